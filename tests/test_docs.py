"""The examples of README.md, CONTRIBUTING.md and docs/*.md run, in the order in which a reader meets them.

By the language of a fenced block:

* python: runs; all blocks of a file share their names
* toml, c: becomes the file that its first line names, if that is a comment with a file name; toml must load
* console: every line `$ eomgen ...` must end with exit code 0; in a C file's wake also `$ cc ...` and `$ ./...`
* console exact: the same, and what stands below the commands is what they print
* text, anything else: not run; right below a python block, text is what that block prints
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

import eomgen
from eomgen import cli

ROOT = Path(__file__).resolve().parent.parent
PAGES = ["README.md", "CONTRIBUTING.md", *(f"docs/{path.name}" for path in sorted((ROOT / "docs").glob("*.md")))]
EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"(?:#|/\*) ([\w./]+\.(?:toml|c))(?: \*/)?$")
LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


class Fenced(NamedTuple):
    """A fenced block: its language, its text, the line it begins on."""

    language: str
    text: str
    line: int


def blocks(page: str) -> Iterator[Fenced]:
    """The fenced blocks of a page."""
    text = (ROOT / page).read_text(encoding="utf-8")
    for match in FENCE.finditer(text):
        yield Fenced(match[1].strip(), match[2], text.count("\n", 0, match.start()) + 2)


def compiler() -> list[str]:
    """The C compiler that builds the modules."""
    return shlex.split(os.environ.get("CC") or "cc")


class Reader:
    """Does what a page says, in the current folder."""

    def __init__(self, page: str, capsys: pytest.CaptureFixture[str]) -> None:
        self.page, self.capsys = page, capsys
        self.names: dict[str, object] = {"__name__": page}
        self.printed = ""  # by the block before, if it was Python

    def read(self, block: Fenced) -> None:
        """Runs one block."""
        printed, self.printed = self.printed, ""
        if block.language == "python":
            # Blank lines above, so that a traceback shows the line of the page.
            code = compile("\n" * (block.line - 1) + block.text, str(ROOT / self.page), "exec")
            self.capsys.readouterr()
            exec(code, self.names)
            self.printed = self.capsys.readouterr().out
        elif block.language == "text" and printed:
            assert block.text == printed, f"{self.page}, line {block.line}"
        elif block.language in ("toml", "c"):
            self.keep(block)
        elif block.language in ("console", "console exact"):
            self.console(block)

    def keep(self, block: Fenced) -> None:
        """Writes a block to the file that its first line names."""
        named = FILE.match(block.text.split("\n", 1)[0])
        path = Path(named[1] if named else "scene.toml")
        path.write_text(block.text, encoding="utf-8")
        if path.suffix == ".toml":
            eomgen.load_scene(path)

    def console(self, block: Fenced) -> None:
        """Runs the commands of a console block."""
        shown: list[str] = []
        printed = ""
        for line in block.text.splitlines():
            if line.startswith("$ "):
                printed += self.command(line[2:], f"{self.page}, {line}")
            else:
                shown.append(line)
        if block.language == "console exact":
            assert "\n".join(shown) == printed.rstrip("\n"), f"{self.page}, line {block.line}"

    def command(self, line: str, where: str) -> str:
        """Runs a command that is ours and returns what it prints; others (make, git, pip) are left alone."""
        words = shlex.split(line, comments=True)
        if words[0] == "eomgen":
            self.capsys.readouterr()
            try:
                code = cli.main(words[1:])
            except SystemExit as end:  # argparse: --help, or a bad option
                code = int(end.code or 0)
            output = self.capsys.readouterr()
            assert code == 0, f"{where}: exit code {code}: {output.err}"
            return output.out
        if words[0] == "cc" or words[0].startswith("./"):
            given = [*compiler(), *words[1:]] if words[0] == "cc" else words
            done = subprocess.run(given, capture_output=True, text=True, check=False)
            assert done.returncode == 0, f"{where}: exit code {done.returncode}: {done.stderr}"
            return done.stdout
        return ""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder to work in, with the examples and on the path; what is imported from it is forgotten."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None) or "").startswith(str(tmp_path)):
            del sys.modules[name]


@pytest.mark.parametrize("page", PAGES)
def test_examples_run(page: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reader = Reader(page, capsys)
    for block in blocks(page):
        reader.read(block)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_example_scenes_load(path: Path) -> None:
    scene = eomgen.load_scene(path)
    assert scene.name == path.stem


def test_walker_file_is_the_walker() -> None:
    assert eomgen.load_scene(ROOT / "examples" / "walker.toml") == eomgen.walker()


def test_leg_file_is_the_one_shown() -> None:
    """docs/scenes.md shows examples/leg.toml."""
    (shown,) = [block.text for block in blocks("docs/scenes.md") if block.text.startswith("# leg.toml")]
    kept = (ROOT / "examples" / "leg.toml").read_text(encoding="utf-8")
    assert shown.partition("\n")[2] == kept.partition("\n\n")[2]


def test_readme_shows_what_the_demo_prints(folder: Path) -> None:
    """The accelerations of the README are those that examples/five_links.py prints."""
    script = [sys.executable, str(ROOT / "examples" / "five_links.py")]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(script, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for line in done.stdout.splitlines():
        assert line in readme or "from zero" in line  # that one is rounding, and differs between machines


def test_readme_shows_what_compile_counts(capsys: pytest.CaptureFixture[str]) -> None:
    """The form and the table of functions in the README are what `eomgen compile` prints."""
    assert cli.main(["compile", "--links", "5", "--method", "matrix", "--backend", "numpy"]) == 0
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    counted = [line for line in capsys.readouterr().out.splitlines() if "->" in line or line.startswith("form")]
    assert len(counted) == 7
    assert all(line in readme for line in counted)


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    """Links to files and to headings exist."""
    text = (ROOT / page).read_text(encoding="utf-8")
    for target in LINK.findall(FENCE.sub("", text)):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        path = (ROOT / page).parent / name if name else ROOT / page
        assert path.exists(), f"{page}: {target}"
        if anchor:
            titles = HEADING.findall(FENCE.sub("", path.read_text(encoding="utf-8")))
            assert anchor in {slug(title) for title in titles}, f"{page}: {target}"


def slug(title: str) -> str:
    """The anchor of a heading."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
