"""Matrices derived from the equations: the Jacobian of forward dynamics and the regressor of inverse dynamics."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence

from eomgen.frontends import articulated
from eomgen.frontends.matrix import MatrixEquations
from eomgen.frontends.mechanism import Mechanism, MechanismEquations, Moments
from eomgen.ir.count import operations
from eomgen.ir.derivative import Tape
from eomgen.ir.equations import Equations, solve
from eomgen.ir.expr import Graph, Node

Rows = list[list[Node]]


def jacobian(equations: Equations) -> list[Node]:
    """The derivatives of the accelerations by q, v and u, row by row, (n, 2 n + nu).

    They come from inverse dynamics: with r = M a + h - Q(u), ∂a/∂x = -M⁻¹ ∂r/∂x (Carpentier & Mansard 2018). The
    residual is that of the method or of the matrix form of the same scene, whichever needs fewer operations.
    """
    return _flat(_cheaper(equations, lambda e: _jacobian(e, [*e.q, *e.v], inputs=True)))


def parameter_jacobian(equations: Equations) -> list[Node]:
    """The derivatives of the accelerations by the parameters, row by row, (n, np)."""
    return _flat(_cheaper(equations, lambda e: _jacobian(e, list(e.p), inputs=False)))


def _cheaper(equations: Equations, build: Callable[[Equations], Rows]) -> Rows:
    found = build(equations)
    if isinstance(equations, MechanismEquations) and not isinstance(equations, MatrixEquations):
        other = build(MatrixEquations(equations.mechanism))
        if operations(_flat(other)).total() < operations(_flat(found)).total():
            return other
    return found


def _flat(rows: Rows) -> list[Node]:
    return [node for row in rows for node in row]


def _jacobian(equations: Equations, wrt: Sequence[Node], inputs: bool) -> Rows:
    graph, n, M = equations.graph, len(equations.q), equations.mass_matrix
    right = [Q - h for Q, h in zip(equations.generalised_force(equations.u), equations.bias, strict=True)]
    accelerations = solve(M, right, equations.elimination_order)
    residual = [
        graph.sum(m * a for m, a in zip(row, accelerations, strict=True)) + h
        for row, h in zip(M, equations.bias, strict=True)
    ]
    tape = Tape(residual, leaves=frozenset(accelerations))
    columns = [[-r for r in tape.forward({x: graph.one})] for x in wrt]
    if inputs:
        force = Tape(equations.generalised_force(equations.u))
        columns += [list(force.forward({u: graph.one})) for u in equations.u]
    solved = [solve(M, column, equations.elimination_order) for column in columns]
    return [[column[i] for column in solved] for i in range(n)]


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
    return float(graph.node(value).value)  # type: ignore[arg-type]


_REGRESSORS: weakref.WeakKeyDictionary[Equations, Regressor] = weakref.WeakKeyDictionary()


def regressor(equations: Equations) -> Regressor:
    """The regressor of a scene's equations, made once."""
    assert isinstance(equations, MechanismEquations)
    if equations not in _REGRESSORS:
        _REGRESSORS[equations] = Regressor(equations)
    return _REGRESSORS[equations]
