"""NumPy source of a model: one Python function per function, on arrays over states."""

from __future__ import annotations

from pathlib import Path

from eomgen.backends.numpy import template
from eomgen.backends.numpy.printer import NumPyPrinter
from eomgen.backends.package import init_source, package_files
from eomgen.ir.program import Block, Program, Step, Store, Turns, parts
from eomgen.ir.statements import Indices, Text, statements
from eomgen.model import Model

RUNTIME = Path(__file__).parent / "runtime" / "_gufunc.py"
VALUE_BYTES = 1 << 25  # of a block: about half of the nodes get a name, and live as long as the call
RESULT_BYTES = 1 << 22  # of a block; its columns are written one by one, so it should stay in the cache
SMALLEST, LARGEST = 64, 4096  # states per block


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
    parts = [template.HEAD.format(title=model.title)]
    for program in model.programs:
        shapes = tuple(array.shape for array in program.inputs)
        arguments = ", ".join(array.name for array in program.inputs)
        if program.constants:
            parts.append(_routine(program, f"_{program.name}_constants", "p", program.constants, "c"))
        parts.append(_routine(program, f"_{program.name}", f"{arguments}, c", program.blocks, "out"))
        parts.append(
            template.FUNCTION.format(
                name=program.name,
                doc=f"{program.name}({arguments})\\n\\n{program.doc}.",
                shapes=repr(shapes),
                result=repr(program.output.shape),
                signature=program.signature,
                constants=f"_{program.name}_constants" if program.constants else None,
                parameters=program.inputs[-1].name == "p",
                block=_block_size(program),
                dtypes=repr(model.dtypes),
            )
        )
    return "\n".join(parts)


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
    for step in steps:
        lines += _step(step, printer)
    names = [array.name for array in program.scratch if array.role == "constants"]
    returned = "out" if result == "out" else f"({', '.join(names)},)"
    unpacked = f"{', '.join(names)}, = c" if names and result == "out" else ""
    body = [*([unpacked] if unpacked else []), *lines, f"return {returned}"]
    text = "\n".join(f"    {line}" for line in body)
    return template.ROUTINE.format(name=name, arguments=arguments, body=text)


def _step(step: Step, printer: NumPyPrinter) -> list[str]:
    """The lines of a block, or of several that take turns, with the loop around them."""
    if isinstance(step, Turns):
        found: list[str] = []
        lines = [f"done = [0] * {len(step.parts)}", f"for turn in {step.order!r}:", "    k = done[turn]"]
        lines.append("    done[turn] += 1")
        for number, block in enumerate(step.parts):
            tables, body = _body(block, printer, f"_{number}")
            found += tables
            lines.append(f"    {'el' if number else ''}if turn == {number}:  # {block.title}")
            lines += [f"        {line}" for line in body]
        return [f"# {step.title}", *found, *lines]
    tables, body = _body(step, printer)
    if step.looped:
        body = [f"for k in range({step.count}):", *(f"    {line}" for line in body)]
    return [f"# {step.title}", *tables, *body]


def _body(block: Block, printer: NumPyPrinter, suffix: str = "") -> tuple[list[str], list[str]]:
    """The tables of indices of a block, and its lines for one iteration."""
    indices = Indices(block, suffix)

    def put(store: Store, value: Text) -> str:
        target = f"{store.place.array}[{indices.at(store.place)}]"
        return f"{target} = {target} + {value.text}" if store.add else f"{target} = {value.text}"

    entering = sorted({place.array for place in block.loads.values()} & printer.carried)
    lines = [f"{printer.load(array, '0')} = {array}[0]" for array in entering]
    lines += statements(block, printer, indices.of, put)
    if block.inner:
        first, following = indices.text(block.inner.first, "k"), indices.text(block.inner.following, "i")
        step = [*lines, f"i = {following}"]
        lines = [f"i = {first}", "while i >= 0:", *(f"    {line}" for line in step)]
    return [f"{name} = {values!r}" for values, name in indices.tables.items()], lines
