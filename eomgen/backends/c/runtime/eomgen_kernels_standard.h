/* eomgen_kernels_standard.h: the words of kernels of accuracy "standard"; included again for every type.
 *
 * A `pack` is STREAMS reals, an EACH statement computes them side by side. FMA, SINCOS, ... are those of eomgen_real.h.
 */
#define real eom_real
#define pack EOM_JOIN(EOM_NAME(pack), STREAMS)
#define STREAMS 1
typedef real pack[1];
#undef STREAMS
#define STREAMS EOM_WIDE
#if EOM_WIDE > 1
typedef real pack[EOM_WIDE];
#endif
#define EACH _Pragma("GCC unroll 2") for (int h = 0; h < STREAMS; h++)
#define R(x) ((x) - (real){0}) /* a scalar in every lane; a vector as it is */
#define K(x) ((scalar)x##L) /* a literal, read in the widest type */
#define FMA(a, b, c) eom_fma(R(a), R(b), R(c))
#define FNMA(a, b, c) eom_fnma(R(a), R(b), R(c)) /* c - a b */
#define ANGLE(x) R(x), R(K(0.0)), EOM_ANGLE
#define DIFFERENCE(x, y) R(x), R(y), EOM_DIFFERENCE
#define SINCOS(angle, s, c) STREAMS_SINCOS(angle, s, c)
#undef STREAMS_SINCOS
#if EOM_WIDE > 1
#define STREAMS_SINCOS(x, y, limit, s, c) \
    pack s##_x, s##_y; EACH s##_x[h] = x; EACH s##_y[h] = y; \
    eom_sincos2(s##_x[0], s##_y[0], limit, s##_x[1], s##_y[1], limit, &s[0], &c[0], &s[1], &c[1])
#else
#define STREAMS_SINCOS(x, y, limit, s, c) EACH eom_sincos(x, y, limit, &s[h], &c[h])
#endif
#define SINCOS2(angle, angle2, s, c, s2, c2) EACH eom_sincos2(angle, angle2, &s[h], &c[h], &s2[h], &c2[h])
#define SINCOS_CALL(angle, s, c) EACH eom_sincos_call(angle, &s[h], &c[h])
#define PIVOT_INVERSE(pivot, reference) eom_pivot_inverse(R(pivot), R(reference))
#define SQRT(x) eom_sqrt(R(x))
#define EXP(x) eom_exp(R(x))
#define LOG(x) eom_log(R(x))
