"""SymPy's ``LagrangesMethod``, without ``simplify``.

The Lagrangian is written from the bodies' Cartesian velocities and expanded: of the forms tried on the
paper's point masses (expanded, as it stands, and built by ``Lagrangian`` from ``Particle`` objects) it is the
fastest from 2 links on, by a factor of 1.5 to 1.7 at 4 links.
"""

from __future__ import annotations

import sympy as sm
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

from bench.generation.energy import energies
from bench.generation.mechanism import Mechanism, Vector
from bench.generation.sympy_numbers import evaluate_matrix

VERSION = f"SymPy {sm.__version__}"

Derived = tuple[sm.Matrix, sm.Matrix]


def derive(mechanism: Mechanism) -> Derived:
    """The symbolic mass matrix and forcing (minus the bias) of a mechanism."""
    q = [dynamicsymbols(name) for name in mechanism.coordinates]
    v = [coordinate.diff(dynamicsymbols._t) for coordinate in q]
    p = {name: sm.Symbol(name) for name in mechanism.parameters}
    kinetic, potential = energies(mechanism, q, v, p, sm.cos, sm.sin)
    method = LagrangesMethod(sm.expand(kinetic - potential), q)
    method.form_lagranges_equations()
    return method.mass_matrix, method.forcing


def evaluate(derived: Derived, mechanism: Mechanism, q: Vector, v: Vector) -> tuple[Vector, Vector]:
    """See `bench.generation.one.Contender`."""
    mass_matrix, forcing = derived
    symbols = [dynamicsymbols(name) for name in mechanism.coordinates]
    values = {sm.Symbol(name): value for name, value in mechanism.parameters.items()}
    values |= dict(zip(symbols, q.tolist(), strict=True))
    values |= dict(zip([symbol.diff(dynamicsymbols._t) for symbol in symbols], v.tolist(), strict=True))
    return evaluate_matrix(mass_matrix, values), -evaluate_matrix(forcing, values)[:, 0]
