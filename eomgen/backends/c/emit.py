"""C source of a model: kernels for any type, the table of functions, a plain C interface."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Container, Iterable
from fractions import Fraction

from eomgen.backends.c import template
from eomgen.backends.c.arithmetic import ARITHMETIC, STREAMS, Arithmetic
from eomgen.backends.c.printer import CPrinter, HighPrinter, Kind
from eomgen.backends.package import help_text, init_source, legend, package_files, rollout_signature
from eomgen.ir.program import Array, Block, Program, Rounds, Step, Store, Turns, parts
from eomgen.ir.statements import Indices, Text, decimal, statements
from eomgen.model import Model

WIDE_LIMIT = 2000  # expression nodes
FEW_NUMBERS = 8  # that are stored one by one
TYPES = {"float64": ("f64", "f64v"), "float32": ("f32", "f32v"), "longdouble": ("f80", None)}


def emit(model: Model) -> dict[str, str]:
    """The files of the package by name, all but those that are the same for every model."""
    return {
        "__init__.py": init_source(model, "c", "_kernel"),
        **package_files(model),
        f"csrc/{model.name}_kernels.h": kernels(model),
        f"csrc/{model.name}.c": table(model),
        f"csrc/{model.name}.h": header(model),
    }


def kernels(model: Model) -> str:
    """The functions, as text that is included once per type."""
    arithmetic = ARITHMETIC[model.accuracy]
    head = template.KERNELS_HEAD.format(
        title=model.title,
        name=model.name,
        about=arithmetic.about,
        legend=legend(model, " * "),
        header=arithmetic.header,
    )
    return "\n".join([head, *(function(program, arithmetic) for program in model.programs)])


def function(program: Program, arithmetic: Arithmetic = ARITHMETIC["standard"]) -> str:
    """The kernels of one function: its parts, the function itself, its constants."""
    heading = template.SECTION.format(
        name=program.name,
        doc=program.doc,
        signature=program.signature,
        streams=arithmetic.streams[is_short(program)],
    )
    pieces: list[str] = [heading]
    if program.constants:
        pieces.append("#if EOM_SCALAR_TEXT\n")
        pieces.append(_routine(program, f"{program.name}_constants", program.constants, arithmetic, constants=True))
        pieces.append("#endif\n")
    pieces.append(_routine(program, program.name, program.blocks, arithmetic, constants=False))
    return "\n".join(pieces)


def is_short(program: Program) -> bool:
    """Whether this is the function that runs most, and it is short.

    Then it carries two streams of states, has its sines inlined, and is one function for the compiler, which all cost
    compile time in proportion to the code.
    """
    return (
        program.name == "forward_dynamics" and sum(len(block.nodes()) for block in parts(program.blocks)) <= WIDE_LIMIT
    )


def _routine(program: Program, name: str, steps: tuple[Step, ...], arithmetic: Arithmetic, constants: bool) -> str:
    """One C function; several blocks become functions of their own that it calls in order."""
    frame = template.CONSTANTS_PARAMETERS if constants else template.PARAMETERS
    parameters = frame.format(value=arithmetic.value, still=arithmetic.still)
    arguments = "p, c" if constants else "in, places, p, c, out, work"
    pointers = _pointers(program, arithmetic, constants)
    printer = arithmetic.printer(_kinds(program), is_short(program))
    apart = template.TOGETHER if is_short(program) else template.APART
    pieces: list[str] = []

    def add(frame: str, name: str, title: str, body: list[str], more: str = "") -> None:
        comment = [f"/* {title} */"] if title else []
        text = _indent([*comment, *_used(pointers, body), *body])
        pieces.append(frame.format(name=name, apart=apart, parameters=parameters + more, body=text))

    if len(steps) == 1 and isinstance(steps[0], Block):
        add(template.FUNCTION, name, "", _block(steps[0], printer))
        return "\n".join(pieces)

    def calls(step: Step, part: str, more: str = "", given: str = "") -> list[str]:
        """Adds the functions of a step; returns the lines that call them."""
        if isinstance(step, Rounds):
            inside = [calls(each, f"{part}_{i}", ", int i", ", i") for i, each in enumerate(step.steps, 1)]
            lines = [f"    {line}" for each in inside for line in each]
            return [f"for (int i = 0; i < {step.count}; i++) {{ /* {step.title} */", *lines, "}"]
        if isinstance(step, Turns):
            for number, block in enumerate(step.parts, 1):
                tables, lines = _body(block, printer)
                add(template.PART, f"{part}_{number}", block.title, [*tables, *lines], f", int k{more}")
            return _turns(step, part, f"{parameters}, int k{more}", f"{arguments}, done[turns[turn]]++{given}")
        add(template.PART, part, step.title, _block(step, printer), more)
        return [f"EOM_NAME({part})({arguments}{given});"]

    body = [line for position, step in enumerate(steps, 1) for line in calls(step, f"{name}_{position}")]
    add(template.FUNCTION, name, "", body)
    return "\n".join(pieces)


def _kinds(program: Program) -> dict[str, Kind]:
    return {name: "p" if name == "p" else array.role for name, array in program.arrays.items()}


def _pointers(program: Program, arithmetic: Arithmetic, constants: bool) -> dict[str, str]:
    """A declaration for every array that is not itself a parameter of the C function."""
    pointers: dict[str, str] = {}
    if not constants:
        position = 0
        for array in program.inputs:
            if array.name != "p":
                pointers[array.name] = (
                    f"const scalar *const {array.name} = in[{position}]; EOM_PLACE({array.name}, {position});"
                )
                position += 1
        pointers["out"] = f"EOM_PLACE(out, {position});"
    offset = {"constants": 0, "work": 0}
    for array in program.scratch:
        if array.role == "constants":
            kind = arithmetic.still if constants else f"const {arithmetic.still}"
            if array.name != "c":
                pointers[array.name] = f"{kind} *const {array.name} = c + {offset['constants']};"
        elif not constants:
            pointers[array.name] = f"{arithmetic.value} *const {array.name} = work + {offset['work']};"
        offset["constants" if array.role == "constants" else "work"] += array.size
    return pointers


def _used(pointers: dict[str, str], body: list[str]) -> list[str]:
    named = {name for line in body for pair in re.findall(r"(\w+)\[|EOM_AT\((\w+),", line) for name in pair}
    return [line for name, line in pointers.items() if name in named]


def _turns(step: Turns, part: str, parameters: str, arguments: str) -> list[str]:
    """The loop in which blocks take turns; each is a function of its own, as they may be many."""
    numbers = range(1, len(step.parts) + 1)
    return [
        f"{{ /* {step.title} */",
        f"    static void (*const loops[])({parameters}) = {{",
        *(f"        EOM_NAME({part}_{number})," for number in numbers),
        "    };",
        f"    static const short turns[] = {{{', '.join(map(str, step.order))}}};",
        f"    int done[{len(step.parts)}] = {{0}};",
        f"    for (int turn = 0; turn < {len(step.order)}; turn++)",
        f"        loops[turns[turn]]({arguments});",
        "}",
    ]


def _block(block: Block, printer: CPrinter | HighPrinter) -> list[str]:
    """The lines of a block; a loop around them if it repeats."""
    if _is_list(block):
        return _list(block, printer)
    if block.count == 1 and not block.inner:
        tables, lines = _body(block, printer)
        return [*tables, *lines]
    entering = _entering(block, printer)
    passing = [store.place.array for store in block.stores if store.place.array in entering]
    tables, lines = _body(block, printer, passing)
    return [
        *tables,
        *(printer.enter(array) for array in entering),
        f"for (int k = 0; k < {block.count}; k++) {{",
        *(f"    {line}" for line in lines),
        *(f"    {printer.advance(array)}" for array in passing),
        "}",
        *map(printer.keep, passing),
    ]


def _entering(block: Block, printer: CPrinter | HighPrinter) -> list[str]:
    """The arrays that carry something into a block."""
    arrays = dict.fromkeys(place.array for place in block.loads.values())
    return [array for array in arrays if printer.kinds[array] == "carried"]


def _is_list(block: Block) -> bool:
    """Whether a block fills an array with numbers, from the first element on."""
    if len(block.stores) <= FEW_NUMBERS or block.looped:
        return False
    array = block.stores[0].place.array
    return all(
        store.node.op == "constant" and (store.place.array, store.place.indices[0]) == (array, i)
        for i, store in enumerate(block.stores)
    )


def _list(block: Block, printer: CPrinter | HighPrinter) -> list[str]:
    """Such a block as a loop over a table, which takes less compile time than statements."""
    numbers = ", ".join(decimal(store.node.value) for store in block.stores)
    node = block.stores[0].node
    store = printer.store(block.stores[0].place.array, "k", Text(printer.listed("table[k]"), 3, 0, node), add=False)
    return [
        f"static const double table[] = {{{numbers}}};",
        f"for (int k = 0; k < {len(block.stores)}; k++) {store}",
    ]


def _body(
    block: Block, printer: CPrinter | HighPrinter, passing: Container[str] | None = None
) -> tuple[list[str], list[str]]:
    """The tables of indices of a block, and its lines for one iteration.

    Args:
        block: the block.
        printer: the rules.
        passing: in a loop, the arrays that carry a value from an iteration to the next.
    """
    indices = Indices(block)

    def put(store: Store, value: Text) -> str:
        if passing and store.place.array in passing:
            return printer.leave(store.place.array, value)
        return printer.store(store.place.array, indices.at(store.place), value, store.add)

    entering = _entering(block, printer) if passing is None else []
    lines = _fetching([*map(printer.enter, entering), *statements(block, printer, indices.of, put)])
    if block.inner:
        first, following = indices.text(block.inner.first, "k"), indices.text(block.inner.following, "i")
        lines = [f"for (int i = {first}; i >= 0; i = {following}) {{", *(f"    {line}" for line in lines), "}"]
    tables = [f"static const int {name}[] = {{{', '.join(map(str, at))}}};" for at, name in indices.tables.items()]
    return tables, lines


def _fetching(lines: list[str]) -> list[str]:
    """The lines, each after requests for what it is the first to use, of a later block of states.

    So they are spread over the computation: many at once would wait for each other.
    """
    found: list[str] = []
    seen: set[str] = set()
    for line in lines:
        new = [at for at in dict.fromkeys(re.findall(r"EOM_AT(\([^()]*\))", line)) if at not in seen]
        seen.update(new)
        found += [*(f"EOM_FETCH{at};" for at in new), line]
    return found


def table(model: Model) -> str:
    """The table of functions and the plain C interface."""
    suffixes = [TYPES[dtype] for dtype in model.dtypes]
    arithmetic = ARITHMETIC[model.accuracy]
    includes: list[str] = []
    vectors: list[str] = []
    for scalar, vector in suffixes:
        frame = {"name": model.name, "scalar": scalar}
        includes.append(template.INCLUDE.format(real=scalar, text=1, other=2, **frame))
        if vector:
            includes.append(template.INCLUDE.format(real=vector, text=0, other=1, **frame))
            vectors += [f"void {program.name}_{vector}(void);" for program in model.programs]
    entries: list[str] = []
    interfaces: list[str] = []
    for program in model.programs:
        entries.append(_entry(program, model))
        interfaces.append(_interface(program, model))
    return template.TABLE.format(
        title=model.title,
        name=model.name,
        runtime=arithmetic.runtime,
        includes="\n".join(includes),
        vectors="\n".join(vectors),
        shapes="\n".join(_shapes(program) for program in model.programs),
        entries="\n".join(entries),
        values=_wrap(", ".join(number_of(value) for value in model.p)) if model.p else "    0",
        size=max(1, len(model.p)),
        interfaces="\n".join(interfaces),
    )


def number_of(value: float) -> str:
    """A double as a C literal."""
    return decimal(Fraction(value))


def _operands(program: Program) -> list[Array]:
    return [*program.inputs, program.output]


def _shapes(program: Program) -> str:
    rows = ", ".join(str(array.shape[0]) for array in _operands(program))
    columns = ", ".join(str(array.shape[1]) if len(array.shape) > 1 else "0" for array in _operands(program))
    return (
        f"static const int {program.name}_rows[] = {{{rows}}};\n"
        f"static const int {program.name}_columns[] = {{{columns}}};"
    )


def _entry(program: Program, model: Model) -> str:
    arithmetic = ARITHMETIC[model.accuracy]
    built: list[str] = []
    for dtype, (scalar, vector) in TYPES.items():
        if dtype not in model.dtypes:
            built.append("{0, 0, 0}")
            continue
        first = f"EOM_CAST({program.name}_constants_{scalar})" if program.constants else "0"
        lanes = f"EOM_CAST({program.name}_{vector})" if vector else "0"
        built.append(f"{{{first}, EOM_CAST({program.name}_{scalar}), {lanes}}}")
    rollout = f'"{rollout_signature(program)}"' if program.name == "forward_dynamics" else "0"
    return template.ENTRY.format(
        rollout=rollout,
        name=program.name,
        signature=program.signature,
        doc='\\n\\n"\n     "'.join(help_text(program)),
        inputs=sum(array.name != "p" for array in program.inputs),
        parameters=int(program.inputs[-1].name == "p"),
        constants=arithmetic.size * program.size("constants"),
        work=arithmetic.size * program.size("work", "carried"),
        streams=STREAMS[arithmetic.streams[is_short(program)]],
        kernels=", ".join(built),
    )


def _prototype(program: Program, model: Model, batch: bool) -> str:
    arguments = ["size_t states"] if batch else []
    arguments += [f"const double *{array.name}" for array in program.inputs]
    name = f"{model.name}_{program.name}{'_batch' if batch else ''}"
    return f"void {name}({', '.join([*arguments, 'double *out'])})"


def _interface(program: Program, model: Model) -> str:
    if "float64" not in model.dtypes:
        return ""
    inputs = [array.name for array in program.inputs if array.name != "p"]
    parameters = "p" if program.inputs[-1].name == "p" else "0"
    arithmetic = ARITHMETIC[model.accuracy]
    loads: list[str] = []
    strides: list[int] = []
    for array in _operands(program):
        strides += [8] if len(array.shape) == 1 else [8 * array.shape[1], 8]
    steps = [8 * array.size if array.name != "p" else 0 for array in _operands(program)]
    arguments = [f"(char *){array.name}" for array in _operands(program)]
    if program.constants:
        loads.append(f"    {program.name}_constants_f64({parameters}, (void *)c);")
    return template.INTERFACE.format(
        prototype=_prototype(program, model, batch=False),
        batch=_prototype(program, model, batch=True),
        name=program.name,
        inputs=", ".join(inputs),
        constants=max(1, arithmetic.size * program.size("constants")),
        unused="" if program.constants else " = {0}",
        work=max(1, arithmetic.size * program.size("work", "carried")),
        loads="\n".join(loads),
        parameters=parameters,
        arguments=", ".join(arguments),
        steps=", ".join(map(str, [*steps, *strides])),
        index=[other.name for other in model.programs].index(program.name),
    )


def header(model: Model) -> str:
    """The plain C interface."""
    prototypes: list[str] = []
    for program in model.programs:
        shapes = ", ".join(f"{array.name} {'x'.join(map(str, array.shape))}" for array in _operands(program))
        prototypes.append(f"/* {program.doc}; {shapes} */")
        prototypes += [_prototype(program, model, batch) + ";" for batch in (False, True)]
    return template.HEADER.format(
        title=model.title,
        guard=f"{model.name.upper()}_EQUATIONS_H",
        name=model.name,
        size=max(1, len(model.p)),
        legend=legend(model, " * "),
        prototypes="\n".join(prototypes) if "float64" in model.dtypes else "",
    )


def _indent(lines: Iterable[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


def _wrap(text: str) -> str:
    return "\n".join(textwrap.wrap(text, 110, initial_indent="    ", subsequent_indent="    "))
