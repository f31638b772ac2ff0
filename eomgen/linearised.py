"""The Jacobians of forward dynamics for a planar tree as walks, O(n) for each column.

With r = M a + h - Q(u) they are ∂a/∂x = -M⁻¹ ∂r/∂x (Carpentier & Mansard 2018). Two walks of forward dynamics give a. A
third one gathers ∂r/∂x. With u along link j and n across it, μ the mass that hangs on its far end, Γ = S + μ L and Γ'
its slope by the length, the motion of the link against its joint asks for a force at the joint and moves the far end by

    G_j = (Γ' s̈ - Γ φ̇²) u + (Γ φ̈ + 2 Γ' ṡ φ̇) n        A_j = (L' s̈ - L φ̇²) u + (L φ̈ + 2 L' ṡ φ̇) n

Links above feel G_j at their far ends, links below have A_j at their joints. So ∂r/∂x outside the rows of x's own link
is a product of two vectors, one of the row and one of x, as an element of the mass matrix is. The columns are solved
for by the walks of forward dynamics, which are affine in the inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from eomgen.frontends.articulated import (
    FORCE,
    Flow,
    Ground,
    Results,
    Solved,
    Walk,
    forward_dynamics,
    from_parent,
    to_parent,
)
from eomgen.frontends.mechanism import LinkSymbols
from eomgen.ir.derivative import Tape
from eomgen.ir.expr import Graph, Node
from eomgen.scene import SPRINGS

Axes = tuple[Node, Node]  # along a link and across it
STATE = ("q", "v", "u")  # columns solved for side by side: by a coordinate, its rate and its input
PARAMETERS = ("p",)
GATHERED = ("hung_mass", "felt_u", "felt_n")  # what flows up in the third walk


def right(link: LinkSymbols, coordinate: str, side: str) -> Node:
    """The element of a right-hand side for a coordinate of a link, "angle" or "length"."""
    return link.graph.symbol(f"{link.name}.right_{coordinate}_{side}")


def jacobian(ground: Ground) -> list[Walk]:
    """Walks that give the Jacobian by q, v and u.

    The results "y by x" of the third and the fourth walk are elements of -∂r/∂x, "force x of angle" and the like the
    vectors for its other elements: of y "end" (if it is above) and "force" (if it is below), of x "load" and "shift",
    and "rate load" and "rate shift" for its rate. The last two walks give M⁻¹ times columns.
    """
    one, linear = ground.graph.one, _Linear(ground, STATE)

    def gather(link: LinkSymbols, below: Flow) -> tuple[Flow, Results]:
        at = linear.at(link, below)
        k, L, L1, spin, slide = link.moments, link.L, link.L1, link.rate, link.length_rate
        turning, sliding, bend, square = at.turning, at.sliding, at.bend, at.square
        mixed, second = k.X + at.hung * (L * L1), k.S2 + at.hung * (L1 * L1)
        (load, lateral), (shift, sideways) = at.motion(turning, sliding), at.motion(L, L1)
        vectors = at.vectors() | {
            "load of angle": (lateral, -load),
            "shift of angle": (sideways, -shift),
            "rate load of angle": (2 * (turning * spin), -2 * (sliding * slide)),
            "rate shift of angle": (2 * (L * spin), -2 * (L1 * slide)),
        }
        pulled = sliding * at.across + L1 * at.felt_across
        results: Results = {
            "angle by angle": turning * at.along + L * at.felt_along - link.value("joint_stiffness"),
            "angle by rate": -2 * (mixed * slide) - link.value("joint_damping"),
            "angle by torque": one,
            "parent angle by torque": -one,
        }
        if link.free:
            vectors |= {
                "load of length": (sliding * square, -(sliding * bend)),
                "shift of length": (L1 * square, -(L1 * bend)),
                "rate load of length": (at.zero, -2 * (sliding * spin)),
                "rate shift of length": (at.zero, -2 * (L1 * spin)),
            }
            results |= {
                "angle by length": -pulled - 2 * (mixed * bend) - second * at.coriolis,
                "length by angle": -pulled,
                "length by length": second * square - link.value("stiffness"),
                "angle by length rate": -2 * (mixed * spin),
                "length by rate": 2 * (mixed * spin),
                "length by length rate": -link.value("damping"),
                "length by force": one,
            }
        return at.above((load, lateral)), results | _in_ground(link, vectors)

    def spring(link: LinkSymbols, flow: Flow) -> tuple[Flow, Results]:
        results: Results = {}
        if link.parent is not None:
            for name, own, other in (
                ("joint_stiffness", "angle", "parent angle"),
                ("joint_damping", "rate", "parent angle rate"),
            ):
                value = link.value(name)
                results |= {
                    f"angle by {other}": value,
                    f"parent angle by {own}": value,
                    f"parent angle by {other}": -value,
                }
        return (), results

    gathered = Walk(True, GATHERED, (), gather)
    return [*linear.moving(), gathered, Walk(False, (), (), spring), *linear.solving()]


def parameter_jacobian(ground: Ground) -> list[Walk]:
    """Walks that give the Jacobian by the parameters; what springs add is `spring_slopes`.

    The results of the third walk are as those of `jacobian`, x the short name of a parameter of the link or "gravity".
    """
    one, linear = ground.graph.one, _Linear(ground, PARAMETERS)

    def gather(link: LinkSymbols, below: Flow) -> tuple[Flow, Results]:
        at = linear.at(link, below)
        k, L, L1 = link.moments, link.L, link.L1
        load, shift = at.motion(at.turning, at.sliding), at.motion(L, L1)
        force = k.m * at.along + load[0], k.m * at.across + load[1]
        end = at.felt_along + at.hung * (at.along + shift[0]), at.felt_across + at.hung * (at.across + shift[1])
        if at.apart:
            each = zip((at.along, at.across), at.apart, end, strict=True)
            length, lever = (k.S1 * joint + k.S2 * z + L1 * far for joint, z, far in each)
            angle = link.length * lever
        else:
            angle = k.S * at.across + k.T * at.bend + k.X * at.coriolis + L * end[1]
            length = k.S1 * at.along + k.S2 * at.stretch - k.X * at.square + L1 * end[0]
        moved = at.apart or (at.bend, at.stretch)
        leaves = (at.hung, at.felt_along, at.felt_across, at.along, at.across, *moved)
        tape = Tape([*force, *shift, angle, length], leaves)
        vectors, results = at.vectors(), dict[str, Node]()
        for name, value in link.values.items():
            if name not in SPRINGS:
                *by, by_angle, by_length = (-slope for slope in tape.forward({value: one}))
                vectors[f"load of {name}"] = by[0], by[1]
                if (by[2], by[3]) != (at.zero, at.zero):
                    vectors[f"shift of {name}"] = by[2], by[3]
                results |= {f"angle by {name}": by_angle, f"length by {name}": by_length}
        if ground.gravity is not at.zero:
            results |= {"angle by gravity": -(at.turning * link.cos), "length by gravity": -(at.sliding * link.sin)}
        return at.above(load), results | _in_ground(link, vectors)

    return [*linear.moving(), Walk(True, GATHERED, (), gather), *linear.solving()]


def spring_slopes(link: LinkSymbols) -> Results:
    """The elements of -∂r/∂x for the parameters x of a link's springs."""
    results: Results = {}
    tape = Tape([link.joint_spring, link.spring])
    for name in SPRINGS:
        if name in link.values:
            turning, along = tape.forward({link.values[name]: link.graph.one})
            results |= {f"angle by {name}": -turning, f"parent angle by {name}": turning, f"length by {name}": -along}
    return results


def _in_ground(link: LinkSymbols, vectors: dict[str, Axes]) -> Results:
    """Vectors of a link in the ground's axes, "force x of angle" and the like."""
    results: Results = {}
    c, s = link.cos, link.sin
    for name, (u, n) in vectors.items():
        vector, owner = name.split(" of ")
        results |= {f"{vector} x of {owner}": c * u - s * n, f"{vector} y of {owner}": s * u + c * n}
    return results


@dataclass(frozen=True)
class _At:
    """A link in motion.

    Attributes:
        link: the link.
        hung: the mass below it.
        felt_along, felt_across: the sum of G over the links below, in the link's axes.
        along, across: the joint's acceleration, in the link's axes.
        bend, stretch: φ̈ and s̈.
        apart: of a lumped link s̈ - s φ̇² and s φ̈ + 2 ṡ φ̇, without the rounding of either part.
        square, coriolis: φ̇² and 2 ṡ φ̇.
        turning, sliding: Γ and its slope.
    """

    link: LinkSymbols
    hung: Node
    felt_along: Node
    felt_across: Node
    along: Node
    across: Node
    bend: Node
    stretch: Node
    apart: Axes | None
    square: Node
    coriolis: Node
    turning: Node
    sliding: Node

    @property
    def zero(self) -> Node:
        return self.link.graph.zero

    def motion(self, arm: Node, slope: Node) -> Axes:
        """G (of Γ and its slope) or A (of L and its slope)."""
        if self.apart:  # then Γ = Γ' s and L = L' s
            return slope * self.apart[0], slope * self.apart[1]
        return slope * self.stretch - arm * self.square, arm * self.bend + slope * self.coriolis

    def vectors(self) -> dict[str, Axes]:
        """The vectors of the link's rows."""
        found: dict[str, Axes] = {"end of angle": (self.zero, self.link.L), "force of angle": (self.zero, self.turning)}
        if self.link.free:
            found |= {"end of length": (self.link.L1, self.zero), "force of length": (self.sliding, self.zero)}
        return found

    def above(self, load: Axes) -> Flow:
        """What flows on to the parent."""
        felt = to_parent(self.link, self.felt_along + load[0], self.felt_across + load[1])
        return (self.link.moments.m + self.hung, *felt)


class _Linear:
    """The walks that do not depend on x.

    Args:
        ground: graph and gravity.
        sides: names of the columns that are solved for side by side.
    """

    def __init__(self, ground: Ground, sides: Sequence[str]) -> None:
        self.graph: Graph = ground.graph
        self.sides = sides
        self.solved: dict[LinkSymbols, Solved] = {}
        self.driven: dict[LinkSymbols, list[list[Node]]] = {}
        self.lift, self.drop = forward_dynamics(ground, solved=self.solved)

    def moving(self) -> list[Walk]:
        """Walks that give the accelerations, which are no results."""

        def move(link: LinkSymbols, joint: Flow) -> tuple[Flow, Results]:
            end, found = self.drop.step(link, joint)
            return end, {f"moving {name}": node for name, node in found.items()}

        return [self.lift, Walk(False, self.drop.names, self.drop.start, move)]

    def at(self, link: LinkSymbols, below: Flow) -> _At:
        """A link after these walks, from what flows in on the way up."""
        hung, felt_along, felt_across = below
        known, k, spin = self.solved[link], link.moments, link.rate
        return _At(
            link,
            *(hung, felt_along, felt_across),
            *from_parent(link, *known.joint),
            bend=known.found["angle"],
            stretch=known.found["length"] if link.free else link.length_acceleration,
            apart=known.apart,
            square=spin * spin,
            coriolis=2 * (link.length_rate * spin),
            turning=k.S + hung * link.L,
            sliding=k.S1 + hung * link.L1,
        )

    def solving(self) -> list[Walk]:
        """Walks that give M⁻¹ times columns: those of forward dynamics, differentiated by the inputs."""

        def names(vector: str) -> tuple[str, ...]:
            return tuple(f"{vector}_{axis}_{side}" for side in self.sides for axis in "un")

        start = (self.graph.zero,) * (2 * len(self.sides))
        return [
            Walk(True, names("push"), (), self._push, columns=True),
            Walk(False, names("move"), start, self._follow, columns=True),
        ]

    def _push(self, link: LinkSymbols, below: Flow) -> tuple[Flow, Results]:
        known = self.solved[link]
        tape = Tape([*known.above[FORCE], *known.driven])
        flow: list[Node] = []
        self.driven[link] = []
        for side, pushed in zip(self.sides, _pairs(below), strict=True):
            seeds = {link.torque: right(link, "angle", side), **dict(zip(known.below[FORCE], pushed, strict=True))}
            if link.free:
                seeds[link.force] = right(link, "length", side)
            seeds.pop(self.graph.zero, None)
            along, across, *found = tape.forward(seeds)
            flow += along, across
            self.driven[link].append(found)
        kept = [node for found in self.driven[link] for node in found]
        return tuple(flow), {f"driven {k}": node for k, node in enumerate(kept)}

    def _follow(self, link: LinkSymbols, joint: Flow) -> tuple[Flow, Results]:
        known = self.solved[link]
        names = list(known.found)
        leaves = {*known.driven, *(x for x in known.joint if x.op == "symbol")}
        tape = Tape([*known.end, *(known.found[name] for name in names)], leaves)
        flow: list[Node] = []
        results: Results = {}
        for side, moved, found in zip(self.sides, _pairs(joint), self.driven[link], strict=True):
            carried = {x: y for x, y in zip(known.joint, moved, strict=True) if y is not self.graph.zero}
            along, across, *solution = tape.forward({**carried, **dict(zip(known.driven, found, strict=True))})
            flow += along, across
            results |= {f"{name} by {side}": node for name, node in zip(names, solution, strict=True)}
        return tuple(flow), results


def _pairs(flow: Flow) -> list[Axes]:
    return list(zip(flow[::2], flow[1::2], strict=True))
