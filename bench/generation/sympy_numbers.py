"""Numeric values of SymPy matrices: the check of the SymPy contenders, not timed.

Imports are not timed either, so this module, which all three use, imports what SymPy would import on first
use: some 0.02 s, most of what the smallest derivations would take.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import sympy as sm
import sympy.assumptions.wrapper
import sympy.matrices.expressions.applyfunc
import sympy.sets.setexpr
import sympy.tensor.array.array_derivatives
import sympy.tensor.array.expressions
import sympy.tensor.tensor

from bench.generation.mechanism import Vector


def evaluate_matrix(matrix: sm.MatrixBase, values: Mapping[sm.Basic, float]) -> Vector:
    """The entries of a matrix in floats, each distinct subexpression computed once.

    ``lambdify`` would print and compile every repetition in what ``LagrangesMethod`` returns.

    Args:
        matrix: Entries of sums, products, powers, sines and cosines.
        values: The number of every symbol, function and derivative in them.
    """
    known: dict[sm.Basic, float] = dict(values)

    def value(expression: sm.Basic) -> float:
        number = known.get(expression)
        if number is None:
            arguments = [value(argument) for argument in expression.args]
            if isinstance(expression, sm.Add):
                number = math.fsum(arguments)
            elif isinstance(expression, sm.Mul):
                number = math.prod(arguments)
            elif isinstance(expression, sm.Pow):
                number = arguments[0] ** arguments[1]
            elif isinstance(expression, sm.sin):
                number = math.sin(arguments[0])
            elif isinstance(expression, sm.cos):
                number = math.cos(arguments[0])
            else:
                number = float(expression)  # a number; anything else raises TypeError
            known[expression] = number
        return number

    return np.array([[value(entry) for entry in row] for row in matrix.tolist()])
