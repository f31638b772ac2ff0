"""The command line: exit code and text of every command and of every error a user can cause."""

import importlib
import itertools
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

import pytest

from eomgen import cli, report
from eomgen.errors import BuildError
from eomgen.scene import LINK_TYPES
from eomgen.scene_file import load_scene

ROOT = Path(__file__).resolve().parent.parent
LONGEST = 900  # characters of an error line; a path or two included

LEG = """\
name = "leg"
[[links]]
name = "shank"
model = "point-masses"
length = "free"
masses = [0.7, 1.5, 0.7]
fractions = [0.0, 0.595, 1.0]
"""
THIGH = """\
[[links]]
name = "thigh"
parent = "shank"
model = "elastic-rod"
length = "prescribed"
mass = 8.9
rod_length = 0.45
"""


class Result(NamedTuple):
    """What a command did."""

    code: int
    out: str
    err: str


class Command:
    """Runs the command line in this process."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def __call__(self, *arguments: str) -> Result:
        self._capsys.readouterr()
        try:
            code = cli.main(list(arguments))
        except SystemExit as stop:  # argparse, for help and arguments it does not understand
            code = int(stop.code or 0)
        return Result(code, *self._capsys.readouterr())

    def fails(self, *arguments: str, code: int = 2) -> str:
        """The message of a command that must fail: one line on stderr, nothing on stdout."""
        result = self(*arguments)
        assert result.code == code, result
        assert result.out == ""
        return message(result.err)


def message(err: str) -> str:
    """The text of the one error line."""
    assert err.startswith("eomgen: error: ")
    assert err.endswith("\n")
    text = err.removeprefix("eomgen: error: ").removesuffix("\n")
    assert len(text) < LONGEST, f"{text[:LONGEST]}..."
    assert text.isprintable(), text
    assert "Traceback" not in text
    return text


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Command:
    return Command(capsys)


@pytest.fixture
def leg(tmp_path: Path) -> str:
    path = tmp_path / "leg.toml"
    path.write_text(LEG + THIGH)
    return str(path)


def process(*arguments: str, **environment: str) -> Result:
    """Runs the command line in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "eomgen", *arguments],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    return Result(done.returncode, done.stdout, done.stderr)


# What works


@pytest.mark.parametrize("arguments", [(), ("--help",), ("-h",)])
def test_help(run: Command, arguments: tuple[str, ...]) -> None:
    result = run(*arguments)
    assert result.code == 0
    assert result.err == ""
    assert "usage: eomgen" in result.out
    assert "examples:\n  eomgen compile --links 5 --method matrix" in result.out
    assert "exit codes: 0 fine, 1 a check failed, 2 bad input, 3 a build failed" in result.out


@pytest.mark.parametrize("command", ["compile", "show", "verify", "bench"])
def test_help_of_every_command_has_an_example(run: Command, command: str) -> None:
    result = run(command, "--help")
    assert result.code == 0
    assert result.err == ""
    assert f"usage: eomgen {command}" in result.out
    assert re.search(rf"examples:\n  eomgen {command} \S+", result.out)
    assert command in run("--help").out


def test_examples_in_help_are_understood(run: Command) -> None:
    """Every example line has options that exist (files aside); those without a file run in other tests."""
    for text in cli.EXAMPLES.values():
        for line in re.findall(r"^  eomgen (.*?)(?:   .*)?$", text, re.MULTILINE):
            words = line.split()
            if words[0] != "bench":
                assert cli._parser().parse_args(words).command == words[0]


def test_version(run: Command) -> None:
    from eomgen import __version__

    assert run("--version") == Result(0, f"eomgen {__version__}\n", "")


def test_in_a_process() -> None:
    result = process("--version")
    assert result.code == 0
    assert re.fullmatch(r"eomgen \d+\.\d+\.\d+\n", result.out)
    result = process("compile", "--links", "x")
    assert result.code == 2
    assert "no whole number" in message(result.err)
    assert result.out == ""


def test_help_starts_light() -> None:
    """The figure is 0.15 s; a clock in a test lies on a busy machine, the modules that were loaded do not."""
    code = (
        "import sys\nfrom eomgen.cli import main\ntry:\n main(['--help'])\nexcept SystemExit: pass\n"
        "heavy = {'numpy', 'sympy', 'scipy', 'Cython', 'matplotlib', 'msgspec', 'mpmath', 'flint'} & set(sys.modules)\n"
        "sys.exit(f'loaded {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_compile_a_chain(run: Command) -> None:
    result = run("compile", "--links", "2", "--backend", "numpy")
    assert result.code == 0
    assert result.err == ""
    lines = result.out.splitlines()
    folder = Path(lines[0].removeprefix("module").strip())
    assert (folder / "__init__.py").is_file()
    assert "chain2: 4 coordinates, 13 parameters; method matrix, back end numpy" in lines[1]
    for name in ("forward_dynamics", "inverse_dynamics", "mass_matrix", "bias", "energy", "joints"):
        assert any(line.startswith(f"{name} ") for line in lines)
    assert "(4),(4),(4),(13)->(4)" in result.out


def printed_example(out: str, **options: str | Path) -> subprocess.CompletedProcess[str]:
    """Runs the example that `compile` printed."""
    lines = [line.strip() for line in out.partition("try it:\n")[2].splitlines()]
    assert len(lines) == 3
    code = "\n".join(lines)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, **options)  # type: ignore[call-overload,no-any-return]


EXAMPLES = {
    (): "forward_dynamics(q, v, u, w, model.p)",
    ("--fold", "--functions", "forward_dynamics"): "forward_dynamics(q, v, u, w, model.p)",
    ("--dtypes", "float32"): "forward_dynamics(q, v, u, w, model.p)",
    ("--dtypes", "longdouble,float32"): "forward_dynamics(q, v, u, w, model.p)",
    ("--dtypes", "float32,float64"): "forward_dynamics(q, v, u, w, model.p)",
    ("--functions", "joints"): "joints(q, w, model.p)",
    ("--functions", "prescribed_forces,joints"): "prescribed_forces(q, v, a, w, model.p)",
    ("--functions", "energy", "--dtypes", "float32"): "energy(q, v, w, model.p)",
    ("--functions", "regressor"): "regressor(q, v, a, w)",
    ("--functions", "jacobian,regressor", "--dtypes", "longdouble"): "jacobian(q, v, u, w, model.p)",
}


@pytest.mark.parametrize("options", EXAMPLES)
def test_the_printed_example_runs(run: Command, leg: str, options: tuple[str, ...]) -> None:
    """Of the types and functions that were built: forward dynamics if it is there, else the first of them."""
    out = run("compile", leg, "--backend", "numpy", *options).out
    assert f"print(model.{EXAMPLES[options]})" in out
    done = printed_example(out, cwd=ROOT)
    assert (done.returncode, done.stderr) == (0, "")
    assert re.fullmatch(r"\[[^\[].*\]\n|\[\[.*\]\]\n", done.stdout, re.DOTALL)


@pytest.mark.parametrize("options", [("--dtypes", "float32"), ("--functions", "energy", "--dtypes", "longdouble")])
def test_the_printed_example_runs_in_c(run: Command, options: tuple[str, ...]) -> None:
    """Compiled code converts no type without asking."""
    done = printed_example(run("compile", "--links", "2", *options).out, cwd=ROOT)
    assert (done.returncode, done.stderr) == (0, "")
    assert re.fullmatch(r"\[.*\]\n", done.stdout)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_a_package_stands_alone(run: Command, leg: str, tmp_path: Path, backend: str) -> None:
    """Written with --out it is imported from another folder by a Python that has no eomgen."""
    out = tmp_path / "elsewhere" / f"leg_{backend}"
    out.parent.mkdir()
    options = ("--method", "lagrange", "--functions", "forward_dynamics")
    result = run("compile", leg, "--backend", backend, "--out", str(out), *options)
    assert result.code == 0
    assert result.out.splitlines()[0].endswith(str(out))
    assert f"# from {out.parent}" in result.out
    done = printed_example(result.out, cwd=out.parent)
    assert (done.returncode, done.stderr) == (0, "")
    code = f"import sys; sys.modules['eomgen'] = None; import {out.name}; print({out.name}.q_names)"
    alone = subprocess.run([sys.executable, "-c", code], cwd=out.parent, capture_output=True, text=True, check=False)
    assert alone.stdout == "('shank.angle', 'thigh.angle', 'shank.length')\n", alone.stderr


def test_compile_with_options(run: Command, tmp_path: Path) -> None:
    out = tmp_path / "folded"
    command = ("compile", "--links", "1", "--model", "rigid", "--length", "0.5", "--backend", "numpy", "--fold")
    result = run(
        *command, "--functions", "energy, bias", "--dtypes", "float32,float64", "--out", str(out), "--portable"
    )
    assert result.code == 0
    assert "0 parameters" in result.out
    assert "mass_matrix" not in result.out
    assert "print(model.bias(q, v, model.p))" in result.out  # there is no forward dynamics to try
    text = (out / "__init__.py").read_text()
    assert "'energy'" in text
    assert "'bias'" in text


def test_progress_is_for_terminals(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    report.progress("derive")
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    report.progress("derive")
    assert "derive ..." in capsys.readouterr().err
    report.clear()
    assert capsys.readouterr().err == "\r\x1b[K"


def test_a_path_that_the_terminal_cannot_show(tmp_path: Path) -> None:
    options = ("--links", "1", "--functions", "energy", "--backend", "numpy")
    result = process("compile", *options, PYTHONIOENCODING="ascii", EOMGEN_CACHE=str(tmp_path / "caché"))
    assert result.code == 0
    assert r"cach\xe9" in result.out


def test_show_as_text(run: Command, leg: str) -> None:
    result = run("show", leg)
    assert result.code == 0
    assert result.err == ""
    assert result.out.startswith("leg: 2 links, 3 coordinates, method matrix\nM(q, w, p) a + h(q, v, w, p) = Q(u)\n")
    assert "  q[2]  shank.length (m)\n" in result.out
    assert "  w[0]  thigh.length (m)\n" in result.out
    assert "operations" in result.out
    assert "prescribed_forces (3),(3),(3),(1,3)" in result.out
    assert "out[0] = " in result.out


def test_show_names_the_arguments_that_there_are(run: Command) -> None:
    assert run("show", "--links", "1").out.splitlines()[1] == "M(q, p) a + h(q, v, p) = Q(u)"


def test_help_knows_the_length_of_rigid_links(run: Command) -> None:
    out = " ".join(run("compile", "--help").out.split())
    assert "free (default; not for rigid: 1 m), prescribed, or a fixed length" in out
    assert (
        run("show", "--links", "1", "--model", "rigid").out
        == run("show", "--links", "1", "--model", "rigid", "--length", "1").out
    )


def test_show_is_for_some_functions(run: Command) -> None:
    out = run("show", "--links", "1", "--functions", "joints").out
    assert "joints (2)" in out
    assert "energy" not in out


def test_show_as_c(run: Command) -> None:
    out = run("show", "--links", "1", "--model", "rigid", "--c").out
    assert "EOM_LINKAGE void EOM_NAME(forward_dynamics)" in out
    assert "q[0]  link1.angle (rad)" in out


def test_show_as_python(run: Command) -> None:
    out = run("show", "--links", "1", "--model", "rigid", "--python").out
    compile(out, "shown", "exec")
    assert "forward_dynamics = Function(" in out


def test_show_as_latex(run: Command) -> None:
    pytest.importorskip("sympy")
    out = run("show", "--links", "2", "--model", "rigid", "--latex").out
    assert out.startswith("M = \\left[")
    assert "\nh = \\left[" in out
    coupling = r"\cos{\left(\varphi_{\mathrm{link1}} - \varphi_{\mathrm{link2}} \right)}"
    assert rf"\frac{{\mathrm{{link1.length}} \mathrm{{link2.length}} \mathrm{{link2.mass}} {coupling}}}{{2}}" in out
    assert r"\sin{\left(\varphi_{\mathrm{link1}} \right)}" not in out


def test_debug_shows_the_traceback(tmp_path: Path) -> None:
    """And the exit code stays."""
    result = process("show", str(tmp_path / "none.toml"), "--debug")
    assert result.code == 2
    assert result.err.startswith("Traceback")
    assert "SceneError" in result.err
    assert "eomgen: error:" not in result.err
    result = process("compile", "--debug", *unique(), CC="/nonexistent")
    assert result.code == 3
    assert "BuildError" in result.err


# Scene files


def written(tmp_path: Path, text: str | bytes) -> str:
    path = tmp_path / "scene.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return str(path)


FILES: dict[str, tuple[str | bytes, str]] = {
    "empty": ("", "missing key 'name'"),
    "broken": ("name = ", "not TOML: Invalid value"),
    "broken table": ("[[links]\n", "not TOML"),
    "key twice": ('name = "a"\nname = "b"\n', "not TOML: Cannot overwrite"),
    "not UTF-8": (b'name = "\xff"\n', "byte 8 is not UTF-8; save the file as UTF-8"),
    "nested": ("x = " + "[" * 5000 + "]" * 5000, "nested too deeply"),
    "long number": ("gravity = " + "9" * 5000 + "\n" + LEG, "not TOML|is too large"),
    "unknown key": ("gravty = 9.81\n" + LEG, r"unknown key 'gravty'; allowed: .*did you mean 'gravity'"),
    "unknown key of a link": (
        LEG + "lenght = 1\n",
        r"links\[0\] 'shank': unknown key 'lenght'; .*did you mean 'length'",
    ),
    "gravity below": (LEG + "gravity = 1\n", "key 'gravity' belongs to the scene; move it above"),
    "key missing": (LEG.replace("length =", "# length ="), "missing key 'length'"),
    "model missing": (LEG.replace("model =", "# model ="), "missing key 'model'; it is one of rigid"),
    "unknown model": (
        LEG.replace("point-masses", "point-mass"),
        r"unknown model 'point-mass'.*did you mean 'point-masses'",
    ),
    "links as text": ('name = "a"\nlinks = "b"\n', "links = 'b' is not a list"),
    "links as numbers": ('name = "a"\nlinks = [1]\n', r"links\[0\]: 1 is not a table"),
    "no links": ('name = "a"\nlinks = []\n', "the scene has no links; give at least one"),
    "no links at all": ('name = "a"\n', "missing key 'links'"),
    "text for a number": ('gravity = "9.81"\n' + LEG, "gravity = '9.81' is not a number"),
    "flag for a number": ("gravity = true\n" + LEG, "gravity = True is not a number"),
    "number for a flag": (LEG + "hangs = 1\n", "hangs = 1 is not a flag"),
    "number for a name": (LEG.replace('"leg"', "3"), "name = 3 is not a string"),
    "number for a list": (LEG.replace("[0.7, 1.5, 0.7]", "1.0"), "masses = 1.0 is not a list"),
    "NaN": ("gravity = nan\n" + LEG, "gravity = nan is not finite"),
    "infinity": (LEG.replace("1.5", "inf"), r"masses\[1\] = inf is not finite"),
    "negative mass": (LEG.replace("1.5", "-1.5"), r"'shank': masses\[1\] = -1.5 is negative; a mass must be >= 0"),
    "negative inertia": (LEG + THIGH + "inertia = -1\n", "inertia = -1.0 is negative"),
    "inertia too small": (LEG + THIGH + "inertia = 0.01\n", "inertia = 0.01 leaves a negative central inertia"),
    "fractions missing": (LEG.replace("[0.0, 0.595, 1.0]", "[0.5]"), "masses has length 3 but fractions 1"),
    "unknown length": (LEG.replace('"free"', '"fre"'), "unknown length 'fre'.*did you mean 'free'"),
    "unknown parent": (
        LEG + THIGH.replace('"shank"', '"shin"'),
        r"links\[1\] 'thigh': unknown parent 'shin'; allowed: ground, shank",
    ),
    "own parent": (LEG + 'parent = "shank"\n', "makes a cycle"),
    "cycle": (LEG + 'parent = "thigh"\n' + THIGH, r"parent = 'thigh' makes a cycle \(shank, thigh\)"),
    "later parent": (LEG.replace("[[links]]", THIGH + "[[links]]"), "is a later link; .*move it up"),
    "duplicate": (LEG + THIGH.replace('"thigh"', '"shank"'), r"links\[0\] has this name already"),
    "reserved in C": (LEG.replace('"leg"', '"int"'), "name = 'int' is a reserved word of Python or C"),
    "reserved in Python": (LEG.replace('"shank"', '"lambda"'), "'lambda' is a reserved word of Python or C"),
    "taken": (LEG.replace('"shank"', '"ground"'), "'ground' is a reserved word of eomgen"),
    "not ASCII": (LEG.replace('"shank"', '"Schienbeinlänge"'), "name = '.*' is not an identifier"),
    "control characters": (LEG.replace('"shank"', r'"a\u001b[31m\n"'), "is not an identifier"),
    "quotes": (LEG.replace('"shank"', "'a\"; b'"), "is not an identifier"),
    "newline": (LEG.replace('"leg"', r'"leg\nint x;"'), "is not an identifier"),
    "end of comment": (LEG.replace('"leg"', '"*/ int x; /*"'), "is not an identifier"),
    "path": (LEG.replace('"leg"', '"../../leg"'), "is not an identifier"),
    "length without inertia": (
        LEG.replace("[0.7, 1.5, 0.7]", "[0.7, 0.0, 0.0]"),
        "shank.length has no inertia|shank.angle has no inertia",
    ),
}


@pytest.mark.parametrize("command", ["compile", "show"])
@pytest.mark.parametrize("name", FILES)
def test_scene_files_refused(run: Command, tmp_path: Path, name: str, command: str) -> None:
    text, words = FILES[name]
    if name == "length without inertia" and command == "show":
        pytest.skip("shown as it stands; it is refused when compiled")
    text = run.fails(command, written(tmp_path, text), *(["--backend", "numpy"] if command == "compile" else []))
    assert re.search(words, text), text


def test_the_file_is_named(run: Command, tmp_path: Path) -> None:
    path = written(tmp_path, "gravity = nan\n" + LEG)
    assert run.fails("verify", path).startswith(f"{path}: ")


@pytest.mark.parametrize("command", ["compile", "show", "verify"])
def test_files_that_cannot_be_read(run: Command, tmp_path: Path, command: str) -> None:
    assert "no such file; give the path of a scene file" in run.fails(command, str(tmp_path / "none.toml"))
    assert "is a directory" in run.fails(command, str(tmp_path))
    assert "cannot be read" in run.fails(command, str(tmp_path / ("a" * 300)))
    assert "cannot be read" in run.fails(command, "a\0b.toml")
    assert "cannot be read" in run.fails(command, "/dev/null/scene.toml")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission(run: Command, leg: str) -> None:
    Path(leg).chmod(0)
    assert "Permission denied" in run.fails("show", leg)


HOSTILE = (
    'a; system("touch {mark}")',
    "$(touch {mark})",
    "`touch {mark}`",
    "__import__('os').mknod('{mark}')",
    "{mark}",
)


@pytest.mark.parametrize("name", HOSTILE)
@pytest.mark.parametrize("where", ['"leg"', '"shank"', '"free"', '"point-masses"'])
def test_nothing_is_executed(
    run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, where: str
) -> None:
    monkeypatch.chdir(tmp_path)
    mark = tmp_path / "mark"
    text = LEG.replace(where, f"'''{name.format(mark=mark)}'''")
    assert tomllib.loads(text)
    run.fails("compile", written(tmp_path, text))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.toml"]


@pytest.mark.parametrize("character", ["a", "é", "%", "\\n", "9"])
@pytest.mark.parametrize("where", ["leg", "shank", "free", "point-masses", "gravity", "masses"])
def test_long_texts_are_not_echoed(run: Command, tmp_path: Path, character: str, where: str) -> None:
    """10,000 characters for a name, a value or a key; the message stays short."""
    quoted = f'"{character * 10_000}"'
    text = "gravity = 9.81\n" + LEG
    text = (
        text.replace(f"{where} =", f"{quoted} =")
        if where in ("gravity", "masses")
        else text.replace(f'"{where}"', quoted)
    )
    found = run.fails("compile", written(tmp_path, text))
    assert character * 200 not in found


# Names of scenes and links that mean something in the emitted text


@pytest.mark.parametrize(
    "name",
    [
        "eomgen_real",
        "eomgen_model",
        "eomgen_batch",
        "real",
        "model",
        "scalar",
        "R",
        "K",
        "FMA",
        "q",
        "p",
        "out",
        "main",
        "string",
        "numpy",
        "_kernel",
    ],
)
def test_any_identifier_is_a_scene_and_a_link(run: Command, tmp_path: Path, name: str) -> None:
    """Names of the runtime's files, macros and variables do no harm (or are refused in one line)."""
    path = written(tmp_path, LEG.replace('"leg"', f'"{name}"').replace('"shank"', f'"{name}"'))
    result = run("compile", path, "--functions", "joints")
    if result.code == 2:
        message(result.err)
    else:
        assert (result.code, result.err) == (0, "")


# Arguments

ARGUMENTS: dict[str, tuple[tuple[str, ...], str]] = {
    "no scene": (("compile",), "no scene: name a scene file, or give --links N"),
    "no scene to show": (("show", "--c"), "no scene"),
    "no scene to verify": (("verify",), "no scene"),
    "both": (("compile", "a.toml", "--links", "3"), "--links is for a chain, not for the scene file 'a.toml'"),
    "file and model": (("compile", "a.toml", "--model", "rigid"), "--model is for a chain"),
    "file and length": (("show", "a.toml", "--length", "free"), "--length is for a chain"),
    "no links": (("compile", "--links", "0"), "argument --links: '0' is no whole number of at least 1"),
    "fewer links": (("compile", "--links", "-3"), "'-3' is no whole number"),
    "links as text": (("compile", "--links", "x"), "'x' is no whole number of at least 1; see eomgen compile --help"),
    "half a link": (("verify", "--links", "1.5"), "'1.5' is no whole number"),
    "too many links": (
        ("compile", "--links", "100001"),
        "links = 100001 is not allowed; give an integer from 1 to 100000",
    ),
    "number too long": (("compile", "--links", "9" * 5000), "is no whole number|is not allowed"),
    "too many for dense": (
        ("compile", "--links", "400", "--no-loops"),
        "forward_dynamics of 400 links by method 'matrix' would write down .*use method 'articulated'",
    ),
    "length": (
        ("compile", "--links", "1", "--length", "foo"),
        "--length 'foo' is no length; allowed: free, prescribed, or a number",
    ),
    "length NaN": (("compile", "--links", "1", "--length", "nan"), "length = nan is not finite"),
    "negative length": (
        ("compile", "--links", "1", "--model", "rigid", "--length", "-1"),
        "length = -1.0 is not positive",
    ),
    "no length": (("compile", "--links", "1", "--length", "0"), "link1.angle has no inertia"),
    "free rigid": (
        ("compile", "--links", "1", "--model", "rigid", "--length", "free"),
        "a rigid link needs a number > 0",
    ),
    "method": (
        ("compile", "--links", "1", "--method", "matrx"),
        r"unknown method 'matrx'; allowed: lagrange, recursive, matrix, articulated \(did you mean 'matrix'\?\)",
    ),
    "method to show": (("show", "--links", "1", "--method", "Newton"), "unknown method 'Newton'; allowed: lagrange"),
    "model": (
        ("compile", "--links", "1", "--model", "point-mass"),
        r"unknown model 'point-mass'; allowed: rigid, .*did you mean 'point-masses'",
    ),
    "back end": (("compile", "--links", "1", "--backend", "C"), "unknown back end 'C'; allowed: c, numpy"),
    "back end near": (
        ("compile", "--links", "1", "--backend", "nump"),
        r"unknown back end 'nump'.*did you mean 'numpy'",
    ),
    "back end to verify": (
        ("verify", "--links", "1", "--backend", "fortran"),
        "unknown back end 'fortran'; allowed: c, numpy",
    ),
    "function": (
        ("compile", "--links", "1", "--functions", "energy,joint"),
        r"unknown function 'joint'; allowed: forward_dynamics, .*did you mean 'joints'",
    ),
    "function to show": (("show", "--links", "1", "--functions", "forces"), "unknown function 'forces'"),
    "function of others": (
        ("compile", "--links", "1", "--functions", "prescribed_forces"),
        "unknown function 'prescribed_forces'",
    ),
    "no function": (
        ("compile", "--links", "1", "--functions", ","),
        "no function requested; allowed: forward_dynamics",
    ),
    "dtype": (
        ("compile", "--links", "1", "--dtypes", "float46"),
        r"unknown dtype 'float46'; allowed: float64, float32, longdouble \(did you mean 'float64'\?\)",
    ),
    "no dtype": (("compile", "--links", "1", "--dtypes", ""), "no dtype requested; allowed: float64"),
    "suite": (("bench", "table2"), "unknown benchmark suite 'table2'|not part of the installed package"),
    "no suite": (("bench",), "SUITE"),
    "states": (("verify", "--links", "1", "--states", "0"), "'0' is no whole number"),
    "command": (("compil", "--links", "1"), "invalid choice: 'compil'.*; see eomgen --help"),
    "option": (("compile", "--links", "1", "--methd", "matrix"), "unrecognized arguments: --methd"),
    "value missing": (("compile", "--links"), "expected one argument"),
    "two forms": (("show", "--links", "1", "--c", "--latex"), "not allowed with argument"),
    "LaTeX of functions": (
        ("show", "--links", "1", "--latex", "--functions", "energy"),
        "--functions says nothing to --latex, which shows mass matrix and bias; leave it out",
    ),
    "LaTeX of a solver": (
        ("show", "--links", "1", "--latex", "--solver", "nonsense"),
        "--solver says nothing to --latex",
    ),
    "LaTeX of loops": (("show", "--links", "1", "--latex", "--loops"), "--loops says nothing to --latex"),
    "LaTeX of no loops": (("show", "--links", "1", "--latex", "--no-loops"), "--no-loops says nothing to --latex"),
    "LaTeX of many": (("show", "--links", "9", "--latex"), "LaTeX of 18 coordinates would fill pages"),
}


@pytest.mark.parametrize("name", ARGUMENTS)
def test_arguments_refused(run: Command, name: str) -> None:
    arguments, words = ARGUMENTS[name]
    text = run.fails(*arguments)
    assert re.search(words, text), text


@pytest.mark.parametrize("what", [("--links", "1", "--certify"), ("--hard",)])
def test_certifying_without_flint(run: Command, monkeypatch: pytest.MonkeyPatch, what: tuple[str, ...]) -> None:
    """It is missed before anything is built."""
    monkeypatch.setitem(sys.modules, "flint", None)
    monkeypatch.setattr("eomgen.verification.verify", None)
    assert "certified errors need python-flint, which is not installed; pip install" in run.fails("verify", *what)


@pytest.mark.parametrize("option", [("--functions", "energies"), ("--dtypes", "float16")])
def test_certifying_what_there_is_not(run: Command, monkeypatch: pytest.MonkeyPatch, option: tuple[str, str]) -> None:
    """It is refused before anything is built."""
    pytest.importorskip("flint")
    monkeypatch.setattr("eomgen.verification.verify", None)
    assert f"unknown {option[0][2:-1]} '{option[1]}'; allowed: " in run.fails(
        "verify", "--links", "1", "--certify", *option
    )


@pytest.mark.parametrize(
    "arguments",
    [
        ("{}",),
        ("compile", "{}"),
        ("compile", "--links", "{}"),
        ("compile", "--links", "1", "--method", "{}"),
        ("compile", "--links", "1", "--model", "{}"),
        ("compile", "--links", "1", "--length", "{}"),
        ("compile", "--links", "1", "--backend", "{}"),
        ("compile", "--links", "1", "--functions", "{}"),
        ("compile", "--links", "1", "--dtypes", "{}"),
        ("compile", "--links", "1", "--backend", "numpy", "--out", "{}"),
        ("compile", "--links", "1", "--{}"),
        ("bench", "{}"),
    ],
)
@pytest.mark.parametrize("text", ["a" * 10_000, "é\x1b[31m\n" * 500])
def test_long_arguments_are_not_echoed(run: Command, arguments: tuple[str, ...], text: str) -> None:
    run.fails(*(argument.format(text) for argument in arguments))


@pytest.mark.parametrize("command", ["compile", "verify"])
def test_a_scene_that_is_singular_everywhere(run: Command, tmp_path: Path, command: str) -> None:
    """The walker of rods with free lengths: what slides at the hanging tip has no mass, so it is named."""
    from eomgen.catalog import walker

    path = tmp_path / "walker.toml"
    path.write_text(walker(length="free").to_toml())
    text = run.fails(command, str(path), "--backend", "numpy")
    assert "scene 'walker': swing_shank.length has no inertia, so the mass matrix is singular in every state" in text
    assert "prescribe or fix it" in text


# Compilers


def script(tmp_path: Path, text: str) -> str:
    path = tmp_path / "mycc"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return str(path)


FAILING = 'if [ "$1" = --version ]; then echo "mycc 1.0"; exit 0; fi\n'


def unique(counter: "itertools.count[int]" = itertools.count(1)) -> tuple[str, ...]:  # noqa: B008
    """A small chain that no cache has: its length is new."""
    return ("--links", "1", "--model", "rigid", "--length", f"1.{os.getpid()}{next(counter)}", "--functions", "energy")


@pytest.mark.parametrize("cc", ["/nonexistent", "no_such_compiler_here", " ", "/nonexistent -O1"])
def test_no_compiler(run: Command, monkeypatch: pytest.MonkeyPatch, cc: str) -> None:
    monkeypatch.setenv("CC", cc)
    text = run.fails("compile", *unique(), code=3)
    assert re.search(r"no C compiler: .* is not on the path; install gcc or clang, set CC to one, or use", text)
    assert "--backend numpy" in text
    assert run("compile", *unique(), "--backend", "numpy").code == 0


def test_a_compiler_with_an_open_quote(run: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", 'cc "-O1')
    run.fails("compile", *unique(), code=3)


def test_a_compiler_that_does_not_run(run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", script(tmp_path, "exit 7"))
    assert "does not run" in run.fails("compile", *unique(), code=3)


def test_a_compiler_that_is_no_program(run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "mycc"
    path.write_bytes(b"\x7fnothing")
    path.chmod(0o755)
    monkeypatch.setenv("CC", str(path))
    assert "does not run" in run.fails("compile", *unique(), code=3)


@pytest.fixture
def _no_wrapper(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The kernel is compiled first; Cython need not run for it to fail."""
    build = importlib.import_module("eomgen.backends.c.build")
    monkeypatch.setattr(build, "_wrapper", lambda tools: tmp_path)
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))


@pytest.mark.usefixtures("_no_wrapper")
@pytest.mark.parametrize("out", [False, True])
def test_a_failing_compiler(run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, out: bool) -> None:
    monkeypatch.setenv("CC", script(tmp_path, f'{FAILING}echo "kernel.c:1: error: too hot today" >&2; exit 1'))
    place = tmp_path / "package"
    text = run.fails("compile", *unique(), *(["--out", str(place)] if out else []), code=3)
    assert re.search("the C compiler '.*mycc' failed with exit code 1: kernel.c:1: error: too hot today; log: ", text)
    log = Path(text.rpartition("log: ")[2])
    assert "too hot today" in log.read_text()
    assert not place.exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cache", "mycc"]


@pytest.mark.usefixtures("_no_wrapper")
def test_a_compiler_that_says_a_lot(run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the compiler prints is quoted as one short line, whatever stands in it."""
    noise = r"printf 'error: \033[31m%010000d\n' 0 >&2; exit 1"
    monkeypatch.setenv("CC", script(tmp_path, f"{FAILING}{noise}"))
    result = run("compile", *unique())
    assert result.code == 3
    assert len(result.err) < LONGEST, result.err[:LONGEST]
    message(result.err)


@pytest.mark.usefixtures("_no_wrapper")
def test_a_compiler_killed_by_a_signal(run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", script(tmp_path, f"{FAILING}kill -9 $$"))
    assert "failed with exit code -9" in run.fails("compile", *unique(), code=3)


def test_a_cache_that_cannot_be_written(run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "file"))
    text = run.fails("compile", *unique(), "--backend", "numpy", code=3)
    assert "cannot write to the cache" in text
    assert "set EOMGEN_CACHE to a folder that can be written" in text


# Output folders


def build(run: Command, out: Path | str, *options: str) -> Result:
    return run("compile", "--links", "1", "--backend", "numpy", "--functions", "energy", "--out", str(out), *options)


def refused(run: Command, out: Path | str, *options: str) -> str:
    command = ("compile", "--links", "1", "--backend", "numpy", "--functions", "energy")
    return run.fails(*command, "--out", str(out), *options)


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(files)}


def test_an_output_folder_is_not_overwritten(run: Command, tmp_path: Path) -> None:
    out = tmp_path / "kept"
    assert build(run, out).code == 0
    before = contents(tmp_path)
    text = refused(run, out, "--fold")
    assert f"output folder {out} exists; use --force (force=True) to replace it" in text
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", ["standing", "replaced"])
def test_force_replaces(run: Command, tmp_path: Path, name: str) -> None:
    out = tmp_path / name
    assert build(run, out).code == 0
    (out / "stray.txt").touch()
    assert build(run, out, "--force", "--fold").code == 0
    assert not (out / "stray.txt").exists()
    assert "0 parameters" not in (out / "__init__.py").read_text()
    assert sorted(path.name for path in tmp_path.iterdir()) == [name]


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_force_loads_what_was_built(tmp_path: Path, backend: str) -> None:
    """A package replaced in the same process is the new one in memory too, compiled code included."""
    import eomgen

    out = tmp_path / f"again_{backend}"
    options = {"backend": backend, "functions": ["energy"], "out": out}
    first = eomgen.compile(eomgen.chain(1), **options)
    second = eomgen.compile(eomgen.chain(2), force=True, **options)
    assert first.energy.signature == "(2),(2),(7)->(2)"
    assert second.energy.signature == "(4),(4),(13)->(2)"
    assert second.q_names == eomgen.chain(2).q_names


def test_force_on_a_new_folder(run: Command, tmp_path: Path) -> None:
    assert build(run, tmp_path / "fresh_one", "--force").code == 0


FOREIGN = {
    "empty": {},
    "no package": {"notes.txt": "mine"},
    "other package": {"__init__.py": '"""A package of somebody else."""\n'},
}


@pytest.mark.parametrize("name", FOREIGN)
def test_force_refuses_foreign_folders(run: Command, tmp_path: Path, name: str) -> None:
    out = tmp_path / "mine"
    out.mkdir()
    for file, text in FOREIGN[name].items():
        (out / file).write_text(text)
    assert "exists; use --force" in refused(run, out)
    assert f"output folder {out} is no package written by eomgen; it is not replaced" in refused(run, out, "--force")
    assert {path.name: path.read_text() for path in out.iterdir()} == FOREIGN[name]


def test_force_refuses_files(run: Command, tmp_path: Path) -> None:
    out = tmp_path / "mine"
    out.write_text("a file")
    assert "is no package written by eomgen" in refused(run, out, "--force")
    assert out.read_text() == "a file"


def test_a_link_to_nowhere(run: Command, tmp_path: Path) -> None:
    """A dangling symbolic link is neither followed nor replaced."""
    out = tmp_path / "dangling"
    out.symlink_to(tmp_path / "nowhere")
    refused(run, out)
    assert out.is_symlink()
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("name", ["two words", "1st", "a-b", "größe", "class", "a.b", "...", "a'b"])
def test_names_that_cannot_be_imported(run: Command, tmp_path: Path, name: str) -> None:
    assert "is no module name; use letters, digits and underscores" in refused(run, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_name_that_is_too_long(run: Command, tmp_path: Path) -> None:
    refused(run, tmp_path / ("a" * 300))
    assert list(tmp_path.iterdir()) == []


def test_a_user_that_does_not_exist(run: Command) -> None:
    refused(run, "~no_such_user_here/package")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("json", "a module named 'json' is part of Python"),
        ("antigravity", "a module named 'antigravity' is part of Python"),  # not imported
        ("numpy", "a module named 'numpy' is already imported"),
    ],
)
def test_a_name_that_is_taken(run: Command, tmp_path: Path, name: str, words: str) -> None:
    """It would hide a library, so nothing is written at all."""
    text = refused(run, tmp_path / name)
    assert words in text
    assert "write to a folder of another name" in text
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def importable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of libraries that nobody has imported."""
    folder = tmp_path / "libraries"
    (folder / "a_library").mkdir(parents=True)
    (folder / "a_library" / "__init__.py").write_text("raise SystemExit('imported')\n")
    (folder / "a_module.py").write_text("raise SystemExit('imported')\n")
    (folder / "a_folder").mkdir()
    monkeypatch.syspath_prepend(folder)
    return folder


@pytest.mark.parametrize("name", ["a_library", "a_module"])
def test_a_name_that_can_be_imported(run: Command, tmp_path: Path, importable: Path, name: str) -> None:
    text = refused(run, tmp_path / name)
    assert f"a module named '{name}' exists already ({importable / name}" in text
    assert not (tmp_path / name).exists()


def test_names_that_hide_no_library(run: Command, tmp_path: Path, importable: Path) -> None:
    """A folder that is no package, one of ours elsewhere on the path, and what stands beside the package."""
    assert build(run, tmp_path / "a_folder").code == 0
    for out in (importable / "ours", importable / "ours", tmp_path / "ours", importable / "a_module"):
        result = process("compile", "--links", "1", "--backend", "numpy", "--functions", "energy", "--out", str(out),
                         "--force", PYTHONPATH=f"{importable}{os.pathsep}{ROOT}")  # fmt: skip
        assert (result.code, result.err) == (0, "")


def test_a_parent_that_is_missing(run: Command, tmp_path: Path) -> None:
    assert f"the folder {tmp_path / 'none'} does not exist" in refused(run, tmp_path / "none" / "package")
    assert list(tmp_path.iterdir()) == []


def test_a_parent_that_is_a_file(run: Command, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert "does not exist" in refused(run, tmp_path / "file" / "package")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_parent_without_permission(run: Command, tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    try:
        assert "cannot be written" in refused(run, tmp_path / "package")
    finally:
        tmp_path.chmod(0o755)


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder in which nobody can write")
def test_a_parent_in_which_nobody_can_write(run: Command) -> None:
    """Root too: /proc takes no files."""
    assert "cannot be written" in refused(run, "/proc/package")


@pytest.mark.parametrize("step", ["copytree", "rename"])
@pytest.mark.parametrize("force", [False, True])
def test_never_half_written(
    run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str, force: bool
) -> None:
    """The disk fills up while the package is put in place: what stood there before stands there after."""
    import shutil

    out = tmp_path / f"whole_{step}_{force}"
    if force:
        assert build(run, out).code == 0
    before = contents(tmp_path)
    copy, rename = shutil.copytree, Path.rename

    def full(source: object, target: object, **options: object) -> None:
        copy(source, target, **options)  # type: ignore[call-overload]
        raise OSError(28, "No space left on device")

    def stuck(self: Path, target: Path) -> Path:
        if target == out and "old" not in self.parts:
            raise OSError(28, "No space left on device")
        return rename(self, target)

    with monkeypatch.context() as patch:
        if step == "copytree":
            patch.setattr(shutil, "copytree", full)
        else:
            patch.setattr(Path, "rename", stuck)
        text = refused(run, out, "--fold", *(["--force"] if force else []))
    assert "cannot be written (No space left on device)" in text
    assert contents(tmp_path) == before


def test_a_failing_build_leaves_no_folder(run: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from eomgen import pipeline

    def publish(*arguments: object) -> Path:
        raise BuildError("no build today")

    monkeypatch.setattr(pipeline.cache, "publish", publish)
    out = tmp_path / "never"
    command = ("compile", "--links", "1", "--backend", "numpy", "--out", str(out))
    assert run.fails(*command, code=3) == "no build today"
    assert list(tmp_path.iterdir()) == []


# Interruptions


def test_interrupted(run: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*arguments: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "show", interrupt)
    assert run("show", "--links", "1") == Result(130, "", "eomgen: interrupted\n")


def test_a_reader_that_goes_away() -> None:
    """`eomgen show ... | head -1` ends without a complaint."""
    command = f"{sys.executable} -m eomgen show --links 6 | head -1"
    done = subprocess.run(["sh", "-c", command], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout == "chain6: 6 links, 12 coordinates, method matrix\n"
    assert done.stderr == ""


def test_bench_outside_a_checkout(run: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(cli, "__file__", str(tmp_path / "eomgen" / "cli.py"))
    assert "the benchmarks are not part of the installed package; run eomgen bench in a checkout" in run.fails(
        "bench", "table1"
    )


def test_bench_runs_the_suite(run: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The exit code and arguments of a suite, a module or a package, in the user's folder."""
    here = tmp_path / "here"
    (here / "bench").mkdir(parents=True)
    (here / "bench" / "__init__.py").write_text("raise SystemExit('a folder of the user')\n")
    monkeypatch.chdir(here)
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "__init__.py").touch()
    (tmp_path / "bench" / "quick.py").write_text(
        "import sys\nfrom pathlib import Path\n\ndef main():\n"
        "    Path('ran').write_text(' '.join(sys.argv[1:]))\n    return 1\n\nsys.exit(main())\n"
    )
    monkeypatch.setattr(cli, "__file__", str(tmp_path / "eomgen" / "cli.py"))
    assert run("bench", "quick", "--links", "1..5").code == 1
    assert (here / "ran").read_text() == "--links 1..5"
    (tmp_path / "bench" / "long").mkdir()
    (tmp_path / "bench" / "long" / "__main__.py").write_text("raise SystemExit(3)\n")
    assert run("bench", "long").code == 3
    assert "unknown benchmark suite 'quik'; allowed: long, quick (did you mean 'quick'?)" in run.fails("bench", "quik")


@pytest.mark.skipif(not (ROOT / "results" / "speed.json").is_file(), reason="needs results of the suite")
def test_paths_of_bench_start_from_the_current_folder(
    run: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kept.json").write_bytes((ROOT / "results" / "speed.json").read_bytes())
    assert run("bench", "speed", "--from-json", "kept.json", "--out", "there").code in (0, 1)  # 1: a cell had failed
    assert sorted(path.name for path in (tmp_path / "there").iterdir()) == ["speed.md", "speed.png"]


def test_bench_writes_to_the_results_of_the_checkout(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from bench import pareto

    monkeypatch.chdir(tmp_path)
    assert pareto.parse([]).out == str(ROOT / "results")
    assert pareto.parse(["--out", "there"]).out == "there"


# The catalogue of a scene file


@pytest.mark.parametrize("model", LINK_TYPES)
def test_a_file_is_the_chain_it_describes(run: Command, tmp_path: Path, model: str) -> None:
    from eomgen.catalog import chain

    path = tmp_path / "chain.toml"
    path.write_text(chain(2, model).to_toml())
    assert load_scene(path) == chain(2, model)
    assert run("show", str(path)).out == run("show", "--links", "2", "--model", model).out
