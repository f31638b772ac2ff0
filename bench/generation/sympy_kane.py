"""SymPy's ``KanesMethod``, without ``simplify``: particles and rigid bodies in the frames of their links.

Velocities are given, accelerations are SymPy's work. Writing the velocities in the inertial frame, giving the
accelerations too, or both, makes it at most a quarter faster from 2 links on.
"""

from __future__ import annotations

import sympy as sm
from sympy.physics.mechanics import (
    KanesMethod,
    Particle,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    outer,
)

from bench.generation.mechanism import Mechanism, Vector
from bench.generation.sympy_numbers import evaluate_matrix

VERSION = f"SymPy {sm.__version__}"

Derived = tuple[sm.Matrix, sm.Matrix]


def derive(mechanism: Mechanism) -> Derived:
    """The symbolic mass matrix and forcing (minus the bias) of a mechanism."""
    n = mechanism.links
    q = [dynamicsymbols(name) for name in mechanism.coordinates]
    u = [dynamicsymbols(name) for name in mechanism.rates]
    p = {name: sm.Symbol(name) for name in mechanism.parameters}
    ground = ReferenceFrame("ground")
    joint = Point("origin")
    joint.set_vel(ground, 0)
    bodies = []
    loads = []
    for i in range(n):
        link = mechanism.link(i, p)
        s, s_dot = (q[n + i], u[n + i]) if mechanism.free else (0, 0)
        frame = ground.orientnew(f"link_{i}", "Axis", [q[i], ground.z])
        frame.set_ang_vel(ground, u[i] * ground.z)
        # r along the link and its velocity: r u and ṙ u + r ω n
        for k, body in enumerate(link.bodies):
            r = body.alpha + body.beta * s
            centre = joint.locatenew(f"centre_{i}_{k}", r * frame.x)
            centre.set_vel(ground, joint.vel(ground) + body.beta * s_dot * frame.x + r * u[i] * frame.y)
            if body.inertia == 0:
                bodies.append(Particle(f"body_{i}_{k}", centre, body.mass))
            else:
                inertia = (body.inertia * outer(frame.z, frame.z), centre)
                bodies.append(RigidBody(f"body_{i}_{k}", centre, frame, body.mass, inertia))
            loads.append((centre, -body.mass * p["g"] * ground.y))
        r = link.alpha + link.beta * s
        end = joint.locatenew(f"end_{i}", r * frame.x)
        end.set_vel(ground, joint.vel(ground) + link.beta * s_dot * frame.x + r * u[i] * frame.y)
        joint = end
    rates = [coordinate.diff(dynamicsymbols._t) - rate for coordinate, rate in zip(q, u, strict=True)]
    method = KanesMethod(ground, q, u, kd_eqs=rates)
    method.kanes_equations(bodies, loads)
    return method.mass_matrix, method.forcing


def evaluate(derived: Derived, mechanism: Mechanism, q: Vector, v: Vector) -> tuple[Vector, Vector]:
    """See `bench.generation.one.Contender`."""
    mass_matrix, forcing = derived
    symbols = [dynamicsymbols(name) for name in mechanism.coordinates + mechanism.rates]
    values = {sm.Symbol(name): value for name, value in mechanism.parameters.items()}
    values |= dict(zip(symbols, [*q.tolist(), *v.tolist()], strict=True))
    return evaluate_matrix(mass_matrix, values), -evaluate_matrix(forcing, values)[:, 0]
