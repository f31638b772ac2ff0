"""Interned scalar expressions: the one place where nodes are made.

A `Graph` owns its nodes. Asking twice for the same operation on the same operands gives the same node, so
common subexpressions are shared from birth and equality is identity. Node numbers grow with creation and
operands exist before their users, so ascending numbers are a topological order and nothing recurses.

The constructors fold constants (exactly, as rational numbers), drop zeros and ones and move signs outward.
Every rewrite they make is exact in floating-point arithmetic too, except the folding of constants, which
rounds once instead of several times.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable
from fractions import Fraction
from typing import TypeAlias

Number: TypeAlias = int | float | Fraction
Operand: TypeAlias = "Node | int | float | Fraction"

UNARY = ("neg", "sin", "cos", "sqrt", "exp", "log")
BINARY = ("add", "sub", "mul", "div", "pivot_inverse")
LEAVES = ("constant", "symbol")


class Node:
    """One scalar: a constant, a symbol, or an operation on other nodes of the same graph.

    Attributes:
        graph: the owner.
        id: number in order of creation.
        op: an entry of `LEAVES`, `UNARY` or `BINARY`. `pivot_inverse(d, r)` is 1/d where d is safely positive
            beside its reference r > 0, and NaN where it is not (see `docs/design.md`).
        args: the operands.
        value: the exact number of a constant, otherwise 0.
        name: the name of a symbol, otherwise "".
    """

    __slots__ = ("args", "graph", "id", "name", "op", "value")

    def __init__(
        self,
        graph: Graph,
        number: int,
        op: str,
        args: tuple[Node, ...] = (),
        value: int | Fraction = 0,
        name: str = "",
    ) -> None:
        self.graph = graph
        self.id = number
        self.op = op
        self.args = args
        self.value = value
        self.name = name

    def __add__(self, other: Operand) -> Node:
        return self.graph.add(self, other if other.__class__ is Node else self.graph.constant(other))  # type: ignore[arg-type]

    def __radd__(self, other: Operand) -> Node:
        return self.graph.add(self.graph.node(other), self)

    def __sub__(self, other: Operand) -> Node:
        return self.graph.sub(self, other if other.__class__ is Node else self.graph.constant(other))  # type: ignore[arg-type]

    def __rsub__(self, other: Operand) -> Node:
        return self.graph.sub(self.graph.node(other), self)

    def __mul__(self, other: Operand) -> Node:
        return self.graph.mul(self, other if other.__class__ is Node else self.graph.constant(other))  # type: ignore[arg-type]

    def __rmul__(self, other: Operand) -> Node:
        return self.graph.mul(self.graph.node(other), self)

    def __truediv__(self, other: Operand) -> Node:
        return self.graph.div(self, self.graph.node(other))

    def __rtruediv__(self, other: Operand) -> Node:
        return self.graph.div(self.graph.node(other), self)

    def __neg__(self) -> Node:
        return self.graph.neg(self)

    def __repr__(self) -> str:
        if self.op == "constant":
            return f"<{self.value}>"
        return f"<{self.name}>" if self.op == "symbol" else f"<{self.op} #{self.id}>"


class Graph:
    """A table of interned nodes. Graphs share nothing, so a new graph is a cold start."""

    def __init__(self) -> None:
        self._count = 0
        self._leaves: dict[int | Fraction | str, Node] = {}
        self._operations: dict[str, dict[tuple[Node, ...], Node]] = {op: {} for op in (*UNARY, *BINARY)}
        self.zero = self.constant(0)
        self.one = self.constant(1)

    def __len__(self) -> int:
        return self._count

    def node(self, operand: Operand) -> Node:
        """The operand itself if it is a node, otherwise its constant."""
        return operand if operand.__class__ is Node else self.constant(operand)  # type: ignore[arg-type]

    def constant(self, number: Number) -> Node:
        """The constant of an exact value; a float stands for the binary fraction it is.

        Raises:
            ValueError: the number is NaN or infinite.
        """
        if isinstance(number, float):
            if not math.isfinite(number):
                raise ValueError(f"{number} is no constant; constants are finite")
            number = Fraction(number)
        if isinstance(number, Fraction) and number.denominator == 1:
            number = number.numerator
        found = self._leaves.get(number)
        if found is None:
            found = self._leaves[number] = Node(self, self._count, "constant", value=number)
            self._count += 1
        return found

    def symbol(self, name: str) -> Node:
        """The symbol of this name."""
        found = self._leaves.get(name)
        if found is None:
            found = self._leaves[name] = Node(self, self._count, "symbol", name=name)
            self._count += 1
        return found

    def _made(self, op: str, args: tuple[Node, ...]) -> Node:
        """The operation on these operands, as it stands."""
        table = self._operations[op]
        found = table.get(args)
        if found is None:
            found = table[args] = Node(self, self._count, op, args)
            self._count += 1
        return found

    def add(self, a: Node, b: Node) -> Node:
        """a + b"""
        if a is self.zero:
            return b
        if b is self.zero:
            return a
        if b.op == "neg":
            return self.sub(a, b.args[0])
        if a.op == "neg":
            return self.sub(b, a.args[0])
        if a.op == "constant" and b.op == "constant":
            return self.constant(a.value + b.value)
        return self._made("add", (a, b) if a.id <= b.id else (b, a))

    def sub(self, a: Node, b: Node) -> Node:
        """a - b"""
        if b is self.zero:
            return a
        if a is b:
            return self.zero
        if b.op == "neg":
            return self.add(a, b.args[0])
        if a.op == "constant":
            if b.op == "constant":
                return self.constant(a.value - b.value)
            if a is self.zero:
                return self.neg(b)
        if a.op == "neg":
            return self.neg(self.add(a.args[0], b))
        reverse = self._operations["sub"].get((b, a))
        return self._made("sub", (a, b)) if reverse is None else self.neg(reverse)

    def mul(self, a: Node, b: Node) -> Node:
        """a b"""
        if a.op == "constant":
            if b.op == "constant":
                return self.constant(a.value * b.value)
            if a is self.zero or a is self.one:
                return b if a is self.one else a
            if a.value == -1:
                return self.neg(b)
            return self.neg(self.mul(a, b.args[0])) if b.op == "neg" else self._made("mul", (a, b))
        if b.op == "constant":
            return self.mul(b, a)
        if a.op == "neg":
            return self.neg(self.mul(a.args[0], b))
        if b.op == "neg":
            return self.neg(self.mul(a, b.args[0]))
        return self._made("mul", (a, b) if a.id <= b.id else (b, a))

    def div(self, a: Node, b: Node) -> Node:
        """a / b

        Raises:
            ZeroDivisionError: b is the constant zero.
        """
        if b is self.zero:
            raise ZeroDivisionError("division by the constant 0")
        if a is self.zero or b is self.one:
            return a
        if a.op == "constant" and b.op == "constant":
            return self.constant(Fraction(a.value) / b.value)
        if b.op == "constant" and _is_power_of_two(b.value):
            return self.mul(self.constant(Fraction(1) / b.value), a)
        if a.op == "neg":
            return self.neg(self.div(a.args[0], b))
        if b.op == "neg":
            return self.neg(self.div(a, b.args[0]))
        return self._made("div", (a, b))

    def neg(self, a: Node) -> Node:
        """-a"""
        if a.op == "constant":
            return self.constant(-a.value)
        return a.args[0] if a.op == "neg" else self._made("neg", (a,))

    def sin(self, a: Node) -> Node:
        """sin a, a in radians"""
        if a is self.zero:
            return a
        return self.neg(self.sin(a.args[0])) if a.op == "neg" else self._made("sin", (a,))

    def cos(self, a: Node) -> Node:
        """cos a, a in radians"""
        if a is self.zero:
            return self.one
        return self.cos(a.args[0]) if a.op == "neg" else self._made("cos", (a,))

    def sqrt(self, a: Node) -> Node:
        """√a"""
        return a if a is self.zero or a is self.one else self._made("sqrt", (a,))

    def exp(self, a: Node) -> Node:
        """eᵃ"""
        return self.one if a is self.zero else self._made("exp", (a,))

    def log(self, a: Node) -> Node:
        """The natural logarithm of a."""
        return self.zero if a is self.one else self._made("log", (a,))

    def pivot_inverse(self, pivot: Node, reference: Node) -> Node:
        """1/pivot, or NaN where the pivot is not safely positive beside the reference."""
        return self._made("pivot_inverse", (pivot, reference))

    def power(self, a: Node, exponent: int) -> Node:
        """a to an integer power, by repeated squaring."""
        if exponent < 0:
            return self.div(self.one, self.power(a, -exponent))
        result = self.one
        while exponent:
            if exponent & 1:
                result = self.mul(result, a)
            exponent >>= 1
            if exponent:
                a = self.mul(a, a)
        return result

    def sum(self, terms: Iterable[Operand]) -> Node:
        """The sum of the terms, added from the first to the last."""
        total = self.zero
        for term in terms:
            total = self.add(total, self.node(term))
        return total


def reachable(outputs: Iterable[Node], stop: Container[Node] = ()) -> list[Node]:
    """Every node the outputs need, operands first; nodes in `stop` are kept but not looked behind."""
    seen: set[Node] = set()
    stack = list(outputs)
    while stack:
        node = stack.pop()
        if node not in seen:
            seen.add(node)
            if node not in stop:
                stack.extend(node.args)
    return sorted(seen, key=_number)


def _is_power_of_two(value: int | Fraction) -> bool:
    """Whether multiplying by 1/value is exact in binary."""
    top, bottom = abs(value.numerator), value.denominator
    return top & (top - 1) == 0 and bottom & (bottom - 1) == 0


def _number(node: Node) -> int:
    return node.id
