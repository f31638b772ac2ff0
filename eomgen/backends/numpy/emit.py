"""NumPy source of a model: one Python function per function, on arrays over states."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from eomgen.backends.numpy import template
from eomgen.backends.numpy.printer import NumPyPrinter
from eomgen.backends.package import help_text, init_source, package_files
from eomgen.ir.expr import LEAVES, Node
from eomgen.ir.program import Block, Program, Rounds, Step, Turns, parts
from eomgen.ir.schedule import order
from eomgen.ir.statements import Indices, Text, is_difference
from eomgen.model import Model

RUNTIME = Path(__file__).parent / "runtime" / "_gufunc.py"
VALUE_BYTES = 1 << 25  # of a block, if half of the values are alive: in long functions they wait in arrays
RESULT_BYTES = 1 << 22  # of a block; its columns are written one by one, so it should stay in the cache
SMALLEST, LARGEST = 64, 4096  # states per block
ARGUMENTS = frozenset("qvauwp")
SIGNS = {"add": "+", "sub": "-", "mul": "*"}
UNRECORDED = ("add", "sub", "mul", "sin", "cos")  # operations whose derivatives do not need their result


def emit(model: Model) -> dict[str, str]:
    """The files of the package by name."""
    return {
        "__init__.py": init_source(model, "numpy", "_kernel"),
        **package_files(model),
        "_kernel.py": kernel(model),
        "_gufunc.py": RUNTIME.read_text(encoding="utf-8"),
    }


def kernel(model: Model) -> str:
    """The module with all functions."""
    texts = [template.HEAD.format(title=model.title)]
    for program in model.programs:
        shapes = tuple(array.shape for array in program.inputs)
        arguments = ", ".join(array.name for array in program.inputs)
        if program.constants:
            texts.append(_routine(program, f"_{program.name}_constants", "p", program.constants, "c"))
        texts.append(_routine(program, f"_{program.name}", f"{arguments}, c", program.blocks, "out"))
        texts.append(
            template.FUNCTION.format(
                name=program.name,
                doc="\\n\\n".join(help_text(program)),
                shapes=repr(shapes),
                result=repr(program.output.shape),
                signature=program.signature,
                constants=f"_{program.name}_constants" if program.constants else None,
                parameters=program.inputs[-1].name == "p",
                block=_block_size(program),
                dtypes=repr(model.dtypes),
            )
        )
    return "\n".join(texts)


def _block_size(program: Program) -> int:
    """States per block: enough that NumPy's calls cost little, few enough that the values take little memory."""
    values = sum(len(block.nodes()) * block.times() for block in parts(program.blocks)) // 2 + program.output.size
    fitting = min(VALUE_BYTES // (8 * max(values, 1)), RESULT_BYTES // (8 * max(program.output.size, 1)))
    return max(SMALLEST, min(LARGEST, fitting // 64 * 64))


def _routine(program: Program, name: str, arguments: str, steps: tuple[Step, ...], result: str) -> str:
    """One Python function; its result is the list of the elements of `result`."""
    roles = ("constants",) if result == "c" else ("work", "carried")
    lines = [f"{array.name} = [0.0] * {array.size}" for array in program.scratch if array.role in roles]
    printer = NumPyPrinter({array.name for array in program.scratch if array.role == "carried"})
    if result == "out":
        lines.append(f"out = [0.0] * {program.output.size}")
    body = [line for step in steps for line in _step(step, printer)]
    if printer.asks:
        lines.append("small = all_small(xp, q)")
    lines += body
    names = [array.name for array in program.scratch if array.role == "constants"]
    returned = "out" if result == "out" else f"({', '.join(names)},)"
    unpacked = f"{', '.join(names)}, = c" if names and result == "out" else ""
    body = [*([unpacked] if unpacked else []), *lines, f"return {returned}"]
    text = "\n".join(f"    {line}" for line in body)
    return template.ROUTINE.format(name=name, arguments=arguments, body=text)


def _step(step: Step, printer: NumPyPrinter) -> list[str]:
    """The lines of a step, with the loops around them."""
    tables, lines = _lines(step, printer, "")
    return [f"# {step.title}", *tables, *lines]


def _lines(step: Step, printer: NumPyPrinter, suffix: str) -> tuple[list[str], list[str]]:
    """The tables of a step, whose names end in the suffix, and its lines."""
    tables: list[str] = []
    if isinstance(step, Rounds):
        lines = [f"for i in range({step.count}):"]
        for number, part in enumerate(step.steps):
            found, body = _lines(part, printer, f"{suffix}_{number}")
            tables += found
            lines += [f"    # {part.title}", *(f"    {line}" for line in body)]
        return tables, lines
    if isinstance(step, Turns):
        lines = [f"done = [0] * {len(step.parts)}", f"for turn in {step.order!r}:", "    k = done[turn]"]
        lines.append("    done[turn] += 1")
        for number, block in enumerate(step.parts):
            found, body = _body(block, printer, f"{suffix}_{number}")
            tables += found
            lines.append(f"    {'el' if number else ''}if turn == {number}:  # {block.title}")
            lines += [f"        {line}" for line in body]
        return tables, lines
    tables, lines = _body(step, printer, suffix)
    if step.count > 1 or step.inner:
        lines = [f"for k in range({step.count}):", *(f"    {line}" for line in lines)]
    return tables, lines


def _body(block: Block, printer: NumPyPrinter, suffix: str = "") -> tuple[list[str], list[str]]:
    """The tables of indices of a block, and its lines for one iteration."""
    indices = Indices(block, suffix)
    lines = _statements(block, printer, indices)
    if block.inner:
        first, following = indices.text(block.inner.first, "k"), indices.text(block.inner.following, "i")
        step = [*lines, f"i = {following}"]
        lines = [f"i = {first}", "while i >= 0:", *(f"    {line}" for line in step)]
    return [f"{name} = {values!r}" for values, name in indices.tables.items()], lines


def _statements(block: Block, printer: NumPyPrinter, indices: Indices) -> list[str]:
    """Every operation as a statement, then the stores.

    Sine and cosine of a difference of loaded values come from one call, which corrects them for its rounding. After
    the last use of a value its name is taken again, so that few arrays are alive and stay in the cache. A sum or
    product is written over an operand that has no other use, if no library keeps that for derivatives and it depends
    on every argument that the other one depends on: then it has the shape of the result.
    """
    writer = _Writer(block, printer, indices)
    for node in order(block):
        writer.write(node)
    for store in block.stores:
        target, value = f"{store.place.array}[{indices.at(store.place)}]", writer.text(store.node).text
        writer.lines.append(f"{target} = {target} + {value}" if store.add else f"{target} = {value}")
    return writer.lines


class _Writer:
    """Writes the statements of a block, operation by operation.

    Attributes:
        lines: the statements so far.
    """

    def __init__(self, block: Block, printer: NumPyPrinter, indices: Indices) -> None:
        self.block, self.printer, self.indices = block, printer, indices
        nodes = order(block)
        sines = [node for node in nodes if node.op in ("sin", "cos")]
        self.turned = {node: node.args[0] for node in sines if is_difference(node.args[0], block)}
        self.uses = Counter([*(arg for node in nodes for arg in node.args), *(store.node for store in block.stores)])
        self.uses.subtract(self.turned.values())
        self.left = self.uses.copy()
        self.texts: dict[Node, Text] = {}
        self.least: dict[Node, frozenset[str]] = {}  # the arguments a value certainly depends on
        self.most: dict[Node, frozenset[str]] = {}  # and those it may depend on
        self.free: list[str] = []
        self.count = 0
        entering = sorted({place.array for place in block.loads.values()} & printer.carried)
        self.lines = [f"{printer.load(array, '0')} = {array}[0]" for array in entering]

    def text(self, node: Node) -> Text:
        """The text of a value that is written, loaded or constant."""
        if node not in self.texts:
            place = self.block.loads.get(node)
            if place is None:
                self.texts[node] = self.printer.constant(node)
            else:
                self.texts[node] = Text(self.printer.load(place.array, self.indices.at(place)), 3, 0, node)
            array = "" if place is None else "p" if place.array == "c" else place.array
            self.least[node] = ARGUMENTS & {array}
            self.most[node] = self.least[node] if array in {"", *ARGUMENTS} else ARGUMENTS
        return self.texts[node]

    def write(self, node: Node) -> None:
        """Writes the statement of a value, if it has one that is not written yet."""
        if node in self.texts or not self.uses[node]:
            return
        if node in self.turned:
            self._turn(node)
            return
        text = self.printer.operation(node, [self.text(arg) for arg in node.args]).text
        self._depends(node, node.args)
        over = self._spare(node)
        for arg in node.args:
            self.left[arg] -= 1
            if not self.left[arg] and arg not in self.block.loads and arg.op not in LEAVES and arg is not over:
                self.free.append(self.texts[arg].text)
        if over:
            (other,) = (self.texts[arg].text for arg in node.args if arg is not over)
            name = self.texts[over].text
            self.lines.append(f"{name} {SIGNS[node.op]}= {other}")
        else:
            name = self._name()
            self.lines.append(f"{name} = {text}")
        self.texts[node] = Text(name, 3, 0, node)

    def _turn(self, node: Node) -> None:
        """Sine and cosine of a difference of loaded values."""
        angle = node.args[0]
        x, y = (self.text(arg).text for arg in angle.args)
        twins = node.graph.sin(angle), node.graph.cos(angle)
        sine, cosine = (self._name() if twin in self.turned else "_" for twin in twins)
        for twin, name in zip(twins, (sine, cosine), strict=True):
            if twin in self.turned:
                self.texts[twin] = Text(name, 3, 0, twin)
                self._depends(twin, angle.args)
        coordinates = all(self.block.loads[arg].array == "q" for arg in angle.args)
        self.lines.append(self.printer.turn(sine, cosine, x, y, coordinates))

    def _spare(self, node: Node) -> Node | None:
        """The operand over which a sum or product may be written."""
        targets = {"add": node.args, "mul": node.args, "sub": node.args[:1]}.get(node.op, ())
        for arg in targets:
            if self.uses[arg] == 1 and arg.op in UNRECORDED and self.least[arg] == self.most[node]:
                return arg
        return None

    def _name(self) -> str:
        if self.free:
            return self.free.pop()
        self.count += 1
        return f"t{self.count - 1}"

    def _depends(self, node: Node, args: Iterable[Node]) -> None:
        self.least[node] = frozenset().union(*(self.least[arg] for arg in args))
        self.most[node] = frozenset().union(*(self.most[arg] for arg in args))
