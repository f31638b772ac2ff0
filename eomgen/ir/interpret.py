"""Reference evaluation of expressions: one rule per operation, over any kind of number.

`evaluate` is the judge of every other path. It runs in floating point (`Floats`, scalars or arrays), in a
prime field (`PrimeField`, an exact test of identity) or at any precision (`Digits`, mpmath).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any, Protocol

import numpy as np

from eomgen.errors import UnsupportedError
from eomgen.ir.expr import Node, reachable
from eomgen.ir.program import Block, Program

Label = Callable[[Node], str]


class Arithmetic(Protocol):
    """What `evaluate` needs of a kind of number."""

    def constant(self, value: int | Fraction) -> Any: ...
    def apply(self, op: str, *args: Any) -> Any: ...
    def turn(self, angle: Node, values: Mapping[Node, Any], label: Label) -> tuple[Any, Any]: ...


def evaluate(
    outputs: Sequence[Node], given: Mapping[Node, Any], arithmetic: Arithmetic, label: Label | None = None
) -> list[Any]:
    """The values of some expressions.

    Args:
        outputs: the expressions.
        given: the values of symbols (or of any node, which is then not looked behind).
        arithmetic: the kind of number.
        label: the name of a symbol, where it is not the symbol's own.

    Raises:
        KeyError: a symbol has no value.
    """
    values: dict[Node, Any] = dict(given)
    turns: dict[Node, tuple[Any, Any]] = {}
    for node in reachable(outputs, given):
        if node in values:
            continue
        op, args = node.op, node.args
        if op == "constant":
            values[node] = arithmetic.constant(node.value)
        elif op == "symbol":
            raise KeyError(f"symbol {node.name!r} has no value")
        elif op == "sin" or op == "cos":
            if args[0] not in turns:
                turns[args[0]] = arithmetic.turn(args[0], values, label or _own_name)
            values[node] = turns[args[0]][op == "sin"]
        elif len(args) == 2:
            values[node] = arithmetic.apply(op, values[args[0]], values[args[1]])
        else:
            values[node] = arithmetic.apply(op, values[args[0]])
    return [values[output] for output in outputs]


def _own_name(symbol: Node) -> str:
    return symbol.name


def run(program: Program, inputs: Mapping[str, Sequence[Any]], arithmetic: Arithmetic) -> list[Any]:
    """The result of a program, block by block, loops included.

    Args:
        program: the program.
        inputs: the elements of every input array, flattened.
        arithmetic: the kind of number.
    """
    arrays: dict[str, list[Any]] = {name: list(values) for name, values in inputs.items()}
    for array in (*program.scratch, program.output):
        arrays[array.name] = [None] * array.size
    names = {array.name: array.symbols for array in program.inputs}

    for step in (*program.constants, *program.blocks):
        for block, k, i in step.iterations():
            _run_once(block, k, i, arrays, names, arithmetic)
    return arrays[program.output.name]


def _run_once(
    block: Block,
    k: int,
    i: int,
    arrays: dict[str, list[Any]],
    names: Mapping[str, tuple[str, ...]],
    arithmetic: Arithmetic,
) -> None:
    """Iteration k of a block, i of its inner loop."""

    def label(node: Node) -> str:
        if node not in block.loads:  # behind a value that another block computed
            return node.name
        place = block.loads[node]
        return names[place.array][place.index(k, i)]

    given = {node: arrays[place.array][place.index(k, i)] for node, place in block.loads.items()}
    values = evaluate([store.node for store in block.stores], given, arithmetic, label)
    for store, value in zip(block.stores, values, strict=True):
        array, index = arrays[store.place.array], store.place.index(k, i)
        array[index] = arithmetic.apply("add", array[index], value) if store.add else value


class Operators:
    """`apply` for numbers with the operators of Python; a kind of number says what is left."""

    def divide(self, a: Any, b: Any) -> Any:
        return a / b

    def pivot_inverse(self, pivot: Any, reference: Any) -> Any:
        return 1 / pivot

    def function(self, name: str, a: Any) -> Any:
        """The value of sqrt, exp or log."""
        raise NotImplementedError

    def apply(self, op: str, a: Any, b: Any = None) -> Any:
        match op:
            case "add":
                return a + b
            case "sub":
                return a - b
            case "mul":
                return a * b
            case "div":
                return self.divide(a, b)
            case "neg":
                return -a
            case "pivot_inverse":
                return self.pivot_inverse(a, b)
            case "sqrt" | "exp" | "log":
                return self.function(op, a)
        raise AssertionError(op)


class Floats(Operators):
    """float64 scalars or arrays. A pivot is safe beside its reference above 16 eps (see `docs/accuracy.md`)."""

    PIVOT, LEAST = 16 * np.finfo(float).eps, np.finfo(float).tiny

    def constant(self, value: int | Fraction) -> float:
        return float(value)

    def turn(self, angle: Node, values: Mapping[Node, Any], label: Label) -> tuple[Any, Any]:
        return np.cos(values[angle]), np.sin(values[angle])

    def divide(self, a: Any, b: Any) -> Any:
        return np.divide(a, b)

    def pivot_inverse(self, pivot: Any, reference: Any) -> Any:
        safe = np.greater(pivot, self.PIVOT * reference + self.LEAST)
        return np.divide(np.where(safe, 1.0, 0.0), np.where(safe, pivot, 0.0))

    def function(self, name: str, a: Any) -> Any:
        return getattr(np, name)(a)


class Digits(Operators):
    """Decimal digits of precision by mpmath, from the exact binary inputs.

    Args:
        digits: significant decimal digits.
    """

    def __init__(self, digits: int = 60) -> None:
        import mpmath

        self.context = mpmath.MPContext()
        self.context.dps = digits

    def number(self, value: float) -> Any:
        """A float, exactly."""
        return self.context.mpf(float(value))

    def constant(self, value: int | Fraction) -> Any:
        return self.context.mpf(value.numerator) / value.denominator

    def turn(self, angle: Node, values: Mapping[Node, Any], label: Label) -> tuple[Any, Any]:
        cos, sin = self.context.cos_sin(values[angle])
        return cos, sin

    def pivot_inverse(self, pivot: Any, reference: Any) -> Any:
        return 1 / pivot if pivot > 0 else self.context.nan

    def function(self, name: str, a: Any) -> Any:
        return getattr(self.context, name)(a)


class PrimeField:
    """Integers modulo 2^61 - 1, for an exact test of identity.

    Every quantity of a scene is a rational function of parameters, rates, lengths and of points (cos, sin) on
    unit circles. Angles become random points of the circle group, so two expressions that agree at a random
    point are the same function but for a probability of the order of degree / 2^61 (Schwartz 1980). An
    expression can be tested if every sine and cosine is of a sum of symbols with whole coefficients.

    Args:
        seed: names the random point; a symbol's value depends on the seed and its name only, so expressions
            of different graphs meet the same point.
    """

    P = (1 << 61) - 1

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed

    def random(self, name: str) -> int:
        """The value of a symbol."""
        text = f"{self.seed}/{name}".encode()
        return int.from_bytes(hashlib.blake2b(text, digest_size=16).digest(), "big") % self.P

    def _point(self, name: str) -> tuple[int, int]:
        """A random point of the circle: ((1 - t²)/(1 + t²), 2 t/(1 + t²)); -1 is no square modulo P."""
        t = self.random(f"circle/{name}")
        scale = pow(1 + t * t, -1, self.P)
        return (1 - t * t) * scale % self.P, 2 * t * scale % self.P

    def constant(self, value: int | Fraction) -> int:
        return value.numerator * pow(value.denominator, -1, self.P) % self.P

    def turn(self, angle: Node, values: Mapping[Node, int], label: Label) -> tuple[int, int]:
        points: dict[Node, tuple[int, int]] = {}
        for node in reachable([angle]):
            args = node.args
            if node.op == "symbol":
                points[node] = self._point(label(node))
            elif node.op == "neg":
                c, s = points[args[0]]
                points[node] = (c, -s % self.P)
            elif node.op in ("add", "sub"):
                (c, s), (d, t) = points[args[0]], points[args[1]]
                points[node] = self._rotate(c, s, d, t if node.op == "add" else -t)
            elif node.op == "mul" and args[0].op == "constant" and isinstance(args[0].value, int):
                points[node] = self._multiple(points[args[1]], args[0].value)
            elif node.op == "constant":
                points[node] = self._point(f"constant {node.value}")
            else:
                raise UnsupportedError(
                    "the exact test needs sines and cosines of sums of symbols with whole coefficients; "
                    f"it cannot test the sine or cosine of a {node.op!r}"
                )
        return points[angle]

    def _rotate(self, c: int, s: int, d: int, t: int) -> tuple[int, int]:
        return (c * d - s * t) % self.P, (s * d + c * t) % self.P

    def _multiple(self, point: tuple[int, int], times: int) -> tuple[int, int]:
        if times < 0:
            point, times = (point[0], -point[1]), -times
        result = (1, 0)
        while times:
            if times & 1:
                result = self._rotate(*result, *point)
            point = self._rotate(*point, *point)
            times >>= 1
        return result

    def apply(self, op: str, a: int, b: int = 0) -> int:
        match op:
            case "add":
                return (a + b) % self.P
            case "sub":
                return (a - b) % self.P
            case "mul":
                return a * b % self.P
            case "neg":
                return -a % self.P
            case "div":
                return a * pow(b, -1, self.P) % self.P
            case "pivot_inverse":
                return pow(a, -1, self.P) if a else 0
        raise UnsupportedError(f"the exact test knows rational functions only, not {op!r}")


def fingerprint(outputs: Sequence[Node], seed: int = 0, given: Mapping[str, Fraction] | None = None) -> list[int]:
    """The exact values of expressions at a random point of the prime field.

    Args:
        outputs: the expressions.
        seed: names the point.
        given: values for symbols by name that are not to be random.
    """
    field = PrimeField(seed)
    fixed = given or {}
    values = {
        node: field.constant(fixed[node.name]) if node.name in fixed else field.random(node.name)
        for node in reachable(outputs)
        if node.op == "symbol"
    }
    return evaluate(outputs, values, field)
