"""The matrix method in plain SymPy: every element from the table, then SymPy's matrix products."""

from __future__ import annotations

import sympy as sm

from bench.generation.mechanism import Mechanism, Vector
from bench.generation.sympy_numbers import evaluate_matrix
from bench.generation.table import elements

VERSION = f"SymPy {sm.__version__}"

Derived = tuple[sm.Matrix, sm.Matrix]


def derive(mechanism: Mechanism) -> Derived:
    """The symbolic mass matrix and bias of a mechanism."""
    n = mechanism.links
    q = [sm.Symbol(name) for name in mechanism.coordinates]
    v = [sm.Symbol(name) for name in mechanism.rates]
    p = {name: sm.Symbol(name) for name in mechanism.parameters}
    matrix = {letter: sm.Matrix(rows) for letter, rows in elements(mechanism, q, p, sm.cos, sm.sin).items()}
    squares = sm.Matrix([rate**2 for rate in v[:n]])
    # A φ̈ + E s̈ + B φ̇² + 2 D (φ̇ ṡ) + g C
    if not mechanism.free:
        return matrix["A"], matrix["B"] * squares + p["g"] * matrix["C"]
    products = sm.Matrix([2 * rate * s_dot for rate, s_dot in zip(v[:n], v[n:], strict=True)])
    angles = matrix["B"] * squares + matrix["D"] * products + p["g"] * matrix["C"]
    # Eᵀ φ̈ + G s̈ + H φ̇² + 2 Λ (φ̇ ṡ) + g K
    lengths = matrix["H"] * squares + matrix["L"] * products + p["g"] * matrix["K"]
    mass_matrix = sm.Matrix([[matrix["A"], matrix["E"]], [matrix["E"].T, matrix["G"]]])
    return mass_matrix, angles.col_join(lengths)


def evaluate(derived: Derived, mechanism: Mechanism, q: Vector, v: Vector) -> tuple[Vector, Vector]:
    """See `bench.generation.one.Contender`."""
    mass_matrix, bias = derived
    numbers = mechanism.parameters | dict(
        zip(mechanism.coordinates + mechanism.rates, [*q.tolist(), *v.tolist()], strict=True)
    )
    values = {sm.Symbol(name): value for name, value in numbers.items()}
    return evaluate_matrix(mass_matrix, values), evaluate_matrix(bias, values)[:, 0]
