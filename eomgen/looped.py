"""The functions that can be loops over links: which walks compute them, and where their results go."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from eomgen import linearised
from eomgen.frontends import articulated
from eomgen.frontends.articulated import Ground, Walk
from eomgen.frontends.mechanism import Mechanism
from eomgen.scene import SPRINGS

Outputs = dict[str, tuple[str, dict[int, int]]]  # result name -> array, and link -> index in it
COLUMNS = "columns"  # the array of a matrix that walks solve for, column by column
AXES = ("x", "y")


@dataclass(frozen=True)
class Product:
    """Elements of a matrix for pairs of links of which one is above the other: products of two vectors.

    Attributes:
        above, below: names of the vectors, of which a link may have several.
        places: where it goes: array, first index, and what the numbers of the vector below and of the one above are
            multiplied by to give the rest of it.
    """

    above: str
    below: str
    places: tuple[tuple[str, int, int, int], ...]


@dataclass(frozen=True)
class Looped:
    """How a function is computed by walks.

    Attributes:
        walks: makes the walks.
        outputs: where the results of the links go.
        zeros: an array that starts at zero.
        add: the results that go there are added.
        products: elements for pairs of links.
        before: the number of walks before these.
        sides: names of the columns that are solved for side by side.
        slopes: derivatives by the parameters of springs belong to it.
    """

    walks: Callable[[Ground], list[Walk]]
    outputs: Callable[[Mechanism], Outputs]
    zeros: str = ""
    add: bool = False
    products: Callable[[Mechanism], list[Product]] = lambda mechanism: []
    before: int = 0
    sides: tuple[str, ...] = ()
    slopes: bool = False


def axis_of(vector: str, axis: str) -> str:
    """The array of one component of a vector."""
    return f"{vector.replace(' ', '_')}_{axis}"


def coordinates(mechanism: Mechanism) -> dict[str, dict[int, int]]:
    """The number of a coordinate by kind, "angle" or "length", and by link."""
    m = len(mechanism.links)
    return {"angle": {i: i for i in range(m)}, "length": {i: m + k for k, i in enumerate(mechanism.scene.free)}}


def _links(mechanism: Mechanism, index: Callable[[int], int], array: str = "out") -> tuple[str, dict[int, int]]:
    return array, {i: index(i) for i in range(len(mechanism.links))}


def _coordinates(mechanism: Mechanism, angle: str = "angle") -> Outputs:
    own = coordinates(mechanism)
    return {angle: ("out", own["angle"]), "length": ("out", own["length"])}


def _prescribed(mechanism: Mechanism) -> Outputs:
    return {"length": ("out", {i: k for k, i in enumerate(mechanism.scene.prescribed)})}


def _vectors(names: Iterable[str], owners: dict[str, dict[int, int]]) -> Outputs:
    """Two arrays for every vector, by the number of its owner."""
    return {
        f"{vector} {axis} of {owner}": (axis_of(vector, axis), indices)
        for owner, indices in owners.items()
        for vector in names
        for axis in AXES
    }


def _matrix(mechanism: Mechanism) -> Outputs:
    own, n = coordinates(mechanism), len(mechanism.symbols.q)
    diagonal = {name: ("out", {i: (n + 1) * index for i, index in at.items()}) for name, at in own.items()}
    return diagonal | _vectors(("end", "force"), own)


def _matrix_products(mechanism: Mechanism) -> list[Product]:
    n = len(mechanism.symbols.q)
    return [Product("end", "force", (("out", 0, 1, n), ("out", 0, n, 1)))]


def _rows(mechanism: Mechanism) -> dict[str, dict[int, int]]:
    """The coordinates in whose rows of ∂r/∂x a link writes by itself."""
    parents = {i: parent for i, parent in enumerate(mechanism.parents) if parent >= 0}
    return {**coordinates(mechanism), "parent angle": parents}


def _elements(mechanism: Mechanism, columns: dict[str, dict[int, int]]) -> Outputs:
    """Where elements of the matrix to solve for go, which is stored column by column."""
    n = len(mechanism.symbols.q)
    return {
        f"{row} by {column}": (COLUMNS, {i: n * at[i] + index for i, index in indices.items() if i in at})
        for row, indices in _rows(mechanism).items()
        for column, at in columns.items()
    }


def _solutions(mechanism: Mechanism, sides: tuple[str, ...], columns: int) -> Outputs:
    """Where the first solution on every side goes."""
    return {
        f"{name} by {side}": ("out", {i: columns * index + k * columns // len(sides) for i, index in indices.items()})
        for name, indices in coordinates(mechanism).items()
        for k, side in enumerate(sides)
    }


def _jacobian(mechanism: Mechanism) -> Outputs:
    own, n = coordinates(mechanism), len(mechanism.symbols.q)
    rows = _rows(mechanism)
    columns = dict(rows)
    for name, indices in rows.items():
        columns["rate" if name == "angle" else f"{name} rate"] = {i: n + index for i, index in indices.items()}
    for name, coordinate in (("torque", "angle"), ("force", "length")):
        columns[name] = {i: 2 * n + index for i, index in own[coordinate].items()}
    vectors = _vectors(("end", "force", "load", "shift", "rate load", "rate shift"), own)
    return _elements(mechanism, columns) | vectors | _solutions(mechanism, linearised.STATE, 3 * n)


def _jacobian_products(mechanism: Mechanism) -> list[Product]:
    n = len(mechanism.symbols.q)
    found: list[Product] = []
    for start, rate in ((0, ""), (n * n, "rate ")):
        found.append(Product("end", f"{rate}load", ((COLUMNS, start, n, 1),)))
        found.append(Product(f"{rate}shift", "force", ((COLUMNS, start, 1, n),)))
    return found


def _parameter_jacobian(mechanism: Mechanism) -> Outputs:
    slots, columns = mechanism.symbols.slots, dict[str, dict[int, int]]()
    for i, link in enumerate(mechanism.links):
        for name, node in link.values.items():
            columns.setdefault(name, {})[i] = slots[node].index
    vectors = _vectors(("load", "shift"), {name: at for name, at in columns.items() if name not in SPRINGS})
    vectors |= _vectors(("end", "force"), coordinates(mechanism))
    last = len(mechanism.symbols.p) - 1
    columns["gravity"] = dict.fromkeys(range(len(mechanism.links)), last)
    return _elements(mechanism, columns) | vectors | _solutions(mechanism, linearised.PARAMETERS, last + 1)


def _parameter_products(mechanism: Mechanism) -> list[Product]:
    n = len(mechanism.symbols.q)
    return [Product("end", "load", ((COLUMNS, 0, n, 1),)), Product("shift", "force", ((COLUMNS, 0, 1, n),))]


LOOPED: dict[str, Looped] = {
    "forward_dynamics": Looped(articulated.forward_dynamics, _coordinates),
    "inverse_dynamics": Looped(articulated.newton_euler, lambda mechanism: _coordinates(mechanism, "torque")),
    "mass_matrix": Looped(articulated.composite_bodies, _matrix, zeros="out", products=_matrix_products, before=1),
    "bias": Looped(articulated.no_accelerations, _coordinates),
    "energy": Looped(
        articulated.energy,
        lambda mechanism: {
            "kinetic": _links(mechanism, lambda i: 0, "sum"),
            "potential": _links(mechanism, lambda i: 1, "sum"),
        },
        zeros="sum",
        add=True,
    ),
    "prescribed_forces": Looped(articulated.newton_euler, _prescribed),
    "joints": Looped(
        articulated.joints,
        lambda mechanism: {"x": _links(mechanism, lambda i: 2 * i), "y": _links(mechanism, lambda i: 2 * i + 1)},
    ),
    "jacobian": Looped(
        linearised.jacobian,
        _jacobian,
        zeros=COLUMNS,
        add=True,
        products=_jacobian_products,
        before=3,
        sides=linearised.STATE,
    ),
    "parameter_jacobian": Looped(
        linearised.parameter_jacobian,
        _parameter_jacobian,
        zeros=COLUMNS,
        products=_parameter_products,
        before=3,
        sides=linearised.PARAMETERS,
        slopes=True,
    ),
}
