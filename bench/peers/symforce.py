"""SymForce: its generated C++ (Eigen), compiled with g++ -O3 -march=native and called in a loop."""

import sys
from pathlib import Path

if __name__ == "__main__":  # not this folder: its files are named like packages
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import importlib.util
import logging

import numpy as np

from bench.peers import equations, harness

LOOP = """
#include "forward.h"
extern "C" void loop(long batch, const double *q, const double *v, const double *u, double *out)
{{
    typedef Eigen::Matrix<double, {n}, 1> Vector;
    typedef Eigen::Map<const Vector> View;
    for (long k = 0; k < batch; k++) {{
        const Vector a = View(q + k * {n}), b = View(v + k * {n}), c = View(u + k * {n});
        Eigen::Map<Vector>(out + k * {n}) = sym::Forward<double>(a, b, c);
    }}
}}
"""


def load():
    import symforce

    logging.getLogger("symforce").setLevel(logging.ERROR)
    symforce.set_epsilon_to_number(0.0)
    import symforce.codegen
    import symforce.symbolic

    return symforce


def eigen():
    """Where Eigen's headers are: the system's, or those that CasADi or Pinocchio brought."""
    places = [Path("/usr/include/eigen3"), Path("/usr/local/include/eigen3")]
    for package, inside in (("casadi", "include/eigen3"), ("cmeel", "../cmeel.prefix/include/eigen3")):
        spec = importlib.util.find_spec(package)
        if spec and spec.origin:
            places.append(Path(spec.origin).parent / inside)
    found = [place for place in places if (place / "Eigen" / "Dense").exists()]
    if not found:
        raise ImportError("no Eigen headers for its generated C++")
    return found[0]


def make(symforce, case):
    sf, codegen = symforce.symbolic, symforce.codegen
    n, algorithm = case.links, case.options.algorithm
    vector = getattr(sf, f"V{n}", None) or sf.Matrix

    def forward(q, v, u):
        acc = equations.accelerations(n, "rigid", list(q), list(v), list(u), sf.sin, sf.cos, algorithm)
        return sf.Matrix(n, 1, acc)

    kind = type(sf.Matrix(n, 1, [0] * n)) if vector is sf.Matrix else vector
    function = codegen.Codegen.function(
        forward, config=codegen.CppConfig(), input_types=[kind] * 3, output_names=["acc"], return_key="acc"
    )
    function.generate_function(output_dir=case.folder, skip_directory_nesting=True)
    source = case.folder / "loop.cc"
    source.write_text(LOOP.format(n=n))
    flags = ["-std=c++17", "-I", str(eigen()), "-I", str(case.folder)]
    library = harness.compile_c([source], case.folder, flags, compiler="g++")
    out, answer = np.empty_like(case.q), np.empty(n)
    args = [harness.pointer(a) for a in (case.q, case.v, case.u, out)]
    one = [harness.pointer(a) for a in (case.q, case.v, case.u, answer)]
    return harness.Peer(
        batch=lambda: library.loop(len(case.q), *args),
        result=lambda: out,
        single=lambda: library.loop(1, *one),
        note=f"{algorithm}; single call through ctypes",
    )


if __name__ == "__main__":
    choices = {"choices": ("dense", "recursion"), "default": "dense"}
    harness.main("symforce", load, make, options=[("--algorithm", choices)])
