"""Matrices derived from the equations: the Jacobian of forward dynamics and the regressor of inverse dynamics."""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Sequence

from eomgen.errors import UnsupportedError
from eomgen.frontends import articulated
from eomgen.frontends.matrix import Elements, MatrixEquations, dot
from eomgen.frontends.mechanism import Mechanism, MechanismEquations, Moments
from eomgen.ir.count import operations
from eomgen.ir.derivative import Tape
from eomgen.ir.equations import Equations, Vector
from eomgen.ir.expr import Graph, Node
from eomgen.ir.statements import finite

Columns = Sequence[Vector]  # of a matrix
Weighted = Sequence[tuple[Node, Vector]]  # a sum of columns times weights


def jacobian(equations: Equations) -> list[Node]:
    """The derivatives of the accelerations by q, v and u, row by row, (n, 2 n + nu).

    They come from inverse dynamics: with r = M a + h - Q(u), ∂a/∂x = -M⁻¹ ∂r/∂x (Carpentier & Mansard 2018). The
    residual is that of the method or of the matrix form of the same scene, differentiated on the graph or, for the
    latter, in closed form: what needs fewest operations.
    """
    forms = _forms(equations)
    found = [_differentiated(e, [*e.q, *e.v], inputs=True) for e in forms]
    matrix = forms[-1]
    if isinstance(matrix, MatrixEquations):
        found += [
            _closed(matrix, through) for through in (matrix.elimination.solve, matrix.elimination.solve_by_inverse)
        ]
    return _shortest(found)


def parameter_jacobian(equations: Equations) -> list[Node]:
    """The derivatives of the accelerations by the parameters, row by row, (n, np)."""
    found = [_differentiated(e, list(e.p), inputs=False) for e in _forms(equations)]
    return _shortest(found)


def _forms(equations: Equations) -> list[Equations]:
    """The equations, and the matrix form of their scene."""
    if isinstance(equations, MechanismEquations) and not isinstance(equations, MatrixEquations):
        return [equations, MatrixEquations(equations.mechanism)]
    return [equations]


def _flat(columns: Columns) -> list[Node]:
    """The elements row by row."""
    return [column[i] for i in range(len(columns[0])) for column in columns]


def _shortest(matrices: Sequence[Columns]) -> list[Node]:
    """The elements, row by row, of the matrix that needs fewest operations."""
    return min(map(_flat, matrices), key=lambda nodes: operations(nodes).total())


def _differentiated(equations: Equations, wrt: Sequence[Node], inputs: bool) -> Columns:
    """The derivatives of the accelerations by some symbols, and by u if wanted, on the graph: a column of n each."""
    graph, M, solve = equations.graph, equations.mass_matrix, equations.elimination.solve
    right = [Q - h for Q, h in zip(equations.generalised_force(equations.u), equations.bias, strict=True)]
    accelerations = solve(right)
    residual = [
        graph.sum(m * a for m, a in zip(row, accelerations, strict=True)) + h
        for row, h in zip(M, equations.bias, strict=True)
    ]
    tape = Tape(residual, leaves=frozenset(accelerations))
    columns = [[-r for r in tape.forward({x: graph.one})] for x in wrt]
    if inputs:
        force = Tape(equations.generalised_force(equations.u))
        columns += [list(force.forward({u: graph.one})) for u in equations.u]
    return [solve(column) for column in columns]


def _closed(equations: MatrixEquations, through: Callable[[Sequence[Node]], Vector]) -> Columns:
    """The Jacobian of a scene in closed form.

    Outside its own rows (φ and s of the link) link j enters r in products with cos(φ_i - φ_j) and sin(φ_i - φ_j), so
    with the columns b of B over H, d of D over Λ, m of A over Eᵀ and e of E over G, there

        ∂r/∂φ_j = b_j φ̈_j + d_j s̈_j - m_j φ̇_j² - e_j 2 φ̇_j ṡ_j        ∂r/∂φ̇_j = 2 (b_j φ̇_j + d_j ṡ_j)
        ∂r/∂s_j = d_j φ̈_j - e_j φ̇_j²                                  ∂r/∂ṡ_j = 2 d_j φ̇_j

    M⁻¹ b_j and M⁻¹ d_j serve two derivatives each. m_j and e_j are columns of M, so M⁻¹ times one without its own rows
    is minus M⁻¹ times those in all rows but its own, where it is summed up since a difference would cancel. What is
    left are few elements, of the own rows and of springs, times columns of M⁻¹.

    Args:
        equations: the matrix form.
        through: M⁻¹ times a column, (n,).

    Returns:
        The columns of the derivatives by q, v and u, (2 n + nu) of n elements.
    """
    graph, links, free = equations.graph, equations.mechanism.links, equations.mechanism.scene.free
    zero, M, inverse = graph.zero, equations.mass_matrix, equations.elimination.inverse
    length_of = {j: len(links) + k for k, j in enumerate(free)}
    right = [Q - h for Q, h in zip(equations.generalised_force(equations.u), equations.bias, strict=True)]
    a = equations.elimination.solve(right)
    velocity, gravity, springs = (equations.bias_parts[name] for name in ("velocity", "gravity", "springs"))
    moving = [dot(row, a) + h + g for row, h, g in zip(M, velocity, gravity, strict=True)]
    tapes = [Tape([r], leaves=frozenset(a)) for r in moving]
    spring_tape, force_tape = Tape(springs), Tape(equations.generalised_force(equations.u))

    def away(upper: Elements, lower: Elements, j: int) -> Vector:
        """A column without the rows of link j, negative."""
        column = [row[j] for row in upper] + [lower[i][j] for i in free]
        return tuple(zero if i in (j, length_of.get(j)) else -x for i, x in enumerate(column))

    def combined(weighted: Weighted) -> Vector:
        return tuple(dot([w for w, _ in weighted], [column[i] for _, column in weighted]) for i in range(len(M)))

    def derivative(x: Node, own: list[int], weighted: Weighted, kept: dict[int, Node]) -> Vector:
        """∂a/∂x from columns times weights, those of M (`kept`) without the rows `own`, and what is left of ∂r/∂x."""
        left = [-y for y in spring_tape.forward({x: graph.one})]
        for i in own:
            left[i] = left[i] - tapes[i].forward({x: graph.one})[0]
        undone = [y - graph.sum(M[i][k] * w for k, w in kept.items()) if i in own else y for i, y in enumerate(left)]
        found = list(combined(weighted))
        for i, row in enumerate(inverse):
            if i in own:
                rest = [zero if k in own else y for k, y in enumerate(row)]
                found[i] = found[i] + graph.sum(w * dot(rest, M[k]) for k, w in kept.items())
            found[i] = found[i] + dot(row, left if i in own else undone)
        return tuple(found)

    angles, lengths, rates, speeds = [], [], [], []
    for j, link in enumerate(links):
        b, d = away(equations.B, equations.H, j), away(equations.D, equations.Lambda, j)
        spin, slide = link.rate, link.length_rate
        square, mixed = spin * spin, 2 * (spin * slide)
        own, kept, stretching = [j], {j: square}, link.length_acceleration
        if link.free:
            s = length_of[j]
            own, kept, stretching = [j, s], {j: square, s: mixed}, a[s]
        given = link.varies and not link.free
        if not given:
            b, d = through(b), through(d)
        by_angle, by_rate = [(a[j], b), (stretching, d)], [(2 * spin, b), (2 * slide, d)]
        if given:  # two sums, not three columns, one of which M does not have
            by_angle.append((-mixed, away(equations.E, equations.G, j)))
            by_angle, by_rate = ([(graph.one, through(combined(x)))] for x in (by_angle, by_rate))
        angles.append(derivative(link.angle, own, by_angle, kept))
        rates.append(derivative(link.rate, own, by_rate, {}))
        if link.free:
            lengths.append(derivative(link.length, own, [(a[j], d)], {s: square}))
            speeds.append(derivative(link.length_rate, own, [(2 * spin, d)], {}))
    exerted = [force_tape.forward({u: graph.one}) for u in equations.u]
    return [*angles, *lengths, *rates, *speeds, *(tuple(dot(row, Q) for row in inverse) for Q in exerted)]


class Regressor:
    """Inverse dynamics as a matrix times the parameters in which it is linear: u = Y(q, v, a, w) b.

    Per link b holds those of Σ m, Σ m α, Σ m β, Σ (m α² + J), Σ m α β, Σ m β² that the link's shape leaves, and the
    stiffnesses and dampings that the scene has; the geometry and gravity are the scene's numbers.

    Attributes:
        names: names of b, "shank.mass_alpha" and the like.
        values: b of the scene.
        nodes: Y, (nu, nb), row by row.
        symbols: the arguments, in whose graph Y is.
    """

    MOMENTS = ("mass", "mass_alpha", "mass_beta", "mass_alpha2", "mass_alpha_beta", "mass_beta2")
    ELASTIC = ("stiffness", "damping", "joint_stiffness", "joint_damping")

    def __init__(self, equations: MechanismEquations) -> None:
        mechanism = Mechanism(equations.mechanism.scene, fold=True)
        graph = mechanism.graph
        self.names: list[str] = []
        self.values: list[float] = []
        linear: list[Node] = []

        def parameter(name: str, value: float) -> Node:
            if not value:
                return graph.zero
            if not math.isfinite(value):
                raise UnsupportedError(f"{name} of the regressor's b is {value}; use smaller numbers, or other units")
            self.names.append(name)
            self.values.append(value)
            linear.append(graph.symbol(f"b.{name}"))
            return linear[-1]

        for link in mechanism.links:
            bodies = [tuple(_number(graph, x) for x in body) for body in link.bodies]
            sums = (
                sum(m for m, _, _, _ in bodies),
                sum(m * a for m, a, _, _ in bodies),
                sum(m * b for m, _, b, _ in bodies),
                sum(m * a * a + J for m, a, _, J in bodies),
                sum(m * a * b for m, a, b, _ in bodies),
                sum(m * b * b for m, _, b, _ in bodies),
            )
            named = zip(self.MOMENTS, sums, strict=True)
            m, a, b, aa, ab, bb = (parameter(f"{link.name}.{name}", value) for name, value in named)
            s = link.length
            link.moments = Moments(m=m, S=a + b * s, T=aa + s * (2 * ab + bb * s), S1=b, S2=bb, X=ab + bb * s)
            for name in self.ELASTIC:
                link.values[name] = parameter(f"{link.name}.{name}", float(link.value(name).value))
        results = articulated.unroll(mechanism, articulated.newton_euler(mechanism))
        free = mechanism.scene.free
        inverse = [*(r["torque"] for r in results), *(results[i]["length"] for i in free)]
        tape = Tape(inverse)
        columns = [tape.forward({symbol: graph.one}) for symbol in linear]
        self.nodes = [column[i] for i in range(len(inverse)) for column in columns]
        self.symbols = mechanism.symbols


def _number(graph: Graph, value: object) -> float:
    return finite(graph.node(value).value)  # type: ignore[arg-type]


_REGRESSORS: weakref.WeakKeyDictionary[Equations, Regressor] = weakref.WeakKeyDictionary()


def regressor(equations: Equations) -> Regressor:
    """The regressor of a scene's equations, made once."""
    assert isinstance(equations, MechanismEquations)
    if equations not in _REGRESSORS:
        _REGRESSORS[equations] = Regressor(equations)
    return _REGRESSORS[equations]
