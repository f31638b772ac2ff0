"""Lagrange's equations in SymEngine: derivatives of the energies, nothing expanded."""

from __future__ import annotations

import symengine as se

from bench.generation.energy import energies
from bench.generation.mechanism import Mechanism, Vector
from bench.generation.symengine_numbers import evaluate_matrix

VERSION = f"SymEngine {se.__version__}"

Derived = tuple[se.DenseMatrix, se.DenseMatrix]


def derive(mechanism: Mechanism) -> Derived:
    """The symbolic mass matrix and bias of a mechanism."""
    q = [se.Symbol(name) for name in mechanism.coordinates]
    v = [se.Symbol(name) for name in mechanism.rates]
    p = {name: se.Symbol(name) for name in mechanism.parameters}
    kinetic, potential = energies(mechanism, q, v, p, se.cos, se.sin)
    q_column, v_column = se.DenseMatrix(q), se.DenseMatrix(v)
    momentum = se.DenseMatrix([kinetic.diff(rate) for rate in v])
    force = se.DenseMatrix([(kinetic - potential).diff(coordinate) for coordinate in q])
    # h = (∂p/∂q) v - ∂T/∂q + ∂V/∂q
    return momentum.jacobian(v_column), momentum.jacobian(q_column) * v_column - force


def evaluate(derived: Derived, mechanism: Mechanism, q: Vector, v: Vector) -> tuple[Vector, Vector]:
    """See `bench.generation.one.Contender`."""
    mass_matrix, bias = derived
    return evaluate_matrix(mass_matrix, mechanism, q, v), evaluate_matrix(bias, mechanism, q, v)[:, 0]
