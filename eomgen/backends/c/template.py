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
#include "{header}"
"""

STANDARD_ABOUT = """\
 * Every value between is a `pack` of as many, and EACH statement computes its reals side by side."""
HIGH_ABOUT = """\
 * Values between are twofolds, sums of two doubles (eomgen_twofold.h); the digits of ADD21, ... tell which operands are
 * twofolds (2) and which are doubles (1)."""
FAST_ABOUT = """\
 * Values between are floats (eomgen_single.h): half as many vectors, which EACH statement computes side by side. Angles
 * and their differences are reduced as doubles."""

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
