"""PyDy: Kane's method in SymPy, its Cython generator, one call from Python per state."""

import sys
from pathlib import Path

if __name__ == "__main__":  # not this folder: its files are named like packages
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import numpy as np

from bench.peers import harness, mechanism

STATES = 2000


def load():
    import pydy.codegen.ode_function_generators as generators
    import sympy
    import sympy.physics.mechanics as mechanics

    return generators, sympy, mechanics


def make(tool, case):
    generators, sympy, me = tool
    n = case.links
    q, v, u = (me.dynamicsymbols(f"{name}:{n}") for name in "qvu")
    ground, point = me.ReferenceFrame("N"), me.Point("O")
    point.set_vel(ground, 0)
    gravity = sympy.Symbol("g")  # its Cython generator needs at least one constant
    bodies, loads, frames = [], [], []
    for i in range(n):
        frame = ground.orientnew(f"A{i}", "Axis", [q[i], ground.z])
        frame.set_ang_vel(ground, v[i] * ground.z)
        centre, end = point.locatenew(f"C{i}", frame.x / 2), point.locatenew(f"P{i}", frame.x)
        centre.v2pt_theory(point, ground, frame)
        end.v2pt_theory(point, ground, frame)
        inertia = me.inertia(frame, 0, 0, 1 / 12.0)
        bodies.append(me.RigidBody(f"B{i}", centre, frame, 1.0, (inertia, centre)))
        loads += [(centre, -gravity * ground.y), (frame, u[i] * ground.z)]
        if i:
            loads.append((frames[-1], -u[i] * ground.z))
        frames.append(frame)
        point = end
    kane = me.KanesMethod(ground, q, v, [v[i] - q[i].diff(me.dynamicsymbols._t) for i in range(n)])
    kane.kanes_equations(bodies, loads)
    rhs = generators.generate_ode_function(
        kane.forcing,
        q,
        v,
        [gravity],
        mass_matrix=kane.mass_matrix,
        coordinate_derivatives=sympy.Matrix(v),  # the speeds are the angles' rates
        specifieds=u,
        generator="cython",
        tmp_dir=str(case.folder),
        linear_sys_solver=case.options.solver,
    )
    count = min(STATES, len(case.q))
    x = np.hstack([case.q, case.v])[:count]
    out, p = np.empty((count, 2 * n)), np.array([mechanism.GRAVITY])

    def batch():
        for k in range(count):
            out[k] = rhs(x[k], 0.0, case.u[k], p)

    return harness.Peer(
        batch=batch,
        result=lambda: out[:, n:],
        single=lambda: rhs(x[0], 0.0, case.u[0], p),
        states=count,
        note=f"Python loop over {count} states; linear solver {case.options.solver}",
    )


if __name__ == "__main__":
    harness.main("pydy", load, make, options=[("--solver", {"default": "sympy:LU"})])
