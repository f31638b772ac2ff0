"""NumPy text for expressions: one rule per operation."""

from __future__ import annotations

from eomgen.ir.expr import Node
from eomgen.ir.statements import Text, infix


class NumPyPrinter:
    """The rules of Python with an array namespace xp."""

    def load(self, array: str, index: str) -> str:
        return f"{array}[{index}]"

    def named(self, name: str) -> str:
        return name

    def constant(self, node: Node) -> Text:
        text = repr(float(node.value))
        return Text(text, 1 if text.startswith("-") else 3, 0, node)

    def operation(self, node: Node, args: list[Text]) -> Text:
        depth = 1 + max(arg.depth for arg in args)
        if node.op == "pivot_inverse":
            return Text(f"pivot_inverse(xp, {args[0].text}, {args[1].text})", 3, depth, node)
        if node.op in ("sqrt", "exp", "log"):
            return Text(f"xp.{node.op}({args[0].text})", 3, depth, node)
        return infix(node, args)

    def assign(self, name: str, text: str) -> str:
        return f"{name} = {text}"

    def sincos(self, angle: str, sine: str, cosine: str) -> list[str]:
        return [f"{sine}, {cosine} = xp.sin({angle}), xp.cos({angle})"]
