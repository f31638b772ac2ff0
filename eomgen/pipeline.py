"""From a scene to an importable module, stage by stage."""

from __future__ import annotations

import importlib
import importlib.util
import keyword
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from eomgen import backends, choice, frontends, functions, passes, regularity, sensitivity
from eomgen.backends import cache
from eomgen.errors import OptionError, UnsupportedError, one_line, shown, unknown
from eomgen.frontends.mechanism import Mechanism, MechanismEquations
from eomgen.ir.count import program_operations
from eomgen.ir.equations import Equations
from eomgen.ir.program import Program
from eomgen.model import Model
from eomgen.scene import Scene
from eomgen.version import __version__

LONGEST_NAME = 100
_LOADED: dict[Path, int] = {}  # packages outside the cache, and how often they were loaded again
METHOD = "matrix"  # unless another is asked for
DTYPES = ("float64", "float32", "longdouble")
ACCURACIES = ("fast", "standard", "high")


Progress = Callable[[str], None]


@dataclass
class Stopwatch:
    """Seconds per stage; `progress` hears of each stage when it starts."""

    progress: Progress | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        if self.progress:
            self.progress(name)
        start = time.perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start


def derive(scene: Scene, method: str = METHOD, fold: bool = False) -> Equations:
    """The equations of motion of a scene.

    Args:
        scene: the scene.
        method: "lagrange", "recursive", "matrix" or "articulated".
        fold: put the scene's numbers in place of parameters.

    Raises:
        OptionError: what is given is no scene, or there is no such method.
    """
    if not isinstance(scene, Scene):
        advice = "use eomgen.load_scene(path) for a file, eomgen.Scene.from_dict(table) for a dictionary"
        raise OptionError(f"{shown(scene)} is no scene; {advice}")
    _check_method(method)
    return frontends.derive(Mechanism(scene, fold), method)


def programs(
    equations: Equations,
    names: Sequence[str] | None = None,
    loops: bool | None = None,
    solver: str = "auto",
) -> tuple[Program, ...]:
    """The programs of some functions (default: all), after the passes.

    Args:
        equations: the equations.
        names: the functions.
        loops: emit loops over links; None decides by the number of links.
        solver: the elimination of forward dynamics, see `compile`.

    Raises:
        OptionError: the equations do not have a function of that name, or cannot be written as loops.
    """
    chosen = functions.select(equations, names)
    return tuple(passes.run(program) for program in choice.programs(equations, chosen, loops, solver))


def compile(
    scene: Scene | Equations,
    method: str = METHOD,
    backend: str = "c",
    out: str | os.PathLike[str] | None = None,
    fold: bool = False,
    dtypes: Sequence[str] = ("float64",),
    functions: Sequence[str] | None = None,
    *,
    force: bool = False,
    portable: bool = False,
    loops: bool | None = None,
    solver: str = "auto",
    accuracy: str = "standard",
    progress: Progress | None = None,
) -> ModuleType:
    """Compiles a scene (or equations) into a module and imports it.

    Args:
        scene: the scene, or equations from `derive` or `lagrangian`, which have a method and a fold of their own.
        method: the method of derivation; of equations their own, or left out.
        backend: "c" or "numpy"; both give the same functions.
        out: a folder to write the package to; it then imports without eomgen. Without, it lives in the cache.
        fold: compile the scene's numbers in; p then has length 0. Equations with parameters do not allow it.
        dtypes: among "float64", "float32", "longdouble"; each function dispatches on the type of its arguments.
        functions: names of the functions to build, default all.
        force: replace the package that stands in `out`.
        portable: build for any processor of this architecture, not for this machine's.
        loops: emit loops over links, those of the recursion whatever the method; False keeps the formulas of the
            method; None decides by the number of links.
        solver: the elimination in forward dynamics: "dense" solves M a = Q - h of the chosen method, "articulated"
            walks along the links, "auto" takes the one with fewer operations per state.
        accuracy: the arithmetic of the C between arguments and results in float64: "standard" is float64 too, "high"
            twice its precision, "fast" float32; `docs/accuracy.md` tells what each costs and gives.
        progress: called with the name of each stage when it starts.

    Returns:
        The module; `docs/modules.md` describes it.

    Raises:
        OptionError: what is given is no scene, an option has no such value, or `out` exists.
        UnsupportedError: scene and options are valid but cannot be combined, or `out` has the name of a library.
        SingularError: the mass matrix is singular in every state.
        BuildError: no compiler, or it failed.
    """
    watch = Stopwatch(progress)
    target = backends.select(backend)
    kinds = _dtypes(dtypes)
    _check_accuracy(accuracy, backend, kinds)
    if isinstance(scene, Equations):
        _check_equations(scene, method, fold)
    place = _check_out(out, force)
    with watch.stage("derive"):
        equations = scene if isinstance(scene, Equations) else derive(scene, method, fold)
        built = programs(equations, functions, loops, solver)
        regularity.check(equations)
    with watch.stage("emit"):
        options = {"loops": loops, "solver": solver, "portable": portable, "accuracy": accuracy}
        model = describe(equations, built, kinds, {**target.facts(portable, built), "options": options}, accuracy)
        files = target.emit(model)
    key = cache.digest([__version__, backend, *files, *files.values(), *target.environment(portable)])
    name = f"{model.name}_{key}"

    def make(folder: Path) -> None:
        cache.write(folder, files)
        target.build(folder, model, portable)

    with watch.stage("build"):
        built_folder = cache.publish(cache.folder() / "models" / name, make)
        if place is not None:
            _deliver(built_folder, place, force)
    with watch.stage("load"):
        module = _import_cached(name) if place is None else _import_from(place)
    module.info = {**module.info, "seconds": dict(watch.seconds)}  # type: ignore[attr-defined]
    return module


def on_request(module: ModuleType, name: str) -> Any:
    """A function (or a fact that belongs to one) that a compiled module does not have yet, compiled now.

    Args:
        module: a module of a scene.
        name: "jacobian", "parameter_jacobian", "regressor", or "b" and "b_names" of the regressor.
    """
    function = "regressor" if name in ("b", "b_names") else name
    scene = Scene.from_dict(module.scene)
    fold, dtypes, options = not len(module.p), module.info["dtypes"], module.info["options"]
    built = compile(scene, module.method, module.backend, None, fold, dtypes, [function], **options)
    return getattr(built, name)


def describe(
    equations: Equations,
    built: tuple[Program, ...],
    dtypes: tuple[str, ...],
    facts: dict[str, Any],
    accuracy: str = "standard",
) -> Model:
    """Everything a back end writes down, the same for the same scene and options."""
    symbols = equations.symbols
    scene: Scene | None = equations.mechanism.scene if isinstance(equations, MechanismEquations) else None
    name = scene.name if scene else "system"
    if name.startswith("eomgen_"):  # the names of the runtime's files
        name = f"scene_{name}"
    if scene:
        names = {f"{kind}_names": getattr(scene, f"{kind}_names") for kind in "qvuw"}
    else:
        names = {f"{kind}_names": tuple(node.name for node in getattr(symbols, kind)) for kind in "qvu"}
        names["w_names"] = ()
    names["p_names"] = tuple(node.name for node in symbols.p)
    facts_of_b: dict[str, Any] = {}
    if any(program.name == "regressor" for program in built):
        linear = sensitivity.regressor(equations)
        facts_of_b = {"b_names": tuple(linear.names), "b": tuple(linear.values)}
    info = {
        "eomgen": __version__,
        "dtypes": dtypes,
        "forms": {program.name: program.form for program in built if program.form},
        "operations": {
            program.name: {rate: dict(sorted(kinds.items())) for rate, kinds in program_operations(program).items()}
            for program in built
        },
        **facts,
    }
    return Model(
        name=name,
        title=f"{name}: equations of motion by the {equations.method} method (eomgen {__version__})",
        programs=built,
        names=names,
        p=symbols.p_values,
        facts={"scene": scene.to_dict() if scene else {}, "method": equations.method, "info": info, **facts_of_b},
        dtypes=dtypes,
        accuracy=accuracy,
        available=tuple(functions.available(equations)),
    )


def _check_method(method: str) -> None:
    if not isinstance(method, str) or method not in frontends.METHODS:
        raise OptionError(unknown("method", method, frontends.METHODS))


def _check_equations(equations: Equations, method: str, fold: bool) -> None:
    """Refuses options of `compile` that equations have settled; its default method says nothing."""
    _check_method(method)
    if method not in (METHOD, equations.method):
        raise UnsupportedError(
            f"method {method!r} is not that of the equations, {equations.method!r}; leave it out, or derive with it"
        )
    if fold and equations.p:
        advice = "give fold to eomgen.derive"
        if not isinstance(equations, MechanismEquations):
            advice = "write the numbers into the energies"
        raise UnsupportedError(f"fold=True comes too late for equations with {len(equations.p)} parameters; {advice}")


def _check_accuracy(accuracy: str, backend: str, dtypes: tuple[str, ...]) -> None:
    if accuracy not in ACCURACIES:
        raise OptionError(unknown("accuracy", accuracy, ACCURACIES))
    if accuracy != "standard" and backend != "c":
        raise OptionError(f"accuracy {accuracy!r} needs the C back end, not {backend!r}; allowed there: standard")
    if accuracy != "standard" and dtypes != ("float64",):
        raise OptionError(
            f"accuracy {accuracy!r} is for arguments in float64, not {', '.join(dtypes)}; "
            "leave dtypes out, or use accuracy 'standard'"
        )


def _dtypes(dtypes: Sequence[str]) -> tuple[str, ...]:
    chosen = [dtypes] if isinstance(dtypes, str) else [str(dtype) for dtype in dtypes]
    for dtype in chosen:
        if dtype not in DTYPES:
            raise OptionError(unknown("dtype", dtype, DTYPES))
    if not chosen:
        raise OptionError(f"no dtype requested; allowed: {', '.join(DTYPES)}")
    return tuple(sorted(set(chosen), key=("float32", "float64", "longdouble").index))


def _check_out(out: str | os.PathLike[str] | None, force: bool) -> Path | None:
    """The absolute output folder, checked before any work is done."""
    if out is None:
        return None
    try:
        path = Path(out).expanduser().absolute()
    except RuntimeError:
        raise OptionError(f"output folder {one_line(str(out), 200)}: there is no such user") from None
    shown = one_line(str(path), 200)
    if len(path.name) > LONGEST_NAME:
        raise OptionError(f"output folder {shown}: a name has at most {LONGEST_NAME} characters")
    if not path.name.isidentifier() or keyword.iskeyword(path.name) or not path.name.isascii():
        raise OptionError(
            f"output folder {shown}: {one_line(path.name)!r} is no module name; use letters, digits and underscores"
        )
    _check_free(path)
    if path.exists():
        if not force:
            raise OptionError(f"output folder {shown} exists; use --force (force=True) to replace it")
        if not _is_package_of_ours(path):
            raise OptionError(f"output folder {shown} is no package written by eomgen; it is not replaced")
    elif not path.parent.is_dir():
        raise OptionError(f"output folder {shown}: the folder {one_line(str(path.parent), 200)} does not exist")
    if not os.access(path.parent, os.W_OK):
        raise OptionError(f"output folder {shown}: {one_line(str(path.parent), 200)} cannot be written")
    return path


def _check_free(place: Path) -> None:
    """Refuses a folder whose module would take the name of another library's; one of ours makes way."""
    name = place.name
    advice = "write to a folder of another name"
    if name in sys.stdlib_module_names:
        raise UnsupportedError(f"a module named {name!r} is part of Python; {advice}")
    if name in {loaded.name for loaded in _LOADED}:
        return
    if name in sys.modules:
        raise UnsupportedError(f"a module named {name!r} is already imported; {advice}")
    spec = importlib.util.find_spec(name)
    if spec is None or not spec.has_location or spec.origin is None:  # None: a folder that is no package
        return
    found, here = Path(spec.origin).resolve(), place.parent.resolve()
    if found.parent not in (here, here / name) and not _is_package_of_ours(found.parent):
        raise UnsupportedError(f"a module named {name!r} exists already ({one_line(str(found), 200)}); {advice}")


def _is_package_of_ours(path: Path) -> bool:
    init = path / "__init__.py"
    return path.is_dir() and init.is_file() and "(eomgen " in init.read_text(encoding="utf-8", errors="replace")[:2000]


def _deliver(source: Path, place: Path, force: bool) -> None:
    """Copies a finished package to its place in one step; nobody sees half of it."""
    try:
        private = Path(tempfile.mkdtemp(prefix=f".{place.name}-", dir=place.parent))
    except OSError as error:
        raise OptionError(f"output folder {one_line(str(place), 200)} cannot be written ({error.strerror})") from None
    try:
        shutil.copytree(source, private / "new", ignore=shutil.ignore_patterns("__pycache__"))
        replaced = force and place.exists()
        if replaced:
            place.rename(private / "old")
        try:
            (private / "new").rename(place)
        except OSError:
            if replaced:
                (private / "old").rename(place)
            raise
    except OSError as error:
        raise OptionError(f"output folder {one_line(str(place), 200)} cannot be written ({error.strerror})") from None
    finally:
        shutil.rmtree(private, ignore_errors=True)


def _import_cached(name: str) -> ModuleType:
    from eomgen import models

    models.__path__ = [str(cache.folder() / "models")]
    importlib.invalidate_caches()
    return importlib.import_module(f"eomgen.models.{name}")


def _import_from(place: Path) -> ModuleType:
    """Imports the package at a path under its folder's name, leaving `sys.path` as it is."""
    name = place.name
    # The dynamic loader knows a library by its path; another spelling makes it read a replaced one.
    again = _LOADED[place] = _LOADED.get(place, -1) + 1
    folder = str(place) + "/." * again
    for loaded in [key for key in sys.modules if key == name or key.startswith(f"{name}.")]:
        del sys.modules[loaded]
    importlib.invalidate_caches()
    spec = importlib.util.spec_from_file_location(name, place / "__init__.py", submodule_search_locations=[folder])
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
