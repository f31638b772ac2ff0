"""The mechanisms that tests and benchmarks share, by name, and random states of any mechanism.

The links of a case are unequal, so that numbers mixed up between links are seen. No case is singular in every
state: the length of a hanging rod at the end of a branch moves no mass, so it is prescribed.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from eomgen.catalog import walker
from eomgen.scene import LINK_TYPES, AnyLink, Length, Scene

GRAVITY = 9.81
VARIABLE = tuple(model for model in LINK_TYPES if model != "rigid")
ALONG = {"stiffness": 310.0, "rest_length": 0.45, "damping": 7.0}
JOINT = {"joint_stiffness": 23.0, "joint_rest_angle": 0.35, "joint_damping": 1.7}
Changes = Mapping[int, Mapping[str, Any]]


def link(index: int, parent: int, model: str, length: Length | None = None, **changes: Any) -> AnyLink:
    """Link `index` (from 0) of a case: "link1", "link2", ..., each a little heavier and longer than the last.

    Args:
        index: Its place in the scene.
        parent: The place of its parent, -1 for the ground.
        model: The link model.
        length: As in a scene; None is "free", or a length of its own if the model is rigid.
        changes: Further keys of the link, or other values for those the model needs.
    """
    k = 1 + 0.13 * index
    numbers: dict[str, dict[str, Any]] = {
        "rigid": {"mass": 1.3 * k},
        "elastic-rod": {"mass": 1.1 * k, "rod_length": 0.5 * k},
        "telescopic": {"rod_mass": 0.4 * k, "rod_length": 0.6 * k, "housing_mass": 0.7 * k, "housing_length": 0.45 * k},
        "joint-masses": {"masses": (0.2 * k, 0.6 * k, 0.3 * k), "fraction": 0.41 * k},
        "point-masses": {"masses": (0.3 * k, 0.5 * k, 0.2 * k, 0.1), "fractions": (0.0, 0.37 * k, 0.8, 1.0)},
    }
    if length is None:
        length = 0.7 * k if model == "rigid" else "free"
    keys = {"parent": f"link{parent + 1}" if parent >= 0 else "ground", "length": length, **numbers[model], **changes}
    return LINK_TYPES[model](name=f"link{index + 1}", **keys)


def tree(
    name: str,
    parents: Sequence[int],
    models: str | Sequence[str],
    lengths: Length | Sequence[Length | None] | None = None,
    hanging: Sequence[int] = (),
    gravity: float = GRAVITY,
    changes: Changes | None = None,
) -> Scene:
    """A scene of the links above.

    Args:
        name: The name of the scene; its hyphens become underscores.
        parents: The place of every link's parent, -1 for the ground.
        models: The model of every link, or of all.
        lengths: The length of every link, or of all; None as for `link`.
        hanging: The places of the links that hang.
        gravity: In m/s^2.
        changes: Further keys by the place of the link.
    """
    count = len(parents)
    each_model = [models] * count if isinstance(models, str) else models
    each_length = [lengths] * count if lengths is None or isinstance(lengths, str | float) else lengths
    made = (
        link(i, parent, model, length, hangs=i in hanging, **(changes or {}).get(i, {}))
        for i, (parent, model, length) in enumerate(zip(parents, each_model, each_length, strict=True))
    )
    return Scene(name.replace("-", "_"), tuple(made), gravity)


def random_tree(links: int, seed: int = 1) -> Scene:
    """A tree of links of every model and mode, some with springs, some hanging, in random order on random parents."""
    numbers = random.Random(seed)
    parents = [-1, *(numbers.randrange(max(0, i - 8), i) for i in range(1, links))]
    models = [numbers.choice(tuple(LINK_TYPES)) for _ in parents]
    lengths = [None if model == "rigid" else numbers.choice(("free", "prescribed", 0.6)) for model in models]
    # A length that moves no mass would make the scene singular, so tips do not hang.
    hanging = [i for i in range(links) if i in parents and numbers.random() < 0.3]
    springs = [
        numbers.choice(({}, JOINT, ALONG, {**ALONG, **JOINT}) if isinstance(length, str) else ({}, JOINT))
        for length in lengths
    ]
    return tree("random_tree", parents, models, lengths, hanging, changes=dict(enumerate(springs)))


def line(links: int) -> tuple[int, ...]:
    """The parents of a chain."""
    return tuple(range(-1, links - 1))


def _chains() -> Iterator[Scene]:
    """Chains of every model, of one to five links, and of all kinds of lengths."""
    for model in LINK_TYPES:
        for links in range(1, 6):
            yield tree(f"{model}_{links}", line(links), model)
    for model in VARIABLE:
        yield tree(f"{model}_3_prescribed", line(3), model, "prescribed")
        yield tree(f"{model}_3_fixed", line(3), model, 0.6)
        yield tree(f"{model}_4_mixed", line(4), model, ("free", "prescribed", 0.6, "free"))
        yield tree(f"{model}_3_hanging", line(3), model, ("free", "free", "prescribed"), hanging=(0, 1, 2))
    yield tree("rigid_3_hanging", line(3), "rigid", hanging=(0, 1, 2))
    yield tree("models_5", line(5), tuple(LINK_TYPES))


def _trees() -> Iterator[Scene]:
    yield tree("fork", (-1, 0, 0), "rigid")
    yield tree("star", (-1, 0, 0, 0), ("rigid", "telescopic", "elastic-rod", "point-masses"))
    yield tree("roots", (-1, -1, 0, 1, 1, -1), ("point-masses", "rigid", "elastic-rod", "telescopic", "rigid", "rigid"))
    yield tree(
        "hanging_branch",
        (-1, 0, 1, 2, 1, 4),
        ("elastic-rod", "joint-masses", "elastic-rod", "rigid", "telescopic", "point-masses"),
        ("free", "prescribed", "free", None, 0.5, "free"),
        hanging=(2, 3, 5),
    )


def _forces() -> Iterator[Scene]:
    """Without gravity, with it upside down, with springs and dampers."""
    mixed = ("elastic-rod", "rigid", "telescopic")
    yield tree("weightless", line(3), mixed, gravity=0.0)
    yield tree("upside_down", line(3), mixed, gravity=-1.62)
    yield tree(
        "length_springs", line(3), ("elastic-rod", "telescopic", "point-masses"), ("free", "prescribed", "free"),
        changes={0: ALONG, 1: ALONG, 2: {"damping": 3.0}},
    )  # fmt: skip
    yield tree("joint_springs", line(3), "rigid", changes={0: JOINT, 1: {"joint_damping": 0.4}, 2: JOINT})
    yield tree(
        "springs", (-1, 0, 1, 1, -1), ("joint-masses", "telescopic", "elastic-rod", "rigid", "point-masses"),
        ("free", "prescribed", "prescribed", None, "free"), hanging=(2,),
        changes={0: {**ALONG, **JOINT}, 1: {**ALONG, **JOINT}, 2: {"stiffness": 90.0}, 3: JOINT, 4: {**ALONG, **JOINT}},
    )  # fmt: skip
    yield tree("weightless_springs", (-1, 0, 0), mixed, gravity=0.0, changes={1: JOINT, 2: {**ALONG, **JOINT}})


def _numbers() -> Iterator[Scene]:
    """Inertias and centres that are given, masses that are zero."""
    yield tree("centers", (-1, 0, 0), "rigid", hanging=(2,), changes={
        0: {"center": -0.1, "inertia": 0.2}, 1: {"inertia": 0.0}, 2: {"center": 0.9},
    })  # fmt: skip
    yield tree("inertias", line(3), ("elastic-rod", "telescopic", "telescopic"), changes={
        0: {"inertia": 0.3}, 1: {"rod_inertia": 0.05, "housing_inertia": 0.11}, 2: {"housing_inertia": 0.2},
    })  # fmt: skip
    yield tree("massless", line(3), ("telescopic", "joint-masses", "point-masses"), changes={
        0: {"rod_mass": 0.0}, 1: {"masses": (0.0, 0.9, 0.0)}, 2: {"masses": (0.8,), "fractions": (0.6,)},
    })  # fmt: skip


CASES: dict[str, Scene] = {
    **{scene.name: scene for family in (_chains, _trees, _forces, _numbers) for scene in family()},
    **{f"walker_{links}_prescribed": walker(links) for links in ("rods", "lumped")},
    **{f"walker_{links}_fixed": walker(links, 0.4) for links in ("rods", "lumped")},
    "walker_lumped_free": walker("lumped", "free"),
}


class Named(Protocol):
    """What tells the size of a state: a scene or a compiled module."""

    @property
    def q_names(self) -> tuple[str, ...]: ...
    @property
    def w_names(self) -> tuple[str, ...]: ...


class State(NamedTuple):
    """States of a mechanism, (*batch, n) and (*batch, k, 3), by the letters of `eomgen.ir.equations`."""

    q: NDArray[np.float64]
    v: NDArray[np.float64]
    a: NDArray[np.float64]
    u: NDArray[np.float64]
    w: NDArray[np.float64]

    def of(self, letters: str) -> list[NDArray[np.float64]]:
        """The arrays of these letters, as a compiled function takes them: w only where a length is prescribed."""
        return [getattr(self, letter) for letter in letters if letter != "w" or self.w.shape[-2]]


def random_state(mechanism: Named, seed: int, batch: tuple[int, ...] = ()) -> State:
    """Random states: angles of a whole turn, lengths from 0.4 to 1 m (far from where a link vanishes).

    Args:
        mechanism: A scene or a module.
        seed: Names the states.
        batch: The leading shape.
    """
    random = np.random.default_rng(seed)
    angles = sum(name.endswith(".angle") for name in mechanism.q_names)
    n, k = len(mechanism.q_names), len(mechanism.w_names)

    def uniform(low: float, high: float, *shape: int) -> NDArray[np.float64]:
        return random.uniform(low, high, (*batch, *shape))

    q = np.concatenate([uniform(-np.pi, np.pi, angles), uniform(0.4, 1.0, n - angles)], axis=-1)
    w = np.stack([uniform(0.4, 1.0, k), uniform(-1, 1, k), uniform(-3, 3, k)], axis=-1)
    return State(q, v=uniform(-2, 2, n), a=uniform(-5, 5, n), u=uniform(-20, 20, n), w=w)
