"""Blocks as statements: which values get a name and which stand inside the expression that uses them.

A back end's printer needs only rules for single operations; this file decides where a statement begins.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple, Protocol

from eomgen.errors import UnsupportedError
from eomgen.ir.expr import Node
from eomgen.ir.program import Block, Place, Store
from eomgen.ir.schedule import order

NAMED = ("pivot_inverse", "sqrt", "exp", "log")
LATENCY = {"div": 4, "pivot_inverse": 6, "sin": 12, "cos": 12}  # in sums or products
DEPTH = 6  # deepest expression inside one statement


@dataclass(frozen=True)
class Text:
    """A printed expression.

    Attributes:
        text: what stands in the code.
        rank: how tightly it binds: 1 sums, 2 products, 3 anything that needs no parentheses.
        depth: operations nested in it.
        node: the operation it prints.
        factors: the two factors of a product.
        opposite: how its negative is written, where that is not a sign before it.
        late: the longest chain of operations up to it.
    """

    text: str
    rank: int
    depth: int
    node: Node
    factors: tuple[str, str] | None = None
    opposite: str | None = None
    late: int = 0


class Sine(NamedTuple):
    """An angle whose sine and cosine are wanted.

    Attributes:
        angle: its text.
        difference: the texts of x and y if the angle is a difference x - y of loaded values, which is rounded where
            they differ in size.
        sine, cosine: names for the results, None where one is not used.
    """

    angle: str
    difference: tuple[str, str] | None
    sine: str | None
    cosine: str | None


class Printer(Protocol):
    """The rules of a language.

    Attributes:
        sines: how many angles at most one call of `sincos` gets.
        together: whether sine and cosine of an angle come from one call, so that it is written once.
    """

    sines: int
    together: bool

    def load(self, array: str, index: str) -> str: ...
    def named(self, name: str) -> str: ...
    def constant(self, node: Node) -> Text: ...
    def operation(self, node: Node, args: list[Text]) -> Text: ...
    def assign(self, name: str, text: str) -> str: ...
    def sincos(self, sines: list[Sine]) -> list[str]: ...


def statements(
    block: Block, printer: Printer, index: Callable[[Node], str], put: Callable[[Store, Text], str]
) -> list[str]:
    """The statements of a block.

    A value is stored as soon as it is computed, so that it need not be kept, unless the block loads from the array.

    Args:
        block: the block.
        printer: the rules of the language.
        index: the text of the index at which a loaded node is found.
        put: the statement of a store.
    """
    loaded = {place.array for place in block.loads.values()}
    early: dict[Node, list[Store]] = {}
    last: list[Store] = []
    for store in block.stores:
        known = store.node in block.loads or not store.node.args
        if known or store.add or store.place.array in loaded:
            last.append(store)
        else:
            early.setdefault(store.node, []).append(store)
    writer = _Writer(block, printer, index)
    for node in writer.nodes:
        writer.write(node)
        writer.lines += [put(store, writer.texts[node]) for store in early.get(node, ())]
    return writer.lines + [put(store, writer.text(store.node)) for store in last]


class _Writer:
    """Writes the statements of a block, operation by operation.

    Attributes:
        nodes: what there is to write, in order.
        lines: the statements so far.
        texts: how what is written, loaded or constant is called.
    """

    def __init__(self, block: Block, printer: Printer, index: Callable[[Node], str]) -> None:
        self.block, self.printer, self.index = block, printer, index
        self.nodes = order(block)
        self.lines: list[str] = []
        self.texts: dict[Node, Text] = {}
        self.counter = 0
        self.uses = self._uses()
        # Angles whose sines are still to come, in the order of their first use.
        self.angles = list(dict.fromkeys(node.args[0] for node in self.nodes if node.op in ("sin", "cos")))

    def _uses(self) -> Counter[Node]:
        """How often the text of a value stands in others."""
        uses = Counter(arg for node in self.nodes for arg in node.args)
        uses.update(store.node for store in self.block.stores)
        for node in self.nodes:
            if node.op in ("sin", "cos"):
                (angle,) = node.args
                again = self.printer.together and node.op == "cos" and angle.graph.sin(angle) in uses
                uses[angle] -= again or is_difference(angle, self.block)
        # A sign never gets a name of its own, so what it negates must have one if the sign is used twice.
        for node in reversed(self.nodes):
            if node.op == "neg" and uses[node] > 1:
                uses[node.args[0]] += uses[node] - 1
        return uses

    def write(self, node: Node) -> None:
        """Writes the statement of a value, if it has one that is not written yet."""
        if node in self.texts:
            return
        if node.op in ("sin", "cos"):
            group = [self.angles[0], *filter(self._at_hand, self.angles[1:])][: self.printer.sines]
            self.angles = [angle for angle in self.angles if angle not in group]
            self.lines += self.printer.sincos([self._sine(angle) for angle in group])
        else:
            self._compute(node)

    def text(self, node: Node) -> Text:
        """The text of a value that is written, loaded or constant."""
        found = self.texts.get(node)
        if found is None:
            if node in self.block.loads:
                element = self.printer.load(self.block.loads[node].array, self.index(node))
                found = Text(element, 3, 0, node)
            else:
                found = self.printer.constant(node)
            self.texts[node] = found
        return found

    def _compute(self, node: Node) -> None:
        args = [self.text(arg) for arg in node.args]
        printed = self.printer.operation(node, args)
        late = max(arg.late for arg in args) + LATENCY.get(node.op, 1)
        if node.op != "neg" and (self.uses[node] > 1 or node.op in NAMED or printed.depth >= DEPTH):
            name = f"t{self.counter}"
            self.counter += 1
            self.lines.append(self.printer.assign(name, printed.text))
            printed = Text(self.printer.named(name), 3, 0, node)
        self.texts[node] = replace(printed, late=late)

    def _sine(self, angle: Node) -> Sine:
        if angle.args and angle not in self.block.loads and angle not in self.texts:
            self._compute(angle)
        twins = {angle.graph.sin(angle): f"s{self.counter}", angle.graph.cos(angle): f"c{self.counter}"}
        self.counter += 1
        names = [name if twin in self.uses and twin not in self.block.loads else None for twin, name in twins.items()]
        for twin, name in zip(twins, names, strict=True):
            if name is not None:
                late = self.text(angle).late + LATENCY[twin.op]
                self.texts[twin] = Text(self.printer.named(name), 3, 0, twin, late=late)
        difference = None
        if is_difference(angle, self.block):
            x, y = (self.text(arg).text for arg in angle.args)
            difference = x, y
        return Sine(self.text(angle).text, difference, *names)

    def _at_hand(self, angle: Node) -> bool:
        return angle in self.block.loads or all(arg in self.block.loads for arg in angle.args)


def is_difference(angle: Node, block: Block) -> bool:
    """Whether an angle is a difference of loaded values."""
    return angle.op == "sub" and angle not in block.loads and all(arg in block.loads for arg in angle.args)


def wrapped(text: Text, rank: int) -> str:
    """The text, in parentheses if it binds less tightly than `rank`."""
    return text.text if text.rank >= rank else f"({text.text})"


def infix(node: Node, args: list[Text]) -> Text:
    """The rules that C and Python share: sums, products, quotients and signs."""
    depth = 1 + max(arg.depth for arg in args)
    match node.op:
        case "add":
            return Text(f"{args[0].text} + {wrapped(args[1], 1)}", 1, depth, node)
        case "sub":
            return Text(f"{args[0].text} - {wrapped(args[1], 2)}", 1, depth, node)
        case "mul":
            factors = wrapped(args[0], 2), wrapped(args[1], 3)
            return Text(" * ".join(factors), 2, depth, node, factors)
        case "div":
            return Text(f"{wrapped(args[0], 2)} / {wrapped(args[1], 3)}", 2, depth, node)
        case "neg":
            return Text(f"-{wrapped(args[0], 3)}", 1, args[0].depth, node)
    raise AssertionError(f"no rule for {node.op}")


class Indices:
    """Texts of the indices of a block: numbers in straight-line code, expressions in the loop variable k in a loop.

    Indices without a common stride stand in tables. Where two differ by a constant, they share one.

    Args:
        block: the block.
        suffix: ends the names of the tables.

    Attributes:
        tables: the tables and their names.
    """

    def __init__(self, block: Block, suffix: str = "") -> None:
        self.block = block
        self.suffix = suffix
        self.tables: dict[tuple[int, ...], str] = {}
        self._shapes: dict[tuple[int, ...], tuple[str, int]] = {}

    def of(self, node: Node) -> str:
        """The index at which a loaded node is found."""
        return self.at(self.block.loads[node])

    def at(self, place: Place) -> str:
        """The index of a place."""
        if not self.block.looped:
            return str(place.index(0))
        outer = self.text(place.indices, "k")
        return f"{outer} + {self.text(place.inner, 'i')}" if place.inner else outer

    def text(self, indices: Sequence[int], variable: str) -> str:
        """The text of an index in a loop variable."""
        found = arithmetic(indices, variable)
        if found is None:
            first, values = indices[0], tuple(indices)
            shape = tuple(index - first for index in values)
            if shape not in self._shapes:
                self.tables[values] = f"at{len(self.tables)}{self.suffix}"
                self._shapes[shape] = self.tables[values], first
            name, start = self._shapes[shape]
            found = _plus(f"{name}[{variable}]", first - start)
        return found


def arithmetic(indices: Sequence[int], variable: str = "k") -> str | None:
    """The text of an index in the loop variable, None if the indices have no common stride."""
    if isinstance(indices, range):
        return affine(indices.start, indices.step, variable)
    strides = {b - a for a, b in itertools.pairwise(indices)} or {0}
    return affine(indices[0], strides.pop(), variable) if len(strides) == 1 else None


def affine(start: int, stride: int, variable: str = "k") -> str:
    """start + stride k, written as a person would."""
    if stride == 0:
        return str(start)
    term = variable if abs(stride) == 1 else f"{abs(stride)} * {variable}"
    if stride > 0:
        return _plus(term, start) if start < 0 else f"{start} + {term}" if start else term
    return f"{start} - {term}"


def _plus(term: str, number: int) -> str:
    return f"{term} {'-' if number < 0 else '+'} {abs(number)}" if number else term


def finite(value: int | Fraction) -> float:
    """The nearest double.

    Raises:
        UnsupportedError: none is as large.
    """
    try:
        return float(value)
    except OverflowError:
        size = len(str(abs(int(value)))) - 1
        raise UnsupportedError(
            f"the scene's numbers make one of about 1e{size} where they are computed beforehand (fold, regressor); a "
            "float64 holds numbers to 1.8e308; use smaller numbers, or other units, or leave fold out"
        ) from None


def decimal(value: int | Fraction) -> str:
    """A literal that reads back to the nearest number of any type: shortest if a double holds it exactly.

    Raises:
        UnsupportedError: no double is as large.
    """
    short = repr(finite(value))
    if Fraction(short) == value:
        return short
    scale = Fraction(value)
    exponent = len(str(abs(scale.numerator))) - len(str(scale.denominator))
    digits = round(scale * Fraction(10) ** (24 - exponent))
    return f"{digits}e{exponent - 24}"
