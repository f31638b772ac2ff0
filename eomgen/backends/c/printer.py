"""C text for expressions: one rule per operation.

The text serves every type: `real` is a scalar or a vector of lanes (see `runtime/eomgen_real.h`), and every value
is a pack of them, element h of which an EACH statement computes. A product that is used once inside a sum becomes
an explicit fused multiply-add, so that no compiler decides about rounding.
"""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.ir.expr import Node
from eomgen.ir.statements import Text, decimal, infix, wrapped

FUNCTIONS = {"pivot_inverse": "PIVOT_INVERSE", "sqrt": "SQRT", "exp": "EXP", "log": "LOG"}


class CPrinter:
    """The rules of C.

    Args:
        packs: for every array whether its elements are packs (at the rate of states) or scalars.
        inline: whether sines and cosines stand in line or are called.
    """

    def __init__(self, packs: Mapping[str, bool], inline: bool = True) -> None:
        self.packs = packs
        self.function = "SINCOS" if inline else "SINCOS_CALL"

    def load(self, array: str, index: str) -> str:
        return f"{array}[{index}][h]" if self.packs[array] else f"{array}[{index}]"

    def named(self, name: str) -> str:
        return f"{name}[h]"

    def constant(self, node: Node) -> Text:
        text = decimal(node.value)
        return Text(f"K({text})", 3, 0, node)

    def operation(self, node: Node, args: list[Text]) -> Text:
        if node.op in FUNCTIONS:
            inner = ", ".join(arg.text for arg in args)
            return Text(f"{FUNCTIONS[node.op]}({inner})", 3, 1 + max(arg.depth for arg in args), node)
        if node.op == "add" or node.op == "sub":
            fused = self._fused(node, *args)
            if fused is not None:
                return fused
        return infix(node, args)

    def _fused(self, node: Node, left: Text, right: Text) -> Text | None:
        """fma for a sum with a product that has no name of its own."""
        minus = node.op == "sub"
        for product, other, flip in ((left, right, False), (right, left, minus)):
            if product.factors is None:
                continue
            a, b = product.factors
            addend = other.text if not minus or flip else f"-{wrapped(other, 3)}"
            first = f"-{a}" if flip else a
            return Text(f"FMA({first}, {b}, {addend})", 3, 1 + max(left.depth, right.depth), node)
        return None

    def assign(self, name: str, text: str) -> str:
        return f"pack {name}; EACH {name}[h] = {text};"

    def sincos(self, angle: str, sine: str | None, cosine: str | None) -> list[str]:
        sine, cosine = sine or f"{cosine}_sin", cosine or f"{sine}_cos"
        return [f"pack {sine}, {cosine}; EACH {self.function}({angle}, &{sine}[h], &{cosine}[h]);"]
