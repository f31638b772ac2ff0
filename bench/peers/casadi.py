"""CasADi: SX expressions, its generated C compiled with gcc -O3 -march=native and called in a C loop."""

import sys
from pathlib import Path

if __name__ == "__main__":  # not this folder: its files are named like packages
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import numpy as np

from bench.peers import equations, harness, mechanism

LOOP = """
#include "fd.c"
void loop(long batch, const double *q, const double *v, const double *u, double *out,
          casadi_int *iw, double *w)
{{
    const double *arg[{arg}];
    double *res[{res}];
    for (long k = 0; k < batch; k++) {{
        arg[0] = q + k * {n};
        arg[1] = v + k * {n};
        arg[2] = u + k * {n};
        res[0] = out + k * {size};
        fd(arg, res, iw, w, 0);
    }}
}}
"""


def load():
    import casadi

    return casadi


def make(casadi, case):
    n, algorithm = case.q.shape[1], case.options.algorithm
    q, v, u = (casadi.SX.sym(name, n) for name in "qvu")
    parts = [casadi.vertsplit(a) for a in (q, v, u)]
    given = (case.links, case.mechanism, *parts, casadi.sin, casadi.cos)
    if algorithm == "solve":
        M, f, size = equations.dense(*given)
        full = casadi.SX(n, n)
        for i in range(n):
            for j in range(i + 1):
                full[i, j] = full[j, i] = M[i][j]
        order = [size * i + part for part in range(size) for i in range(n // size)]
        acc = casadi.solve(full, casadi.vertcat(*f))[order]
    else:
        acc = casadi.vertcat(*equations.accelerations(*given, algorithm))
    jacobian = case.options.jacobian
    if jacobian:
        acc = casadi.densify(casadi.jacobian(acc, casadi.vertcat(q, v, u))).T  # generated C is column-major
    fd = casadi.Function("fd", [q, v, u], [acc], {"cse": True})
    generator = casadi.CodeGenerator("fd.c")
    generator.add(fd)
    generator.generate(str(case.folder) + "/")
    source = case.folder / "loop.c"
    size = n * 3 * n if jacobian else n
    source.write_text(LOOP.format(arg=fd.sz_arg(), res=fd.sz_res(), n=n, size=size))
    library = harness.compile_c([source], case.folder)
    out = np.empty((len(case.q), size))
    work, iwork = np.empty(fd.sz_w() + 1), np.empty(fd.sz_iw() + 1, np.int64)
    args = [harness.pointer(a) for a in (case.q, case.v, case.u, out, iwork, work)]
    external = casadi.external("fd", str(case.folder / "peer.so"))
    buffer, evaluate = external.buffer()
    views = [a[0].copy() for a in (case.q, case.v, case.u)]
    for i, view in enumerate(views):
        buffer.set_arg(i, memoryview(view))
    answer = np.empty(size)
    buffer.set_res(0, memoryview(answer))

    def single():  # new numbers for bound buffers: the fastest way that its Python interface offers
        for view, array in zip(views, (case.q, case.v, case.u), strict=True):
            view[:] = array[1]
        evaluate()

    plain = harness.per_call(lambda: external(*views))

    def want():
        return mechanism.reference_jacobian(case.q[:500], case.v[:500], case.u[:500], case.mechanism)

    def exact(rows):
        return mechanism.exact_jacobian(case.q[rows], case.v[rows], case.u[rows], case.mechanism)

    return harness.Peer(
        batch=lambda: library.loop(len(case.q), *args),
        result=lambda: out,
        single=single,
        want=want if jacobian else None,
        exact=exact if jacobian else None,
        extra={
            "function": "jacobian" if jacobian else "forward_dynamics",
            "ns_single_call_plain": plain * 1e9,
        },
        keep=(external, buffer, views, answer, library),
        note=f"{algorithm}; {fd.n_instructions()} instructions; single call through Function.buffer",
    )


if __name__ == "__main__":
    harness.main(
        "casadi",
        load,
        make,
        mechanisms=tuple(mechanism.LINKS),
        options=[
            ("--jacobian", {"action": "store_true", "help": "d acceleration / d (q, v, u) instead"}),
            ("--algorithm", {"choices": ("dense", "solve", "recursion"), "default": "dense"}),
        ],
    )
