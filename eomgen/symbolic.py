"""To and from SymPy: for reading (LaTeX), for tests, and for a user's own kinetic and potential energy."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from eomgen.errors import OptionError, UnsupportedError, shown
from eomgen.frontends.lagrange import LagrangeEquations
from eomgen.ir.equations import Equations, Symbols
from eomgen.ir.expr import Graph, Node, reachable
from eomgen.ir.interpret import Label, Operators, evaluate


def import_sympy() -> Any:
    """SymPy.

    Raises:
        UnsupportedError: it is not installed.
    """
    try:
        import sympy
    except ImportError:
        raise UnsupportedError("this needs SymPy, which is not installed; pip install sympy") from None
    return sympy


class _Expressions(Operators):
    """SymPy expressions as a kind of number for `evaluate`."""

    def __init__(self) -> None:
        self.sympy = import_sympy()

    def constant(self, value: int | Fraction) -> Any:
        return self.sympy.Rational(value.numerator, value.denominator)

    def turn(self, angle: Node, values: Mapping[Node, Any], label: Label) -> tuple[Any, Any]:
        return self.sympy.cos(values[angle]), self.sympy.sin(values[angle])

    def function(self, name: str, a: Any) -> Any:
        return getattr(self.sympy, name)(a)


def to_sympy(outputs: Sequence[Node], names: Mapping[str, Any] | None = None) -> list[Any]:
    """SymPy expressions equal to some nodes.

    Args:
        outputs: the nodes.
        names: SymPy expressions for symbols by name; others become real symbols of the same name.
    """
    sympy, known = import_sympy(), names or {}
    given = {
        node: known.get(node.name, sympy.Symbol(node.name, real=True))
        for node in reachable(outputs)
        if node.op == "symbol"
    }
    return evaluate(outputs, given, _Expressions())


def from_sympy(expression: Any, graph: Graph, symbols: Mapping[Any, Node]) -> Node:
    """The node equal to a SymPy expression, without evaluating any text.

    Args:
        expression: sums, products, powers (a fixed exponent that is a multiple of 1/2), sin, cos, tan, exp, log and
            exact or binary numbers.
        graph: the graph to build in.
        symbols: nodes for the expression's symbols (and applied functions, and derivatives).

    Raises:
        OptionError: a symbol has no node.
        UnsupportedError: a function is not in the list above.
    """
    sympy = import_sympy()
    if isinstance(expression, (int, float, Fraction)):
        expression = sympy.sympify(expression)
    if not isinstance(expression, sympy.Expr):
        raise OptionError(f"{shown(expression)} is no SymPy expression; text is not evaluated")
    done: dict[Any, Node] = {}
    stack: list[tuple[Any, bool]] = [(expression, False)]
    while stack:
        item, ready = stack.pop()
        if item in done:
            continue
        if item in symbols:
            done[item] = symbols[item]
        elif item.is_Number or item.is_NumberSymbol:
            done[item] = graph.constant(_number(item, sympy))
        elif ready:
            done[item] = _operation(item, [done[arg] for arg in item.args], graph, sympy)
        elif item.is_Symbol or isinstance(item, (sympy.Derivative, sympy.core.function.AppliedUndef)):
            raise OptionError(
                f"the energies contain {shown(str(item))}, which is no coordinate, rate or parameter; "
                "give its value in `parameters`"
            )
        else:
            stack.append((item, True))
            stack.extend((arg, False) for arg in item.args)
    return done[expression]


def _number(item: Any, sympy: Any) -> Fraction:
    """The exact value of a number; of π and the like 60 digits."""
    if item.is_finite and (item.is_Rational or item.is_Float or item.is_NumberSymbol):
        exact = sympy.Rational(str(item.evalf(60))) if item.is_NumberSymbol else sympy.Rational(item)
        value = Fraction(int(exact.p), int(exact.q))
        if abs(value) <= sys.float_info.max:
            return value
    raise UnsupportedError(f"the number {shown(str(item))} is no finite number that a float64 can hold")


def _operation(item: Any, args: list[Node], graph: Graph, sympy: Any) -> Node:
    if item.is_Add:
        return graph.sum(args)
    if item.is_Mul:
        product = graph.one
        for arg in args:
            product = product * arg
        return product
    if item.is_Pow and item.exp.is_Rational and item.exp.q in (1, 2):
        base = args[0] if item.exp.q == 1 else graph.sqrt(args[0])
        return graph.power(base, int(item.exp.p))
    if isinstance(item, sympy.exp):
        return graph.exp(args[0])
    if isinstance(item, sympy.tan):
        return graph.sin(args[0]) / graph.cos(args[0])
    for name in ("sin", "cos", "log"):
        if isinstance(item, getattr(sympy, name)) and len(args) == 1:
            made: Node = getattr(graph, name)(args[0])
            return made
    raise UnsupportedError(
        f"{shown(str(item.func.__name__))} is not supported; allowed: sums, products, powers with a fixed "
        "exponent that is a multiple of 1/2, sqrt, sin, cos, tan, exp, log"
    )


def lagrangian(
    T: Any,
    V: Any,
    q: Sequence[Any],
    parameters: Mapping[Any, float] | None = None,
    *,
    v: Sequence[Any] | None = None,
    dissipation: Any = 0,
) -> Equations:
    """Lagrange's equations of a user's own system.

    Args:
        T: kinetic energy, a SymPy expression of the coordinates, their rates and parameters.
        V: potential energy.
        q: the coordinates: SymPy symbols, or functions of time (`dynamicsymbols`).
        parameters: the value of every other symbol, in the order of p.
        v: the rates' symbols; may be left out if q are functions of time, whose derivatives then are the rates.
        dissipation: Rayleigh's function R of the rates: the damping forces are -∂R/∂q̇.

    Returns:
        Equations that `eomgen.compile` takes; u are the generalised forces of the coordinates.

    Raises:
        OptionError: no coordinates, as many rates as not coordinates, a name twice or no identifier, or a symbol
            without a value.
        UnsupportedError: SymPy is missing, or a function is not supported.
    """
    sympy = import_sympy()
    coordinates, values = list(q), dict(parameters or {})
    if not coordinates:
        raise OptionError("no coordinates; give at least one in q")
    if v is None:
        if not all(isinstance(item, sympy.core.function.AppliedUndef) for item in coordinates):
            raise OptionError("q are plain symbols, so their rates must be given: v=[...]")
        v = [sympy.Derivative(item, *item.args) for item in coordinates]
    if len(v) != len(coordinates):
        raise OptionError(f"{len(v)} rates in v for {len(coordinates)} coordinates in q; give one each")
    names = [_name(item) for item in coordinates]
    parameter_names = [_name(item) for item in values]
    taken = [*names, *parameter_names]
    for name in taken:
        if taken.count(name) > 1:
            raise OptionError(f"the name {name!r} stands twice among coordinates and parameters; rename one")
    graph = Graph()
    nodes = [graph.symbol(name) for name in names]
    rates = [graph.symbol(f"{name}.rate") for name in names]
    p = [graph.symbol(name) for name in parameter_names]
    symbols = Symbols(
        graph=graph,
        q=tuple(nodes),
        v=tuple(rates),
        a=tuple(graph.symbol(f"{name}.acceleration") for name in names),
        u=tuple(graph.symbol(f"{name}.force") for name in names),
        p=tuple(p),
        p_values=tuple(_value(name, value) for name, value in zip(parameter_names, values.values(), strict=True)),
    )
    table = dict(zip([*coordinates, *v, *values], [*nodes, *rates, *p], strict=True))
    kinetic, potential, damping = (from_sympy(item, graph, table) for item in (T, V, dissipation))
    return LagrangeEquations(symbols, kinetic, potential, graph.zero, damping)


def _value(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise OptionError(f"parameter {name}: {shown(value)} is no finite number; give one in `parameters`")
    return number


def _name(item: Any) -> str:
    name = str(getattr(item, "func", item).__name__) if getattr(item, "args", ()) else str(item)
    if not (name.isidentifier() and name.isascii()):
        raise OptionError(f"the name {shown(name)} is no identifier; rename the symbol (letters, digits, underscores)")
    return name
