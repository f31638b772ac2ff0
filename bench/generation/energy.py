"""Kinetic and potential energy of a mechanism in any algebra: what the Lagrange contenders start from."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from bench.generation.mechanism import Mechanism, Scalar


def energies(
    mechanism: Mechanism,
    q: Sequence[Scalar],
    v: Sequence[Scalar],
    p: Mapping[str, Scalar],
    cos: Callable[[Scalar], Scalar],
    sin: Callable[[Scalar], Scalar],
) -> tuple[Scalar, Scalar]:
    """The kinetic and the potential energy, from the Cartesian velocities of the bodies.

    Args:
        mechanism: The mechanism.
        q: Its coordinates, all angles and then all free lengths.
        v: Their rates.
        p: Its parameters by name.
        cos: The cosine of the algebra.
        sin: The sine of the algebra.
    """
    n = mechanism.links
    kinetic = potential = joint_y = joint_vx = joint_vy = 0
    for i in range(n):
        link = mechanism.link(i, p)
        s, s_dot = (q[n + i], v[n + i]) if mechanism.free else (0, 0)
        c, d, omega = cos(q[i]), sin(q[i]), v[i]
        for body in link.bodies:
            r, r_dot = body.alpha + body.beta * s, body.beta * s_dot
            vx, vy = joint_vx + r_dot * c - r * omega * d, joint_vy + r_dot * d + r * omega * c
            kinetic += (body.mass * (vx**2 + vy**2) + body.inertia * omega**2) / 2
            potential += body.mass * p["g"] * (joint_y + r * d)
        r, r_dot = link.alpha + link.beta * s, link.beta * s_dot
        joint_y = joint_y + r * d
        joint_vx, joint_vy = joint_vx + r_dot * c - r * omega * d, joint_vy + r_dot * d + r * omega * c
    return kinetic, potential
