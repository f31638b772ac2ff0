"""Exact values of expressions at a random point of the prime field: equal values mean the same function.

(With a probability of error of the order of 1e-15 a comparison; see `eomgen.ir.interpret.PrimeField`.)
"""

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

from eomgen.functions import FUNCTIONS, select
from eomgen.ir.equations import Equations, Matrix, Vector
from eomgen.ir.expr import Node
from eomgen.ir.interpret import PrimeField, fingerprint
from eomgen.ir.program import flatten

P = PrimeField.P


def exact(nodes: Sequence[Node], given: Mapping[Node, int] | None = None, seed: int = 0) -> list[int]:
    """The values of some expressions, and of symbols in place of the random ones."""
    return fingerprint(nodes, seed, {symbol.name: Fraction(value) for symbol, value in (given or {}).items()})


def exact_groups(
    groups: Mapping[str, Sequence[Node]], given: Mapping[str, Fraction] | None = None
) -> dict[str, list[int]]:
    """The values of named groups of expressions of one graph; what they share is evaluated once."""
    values = iter(fingerprint([node for nodes in groups.values() for node in nodes], given=given))
    return {name: [next(values) for _ in nodes] for name, nodes in groups.items()}


def differences(a: Mapping[str, object], b: Mapping[str, object]) -> list[str]:
    """The names under which two tables do not hold the same."""
    return [name for name in {**a, **b} if a.get(name) != b.get(name)]


def flat(elements: Matrix | Vector) -> tuple[Node, ...]:
    """The elements of a matrix row by row, or of a vector."""
    return flatten(elements) if isinstance(elements[0], tuple) else elements  # type: ignore[arg-type,return-value]


def results(equations: Equations) -> dict[str, Sequence[Node]]:
    """The expressions of every function that a module has unless others are asked for."""
    return {name: FUNCTIONS[name].build(equations) for name in select(equations, None)}


def quantities(equations: Equations) -> dict[str, Sequence[Node]]:
    """Everything that all methods must agree on: the result of every function, and each part of the bias."""
    return {**results(equations), **{f"bias, {part}": nodes for part, nodes in equations.bias_parts.items()}}


def dot(a: Iterable[Node], b: Iterable[Node]) -> Node:
    """Σ a b"""
    products = [x * y for x, y in zip(a, b, strict=True)]
    return products[0].graph.sum(products)
