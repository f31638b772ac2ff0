"""The matrix method: every element of every matrix directly, then the products.

    A φ̈ + E s̈ + B φ̇² + 2 D (φ̇ ṡ) + g C = Q_φ            (Borisov & Rozenblat 2017, eq. 5)
    Eᵀ φ̈ + G s̈ + H φ̇² + 2 Λ (φ̇ ṡ) + g K = Q_s           (eq. 6; Λ is the paper's L, Eᵀ its P)

The elements are the table in `docs/mechanics.md` (eqs. 7-9 in general form), with D_i the mass below link i
and P = S + L D, P' = S' + L' D.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

from eomgen.frontends.mechanism import Mechanism, MechanismEquations
from eomgen.ir.equations import Matrix, Vector, lazy
from eomgen.ir.expr import Node

Elements = list[list[Node]]


class MatrixEquations(MechanismEquations):
    """The named matrices over all links, (m, m), and what their products give."""

    method = "matrix"

    @cached_property
    def below(self) -> list[Node]:
        """D_i: the mass of all links strictly below link i."""
        links, parents = self.mechanism.links, self.mechanism.parents
        total = [self.graph.zero] * len(links)
        for i in range(len(links) - 1, -1, -1):
            if parents[i] >= 0:
                total[parents[i]] = total[parents[i]] + (links[i].moments.m + total[i])
        return total

    @cached_property
    def P(self) -> list[Node]:
        """P_i = S_i + L_i D_i"""
        return [k.moments.S + k.L * d for k, d in zip(self.mechanism.links, self.below, strict=True)]

    @cached_property
    def P1(self) -> list[Node]:
        """P'_i = ∂P_i/∂s_i"""
        return [k.moments.S1 + k.L1 * d for k, d in zip(self.mechanism.links, self.below, strict=True)]

    @cached_property
    def pairs(self) -> list[tuple[int, int, Node, Node]]:
        """(i, j, cos(φ_i - φ_j), sin(φ_i - φ_j)) for every ancestor i of every j."""
        links = self.mechanism.links
        pairs: list[tuple[int, int, Node, Node]] = []
        for j, below in enumerate(links):
            for i in self.mechanism.ancestors(j):
                above = links[i]
                pairs.append(
                    (
                        i,
                        j,
                        above.cos * below.cos + above.sin * below.sin,
                        above.sin * below.cos - above.cos * below.sin,
                    )
                )
        return pairs

    def _zeros(self) -> Elements:
        m = len(self.mechanism.links)
        return [[self.graph.zero] * m for _ in range(m)]

    def _diagonal(self, elements: Sequence[Node]) -> Elements:
        matrix = self._zeros()
        for i, element in enumerate(elements):
            matrix[i][i] = element
        return matrix

    @cached_property
    def A(self) -> Elements:
        links = self.mechanism.links
        A = self._diagonal([k.moments.T + k.L * k.L * d for k, d in zip(links, self.below, strict=True)])
        for i, j, c, _ in self.pairs:
            A[i][j] = A[j][i] = links[i].L * self.P[j] * c
        return A

    @cached_property
    def B(self) -> Elements:
        B = self._zeros()
        for i, j, _, s in self.pairs:
            B[i][j] = self.mechanism.links[i].L * self.P[j] * s
            B[j][i] = -B[i][j]
        return B

    @cached_property
    def C(self) -> list[Node]:
        return [p * k.cos for p, k in zip(self.P, self.mechanism.links, strict=True)]

    @cached_property
    def D(self) -> Elements:
        links = self.mechanism.links
        D = self._diagonal([k.moments.X + k.L * k.L1 * d for k, d in zip(links, self.below, strict=True)])
        for i, j, c, _ in self.pairs:
            D[i][j] = links[i].L * self.P1[j] * c
            D[j][i] = links[i].L1 * self.P[j] * c
        return D

    @cached_property
    def E(self) -> Elements:
        links, E = self.mechanism.links, self._zeros()
        for i, j, _, s in self.pairs:
            E[i][j] = -(links[i].L * self.P1[j] * s)
            E[j][i] = links[i].L1 * self.P[j] * s
        return E

    @cached_property
    def G(self) -> Elements:
        links = self.mechanism.links
        G = self._diagonal([k.moments.S2 + k.L1 * k.L1 * d for k, d in zip(links, self.below, strict=True)])
        for i, j, c, _ in self.pairs:
            G[i][j] = G[j][i] = links[i].L1 * self.P1[j] * c
        return G

    @cached_property
    def H(self) -> Elements:
        links = self.mechanism.links
        H = self._diagonal([-(k.moments.X + k.L * k.L1 * d) for k, d in zip(links, self.below, strict=True)])
        for i, j, c, _ in self.pairs:
            H[i][j] = -(links[i].L1 * self.P[j] * c)
            H[j][i] = -(links[i].L * self.P1[j] * c)
        return H

    @cached_property
    def K(self) -> list[Node]:
        return [p * k.sin for p, k in zip(self.P1, self.mechanism.links, strict=True)]

    @cached_property
    def Lambda(self) -> Elements:
        matrix = self._zeros()
        for i, j, _, s in self.pairs:
            matrix[i][j] = self.mechanism.links[i].L1 * self.P1[j] * s
            matrix[j][i] = -matrix[i][j]
        return matrix

    @cached_property
    def matrices(self) -> Mapping[str, Matrix | Vector]:
        return _Letters(self)

    @lazy
    def mass_matrix(self) -> Matrix:
        free = self.mechanism.scene.free
        top = [(*row, *(self.E[i][k] for k in free)) for i, row in enumerate(self.A)]
        bottom = [(*(row[j] for row in self.E), *(self.G[j][k] for k in free)) for j in free]
        return (*top, *bottom)

    @cached_property
    def _motion(self) -> tuple[list[Node], list[Node], list[Node]]:
        """φ̇², 2 φ̇ ṡ and the prescribed s̈, per link."""
        links, zero = self.mechanism.links, self.graph.zero
        squares = [k.rate * k.rate for k in links]
        mixed = [2 * (k.rate * k.length_rate) for k in links]
        given = [k.length_acceleration if k.varies and not k.free else zero for k in links]
        return squares, mixed, given

    def _velocity_forces(self, i: int, along: bool) -> Node:
        """B φ̇² + 2 D (φ̇ ṡ) + E s̈ of the prescribed lengths in row i; H, Λ and G along the length."""
        squares, mixed, given = self._motion
        rows = (self.H[i], self.Lambda[i], self.G[i]) if along else (self.B[i], self.D[i], self.E[i])
        products = (dot(row, column) for row, column in zip(rows, (squares, mixed, given), strict=True))
        return self.graph.sum(products)

    @lazy
    def bias_parts(self) -> dict[str, Vector]:
        mechanism, free = self.mechanism, self.mechanism.scene.free
        m, g = len(mechanism.links), mechanism.gravity
        torques = mechanism.reactions([k.joint_spring for k in mechanism.links])
        velocity = [self._velocity_forces(i, False) for i in range(m)]
        gravity = [g * c for c in self.C]
        return {
            "velocity": (*velocity, *(self._velocity_forces(i, True) for i in free)),
            "gravity": (*gravity, *(g * self.K[i] for i in free)),
            "springs": (*torques, *(mechanism.links[i].spring for i in free)),
        }

    @lazy
    def prescribed_forces(self) -> Vector:
        links, g = self.mechanism.links, self.mechanism.gravity
        turning = [k.acceleration for k in links]
        moving = [k.length_acceleration if k.free else self.graph.zero for k in links]
        return tuple(
            dot([row[i] for row in self.E], turning)
            + dot(self.G[i], moving)
            + self._velocity_forces(i, True)
            + g * self.K[i]
            + links[i].spring
            for i in self.mechanism.scene.prescribed
        )

    @lazy
    def kinetic(self) -> Node:
        """½ [φ̇ ṡ] [[A, E], [Eᵀ, G]] [φ̇ ṡ]ᵀ"""
        links = self.mechanism.links
        turn, slide = [k.rate for k in links], [k.length_rate for k in links]
        total = self.graph.zero
        for i in range(len(links)):
            total = total + turn[i] * (dot(self.A[i], turn) + 2 * dot(self.E[i], slide))
            total = total + slide[i] * dot(self.G[i], slide)
        return total / 2

    @lazy
    def potential(self) -> Node:
        """g Σ P sin φ and the springs' ½ k x²"""
        links, parents = self.mechanism.links, self.mechanism.parents
        total = self.mechanism.gravity * dot(self.P, [k.sin for k in links])
        for link, parent in zip(links, parents, strict=True):
            stretch = link.length - link.value("rest_length")
            turn = link.angle - (links[parent].angle if parent >= 0 else 0) - link.value("joint_rest_angle")
            total = total + link.value("stiffness") / 2 * (stretch * stretch)
            total = total + link.value("joint_stiffness") / 2 * (turn * turn)
        return total


class _Letters(Mapping[str, "Matrix | Vector"]):
    """The matrices by the paper's letters, each built when it is read."""

    NAMES = {letter: letter for letter in "ABCDEGHK"} | {"Λ": "Lambda"}

    def __init__(self, equations: MatrixEquations) -> None:
        self._equations = equations

    def __getitem__(self, letter: str) -> Matrix | Vector:
        rows = getattr(self._equations, self.NAMES[letter])
        return tuple(tuple(row) if isinstance(row, list) else row for row in rows)

    def __iter__(self) -> Iterator[str]:
        return iter(self.NAMES)

    def __len__(self) -> int:
        return len(self.NAMES)


def dot(a: Sequence[Node], b: Sequence[Node]) -> Node:
    """Σ a b over the nonzero products."""
    graph = a[0].graph
    zero = graph.zero
    return graph.sum(x * y for x, y in zip(a, b, strict=True) if x is not zero and y is not zero)


def derive(mechanism: Mechanism) -> MechanismEquations:
    """The matrix form of a scene."""
    return MatrixEquations(mechanism)
