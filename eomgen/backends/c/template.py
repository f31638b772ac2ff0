"""Frames of the emitted C; they hold only what never varies."""

KERNELS_HEAD = """\
/* {title}
 *
 * The equations, as one text for every type: {name}.c includes it once for each. `real` is a scalar or a vector of
 * lanes (a lane is a state), `scalar` its element; FMA, SINCOS, ... are those of eomgen_real.h. Every value is a
 * `pack` of STREAMS reals that EACH statement computes side by side.
 *
{legend}
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
#define R(x) ((x) - (real){{0}}) /* a scalar in every lane; a vector as it is */
#define K(x) ((scalar)x##L) /* a literal, read in the widest type */
#define FMA(a, b, c) eom_fma(R(a), R(b), R(c))
#define SINCOS(x, s, c) eom_sincos(R(x), s, c)
#define SINCOS_CALL(x, s, c) eom_sincos_call(R(x), s, c)
#define PIVOT_INVERSE(pivot, reference) eom_pivot_inverse(R(pivot), R(reference))
#define SQRT(x) eom_sqrt(R(x))
#define EXP(x) eom_exp(R(x))
#define LOG(x) eom_log(R(x))
"""

SECTION = """\
/* ---- {name} ----
 * {doc}
 * {signature}
 */
#undef STREAMS
#define STREAMS {streams}"""

PARAMETERS = "const pack *const *in, const scalar *p, const scalar *c, pack *restrict out, pack *restrict work"
CONSTANTS_PARAMETERS = "const scalar *p, scalar *restrict c"

FUNCTION = """\
static void EOM_NAME({name})({parameters})
{{
{body}
}}
"""

PART = """\
static __attribute__((noinline)) void EOM_NAME({name})({parameters})
{{
{body}
}}
"""

COLUMNS_HEAD = """\
for (int j = 0; j < {n}; j++) {{
    for (int i = 0; i < {n}; i++) EACH a[i][h] = R((scalar)(i == j));"""

COLUMNS_TAIL = """\
    for (int i = 0; i < {n}; i++) EACH out[i * {n} + j][h] = column[i][h];
}}"""

INCLUDE = """\
#define EOM_REAL {real}
#define scalar eom_{scalar}
#define EOM_SCALAR_TEXT {text}
#include "{name}_kernels.h"
#undef real
#undef pack
#undef EACH
#undef scalar
#undef R
#undef K
#undef FMA
#undef SINCOS
#undef SINCOS_CALL
#undef STREAMS
#undef PIVOT_INVERSE
#undef SQRT
#undef EXP
#undef LOG
#undef EOM_SCALAR_TEXT
#undef EOM_REAL
"""

TABLE = """\
/* {title}
 *
 * The kernels of every type, the table through which eomgen_batch.c finds them, and the functions of {name}.h.
 */
#include "{name}.h"

#include "eomgen_model.h"
#include "eomgen_real.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wpsabi"

{includes}
{shapes}

#define EOM_CAST(kernel) ((void (*)(void))(kernel))

const eom_function eom_functions[] = {{
{entries}
}};
const int eom_function_count = sizeof eom_functions / sizeof eom_functions[0];

const double {name}_p[{size}] = {{
{values}
}};

{interfaces}"""

ENTRY = """\
    {{"{name}", "{signature}",
     "{doc}",
     {rollout},
     {inputs}, {parameters}, {name}_rows, {name}_columns, {constants}, {work}, {wide},
     {kernels}}},"""

DOC = "{name}({arguments})\\n\\n{doc}."

INTERFACE = """\
{prototype}
{{
    const pack_f641 *in[] = {{{inputs}}};
    double c[{constants}], work[{work}];
{loads}
    {name}_f64(in, {parameters}, c, (pack_f641 *)out, (pack_f641 *)work);
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
 * Plain C interface; link {name}.c and eomgen_batch.c (compile with -O2 -ffp-contract=off, no -ffast-math).
 * Arrays are row-major and must not overlap the result. The _batch functions run over `states` rows of every
 * argument but p, in vector lanes.
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
