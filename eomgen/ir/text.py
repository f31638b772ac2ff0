"""A readable dump of programs, with the symbols' own names; for people and for golden tests."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.ir.expr import Node
from eomgen.ir.program import Block, Place, Program, Rounds, Step, Store, Turns
from eomgen.ir.statements import Sine, Text, arithmetic, infix, statements


class PlainPrinter:
    """Ordinary notation."""

    sines, together = 1, False

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

    def sincos(self, sines: list[Sine]) -> list[str]:
        [(angle, _, sine, cosine)] = sines
        pairs = ((sine, "sin"), (cosine, "cos"))
        return [f"{name} = {function}({angle})" for name, function in pairs if name]


def dump(program: Program) -> str:
    """A program as text: a line per statement, results last in each block.

    A loaded symbol stands under its own name, another value as array[index]; in a loop k is the iteration, i that of
    a loop inside or around. Loops that take turns, and steps with a loop around them, stand below their common title.
    """
    inputs = {array.name for array in program.inputs}
    lines = [f"{program.name} {program.signature}: {program.doc}"]
    return "\n".join([*lines, *_steps((*program.constants, *program.blocks), inputs)])


def _steps(steps: Sequence[Step], inputs: set[str]) -> list[str]:
    lines: list[str] = []
    for step in steps:
        if isinstance(step, Rounds):
            lines += [f"  {step.title}, i = 0..{step.count - 1}", *_steps(step.steps, inputs)]
            continue
        if isinstance(step, Turns):
            lines.append(f"  {step.title}, {len(step.parts)} loops in turns")
        lines += [line for block in step.parts for line in _block(block, inputs)]
    return lines


def _block(block: Block, inputs: set[str]) -> list[str]:
    def index(indices: Sequence[int], variable: str) -> str:
        return arithmetic(indices, variable) or f"table of {variable}"

    def place_text(place: Place) -> str:
        if not block.looped:
            return f"{place.array}[{place.indices[0]}]"
        inner = f" + {index(place.inner, 'i')}" if place.inner else ""
        return f"{place.array}[{index(place.indices, 'k')}{inner}]"

    def name(node: Node) -> str:
        place = block.loads[node]
        return node.name if not block.looped and place.array in inputs and node.name else place_text(place)

    def put(store: Store, value: Text) -> str:
        return f"{place_text(store.place)} {'+=' if store.add else '='} {value.text}"

    found = statements(block, PlainPrinter(), name, put)
    title = f"  {block.title}" + (f", k = 0..{block.count - 1}" if block.count > 1 or block.inner else "")
    if block.inner:
        title += f", i = {index(block.inner.first, 'k')}, then {index(block.inner.following, 'i')}"
    return [title, *(f"    {line}" for line in found)]
