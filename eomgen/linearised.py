"""The Jacobian of forward dynamics for a planar tree as walks, O(n²) in the number of links.

With r = M a + h - Q(u) it is ∂a/∂x = -M⁻¹ ∂r/∂x (Carpentier & Mansard 2018). Two walks of forward dynamics give a. A
third one gathers ∂r/∂x. With u along link j and n across it, μ the mass that hangs on its far end, Γ = S + μ L and Γ'
its slope by the length, the motion of the link against its joint asks for a force at the joint and moves the far end by

    G_j = (Γ' s̈ - Γ φ̇²) u + (Γ φ̈ + 2 Γ' ṡ φ̇) n        A_j = (L' s̈ - L φ̇²) u + (L φ̈ + 2 L' ṡ φ̇) n

Links above feel G_j at their far ends, links below have A_j at their joints. So ∂r/∂x outside the rows of x's own link
is a product of two vectors, one of the row and one of x, as an element of the mass matrix is. The columns are solved
for by the walks of forward dynamics, which are affine in the inputs.
"""

from __future__ import annotations

from eomgen.frontends.articulated import Flow, Ground, Results, Solved, Walk, forward_dynamics, from_parent, to_parent
from eomgen.frontends.mechanism import LinkSymbols
from eomgen.ir.derivative import Tape
from eomgen.ir.expr import Node

Axes = tuple[Node, Node]  # along a link and across it
SIDES = ("q", "v", "u")  # columns solved for side by side: by a coordinate, its rate and its input


def right(link: LinkSymbols, coordinate: str, side: str) -> Node:
    """The element of a right-hand side for a coordinate of a link, "angle" or "length"."""
    return link.graph.symbol(f"{link.name}.right_{coordinate}_{side}")


def jacobian(ground: Ground) -> list[Walk]:
    """Walks that give the Jacobian.

    The results "y by x" of the third and the fourth walk are elements of -∂r/∂x, "force x of angle" and the like the
    vectors for its other elements: of y "end" (if it is above) and "force" (if it is below), of x "load" and "shift",
    and "rate load" and "rate shift" for its rate. The last two walks give M⁻¹ times columns.
    """
    graph = ground.graph
    zero, one = graph.zero, graph.one
    solved: dict[LinkSymbols, Solved] = {}
    lift, drop = forward_dynamics(ground, solved=solved)
    driven: dict[LinkSymbols, list[list[Node]]] = {}

    def move(link: LinkSymbols, joint: Flow) -> tuple[Flow, Results]:
        end, found = drop.step(link, joint)
        return end, {f"moving {name}": node for name, node in found.items()}

    def gather(link: LinkSymbols, below: Flow) -> tuple[Flow, Results]:
        hung, felt_along, felt_across = below
        k, L, L1, spin, slide = link.moments, link.L, link.L1, link.rate, link.length_rate
        turning, mixed, sliding = k.S + hung * L, k.X + hung * (L * L1), k.S1 + hung * L1
        second = k.S2 + hung * (L1 * L1)
        found = solved[link].found
        bend, stretch = found["angle"], found["length"] if link.free else link.length_acceleration
        along, across = from_parent(link, *solved[link].joint)
        square, coriolis = spin * spin, 2 * (slide * spin)

        def motion(arm: Node, slope: Node) -> Axes:
            """G_j or A_j."""
            return slope * stretch - arm * square, arm * bend + slope * coriolis

        (load, lateral), (shift, sideways) = motion(turning, sliding), motion(L, L1)
        vectors: dict[str, Axes] = {
            "end of angle": (zero, L),
            "force of angle": (zero, turning),
            "load of angle": (lateral, -load),
            "shift of angle": (sideways, -shift),
            "rate load of angle": (2 * (turning * spin), -2 * (sliding * slide)),
            "rate shift of angle": (2 * (L * spin), -2 * (L1 * slide)),
        }
        pulled = sliding * across + L1 * felt_across
        results: Results = {
            "angle by angle": turning * along + L * felt_along - link.value("joint_stiffness"),
            "angle by rate": -2 * (mixed * slide) - link.value("joint_damping"),
            "angle by torque": one,
            "parent angle by torque": -one,
        }
        if link.free:
            vectors |= {
                "end of length": (L1, zero),
                "force of length": (sliding, zero),
                "load of length": (sliding * square, -(sliding * bend)),
                "shift of length": (L1 * square, -(L1 * bend)),
                "rate load of length": (zero, -2 * (sliding * spin)),
                "rate shift of length": (zero, -2 * (L1 * spin)),
            }
            results |= {
                "angle by length": -pulled - 2 * (mixed * bend) - second * coriolis,
                "length by angle": -pulled,
                "length by length": second * square - link.value("stiffness"),
                "angle by length rate": -2 * (mixed * spin),
                "length by rate": 2 * (mixed * spin),
                "length by length rate": -link.value("damping"),
                "length by force": one,
            }
        c, s = link.cos, link.sin
        for name, (u, n) in vectors.items():
            vector, coordinate = name.split(" of ")
            results[f"{vector} x of {coordinate}"] = c * u - s * n
            results[f"{vector} y of {coordinate}"] = s * u + c * n
        return (k.m + hung, *to_parent(link, felt_along + load, felt_across + lateral)), results

    def spring(link: LinkSymbols, flow: Flow) -> tuple[Flow, Results]:
        results: Results = {}
        if link.parent is not None:
            for name, rate in (("joint_stiffness", ""), ("joint_damping", " rate")):
                value = link.value(name)
                results |= {
                    f"angle by parent angle{rate}": value,
                    f"parent angle by {rate.strip() or 'angle'}": value,
                    f"parent angle by parent angle{rate}": -value,
                }
        return (), results

    def push(link: LinkSymbols, below: Flow) -> tuple[Flow, Results]:
        known = solved[link]
        tape = Tape([*known.above[3:5], *known.driven])
        flow: list[Node] = []
        driven[link] = []
        for side, (u, n) in zip(SIDES, _pairs(below), strict=True):
            seeds = {link.torque: right(link, "angle", side), known.below[3]: u, known.below[4]: n}
            if link.free:
                seeds[link.force] = right(link, "length", side)
            seeds.pop(zero, None)
            along, across, *found = tape.forward(seeds)
            flow += along, across
            driven[link].append(found)
        kept = [node for found in driven[link] for node in found]
        return tuple(flow), {f"driven {k}": node for k, node in enumerate(kept)}

    def follow(link: LinkSymbols, joint: Flow) -> tuple[Flow, Results]:
        known = solved[link]
        names = list(known.found)
        leaves = {*known.driven, *(x for x in known.joint if x.op == "symbol")}
        tape = Tape([*known.end, *(known.found[name] for name in names)], leaves)
        flow: list[Node] = []
        results: Results = {}
        for side, moved, found in zip(SIDES, _pairs(joint), driven[link], strict=True):
            carried = {x: y for x, y in zip(known.joint, moved, strict=True) if y is not zero}
            along, across, *solution = tape.forward({**carried, **dict(zip(known.driven, found, strict=True))})
            flow += along, across
            results |= {f"{name} by {side}": node for name, node in zip(names, solution, strict=True)}
        return tuple(flow), results

    def names(vector: str) -> tuple[str, ...]:
        return tuple(f"{vector}_{axis}_{side}" for side in SIDES for axis in "un")

    return [
        lift,
        Walk(False, drop.names, drop.start, move),
        Walk(True, ("hung_mass", "felt_u", "felt_n"), (), gather),
        Walk(False, (), (), spring),
        Walk(True, names("push"), (), push, columns=True),
        Walk(False, names("move"), (zero,) * (2 * len(SIDES)), follow, columns=True),
    ]


def _pairs(flow: Flow) -> list[Axes]:
    return list(zip(flow[::2], flow[1::2], strict=True))
