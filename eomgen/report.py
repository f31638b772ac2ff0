"""What the command line prints: plain text for people."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import ModuleType

from eomgen import backends, pipeline
from eomgen.certify import Certificate
from eomgen.errors import UnsupportedError
from eomgen.functions import FUNCTIONS
from eomgen.ir.count import program_operations
from eomgen.ir.equations import Equations
from eomgen.ir.program import Program
from eomgen.ir.text import dump
from eomgen.scene import Scene
from eomgen.verification import Verification


def progress(text: str) -> None:
    """Shows what is being done on a terminal; the line is overwritten by the next."""
    _status(f"{text} ...")


def clear() -> None:
    """Takes that away."""
    _status("")


@contextmanager
def progressing() -> Iterator[pipeline.Progress]:
    """`progress` for some work, taken away when it ends or fails."""
    try:
        yield progress
    finally:
        clear()


def _status(text: str) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\x1b[K{text}")
        sys.stderr.flush()


def table(rows: Sequence[Sequence[str]], header: Sequence[str]) -> str:
    """Columns as wide as they must be; all but the first are aligned to the right."""
    cells = [list(header), *map(list, rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(header))]
    lines = [
        "  ".join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in cells
    ]
    return "\n".join([lines[0], "  ".join("-" * width for width in widths), *lines[1:]])


def compiled(module: ModuleType, in_cache: bool) -> str:
    """Where a module is, what it offers, how long it took, and three lines that run."""
    info, folder = module.info, os.path.dirname(module.__file__ or "")
    rows = [
        [
            name,
            getattr(module, name).signature,
            str(sum(counts["state"].values())),
            str(sum(counts["parameters"].values())),
        ]
        for name, counts in info["operations"].items()
    ]
    n = len(module.q_names)
    lines = [
        f"module    {folder}",
        f"scene     {module.scene.get('name', 'user system')}: {n} coordinates, {len(module.p)} parameters; "
        f"method {module.method}, back end {module.backend}",
        "seconds   " + ", ".join(f"{stage} {seconds:.3f}" for stage, seconds in info["seconds"].items()),
        *(f"form      {', '.join(names)}: {form}" for form, names in _by_form(info["forms"]).items()),
        "",
        table(rows, ["function", "signature", "operations per state", "per parameter set"]),
        "",
    ]
    name = module.__name__ if in_cache else os.path.basename(folder)
    where = "" if in_cache else f"    # from {os.path.dirname(folder)}"
    function = next(iter(info["operations"]))  # forward_dynamics, if it was built
    letters, values = _arguments(module, function)
    call = [*letters, "model.p"] if FUNCTIONS[function].parameters else letters
    lines += [
        "try it:",
        f"  import numpy, {name} as model{where}",
        f"  {', '.join(letters)} = {', '.join(values)}",
        f"  print(model.{function}({', '.join(call)}))",
    ]
    return "\n".join(lines)


def _arguments(module: ModuleType, function: str) -> tuple[list[str], list[str]]:
    """The letters of a function's arguments before p, and the Python that makes a value of each, of a type built."""
    dtype = "float64" if "float64" in module.info["dtypes"] else module.info["dtypes"][0]
    n, k = len(module.q_names), len(module.w_names)
    of = str(n) if dtype == "float64" else f"{n}, {dtype!r}"
    row = "[1.0, 0.0, 0.0]" if dtype == "float64" else f"numpy.{dtype}([1, 0, 0])"
    values = dict.fromkeys("vau", f"numpy.zeros({of})")
    values |= {"q": f"numpy.ones({of})", "w": f"numpy.tile({row}, ({k}, 1))"}
    letters = [letter for letter in FUNCTIONS[function].arguments if letter != "w" or k]
    return letters, [values[letter] for letter in letters]


def _by_form(forms: dict[str, str]) -> dict[str, list[str]]:
    """The functions of every form."""
    found: dict[str, list[str]] = {}
    for name, form in forms.items():
        found.setdefault(form, []).append(name)
    return found


def shown_equations(
    scene: Scene, method: str, names: Sequence[str] | None, kind: str, loops: bool | None = None, solver: str = "auto"
) -> str:
    """The equations of a scene: "text", "latex", "c" or "python"."""
    equations = pipeline.derive(scene, method)
    if kind == "latex":
        return latex(equations)
    built = pipeline.programs(equations, names, loops, solver)
    if kind in ("c", "python"):
        back_end = "c" if kind == "c" else "numpy"
        model = pipeline.describe(equations, built, ("float64",), {})
        files = backends.select(back_end).emit(model)
        return files[f"csrc/{model.name}_kernels.h" if kind == "c" else "_kernel.py"].rstrip()
    return "\n\n".join([_symbols(equations, scene), _counts(built), *(dump(program) for program in built)])


def _symbols(equations: Equations, scene: Scene) -> str:
    units = equations.symbols.units
    lines = [f"{scene.name}: {len(scene.links)} links, {len(equations.q)} coordinates, method {equations.method}"]
    groups = {"q": equations.q, "u": equations.u, "w": [row[0] for row in equations.w], "p": equations.p}
    others = [letter for letter in "wp" if groups[letter]]
    lines.append(f"M({', '.join(['q', *others])}) a + h({', '.join(['q', 'v', *others])}) = Q(u)")
    for letter, nodes in groups.items():
        lines += [
            f"  {letter}[{i}]  {node.name}" + (f" ({units[node]})" if node in units else "")
            for i, node in enumerate(nodes)
        ]
    return "\n".join(lines)


def _counts(built: Sequence[Program]) -> str:
    kinds = ("add", "sub", "mul", "div", "pivot_inverse", "sin", "cos")
    rows = []
    for program in built:
        counts = program_operations(program)
        state = counts["state"]
        rows.append(
            [program.name, *(str(state[kind]) for kind in kinds), str(state.total()), str(counts["parameters"].total())]
        )
    return table(rows, ["operations", *kinds[:4], "pivot", *kinds[5:], "per state", "per parameter set"])


def latex(equations: Equations) -> str:
    """M and h in LaTeX, written out without shared subexpressions, with sines and cosines of differences of angles.

    Raises:
        UnsupportedError: SymPy is missing, or there are more than 8 coordinates.
    """
    from eomgen.symbolic import import_sympy, to_sympy

    n = len(equations.q)
    if n > 8:
        raise UnsupportedError(f"LaTeX of {n} coordinates would fill pages; allowed: up to 8; use plain show instead")
    sympy = import_sympy()
    from sympy.simplify.fu import TR10i

    names = {}
    for link in getattr(getattr(equations, "mechanism", None), "links", []):
        tag = link.name.replace("_", r"\_")
        for attribute, letter in (
            ("angle", r"\varphi"),
            ("rate", r"\dot{\varphi}"),
            ("length", "s"),
            ("length_rate", r"\dot{s}"),
            ("length_acceleration", r"\ddot{s}"),
        ):
            node = getattr(link, attribute)
            if node.op == "symbol":
                names[node.name] = sympy.Symbol(rf"{letter}_{{\mathrm{{{tag}}}}}", real=True)
    names["gravity"] = sympy.Symbol("g", real=True)
    for node in equations.p:
        if node.name not in names:
            text = node.name.replace("_", r"\_")
            names[node.name] = sympy.Symbol(rf"\mathrm{{{text}}}", real=True)
    nodes = [*(node for row in equations.mass_matrix for node in row), *equations.bias]
    written = list(map(TR10i, to_sympy(nodes, names)))
    mass, bias = sympy.Matrix(n, n, written[: n * n]), sympy.Matrix(n, 1, written[n * n :])
    return f"M = {sympy.latex(mass)}\n\nh = {sympy.latex(bias)}"


def verification(result: Verification) -> str:
    """The tables of `eomgen verify`."""
    methods = list(result.programs)
    rows = [
        [quantity, *("identical" if same else "DIFFERENT" for same in row.values())]
        for quantity, row in result.identical.items()
    ]
    rows.append(["programs after passes", *("identical" if kept else "DIFFERENT" for kept in result.programs.values())])
    exact = table(rows, ["the same function, exactly", *methods])
    columns = sorted({item.backend for item in result.measured})
    names = list(dict.fromkeys(item.function for item in result.measured))
    errors = []
    for name in names:
        cells = []
        for method in methods:
            for backend in columns:
                (item,) = [m for m in result.measured if (m.function, m.method, m.backend) == (name, method, backend)]
                cells.append(f"{item.error:.2g}" + ("" if item.passed else " FAILED"))
        (bound,) = [
            m.bound for m in result.measured if (m.function, m.method, m.backend) == (name, methods[0], columns[0])
        ]
        errors.append([name, *cells, f"{bound:.3g}"])
    heading = [f"{method}/{backend}" for method in methods for backend in columns]
    measured = table(errors, ["largest error, eps", *heading, "bound"])
    verdict = "all checks passed" if result.passed else f"{result.failures} of {result.checks} checks FAILED"
    return f"{exact}\n\n{measured}\n\n{result.scene}: {verdict}"


def certificates(found: Sequence[Certificate]) -> str:
    """For each type a table of forward dynamics by case, and one of the other functions in their worst cases."""
    parts = []
    for dtype in dict.fromkeys(item.dtype for item in found):
        items = [item for item in found if item.dtype == dtype]
        solved = [item for item in items if item.function == "forward_dynamics"]
        if solved:
            cases = {name: [item for item in solved if item.case == name] for name in _ordered(solved, "case")}
            parts.append(_errors(f"forward dynamics, eps of {dtype}", cases))
        others = [item for item in items if item.function != "forward_dynamics"]
        if others:
            worst = {}
            for name in _ordered(others, "function"):
                own = [item for item in others if item.function == name]
                case = max(own, key=lambda item: item.scaled / item.bound).case
                worst[f"{name} ({case})"] = [item for item in own if item.case == case]
            parts.append(_errors("other functions, each in its worst case", worst))
    backends = ", ".join(_ordered(found, "backend"))
    failed = sum(not item.passed for item in found)
    explained = sum(item.passed and item.bound < item.scaled < math.inf for item in found)
    verdict = f"{len(found)} errors, {explained} above the target but explained, {failed} FAILED"
    notes = f"Each error is the larger one of {backends}. ~: above the target, explained by how the method is written."
    return "\n\n".join([*parts, notes, f"certified errors: {verdict}"])


def _ordered(found: Sequence[Certificate], attribute: str) -> list[str]:
    return list(dict.fromkeys(getattr(item, attribute) for item in found))


def _errors(title: str, groups: Mapping[str, Sequence[Certificate]]) -> str:
    """A row for each group: the largest error of each method, beside what is possible and the target."""
    methods = list(dict.fromkeys(item.method for items in groups.values() for item in items))
    rows = []
    for name, items in groups.items():
        bound, cells = min(item.bound for item in items), []
        for method in methods:
            own = [item for item in items if item.method == method]
            largest = max((item.scaled for item in own), default=0.0)
            mark = " FAILED" if not all(item.passed for item in own) else "~" if bound < largest < math.inf else ""
            cells.append((f"{largest:.2g}" if largest < math.inf else "NaN") + mark if own else "-")
        possible = min(item.possible for item in items)
        rows.append([name, *cells, f"{items[0].mass_condition:.2g}", f"{possible:.2g}", f"{bound:.2g}"])
    return table(rows, [title, *methods, "κ(M)", "possible", "target"])
