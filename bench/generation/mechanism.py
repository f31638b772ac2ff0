"""The mechanisms of Table 1, their parameters and the reference values of their equations.

A mechanism is a serial chain from the ground; angles are absolute, counter-clockwise from the x axis, and
gravity acts along -y. Every link is an affine link (bodies at alpha + beta s from its joint), so a contender
needs one kind of link. The reference evaluation shares that description with the contenders and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Scalar = Any  # a float, or an expression of the contender's library

GRAVITY = 9.81
NOMINAL: dict[str, dict[str, float]] = {
    "point-masses": {"m0": 0.25, "m1": 0.5, "m2": 0.25, "n0": 0.0, "n1": 0.5, "n2": 1.0},
    "elastic-rod": {"m": 1.0, "l": 0.5, "I": 1.0 * 0.5**2 / 3},
    "rigid": {"m": 1.0, "l": 1.0, "c": 0.5, "J": 1.0 / 12},
}
"""Values of one link's parameters by kind: masses m (kg), fractions n, lengths l and centre c (m), inertia I
about the near end and J about the centre (kg m²)."""


class Body(NamedTuple):
    """A body on a link, its centre at alpha + beta s from the joint, with its central inertia."""

    mass: Scalar
    alpha: Scalar
    beta: Scalar
    inertia: Scalar


class Link(NamedTuple):
    """An affine link: its bodies, and its far end at alpha + beta s from the joint."""

    bodies: tuple[Body, ...]
    alpha: Scalar
    beta: Scalar


@dataclass(frozen=True)
class Mechanism:
    """A serial chain of equal links.

    Attributes:
        kind: One of the keys of ``NOMINAL``.
        links: The number of links, at least 1.
        spread: Link i (from 0) has 1 + spread i times the nominal values. Derivations do not see values; a
            check with unequal links finds parameters that were mixed up between links.
    """

    kind: str
    links: int
    spread: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in NOMINAL:
            raise ValueError(f"kind {self.kind!r} is unknown: choose one of {', '.join(NOMINAL)}")
        if self.links < 1:
            raise ValueError(f"a chain of {self.links} links is empty: give at least 1 link")

    @property
    def free(self) -> bool:
        """True where every link has a free length."""
        return self.kind != "rigid"

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates: all angles, then all free lengths."""
        angles = tuple(f"phi_{i}" for i in range(self.links))
        return angles + tuple(f"s_{i}" for i in range(self.links)) if self.free else angles

    @property
    def rates(self) -> tuple[str, ...]:
        """Names of the rates, in the order of the coordinates."""
        return tuple(f"{name}_dot" for name in self.coordinates)

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the parameters by name: gravity, then each link's own."""
        values = {"g": GRAVITY}
        for i in range(self.links):
            factor = 1 + self.spread * i
            values |= {f"{name}_{i}": value * factor for name, value in NOMINAL[self.kind].items()}
        return values

    def link(self, i: int, p: Mapping[str, Scalar]) -> Link:
        """The constants of link i, as numbers or as expressions.

        Args:
            i: The link, from 0 at the ground.
            p: The parameters by name: numbers, or symbols of any library with the usual operators.
        """
        if self.kind == "point-masses":
            return Link(tuple(Body(p[f"m{k}_{i}"], 0, p[f"n{k}_{i}"], 0) for k in range(3)), 0, 1)
        mass, length = p[f"m_{i}"], p[f"l_{i}"]
        if self.kind == "elastic-rod":
            return Link((Body(mass, length / 2, 1, p[f"I_{i}"] - mass * length**2 / 4),), length, 1)
        return Link((Body(mass, p[f"c_{i}"], 0, p[f"J_{i}"]),), length, 0)

    def random_state(self, seed: int) -> tuple[Vector, Vector]:
        """Coordinates (rad, m; lengths from 0.3 to 0.9 m) and rates (rad/s, m/s; from -2 to 2) of a seed."""
        random = np.random.default_rng(seed)
        lengths = self.links if self.free else 0
        q = np.concatenate([random.uniform(-np.pi, np.pi, self.links), random.uniform(0.3, 0.9, lengths)])
        return q, random.uniform(-2, 2, q.size)

    def reference(self, q: Vector, v: Vector) -> tuple[Vector, Vector]:
        """The mass matrix (n, n) and the bias (n) of a state, by the table of Borisov and Rozenblat (2017).

        The bias holds the terms of velocity and gravity: M a + h is the generalised force.

        Args:
            q: The coordinates (n), all angles and then all free lengths; rad and m.
            v: Their rates (n).
        """
        n = self.links
        s, s_dot = (q[n:], v[n:]) if self.free else (np.zeros(n), np.zeros(n))
        phi, omega, g = q[:n], v[:n], GRAVITY
        chain = [self.link(i, self.parameters) for i in range(n)]
        mass = [sum(b.mass for b in link.bodies) for link in chain]
        mass_matrix, bias = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
        for i in range(n):
            bodies = [(b, b.alpha + b.beta * s[i]) for b in chain[i].bodies]
            below = sum(mass[i + 1 :])
            length, slope = chain[i].alpha + chain[i].beta * s[i], chain[i].beta
            arm = sum(b.mass * r for b, r in bodies) + length * below
            arm_slope = sum(b.mass * b.beta for b, _ in bodies) + slope * below
            mixed = sum(b.mass * b.beta * r for b, r in bodies) + length * slope * below
            # Diagonals of A, G, D and H, and the gravity terms C and K.
            mass_matrix[i, i] = sum(b.mass * r**2 + b.inertia for b, r in bodies) + length**2 * below
            mass_matrix[n + i, n + i] = sum(b.mass * b.beta**2 for b, _ in bodies) + slope**2 * below
            bias[i] += 2 * mixed * omega[i] * s_dot[i] + g * arm * math.cos(phi[i])
            bias[n + i] += -mixed * omega[i] ** 2 + g * arm_slope * math.sin(phi[i])
            for a in range(i):  # a is an ancestor of i: a row of the table, then its mirror image
                up = chain[a].alpha + chain[a].beta * s[a]
                up_slope = chain[a].beta
                cos, sin = math.cos(phi[a] - phi[i]), math.sin(phi[a] - phi[i])
                mass_matrix[a, i] = mass_matrix[i, a] = up * arm * cos
                mass_matrix[a, n + i] = mass_matrix[n + i, a] = -up * arm_slope * sin
                mass_matrix[i, n + a] = mass_matrix[n + a, i] = up_slope * arm * sin
                mass_matrix[n + a, n + i] = mass_matrix[n + i, n + a] = up_slope * arm_slope * cos
                bias[a] += up * arm * sin * omega[i] ** 2 + 2 * up * arm_slope * cos * omega[i] * s_dot[i]
                bias[i] += -up * arm * sin * omega[a] ** 2 + 2 * up_slope * arm * cos * omega[a] * s_dot[a]
                turn = 2 * up_slope * arm_slope * sin
                bias[n + a] += -up_slope * arm * cos * omega[i] ** 2 + turn * omega[i] * s_dot[i]
                bias[n + i] += -up * arm_slope * cos * omega[a] ** 2 - turn * omega[a] * s_dot[a]
        size = q.size
        return mass_matrix[:size, :size], bias[:size]
