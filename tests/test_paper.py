"""The formulas of the paper as it prints them, written down once more, from sums of their own.

A. V. Borisov, G. M. Rozenblat, Computer Research and Modeling, 2017, 9(2), 201-210; `docs/mechanics.md` has them in
general form, for links with an attachment point A and any far end L = α + β s.
"""

from collections.abc import Callable
from typing import NamedTuple

import pytest

import eomgen
from bench.cases import CASES, line, tree
from eomgen.frontends.mechanism import LinkSymbols, Mechanism, MechanismEquations
from eomgen.ir.derivative import Tape
from eomgen.ir.expr import Node
from tests.exact import dot, exact, flat

HAVE_MATRICES = pytest.mark.parametrize("method", ["matrix", "recursive"])
Rows = list[list[Node]]


# Formula (7): the matrix A of a chain of elastic rods


@HAVE_MATRICES
@pytest.mark.parametrize("links", [1, 2, 3, 5])
def test_formula_7(links: int, method: str) -> None:
    """A_ij = (l_i + ξ_i) (m_j (ξ_j + l_j/2) + (l_j + ξ_j) Σ_{k>j} m_k) cos(φ_i - φ_j) for i < j,

    A_ii = I_i + m_i (ξ_i² + l_i ξ_i) + (l_i + ξ_i)² Σ_{k>i} m_k, with I about the rod's near end.
    """
    scene = tree("chain", line(links), "elastic-rod", changes={i: {"inertia": 1.0} for i in range(links)})
    equations = eomgen.derive(scene, method)
    graph, symbol = equations.graph, equations.graph.symbol

    def of(name: str) -> list[Node]:
        return [symbol(f"link{i + 1}.{name}") for i in range(links)]

    m, l, x, I, angle = (of(name) for name in ("mass", "rod_length", "length", "inertia", "angle"))  # noqa: E741
    beyond = [graph.sum(m[i + 1 :]) for i in range(links)]

    def element(i: int, j: int) -> Node:
        reach = l[j] + x[j]
        if i == j:
            return I[i] + m[i] * (x[i] * x[i] + l[i] * x[i]) + reach * reach * beyond[i]
        carried = m[j] * (x[j] + l[j] / 2) + reach * beyond[j]
        return (l[i] + x[i]) * carried * graph.cos(angle[i] - angle[j])

    printed = [element(min(i, j), max(i, j)) for i in range(links) for j in range(links)]
    assert exact(flat(equations["A"])) == exact(printed)


# The recurrence: matrices of n + 1 links are those of n, padded with zeros, and an increment


class Sums(NamedTuple):
    """What the increments need of a link: L and L', and the moments of its own bodies."""

    L: Node
    L1: Node
    S: Node
    S1: Node
    T: Node
    X: Node
    S2: Node
    m: Node


def sums(link: LinkSymbols) -> Sums:
    total = link.graph.sum
    bodies = [(b.mass, b.alpha + b.beta * link.length, b.beta, b.inertia) for b in link.bodies]
    return Sums(
        L=link.L,
        L1=link.L1,
        S=total(m * r for m, r, _, _ in bodies),
        S1=total(m * beta for m, _, beta, _ in bodies),
        T=total(m * r * r + inertia for m, r, _, inertia in bodies),
        X=total(m * beta * r for m, r, beta, _ in bodies),
        S2=total(m * beta * beta for m, _, beta, _ in bodies),
        m=total(m for m, _, _, _ in bodies),
    )


class Pair(NamedTuple):
    """Link i above link j: what stands in row i, column j and in row j, column i of a matrix.

    `P` and `P1` are what j adds to the first moment and to its slope: those of its bodies when j is the new
    link, L_j m and L'_j m when it is above the new link, of mass m.
    """

    upper: Callable[[Sums, Node, Node, Node, Node], Node]
    lower: Callable[[Sums, Node, Node, Node, Node], Node]


def same(element: Callable[[Sums, Node, Node, Node, Node], Node], sign: int = 1) -> Pair:
    return Pair(element, lambda *args: sign * element(*args))


# Letter: the pair's elements from (link i, P_j, P'_j, cos(φ_i - φ_j), sin(φ_i - φ_j)).
PAIRS = {
    "A": same(lambda i, P, P1, c, s: i.L * P * c),
    "B": same(lambda i, P, P1, c, s: i.L * P * s, -1),
    "D": Pair(lambda i, P, P1, c, s: i.L * P1 * c, lambda i, P, P1, c, s: i.L1 * P * c),
    "E": Pair(lambda i, P, P1, c, s: -(i.L * P1 * s), lambda i, P, P1, c, s: i.L1 * P * s),
    "G": same(lambda i, P, P1, c, s: i.L1 * P1 * c),
    "H": Pair(lambda i, P, P1, c, s: -(i.L1 * P * c), lambda i, P, P1, c, s: -(i.L * P1 * c)),
    "Λ": same(lambda i, P, P1, c, s: i.L1 * P1 * s, -1),
}
# Letter: the diagonal element of the new link, and what its mass adds to that of a link above it.
DIAGONALS: dict[str, tuple[Callable[[Sums], Node | int], Callable[[Sums, Node], Node | int]]] = {
    "A": (lambda k: k.T, lambda k, m: k.L * k.L * m),
    "D": (lambda k: k.X, lambda k, m: k.L * k.L1 * m),
    "G": (lambda k: k.S2, lambda k, m: k.L1 * k.L1 * m),
    "H": (lambda k: -k.X, lambda k, m: -(k.L * k.L1 * m)),
}
NOTHING = (lambda k: 0, lambda k, m: 0)


def add(row: list[Node], column: int, term: Node | int) -> None:
    row[column] = row[column] + term


def by_recurrence(mechanism: Mechanism, letter: str) -> Rows:
    """A matrix grown from nothing, a link at a time."""
    graph, rows = mechanism.graph, []
    links = [sums(link) for link in mechanism.links]
    first, more = DIAGONALS.get(letter, NOTHING)
    pair = PAIRS[letter]
    for new, link in enumerate(links):
        rows = [[*row, graph.zero] for row in rows] + [[graph.zero] * (new + 1)]
        path = [new, *mechanism.ancestors(new)]
        for depth, j in enumerate(path):
            P, P1 = (link.S, link.S1) if j == new else (links[j].L * link.m, links[j].L1 * link.m)
            add(rows[j], j, first(link) if j == new else more(links[j], link.m))
            for i in path[depth + 1 :]:
                turn = mechanism.links[i].angle - mechanism.links[j].angle
                arguments = (links[i], P, P1, graph.cos(turn), graph.sin(turn))
                add(rows[i], j, pair.upper(*arguments))
                add(rows[j], i, pair.lower(*arguments))
    return rows


@HAVE_MATRICES
@pytest.mark.parametrize("letter", PAIRS)
@pytest.mark.parametrize("case", ["elastic_rod_4", "point_masses_4", "models_5", "roots", "hanging_branch"])
def test_recurrence(case: str, letter: str, method: str) -> None:
    equations = eomgen.derive(CASES[case], method)
    rows = by_recurrence(equations.mechanism, letter)
    assert exact(flat(equations[letter])) == exact([element for row in rows for element in row])


@HAVE_MATRICES
@pytest.mark.parametrize("case", ["elastic_rod_4", "point_masses_4", "models_5", "roots", "hanging_branch"])
def test_recurrence_of_the_weights(case: str, method: str) -> None:
    """C_j and K_j: P_j cos φ_j and P'_j sin φ_j, P and P' growing by L m and L' m."""
    equations = eomgen.derive(CASES[case], method)
    mechanism = equations.mechanism
    graph, links = mechanism.graph, [sums(link) for link in mechanism.links]
    P, P1 = [link.S for link in links], [link.S1 for link in links]
    for new, link in enumerate(links):
        for j in mechanism.ancestors(new):
            P[j], P1[j] = P[j] + links[j].L * link.m, P1[j] + links[j].L1 * link.m
    angles = [link.angle for link in mechanism.links]
    assert exact(equations["C"]) == exact([x * graph.cos(angle) for x, angle in zip(P, angles, strict=True)])
    assert exact(equations["K"]) == exact([x * graph.sin(angle) for x, angle in zip(P1, angles, strict=True)])


# Equations (5) and (6): the named matrices are the equations


def assembled(equations: MechanismEquations, along: bool) -> list[Node]:
    """A φ̈ + E s̈ + B φ̇² + 2 D (φ̇ ṡ) + g C per angle; Eᵀ φ̈ + G s̈ + H φ̇² + 2 Λ (φ̇ ṡ) + g K per length."""
    links, g = equations.mechanism.links, equations.mechanism.gravity
    turning = zip(*equations["E"], strict=True) if along else equations["A"]
    sliding, square, mixed, weight = (equations[letter] for letter in ("GHΛK" if along else "EBDC"))
    a = [link.acceleration for link in links]
    s = [link.length_acceleration for link in links]
    squares = [link.rate * link.rate for link in links]
    products = [2 * link.rate * link.length_rate for link in links]
    return [
        dot(A, a) + dot(E, s) + dot(B, squares) + dot(D, products) + g * C
        for A, E, B, D, C in zip(turning, sliding, square, mixed, weight, strict=True)
    ]


@HAVE_MATRICES
@pytest.mark.parametrize("case", [name for name in CASES if not name.endswith(("_1", "_2", "_4"))])
def test_equations_5_and_6(case: str, method: str) -> None:
    """They say the same as M a + h and the prescribed forces, springs apart: the paper has none."""
    equations = eomgen.derive(CASES[case], method)
    scene, m = CASES[case], len(CASES[case].links)
    total = [
        dot(row, equations.a) + velocity + weight
        for row, velocity, weight in zip(
            equations.mass_matrix, equations.bias_parts["velocity"], equations.bias_parts["gravity"], strict=True
        )
    ]
    turning, sliding = assembled(equations, along=False), assembled(equations, along=True)
    assert exact(turning) == exact(total[:m])
    assert exact([sliding[i] for i in scene.free]) == exact(total[m:])
    springs = [equations.mechanism.links[i].spring for i in scene.prescribed]
    pushed = [force - spring for force, spring in zip(equations.prescribed_forces, springs, strict=True)]
    assert exact([sliding[i] for i in scene.prescribed]) == exact(pushed)


# Equation (1): where its gravity acts


def one_rod(arm: str) -> tuple[MechanismEquations, Node]:
    """The equations of one elastic rod, and what an equation (1) with another gravity arm asks of the torque."""
    equations = eomgen.derive(tree("rod", line(1), "elastic-rod", changes={0: {"inertia": 0.4}}))
    symbol = equations.graph.symbol
    mass, rod, x = (symbol(f"link1.{name}") for name in ("mass", "rod_length", "length"))
    arms = {"printed": rod + x / 2, "corrected": x + rod / 2}
    weight = symbol("gravity") * mass * equations.graph.cos(equations.q[0])
    return equations, equations.inverse_dynamics[0] + weight * (arms[arm] - arms["corrected"])


@pytest.mark.parametrize(("arm", "kept"), [("corrected", True), ("printed", False)])
def test_gravity_arm_of_equation_1(arm: str, kept: bool) -> None:
    """With the printed arm l + ξ/2 the energy is not kept; with that of the rod's centre, ξ + l/2, it is."""
    equations, torque = one_rod(arm)
    flow = dict(zip((*equations.q, *equations.v), (*equations.v, *equations.a), strict=True))
    (gained,) = Tape([equations.kinetic + equations.potential]).forward(flow)
    power = torque * equations.v[0] + equations.inverse_dynamics[1] * equations.v[1]
    assert (exact([gained]) == exact([power])) == kept


@pytest.mark.parametrize(("arm", "potential"), [("corrected", True), ("printed", False)])
def test_no_energy_at_all_belongs_to_the_printed_arm(arm: str, potential: bool) -> None:
    """Equations (1) and (2) have a common potential only if ∂(1)/∂ξ = ∂(2)/∂φ in their gravity terms."""
    equations, torque = one_rod(arm)
    still = dict.fromkeys((*equations.v, *equations.a), 0)
    angle, length = equations.q
    one = equations.graph.one
    (by_length,), (by_angle,) = (
        Tape([force]).forward({symbol: one})
        for force, symbol in ((torque, length), (equations.inverse_dynamics[1], angle))
    )
    assert (exact([by_length], still) == exact([by_angle], still)) == potential


# The printed kinetic energy of n links couples neighbours only


@pytest.mark.parametrize(("links", "same_"), [(2, True), (3, False)])
def test_kinetic_energy_of_neighbours_only(links: int, same_: bool) -> None:
    """It is the kinetic energy of two links, and no longer that of three."""
    equations = eomgen.derive(tree("chain", line(links), "elastic-rod"))
    M, m = equations.mass_matrix, links
    full = equations.kinetic
    far = [
        M[row][column] * equations.v[row] * equations.v[column]
        for row in range(2 * m)
        for column in range(2 * m)
        if abs(row % m - column % m) > 1
    ]
    assert (exact([full]) == exact([full - equations.graph.sum(far) / 2])) == same_
