"""Motions to any number of digits: extrapolation of the midpoint rule, the reference of `bench stability`.

The explicit midpoint rule with an even number of steps has an error in even powers of its step alone, so k runs with
2, 4, ..., 2 k steps eliminate k powers of it (Gragg 1965; Hairer, Nørsett & Wanner 1993, section II.9). Order and step
follow from the digits asked for. The numbers are `arb` balls whose radii are dropped after every evaluation: nothing is
certified here, so two runs of different digits, and with them of different orders and steps, have to agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from eomgen.certify import Balls, import_flint
from eomgen.ir.equations import Equations
from eomgen.ir.interpret import evaluate

Vector = list[Any]
Field = Callable[[Vector], Vector]


class Motion(NamedTuple):
    """The state at the end, as lists of `arb` numbers, and how many steps led there."""

    q: Vector
    v: Vector
    steps: int


def motion(equations: Equations, q: Sequence[Any], v: Sequence[Any], end: float, digits: int = 32) -> Motion:
    """The state of a mechanism without inputs and prescribed lengths after some time.

    Args:
        equations: they give the accelerations and the parameters' values.
        q, v: the state at time 0, floats (taken as the binary numbers they are) or `arb` numbers.
        end: the time, s.
        digits: decimal digits that a step keeps of the larger of 1 and the state.

    Raises:
        UnsupportedError: python-flint is missing.
    """
    flint = import_flint()
    columns, n = math.ceil(digits / 2), len(q)
    # Ten digits for cancellation in the extrapolation, and bits for the rounding that grows from link to link.
    with flint.ctx.workprec(math.ceil((digits + 10) / math.log10(2)) + 4 * n):
        field = _field(equations)
        time, end, state = flint.arb(0), flint.arb(end), [flint.arb(x) for x in (*q, *v)]
        length, steps = 1e-3, 0
        while time < end:
            step = min(flint.arb(length), end - time)
            found, error = _step(field, state, step, columns)
            size = max(1.0, *(abs(float(x)) for x in state))
            if error <= 10.0**-digits * size:
                state, time, steps = found, (time + step).mid(), steps + 1
            error = max(error / size, 1e-300)
            length = float(step) * min(4.0, 0.9 * (10.0**-digits / error) ** (1 / (2 * columns - 1)))
    return Motion(state[:n], state[n:], steps)


def _field(equations: Equations) -> Field:
    """The state's rate."""
    flint = import_flint()
    n, arithmetic, accelerations = len(equations.q), Balls(), list(equations.forward_dynamics)
    symbols = (*equations.q, *equations.v)
    fixed = dict(zip(equations.p, map(flint.arb, equations.symbols.p_values), strict=True))
    fixed |= dict.fromkeys(equations.u, flint.arb(0))

    def field(state: Vector) -> Vector:
        given = fixed | dict(zip(symbols, state, strict=True))
        return state[n:] + [x.mid() for x in evaluate(accelerations, given, arithmetic)]

    return field


def _step(field: Field, state: Vector, step: Any, columns: int) -> tuple[Vector, float]:
    """The state a step later, and how far the last two extrapolations are apart."""
    flint = import_flint()
    start = field(state)
    row: list[Vector] = []
    for j in range(1, columns + 1):
        h = step / (2 * j)
        before, now = state, [x + h * rate for x, rate in zip(state, start, strict=True)]
        for _ in range(2 * j - 1):
            before, now = now, [x + 2 * h * rate for x, rate in zip(before, field(now), strict=True)]
        found = [now]
        for k, coarse in enumerate(row, 1):  # Aitken and Neville: from 2 (j - k) and 2 j steps
            weight = (flint.arb(j) / (j - k)) ** 2 - 1
            fine = found[-1]
            found.append([x + (x - y) / weight for x, y in zip(fine, coarse, strict=True)])
        row = found
    error = max(abs(float(x - y)) for x, y in zip(row[-1], row[-2], strict=True))
    return [x.mid() for x in row[-1]], error
