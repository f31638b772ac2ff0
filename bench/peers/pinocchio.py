"""Pinocchio: its articulated-body algorithm on a model built joint by joint."""

import sys
from pathlib import Path

if __name__ == "__main__":  # not this folder: its files are named like packages
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import numpy as np

from bench.peers import harness, mechanism


def load():
    import pinocchio

    return pinocchio


def make(pinocchio, case):
    model = pinocchio.Model()
    model.gravity.linear = np.array([0.0, -mechanism.GRAVITY, 0.0])
    joint = 0
    for i in range(case.links):
        place = pinocchio.SE3(np.eye(3), np.array([1.0 if i else 0.0, 0.0, 0.0]))
        joint = model.addJoint(joint, pinocchio.JointModelRZ(), place, f"joint{i}")
        body = pinocchio.Inertia(1.0, np.array([0.5, 0.0, 0.0]), np.diag([1e-3, 1 / 12, 1 / 12]))
        model.appendBodyToJoint(joint, body, pinocchio.SE3.Identity())
    q, v = mechanism.relative(case.q, case.v)
    columns = [np.asfortranarray(a.T) for a in (q, v, case.u)]
    data = model.createData()
    state = [a[0].copy() for a in (q, v, case.u)]
    out = np.zeros((case.links, len(q)), order="F")
    parallel = getattr(pinocchio, "abaInParallel", None)
    if parallel:
        pool = pinocchio.ModelPool(model, 1)

        def batch():
            parallel(1, pool, *columns, out)

        note = "abaInParallel with one thread"
    else:

        def batch():
            for k in range(len(q)):
                out[:, k] = pinocchio.aba(model, data, q[k], v[k], case.u[k])

        note = "Python loop over aba"
    return harness.Peer(
        batch=batch,
        result=lambda: np.cumsum(out.T, 1),
        single=lambda: pinocchio.aba(model, data, *state),
        note=f"{note}; relative angles inside, compared as absolute ones",
    )


if __name__ == "__main__":
    harness.main("pinocchio", load, make, package="pin")
