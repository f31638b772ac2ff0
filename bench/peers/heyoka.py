"""heyoka: expressions compiled by LLVM to a compiled function that takes batches in SIMD lanes."""

import sys
from pathlib import Path

if __name__ == "__main__":  # not this folder: its files are named like packages
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import numpy as np

from bench.peers import equations, harness, mechanism


def load():
    import heyoka

    return heyoka


def make(heyoka, case):
    n = case.q.shape[1]
    q, v, u = ([heyoka.make_vars(f"{name}{i}") for i in range(n)] for name in "qvu")
    given = (case.links, case.mechanism, q, v, u, heyoka.sin, heyoka.cos)
    acc = equations.accelerations(*given, case.options.algorithm)
    acc = [heyoka.expression(a) if isinstance(a, float) else a for a in acc]
    function = heyoka.cfunc(acc, vars=q + v + u, force_avx512=case.options.avx512)
    inputs = np.ascontiguousarray(np.hstack([case.q, case.v, case.u]).T)
    outputs = np.empty((n, len(case.q)))
    one, answer = inputs[:, 0].copy(), np.empty(n)
    return harness.Peer(
        batch=lambda: function(inputs, outputs=outputs),
        result=lambda: outputs.T,
        single=lambda: function(one, outputs=answer),
        note=f"{case.options.algorithm}; arrays batch-contiguous"
        + ("; 512-bit vectors forced" if case.options.avx512 else ""),
    )


if __name__ == "__main__":
    harness.main(
        "heyoka",
        load,
        make,
        mechanisms=tuple(mechanism.LINKS),
        options=[
            ("--algorithm", {"choices": ("dense", "recursion"), "default": "dense"}),
            ("--avx512", {"action": "store_true", "help": "force 512-bit vectors"}),
        ],
    )
