"""Ready scenes: a chain of equal links and the five-link walker of the paper.

Source of the walker's numbers: A. V. Borisov, G. M. Rozenblat, Computer Research and Modeling, 2017, 9(2),
201-210, numerical study of the single-support phase.
"""

from itertools import pairwise
from typing import Any, NamedTuple

from eomgen.errors import OptionError, shown, unknown
from eomgen.scene import LINK_TYPES, Length, Scene

MAX_LINKS = 100_000

# Links of 1 kg, 1 m from joint to joint (at s = 0.5 m where a rod adds to the length, at s = 1 m elsewhere).
_CHAIN_NUMBERS: dict[str, dict[str, Any]] = {
    "rigid": {"mass": 1.0},
    "elastic-rod": {"mass": 1.0, "rod_length": 0.5},
    "telescopic": {"rod_mass": 0.4, "rod_length": 0.6, "housing_mass": 0.6, "housing_length": 0.5},
    "joint-masses": {"masses": (0.25, 0.5, 0.25), "fraction": 0.5},
    "point-masses": {"masses": (0.25, 0.5, 0.25), "fractions": (0.0, 0.5, 1.0)},
}


class _WalkerLink(NamedTuple):
    name: str
    parent: str
    hangs: bool
    mass: float  # kg
    rod_length: float  # m
    fraction: float  # of the length, where the middle mass stands
    angle: float  # rad, at t = 0
    rate: float  # rad/s, at t = 0


_WALKER = (
    _WalkerLink("stance_shank", "ground", False, 2.91, 0.385, 0.595, 1.68, -1.57),
    _WalkerLink("stance_thigh", "stance_shank", False, 8.93, 0.477, 0.545, 1.70, -2.92),
    _WalkerLink("swing_thigh", "stance_thigh", True, 8.93, 0.477, 0.545, 1.21, -0.19),
    _WalkerLink("swing_shank", "swing_thigh", True, 2.91, 0.385, 0.595, 0.39, -2.83),
    _WalkerLink("trunk", "stance_thigh", False, 28.93, 0.771, 0.500, 1.57, -0.07),
)
WALKER_ANGLES = tuple(row.angle for row in _WALKER)
WALKER_RATES = tuple(row.rate for row in _WALKER)


def chain(
    links: int,
    model: str = "point-masses",
    length: Length | None = None,
    gravity: float = 9.81,
    hangs: bool = False,
) -> Scene:
    """A chain of equal links of 1 kg, `link1` on the ground; by default the mechanism of the paper's Table 1.

    Args:
        links: How many, 1 to 100000.
        model: The link model.
        length: "free", "prescribed" or a fixed length in m; None is 1 m if rigid, else "free".
        gravity: In m/s^2, along -y.
        hangs: Whether every link is attached by its far end.

    Raises:
        OptionError: There is no such number of links or no such model.
        SceneError: A length or gravity that no scene allows.
    """
    if not isinstance(links, int) or isinstance(links, bool) or not 1 <= links <= MAX_LINKS:
        raise OptionError(f"links = {shown(links)} is not allowed; give an integer from 1 to {MAX_LINKS}")
    if not isinstance(model, str) or model not in LINK_TYPES:
        raise OptionError(unknown("model", model, LINK_TYPES))
    if length is None:
        length = 1.0 if model == "rigid" else "free"
    make: Any = LINK_TYPES[model]
    names = ["ground", *(f"link{i}" for i in range(1, links + 1))]
    made = (
        make(name=name, parent=parent, hangs=hangs, length=length, **_CHAIN_NUMBERS[model])
        for parent, name in pairwise(names)
    )
    return Scene(f"chain{links}", tuple(made), gravity)


def walker(links: str = "rods", length: Length = "prescribed") -> Scene:
    """The five-link walker in single support: stance leg, swing leg that hangs from the hip, and trunk.

    Args:
        links: "rods" (elastic-rod links) or "lumped" (joint-masses links: a quarter of the mass at each end,
            half of it at the fraction).
        length: "prescribed", "free" or a fixed length coordinate in m, for every link.

    Raises:
        OptionError: `links` is neither.
        SceneError: A length that no scene allows.
    """
    if not isinstance(links, str) or links not in _WALKER_LINKS:
        raise OptionError(unknown("walker links", links, _WALKER_LINKS))
    model, numbers = _WALKER_LINKS[links]
    make: Any = LINK_TYPES[model]
    made = (make(name=row.name, parent=row.parent, hangs=row.hangs, length=length, **numbers(row)) for row in _WALKER)
    return Scene("walker", tuple(made))


def _rod(row: _WalkerLink) -> dict[str, Any]:
    return {"mass": row.mass, "rod_length": row.rod_length}


def _lumped(row: _WalkerLink) -> dict[str, Any]:
    return {"masses": (row.mass / 4, row.mass / 2, row.mass / 4), "fraction": row.fraction}


_WALKER_LINKS = {"rods": ("elastic-rod", _rod), "lumped": ("joint-masses", _lumped)}
