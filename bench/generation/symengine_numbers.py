"""Numeric values of SymEngine matrices: the check of the SymEngine contenders, not timed."""

from __future__ import annotations

import numpy as np
import symengine as se

from bench.generation.mechanism import Mechanism, Vector


def evaluate_matrix(matrix: se.DenseMatrix, mechanism: Mechanism, q: Vector, v: Vector) -> Vector:
    """The entries of a matrix in floats at a state of a mechanism.

    Substitution computes a subexpression of an entry once. ``Lambdify`` takes 30 s where this takes 0.4 s:
    the mass matrix of 20 links of point masses by Lagrange.

    Args:
        matrix: Entries in the mechanism's parameters, coordinates and rates.
        mechanism: The mechanism.
        q: Its coordinates (n).
        v: Their rates (n).
    """
    names = [*mechanism.parameters, *mechanism.coordinates, *mechanism.rates]
    numbers = [*mechanism.parameters.values(), *q.tolist(), *v.tolist()]
    values = {se.Symbol(name): number for name, number in zip(names, numbers, strict=True)}
    return np.array(matrix.msubs(values).tolist(), dtype=float)
