"""60-digit arithmetic in which every number carries a bound of what rounding can do to it."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from eomgen.ir.expr import Node
from eomgen.ir.interpret import Digits


class Rounded(NamedTuple):
    """A number of 60 digits, and how far a computed one may be from it, in units of eps."""

    value: Any
    bound: float


class RunningError:
    """Arithmetic that bounds the rounding of its own operations, to first order (Higham 2002, section 3.3).

    An operation passes on the errors of its operands and adds its own, at most eps/2 of the result. It is counted
    as eps, which leaves room for all terms of higher order. A sine or cosine is trusted to eps, about two units in
    the last place of a value near 1. A fused multiply-add rounds less often, so it keeps the bound.
    """

    def __init__(self) -> None:
        self._digits = Digits(60)

    def number(self, value: Any) -> Rounded:
        """A number of any NumPy type, exactly: what a double cannot hold is added to it."""
        head = float(value)
        tail = float(value - type(value)(head)) if np.isfinite(head) else 0.0
        return Rounded(self._digits.number(head) + self._digits.number(tail), 0.0)

    def constant(self, value: int | Fraction) -> Rounded:
        return Rounded(self._digits.constant(value), abs(float(value)))

    def turn(self, angle: Node, values: Mapping[Node, Rounded], *names: Any) -> tuple[Rounded, Rounded]:
        value, bound = values[angle]
        cos, sin = self._digits.turn(angle, {angle: value}, *names)
        return Rounded(cos, bound * abs(float(sin)) + 1), Rounded(sin, bound * abs(float(cos)) + 1)

    def apply(self, op: str, a: Rounded, b: Rounded | None = None) -> Rounded:
        x, e = a
        y, f = b or Rounded(0, 0.0)
        value = self._digits.apply(op, x, y) if b else self._digits.apply(op, x)
        match op:
            case "neg":
                return Rounded(value, e)
            case "add" | "sub":
                passed = e + f
            case "mul":
                passed = abs(float(x)) * f + abs(float(y)) * e
            case "div":
                passed = (e + abs(float(value)) * f) / abs(float(y))
            case "pivot_inverse":
                passed = float(value) ** 2 * e
            case _:
                raise AssertionError(f"no bound of the error of {op}")
        return Rounded(value, passed + abs(float(value)))

    def errors(self, found: Sequence[Any], expected: Sequence[Rounded]) -> np.ndarray:
        """How far computed numbers are from those expected."""
        return np.array([float(abs(self.number(x).value - y.value)) for x, y in zip(found, expected, strict=True)])
