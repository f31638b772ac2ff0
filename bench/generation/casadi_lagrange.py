"""Lagrange's equations in CasADi by its usual idiom: scalar energies in SX, then their derivatives."""

from __future__ import annotations

import casadi as ca
import numpy as np

from bench.generation.energy import energies
from bench.generation.mechanism import Mechanism, Vector

VERSION = f"CasADi {ca.CasadiMeta.version()}"

Derived = tuple[ca.SX, ...]


def derive(mechanism: Mechanism) -> Derived:
    """The symbols q, v and p and the symbolic mass matrix and bias of a mechanism."""
    size = len(mechanism.coordinates)
    q, v = ca.SX.sym("q", size), ca.SX.sym("v", size)
    p = ca.SX.sym("p", len(mechanism.parameters))
    named = dict(zip(mechanism.parameters, ca.vertsplit(p), strict=True))
    kinetic, potential = energies(mechanism, ca.vertsplit(q), ca.vertsplit(v), named, ca.cos, ca.sin)
    mass_matrix, momentum = ca.hessian(kinetic, v)
    # h = (∂p/∂q) v - ∂T/∂q + ∂V/∂q
    bias = ca.jtimes(momentum, q, v) - ca.gradient(kinetic - potential, q)
    return q, v, p, mass_matrix, bias


def evaluate(derived: Derived, mechanism: Mechanism, q: Vector, v: Vector) -> tuple[Vector, Vector]:
    """See `bench.generation.one.Contender`."""
    function = ca.Function("equations", derived[:3], derived[3:])
    mass_matrix, bias = function(q, v, list(mechanism.parameters.values()))
    return np.asarray(mass_matrix.full()), np.asarray(bias.full())[:, 0]
