"""The matrix method in SymEngine: every element from the table, then SymEngine's matrix products."""

from __future__ import annotations

import symengine as se

from bench.generation.mechanism import Mechanism, Vector
from bench.generation.symengine_numbers import evaluate_matrix
from bench.generation.table import elements

VERSION = f"SymEngine {se.__version__}"

Derived = tuple[se.DenseMatrix, se.DenseMatrix]


def derive(mechanism: Mechanism) -> Derived:
    """The symbolic mass matrix and bias of a mechanism."""
    n = mechanism.links
    q = [se.Symbol(name) for name in mechanism.coordinates]
    v = [se.Symbol(name) for name in mechanism.rates]
    p = {name: se.Symbol(name) for name in mechanism.parameters}
    rows = elements(mechanism, q, p, se.cos, se.sin)
    matrix = {letter: se.DenseMatrix(entries) for letter, entries in rows.items()}
    squares = se.DenseMatrix([rate**2 for rate in v[:n]])
    # A φ̈ + E s̈ + B φ̇² + 2 D (φ̇ ṡ) + g C
    if not mechanism.free:
        return matrix["A"], matrix["B"] * squares + matrix["C"] * p["g"]
    products = se.DenseMatrix([2 * rate * s_dot for rate, s_dot in zip(v[:n], v[n:], strict=True)])
    angles = matrix["B"] * squares + matrix["D"] * products + matrix["C"] * p["g"]
    # Eᵀ φ̈ + G s̈ + H φ̇² + 2 Λ (φ̇ ṡ) + g K
    lengths = matrix["H"] * squares + matrix["L"] * products + matrix["K"] * p["g"]
    upper = matrix["A"].row_join(matrix["E"])
    mass_matrix = upper.col_join(matrix["E"].T.row_join(matrix["G"]))
    return mass_matrix, angles.col_join(lengths)


def evaluate(derived: Derived, mechanism: Mechanism, q: Vector, v: Vector) -> tuple[Vector, Vector]:
    """See `bench.generation.one.Contender`."""
    mass_matrix, bias = derived
    return evaluate_matrix(mass_matrix, mechanism, q, v), evaluate_matrix(bias, mechanism, q, v)[:, 0]
