"""Lagrange's equations of the second kind, from the energies alone.

Positions are written down; velocities, momenta ∂T/∂q̇, forces ∂T/∂q and ∂V/∂q, and the time derivative are
found by differentiating the expression graph. No formula enters but ṙ² + r²φ̇², the square of a velocity in polar
coordinates, and

    d/dt ∂T/∂q̇ - ∂T/∂q + ∂V/∂q + ∂R/∂q̇ = Q

with the dissipation R of the dampers (Goldstein, Poole & Safko 2002, sections 1.5 and 1.6). Prescribed
lengths are differentiated like coordinates, so s, ṡ and s̈ always travel together.
"""

from __future__ import annotations

from functools import cached_property

from eomgen.frontends.mechanism import Mechanism, MechanismEquations
from eomgen.ir.derivative import Tape
from eomgen.ir.equations import Equations, Matrix, Symbols, Vector, lazy
from eomgen.ir.expr import Node


class LagrangeEquations(Equations):
    """Equations from a kinetic energy, potential energies and a dissipation.

    Args:
        symbols: the symbols; prescribed lengths (rows of w) count as further coordinates.
        kinetic: T(q, v), J.
        gravity: the potential energy of gravity (any potential energy of q for a user's own system), J.
        springs: the potential energy of springs, J.
        dissipation: R(v), half the power that dampers take, W.
    """

    method = "lagrange"

    def __init__(self, symbols: Symbols, kinetic: Node, gravity: Node, springs: Node, dissipation: Node) -> None:
        Equations.__init__(self, symbols)
        self._kinetic, self._gravity, self._springs = kinetic, gravity, springs
        self._dissipation = dissipation
        self._positions = (*symbols.q, *(row[0] for row in symbols.w))
        self._rates = (*symbols.v, *(row[1] for row in symbols.w))

    @lazy
    def kinetic(self) -> Node:
        return self._kinetic

    @lazy
    def potential(self) -> Node:
        return self._gravity + self._springs

    @cached_property
    def _momenta(self) -> Tape:
        return Tape(Tape([self._kinetic]).reverse(self._rates))

    @lazy
    def mass_matrix(self) -> Matrix:
        n, one = len(self.q), self.graph.one
        columns = [self._momenta.forward({rate: one}) for rate in self.v]
        return tuple(tuple(columns[max(i, j)][min(i, j)] for j in range(n)) for i in range(n))

    @cached_property
    def _inertia_forces(self) -> Vector:
        """d/dt ∂T/∂q̇ - ∂T/∂q with a = 0, for coordinates and prescribed lengths."""
        flow = dict(zip(self._positions, self._rates, strict=True))
        flow.update((rate, acceleration) for _, rate, acceleration in self.w)
        drift = self._momenta.forward(flow)
        force = Tape([self._kinetic]).reverse(self._positions)
        return tuple(d - f for d, f in zip(drift, force, strict=True))

    @cached_property
    def _gravity_forces(self) -> Vector:
        return Tape([self._gravity]).reverse(self._positions)

    @cached_property
    def _spring_forces(self) -> Vector:
        stretched = Tape([self._springs]).reverse(self._positions)
        damped = Tape([self._dissipation]).reverse(self._rates)
        return tuple(s + d for s, d in zip(stretched, damped, strict=True))

    @lazy
    def bias_parts(self) -> dict[str, Vector]:
        n = len(self.q)
        return {
            "velocity": self._inertia_forces[:n],
            "gravity": self._gravity_forces[:n],
            "springs": self._spring_forces[:n],
        }

    @lazy
    def prescribed_forces(self) -> Vector:
        n = len(self.q)
        pushed = self._momenta.forward(dict(zip(self.v, self.a, strict=True)))
        parts = (pushed, self._inertia_forces, self._gravity_forces, self._spring_forces)
        return tuple(self.graph.sum(terms) for terms in zip(*(part[n:] for part in parts), strict=True))


class SceneLagrangeEquations(MechanismEquations, LagrangeEquations):
    """Lagrange's equations of a scene: the energies of its bodies, springs and dampers."""

    def __init__(self, mechanism: Mechanism) -> None:
        MechanismEquations.__init__(self, mechanism)
        LagrangeEquations.__init__(self, mechanism.symbols, *energies(mechanism))


def energies(mechanism: Mechanism) -> tuple[Node, Node, Node, Node]:
    """T, V of gravity, V of springs and the dissipation R of a scene."""
    graph, links = mechanism.graph, mechanism.links
    positions: list[Node] = []  # per link that of its joint; per body that from there, and r along the link
    ends: list[tuple[Node, Node]] = []
    kinetic = gravity = springs = dissipation = graph.zero
    for link, parent in zip(links, mechanism.parents, strict=True):
        joint = ends[parent] if parent >= 0 else (graph.zero, graph.zero)
        ends.append((joint[0] + link.L * link.cos, joint[1] + link.L * link.sin))
        along, up = link.length * link.cos, link.length * link.sin
        positions += joint
        for body in link.bodies:
            arm = body.alpha * link.cos + body.beta * along, body.alpha * link.sin + body.beta * up
            positions += [*arm, link.reach(body.alpha, body.beta)]
            gravity = gravity + body.mass * (joint[1] + arm[1])
            kinetic = kinetic + body.inertia * (link.rate * link.rate)
        turn, rate = link.angle, link.rate
        if parent >= 0:
            turn, rate = turn - links[parent].angle, rate - links[parent].rate
        turn = turn - link.value("joint_rest_angle")
        stretch = link.length - link.value("rest_length")
        springs = springs + link.value("stiffness") * (stretch * stretch)
        springs = springs + link.value("joint_stiffness") * (turn * turn)
        dissipation = dissipation + link.value("damping") * (link.length_rate * link.length_rate)
        dissipation = dissipation + link.value("joint_damping") * (rate * rate)
    flow = {link.angle: link.rate for link in links}
    flow.update((link.length, link.length_rate) for link in links if link.varies)
    velocities = iter(Tape(positions).forward(flow))
    for link in links:
        vx, vy = next(velocities), next(velocities)
        mass = push_x = push_y = graph.zero
        # Σ m (v + w)² with w² in polar coordinates: in sines and cosines it leaves centrifugal terms, which cancel to
        # rounding only, in the equation of the link's own angle.
        for body in link.bodies:
            arm_x, arm_y, along = (next(velocities) for _ in range(3))
            mass, push_x, push_y = mass + body.mass, push_x + body.mass * arm_x, push_y + body.mass * arm_y
            across = link.reach(body.alpha, body.beta) * link.rate
            kinetic = kinetic + body.mass * (along * along + across * across)
        kinetic = kinetic + mass * (vx * vx + vy * vy) + 2 * (vx * push_x + vy * push_y)
    return kinetic / 2, mechanism.gravity * gravity, springs / 2, dissipation / 2


def derive(mechanism: Mechanism) -> MechanismEquations:
    """Lagrange's equations of a scene."""
    return SceneLagrangeEquations(mechanism)
