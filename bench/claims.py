"""What the paper claims of its models, put into figures: energy, inertia, a mass that meets its joint, gravity's arm.

`eomgen bench claims` prints the tables that `docs/paper.md` explains and writes them to `claims.md` and `claims.json`;
`tests/test_claims.py` holds what they show. The paper: A. V. Borisov, G. M. Rozenblat, Computer Research and Modeling,
2017, 9(2), 201-210.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import eomgen
from bench import report
from bench.cases import line, tree
from eomgen.certify import Balls, import_flint
from eomgen.ir.interpret import evaluate
from eomgen.scene import LINK_TYPES, Scene

Array = NDArray[np.float64]
Record = dict[str, Any]

PACKAGES = ("numpy", "scipy", "python-flint")
EPS = float(np.finfo(float).eps)
RTOL = 1e-13  # of DOP853; below 100 eps SciPy raises it
SPRING = {"stiffness": 900.0, "rest_length": 0.7, "joint_stiffness": 12.0, "joint_rest_angle": 0.2}
JOINT = {key: value for key, value in SPRING.items() if key.startswith("joint")}
MISSES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # m, from the joint


def integrate(model: Any, start: Array, times: Sequence[float], torque: Any = None, **options: Any) -> Any:
    """SciPy's solution by DOP853 with the compiled accelerations.

    Args:
        model: a module.
        start: coordinates, then rates.
        times: where the state is wanted; the last one is the end.
        torque: the inputs at a state, (q, v) -> u; none if not given.
        options: for `solve_ivp`.
    """
    from scipy.integrate import solve_ivp

    n = len(start) // 2
    still = np.zeros(n)

    def rate(_: float, x: Array) -> Array:
        u = still if torque is None else torque(x[:n], x[n:])
        return np.concatenate([x[n:], model.forward_dynamics(x[:n], x[n:], u, model.p)])

    options = {"rtol": RTOL, "atol": RTOL, **options}
    return solve_ivp(rate, (0.0, times[-1]), start, method="DOP853", t_eval=times, **options)


# 1. The energy is an integral of motion


def conservative_scenes() -> dict[str, Scene]:
    """Chains of two links of every model, with free and fixed lengths, and springs in joints and along lengths."""
    found = {}
    for model in LINK_TYPES:
        if model == "rigid":
            found["rigid"] = tree("rigid", line(2), model)
            found["rigid, springs"] = tree("rigid", line(2), model, changes=dict.fromkeys(range(2), JOINT))
            continue
        springs = {k: {**SPRING, "rest_length": 0.7 + 0.1 * k} for k in range(2)}
        found[f"{model}, free lengths, springs"] = tree("free", line(2), model, "free", changes=springs)
        found[f"{model}, fixed lengths"] = tree("fixed", line(2), model, 0.6)
    found["elastic-rod, free lengths, no springs"] = tree("free", line(2), "elastic-rod")
    found["all models, springs"] = tree(
        "models", line(5), tuple(LINK_TYPES), changes={k: JOINT if k == 0 else SPRING for k in range(5)}
    )
    return found


def energy_drift(scene: Scene, rolled: int = 20_000) -> Record:
    """How far the energy moves in a second, over the largest kinetic or potential energy on the way.

    By DOP853 at 50 times, and by the compiled rollout with many steps at the end.
    """
    model = eomgen.compile(scene, functions=["forward_dynamics", "energy"])
    m, n = len(scene.links), len(model.q_names)
    start = np.concatenate(
        [0.4 + 0.5 * np.arange(m), np.full(n - m, 0.75), 0.8 * (-1.0) ** np.arange(m), np.zeros(n - m)]
    )
    found = integrate(model, start, np.linspace(0, 1, 51))
    energies = model.energy(found.y[:n].T, found.y[n:].T, model.p)
    total, size = energies.sum(axis=-1), np.abs(energies).max()
    q, v = model.rollout(start[:n], start[n:], np.zeros((1, n)), model.p, 1 / rolled, steps=rolled)
    last = model.energy(q[0], v[0], model.p).sum()
    evaluations = int(found.nfev)
    return {
        "evaluations": evaluations,
        "dop853": float(np.abs(total - total[0]).max() / size),
        "rollout": float(abs(last - total[0]) / size),
        "exchanged": float(np.ptp(energies[:, 0]) / size),
    }


# 2. The mass matrix is positive definite


def pivots(scene: Scene, q: Mapping[str, float]) -> dict[str, Any]:
    """Balls that hold the pivots of LDLᵀ of the mass matrix by coordinate, eliminated from the last link to the first.

    Args:
        scene: all of its lengths are free or fixed.
        q: the coordinates by name, the binary numbers they are.

    A pivot that is exactly zero ends the elimination.
    """
    flint = import_flint()
    equations = eomgen.derive(scene, "matrix")
    names = [
        name for link in reversed(scene.links) for name in (f"{link.name}.length", f"{link.name}.angle") if name in q
    ]
    place = [scene.q_names.index(name) for name in names]
    with flint.ctx.workprec(2000):
        given = dict(zip(equations.p, map(flint.arb, equations.symbols.p_values), strict=True))
        given |= {symbol: flint.arb(q[name]) for symbol, name in zip(equations.q, scene.q_names, strict=True)}
        flat = iter(evaluate([x for row in equations.mass_matrix for x in row], given, Balls()))
        M = [[next(flat) for _ in equations.q] for _ in equations.q]
        left = [[M[i][j] for j in place] for i in place]
        found = {}
        for k, name in enumerate(names):
            pivot = found[name] = left[k][k]
            if pivot.contains(0):
                break
            for i in range(k + 1, len(names)):
                factor = left[i][k] / pivot
                for j in range(k + 1, len(names)):
                    left[i][j] -= factor * left[k][j]
        return found


def least_inertia(links: int, states: int, seed: int = 1) -> Record:
    """The least pivots of a chain of elastic rods, as parts of their bounds J and m, over random and extreme states.

    A link's own central inertia J bounds the pivot of its angle and its mass m that of its length, whatever hangs on
    it: eliminating the links above leaves something that is not negative on the own bodies' diagonal terms.
    """
    flint = import_flint()
    scene = tree("rods", line(links), "elastic-rod")
    random = np.random.default_rng(seed)
    least = {"angle": math.inf, "length": math.inf}
    for k in range(states):
        folded = 0.7 + np.pi * random.integers(0, 2, links)
        angles = random.uniform(-np.pi, np.pi, links) if k % 3 else folded
        if k % 5 == 0:
            angles *= 10.0 ** random.integers(0, 15)
        half = np.array([-link.rod_length / 2 for link in scene.links])
        sizes = 10.0 ** random.uniform(-12, 6, links) * random.choice([-1, 1], links)
        lengths = [random.uniform(0.4, 1.0, links), half, 2 * half, 0 * half, sizes, half + sizes][k % 6]
        found = pivots(scene, dict(zip(scene.q_names, map(float, (*angles, *lengths)), strict=True)))
        for link in scene.links:
            with flint.ctx.workprec(2000):
                inertia = {p.name: p.value for p in link.parameters}
                mass, rod = flint.arb(inertia["mass"]), flint.arb(inertia["rod_length"])
                for name, bound in (("angle", mass * rod * rod / 12), ("length", mass)):
                    share = found[f"{link.name}.{name}"] / bound
                    least[name] = min(least[name], float(share.lower()))
    return {"links": links, "states": states, **least}


class Singular(NamedTuple):
    """A state in which a mass matrix is not positive definite: the scene, the coordinates, the pivot that vanishes."""

    scene: Scene
    q: dict[str, float]
    coordinate: str


def singular_states() -> dict[str, Singular]:
    """Where the other models fail."""

    def place(scene: Scene, **changed: float) -> dict[str, float]:
        q = {name: 0.3 + 0.4 * k for k, name in enumerate(scene.q_names)}
        return q | {name.replace("_", "."): value for name, value in changed.items()}

    masses = tree("masses", line(3), "point-masses")
    joints = tree("joints", line(3), "joint-masses")
    hung = tree("hung", line(2), "elastic-rod", hanging=(0,))
    thin = tree("thin", line(1), "elastic-rod", changes={0: {"mass": 1.0, "rod_length": 0.5, "inertia": 0.0625}})
    return {
        "1d, the length of a link is zero": Singular(masses, place(masses, link2_length=0.0), "link2.angle"),
        "1c, the length of a link is zero": Singular(joints, place(joints, link1_length=0.0), "link1.angle"),
        "1a, hanging, in line with the next link": Singular(
            hung, place(hung, link1_angle=0.7, link2_angle=0.7), "link1.length"
        ),
        "1a, no central inertia, the centre in the joint": Singular(
            thin, place(thin, link1_length=-0.25), "link1.angle"
        ),
    }


# 3. A mass that is aimed at its joint


def one_mass(gravity: float = 9.81) -> Scene:
    """A point mass on a link without mass of its own: it flies freely."""
    return tree("mass", line(1), "point-masses", gravity=gravity, changes={0: {"masses": (1.0,), "fractions": (1.0,)}})


def polar(x: float, y: float, vx: float, vy: float) -> Array:
    """Angle, length and their rates of a place and a velocity."""
    length = math.hypot(x, y)
    return np.array([math.atan2(y, x), length, (x * vy - y * vx) / length**2, (x * vx + y * vy) / length])


def near_miss(aim: float, gravity: float = 9.81) -> Record:
    """A mass thrown past its joint, `aim` metres above it, against the parabola (or line) it must fly on.

    Returns:
        The spin at the time of the least distance and that of the closed form (the angular momentum over the squared
        distance), the largest distance from the curve, and the change of s² φ̇² + ṡ² + 2 g y.
    """
    scene = one_mass(gravity)
    model = eomgen.compile(scene, functions=["forward_dynamics", "joints"])
    x, y, vx, vy = -1.0, aim, 2.0, gravity / 4  # above the joint at t = 1/2, at the same height as at first
    start = polar(x, y, vx, vy)
    # The time of the least distance: the root of x·v, by Newton's method in the closed form.
    t = 0.5
    for _ in range(50):
        px, py, wy = x + vx * t, y + vy * t - gravity * t * t / 2, vy - gravity * t
        t -= (px * vx + py * wy) / (vx * vx + wy * wy - gravity * py)
    nearest = math.hypot(px, py)
    spin = (px * wy - py * vx) / nearest**2
    times = np.unique([*np.linspace(0, 1, 41), t])
    found = integrate(model, start, times, atol=1e-16)
    ends = model.joints(found.y[:2].T, model.p)[:, 0]
    curve = np.stack([x + vx * times, y + vy * times - gravity * times**2 / 2], axis=-1)
    angle, length, turning, along = found.y
    bounded = (length * turning) ** 2 + along**2 + 2 * gravity * length * np.sin(angle)
    return {
        "aim": aim,
        "nearest": nearest,
        "evaluations": int(found.nfev),
        "spin": float(abs(turning[np.searchsorted(times, t)])),
        "closed_form": abs(spin),
        "off_curve": float(np.abs(ends - curve).max()),
        "bounded": float(np.ptp(bounded) / np.abs(bounded).max()),
    }


def direct_hit(gravity: float = 0.0, speed: float = 2.0) -> Record:
    """A mass one metre from the joint and thrown at it: when its length is zero, beside 1 m = v t + g t²/2.

    The link stands upright, above its joint.
    """
    model = eomgen.compile(one_mass(gravity), functions=["forward_dynamics"])

    def reached(_: float, x: Array) -> float:
        return float(x[1]) - 1e-9

    reached.terminal = True  # type: ignore[attr-defined]
    found = integrate(
        model, np.array([math.pi / 2, 1.0, 0.0, -speed]), [2.0], events=reached, first_step=1e-3, max_step=1e-2
    )
    time = (math.sqrt(speed**2 + 2 * gravity) - speed) / gravity if gravity else 1 / speed
    with np.errstate(invalid="ignore"):
        there = model.forward_dynamics(np.array([math.pi / 2, 0.0]), np.array([0.0, -speed]), np.zeros(2), model.p)
    return {
        "gravity": gravity,
        "time": float(found.t_events[0][0]) if len(found.t_events[0]) else math.nan,
        "closed_form": time,
        "accelerations_there": [float(x) for x in there],
    }


# 4. The arm of gravity in equation (1)


def gravity_arms() -> list[Record]:
    """The drift of the energy of one elastic rod in a second, as equation (1) prints gravity's arm and as it is.

    The printed arm l + ξ/2 instead of ξ + l/2 is a torque more. Beside the energy with the centre of the rod stands
    that with the printed arm, as equation (10) has it.
    """
    scene = tree("rod", line(1), "elastic-rod", changes={0: {"mass": 1.0, "rod_length": 0.5}})
    model = eomgen.compile(scene, functions=["forward_dynamics", "energy"])
    g, rod = scene.gravity, 0.5

    def excess(q: Array) -> Any:
        return g * ((rod + q[1] / 2) - (q[1] + rod / 2))  # what the printed arm adds to g m (arm); m = 1

    def printed(q: Array, _: Array) -> Array:
        return np.array([-excess(q) * math.cos(q[0]), 0.0])

    start, times = np.array([0.4, 0.3, 1.0, 0.5]), np.linspace(0, 1, 51)
    records = []
    for arm, torque in (("printed, l + ξ/2", printed), ("corrected, ξ + l/2", None)):
        found = integrate(model, start, times, torque)
        q, v = found.y[:2], found.y[2:]
        parts = model.energy(q.T, v.T, model.p)
        size = np.abs(parts).max()
        energy = parts.sum(axis=-1)
        as_printed = energy + excess(q) * np.sin(q[0])
        records.append(
            {"arm": arm, "energy": float(np.ptp(energy) / size), "printed_energy": float(np.ptp(as_printed) / size)}
        )
    return records


# The report


def measure() -> dict[str, Any]:
    """Everything that goes into `claims.json`."""
    facts = report.machine(PACKAGES)
    records = [
        {"claim": "energy", "scene": name, **energy_drift(scene)} for name, scene in conservative_scenes().items()
    ]
    records += [{"claim": "inertia", **least_inertia(links, 300)} for links in (1, 2, 3, 5)]
    for name, (scene, q, coordinate) in singular_states().items():
        pivot = pivots(scene, q)[coordinate]
        records.append(
            {"claim": "singular", "state": name, "coordinate": coordinate, "at_most": float(abs(pivot).upper())}
        )
    records += [{"claim": "miss", "gravity": g, **near_miss(aim, g)} for g in (0.0, 9.81) for aim in MISSES]
    records += [{"claim": "hit", **direct_hit(g)} for g in (0.0, 9.81)]
    records += [{"claim": "gravity", **record} for record in gravity_arms()]
    return {"suite": "claims", "machine": facts, "records": records}


def render(found: Mapping[str, Any]) -> str:
    """`claims.md`."""

    def table(claim: str, columns: Mapping[str, str]) -> str:
        rows = [[_cell(r[key]) for key in columns] for r in found["records"] if r["claim"] == claim]
        return report.markdown(list(columns.values()), rows)

    parts = [
        "# The paper's claims",
        "Written by `eomgen bench claims`; `docs/paper.md` explains it.",
        report.describe_machine(found["machine"]),
        "## Energy",
        "Largest change of the energy in a second, over the largest kinetic or potential energy.",
        table("energy", {"scene": "scene", "evaluations": "evaluations", "dop853": "DOP853, rtol 1e-13",
                         "rollout": "rollout, 20 000 steps", "exchanged": "change of the kinetic energy"}),
        "## Inertia of model 1a",
        "Least pivot of certified eliminations, as a part of its bound: J for an angle, m for a length.",
        table("inertia", {"links": "links", "states": "states", "angle": "angle over J", "length": "length over m"}),
        "## Singular states",
        table("singular", {"state": "model and state", "coordinate": "pivot", "at_most": "its size (0: below 1e-300)"}),
        "## Aimed past the joint",
        table("miss", {"aim": "aim, m", "gravity": "gravity", "nearest": "nearest, m", "spin": "spin, rad/s",
                       "closed_form": "closed form", "off_curve": "off the curve, m", "bounded": "change of the bound",
                       "evaluations": "evaluations"}),
        "## Aimed at the joint",
        table("hit", {"gravity": "gravity", "time": "time of length 1e-9 m, s",
                      "closed_form": "closed form of length 0, s", "accelerations_there": "accelerations at length 0"}),
        "## Gravity's arm in equation (1)",
        "Drift of the energy with the arm of the rod's centre, and with the printed arm.",
        table("gravity", {"arm": "arm", "energy": "drift, centre's arm", "printed_energy": "drift, printed arm"}),
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def _cell(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(_cell, value))
    if not isinstance(value, float):
        return str(value)
    return f"{value:.10g}" if 1e-3 < abs(value) < 1e7 else f"{value:.2g}"


def main() -> int:
    """Runs the suite."""
    parser = report.Parser(
        prog="eomgen bench claims",
        description="Puts the paper's claims into figures; writes claims.json and claims.md.",
    )
    report.add_out(parser)
    options = parser.parse_args()
    for package in ("scipy", "flint"):
        report.require(package, "claims", "bench")
    place = report.folder(options.out)
    found = measure()
    report.write(place / "claims.json", report.dumped(found))
    text = render(found)
    report.write(place / "claims.md", text)
    print(text + f"\nwrote {place / 'claims.md'} and claims.json")
    return 0


if __name__ == "__main__":
    raise SystemExit(report.command(main))
