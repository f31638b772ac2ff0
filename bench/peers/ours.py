"""eomgen: a chain compiled by the method and back end that the options name, called as its users call it."""

import sys
from pathlib import Path

if __name__ == "__main__":  # not this folder: its files are named like packages
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import ctypes
import os
import subprocess
from functools import partial

import numpy as np

from bench.peers import harness, mechanism

STEPS, INTERVALS, DT = 1000, 10, 1e-3  # a rollout, and the intervals of constant inputs it is divided into

# One state after another: the kernel of one state from the model's table, what depends on p only computed before.
LOOP = """
#include "eomgen_model.h"
#include "{name}.h"

typedef void first(const double *, double *);
typedef void one(const double *const *, const eom_place *, const double *, const double *, double *, void *);

void loop(long states, const double *q, const double *v, const double *u, const double *p, double *out)
{{
    const eom_function *f = &eom_functions[0];
    one *kernel = (one *)f->f64.one;
    double c[f->constants + 1], work[f->work + 1];
    if (f->f64.constants)
        ((first *)f->f64.constants)(p, c);
    for (long k = 0; k < states; k++) {{
        const double *in[] = {{q + k * {n}, v + k * {n}, u + k * {n}}};
        kernel(in, 0, p, c, out + k * {size}, work);
    }}
}}

/* The same through the plain C interface, which computes what depends on p for every state. */
void loop_interface(long states, const double *q, const double *v, const double *u, const double *p, double *out)
{{
    for (long k = 0; k < states; k++)
        {name}_{function}(q + k * {n}, v + k * {n}, u + k * {n}, p, out + k * {size});
}}
"""


def load():
    import eomgen

    return eomgen


def make(eomgen, case):
    options = case.options
    scene = eomgen.chain(case.links, model=case.mechanism)
    module = eomgen.compile(scene, options.method, options.backend, functions=[options.function], solver=options.solver)
    counts = module.info["operations"][options.function]
    facts = {
        "function": options.function,
        "method": options.method,
        "backend": options.backend,
        "operations": counts["state"],
        "build_stages": module.info["seconds"],
    }
    if options.rollout:
        return rollout(module, case, facts)
    function, n = getattr(module, options.function), case.q.shape[1]
    columns = (3 * n,) if options.function == "jacobian" else ()
    order = "F" if options.layout == "batch" else "C"
    arrays, out = [np.array(a) for a in (case.q, case.v, case.u)], np.empty((len(case.q), n, *columns))
    if order == "F":  # as the hand-written code gets them
        *arrays, out = (harness.aligned(a.T).T for a in (*arrays, out))
    state, answer = [a[0].copy() for a in (case.q, case.v, case.u)], np.empty((n, *columns))
    call = partial(function, *arrays, module.p, out=out)
    note = f"arrays {'batch-contiguous' if order == 'F' else 'row-major'}"
    if options.scalar:
        library = compiled_loop(module, case, options.function, int(np.prod([n, *columns])))
        pointers = [harness.pointer(a) for a in (*arrays, np.array(module.p), out)]
        call = partial(library.loop, len(case.q), *pointers)
        interface = min(harness.timed(partial(library.loop_interface, len(case.q), *pointers), options.repeats))
        facts["ns_plain_c_interface"] = interface / len(case.q) * 1e9
        out[...] = np.nan
        note = "one state after another in a C loop, row-major"
    want = {}
    if columns:
        want["want"] = lambda: mechanism.reference_jacobian(case.q[:500], case.v[:500], case.u[:500], case.mechanism)
        want["exact"] = lambda rows: mechanism.exact_jacobian(case.q[rows], case.v[rows], case.u[rows], case.mechanism)
    return harness.Peer(
        batch=call,
        result=lambda: out,
        single=None if options.scalar else lambda: function(*state, module.p, out=answer),
        extra=facts,
        keep=(module, arrays, out),
        note=f"{note}; {sum(counts['state'].values())} operations per state",
        **want,
    )


def compiled_loop(module, case, function, size):
    """The C loop, compiled with the module's own sources and flags."""
    folder = Path(module.__file__).parent / "csrc"
    name = next(folder.glob("*_kernels.h")).name.removesuffix("_kernels.h")
    loop = case.folder / "loop.c"
    loop.write_text(LOOP.format(name=name, function=function, n=case.q.shape[1], size=size))
    sources = [loop, folder / f"{name}.c", folder / "eomgen_batch.c"]
    library = case.folder / "loop.so"
    compiler = (os.environ.get("CC") or "cc").split()
    words = [
        *compiler,
        *module.info["flags"].split(),
        "-fvisibility=default",
        "-shared",
        f"-I{folder}",
        *map(str, sources),
    ]
    subprocess.run([*words, "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def rollout(module, case, facts):
    """Many trajectories with inputs that are constant over intervals; some checked after the first of them."""
    lanes, first, few = len(case.q), STEPS // INTERVALS, slice(0, 4)
    inputs = np.repeat(case.u[:, None], INTERVALS, 1)
    found = [None]

    def batch():
        found[0] = module.rollout(case.q, case.v, inputs, module.p, DT, STEPS)

    def want():
        return mechanism.rollout(mechanism.reference, case.q[few], case.v[few], case.u[few], DT, first)

    def exact(rows):
        one = rows[:1]
        return mechanism.exact_rollout(case.q[one], case.v[one], case.u[one], DT, first)

    return harness.Peer(
        batch=batch,
        result=lambda: np.hstack([a[few, 0] for a in found[0]]),
        want=want,
        exact=exact,
        states=lanes * STEPS,
        extra={**facts, "function": "rollout", "lanes": lanes, "steps": STEPS},
        keep=(module, inputs),
        note=f"ns per state and step of RK4 (4 evaluations); 4 lanes checked after {first} steps",
    )


if __name__ == "__main__":
    harness.main(
        "eomgen",
        load,
        make,
        mechanisms=tuple(mechanism.LINKS),
        options=[
            ("--layout", {"choices": ("row", "batch"), "default": "row"}),
            ("--method", {"default": "matrix"}),
            ("--solver", {"default": "auto"}),
            ("--backend", {"choices": ("c", "numpy"), "default": "c"}),
            ("--function", {"choices": ("forward_dynamics", "jacobian"), "default": "forward_dynamics"}),
            ("--scalar", {"action": "store_true", "help": "one state at a time in a compiled C loop"}),
            ("--rollout", {"action": "store_true", "help": f"{STEPS} steps of RK4 instead"}),
        ],
    )
