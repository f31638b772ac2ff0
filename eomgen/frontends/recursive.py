"""The recursive method: the equations of n + 1 links from those of n.

The matrices of n links are padded with zeros and an increment is added. A new link ν has nothing below it,
so for links i, j above it (i above j or i = j) the increment of A is L_i L_j m_ν cos(φ_i - φ_j), in the row
and column of ν it is L_i S_ν cos(φ_i - φ_ν), on the diagonal T_ν; the other matrices alike (Borisov &
Rozenblat 2017, section 3). All increments of column j carry the same factor m_ν, so they are kept as one
growing number per column, the mass it carries, and a step costs only the depth of the new link.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

from eomgen.errors import OptionError, shown
from eomgen.frontends.mechanism import LinkSymbols, Mechanism, MechanismEquations
from eomgen.ir.equations import Equations, Matrix, Vector, lazy
from eomgen.ir.expr import Node
from eomgen.scene import AnyLink, Scene


class _Grown(NamedTuple):
    """What the links so far contribute.

    Attributes:
        carried: by link the mass it carries.
        turning: by link above and link below the cosine and the sine of the angle between them.
    """

    carried: list[Node]
    turning: dict[tuple[int, int], tuple[Node, Node]]


class RecursiveEquations(MechanismEquations):
    """Equations grown link by link.

    Args:
        mechanism: the scene as symbols.
        shorter: equations of the same scene without its last link, in the same graph, to start from.
    """

    method = "recursive"

    def __init__(self, mechanism: Mechanism, shorter: RecursiveEquations | None = None) -> None:
        super().__init__(mechanism)
        if shorter:
            self._grown = self._grow(shorter._grown)

    @cached_property
    def _grown(self) -> _Grown:
        """What all links contribute."""
        return self._grow(_Grown([], {}))

    def _grow(self, start: _Grown) -> _Grown:
        """The recursion: every new link brings its border, and the increments of all links above it."""
        links = self.mechanism.links
        carried, turning = list(start.carried), dict(start.turning)
        for new in range(len(carried), len(links)):
            added = links[new]
            for i in self.mechanism.ancestors(new):
                turning[i, new] = (
                    links[i].cos * added.cos + links[i].sin * added.sin,
                    links[i].sin * added.cos - links[i].cos * added.sin,
                )
                carried[i] = carried[i] + self.graph.sum(b.mass for b in added.bodies)
            carried.append(self.graph.zero)
        return _Grown(carried, turning)

    @cached_property
    def _borders(self) -> list[tuple[Node, Node]]:
        """Columns of A and E without the factors of the row: S + L m of the link and its slope, m the mass carried."""
        found: list[tuple[Node, Node]] = []
        for link, mass in zip(self.mechanism.links, self._grown.carried, strict=True):
            first = self.graph.sum(b.mass * link.reach(b.alpha, b.beta) for b in link.bodies)
            slope = self.graph.sum(b.mass * b.beta for b in link.bodies)
            found.append((first + mass * link.L, slope + mass * link.L1))
        return found

    def _corner(self, j: int) -> tuple[Node, Node, Node]:
        """Diagonal elements of A, D and G: T_ν, X_ν, S''_ν when link j was new, increased by what it carries."""
        link, mass = self.mechanism.links[j], self._grown.carried[j]
        turning, mixed, sliding = mass * link.L * link.L, mass * link.L * link.L1, mass * link.L1 * link.L1
        for body in link.bodies:
            r = link.reach(body.alpha, body.beta)
            turning = turning + (body.mass * r * r + body.inertia)
            mixed = mixed + body.mass * r * body.beta
            sliding = sliding + body.mass * body.beta * body.beta
        return turning, mixed, sliding

    @cached_property
    def matrices(self) -> Mapping[str, Matrix | Vector]:
        return {**self._squares, "C": self._weights[0], "K": self._weights[1]}

    @cached_property
    def _weights(self) -> tuple[Vector, Vector]:
        """C and K: what gravity pulls on every angle and every length."""
        pairs = list(zip(self._borders, self.mechanism.links, strict=True))
        return tuple(P * link.cos for (P, _), link in pairs), tuple(slope * link.sin for (_, slope), link in pairs)

    @cached_property
    def _squares(self) -> dict[str, Matrix]:
        links, zero = self.mechanism.links, self.graph.zero
        m = len(links)
        A, B, D, E, G, H, Lambda = ([[zero] * m for _ in range(m)] for _ in range(7))
        for j in range(m):
            A[j][j], D[j][j], G[j][j] = self._corner(j)
            H[j][j] = -D[j][j]
        for (i, j), (c, s) in self._grown.turning.items():
            P, slope = self._borders[j]
            turn, slide = links[i].L, links[i].L1
            A[i][j] = A[j][i] = turn * P * c
            B[i][j] = turn * P * s
            B[j][i] = -B[i][j]
            if slope is not zero:
                D[i][j] = turn * slope * c
                H[j][i] = -D[i][j]
                E[i][j] = -(turn * slope * s)
                G[i][j] = G[j][i] = slide * slope * c
                Lambda[i][j] = slide * slope * s
                Lambda[j][i] = -Lambda[i][j]
            if slide is not zero:
                D[j][i] = slide * P * c
                H[i][j] = -D[j][i]
                E[j][i] = slide * P * s
        return {
            name: tuple(tuple(row) for row in rows)
            for name, rows in zip("ABDEGHΛ", (A, B, D, E, G, H, Lambda), strict=True)
        }

    @lazy
    def mass_matrix(self) -> Matrix:
        free, squares = self.mechanism.scene.free, self._squares
        A, E, G = squares["A"], squares["E"], squares["G"]
        top = [(*row, *(E[i][j] for j in free)) for i, row in enumerate(A)]
        bottom = [(*(row[j] for row in E), *(G[j][k] for k in free)) for j in free]
        return (*top, *bottom)

    def _forces(self, angles: Sequence[Node], lengths: Sequence[Node]) -> Vector:
        return (*angles, *(lengths[i] for i in self.mechanism.scene.free))

    @cached_property
    def _velocity_rows(self) -> tuple[list[Node], list[Node]]:
        """Forces of the motion on every angle and every length (prescribed ones too), pair by pair."""
        zero, links = self.graph.zero, self.mechanism.links
        turning: list[Node] = []
        sliding: list[Node] = []
        # Acceleration of a far end against its joint, without what the unknown accelerations add,
        # along the link and across it.
        along = [self._given(k) * k.L1 - k.L * (k.rate * k.rate) for k in links]
        across = [2 * (k.rate * k.length_rate) * k.L1 for k in links]
        for j, link in enumerate(links):
            _, mixed, second = self._corner(j)
            turning.append(mixed * (2 * (link.rate * link.length_rate)))
            sliding.append(second * self._given(link) - mixed * (link.rate * link.rate))
        for (i, j), (c, s) in self._grown.turning.items():
            upper, lower = links[i], links[j]
            P, slope = self._borders[j]
            pull = slope * self._given(lower) - P * (lower.rate * lower.rate)
            push = slope * (2 * (lower.rate * lower.length_rate))
            turning[i] = turning[i] + upper.L * (push * c - pull * s)
            sliding[i] = sliding[i] + upper.L1 * (pull * c + push * s)
            turning[j] = turning[j] + P * (across[i] * c + along[i] * s)
            if slope is not zero:
                sliding[j] = sliding[j] + slope * (along[i] * c - across[i] * s)
        return turning, sliding

    def _given(self, link: LinkSymbols) -> Node:
        """The prescribed s̈ of a link, zero for other lengths."""
        return link.length_acceleration if link.varies and not link.free else self.graph.zero

    @lazy
    def bias_parts(self) -> dict[str, Vector]:
        g, (C, K), links = self.mechanism.gravity, self._weights, self.mechanism.links
        springs = [self.graph.zero] * len(links)
        for i, parent in enumerate(self.mechanism.parents):
            springs[i] = springs[i] + links[i].joint_spring
            if parent >= 0:
                springs[parent] = springs[parent] - links[i].joint_spring
        return {
            "velocity": self._forces(*self._velocity_rows),
            "gravity": self._forces([g * x for x in C], [g * x for x in K]),
            "springs": self._forces(springs, [k.spring for k in links]),
        }

    @lazy
    def prescribed_forces(self) -> Vector:
        links, total = self.mechanism.links, self.graph.sum
        E, G, K = self._squares["E"], self._squares["G"], self._weights[1]
        return tuple(
            total(E[j][i] * k.acceleration for j, k in enumerate(links))
            + total(G[i][j] * k.length_acceleration for j, k in enumerate(links) if k.free)
            + self._velocity_rows[1][i]
            + self.mechanism.gravity * K[i]
            + links[i].spring
            for i in self.mechanism.scene.prescribed
        )

    @lazy
    def kinetic(self) -> Node:
        """Every link adds ½ m V² + V · (S φ̇ n + S' ṡ u) + ½ (T φ̇² + S'' ṡ²), V the velocity of its joint.

        (The mixed term X φ̇ ṡ vanishes: u and n are orthogonal.)
        """
        zero = self.graph.zero
        ends: list[tuple[Node, Node]] = []
        total = zero
        for link, parent in zip(self.mechanism.links, self.mechanism.parents, strict=True):
            vx, vy = ends[parent] if parent >= 0 else (zero, zero)
            k = link.moments
            across = link.cos * vy - link.sin * vx
            along = link.cos * vx + link.sin * vy
            total = total + k.m * (vx * vx + vy * vy) / 2
            total = total + link.rate * (k.S * across + k.T * link.rate / 2)
            total = total + link.length_rate * (k.S1 * along + k.S2 * link.length_rate / 2)
            turn, slide = link.L * link.rate, link.L1 * link.length_rate
            ends.append((vx + slide * link.cos - turn * link.sin, vy + slide * link.sin + turn * link.cos))
        return total

    @lazy
    def potential(self) -> Node:
        """Every link adds g (m y + S sin φ), y the height of its joint, and its springs' energy."""
        heights: list[Node] = []
        weight = springs = self.graph.zero
        for link, parent in zip(self.mechanism.links, self.mechanism.parents, strict=True):
            y = heights[parent] if parent >= 0 else self.graph.zero
            heights.append(y + link.L * link.sin)
            weight = weight + (link.moments.m * y + link.moments.S * link.sin)
            turn = link.angle - (self.mechanism.links[parent].angle if parent >= 0 else 0)
            turn = turn - link.value("joint_rest_angle")
            stretch = link.length - link.value("rest_length")
            springs = springs + link.value("stiffness") * stretch * stretch
            springs = springs + link.value("joint_stiffness") * turn * turn
        return self.mechanism.gravity * weight + springs / 2


def derive(mechanism: Mechanism) -> MechanismEquations:
    """The equations of a scene, grown from none."""
    return RecursiveEquations(mechanism)


def extend(equations: Equations, link: AnyLink) -> RecursiveEquations:
    """The equations with one more link, reusing everything derived so far.

    Args:
        equations: from `derive` or `extend` of this method.
        link: the new link; its parent is a link of the scene or the ground.

    Raises:
        OptionError: what is given are no equations, or they come from another method.
        SceneError: the link does not fit the scene.
    """
    if not isinstance(equations, Equations):
        raise OptionError(f"{shown(equations)} are no equations; use eomgen.derive(scene, method='recursive')")
    if not isinstance(equations, RecursiveEquations):
        raise OptionError(f"method {equations.method!r} cannot be extended; derive with method 'recursive'")
    shorter = equations.mechanism
    scene = Scene(name=shorter.scene.name, links=(*shorter.scene.links, link), gravity=shorter.scene.gravity)
    longer = Mechanism(scene, fold=shorter.fold, graph=shorter.graph)
    return RecursiveEquations(longer, shorter=equations)
