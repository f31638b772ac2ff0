"""Frames of the emitted C; they hold only what never varies."""

KERNELS_HEAD = """\
/* {title}
 *
 * The equations, as one text for every type: {name}.c includes it once for each. `real` is a scalar or a vector of
 * lanes (a lane is a state), `scalar` its element. EOM_AT(q, i) is STREAMS reals: element i of an argument or result.
{about}
 *
{legend}
 */
#define real eom_real
{macros}"""

STANDARD_ABOUT = """\
 * Every value between is a `pack` of as many, and EACH statement computes its reals side by side; FMA, SINCOS, ... are
 * those of eomgen_real.h."""
STANDARD_MACROS = """\
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
#define STREAMS_SINCOS(x, y, limit, s, c) \\
    pack s##_x, s##_y; EACH s##_x[h] = x; EACH s##_y[h] = y; \\
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
"""

HIGH_ABOUT = """\
 * Values between are twofolds, sums of two doubles (eomgen_twofold.h); the digits of ADD21, ... tell which operands are
 * twofolds (2) and which are doubles (1)."""
HIGH_MACROS = """\
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
"""

FAST_ABOUT = """\
 * Values between are floats (eomgen_single.h): half as many vectors, which EACH statement computes side by side. Angles
 * and their differences are reduced as doubles."""
FAST_MACROS = """\
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
"""

SECTION = """\
/* ---- {name} ----
 * {doc}
 * {signature}
 */
#undef STREAMS
#define STREAMS {streams}"""

PARAMETERS = (
    "const scalar *const *in, const eom_place *places, const scalar *p, const {still} *c, scalar *restrict out, "
    "{value} *restrict work"
)
CONSTANTS_PARAMETERS = "const scalar *p, {still} *restrict c"

APART, TOGETHER = "static EOM_APART", "EOM_INLINE"
FUNCTION = """\
EOM_LINKAGE void EOM_NAME({name})({parameters})
{{
{body}
}}
"""

PART = """\
{apart} void EOM_NAME({name})({parameters})
{{
{body}
}}
"""

INCLUDE = """\
#if EOM_PART != {other}
#define EOM_REAL {real}
#define scalar eom_{scalar}
#define EOM_SCALAR_TEXT {text}
#include "{name}_kernels.h"
#undef scalar
#undef STREAMS
#undef EOM_SCALAR_TEXT
#undef EOM_REAL
#endif
"""

TABLE = """\
/* {title}
 *
 * The kernels of every type, the table through which eomgen_batch.c finds them, and the functions of {name}.h.
 */
#include "{name}.h"

#include "eomgen_model.h"
#include "{runtime}"

#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wpsabi"

#ifndef EOM_PART
#define EOM_PART 0 /* everything; 1: the scalars, the table and the functions, 2: the vectors, to be linked with 1 */
#endif
#if EOM_PART == 2
#define EOM_LINKAGE EOM_APART
#else
#define EOM_LINKAGE static EOM_APART
#endif

{includes}
#if EOM_PART == 1
{vectors}
#endif
#if EOM_PART != 2
{shapes}

#define EOM_CAST(kernel) ((void (*)(void))(kernel))

const eom_function eom_functions[] = {{
{entries}
}};
const int eom_function_count = sizeof eom_functions / sizeof eom_functions[0];

const double {name}_p[{size}] = {{
{values}
}};

{interfaces}
#endif
"""

ENTRY = """\
    {{"{name}", "{signature}",
     "{doc}",
     {rollout},
     {inputs}, {parameters}, {name}_rows, {name}_columns, {constants}, {work}, {streams},
     {kernels}}},"""

INTERFACE = """\
{prototype}
{{
    const double *in[] = {{{inputs}}};
    double c[{constants}]{unused}, work[{work}];
{loads}
    {name}_f64(in, 0, {parameters}, (void *)c, out, (void *)work);
}}

{batch}
{{
    char *args[] = {{{arguments}}};
    const intptr_t dimensions[] = {{(intptr_t)states}}, steps[] = {{{steps}}};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[{index}]);
}}
"""

HEADER = """\
/* {title}
 *
 * Plain C interface, for C11 or later; link {name}.c and eomgen_batch.c (compile with -O2 -ffp-contract=off, no
 * -ffast-math). Arrays are row-major and must not overlap the result. The _batch functions run over `states` rows of
 * every argument but p, in vector lanes.
 *
{legend}
 */
#ifndef {guard}
#define {guard}

#include <stddef.h>

#ifdef __cplusplus
extern "C" {{
#endif

/* The scene's own parameters. */
extern const double {name}_p[{size}];

{prototypes}

#ifdef __cplusplus
}}
#endif

#endif
"""
