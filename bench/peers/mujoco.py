"""MuJoCo: forward dynamics of its batch, or its rollout, contacts and constraints off."""

import ctypes
import sys
from pathlib import Path

if __name__ == "__main__":  # not this folder: its files are named like packages
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import numpy as np

from bench.peers import harness, mechanism

STEPS, DT, LANES, CHECKED = 1000, 1e-3, 100, 100
LINK = """<body pos="{x} 0 0"><joint name="joint{i}" type="hinge" axis="0 0 1"/>
<inertial pos="0.5 0 0" mass="1" diaginertia="0.001 0.08333333333333333 0.08333333333333333"/>"""

LOOP = """
#include <mujoco/mujoco.h>
#include <string.h>
void loop(const mjModel *m, mjData *d, long batch, const double *q, const double *v, const double *u,
          double *out)
{{
    for (long k = 0; k < batch; k++) {{
        memcpy(d->qpos, q + k * {n}, {n} * sizeof(double));
        memcpy(d->qvel, v + k * {n}, {n} * sizeof(double));
        memcpy(d->qfrc_applied, u + k * {n}, {n} * sizeof(double));
        mj_forward(m, d);
        memcpy(out + k * {n}, d->qacc, {n} * sizeof(double));
    }}
}}
"""


def load():
    import mujoco
    import mujoco.rollout

    return mujoco


def make(mujoco, case):
    rollout = case.options.rollout
    bodies = "".join(LINK.format(x=int(i > 0), i=i) for i in range(case.links)) + "</body>" * case.links
    motors = "".join(f'<motor joint="joint{i}"/>' for i in range(case.links)) if rollout else ""
    options = f'gravity="0 {-mechanism.GRAVITY} 0" timestep="{DT}" integrator="{case.options.integrator}"'
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option {options}><flag contact="disable" constraint="disable"/></option>
        <worldbody>{bodies}</worldbody><actuator>{motors}</actuator></mujoco>"""
    )
    data = mujoco.MjData(model)
    q, v = mechanism.relative(case.q, case.v)

    def single():
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q[0], v[0], case.u[0]
        mujoco.mj_forward(model, data)

    if rollout:
        return make_rollout(mujoco, case, model, data, q, v)
    acc = np.empty_like(q)
    include = Path(mujoco.__file__).parent / "include"
    engine = sorted(Path(mujoco.__file__).parent.glob("libmujoco*"))
    if case.options.api == "batch":
        from mujoco.batch import Batch

        many = Batch(model, len(q), 1)
        many.bind("qpos")[:], many.bind("qvel")[:], many.bind("qfrc_applied")[:] = q, v, case.u
        acc, batch, note = many.bind("qacc"), many.forward, "mujoco.batch.Batch.forward with one thread"
    elif (include / "mujoco" / "mujoco.h").exists() and engine:
        source = case.folder / "loop.c"
        source.write_text(LOOP.format(n=case.links))
        library = harness.compile_c([source, engine[0]], case.folder, ["-I", str(include)])
        args = [harness.pointer(a) for a in (q, v, case.u, acc)]
        addresses = [ctypes.c_void_p(x._address) for x in (model, data)]

        def batch():
            library.loop(*addresses, len(q), *args)

        note = "C loop over mj_forward"
    else:

        def batch():
            for k in range(len(q)):
                data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q[k], v[k], case.u[k]
                mujoco.mj_forward(model, data)
                acc[k] = data.qacc

        note = "Python loop over mj_forward"
    return harness.Peer(
        batch=batch,
        result=lambda: np.cumsum(acc, 1),
        single=single,
        note=f"{note}; relative angles inside, compared as absolute ones",
    )


def make_rollout(mujoco, case, model, data, q, v):
    lanes = min(LANES, len(q))
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    start = np.hstack([np.zeros((lanes, 1)), q[:lanes], v[:lanes]])
    assert start.shape[1] == size
    control = np.repeat(case.u[:lanes, None], STEPS, 1)
    states = np.empty((lanes, STEPS, size))
    sensors = np.empty((lanes, STEPS, model.nsensordata))
    steps = CHECKED if case.options.integrator == "RK4" else 1

    def batch():
        mujoco.rollout.rollout(model, [data], start, control, nstep=STEPS, state=states, sensordata=sensors)

    def result():
        n = case.links
        after = states[:4, steps - 1]
        return np.hstack([np.cumsum(after[:, 1 : n + 1], 1), np.cumsum(after[:, n + 1 :], 1)])

    def want():
        q, v, u = case.q[:4], case.v[:4], case.u[:4]
        if case.options.integrator != "RK4":  # semi-implicit Euler
            v = v + DT * mechanism.reference(q, v, u)
            return np.hstack([q + DT * v, v])
        return mechanism.rollout(mechanism.reference, q, v, u, DT, steps)

    def exact(rows):
        one = rows[:1]
        return mechanism.exact_rollout(case.q[one], case.v[one], case.u[one], DT, steps)

    return harness.Peer(
        batch=batch,
        result=result,
        want=want,
        exact=exact if case.options.integrator == "RK4" else None,
        states=lanes * STEPS,
        extra={"function": "rollout", "integrator": case.options.integrator, "lanes": lanes, "steps": STEPS},
        note=f"ns per state and step; 4 lanes checked after {steps} steps",
    )


if __name__ == "__main__":
    harness.main(
        "mujoco",
        load,
        make,
        options=[
            ("--rollout", {"action": "store_true", "help": f"{STEPS} steps instead"}),
            ("--api", {"choices": ("c", "batch"), "default": "c"}),
            ("--integrator", {"choices": ("RK4", "Euler"), "default": "RK4"}),
        ],
    )
