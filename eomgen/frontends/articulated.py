"""The articulated-body recursion for a planar tree, O(n) in the number of links.

Angles are absolute, so a subtree acts on the link that carries it only through a force at the joint, and that
force is affine in the joint's acceleration a: F = Λ a + b with a symmetric 2 × 2 articulated inertia Λ
(Featherstone 2008, chapter 7, in the plane). A walk from the tips to the root eliminates one link after the
other, a walk back gives the accelerations. Gravity is an upward acceleration of the ground.

Every function of this method is one or two *walks*. A walk visits the links in one direction; its step maps
what comes in (from the children, summed, or from the parent) to what goes out, plus results. The same steps
serve straight-line code (called once per link) and loops (called once per kind of link on stand-in symbols).

Vectors and tensors stand in the axes of a link, u along it and n across, and are turned once between neighbours,
by the angle between them; sines of absolute angles are not needed. Of Λ flow p, d and e, where
2 Λ = p I + d (u u - n n) + e (u n + n u): a turn rotates (d, e) by the double angle, and nothing has to be halved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from eomgen.frontends.mechanism import LinkSymbols, Mechanism, MechanismEquations
from eomgen.ir.equations import Matrix, Vector, lazy
from eomgen.ir.expr import Graph, Node
from eomgen.links import Body

Flow = tuple[Node, ...]
Results = dict[str, Node]
Step = Callable[[LinkSymbols, Flow], tuple[Flow, Results]]
FORCE = slice(3, 5)  # b (u, n) in what flows up in forward dynamics


class Ground(Protocol):
    """What the walks need beside the links: a graph and gravity. A mechanism has both."""

    @property
    def graph(self) -> Graph: ...
    @property
    def gravity(self) -> Node: ...


@dataclass(frozen=True)
class Walk:
    """One pass over the links.

    Attributes:
        upward: from the tips to the root; otherwise from the root to the tips.
        names: names of the quantities that flow.
        start: what flows into a root link on a downward walk; an upward walk starts from zeros.
        step: maps a link and the inflow to the outflow and the results.
        columns: walked once for every column of a matrix.
    """

    upward: bool
    names: tuple[str, ...]
    start: Flow
    step: Step
    columns: bool = False


def unroll(mechanism: Mechanism, walks: list[Walk]) -> list[Results]:
    """The results of the walks for every link, as straight-line expressions."""
    links, parents, zero = mechanism.links, mechanism.parents, mechanism.graph.zero
    results: list[Results] = [{} for _ in links]
    for walk in walks:
        if walk.upward:
            inflow = [[zero] * len(walk.names) for _ in links]
            for i in range(len(links) - 1, -1, -1):
                outflow, found = walk.step(links[i], tuple(inflow[i]))
                results[i].update(found)
                if parents[i] >= 0:
                    total = inflow[parents[i]]
                    inflow[parents[i]] = [a + b for a, b in zip(total, outflow, strict=True)]
        else:
            flows: list[Flow] = []
            for link, parent in zip(links, parents, strict=True):
                outflow, found = walk.step(link, flows[parent] if parent >= 0 else walk.start)
                results[len(flows)].update(found)
                flows.append(outflow)
    return results


def forward_dynamics(
    ground: Ground, pivots: list[tuple[str, Node]] | None = None, solved: dict[LinkSymbols, Solved] | None = None
) -> list[Walk]:
    """Walks that give φ̈ and s̈ from the inputs.

    Args:
        ground: graph and gravity.
        pivots: collects the pivots by coordinate, in the order of elimination.
        solved: collects the links with what the walks find.
    """
    zero = ground.graph.zero
    solved = {} if solved is None else solved

    def lift(link: LinkSymbols, below: Flow) -> tuple[Flow, Results]:
        solved[link] = (_Lumped if _is_lumped(link) else _General)(link, below)
        if pivots is not None:
            pivots.extend((f"{link.name}.{kind}", pivot) for kind, pivot in solved[link].pivots.items())
        return solved[link].above, solved[link].kept

    def drop(link: LinkSymbols, joint: Flow) -> tuple[Flow, Results]:
        solved[link].joint = joint
        solved[link].end, solved[link].found = solved[link].accelerations(*joint)
        return solved[link].end, solved[link].found

    return [
        Walk(True, ("inertia_p", "inertia_d", "inertia_e", "force_u", "force_n", "torque"), (), lift),
        Walk(False, ("acceleration_u", "acceleration_n"), (zero, ground.gravity), drop),
    ]


class Solved:
    """A link whose own accelerations are eliminated.

    Attributes:
        link: the link.
        below: what flows in on the way up: Λ, b and the joint torques of the links below.
        above: Λ (p, d, e) and b (u, n) in the parent's axes, and the joint torque that the parent feels.
        pivots: the pivots by the coordinate they belong to, the first eliminated first.
        kept: what the way down needs and is computed on the way up, by any names.
        driven: of it, what depends on the inputs.
        joint, end, found: what flows in and out on the way down, and its results.
        apart: z of a lumped link (below), the acceleration of its end against its joint by unit of L'; None of others.
    """

    above: Flow
    pivots: dict[str, Node]
    kept: Results
    driven: Flow
    joint: Flow
    end: Flow
    found: Results
    apart: tuple[Node, Node] | None = None

    def __init__(self, link: LinkSymbols, below: Flow) -> None:
        self.link, self.below = link, below

    def accelerations(self, u: Node, n: Node) -> tuple[Flow, Results]:
        """The far end's acceleration, and φ̈ and s̈, from the joint's acceleration in the parent's axes."""
        raise NotImplementedError


def to_parent(link: LinkSymbols, u: Node, n: Node) -> tuple[Node, Node]:
    """A vector in the link's axes, in its parent's."""
    c, s = link.graph.cos(link.turn), link.graph.sin(link.turn)
    return c * u - s * n, s * u + c * n


def from_parent(link: LinkSymbols, u: Node, n: Node) -> tuple[Node, Node]:
    """A vector in the parent's axes, in the link's."""
    c, s = link.graph.cos(link.turn), link.graph.sin(link.turn)
    return c * u + s * n, c * n - s * u


def _deviator_to_parent(link: LinkSymbols, d: Node, e: Node) -> tuple[Node, Node]:
    """d and e of a tensor in the link's axes, in its parent's."""
    c, s = link.graph.cos(link.turn), link.graph.sin(link.turn)
    twice = 2 * s
    cos2, sin2 = 1 - twice * s, twice * c
    return cos2 * d - sin2 * e, cos2 * e + sin2 * d


class _General(Solved):
    """Any link: elimination of s̈ (if the length is free), then of φ̈, in link axes (u along, n across).

    With c the known part of the far end's acceleration and b' = b + Λ c the equations of the link are

        T φ̈ + L Λ_n (L' s̈, L φ̈) + (S n + L Λ_n) a + 2 X ṡ φ̇ + L b'_n = Q_φ        (Λ_n the row of Λ across)
        S'' s̈ + L' Λ_u (L' s̈, L φ̈) + (S' u + L' Λ_u) a - X φ̇² + L' b'_u = Q_s
    """

    def __init__(self, link: LinkSymbols, below: Flow) -> None:
        super().__init__(link, below)
        p, d, e, below_along, below_across, torque = below
        k, L, L1 = link.moments, link.L, link.L1
        half, half1 = L / 2, L1 / 2
        along, across = p + d, p - d  # of 2 Λ
        given = link.length_acceleration if link.varies and not link.free else link.graph.zero
        square = link.rate * link.rate
        self.coriolis = 2 * (link.length_rate * link.rate)
        swing = L * square
        self.end_along, self.end_across = L1 * given - swing, L1 * self.coriolis
        known = half1 * given, half1 * self.coriolis
        u, n, swung = half * e, k.S + half * across, half * along
        b_along = below_along + along * known[0] + e * known[1]
        force_along = b_along - (k.S + swung) * square + k.S1 * given
        b_across = below_across + e * known[0] + across * known[1] - u * square
        force_across = b_across + k.S1 * self.coriolis
        effort = link.torque - link.joint_spring

        pivot, reference = k.T + L * half * across, k.T + L * half * p
        right = effort - torque - L * b_across - k.X * self.coriolis
        self.pivots = {}
        if link.free:
            self.pivots["length"] = k.S2 + L1 * half1 * along
            slide = link.graph.pivot_inverse(self.pivots["length"], k.S2 + L1 * half1 * p)
            slide_u, slide_n, slide_turn = k.S1 + half1 * along, half1 * e, L1 * u
            slide_right = link.force - link.spring - L1 * (b_along - swung * square) + k.X * square
            share = slide_turn * slide
            pivot = pivot - slide_turn * share
            u, n = u - slide_u * share, n - slide_n * share
            right = right - share * slide_right
            self.pushed, self.slide_gains = slide_right * slide, (slide_u * slide, slide_n * slide, share)
        self.pivots["angle"] = pivot
        inverse = link.graph.pivot_inverse(pivot, reference)
        self.gain_u, self.gain_n, self.free_turn = u * inverse, n * inverse, right * inverse
        force_along = force_along + self.gain_u * right
        force_across = force_across + self.gain_n * right
        if link.free:
            force_along = force_along + slide_u * self.pushed
            force_across = force_across + slide_n * self.pushed
            left_u = k.m + along / 2 - slide_u * self.slide_gains[0] - u * self.gain_u
            left_n = k.m + across / 2 - slide_n * self.slide_gains[1] - n * self.gain_n
            left_mixed = e - 2 * (slide_u * self.slide_gains[1] + u * self.gain_n)
        else:
            # Without a free length the difference m + Λ_nn - n²/pivot has a form with positive terms only.
            # Nothing is of the order of mass², which might leave the range of numbers.
            far = link.graph.sum(b.mass * _squared(_arm(link, b) - L) + b.inertia for b in link.bodies)
            left_u = k.m + along / 2 - u * self.gain_u
            left_n = _central(link, inverse) + across * (far / 2 * inverse)
            left_mixed = e * ((k.T - L * k.S) * inverse)
        turned = _deviator_to_parent(link, left_u - left_n, left_mixed)
        self.above = (left_u + left_n, *turned, *to_parent(link, force_along, force_across), effort)
        self.kept = {"turn": self.free_turn, "gain_u": self.gain_u, "gain_n": self.gain_n, "swing": swing}
        self.driven = (self.free_turn, self.pushed) if link.free else (self.free_turn,)

    def accelerations(self, u: Node, n: Node) -> tuple[Flow, Results]:
        link = self.link
        along, across = from_parent(link, u, n)
        turn = self.free_turn - self.gain_u * along - self.gain_n * across
        results = {"angle": turn}
        end_along, end_across = along + self.end_along, across + self.end_across + link.L * turn
        if link.free:
            gain_u, gain_n, share = self.slide_gains
            results["length"] = self.pushed - share * turn - gain_u * along - gain_n * across
            end_along = end_along + link.L1 * results["length"]
        return (end_along, end_across), results


class _Lumped(Solved):
    """A free massless rod with point masses at fractions β of s: its inertia is the same in every direction.

    With z = (s̈ - s φ̇²) u + (s φ̈ + 2 ṡ φ̇) n, θ₁ = Σ m β, θ₂ = Σ m β², L = λ s and f = F u + (Q_φ/s) n the
    equations are (θ₂ + λ² Λ) z = f - λ b - (θ₁ + λ Λ) a: nothing is rotated and only s is divided by.
    """

    def __init__(self, link: LinkSymbols, below: Flow) -> None:
        super().__init__(link, below)
        p, d, e, below_along, below_across, torque = below
        graph, scale, half = link.graph, link.L1, link.L1 / 2
        masses = [(b.mass, b.beta) for b in link.bodies]
        mass = graph.sum(m for m, _ in masses)
        first = graph.sum(m * b for m, b in masses)
        second = graph.sum(m * b * b for m, b in masses)
        apart = _apart(link, masses, mass * second - first * first)
        far = graph.sum(m * _squared(b - scale) for m, b in masses)
        square = scale * half
        a = second + square * p
        deviation = d * d + e * e
        self.pivots = {"length": a * a - square * square * deviation}
        inverse = graph.pivot_inverse(self.pivots["length"], a * a)
        gain = (half * second - square * first) * inverse
        along_gain, deviation = a * inverse, deviation * inverse
        self.gain = (first + half * p) * along_gain - half * square * deviation, gain * d, gain * e
        shear = -square * inverse
        effort = link.torque - link.joint_spring
        length = link.length
        self.per_length = length * graph.pivot_inverse(length * length, length * length)
        push = link.force - link.spring - scale * below_along
        turn = (effort - torque) * self.per_length - scale * below_across
        self.z = _apply((along_gain, shear * d, shear * e), push, turn)
        along, across = _apply(self.gain, push, turn)
        stiff = (far * second - scale * scale * apart) * inverse
        left = (2 * apart + far * p) * along_gain - far * square * deviation
        turned = _deviator_to_parent(link, stiff * d, stiff * e)
        self.above = (left, *turned, *to_parent(link, below_along + along, below_across + across), effort)
        self.kept, self.driven = {}, self.z

    def accelerations(self, u: Node, n: Node) -> tuple[Flow, Results]:
        link = self.link
        along, across = from_parent(link, u, n)
        pulled = _apply(self.gain, along, across)
        zu, zn = self.apart = self.z[0] - pulled[0], self.z[1] - pulled[1]
        # s (1/s) is 1, or NaN where s vanishes: the state as a whole is singular there, not only its angle.
        results = {
            "angle": (zn - 2 * (link.length_rate * link.rate)) * self.per_length,
            "length": zu + (link.length * self.per_length) * (link.length * (link.rate * link.rate)),
        }
        return (along + link.L1 * zu, across + link.L1 * zn), results


def _is_lumped(link: LinkSymbols) -> bool:
    return link.free and all(b.alpha == 0 and b.inertia == 0 for b in link.bodies) and link.L1 * link.length is link.L


def _apply(tensor: tuple[Node, Node, Node], x: Node, y: Node) -> tuple[Node, Node]:
    p, d, e = tensor
    return (p + d) * x + e * y, (p - d) * y + e * x


def _arm(link: LinkSymbols, body: Body) -> Node:
    return link.graph.node(link.reach(body.alpha, body.beta))


def _squared(x: Node) -> Node:
    return x * x


def _apart(link: LinkSymbols, masses: list[tuple[Node, Node]], direct: Node) -> Node:
    """Σ_{k<l} m_k m_l (r_k - r_l)², which is Σ m Σ m r² - (Σ m r)² without its cancellation; direct for many."""
    if len(masses) > 4:
        return direct
    terms = ((m * n) * _squared(link.graph.node(r - q)) for k, (m, r) in enumerate(masses) for n, q in masses[:k])
    return link.graph.sum(terms)


def _central(link: LinkSymbols, inverse: Node) -> Node:
    """(m T - S²)/T': the mass times the moment of inertia about the link's own centre, by the pivot T'."""
    k = link.moments
    masses = [(link.graph.node(b.mass), _arm(link, b)) for b in link.bodies]
    inertia = link.graph.sum(b.inertia for b in link.bodies)
    apart = _apart(link, masses, k.m * (k.T - inertia) - k.S * k.S)
    return apart * inverse + k.m * (inertia * inverse)


def inverse_dynamics(
    ground: Ground, accelerated: bool = True, weight: bool = True, moving: bool = True, springs: bool = True
) -> list[Walk]:
    """Walks that give what the motion asks for, the planar recursive Newton-Euler method.

    Results: "angle", "length" the equation of each coordinate (also of a prescribed length), "torque" the
    joint torque that reacts on the parent.

    Args:
        ground: graph and gravity.
        accelerated: count the accelerations a.
        weight: count gravity.
        moving: count the rates and the prescribed accelerations.
        springs: count springs and dampers.
    """
    zero = ground.graph.zero
    motion: dict[LinkSymbols, tuple[Node, ...]] = {}

    def drop(link: LinkSymbols, joint: Flow) -> tuple[Flow, Results]:
        joint_along, joint_across = from_parent(link, *joint)
        turn = link.acceleration if accelerated else zero
        slide = link.length_acceleration if (accelerated if link.free else moving) else zero
        square = link.rate * link.rate if moving else zero
        coriolis = 2 * (link.length_rate * link.rate) if moving else zero
        motion[link] = (joint_along, joint_across, turn, slide, square, coriolis)
        along = joint_along + link.L1 * slide - link.L * square
        return (along, joint_across + link.L * turn + link.L1 * coriolis), {}

    def lift(link: LinkSymbols, below: Flow) -> tuple[Flow, Results]:
        end_along, end_across, torque, sprung = below
        k = link.moments
        along, across, turn, slide, square, coriolis = motion[link]
        force_along = k.m * along + k.S1 * slide - k.S * square + end_along
        force_across = k.m * across + k.S * turn + k.S1 * coriolis + end_across
        angle = k.S * across + k.T * turn + k.X * coriolis + link.L * end_across
        length = k.S1 * along + k.S2 * slide - k.X * square + link.L1 * end_along
        above = to_parent(link, force_along, force_across)
        torque = torque + angle
        spring, stretch = (link.joint_spring, link.spring) if springs else (zero, zero)
        results = {"angle": angle + (spring - sprung), "length": length + stretch, "torque": torque + spring}
        return (*above, torque, spring), results

    gravity = ground.gravity if weight else zero
    return [
        Walk(False, ("acceleration_u", "acceleration_n"), (zero, gravity), drop),
        Walk(True, ("force_u", "force_n", "torque", "spring"), (), lift),
    ]


def newton_euler(ground: Ground) -> list[Walk]:
    """Inverse dynamics with everything counted."""
    return inverse_dynamics(ground)


def no_accelerations(ground: Ground) -> list[Walk]:
    """Inverse dynamics without the accelerations a: the bias."""
    return inverse_dynamics(ground, accelerated=False)


def composite_bodies(ground: Ground) -> list[Walk]:
    """The walk that gives the diagonal of the mass matrix, and two vectors for every coordinate.

    The element of a coordinate x and of a coordinate y of a link above is the product of the motion of that link's
    end for a unit of y ("end of ...") and the force at the joint for a unit of ẍ ("force of ..."): what hangs below
    a far end moves with it as one mass, whatever its shape, as angles are absolute (composite bodies; Featherstone
    2008, section 6.2).
    """

    def lift(link: LinkSymbols, below: Flow) -> tuple[Flow, Results]:
        (hung,), k = below, link.moments
        c, s = link.cos, link.sin
        turn, slide = k.S + hung * link.L, k.S1 + hung * link.L1
        results = {
            "angle": k.T + hung * link.L * link.L,
            "end x of angle": -(link.L * s),
            "end y of angle": link.L * c,
            "force x of angle": -(turn * s),
            "force y of angle": turn * c,
        }
        if link.free:
            results |= {
                "length": k.S2 + hung * link.L1 * link.L1,
                "end x of length": link.L1 * c,
                "end y of length": link.L1 * s,
                "force x of length": slide * c,
                "force y of length": slide * s,
            }
        return (k.m + hung,), results

    return [Walk(True, ("hung_mass",), (), lift)]


def energy(ground: Ground) -> list[Walk]:
    """The walk that gives each link's kinetic and potential energy ("kinetic", "potential")."""
    g, zero = ground.gravity, ground.graph.zero

    def drop(link: LinkSymbols, joint: Flow) -> tuple[Flow, Results]:
        height, vx, vy = joint
        c, s, k = link.cos, link.sin, link.moments
        across, along = c * vy - s * vx, c * vx + s * vy
        twice = k.m * (vx * vx + vy * vy) + k.T * link.rate * link.rate + k.S2 * link.length_rate * link.length_rate
        kinetic = twice / 2 + k.S * link.rate * across + k.S1 * link.length_rate * along
        potential = g * (k.m * height + k.S * s) + link.spring_energy
        end_along, end_across = link.L1 * link.length_rate, link.L * link.rate
        ends = height + link.L * s, vx + c * end_along - s * end_across, vy + s * end_along + c * end_across
        return ends, {"kinetic": kinetic, "potential": potential}

    return [Walk(False, ("height", "velocity_x", "velocity_y"), (zero, zero, zero), drop)]


def joints(ground: Ground) -> list[Walk]:
    """The walk that gives the far ends ("x", "y")."""
    zero = ground.graph.zero

    def drop(link: LinkSymbols, joint: Flow) -> tuple[Flow, Results]:
        end = joint[0] + link.L * link.cos, joint[1] + link.L * link.sin
        return end, {"x": end[0], "y": end[1]}

    return [Walk(False, ("x", "y"), (zero, zero), drop)]


class ArticulatedEquations(MechanismEquations):
    """Equations by the recursions above; the mass matrix by composite bodies."""

    method = "articulated"

    def _per_coordinate(self, results: list[Results], angle: str = "angle") -> Vector:
        free = self.mechanism.scene.free
        return (*(r[angle] for r in results), *(results[i]["length"] for i in free))

    @lazy
    def forward_dynamics(self) -> Vector:
        return self._per_coordinate(unroll(self.mechanism, forward_dynamics(self.mechanism)))

    @lazy
    def pivots(self) -> list[tuple[str, Node]]:
        """The pivots of the elimination by coordinate, in order."""
        pivots: list[tuple[str, Node]] = []
        unroll(self.mechanism, forward_dynamics(self.mechanism, pivots)[:1])
        return pivots

    @cached_property
    def _newton_euler(self) -> list[Results]:
        return unroll(self.mechanism, newton_euler(self.mechanism))

    @lazy
    def inverse_dynamics(self) -> Vector:
        return self._per_coordinate(self._newton_euler, "torque")

    @lazy
    def prescribed_forces(self) -> Vector:
        return tuple(self._newton_euler[i]["length"] for i in self.mechanism.scene.prescribed)

    @lazy
    def bias(self) -> Vector:
        return self._per_coordinate(unroll(self.mechanism, no_accelerations(self.mechanism)))

    @lazy
    def bias_parts(self) -> dict[str, Vector]:
        walks = {
            "velocity": inverse_dynamics(self.mechanism, False, False, True, False),
            "gravity": inverse_dynamics(self.mechanism, False, True, False, False),
            "springs": inverse_dynamics(self.mechanism, False, False, False, True),
        }
        parts = {name: unroll(self.mechanism, walk) for name, walk in walks.items()}
        return {name: self._per_coordinate(results) for name, results in parts.items()}

    @cached_property
    def _energies(self) -> tuple[Node, Node]:
        results = unroll(self.mechanism, energy(self.mechanism))
        total = self.graph.sum
        return total(r["kinetic"] for r in results), total(r["potential"] for r in results)

    @lazy
    def kinetic(self) -> Node:
        return self._energies[0]

    @lazy
    def potential(self) -> Node:
        return self._energies[1]

    @lazy
    def mass_matrix(self) -> Matrix:
        """Column by column: the force that a unit acceleration needs at the joint, felt by all links above.

        What hangs below a far end moves with it as one mass, whatever its shape: angles are absolute, so it
        does not turn (composite bodies; Featherstone 2008, section 6.2).
        """
        links, graph = self.mechanism.links, self.graph
        m, zero = len(links), graph.zero
        place = {link: m + k for k, link in enumerate(self.mechanism.scene.free)}
        rows = [[zero] * len(self.q) for _ in self.q]
        hung = [zero] * m
        for j in range(m - 1, -1, -1):
            link, mass, k = links[j], hung[j], links[j].moments
            turn, slide = k.S + mass * link.L, k.S1 + mass * link.L1
            rows[j][j] = k.T + mass * link.L * link.L
            if j in place:
                rows[place[j]][place[j]] = k.S2 + mass * link.L1 * link.L1
            for i in self.mechanism.ancestors(j):
                above = links[i]
                c = above.cos * link.cos + above.sin * link.sin
                s = above.sin * link.cos - above.cos * link.sin
                # The force is turn n_j for a unit φ̈_j and slide u_j for a unit s̈_j.
                felt = [(j, above.L * (turn * c), above.L1 * (turn * s))]
                if j in place:
                    felt.append((place[j], -(above.L * (slide * s)), above.L1 * (slide * c)))
                for column, angle, length in felt:
                    rows[i][column] = rows[column][i] = angle
                    if i in place:
                        rows[place[i]][column] = rows[column][place[i]] = length
            if self.mechanism.parents[j] >= 0:
                parent = self.mechanism.parents[j]
                hung[parent] = hung[parent] + (k.m + mass)
        return tuple(tuple(row) for row in rows)


def derive(mechanism: Mechanism) -> MechanismEquations:
    """The recursions of a scene."""
    return ArticulatedEquations(mechanism)
