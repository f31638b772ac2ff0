/* eomgen_kernels_fast.h: the words of kernels of accuracy "fast"; included again for every type.
 *
 * Values between arguments and results are floats (eomgen_single.h), half as many vectors as of doubles.
 */
#define real eom_real
#define single EOM_NAME(eom_single)
#define floats EOM_JOIN(EOM_NAME(floats), STREAMS)
#define STREAMS 1
typedef single floats[1];
#undef STREAMS
#define STREAMS EOM_WIDE
#if EOM_WIDE > 1
typedef single floats[1];
#undef STREAMS
#define STREAMS EOM_WIDER
typedef single floats[EOM_WIDER / 2];
#endif
#define EACH _Pragma("GCC unroll 2") for (int h = 0; h < (STREAMS + 1) / 2; h++)
#define R(x) ((x) - (single){0}) /* a scalar in every lane; a vector as it is */
#define K(x) ((float)x##L) /* a literal, read in the widest type */
#define NARROW(x) EOM_NAME(eom_narrow)((x) + 2 * h)
#define NARROW_DIFFERENCE(x, y) EOM_NAME(eom_narrow_difference)((x) + 2 * h, (y) + 2 * h)
#define WIDEN(x, a) EOM_NAME(eom_widen)((x) + 2 * h, a)
#define FMA(a, b, c) EOM_NAME(eom_single_fma)(R(a), R(b), R(c))
#define FNMA(a, b, c) EOM_NAME(eom_single_fnma)(R(a), R(b), R(c)) /* c - a b */
#define SINCOS(x, s, c) EOM_NAME(eom_single_sincos)(R(x), s, c)
#define SINCOS_ANGLE(x, s, c) EOM_NAME(eom_sincos_angle)((x) + 2 * h, s, c)
#define SINCOS_DIFFERENCE(x, y, s, c) EOM_NAME(eom_sincos_difference)((x) + 2 * h, (y) + 2 * h, s, c)
#define PIVOT_INVERSE(pivot, reference) EOM_NAME(eom_single_pivot_inverse)(R(pivot), R(reference))
#define SQRT(x) EOM_NAME(eom_single_sqrt)(R(x))
#define EXP(x) EOM_NAME(eom_single_exp)(R(x))
#define LOG(x) EOM_NAME(eom_single_log)(R(x))
