"""Equations of motion: what every front end returns and everything after it reads.

Symbols, used with the same meaning everywhere (n coordinates, k prescribed lengths):

| name | meaning | unit | shape |
|---|---|---|---|
| q | coordinates: absolute angles of the links, then the free lengths | rad, m | n |
| v | their rates | rad/s, m/s | n |
| a | their accelerations | rad/s², m/s² | n |
| u | joint torques, then the forces along the free lengths | N m, N | n |
| w | prescribed lengths: value, rate, acceleration | m, m/s, m/s² | k, 3 |
| p | parameters | per parameter | np |

The equations are `M(q, w, p) a + h(q, v, w, p) = Q(u)` with mass matrix M and bias h. A joint torque acts on
its link and reacts on the parent, so Q of an angle is the link's own torque less those of its children.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

from eomgen.ir.expr import Graph, Node

T = TypeVar("T")


class lazy(cached_property[T]):  # noqa: N801 (used like cached_property)
    """A cached property that is built with the garbage collector paused.

    A graph makes many objects and no garbage; searching it for garbage would take as long as making it.
    """

    def __init__(self, build: Callable[[Any], T]) -> None:
        def paused(owner: Any) -> T:
            if not gc.isenabled():
                return build(owner)
            gc.disable()
            try:
                return build(owner)
            finally:
                gc.enable()

        super().__init__(paused)
        self.__doc__ = build.__doc__


Vector = tuple[Node, ...]
Matrix = tuple[tuple[Node, ...], ...]


@dataclass(frozen=True)
class Slot:
    """Where a symbol is found at run time: an element of a named array."""

    array: str
    index: int


@dataclass(frozen=True)
class Symbols:
    """The symbols of a set of equations, by the table above.

    Attributes:
        graph: the graph all expressions live in.
        q, v, a, u, w, p: symbols; p is empty when the numbers were folded in.
        p_values: the parameters' values, as many as p.
        units: the unit of each symbol.
    """

    graph: Graph
    q: Vector
    v: Vector
    a: Vector
    u: Vector
    w: tuple[tuple[Node, Node, Node], ...] = ()
    p: Vector = ()
    p_values: tuple[float, ...] = ()
    units: Mapping[Node, str] = field(default_factory=dict)

    @cached_property
    def slots(self) -> dict[Node, Slot]:
        """The array element that each symbol stands for; w is flattened row by row."""
        rows = [node for row in self.w for node in row]
        arrays = {"q": self.q, "v": self.v, "a": self.a, "u": self.u, "w": rows, "p": self.p}
        return {node: Slot(name, i) for name, nodes in arrays.items() for i, node in enumerate(nodes)}


class Elimination:
    """LDLᵀ of a symmetric positive definite matrix without pivoting, skipping structural zeros.

    With absolute angles an element of the mass matrix is nonzero only between a link and its ancestors, so
    eliminating the deepest link first creates no new nonzeros (Featherstone 2008, section 6.5). Each pivot passes
    `pivot_inverse` beside its own diagonal element.

    Args:
        matrix: symmetric, (n, n); only the elements at or before the pivot in the order are read.
        order: the coordinates, the first to be eliminated first.
    """

    def __init__(self, matrix: Matrix, order: Sequence[int]) -> None:
        self.graph = graph = matrix[0][0].graph
        self.order = order
        zero = graph.zero
        rows = [list(row) for row in matrix]
        self.pivots: dict[int, Node] = {}  # inverted
        self.columns: dict[int, list[tuple[int, Node]]] = {}  # of L
        for step, k in enumerate(order):
            inverse = self.pivots[k] = graph.pivot_inverse(rows[k][k], matrix[k][k])
            column = [(i, rows[k][i]) for i in order[step + 1 :] if rows[k][i] is not zero]
            self.columns[k] = [(i, element * inverse) for i, element in column]
            for position, (i, factor) in enumerate(self.columns[k]):
                for j, other in column[position:]:
                    rows[j][i] = rows[i][j] = rows[i][j] - factor * other
        # A pivot that fails makes all that is coupled to it NaN; what is coupled to nothing is told by a factor of one.
        coupled = {i for k, column in self.columns.items() if column for i in (k, *(pivot for pivot, _ in column))}
        sizes = {k: graph.one if matrix[k][k] is zero else matrix[k][k] for k in order if k not in coupled}
        ones = {k: size * self.pivots[k] for k, size in sizes.items()}
        self.uncoupled = {k: [one for pivot, one in ones.items() if pivot != k] for k in ones}

    def solve(self, right: Sequence[Node]) -> Vector:
        """The solution for a right-hand side, (n,)."""
        total = self.graph.sum
        b = list(right)
        for k in self.order:
            for i, factor in self.columns[k]:
                b[i] = b[i] - factor * b[k]
        solution: dict[int, Node] = {}
        for k in reversed(self.order):
            solution[k] = b[k] * self.pivots[k] - total(factor * solution[i] for i, factor in self.columns[k])
        for k, others in self.uncoupled.items():
            for other in others:
                solution[k] = solution[k] * other
        return tuple(solution[k] for k in range(len(b)))

    def solve_by_inverse(self, right: Sequence[Node]) -> Vector:
        """The same by the inverse: fewer operations for several dense right-hand sides."""
        zero = self.graph.zero
        return tuple(
            self.graph.sum(x * y for x, y in zip(row, right, strict=True) if y is not zero) for row in self.inverse
        )

    @cached_property
    def inverse(self) -> Matrix:
        """The inverse of the matrix, (n, n), each pair of equal elements once (Takahashi et al. 1973)."""
        graph, n = self.graph, len(self.order)
        found = [[graph.zero] * n for _ in range(n)]
        done: list[int] = []
        for k in reversed(self.order):
            factors = self.columns[k]
            for j in done:
                found[k][j] = found[j][k] = -graph.sum(factor * found[i][j] for i, factor in factors)
            found[k][k] = self.pivots[k] - graph.sum(factor * found[i][k] for i, factor in factors)
            done.append(k)
        for k, others in self.uncoupled.items():
            for other in others:
                found[k][k] = found[k][k] * other
        return tuple(map(tuple, found))


class Equations:
    """The common symbolic result of every method; a front end fills it by overriding.

    Everything is lazy: an expression is built when it is first read and kept.

    Attributes:
        method: the name of the method.
        symbols: the symbols (`q`, `v`, `a`, `u`, `w`, `p` are also attributes of the equations).
    """

    method = ""

    def __init__(self, symbols: Symbols) -> None:
        self.symbols = symbols
        self.graph = symbols.graph
        self.q, self.v, self.a, self.u = symbols.q, symbols.v, symbols.a, symbols.u
        self.w, self.p = symbols.w, symbols.p

    @lazy
    def mass_matrix(self) -> Matrix:
        """M, (n, n)."""
        raise NotImplementedError

    @lazy
    def bias_parts(self) -> dict[str, Vector]:
        """The parts of the bias: "velocity" (with the motion of prescribed lengths), "gravity", "springs"."""
        raise NotImplementedError

    @lazy
    def bias(self) -> Vector:
        """h, (n,): the sum of its parts."""
        return tuple(self.graph.sum(parts) for parts in zip(*self.bias_parts.values(), strict=True))

    @lazy
    def kinetic(self) -> Node:
        """Kinetic energy, J."""
        raise NotImplementedError

    @lazy
    def potential(self) -> Node:
        """Potential energy of gravity and springs, J."""
        raise NotImplementedError

    @lazy
    def joints(self) -> Matrix:
        """Positions of the links' far ends, (m, 2), m."""
        raise NotImplementedError

    @lazy
    def prescribed_forces(self) -> Vector:
        """Forces along the prescribed lengths, (k,), N."""
        return ()

    @cached_property
    def matrices(self) -> Mapping[str, Matrix | Vector]:
        """The paper's matrices by letter, for the methods that have them."""
        return {}

    def __getitem__(self, letter: str) -> Matrix | Vector:
        """The matrix of this letter; "L" is the paper's letter for Λ.

        Raises:
            KeyError: the method has no such matrix.
        """
        letter = "Λ" if letter == "L" else letter
        if letter not in self.matrices:
            allowed = ", ".join(self.matrices) or "none"
            raise KeyError(f"method {self.method!r} has no matrix {letter!r}; it has {allowed}")
        return self.matrices[letter]

    def generalised_force(self, u: Sequence[Node]) -> Vector:
        """Q that the inputs u exert on the coordinates."""
        return tuple(u)

    def inputs_for(self, force: Sequence[Node]) -> Vector:
        """The inverse of `generalised_force`: u that exerts a given Q."""
        return tuple(force)

    @lazy
    def forward_dynamics(self) -> Vector:
        """Accelerations a of M a = Q(u) - h, by elimination of the deepest coordinate first."""
        right = [Q - h for Q, h in zip(self.generalised_force(self.u), self.bias, strict=True)]
        return self.elimination.solve(right)

    @lazy
    def elimination(self) -> Elimination:
        """The factors of M."""
        return Elimination(self.mass_matrix, self.elimination_order)

    @property
    def elimination_order(self) -> Sequence[int]:
        """Coordinates, the first to be eliminated first."""
        return range(len(self.q) - 1, -1, -1)

    @lazy
    def inverse_dynamics(self) -> Vector:
        """u that gives the accelerations a: Q(u) = M a + h."""
        total = self.graph.sum
        force = [
            total(m * a for m, a in zip(row, self.a, strict=True)) + h
            for row, h in zip(self.mass_matrix, self.bias, strict=True)
        ]
        return self.inputs_for(force)
