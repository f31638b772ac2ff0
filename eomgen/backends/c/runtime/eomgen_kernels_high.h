/* eomgen_kernels_high.h: the words of kernels of accuracy "high"; included again for every type.
 *
 * Values between arguments and results are twofolds, sums of two doubles (eomgen_twofold.h).
 */
#define real eom_real
#define twofold EOM_NAME(eom_twofold)
#define SET(x) EOM_NAME(eom_set)(x) /* a double in every lane */
#define SPREAD(x) ((twofold){SET((x).hi), SET((x).lo)}) /* the same for a twofold */
#define TWOFOLD(hi, lo) ((twofold){SET(hi), SET(lo)})
#define WIDE(x) ((twofold){(x), SET(0)})
#define ADD11 EOM_NAME(eom_add11)
#define ADD21 EOM_NAME(eom_add21)
#define ADD22 EOM_NAME(eom_add22)
#define MUL11 EOM_NAME(eom_mul11)
#define MUL21 EOM_NAME(eom_mul21)
#define MUL22 EOM_NAME(eom_mul22)
#define DIV22 EOM_NAME(eom_div22)
#define SCALE EOM_NAME(eom_scale)
#define MINUS EOM_NAME(eom_minus)
#define SINCOS EOM_NAME(eom_twofold_sincos)
#define PIVOT_INVERSE EOM_NAME(eom_twofold_pivot_inverse)
