"""A scene as symbols: what all front ends start from and nothing they derive.

A front end sees affine links only (`eomgen.links`): bodies at r = α + β s along the link, the far end at
L = α_L + β_L s. Which model a link came from no longer matters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from eomgen.ir.equations import Equations, Matrix, Symbols, Vector, lazy
from eomgen.ir.expr import Graph, Node
from eomgen.links import Affine, Body, affine
from eomgen.scene import Link, Scene


@dataclass(frozen=True)
class Moments:
    """Sums over the bodies of one link (Borisov & Rozenblat 2017, above eq. 5).

    m = Σ m, S = Σ m r, T = Σ (m r² + J), S1 = Σ m β, S2 = Σ m β², X = Σ m β r.
    """

    m: Node
    S: Node
    T: Node
    S1: Node
    S2: Node
    X: Node


class LinkSymbols:
    """One link as symbols.

    Attributes:
        parent: the link this one is attached to, None for the ground.
        angle, rate, acceleration: φ, φ̇, φ̈.
        length, length_rate, length_acceleration: s, ṡ, s̈; all zero for a fixed length.
        free: whether s is a coordinate; varies: whether there is a length that changes.
        torque, force: inputs; the force is zero unless the length is free.
        bodies, L, L1: the affine link: bodies, far end L and its slope ∂L/∂s.
        spring: k (s - s₀) + d ṡ along the length, zero without.
    """

    def __init__(self, link: Link, graph: Graph, values: dict[str, Node], parent: LinkSymbols | None = None) -> None:
        zero, symbol = graph.zero, graph.symbol
        name = link.name
        self.graph = graph
        self.name = name
        self.parent = parent
        self.free = link.mode == "free"
        self.varies = link.mode != "fixed"
        self.angle = symbol(f"{name}.angle")
        self.rate = symbol(f"{name}.angle_rate")
        self.acceleration = symbol(f"{name}.angle_acceleration")
        self.torque = symbol(f"{name}.torque")
        self.length = self.length_rate = self.length_acceleration = self.force = zero
        if self.varies:
            self.length = symbol(f"{name}.length")
            self.length_rate = symbol(f"{name}.length_rate")
            self.length_acceleration = symbol(f"{name}.length_acceleration")
        if self.free:
            self.force = symbol(f"{name}.force")
        self.values = values
        shape: Affine = affine(link, values)
        self.bodies: tuple[Body, ...] = shape.bodies
        self.L: Node = graph.node(self.reach(*shape.joint))
        self.L1: Node = graph.node(shape.joint[1])

    def reach(self, alpha: Node, beta: Node) -> Node:
        """α + β s"""
        return alpha + beta * self.length

    def value(self, name: str) -> Node:
        """A parameter by its short name, zero if the scene has none."""
        return self.values.get(name, self.graph.zero)

    @cached_property
    def cos(self) -> Node:
        """cos φ"""
        return self.graph.cos(self.angle)

    @cached_property
    def sin(self) -> Node:
        """sin φ"""
        return self.graph.sin(self.angle)

    @cached_property
    def turn(self) -> Node:
        """φ - φ_parent, the angle between neighbours; the ground is at angle 0."""
        return self.angle if self.parent is None else self.angle - self.parent.angle

    @cached_property
    def moments(self) -> Moments:
        """The link's sums, with everything that does not change with s gathered first."""
        total, s = self.graph.sum, self.length
        still = [b for b in self.bodies if b.beta == 0]
        scaled = [b for b in self.bodies if b.beta != 0 and b.alpha == 0]
        moving = [b for b in self.bodies if b.beta != 0 and b.alpha != 0]
        arms = [(b, b.mass * self.reach(b.alpha, b.beta)) for b in moving]
        first = total(b.mass * b.beta for b in scaled)
        second = total(b.mass * b.beta * b.beta for b in scaled)
        inertia = total(b.inertia for b in self.bodies)
        return Moments(
            m=total(b.mass for b in self.bodies),
            S=total(b.mass * b.alpha for b in still) + first * s + total(arm for _, arm in arms),
            T=total(b.mass * b.alpha * b.alpha for b in still)
            + inertia
            + second * s * s
            + total(arm * self.reach(b.alpha, b.beta) for b, arm in arms),
            S1=first + total(b.mass * b.beta for b in moving),
            S2=second + total(b.mass * b.beta * b.beta for b in moving),
            X=second * s + total(arm * b.beta for b, arm in arms),
        )

    @cached_property
    def spring(self) -> Node:
        """k (s - s₀) + d ṡ, the force along the length that the link itself takes up."""
        stretch = self.value("stiffness") * (self.length - self.value("rest_length"))
        return stretch + self.value("damping") * self.length_rate

    @cached_property
    def joint_spring(self) -> Node:
        """k (φ - φ_parent - φ₀) + d (φ̇ - φ̇_parent), the torque the joint takes up; the ground is at angle 0."""
        rate = self.rate if self.parent is None else self.rate - self.parent.rate
        stiffness = self.value("joint_stiffness") * (self.turn - self.value("joint_rest_angle"))
        return stiffness + self.value("joint_damping") * rate

    @cached_property
    def spring_energy(self) -> Node:
        """k (s - s₀)²/2 of the length and k (φ - φ_parent - φ₀)²/2 of the joint."""
        stretch = self.length - self.value("rest_length")
        turn = self.turn - self.value("joint_rest_angle")
        return (self.value("stiffness") * stretch * stretch + self.value("joint_stiffness") * turn * turn) / 2


class Mechanism:
    """A scene as symbols in one graph.

    Attributes:
        scene: the scene.
        fold: whether the scene's numbers stand in place of parameters.
        graph: the graph.
        links: one `LinkSymbols` per link.
        parents: index of the parent per link, -1 for the ground.
        gravity: g, zero without gravity.
        symbols: q, v, a, u, w, p in the order of the contract.
    """

    def __init__(self, scene: Scene, fold: bool = False, graph: Graph | None = None) -> None:
        self.scene = scene
        self.fold = fold
        self.graph = graph = graph or Graph()
        self.parents, self.children = scene.parents, scene.children
        symbol = graph.symbol
        p: list[Node] = []
        units: dict[Node, str] = {}
        self.links: list[LinkSymbols] = []
        for link, parent in zip(scene.links, scene.parents, strict=True):
            values: dict[str, Node] = {}
            for short, unit, value in link.parameters:
                if fold:
                    values[short] = graph.constant(value)
                else:
                    values[short] = symbol(f"{link.name}.{short}")
                    units[values[short]] = unit
                    p.append(values[short])
            above = self.links[parent] if parent >= 0 else None
            self.links.append(LinkSymbols(link, graph, values, above))
        self.gravity = graph.zero
        if scene.gravity:
            self.gravity = graph.constant(scene.gravity) if fold else symbol("gravity")
            if not fold:
                units[self.gravity] = "m/s^2"
                p.append(self.gravity)
        links, free = self.links, [self.links[i] for i in scene.free]
        for k in links:
            angles = (k.angle, k.rate, k.acceleration, k.torque)
            lengths = (k.length, k.length_rate, k.length_acceleration, k.force) if k.varies else ()
            units.update(zip(angles, ("rad", "rad/s", "rad/s^2", "N m"), strict=True))
            units.update(zip(lengths, ("m", "m/s", "m/s^2", "N"), strict=False))
        self.symbols = Symbols(
            graph=graph,
            q=tuple([k.angle for k in links] + [k.length for k in free]),
            v=tuple([k.rate for k in links] + [k.length_rate for k in free]),
            a=tuple([k.acceleration for k in links] + [k.length_acceleration for k in free]),
            u=tuple([k.torque for k in links] + [k.force for k in free]),
            w=tuple((k.length, k.length_rate, k.length_acceleration) for k in (links[i] for i in scene.prescribed)),
            p=tuple(p),
            p_values=() if fold else tuple(parameter.value for parameter in scene.parameters),
            units=units,
        )

    def ancestors(self, i: int) -> list[int]:
        """The links between link i and the ground, the nearest first."""
        path: list[int] = []
        while (i := self.parents[i]) >= 0:
            path.append(i)
        return path

    @cached_property
    def coordinate_order(self) -> list[int]:
        """Coordinates for elimination: the deepest link first, in a link its length before its angle."""
        m = len(self.links)
        position = {link: m + k for k, link in enumerate(self.scene.free)}
        order: list[int] = []
        for i in range(m - 1, -1, -1):
            order += [position[i], i] if i in position else [i]
        return order

    def reactions(self, torques: list[Node]) -> list[Node]:
        """Torque on each link when every joint acts on its link and reacts on the parent."""
        total = list(torques)
        for i, parent in enumerate(self.parents):
            if parent >= 0:
                total[parent] = total[parent] - torques[i]
        return total

    @cached_property
    def far_ends(self) -> Matrix:
        """Position of every link's far end, (m, 2)."""
        ends: list[tuple[Node, Node]] = []
        for link, parent in zip(self.links, self.parents, strict=True):
            x, y = ends[parent] if parent >= 0 else (self.graph.zero, self.graph.zero)
            ends.append((x + link.L * link.cos, y + link.L * link.sin))
        return tuple(ends)


class MechanismEquations(Equations):
    """What all methods have in common for a scene: how inputs act, where links end, what is eliminated first."""

    def __init__(self, mechanism: Mechanism) -> None:
        Equations.__init__(self, mechanism.symbols)
        self.mechanism = mechanism

    def generalised_force(self, u: Sequence[Node]) -> Vector:
        m = len(self.mechanism.links)
        return (*self.mechanism.reactions(list(u[:m])), *u[m:])

    def inputs_for(self, force: Sequence[Node]) -> Vector:
        torques = list(force)
        for i in range(len(self.mechanism.links) - 1, -1, -1):
            parent = self.mechanism.parents[i]
            if parent >= 0:
                torques[parent] = torques[parent] + torques[i]
        return tuple(torques)

    @property
    def elimination_order(self) -> Sequence[int]:
        return self.mechanism.coordinate_order

    @lazy
    def joints(self) -> Matrix:
        return self.mechanism.far_ends
