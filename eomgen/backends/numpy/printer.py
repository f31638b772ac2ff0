"""NumPy text for expressions: one rule per operation."""

from __future__ import annotations

from collections.abc import Set
from fractions import Fraction

from eomgen.ir.expr import Node
from eomgen.ir.statements import Text, decimal, finite, infix

FUNCTIONS = ("sin", "cos", "sqrt", "exp", "log")


class NumPyPrinter:
    """The rules of Python with an array namespace xp.

    Args:
        carried: the arrays that carry a value on; what is loaded of them stands in variables of the block.

    Attributes:
        asks: whether something printed wants to know if all of q is small.
    """

    def __init__(self, carried: Set[str] = frozenset()) -> None:
        self.carried = carried
        self.asks = False

    def load(self, array: str, index: str) -> str:
        if array in self.carried:
            return f"{array}_in"
        return f"{array}[{index}]"

    def constant(self, node: Node) -> Text:
        nearest = finite(node.value)
        if Fraction(nearest) == node.value:
            return Text(repr(nearest), 1 if nearest < 0 else 3, 0, node)
        return Text(f'number("{decimal(node.value)}")', 3, 0, node)

    def operation(self, node: Node, args: list[Text]) -> Text:
        depth = 1 + max(arg.depth for arg in args)
        if node.op == "pivot_inverse":
            return Text(f"pivot_inverse(xp, {args[0].text}, {args[1].text})", 3, depth, node)
        if node.op in FUNCTIONS:
            return Text(f"xp.{node.op}({typed(args[0].text)})", 3, depth, node)
        return infix(node, args)

    def turn(self, sine: str, cosine: str, x: str, y: str, coordinates: bool) -> str:
        """The statement for sine and cosine of a difference of loaded values, of two coordinates or not."""
        self.asks |= coordinates
        return f"{sine}, {cosine} = sincos_difference(xp, {x}, {y}, {'small' if coordinates else False})"


def typed(text: str) -> str:
    """The argument of a function; a literal takes the type of the arrays first."""
    try:
        float(text)
    except ValueError:
        return text
    return f'number("{text}")'
