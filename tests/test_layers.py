"""The layers: reads the imports of eomgen and fails on one that points up or sideways.

A name is a module of the package's top level or a folder; what it may import is listed below it in `MAY_IMPORT`. A
new module has to be entered there.
"""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "eomgen"

# The lowest first: every name may import names above its own line only, and of those the ones listed.
MAY_IMPORT: dict[str, set[str]] = {
    "version": set(),
    "errors": set(),
    "ir": {"errors"},
    "scene": {"errors"},
    "scene_file": {"errors", "scene"},
    "links": {"scene"},
    "catalog": {"errors", "scene"},
    "hard": {"catalog", "scene"},
    "model": {"ir"},
    "passes": {"ir"},
    "backends": {"errors", "ir", "model"},
    "models": {"backends", "errors"},
    "frontends": {"errors", "ir", "links", "scene"},
    "sensitivity": {"errors", "frontends", "ir"},
    "linearised": {"frontends", "ir", "scene"},
    "functions": {"errors", "ir", "sensitivity"},
    "regularity": {"errors", "frontends", "ir"},
    "symbolic": {"errors", "frontends", "ir"},
    "looped": {"frontends", "linearised", "scene"},
    "loops": {"frontends", "functions", "ir", "linearised", "looped", "scene"},
    "choice": {"passes", "errors", "frontends", "functions", "ir", "looped", "loops"},
    "delivery": {"backends", "errors", "models"},
    "pipeline": {
        "backends",
        "choice",
        "delivery",
        "errors",
        "frontends",
        "functions",
        "ir",
        "model",
        "passes",
        "regularity",
        "scene",
        "sensitivity",
        "version",
    },
    "verification": {"errors", "frontends", "functions", "hard", "ir", "pipeline", "scene"},
    "certify": {"errors", "frontends", "functions", "hard", "ir", "looped", "pipeline", "scene"},
    "report": {
        "backends",
        "certify",
        "errors",
        "frontends",
        "functions",
        "ir",
        "pipeline",
        "scene",
        "symbolic",
        "verification",
    },
    "cli": {
        "catalog",
        "certify",
        "errors",
        "hard",
        "pipeline",
        "report",
        "scene",
        "scene_file",
        "verification",
        "version",
    },
    "__main__": {"cli"},
    "__init__": {"catalog", "errors", "frontends", "pipeline", "scene", "scene_file", "symbolic", "version"},
}

# Inside a folder: modules that all others of it may import. `__init__` may import every module.
SHARED = {"frontends": {"mechanism"}, "passes": set(), "backends": {"cache", "package"}}
HEAVY = {"Cython", "flint", "matplotlib", "mpmath", "scipy", "sympy"}


class Import(NamedTuple):
    """An import statement: who imports what, and whether it runs when the module is loaded."""

    source: str
    target: str
    line: int
    at_load: bool

    def __str__(self) -> str:
        return f"{self.source} imports {self.target} (line {self.line})"


def modules() -> dict[str, Path]:
    """The modules of the package by dotted name; what emitted packages bring along is none of them."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if "runtime" not in parts:
            found[".".join(parts)] = path
    return found


def imports(source: str, path: Path) -> Iterator[Import]:
    """Every import of a module, with `from x import y` as x.y where that is a module."""
    known = modules()

    def resolve(name: str) -> str:
        return f"{name}.__init__" if f"{name}.__init__" in known else name

    def visit(node: ast.AST, at_load: bool) -> Iterator[Import]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Import):
                yield from (Import(source, resolve(alias.name), child.lineno, at_load) for alias in child.names)
            elif isinstance(child, ast.ImportFrom):
                assert child.level == 0, f"{source}, line {child.lineno}: a relative import"
                for alias in child.names:
                    full = resolve(f"{child.module}.{alias.name}")
                    yield Import(source, full if full in known else resolve(str(child.module)), child.lineno, at_load)
            else:
                later = isinstance(child, (ast.FunctionDef, ast.Lambda)) or _is_type_checking(child)
                yield from visit(child, at_load and not later)

    yield from visit(ast.parse(path.read_text(encoding="utf-8")), True)


def _is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


ALL = [item for source, path in modules().items() for item in imports(source, path)]
OURS = [item for item in ALL if item.target.split(".")[0] == "eomgen"]


def unit(module: str) -> str:
    """The name of a module in `MAY_IMPORT`."""
    return module.split(".")[1]


def inner(module: str) -> str:
    """The module's place in its folder: its name, or that of the folder it stands in."""
    return module.split(".")[2]


def text(items: list[Import]) -> str:
    return "\n".join(map(str, items))


def test_every_module_has_its_layer() -> None:
    assert sorted({unit(module) for module in modules()}) == sorted(MAY_IMPORT)


def test_the_layers_are_in_order() -> None:
    below: set[str] = set()
    for name, allowed in MAY_IMPORT.items():
        assert allowed <= below, name
        below.add(name)


def test_imports_point_down() -> None:
    wrong = [item for item in OURS if unit(item.target) not in {unit(item.source), *MAY_IMPORT[unit(item.source)]}]
    assert not wrong, text(wrong)


@pytest.mark.parametrize("folder", SHARED)
def test_neighbours_do_not_import_each_other(folder: str) -> None:
    """Methods, passes and back ends meet only in what they share."""
    wrong = [
        item
        for item in OURS
        if unit(item.source) == unit(item.target) == folder
        and inner(item.source) not in ("__init__", inner(item.target))
        and inner(item.target) not in SHARED[folder]
    ]
    assert not wrong, text(wrong)


@pytest.mark.parametrize("folder", SHARED)
def test_what_is_shared_imports_no_neighbour(folder: str) -> None:
    wrong = [
        item
        for item in OURS
        if unit(item.source) == unit(item.target) == folder
        and inner(item.source) in SHARED[folder]
        and inner(item.target) not in SHARED[folder]
    ]
    assert not wrong, text(wrong)


def test_symbolic_knows_one_method_only() -> None:
    used = {item.target for item in OURS if unit(item.source) == "symbolic" and unit(item.target) == "frontends"}
    assert used == {"eomgen.frontends.lagrange"}


def test_lagrange_borrows_nothing() -> None:
    """It knows the scene as symbols and how to differentiate: no formula of another method."""
    used = {item.target for item in OURS if item.source == "eomgen.frontends.lagrange"}
    assert {unit(name) for name in used} == {"frontends", "ir"}
    assert {name for name in used if unit(name) == "frontends"} == {"eomgen.frontends.mechanism"}


def test_no_cycles() -> None:
    """Modules can be put in an order in which each imports earlier ones only."""
    needs = {module: {item.target for item in OURS if item.source == module} for module in modules()}
    placed: set[str] = set()
    while ready := [module for module in needs if module not in placed and needs[module] <= placed]:
        placed.update(ready)
    assert sorted(set(needs) - placed) == []


def test_imports_exist() -> None:
    """The targets are resolved: none points to a module that is not there."""
    assert not [str(item) for item in OURS if item.target not in modules()]


def test_nothing_heavy_is_imported_at_once() -> None:
    """Packages that only some commands need are imported where they are used."""
    wrong = [item for item in ALL if item.at_load and item.target.split(".")[0] in HEAVY]
    assert not wrong, text(wrong)


def test_the_command_line_starts_light() -> None:
    """`eomgen --help` loads nothing but the standard library, and of it what argparse needs."""
    light = ("eomgen.cli", "eomgen.__init__", "eomgen.__main__", "eomgen.version", "eomgen.errors")
    wrong = [
        item
        for item in ALL
        if item.at_load and item.source in light and item.target.split(".")[0] in {"numpy", "msgspec", *HEAVY}
    ]
    wrong += [item for item in OURS if item.at_load and item.source in light and item.target not in light]
    assert not wrong, text(wrong)


COPIED = [PACKAGE / "backends" / name for name in ("_condition.py", "_rollout.py")]
EMITTED = sorted([*PACKAGE.glob("backends/*/runtime/*.py"), *COPIED])


@pytest.mark.parametrize("path", EMITTED, ids=lambda path: path.name)
def test_emitted_packages_need_numpy_only(path: Path) -> None:
    """What is copied into packages never imports eomgen, and to load needs NumPy and the standard library."""
    found = list(imports(path.name, path))
    assert not [str(item) for item in found if item.target.split(".")[0] == "eomgen"]
    loaded = {item.target.split(".")[0] for item in found if item.at_load}
    assert loaded <= {"numpy", *sys.stdlib_module_names}
