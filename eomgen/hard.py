"""Hard cases: scenes and states at which equations of motion lose digits, by name.

Cases whose scenes have the same name differ in numbers only: one compiled module serves them all, with the p of each.
How hard a case is, `eomgen.certify.Exact.condition` computes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from eomgen.catalog import chain, walker
from eomgen.scene import ElasticRod, JointMasses, PointMasses, Rigid, Scene

State = dict[str, np.ndarray[Any, Any]]
SEED = 20170901

# Why the states of `hard_states` are hard.
REASONS = {
    "random": "nothing: what is lost at an ordinary state",
    "aligned": "all angles are equal: sines of their differences, products of large numbers, must cancel to zero",
    "nearly aligned": "angles 1e-8 rad apart: the differences have half of their digits",
    "folded": "neighbours point in opposite directions: the differences are near a multiple of π",
    "nearly folded": "neighbours are π - 1e-8 rad apart",
    "fast": "spins of 1e4 rad/s: centrifugal terms of 1e8 beside gravity",
    "fast and nearly aligned": "centrifugal terms of 1e8 times sines of 1e-8",
    "angles of 1e6": "reducing an angle to its quadrant takes more digits than the angle has",
    "angles of 1e15": "the angle's last digit is an eighth of a radian",
    "angles of all sizes": "differences of angles do not fit a float: only their sines and cosines can be combined",
}


@dataclass(frozen=True, eq=False)
class Case:
    """A scene in a state that makes its equations hard to evaluate.

    Attributes:
        name: its name, unique in the catalogue.
        scene: the scene, with the numbers of this case.
        state: the arrays q, v, u, a (n each) and w (k, 3), SI units.
        why: what is hard about it.
    """

    name: str
    scene: Scene
    state: State
    why: str

    @property
    def values(self) -> State:
        """The state and the scene's parameters p: every argument a function can ask for."""
        return {**self.state, "p": np.array([parameter.value for parameter in self.scene.parameters])}


def random_state(scene: Scene, seed: int = SEED) -> State:
    """Angles all around, lengths of 0.5 to 1.5 m, rates, inputs and accelerations of order one."""
    m, free, k = len(scene.links), len(scene.free), len(scene.prescribed)
    n = m + free
    rng = np.random.default_rng(seed)
    return {
        "q": np.concatenate([rng.uniform(-np.pi, np.pi, m), rng.uniform(0.5, 1.5, free)]),
        "v": rng.normal(size=n),
        "u": rng.normal(size=n),
        "a": rng.normal(size=n),
        "w": np.stack([rng.uniform(0.5, 1.5, k), rng.normal(size=k), rng.normal(size=k)], axis=-1),
    }


def hard_states(scene: Scene) -> dict[str, State]:
    """Named states that make the equations of any scene hard to evaluate; `REASONS` says why each is.

    With free lengths also "a length of ...": the first of them nearly vanishes.
    """
    m = len(scene.links)
    numbers = np.arange(m)
    angles = {
        "aligned": np.full(m, 0.7),
        "nearly aligned": 0.7 + 1e-8 * numbers,
        "folded": 0.7 + np.pi * (numbers % 2),
        "nearly folded": 0.7 + (np.pi - 1e-8) * (numbers % 2),
        "angles of 1e6": 1e6 + numbers,
        "angles of 1e15": 1e15 + numbers,
        "angles of all sizes": np.resize([1e15, 0.7, -1e6, 3e-8], m),
    }
    states = {"random": random_state(scene), "fast": _changed(scene, rates=1e4)}
    states["fast and nearly aligned"] = _changed(scene, angles=angles["nearly aligned"], rates=1e4)
    states |= {name: _changed(scene, angles=value) for name, value in angles.items()}
    if scene.free:
        states |= {f"a length of {s:g}": _changed(scene, lengths={0: s}) for s in (1e-3, 1e-6, 1e-9, 1e-12)}
    return states


def _changed(scene: Scene, angles: Any = None, lengths: dict[int, float] | None = None, rates: float = 1.0) -> State:
    """The random state with other angles, some other free lengths (by their number), or its rates scaled."""
    state, m = random_state(scene), len(scene.links)
    if angles is not None:
        state["q"][:m] = angles
    for k, length in (lengths or {}).items():
        state["q"][m + k] = length
    state["v"] *= rates
    return state


def cases() -> tuple[Case, ...]:
    """The catalogue."""
    found = [
        *cases_of(rods()),
        *cases_of(chain(1, "rigid"), "fast"),
        *cases_of(walker(), "fast and nearly aligned", "nearly folded", "angles of all sizes"),
    ]
    found += [*_ratios(), *_extremes(), *_collapsing(), *_elastic(), *_long()]
    return tuple(found)


def cases_of(scene: Scene, *names: str) -> list[Case]:
    """The hard states of a scene as cases, by default all."""
    states = hard_states(scene)
    why = "a link without length has no direction"
    return [Case(f"{scene.name}: {name}", scene, states[name], REASONS.get(name, why)) for name in names or states]


def rods(masses: Sequence[float] = (1.0,) * 4, lengths: Sequence[float] = (1.0,) * 4) -> Scene:
    """A chain of rigid rods, as many masses in kg as lengths in m."""
    names = ["ground", *(f"link{i}" for i in range(1, len(masses) + 1))]
    numbers = zip(pairwise(names), masses, lengths, strict=True)
    links = (Rigid(name=name, parent=parent, mass=m, length=length) for (parent, name), m, length in numbers)
    return Scene("rods", tuple(links))


def lumped(masses: tuple[float, float, float] = (0.25, 0.5, 0.25)) -> Scene:
    """A joint-masses link (model 1c) that carries a point-masses link (1d), both of free length.

    Args:
        masses: of each, at the joint, on the link and at its far end, kg.
    """
    first = JointMasses(name="link1", parent="ground", length="free", masses=masses, fraction=0.4)
    second = PointMasses(name="link2", parent="link1", length="free", masses=masses, fractions=(0.0, 0.4, 1.0))
    return Scene("lumped", (first, second))


def elastic(inertia: float = 1 / 12, stiffness: float = 1e3) -> Scene:
    """Two rods of 0.5 m and 1 kg on elastic stretches of free length (model 1a).

    Args:
        inertia: of each rod about its near end, kg m²; the least possible, of a point mass, is 1/16.
        stiffness: of the stretches in N/m and of the joints in N m/rad.
    """

    rods = (
        ElasticRod(
            name=name,
            parent=parent,
            length="free",
            mass=1.0,
            rod_length=0.5,
            inertia=inertia,
            stiffness=stiffness,
            rest_length=0.5,
            damping=7.0,
            joint_stiffness=stiffness,
            joint_rest_angle=0.3,
            joint_damping=1.7,
        )
        for parent, name in pairwise(("ground", "link1", "link2"))
    )
    return Scene("elastic", tuple(rods))


def crowded() -> Scene:
    """A link of free length with 300 masses on it, and a rod at its end."""
    masses, fractions = (0.01 + 0.001 * (np.arange(300) % 7)).tolist(), np.linspace(0.0, 1.0, 300).tolist()
    many = PointMasses(name="link1", parent="ground", length="free", masses=tuple(masses), fractions=tuple(fractions))
    return Scene("crowded", (many, Rigid(name="link2", parent="link1", length=1.0, mass=1.0)))


def _ratios() -> list[Case]:
    made = []
    for ratio in (1e6, 1e-6, 1e12, 1e-12):
        scene = rods(masses=np.geomspace(1.0, ratio, 4).tolist())
        why = "the heavy end hides the light one: eliminating it leaves the rest with few digits"
        made.append(Case(f"rods: masses to {ratio:g}", scene, random_state(scene), why))
    for ratio in (1e4, 1e-4):
        scene = rods(lengths=np.geomspace(1.0, ratio, 4).tolist())
        why = "moments of inertia, squares of the lengths, differ by twice as many digits"
        made.append(Case(f"rods: lengths to {ratio:g}", scene, random_state(scene), why))
    for tip in (1e-12, 1e-300):
        scene = rods(masses=(1.0, 1.0, 1.0, tip))
        why = "nothing but the tip's own mass resists its rotation"
        made.append(Case(f"rods: a tip of {tip:g} kg", scene, random_state(scene), why))
    return made


def _extremes() -> list[Case]:
    masses = {"subnormal": (1.0, 1.0, 1.0, 5e-324), "tiny": (1e-200,) * 4, "huge": (1e200,) * 4}
    why = {
        "subnormal": "the mass has a single digit, its moments none",
        "tiny": "products of two masses underflow",
        "huge": "products of two masses overflow",
    }
    made = []
    for kind, numbers in masses.items():
        scene = rods(masses=numbers)
        made.append(Case(f"rods: {kind} masses", scene, random_state(scene), why[kind]))
    for kind, length in (("tiny", 1e-100), ("huge", 1e100)):
        scene = rods(lengths=(length,) * 4)
        why_length = "moments of inertia of 1e±200 kg m² beside masses of 1 kg"
        made.append(Case(f"rods: {kind} lengths", scene, random_state(scene), why_length))
    scene = crowded()
    made.append(Case("crowded: 300 masses", scene, random_state(scene), "sums of hundreds of terms"))
    return made


def _collapsing() -> list[Case]:
    scene = lumped()
    made = []
    for k, model in enumerate(("1c", "1d")):
        for length in (1.0, 1e-3, 1e-6, 1e-9, 1e-12):
            why = f"a link of model {model} without length has no direction; its inertia falls with the square"
            state = _changed(scene, lengths={k: length})
            made.append(Case(f"lumped: {model} of {length:g} m", scene, state, why))
    light, tiny = lumped(masses=(0.25, 0.5, 1e-12)), lumped(masses=(1e-120, 2e-120, 1e-120))
    return [
        *made,
        Case("lumped: tips of 1e-12 kg", light, random_state(light), "the far ends have next to no mass"),
        Case("lumped: tiny masses", tiny, random_state(tiny), "products of three masses underflow"),
    ]


def _elastic() -> list[Case]:
    rod, thin, stiff = elastic(), elastic(inertia=0.0625 * (1 + 1e-9)), elastic(stiffness=1e8)
    least, near = {0: -0.25, 1: -0.25}, {0: -0.25, 1: -0.25 * (1 + 1e-8)}
    return [
        Case("elastic: least inertia", rod, _changed(rod, lengths=least), "the rods turn about their own centres"),
        Case("elastic: near it", rod, _changed(rod, lengths=near), "the last rod's arm is a difference of 2.5e-9 m"),
        Case("elastic: thin rods", thin, _changed(thin, lengths=least), "the inertia left is a difference of 6e-11"),
        Case("elastic: stiff springs", stiff, random_state(stiff), "spring forces of 1e8 N beside weights of 10 N"),
    ]


def _long() -> list[Case]:
    why = "errors of hundreds of eliminations add up"
    scenes = [chain(links, "rigid") for links in (100, 1000)]
    return [Case(f"{scene.name}: random", scene, random_state(scene), why) for scene in scenes]
