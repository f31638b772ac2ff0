"""C text for expressions: one rule per operation, for each kind of arithmetic.

The text serves every type: `real` is a scalar or a vector of lanes (see `runtime/eomgen_real.h`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Literal

from eomgen.errors import UnsupportedError
from eomgen.ir.expr import Node
from eomgen.ir.statements import Sine, Text, decimal, finite, infix, wrapped

Kind = Literal["input", "output", "work", "carried", "constants", "p"]

FUNCTIONS = {"pivot_inverse": "PIVOT_INVERSE", "sqrt": "SQRT", "exp": "EXP", "log": "LOG"}


def element(kind: Kind, array: str, index: str) -> str:
    """The reals of an element: arguments and results may lie in arrays of the caller."""
    return f"EOM_AT({array}, {index})" if kind in ("input", "output") else f"{array}[{index}]"


def entering(array: str) -> str:
    """The variable with what an array carries into a block."""
    return f"{array}_in"


class CPrinter:
    """Arithmetic in the type of the arguments.

    Every value is a pack, element h of which an EACH statement computes. A product that is used once inside a sum
    becomes an explicit fused multiply-add, so that no compiler decides about rounding.

    Args:
        kinds: what each array is; elements of `constants` and `p` are scalars, all others packs. What is loaded of
            those that are `carried` stands in variables of the block.
        inline: whether sines and cosines stand in line or are called.
    """

    together = True

    def __init__(self, kinds: Mapping[str, Kind], inline: bool = True) -> None:
        self.kinds = kinds
        self.inline = inline
        self.sines = 2 if inline else 1
        self.scalars: set[str] = set()  # texts of scalars in functions that work on vectors

    def load(self, array: str, index: str) -> str:
        if self.kinds[array] == "carried":
            return self.named(entering(array))
        if self.kinds[array] not in ("constants", "p"):
            return f"{element(self.kinds[array], array, index)}[h]"
        self.scalars.add(f"{array}[{index}]")
        return f"{array}[{index}]"

    def named(self, name: str) -> str:
        return f"{name}[h]"

    def constant(self, node: Node) -> Text:
        text = f"K({decimal(node.value)})"
        self.scalars.add(text)
        return Text(text, 3, 0, node)

    def listed(self, element: str) -> str:
        """An element of a table of doubles."""
        return f"(scalar){element}"

    def operation(self, node: Node, args: list[Text]) -> Text:
        if node.op in FUNCTIONS:
            inner = ", ".join(arg.text for arg in args)
            return Text(f"{FUNCTIONS[node.op]}({inner})", 3, 1 + max(arg.depth for arg in args), node)
        if node.op == "add" or node.op == "sub":
            fused = self._fused(node, *args)
            if fused is not None:
                return fused
        if node.op == "neg" and args[0].opposite is not None:
            return Text(args[0].opposite, 3, args[0].depth, node)
        return infix(node, args)

    def _fused(self, node: Node, left: Text, right: Text) -> Text | None:
        """fma for a sum with a product that has no name of its own; of two, that which comes last.

        Its negative is one, too: a compiler takes a sign into the fma of scalars, but not of vectors, and a zero can
        then have another sign.
        """
        minus = node.op == "sub"
        orders = [(left, right, False), (right, left, minus)]
        for product, other, flip in sorted(orders, key=lambda order: -order[0].late):
            if product.factors is None:
                continue
            factors = ", ".join(product.factors)
            addends = other.text, other.opposite or f"-{wrapped(other, 3)}"
            kept = not minus or flip
            text = f"{'FNMA' if flip else 'FMA'}({factors}, {addends[not kept]})"
            opposite = f"{'FMA' if flip else 'FNMA'}({factors}, {addends[kept]})"
            return Text(text, 3, 1 + max(left.depth, right.depth), node, opposite=opposite)
        return None

    def assign(self, name: str, text: str) -> str:
        return f"pack {name}; EACH {name}[h] = {text};"

    def sincos(self, sines: list[Sine]) -> list[str]:
        function = "SINCOS2" if len(sines) == 2 else "SINCOS" if self.inline else "SINCOS_CALL"
        angles = [f"DIFFERENCE({', '.join(s.difference)})" if s.difference else f"ANGLE({s.angle})" for s in sines]
        names = [name for s in sines for name in (s.sine or f"{s.cosine}_sin", s.cosine or f"{s.sine}_cos")]
        return [f"pack {', '.join(names)}; {function}({', '.join([*angles, *names])});"]

    def enter(self, array: str) -> str:
        """The statement that loads what an array carries into a block."""
        return self.assign(entering(array), f"{array}[0][h]")

    def leave(self, array: str, value: Text) -> str:
        """The statement that computes what an array carries on, while what it has carried is still needed."""
        return self.assign(f"{array}_out", self._real(value))

    def advance(self, array: str) -> str:
        """The statement after which the latter is the former."""
        return f"EACH {entering(array)}[h] = {array}_out[h];"

    def keep(self, array: str) -> str:
        """The statement after a loop that leaves in an array what it has carried to the end."""
        return f"EACH {array}[0][h] = {entering(array)}[h];"

    def _real(self, value: Text) -> str:
        return f"R({value.text})" if value.text.removeprefix("-") in self.scalars else value.text

    def store(self, array: str, index: str, value: Text, add: bool) -> str:
        """The statement that puts a value into an array, or adds it to what is there."""
        sign = "+=" if add else "="
        if self.kinds[array] == "constants":
            return f"EACH {array}[{index}] {sign} {value.text};"
        return f"EACH {element(self.kinds[array], array, index)}[h] {sign} {self._real(value)};"


class FastPrinter(CPrinter):
    """Arithmetic in float for arguments in double.

    Values between have half as many vectors as the packs of the arguments, of floats. The difference of two
    arguments is taken before it is rounded, and sines of angles and of differences reduce them as doubles.
    """

    def __init__(self, kinds: Mapping[str, Kind]) -> None:
        super().__init__(kinds, inline=False)
        self.arguments: dict[str, str] = {}  # text of an argument as a float -> as a pack

    def load(self, array: str, index: str) -> str:
        if self.kinds[array] == "input":
            pack = element("input", array, index)
            text = f"NARROW({pack})"
            self.arguments[text] = pack
            return text
        if self.kinds[array] == "p":
            self.scalars.add(f"(float)p[{index}]")
            return f"(float)p[{index}]"
        return super().load(array, index)

    def operation(self, node: Node, args: list[Text]) -> Text:
        packs = self._packs([arg.text for arg in args])
        if node.op == "sub" and packs:
            return Text(f"NARROW_DIFFERENCE({packs})", 3, 1, node)
        return super().operation(node, args)

    def _packs(self, texts: Sequence[str]) -> str | None:
        """Floats as the packs they come from, if all are arguments."""
        known = all(text in self.arguments for text in texts)
        return ", ".join(self.arguments[text] for text in texts) if known else None

    def assign(self, name: str, text: str) -> str:
        return f"floats {name}; EACH {name}[h] = {text};"

    def sincos(self, sines: list[Sine]) -> list[str]:
        ((angle, difference, sine, cosine),) = sines
        sine, cosine = sine or f"{cosine}_sin", cosine or f"{sine}_cos"
        if difference and (packs := self._packs(difference)):
            call = f"SINCOS_DIFFERENCE({packs}"
        elif packs := self._packs([angle]):
            call = f"SINCOS_ANGLE({packs}"
        else:
            call = f"SINCOS({angle}"
        return [f"floats {sine}, {cosine}; EACH {call}, &{sine}[h], &{cosine}[h]);"]

    def store(self, array: str, index: str, value: Text, add: bool) -> str:
        if self.kinds[array] == "output":
            return f"EACH WIDEN({element('output', array, index)}, R({value.text}));"
        return super().store(array, index, value, add)


class HighPrinter:
    """Arithmetic in twofolds (sums of two doubles) for arguments in double.

    What is a double exactly (an argument, a parameter, most numbers) enters as one: its sums and products cost less.
    """

    sines, together = 1, True

    def __init__(self, kinds: Mapping[str, Kind]) -> None:
        self.kinds = kinds
        self.doubles: set[str] = set()  # texts of doubles

    def _double(self, text: str) -> str:
        self.doubles.add(text)
        return text

    def _wide(self, text: str) -> str:
        return f"WIDE({text})" if text in self.doubles else text

    def load(self, array: str, index: str) -> str:
        match self.kinds[array]:
            case "input":
                return self._double(f"{element('input', array, index)}[0]")
            case "p":
                return self._double(f"SET(p[{index}])")
            case "constants":
                return f"SPREAD({array}[{index}])"
            case "carried":
                return entering(array)
        return f"{array}[{index}]"

    def named(self, name: str) -> str:
        return name

    def constant(self, node: Node) -> Text:
        hi = finite(node.value)
        lo = float(Fraction(node.value) - Fraction(hi))
        text = f"TWOFOLD({hi!r}, {lo!r})" if lo else self._double(f"SET({hi!r})")
        return Text(text, 3, 0, node)

    def listed(self, element: str) -> str:
        return self._double(f"SET({element})")

    def operation(self, node: Node, args: list[Text]) -> Text:
        depth = 1 + max(arg.depth for arg in args)
        texts = [arg.text for arg in args]
        match node.op:
            case "neg":
                return Text(self._minus(texts[0]), 3, args[0].depth, node)
            case "add":
                return Text(self._call("ADD", *texts), 3, depth, node)
            case "sub":
                return Text(self._call("ADD", texts[0], self._minus(texts[1])), 3, depth, node)
            case "mul":
                return Text(self._product(node, *texts), 3, depth, node)
            case "div":
                return Text(f"DIV22({', '.join(map(self._wide, texts))})", 3, depth, node)
            case "pivot_inverse":
                return Text(f"PIVOT_INVERSE({', '.join(map(self._wide, texts))})", 3, depth, node)
        raise UnsupportedError(
            f"accuracy 'high' has no {node.op}, which these equations use; "
            "allowed: sums, products, quotients, sines and cosines; use accuracy 'standard'"
        )

    def _minus(self, text: str) -> str:
        return self._double(f"-{text}") if text in self.doubles else f"MINUS({text})"

    def _call(self, name: str, a: str, b: str) -> str:
        if a in self.doubles and b not in self.doubles:
            a, b = b, a
        return f"{name}{2 - (a in self.doubles)}{2 - (b in self.doubles)}({a}, {b})"

    def _product(self, node: Node, a: str, b: str) -> str:
        for factor, text, other in ((node.args[0], a, b), (node.args[1], b, a)):
            if factor.op == "constant" and abs(math.frexp(factor.value)[0]) == 0.5 and text in self.doubles:
                return self._double(f"({other} * {text})") if other in self.doubles else f"SCALE({other}, {text})"
        return self._call("MUL", a, b)

    def assign(self, name: str, text: str) -> str:
        return f"twofold {name} = {self._wide(text)};"

    def sincos(self, sines: list[Sine]) -> list[str]:
        ((angle, _, sine, cosine),) = sines
        sine, cosine = sine or f"{cosine}_sin", cosine or f"{sine}_cos"
        return [f"twofold {sine}, {cosine}; SINCOS({self._wide(angle)}, &{sine}, &{cosine});"]

    def enter(self, array: str) -> str:
        return self.assign(entering(array), f"{array}[0]")

    def leave(self, array: str, value: Text) -> str:
        return self.assign(f"{array}_out", value.text)

    def advance(self, array: str) -> str:
        return f"{entering(array)} = {array}_out;"

    def keep(self, array: str) -> str:
        return f"{array}[0] = {entering(array)};"

    def store(self, array: str, index: str, value: Text, add: bool) -> str:
        if self.kinds[array] == "output":
            text = value.text if value.text in self.doubles else f"{value.text}.hi"
            return f"{element('output', array, index)}[0] = {text};"
        target = f"{array}[{index}]"
        return f"{target} = {self._call('ADD', target, value.text) if add else self._wide(value.text)};"
