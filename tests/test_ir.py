"""The IR by itself: folding, interning, depth, derivatives, evaluators, passes, counts and the dump."""

import math
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from eomgen.errors import UnsupportedError
from eomgen.ir.count import block_operations, operations, program_operations
from eomgen.ir.derivative import Tape
from eomgen.ir.equations import Elimination
from eomgen.ir.expr import BINARY, UNARY, Graph, Node, reachable
from eomgen.ir.interpret import Digits, Floats, PrimeField, evaluate, fingerprint, run
from eomgen.ir.program import (
    Array,
    Block,
    Inner,
    Place,
    Program,
    Store,
    Turns,
    dimensions,
    flatten,
    needed,
    parts,
    straight,
    take_turns,
)
from eomgen.ir.schedule import order
from eomgen.ir.text import dump
from eomgen.ir.verify import verify
from eomgen.passes import chunk, hoist

P = PrimeField.P
Build = Callable[[Graph, Node, Node], Node]
DEPTH = 100_000


class Exact:
    """Fractions; a turn by an angle of value t is the rational point of the circle at tan(angle/2) = t."""

    def constant(self, value: int | Fraction) -> Fraction:
        return Fraction(value)

    def turn(self, angle: Node, values: Mapping[Node, Any], label: object) -> tuple[Fraction, Fraction]:
        t = values[angle]
        return (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)

    def apply(self, op: str, a: Fraction, b: Fraction = Fraction(0)) -> Fraction:
        rules = {
            "add": lambda: a + b,
            "sub": lambda: a - b,
            "mul": lambda: a * b,
            "div": lambda: a / b,
            "neg": lambda: -a,
            "pivot_inverse": lambda: 1 / a,
        }
        return rules[op]()


POINTS = [(Fraction(3, 7), Fraction(-5, 2)), (Fraction(-11, 3), Fraction(4)), (Fraction(1, 9), Fraction(8, 5))]

# What is asked for, the node that stands for it, its value; "x" and "y" are symbols.
FOLDING: dict[str, tuple[Build, Build, Callable[[Fraction, Fraction], Fraction]]] = {
    "0 + x": (lambda g, x, y: 0 + x, lambda g, x, y: x, lambda x, y: x),
    "x + 0": (lambda g, x, y: x + 0, lambda g, x, y: x, lambda x, y: x),
    "x + -y": (lambda g, x, y: x + -y, lambda g, x, y: x - y, lambda x, y: x - y),
    "-x + y": (lambda g, x, y: -x + y, lambda g, x, y: y - x, lambda x, y: y - x),
    "-x + -y": (lambda g, x, y: -x + -y, lambda g, x, y: -(x + y), lambda x, y: -x - y),
    "x + -x": (lambda g, x, y: x + -x, lambda g, x, y: g.zero, lambda x, y: Fraction(0)),
    "y + x": (lambda g, x, y: y + x, lambda g, x, y: x + y, lambda x, y: x + y),
    "2 + 1/3": (
        lambda g, x, y: g.node(2) + Fraction(1, 3),
        lambda g, x, y: g.constant(Fraction(7, 3)),
        lambda x, y: Fraction(7, 3),
    ),
    "x - 0": (lambda g, x, y: x - 0, lambda g, x, y: x, lambda x, y: x),
    "0 - x": (lambda g, x, y: 0 - x, lambda g, x, y: -x, lambda x, y: -x),
    "x - x": (lambda g, x, y: x - x, lambda g, x, y: g.zero, lambda x, y: Fraction(0)),
    "x - -y": (lambda g, x, y: x - -y, lambda g, x, y: x + y, lambda x, y: x + y),
    "-x - y": (lambda g, x, y: -x - y, lambda g, x, y: -(x + y), lambda x, y: -x - y),
    "-x - -y": (lambda g, x, y: -x - -y, lambda g, x, y: y - x, lambda x, y: y - x),
    "3 - 1/2": (lambda g, x, y: 3 - g.node(0.5), lambda g, x, y: g.constant(2.5), lambda x, y: Fraction(5, 2)),
    "0 x": (lambda g, x, y: 0 * x, lambda g, x, y: g.zero, lambda x, y: Fraction(0)),
    "x 0": (lambda g, x, y: x * 0, lambda g, x, y: g.zero, lambda x, y: Fraction(0)),
    "1 x": (lambda g, x, y: 1 * x, lambda g, x, y: x, lambda x, y: x),
    "x 1.0": (lambda g, x, y: x * 1.0, lambda g, x, y: x, lambda x, y: x),
    "-1 x": (lambda g, x, y: -1 * x, lambda g, x, y: -x, lambda x, y: -x),
    "x 2": (lambda g, x, y: x * 2, lambda g, x, y: 2 * x, lambda x, y: 2 * x),
    "y x": (lambda g, x, y: y * x, lambda g, x, y: x * y, lambda x, y: x * y),
    "-x y": (lambda g, x, y: -x * y, lambda g, x, y: -(x * y), lambda x, y: -x * y),
    "x -y": (lambda g, x, y: x * -y, lambda g, x, y: -(x * y), lambda x, y: -x * y),
    "-x -y": (lambda g, x, y: -x * -y, lambda g, x, y: x * y, lambda x, y: x * y),
    "3 / 4": (lambda g, x, y: g.node(3) * 0.25, lambda g, x, y: g.constant(0.75), lambda x, y: Fraction(3, 4)),
    "0 / x": (lambda g, x, y: 0 / x, lambda g, x, y: g.zero, lambda x, y: Fraction(0)),
    "x / 1": (lambda g, x, y: x / 1, lambda g, x, y: x, lambda x, y: x),
    "1 / 3": (lambda g, x, y: 1 / g.node(3), lambda g, x, y: g.constant(Fraction(1, 3)), lambda x, y: Fraction(1, 3)),
    "x / 2": (lambda g, x, y: x / 2, lambda g, x, y: 0.5 * x, lambda x, y: x / 2),
    "x / -0.25": (lambda g, x, y: x / -0.25, lambda g, x, y: -4 * x, lambda x, y: -4 * x),
    "-x / y": (lambda g, x, y: -x / y, lambda g, x, y: -(x / y), lambda x, y: -x / y),
    "x / -y": (lambda g, x, y: x / -y, lambda g, x, y: -(x / y), lambda x, y: -x / y),
    "- -x": (lambda g, x, y: g.neg(g.neg(x)), lambda g, x, y: x, lambda x, y: x),
    "-(1/3)": (
        lambda g, x, y: -g.node(Fraction(1, 3)),
        lambda g, x, y: g.constant(Fraction(-1, 3)),
        lambda x, y: Fraction(-1, 3),
    ),
    "sin 0": (lambda g, x, y: g.sin(g.zero), lambda g, x, y: g.zero, lambda x, y: Fraction(0)),
    "sin -x": (lambda g, x, y: g.sin(-x), lambda g, x, y: -g.sin(x), lambda x, y: -2 * x / (1 + x * x)),
    "cos 0": (lambda g, x, y: g.cos(g.zero), lambda g, x, y: g.one, lambda x, y: Fraction(1)),
    "cos -x": (lambda g, x, y: g.cos(-x), lambda g, x, y: g.cos(x), lambda x, y: (1 - x * x) / (1 + x * x)),
    "sqrt 0": (lambda g, x, y: g.sqrt(g.zero), lambda g, x, y: g.zero, lambda x, y: Fraction(0)),
    "sqrt 1": (lambda g, x, y: g.sqrt(g.one), lambda g, x, y: g.one, lambda x, y: Fraction(1)),
    "exp 0": (lambda g, x, y: g.exp(g.zero), lambda g, x, y: g.one, lambda x, y: Fraction(1)),
    "log 1": (lambda g, x, y: g.log(g.one), lambda g, x, y: g.zero, lambda x, y: Fraction(0)),
    "x to 0": (lambda g, x, y: g.power(x, 0), lambda g, x, y: g.one, lambda x, y: Fraction(1)),
    "x to 1": (lambda g, x, y: g.power(x, 1), lambda g, x, y: x, lambda x, y: x),
    "x to 5": (lambda g, x, y: g.power(x, 5), lambda g, x, y: x * ((x * x) * (x * x)), lambda x, y: x**5),
    "x to -2": (lambda g, x, y: g.power(x, -2), lambda g, x, y: 1 / (x * x), lambda x, y: x**-2),
    "sum of none": (lambda g, x, y: g.sum([]), lambda g, x, y: g.zero, lambda x, y: Fraction(0)),
    "sum": (lambda g, x, y: g.sum([x, 0, -y, 2]), lambda g, x, y: (x - y) + 2, lambda x, y: x - y + 2),
}


@pytest.fixture
def graph() -> Graph:
    return Graph()


@pytest.mark.parametrize("name", FOLDING)
def test_folding(graph: Graph, name: str) -> None:
    asked, expected, value = FOLDING[name]
    x, y = graph.symbol("x"), graph.symbol("y")
    node = asked(graph, x, y)
    assert node is expected(graph, x, y)
    for at_x, at_y in POINTS:
        assert evaluate([node], {x: at_x, y: at_y}, Exact()) == [value(at_x, at_y)]


def test_difference_the_other_way_round(graph: Graph) -> None:
    x, y = graph.symbol("x"), graph.symbol("y")
    difference = y - x
    assert x - y is -difference
    assert (x - y) + difference is graph.zero


def test_division_by_three_is_not_a_product(graph: Graph) -> None:
    """1/3 is no binary number: x / 3 is rounded once, x * (1/3) would be rounded twice."""
    assert (graph.symbol("x") / 3).op == "div"


def test_constants_are_exact(graph: Graph) -> None:
    assert graph.constant(0.1).value == Fraction(0.1) != Fraction(1, 10)
    assert graph.constant(2.0) is graph.constant(2) is graph.constant(Fraction(4, 2))
    assert graph.constant(-0.0) is graph.zero
    assert type(graph.constant(2.0).value) is int


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_constants_are_finite(graph: Graph, number: float) -> None:
    with pytest.raises(ValueError, match="constants are finite"):
        graph.symbol("x") * number


def test_division_by_zero(graph: Graph) -> None:
    with pytest.raises(ZeroDivisionError, match="division by the constant 0"):
        graph.symbol("x") / 0


STEPS = st.tuples(st.sampled_from(["add", "sub", "mul", "div", "neg"]), st.integers(0, 99), st.integers(0, 99))


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])  # a busy machine is no error
@given(st.lists(STEPS, max_size=20), st.lists(st.integers(-60, 60), min_size=2, max_size=2))
def test_random_expressions_keep_their_value(steps: list[tuple[str, int, int]], sevenths: list[int]) -> None:
    """Whatever the constructors rewrite, the value is that of the operations asked for."""
    graph, judge, at = Graph(), Exact(), [Fraction(number, 7) for number in sevenths]
    symbols = {graph.symbol("x"): at[0], graph.symbol("y"): at[1]}
    nodes = [*symbols, *(graph.constant(c) for c in (0, 1, -1, 2, Fraction(1, 3)))]
    values = [*at, *(Fraction(c) for c in (0, 1, -1, 2, Fraction(1, 3)))]
    for op, first, second in steps:
        i, j = first % len(nodes), second % len(nodes)
        if op == "div" and values[j] == 0:
            continue
        operands = (i,) if op == "neg" else (i, j)
        nodes.append(getattr(graph, op)(*(nodes[k] for k in operands)))
        values.append(judge.apply(op, *(values[k] for k in operands)))
    assert evaluate(nodes, symbols, judge) == values


def test_interning(graph: Graph) -> None:
    x, y = graph.symbol("x"), graph.symbol("y")
    one, size = graph.sin(x * y + 1), len(graph)
    assert graph.sin(1 + y * x) is one
    assert graph.symbol("x") is x
    assert len(graph) == size
    assert Graph().symbol("x") is not x


def test_operands_come_first(graph: Graph) -> None:
    x = graph.symbol("x")
    nodes = reachable([graph.sin(x) * x + graph.cos(x * x)])
    assert [node.id for node in nodes] == sorted(node.id for node in nodes)
    assert all(arg.id < node.id for node in nodes for arg in node.args)


def test_reachable_stops(graph: Graph) -> None:
    x, y = graph.symbol("x"), graph.symbol("y")
    inner = x * y
    assert reachable([inner + 1], {inner}) == [graph.one, inner, inner + 1]


def test_repr(graph: Graph) -> None:
    x = graph.symbol("x")
    assert repr(x) == "<x>"
    assert repr(graph.constant(Fraction(1, 3))) == "<1/3>"
    assert repr(x + x).startswith("<add #")


# Depth


@pytest.fixture(scope="module")
def deep() -> tuple[Node, Node, Node]:
    """((x + y) + y) + y ... and its symbols."""
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    total = x
    for _ in range(DEPTH):
        total = total + y
    return total, x, y


def test_deep_counts(deep: tuple[Node, Node, Node]) -> None:
    total, _, _ = deep
    assert operations([total]) == {"add": DEPTH}


def test_deep_values(deep: tuple[Node, Node, Node]) -> None:
    total, x, y = deep
    assert evaluate([total], {x: 1.0, y: 0.5}, Floats()) == [1 + DEPTH / 2]
    assert evaluate([total], {x: 7, y: 3}, PrimeField()) == [7 + 3 * DEPTH]
    assert evaluate([total], {x: mpmath.mpf(1), y: mpmath.mpf(2)}, Digits(30)) == [1 + 2 * DEPTH]


def test_deep_derivatives(deep: tuple[Node, Node, Node]) -> None:
    total, x, y = deep
    tape = Tape([total])
    assert [tape.forward({s: s.graph.one})[0].value for s in (x, y)] == [1, DEPTH]
    assert [node.value for node in tape.reverse([x, y])] == [1, DEPTH]


def test_deep_programs(deep: tuple[Node, Node, Node]) -> None:
    """The passes, the verifier and the dump walk a chain of any depth."""
    total, x, y = deep
    program = a_program([total], {x: Place("q", (0,)), y: Place("q", (1,))})
    pieces = chunk.run(hoist.run(program))
    verify(pieces)
    assert len(pieces.blocks) == -(-DEPTH // chunk.LIMIT)
    assert run(pieces, {"q": [5, 2], "p": []}, PrimeField()) == [5 + 2 * DEPTH]
    text = dump(program)
    assert text.count(" + ") == DEPTH


# Derivatives

DIFFERENTIABLE: dict[str, Callable[[Graph, Node, Node, Node], Node]] = {
    "add": lambda g, x, y, z: (x + y) + (y + x * 3),
    "sub": lambda g, x, y, z: (x * x - y) - (z - x),
    "mul": lambda g, x, y, z: x * y * z * x,
    "square": lambda g, x, y, z: x * x,
    "div": lambda g, x, y, z: (x + y) / (z * z + 2),
    "div by itself": lambda g, x, y, z: (x * y) / (x + z * x),
    "neg": lambda g, x, y, z: -(x / y) - -z,
    "sin": lambda g, x, y, z: g.sin(x - 2 * y) * g.sin(z),
    "cos": lambda g, x, y, z: g.cos(x + y) * g.cos(x - z),
    "sqrt": lambda g, x, y, z: g.sqrt(x * x + y * y) / z,
    "exp": lambda g, x, y, z: g.exp(-(x * y)) * g.exp(z),
    "log": lambda g, x, y, z: g.log(x * y + 3) - g.log(z),
    "pivot_inverse": lambda g, x, y, z: x * g.pivot_inverse(y * y + z, z),
    "shared": lambda g, x, y, z: (x * y) * g.sin(x * y) + (x * y),
    "constant": lambda g, x, y, z: g.constant(5),
    "itself": lambda g, x, y, z: x,
}
AT = {"x": Fraction(13, 10), "y": Fraction(7, 10), "z": Fraction(9, 5)}


def build(name: str) -> tuple[Node, list[Node]]:
    graph = Graph()
    symbols = [graph.symbol(letter) for letter in AT]
    return DIFFERENTIABLE[name](graph, *symbols), symbols


def at(digits: Digits, **changes: Any) -> dict[str, Any]:
    return {name: digits.constant(value) + changes.get(name, 0) for name, value in AT.items()}


def named(symbols: list[Node], values: Mapping[str, Any]) -> dict[Node, Any]:
    return {symbol: values[symbol.name] for symbol in symbols}


@pytest.mark.parametrize("name", DIFFERENTIABLE)
def test_forward_is_reverse_is_finite_difference(name: str) -> None:
    """Central differences with h = 1e-20 in 60 digits are off by about h² f'''/6, far below 1e-30."""
    node, symbols = build(name)
    digits, step = Digits(60), mpmath.mpf(10) ** -20
    tape = Tape([node])
    forward = [tape.forward({symbol: node.graph.one})[0] for symbol in symbols]
    reverse = tape.reverse(symbols)
    here = named(symbols, at(digits))
    one, two = evaluate(forward, here, digits), evaluate(reverse, here, digits)
    for symbol, a, b in zip(symbols, one, two, strict=True):
        high, low = (
            evaluate([node], named(symbols, at(digits, **{symbol.name: sign * step})), digits)[0] for sign in (1, -1)
        )
        assert abs(a - b) < 1e-50
        assert abs(a - (high - low) / (2 * step)) < 1e-30


@pytest.mark.parametrize("name", DIFFERENTIABLE)
def test_derivative_is_that_of_sympy(name: str) -> None:
    sympy = pytest.importorskip("sympy")
    from eomgen.symbolic import to_sympy

    node, symbols = build(name)
    reverse = Tape([node]).reverse(symbols)
    (expression,) = to_sympy([node])
    digits = Digits(30)
    ours = evaluate(reverse, named(symbols, at(digits)), digits)
    for symbol, derivative in zip(symbols, ours, strict=True):
        theirs = sympy.diff(expression, sympy.Symbol(symbol.name, real=True))
        values = {sympy.Symbol(n, real=True): sympy.Rational(v.numerator, v.denominator) for n, v in AT.items()}
        assert abs(derivative - digits.context.mpf(str(theirs.subs(values).evalf(30)))) < 1e-25


def test_derivative_along_a_direction(graph: Graph) -> None:
    """One forward sweep gives the derivative along any direction, here (2, y)."""
    x, y = graph.symbol("x"), graph.symbol("y")
    (along,) = Tape([x * x * y]).forward({x: graph.constant(2), y: y})
    assert fingerprint([along]) == fingerprint([4 * x * y + x * x * y])


def test_gradient_of_several_outputs_is_that_of_their_sum(graph: Graph) -> None:
    x, y = graph.symbol("x"), graph.symbol("y")
    outputs = [x * y, graph.sin(x), x, x * y]
    assert fingerprint(Tape(outputs).reverse([x, y])) == fingerprint([2 * y + graph.cos(x) + 1, 2 * x])


def test_derivatives_do_not_swell(graph: Graph) -> None:
    """The gradient of a product of n factors costs a multiple of n operations, not n²."""
    factors = [graph.symbol(f"x{i}") for i in range(200)]
    product = graph.one
    for factor in factors:
        product = product * factor
    assert operations(Tape([product]).reverse(factors)).total() < 4 * 200


def test_second_derivative(graph: Graph) -> None:
    x = graph.symbol("x")
    (first,) = Tape([graph.sin(x)]).reverse([x])
    (second,) = Tape([first]).reverse([x])
    assert fingerprint([second]) == fingerprint([-graph.sin(x)])


# Evaluators

RATIONAL: dict[str, Build] = {
    "add": lambda g, x, y: x + y + Fraction(1, 3),
    "sub": lambda g, x, y: x * 7 - y / 3,
    "mul": lambda g, x, y: x * y * x,
    "div": lambda g, x, y: (x - y) / (x * x + 1),
    "neg": lambda g, x, y: -(x * y) / 0.1,
    "pivot_inverse": lambda g, x, y: y * g.pivot_inverse(x * x + 1, x * x + 2),
}


@pytest.mark.parametrize("name", RATIONAL)
def test_evaluators_agree(graph: Graph, name: str) -> None:
    x, y = graph.symbol("x"), graph.symbol("y")
    node, values = RATIONAL[name](graph, x, y), {x: Fraction(13, 4), y: Fraction(-5, 8)}
    (exact,) = evaluate([node], values, Exact())
    floats = {symbol: float(value) for symbol, value in values.items()}
    digits = Digits(60)
    assert float(evaluate([node], floats, Floats())[0]) == pytest.approx(float(exact), rel=1e-15)
    (long,) = evaluate([node], {symbol: digits.number(value) for symbol, value in floats.items()}, digits)
    assert abs(long - digits.constant(exact)) < abs(long) * 1e-58
    (residue,) = evaluate([node], {s: v.numerator * pow(v.denominator, -1, P) for s, v in values.items()}, PrimeField())
    assert residue == exact.numerator * pow(exact.denominator, -1, P) % P


def test_floats_take_arrays(graph: Graph) -> None:
    x = graph.symbol("x")
    angles = np.linspace(-3, 3, 7)
    (value,) = evaluate([graph.sin(x) * graph.exp(x) - graph.sqrt(x * x) * graph.cos(x)], {x: angles}, Floats())
    assert value == pytest.approx(np.sin(angles) * np.exp(angles) - np.abs(angles) * np.cos(angles), rel=1e-15)


FUNCTIONS = {
    "sin": mpmath.sin,
    "cos": mpmath.cos,
    "sqrt": mpmath.sqrt,
    "exp": mpmath.exp,
    "log": mpmath.log,
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_in_digits_and_floats(graph: Graph, name: str) -> None:
    x = graph.symbol("x")
    node = getattr(graph, name)(x)
    with mpmath.workdps(60):
        expected = FUNCTIONS[name](mpmath.mpf(1.75))
    digits = Digits(60)
    assert abs(evaluate([node], {x: digits.number(1.75)}, digits)[0] - expected) < 1e-58
    assert float(evaluate([node], {x: 1.75}, Floats())[0]) == pytest.approx(float(expected), rel=1e-15)


CIRCLE: dict[str, tuple[Build, Build]] = {
    "cos² + sin²": (lambda g, x, y: g.cos(x) * g.cos(x) + g.sin(x) * g.sin(x), lambda g, x, y: g.one),
    "sin(x + y)": (lambda g, x, y: g.sin(x + y), lambda g, x, y: g.sin(x) * g.cos(y) + g.cos(x) * g.sin(y)),
    "cos(x - y)": (lambda g, x, y: g.cos(x - y), lambda g, x, y: g.cos(x) * g.cos(y) + g.sin(x) * g.sin(y)),
    "sin(y - x)": (lambda g, x, y: g.sin(y - x), lambda g, x, y: -g.sin(x - y)),
    "sin 3x": (lambda g, x, y: g.sin(3 * x), lambda g, x, y: 3 * g.sin(x) - 4 * g.power(g.sin(x), 3)),
    "cos -2x": (lambda g, x, y: g.cos(-2 * x), lambda g, x, y: 1 - 2 * g.power(g.sin(x), 2)),
    "cos(-(x + y) + x)": (lambda g, x, y: g.cos(-(x + y) + x), lambda g, x, y: g.cos(y)),
    "cos(x + 1)": (
        lambda g, x, y: g.cos(x + 1),
        lambda g, x, y: g.cos(x) * g.cos(g.one) - g.sin(x) * g.sin(g.one),
    ),
}


@pytest.mark.parametrize("name", CIRCLE)
def test_angles_of_the_prime_field(graph: Graph, name: str) -> None:
    left, right = (make(graph, graph.symbol("x"), graph.symbol("y")) for make in CIRCLE[name])
    for seed in range(3):
        assert fingerprint([left], seed) == fingerprint([right], seed)


def test_prime_field_tells_functions_apart(graph: Graph) -> None:
    x, y = graph.symbol("x"), graph.symbol("y")
    nodes = [x * y, x * y + Fraction(1, 10**15), x + y, graph.sin(x), graph.cos(x), graph.sin(y), x]
    assert len(set(fingerprint(nodes))) == len(nodes)


def test_prime_field_means_the_same_in_every_graph() -> None:
    def node() -> Node:
        graph = Graph()
        graph.symbol("unused")
        return graph.sin(graph.symbol("x")) / graph.symbol("y")

    assert fingerprint([node()], seed=4) == fingerprint([node()], seed=4)
    assert fingerprint([node()], seed=4) != fingerprint([node()], seed=5)


def test_fingerprint_with_given_values(graph: Graph) -> None:
    x = graph.symbol("x")
    assert fingerprint([x * x - 2], given={"x": Fraction(3, 2)}) == fingerprint([graph.constant(0.25)])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda g, x: g.sin(x * x), "sine or cosine of a 'mul'"),
        (lambda g, x: g.cos(0.5 * x), "sine or cosine of a 'mul'"),
        (lambda g, x: g.sin(x / (x + 1)), "sine or cosine of a 'div'"),
        (lambda g, x: g.sqrt(x), "rational functions only, not 'sqrt'"),
        (lambda g, x: g.exp(x), "not 'exp'"),
        (lambda g, x: g.log(x), "not 'log'"),
    ],
)
def test_what_the_exact_test_cannot_test(graph: Graph, make: Callable[[Graph, Node], Node], words: str) -> None:
    with pytest.raises(UnsupportedError, match=words):
        fingerprint([make(graph, graph.symbol("x"))])


def test_a_symbol_needs_a_value(graph: Graph) -> None:
    with pytest.raises(KeyError, match="symbol 'x' has no value"):
        evaluate([graph.symbol("x") + 1], {}, Floats())


def test_given_nodes_are_not_looked_behind(graph: Graph) -> None:
    product = graph.symbol("x") * graph.symbol("y")
    assert evaluate([product + 1], {product: 4.0}, Floats()) == [5.0]


@pytest.mark.parametrize(
    ("pivot", "reference", "safe"),
    [(1.0, 1, True), (17 * 2.0**-52, 1, True), (15 * 2.0**-52, 1, False), (-1.0, 1, False),
     (2.0**-1021, 0, True), (2.0**-1023, 0, False)],
)  # fmt: skip
def test_pivots_of_floats(graph: Graph, pivot: float, reference: float, safe: bool) -> None:
    """1/pivot above 16 eps of the reference and the least normal number, NaN and the flag elsewhere."""
    x = graph.symbol("x")
    node = graph.pivot_inverse(x, graph.constant(reference))
    if safe:
        assert evaluate([node], {x: pivot}, Floats()) == [1 / pivot]
        return
    with np.errstate(invalid="ignore"):
        assert np.isnan(evaluate([node], {x: pivot}, Floats())[0])
    with np.errstate(invalid="raise"), pytest.raises(FloatingPointError):
        evaluate([node], {x: pivot}, Floats())


@pytest.mark.parametrize("pivot", [0, -1])
def test_pivots_of_digits(graph: Graph, pivot: int) -> None:
    assert mpmath.isnan(evaluate([graph.pivot_inverse(graph.constant(pivot), graph.one)], {}, Digits(30))[0])


# Solving


@pytest.mark.parametrize("elimination", [(0, 1, 2, 3), (3, 2, 1, 0), (2, 0, 3, 1)])
def test_solve(graph: Graph, elimination: tuple[int, ...]) -> None:
    rows = [[graph.symbol(f"m{min(i, j)}{max(i, j)}") for j in range(4)] for i in range(4)]
    right = [graph.symbol(f"b{i}") for i in range(4)]
    factors = Elimination(tuple(map(tuple, rows)), elimination)
    for solution in (factors.solve(right), factors.solve_by_inverse(right)):
        product = [graph.sum(m * x for m, x in zip(row, solution, strict=True)) for row in rows]
        assert fingerprint(product) == fingerprint(right)
    assert all(factors.inverse[i][j] is factors.inverse[j][i] for i in range(4) for j in range(4))


@pytest.mark.parametrize(
    ("singular", "lost"), [("", ""), ("b", "abc"), ("c", "abc"), ("d", "de"), ("e", "de"), ("b d", "abcde")]
)
def test_a_bad_pivot_is_felt_by_all_that_is_solved_with_it(graph: Graph, singular: str, lost: str) -> None:
    """a, b and c are coupled, d and e to nothing: of those that are alone each tells the others."""
    zero, names = graph.zero, "abcde"
    a, b, c, d, e, x, y = (graph.symbol(name) for name in "abcdexy")
    matrix = ((a, x, y, zero, zero), (x, b, zero, zero, zero), (y, zero, c, zero, zero))
    matrix += ((zero, zero, zero, d, zero), (zero, zero, zero, zero, e))
    factors = Elimination(matrix, (4, 3, 2, 1, 0))
    given = dict.fromkeys((a, b, c, d, e), 2.0) | {x: 0.5, y: 0.5}
    given |= {graph.symbol(name): 0.0 for name in singular.split()}
    right = [graph.constant(k) for k in range(1, 6)]
    with np.errstate(invalid="ignore"):
        for solution in (factors.solve(right), factors.solve_by_inverse(right)):
            found = evaluate(list(solution), given, Floats())
            assert {name for name, value in zip(names, found, strict=True) if np.isnan(value)} == set(lost)


def test_solve_keeps_zeros(graph: Graph) -> None:
    """Two branches on one root do not couple: the deepest first fills nothing in, the root first would."""
    zero = graph.zero
    a, b, c, x, y = (graph.symbol(name) for name in "abcxy")
    matrix = ((a, x, y), (x, b, zero), (y, zero, c))
    right = [graph.symbol(f"r{i}") for i in range(3)]
    few, many = (operations(Elimination(matrix, order).solve(right)).total() for order in ((2, 1, 0), (0, 1, 2)))
    assert few < many


# Programs, passes, counts


def a_program(
    outputs: list[Node], loads: dict[Node, Place], sizes: Mapping[str, int] | None = None, **changes: Any
) -> Program:
    """A program of one straight block from inputs q and p to `out`."""
    reached = {place.array: max(place.indices) + 1 for place in loads.values()}
    wanted = sizes or {
        name: max([1, *(max(p.indices) + 1 for p in loads.values() if p.array == name)]) for name in "qp"
    }
    if sizes is None and "p" not in reached:
        wanted["p"] = 0
    inputs = tuple(Array(n, (size,), "input", tuple(f"{n}{i}" for i in range(size))) for n, size in wanted.items())
    block = straight("all", loads, [("out", i, node) for i, node in enumerate(outputs)])
    return Program("f", "a function", inputs, Array("out", (len(outputs),), "output"), (block,), **changes)


def random_program(seed: int, size: int) -> Program:
    """A random acyclic graph over q and p with everything that the prime field can evaluate."""
    rng, graph = random.Random(seed), Graph()
    loads = {graph.symbol(f"{name}{i}"): Place(name, (i,)) for name in "qp" for i in range(4)}
    nodes = [*loads, graph.constant(Fraction(1, 3)), *(graph.sin(node) for node in list(loads)[:3])]
    while len(nodes) < size:
        a, b, op = rng.choice(nodes[-40:]), rng.choice(nodes), rng.choice(("add", "sub", "mul", "div", "neg"))
        nodes.append(-a if op == "neg" else getattr(graph, op)(a, b + 7 if op == "div" else b))
    return a_program([*rng.sample(nodes, 5), nodes[-1], nodes[-1], nodes[0], graph.one, -nodes[5]], loads)


def exact_run(program: Program, seed: int = 0) -> list[int]:
    prime = PrimeField(seed)
    return run(program, {array.name: [prime.random(name) for name in array.symbols] for array in program.inputs}, prime)


@pytest.mark.parametrize("limit", [1, 3, 7, 50, 400])
@pytest.mark.parametrize("seed", range(3))
def test_passes_keep_values(seed: int, limit: int) -> None:
    program = random_program(seed, 300)
    expected = exact_run(program)
    hoisted = hoist.run(program)
    verify(hoisted)
    assert exact_run(hoisted) == expected
    for pieces in (chunk.run(program, limit), chunk.run(hoisted, limit)):
        verify(pieces)
        assert exact_run(pieces) == expected
        assert all(len(order(block)) <= max(limit * 3 // 2, 1) for block in (*pieces.blocks, *pieces.constants))
        assert program_operations(pieces) == program_operations(program if pieces.constants == () else hoisted)


def test_chunk_keeps_differences_with_their_sines(graph: Graph) -> None:
    """A back end sees both angles, which a stored difference has lost."""
    x, y = graph.symbol("q0"), graph.symbol("q1")
    turn = x - y
    outputs = [turn * turn, graph.sin(turn), (turn + 3) * x, graph.cos(turn) * y]
    pieces = chunk.run(a_program(outputs, {x: Place("q", (0,)), y: Place("q", (1,))}), 1)
    homes = [block for block in pieces.blocks if any(node.op in ("sin", "cos") for node in order(block))]
    assert len(pieces.blocks) > len(homes) == 2
    assert all(turn not in block.loads for block in homes)


def test_chunk_stores_a_number_of_many_places_in_a_loop(graph: Graph) -> None:
    """The zeros of a large matrix, wherever they are; few of them stay where they are."""
    x = graph.symbol("q0")
    for zeros, counts in ((chunk.MANY, [chunk.MANY, 1]), (chunk.MANY - 1, [1])):
        nodes = [node for i in range(zeros) for node in ((x + i, graph.zero) if i % 3 == 0 else (graph.zero,))]
        program = a_program([*nodes, graph.one], {x: Place("q", (0,))})
        pieces = chunk.run(program)
        verify(pieces)
        assert [block.count for block in parts(pieces.blocks)] == counts
        assert exact_run(pieces) == exact_run(program)


def test_chunk_leaves_lists_of_numbers_whole(graph: Graph) -> None:
    """A back end makes a table of them, however often a number is among them."""
    program = a_program([graph.constant(i % 2) for i in range(3 * chunk.MANY)], {})
    assert chunk.run(program).blocks == program.blocks


def test_chunk_leaves_short_programs_alone() -> None:
    program = random_program(0, 60)
    assert chunk.run(program, 400).blocks == program.blocks


def test_hoist_moves_what_depends_on_parameters_only(graph: Graph) -> None:
    q, p, r = graph.symbol("q0"), graph.symbol("p0"), graph.symbol("p1")
    loads = {q: Place("q", (0,)), p: Place("p", (0,)), r: Place("p", (1,))}
    program = hoist.run(a_program([q * (p * r + 1), graph.sin(r) + q, -p * q, p], loads))
    verify(program)
    assert program_operations(program) == {"state": {"mul": 2, "add": 1}, "parameters": {"mul": 1, "add": 1, "sin": 1}}
    stored = [store.node for block in program.constants for store in block.stores]
    assert stored == [p * r + 1, graph.sin(r)]


def test_hoist_without_parameters_changes_nothing(graph: Graph) -> None:
    q = graph.symbol("q0")
    program = a_program([q * q + 1], {q: Place("q", (0,))})
    assert hoist.run(program) == program


def a_loop(graph: Graph, links: int = 5) -> Program:
    """Masses summed from the tips to the root of a tree (0 has children 1 and 2, 2 has 3 and 4), times q."""
    parents = (-1, 0, 0, 2, 2)
    p, q, total, zero = graph.symbol("p"), graph.symbol("q"), graph.symbol("total"), graph.zero
    first = Block("start", {}, (Store(Place("work", (0,)), zero),))
    names = tuple(range(links))
    fill = Block("own", {p: Place("p", names)}, (Store(Place("sums", names), 2 * p),), links)
    back = tuple(range(links - 1, 0, -1))
    up = Block(
        "tips to root",
        {total: Place("sums", back)},
        (Store(Place("sums", tuple(parents[i] for i in back)), total, add=True),),
        links - 1,
    )
    use = Block(
        "results",
        {total: Place("sums", names), q: Place("q", tuple(2 * i + 1 for i in names))},
        (Store(Place("out", names[::-1]), total * q), Store(Place("work", (0,) * links), q, add=True)),
        links,
    )
    return Program(
        "f",
        "a function",
        (
            Array("q", (2 * links,), "input", tuple(f"q{i}" for i in range(2 * links))),
            Array("p", (links,), "input", tuple(f"p{i}" for i in names)),
        ),
        Array("out", (links,), "output"),
        (first, fill, up, use),
        scratch=(Array("work", (1,), "work"), Array("sums", (links,), "work")),
    )


def test_loops_run_and_are_hoisted(graph: Graph) -> None:
    program = a_loop(graph)
    inputs = {"q": [float(i) for i in range(10)], "p": [1.0, 2.0, 4.0, 8.0, 16.0]}
    expected = [16 * 2 * 9.0, 8 * 2 * 7.0, 28 * 2 * 5.0, 2 * 2 * 3.0, 31 * 2 * 1.0]
    verify(program)
    assert run(program, inputs, Floats()) == expected
    hoisted = hoist.run(program)
    verify(hoisted)
    assert run(hoisted, inputs, Floats()) == expected
    assert [block.title for block in hoisted.blocks] == ["start", "results"]
    assert exact_run(hoisted) == exact_run(program)


def test_loops_are_counted_by_iteration(graph: Graph) -> None:
    assert program_operations(a_loop(graph)) == {"state": {"mul": 5 + 5, "add": 4 + 5}, "parameters": {}}
    assert program_operations(hoist.run(a_loop(graph))) == {
        "state": {"mul": 5, "add": 5},
        "parameters": {"mul": 5, "add": 4},
    }


def pairs(graph: Graph, n: int = 3) -> Program:
    """The symmetric matrix of p_i² q_j for i < j, over a diagonal of ones, along the list of what is below j."""
    upper, lower = graph.symbol("p"), graph.symbol("q")
    every, rows, below = range(n), range(0, n * n, n), range(-1, n - 1)
    element = upper * upper * lower
    blocks = (
        Block("zeros", {}, (Store(Place("out", range(n * n)), graph.zero),), n * n),
        Block("ones", {}, (Store(Place("out", range(0, n * n, n + 1)), graph.one),), n),
        Block(
            "pairs",
            {upper: Place("p", (0,) * n, every), lower: Place("q", every)},
            (Store(Place("out", every, rows), element), Store(Place("out", rows, every), element)),
            n,
            Inner(below, below),
        ),
    )
    inputs = tuple(Array(x, (n,), "input", tuple(f"{x}{i}" for i in every)) for x in "qp")
    return Program("f", "a function", inputs, Array("out", (n, n), "output"), blocks)


def test_a_loop_inside(graph: Graph) -> None:
    program = pairs(graph)
    inputs = {"q": [10.0, 20.0, 30.0], "p": [1.0, 2.0, 3.0]}
    expected = [1, 20, 30, 20, 1, 120, 30, 120, 1]
    verify(program)
    assert run(program, inputs, Floats()) == expected
    assert program_operations(program)["state"] == {"mul": 2 * 3}
    assert [*program.blocks[2].iterations()] == [(program.blocks[2], k, i) for k, i in ((1, 0), (2, 1), (2, 0))]
    hoisted = hoist.run(program)
    verify(hoisted)
    assert run(hoisted, inputs, Floats()) == expected
    assert "k = 0..2, i = k - 1, then i - 1" in dump(program)


def taking_turns(graph: Graph, turns: Sequence[int] = (0, 1, 1, 0, 1)) -> Program:
    """A running product of q_i p_i² (first kind) or q_i + p_i² (second kind) along five links of two kinds."""
    q, p, before = (graph.symbol(name) for name in ("q", "p", "before"))
    blocks: list[Block] = []
    for kind, factor in enumerate((q * (p * p), q + p * p)):
        links = [i for i, turn in enumerate(turns) if turn == kind]
        loads = {q: Place("q", links), p: Place("p", links), before: Place("product", links)}
        stores = (
            Store(Place("product", [i + 1 for i in links]), before * factor),
            Store(Place("out", links), before * factor),
        )
        blocks.append(Block(f"kind {kind}", loads, stores, len(links)))
    n = len(turns)
    start = Block("start", {}, (Store(Place("product", (0,)), graph.one),))
    inputs = tuple(Array(x, (n,), "input", tuple(f"{x}{i}" for i in range(n))) for x in "qp")
    steps = (start, Turns("all links", tuple(blocks), tuple(turns)))
    scratch = (Array("product", (n + 1,), "work"),)
    return Program("f", "a function", inputs, Array("out", (n,), "output"), steps, scratch=scratch)


def test_loops_in_turns(graph: Graph) -> None:
    program = taking_turns(graph)
    inputs = {"q": [2.0, 1.0, 0.5, 4.0, 1.0], "p": [1.0, 2.0, 1.5, 1.0, 0.0]}
    expected = [2.0, 10.0, 27.5, 110.0, 110.0]
    verify(program)
    assert run(program, inputs, Floats()) == expected
    assert program_operations(program)["state"] == {"mul": 2 * 3 + 3 * 2, "add": 3}
    hoisted = hoist.run(program)
    verify(hoisted)
    assert run(hoisted, inputs, Floats()) == expected
    assert program_operations(hoisted) == {"state": {"mul": 2 * 2 + 3, "add": 3}, "parameters": {"mul": 5}}
    assert [len(step.parts) for step in (*hoisted.constants, *hoisted.blocks)] == [2, 1, 2]
    assert "all links, 2 loops in turns" in dump(program)
    assert exact_run(hoisted) == exact_run(program)


def test_turns_out_of_order_are_refused(graph: Graph) -> None:
    """An iteration that reads what a later one computes, and turns that are not the iterations."""
    start, step = taking_turns(graph).blocks
    for turns, message in (((1, 0, 1, 0, 1), "which has no value"), ((0, 1, 1, 0), "are not the iterations")):
        program = replace(taking_turns(graph), blocks=(start, replace(step, order=turns)))
        with pytest.raises(AssertionError, match=message):
            verify(program)


def test_loops_merge_where_they_have_something_to_store(graph: Graph) -> None:
    start, step = taking_turns(graph).blocks
    first, second = step.parts
    assert take_turns("t", [first, replace(second, stores=())], step.order) == first
    assert take_turns("t", [replace(first, stores=())], ()) is None
    merged = take_turns("t", [start, first, second], (0, *(turn + 1 for turn in step.order)))
    assert merged == Turns("t", (start, first, second), (0, 1, 2, 2, 1, 2))
    assert take_turns("t", [replace(start, stores=()), first, second], merged.order) == replace(step, title="t")


def test_a_zero_is_replaced_once(graph: Graph) -> None:
    program = pairs(graph)
    with pytest.raises(AssertionError, match="stored twice"):
        verify(replace(program, blocks=(*program.blocks, program.blocks[1])))


def test_order_is_a_schedule() -> None:
    (block,) = random_program(1, 200).blocks
    nodes = order(block)
    position = {node: i for i, node in enumerate(nodes)}
    assert len(position) == len(nodes)
    assert set(nodes) == {node for node in block.nodes() if node.args}
    assert all(position[arg] < position[node] for node in nodes for arg in node.args if arg in position)


def test_counts(graph: Graph) -> None:
    x, y = graph.symbol("x"), graph.symbol("y")
    shared = x * y
    nodes = [shared + 1, -shared, graph.sin(x) - graph.cos(x), shared / y, graph.pivot_inverse(x, y), graph.sqrt(x)]
    expected = {"mul": 1, "add": 1, "sin": 1, "cos": 1, "sub": 1, "div": 1, "pivot_inverse": 1, "sqrt": 1}
    assert operations(nodes) == expected
    (block,) = a_program(nodes, {x: Place("q", (0,)), y: Place("q", (1,))}).blocks
    assert block_operations([block, block]) == {kind: 2 * count for kind, count in expected.items()}


def test_shapes(graph: Graph) -> None:
    matrix = Array("w", (2, 3), "input", tuple("abcdef"), ("m", "", "", "", "", ""))
    assert matrix.size == 6
    assert matrix.labels == ["a (m)", "b", "c", "d", "e", "f"]
    assert dimensions(matrix) == "(2,3)"
    assert dimensions(Array("p", (0,), "input")) == "(p0)"
    x, y = graph.symbol("x"), graph.symbol("y")
    assert flatten([[x, y], [y, x]]) == (x, y, y, x)
    block = Block("all", {x: Place("q", (0,)), y: Place("q", (1,))}, (Store(Place("out", (0,)), x),))
    assert list(needed(block).loads) == [x]
    assert a_program([x], {x: Place("q", (1,))}).signature == "(2),(p0)->(1)"


# The dump


def test_dump(graph: Graph) -> None:
    x, y, m = graph.symbol("q0"), graph.symbol("q1"), graph.symbol("p0")
    shared = x * y
    outputs = [
        shared + Fraction(1, 3),
        -(shared - m) / (x - 2),
        graph.sin(x) * graph.cos(x) - graph.sqrt(m),
        graph.pivot_inverse(x + y, m) * -3,
        x - (y - m),
    ]
    program = a_program(outputs, {x: Place("q", (0,)), y: Place("q", (1,)), m: Place("p", (0,))})
    assert dump(program).splitlines() == [
        "f (2),(1)->(5): a function",
        "  all",
        "    t0 = q0 * q1",
        "    out[0] = t0 + 1/3",
        "    out[1] = -((t0 - p0) / (q0 - 2))",
        "    s1 = sin(q0)",
        "    c1 = cos(q0)",
        "    t2 = sqrt(p0)",
        "    out[2] = s1 * c1 - t2",
        "    t3 = 1 / (q0 + q1)",
        "    out[3] = (-3) * t3",
        "    out[4] = q0 - (q1 - p0)",
    ]


def test_dump_of_loops(graph: Graph) -> None:
    assert dump(a_loop(graph)).splitlines() == [
        "f (10),(5)->(5): a function",
        "  start",
        "    work[0] = 0",
        "  own, k = 0..4",
        "    sums[k] = 2 * p[k]",
        "  tips to root, k = 0..3",
        "    sums[table of k] += sums[4 - k]",
        "  results, k = 0..4",
        "    out[4 - k] = q[1 + 2 * k] * sums[k]",
        "    work[0] += q[1 + 2 * k]",
    ]


def test_every_operation_is_covered_here() -> None:
    """A new operation needs a line in the tables above."""
    graph = Graph()
    x, y, z = (graph.symbol(name) for name in "xyz")
    used = {node.op for make in DIFFERENTIABLE.values() for node in reachable([make(graph, x, y, z)])}
    assert used >= {*UNARY, *BINARY}
