"""From a scene to an importable module, stage by stage."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from eomgen import backends, choice, delivery, frontends, functions, passes, regularity, sensitivity
from eomgen.backends import cache
from eomgen.backends.package import BELONGS_TO
from eomgen.errors import OptionError, UnsupportedError, shown, unknown
from eomgen.frontends.mechanism import Mechanism, MechanismEquations
from eomgen.ir.count import program_operations
from eomgen.ir.equations import Equations
from eomgen.ir.program import Program
from eomgen.model import Model
from eomgen.scene import Scene
from eomgen.version import __version__

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
    kinds = check_dtypes(dtypes)
    _check_accuracy(accuracy, backend, kinds)
    if isinstance(scene, Equations):
        _check_equations(scene, method, fold)
    place = delivery.check_out(out, force)
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
            delivery.deliver(built_folder, place, force)
    with watch.stage("load"):
        module = delivery.import_cached(name) if place is None else delivery.import_from(place)
    module.info = {**module.info, "seconds": dict(watch.seconds)}  # type: ignore[attr-defined]
    return module


def on_request(module: ModuleType, name: str) -> Any:
    """A function (or a fact that belongs to one) that a compiled module does not have yet, compiled now.

    Args:
        module: a module of a scene.
        name: "jacobian", "parameter_jacobian", "regressor", or "b" and "b_names" of the regressor.
    """
    function = BELONGS_TO.get(name, name)
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


def _check_equations(equations: Equations, method: str, fold: bool) -> None:
    """Refuses options of `compile` that equations have settled; its default method says nothing."""
    frontends.check_method(method)
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


def check_dtypes(dtypes: Sequence[str]) -> tuple[str, ...]:
    """Number types once each, the narrowest first.

    Raises:
        OptionError: there is no such type, or none is given.
    """
    chosen = [dtypes] if isinstance(dtypes, str) else [str(dtype) for dtype in dtypes]
    for dtype in chosen:
        if dtype not in DTYPES:
            raise OptionError(unknown("dtype", dtype, DTYPES))
    if not chosen:
        raise OptionError(f"no dtype requested; allowed: {', '.join(DTYPES)}")
    return tuple(sorted(set(chosen), key=("float32", "float64", "longdouble").index))
