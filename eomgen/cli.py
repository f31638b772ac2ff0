"""The command line: arguments in, the library called, an error to one line and an exit code.

Nothing heavy is imported before it is needed, so `--help` answers at once.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from eomgen.scene import Scene

EXAMPLES = {
    "": """\
examples:
  eomgen compile --links 5 --method matrix       the paper's five-link chain, into the cache
  eomgen compile walker.toml --out walker5       a scene of your own, as a package that stands alone
  eomgen show walker.toml                        its equations and operation counts
  eomgen verify walker.toml                      prove that all methods and back ends agree

exit codes: 0 fine, 1 a check failed, 2 bad input, 3 a build failed""",
    "compile": """\
examples:
  eomgen compile --links 5 --method matrix
  eomgen compile --links 20 --model rigid --method articulated --backend numpy
  eomgen compile walker.toml --method lagrange --out walker5
  eomgen compile walker.toml --functions forward_dynamics,energy --fold
  eomgen compile walker.toml --accuracy high     results right to the last digits, at several times the cost""",
    "show": """\
examples:
  eomgen show --links 2 --model rigid            coordinates, equations, operation counts
  eomgen show walker.toml --method lagrange --latex
  eomgen show walker.toml --c                    the C that would be compiled""",
    "verify": """\
examples:
  eomgen verify walker.toml
  eomgen verify --links 3 --model telescopic --backend numpy
  eomgen verify walker.toml --certify --dtypes float64,float32 --json errors.json
  eomgen verify --hard                           certified errors over the catalogue of hard cases""",
    "bench": """\
examples:
  eomgen bench table1 --links 1..50              generation times beside the published ones
  eomgen bench table1 --help                     the options of a suite""",
}


class _Parser(argparse.ArgumentParser):
    """Argument errors in the one-line form of all others."""

    def error(self, message: str) -> NoReturn:
        from eomgen.errors import one_line

        sys.stderr.write(f"eomgen: error: {one_line(message, 600)}; see {self.prog} --help\n")
        sys.exit(2)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command line and returns the exit code; every error a user can cause is one line."""
    words = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in words
    if isinstance(sys.stdout, io.TextIOWrapper):  # a path may have letters that the terminal does not
        sys.stdout.reconfigure(errors="backslashreplace")
    from eomgen.errors import EomgenError

    try:
        return run([word for word in words if word != "--debug"])
    except EomgenError as error:
        if debug:
            import traceback

            traceback.print_exc()
        else:
            print(f"eomgen: error: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("eomgen: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        sys.stderr.close()
        return 0


def run(arguments: list[str]) -> int:
    """Parses the arguments and runs the command; errors pass through."""
    if arguments[:1] == ["--version"]:
        from eomgen.version import __version__

        print(f"eomgen {__version__}")
        return 0
    if arguments[:1] == ["bench"] and len(arguments) > 1 and arguments[1] not in ("-h", "--help"):
        return bench(arguments[1], arguments[2:])
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.command is None:
        parser.print_help()
        return 0
    return int({"compile": compile_, "show": show, "verify": verify}[options.command](options))


def _parser() -> argparse.ArgumentParser:
    raw = argparse.RawDescriptionHelpFormatter
    parser = _Parser(
        prog="eomgen",
        description="Compiles planar trees of rigid and variable-length links into their equations of motion.",
        epilog=EXAMPLES[""],
        formatter_class=raw,
    )
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    parser.add_argument("--debug", action="store_true", help="show a traceback instead of a one-line error")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands")

    def command(name: str, text: str) -> argparse.ArgumentParser:
        made = commands.add_parser(
            name, help=text, description=text[0].upper() + text[1:] + ".", epilog=EXAMPLES[name], formatter_class=raw
        )
        assert isinstance(made, argparse.ArgumentParser)
        return made

    made = command("compile", "derive, emit and compile a scene into an importable module")
    _scene_options(made)
    _method_option(made)
    made.add_argument("--backend", default="c", metavar="NAME", help="c (default) or numpy")
    made.add_argument("--out", metavar="DIR", help="write the package to this folder; it needs NumPy only")
    made.add_argument("--force", action="store_true", help="replace the package that stands in --out")
    made.add_argument("--fold", action="store_true", help="compile the scene's numbers in; p has length 0")
    made.add_argument("--functions", metavar="A,B", help="build only these functions")
    made.add_argument(
        "--dtypes", default="float64", metavar="A,B", help="float64 (default), float32, longdouble; separated by commas"
    )
    made.add_argument("--portable", action="store_true", help="build for any processor of this architecture")
    made.add_argument(
        "--accuracy", default="standard", metavar="NAME", help="fast, standard (default) or high: see docs/accuracy.md"
    )
    _form_options(made)

    made = command("show", "print the equations, their operation counts or the C of a scene")
    _scene_options(made)
    _method_option(made)
    kinds = made.add_mutually_exclusive_group()
    kinds.add_argument("--latex", action="store_true", help="mass matrix and bias in LaTeX (needs SymPy)")
    kinds.add_argument("--c", action="store_true", help="the C kernels")
    kinds.add_argument("--python", action="store_true", help="the NumPy kernels")
    made.add_argument("--functions", metavar="A,B", help="only these functions")
    _form_options(made)

    made = command("verify", "prove that all methods are identical functions and measure each back end's error")
    _scene_options(made)
    made.add_argument("--backend", action="append", metavar="NAME", help="c or numpy (default both); may be repeated")
    made.add_argument(
        "--states", type=_positive, default=10, metavar="N", help="random states per function (default 10)"
    )

    certified = made.add_argument_group("certified errors (need python-flint)")
    certified.add_argument("--certify", action="store_true", help="also certify the errors at hard states of the scene")
    certified.add_argument("--hard", action="store_true", help="certify the catalogue of hard cases instead of a scene")
    certified.add_argument("--functions", metavar="A,B", help="only these functions; also jacobian, regressor, ...")
    certified.add_argument(
        "--dtypes", metavar="A,B", help="float64 (default), float32, longdouble; separated by commas"
    )
    certified.add_argument("--json", metavar="FILE", help="write every certified error to this file")

    command("bench", "run a benchmark suite of a checkout").add_argument(
        "suite", metavar="SUITE", help="a suite of bench/: table1, speed, pareto, stability, claims"
    )
    return parser


def _scene_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", nargs="?", metavar="SCENE.toml", help="a scene file; or --links for a chain")
    chain = parser.add_argument_group("a chain instead of a file")
    chain.add_argument("--links", type=_positive, metavar="N", help="number of links")
    chain.add_argument(
        "--model", metavar="NAME", help="rigid, elastic-rod, telescopic, joint-masses or point-masses (default)"
    )
    chain.add_argument(
        "--length", metavar="L", help="free (default; not for rigid: 1 m), prescribed, or a fixed length in metres"
    )


def _method_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--method", default="matrix", metavar="NAME", help="lagrange, recursive, matrix (default) or articulated"
    )


def _form_options(parser: argparse.ArgumentParser) -> None:
    form = parser.add_argument_group("form of the code (chosen by size and operation counts unless given)")
    form.add_argument("--loops", action=argparse.BooleanOptionalAction, default=None, help="loops over links")
    form.add_argument(
        "--solver", default="auto", metavar="NAME", help="elimination in forward dynamics: auto, dense or articulated"
    )


def _positive(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is no whole number of at least 1")
    return number


def _scene(options: argparse.Namespace) -> Scene:
    """The scene file, or the chain that the options describe."""
    from eomgen.catalog import chain
    from eomgen.errors import OptionError, shown
    from eomgen.scene_file import load_scene

    chain_options = {"--model": options.model, "--length": options.length, "--links": options.links}
    if options.scene is not None:
        given = [name for name, value in chain_options.items() if value is not None]
        if given:
            raise OptionError(
                f"{given[0]} is for a chain, not for the scene file {shown(options.scene)}; give one of them"
            )
        return load_scene(options.scene)
    if options.links is None:
        raise OptionError("no scene: name a scene file, or give --links N for a chain")
    length: Any = options.length
    if isinstance(length, str) and length not in ("free", "prescribed"):
        try:
            length = float(length)
        except ValueError:
            raise OptionError(
                f"--length {shown(length)} is no length; allowed: free, prescribed, or a number in metres"
            ) from None
    return chain(options.links, model=options.model or "point-masses", length=length)


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [name.strip() for name in text.split(",") if name.strip()]


def compile_(options: argparse.Namespace) -> int:
    """eomgen compile"""
    from eomgen import report
    from eomgen.pipeline import compile as compile_scene

    scene = _scene(options)
    with report.progressing() as progress:
        module = compile_scene(
            scene,
            method=options.method,
            backend=options.backend,
            out=options.out,
            fold=options.fold,
            dtypes=_names(options.dtypes) or [],
            functions=_names(options.functions),
            force=options.force,
            portable=options.portable,
            loops=options.loops,
            solver=options.solver,
            accuracy=options.accuracy,
            progress=progress,
        )
    print(report.compiled(module, in_cache=options.out is None))
    return 0


def show(options: argparse.Namespace) -> int:
    """eomgen show"""
    from eomgen import report
    from eomgen.errors import OptionError

    if options.latex:
        unused = {
            "--functions": options.functions is not None,
            "--solver": options.solver != "auto",
            "--loops": options.loops is True,
            "--no-loops": options.loops is False,
        }
        for name in filter(unused.get, unused):
            raise OptionError(f"{name} says nothing to --latex, which shows mass matrix and bias; leave it out")
    scene, names = _scene(options), _names(options.functions)
    kind = "latex" if options.latex else "c" if options.c else "python" if options.python else "text"
    print(report.shown_equations(scene, options.method, names, kind, options.loops, options.solver))
    return 0


def verify(options: argparse.Namespace) -> int:
    """eomgen verify"""
    from eomgen import report
    from eomgen.certify import check_options, import_flint
    from eomgen.errors import CheckError, OptionError
    from eomgen.verification import verify as verify_scene

    for option in ("json", "functions", "dtypes"):
        if getattr(options, option) and not (options.certify or options.hard):
            raise OptionError(f"--{option} is for the certified errors; give --certify or --hard too")
    if options.certify or options.hard:
        import_flint()
        check_options(_names(options.functions), _names(options.dtypes))
    if options.json:
        _check_writable(options.json)
    if options.hard:
        if options.scene is not None or options.links is not None:
            raise OptionError("--hard has scenes of its own; give no scene file and no --links")
        certify(None, options)
        return 0
    scene = _scene(options)
    with report.progressing() as progress:
        result = verify_scene(scene, backends=options.backend, states=options.states, progress=progress)
    print(report.verification(result))
    if options.certify:
        certify(scene, options)
    if not result.passed:
        raise CheckError(
            f"{result.failures} of {result.checks} checks failed for scene {result.scene!r}: {result.summary}"
        )
    return 0


def certify(scene: Scene | None, options: argparse.Namespace) -> None:
    """eomgen verify --certify of a scene, eomgen verify --hard without one."""
    import json
    from pathlib import Path

    from eomgen import hard, report
    from eomgen.certify import as_rows, measure
    from eomgen.errors import CheckError

    cases = hard.cases() if scene is None else hard.cases_of(scene)
    with report.progressing() as progress:
        found = measure(
            cases,
            backends=options.backend or ("c", "numpy"),
            names=_names(options.functions),
            dtypes=_names(options.dtypes) or ("float64",),
            progress=progress,
        )
    print(("" if scene is None else "\n") + report.certificates(found))
    if options.json:
        text = json.dumps(as_rows(found), indent=1, allow_nan=False) + "\n"
        with _writing(options.json):
            Path(options.json).write_text(text, encoding="utf-8")
    failed = [item for item in found if not item.passed]
    if failed:
        worst = max(failed, key=lambda item: item.scaled / item.bound)
        where = f"{worst.function} of {worst.method}/{worst.backend} in {worst.case!r}, {worst.dtype}"
        raise CheckError(f"{len(failed)} of {len(found)} certified errors are not explained, the worst: {where}")


@contextmanager
def _writing(file: str) -> Iterator[None]:
    """Says in one line that a file cannot be written."""
    from eomgen.errors import OptionError, one_line

    try:
        yield
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        reason = one_line(str(getattr(error, "strerror", None) or error))
        raise OptionError(f"--json {one_line(file, 200)} cannot be written ({reason}); check the path") from None


def _check_writable(file: str) -> None:
    """Opens a file that is to be written later; what stands in it stays."""
    import os
    from pathlib import Path

    with _writing(file):
        new = not os.path.lexists(file)
        Path(file).open("a").close()
        if new:
            Path(file).unlink()


def bench(suite: str, arguments: list[str]) -> int:
    """eomgen bench: runs bench/<suite>.py, or the package of that name, of the checkout this package stands in."""
    import os
    import subprocess
    from pathlib import Path

    from eomgen.errors import OptionError, unknown

    root = Path(__file__).resolve().parent.parent
    files = [path for path in (root / "bench").glob("*.py") if "\ndef main(" in path.read_text(encoding="utf-8")]
    packages = [path.parent for path in (root / "bench").glob("*/__main__.py")]
    suites = sorted(path.stem for path in files + packages)
    if not suites:
        raise OptionError("the benchmarks are not part of the installed package; run eomgen bench in a checkout of it")
    if suite not in suites:
        raise OptionError(unknown("benchmark suite", suite, suites))
    # It runs in the user's folder, from which relative paths start; -P: a folder named bench there is not imported.
    paths = [str(root), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    command = [sys.executable, "-P", "-m", f"bench.{suite}", *arguments]
    return subprocess.run(command, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
