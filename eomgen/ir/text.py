"""A readable dump of programs, with the symbols' own names; for people and for golden tests."""

from __future__ import annotations

from eomgen.ir.expr import Node
from eomgen.ir.program import Place, Program
from eomgen.ir.statements import Text, arithmetic, infix, statements


class PlainPrinter:
    """Ordinary notation."""

    def load(self, array: str, index: str) -> str:
        return index

    def named(self, name: str) -> str:
        return name

    def constant(self, node: Node) -> Text:
        text = str(node.value)
        return Text(text, 3 if text.isdigit() else 1 if text.startswith("-") else 2, 0, node)

    def operation(self, node: Node, args: list[Text]) -> Text:
        if node.op in ("pivot_inverse", "sqrt", "exp", "log"):
            depth = 1 + max(arg.depth for arg in args)
            if node.op == "pivot_inverse":
                return Text(f"1 / {args[0].text if args[0].rank == 3 else f'({args[0].text})'}", 2, depth, node)
            return Text(f"{node.op}({args[0].text})", 3, depth, node)
        return infix(node, args)

    def assign(self, name: str, text: str) -> str:
        return f"{name} = {text}"

    def sincos(self, angle: str, sine: str | None, cosine: str | None) -> list[str]:
        pairs = ((sine, "sin"), (cosine, "cos"))
        return [f"{name} = {function}({angle})" for name, function in pairs if name]


def dump(program: Program) -> str:
    """A program as text: a line per statement, results last in each block.

    A loaded symbol stands under its own name, another value as array[index]; in a loop k is the iteration.
    """
    inputs = {array.name for array in program.inputs}
    lines = [f"{program.name} {program.signature}: {program.doc}"]

    def place_text(place: Place, looped: bool) -> str:
        if not looped:
            return f"{place.array}[{place.indices[0]}]"
        return f"{place.array}[{arithmetic(place.indices) or 'table of k'}]"

    for block in (*program.constants, *program.blocks):
        looped = block.count > 1

        def name(node: Node, looped: bool = looped, loads: dict[Node, Place] = block.loads) -> str:
            place = loads[node]
            return node.name if not looped and place.array in inputs and node.name else place_text(place, looped)

        found, texts = statements(block, PlainPrinter(), name)
        lines.append(f"  {block.title}" + (f", k = 0..{block.count - 1}" if looped else ""))
        lines += [f"    {line}" for line in found]
        lines += [
            f"    {place_text(store.place, looped)} {'+=' if store.add else '='} {texts[store.node].text}"
            for store in block.stores
        ]
    return "\n".join(lines)
