"""What every benchmark suite needs around its measurements: the machine, tables, plots, a command line."""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NoReturn

from eomgen import backends
from eomgen.errors import BuildError, EomgenError, OptionError, UnsupportedError, one_line, shown
from eomgen.version import __version__

ROOT = Path(__file__).resolve().parent.parent
UNITS = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "ns": 1e-9}
MET = {True: "yes", False: "**no**", None: "–"}  # in a table of targets


class Parser(argparse.ArgumentParser):
    """Argument errors in the one-line form of all others."""

    def error(self, message: str) -> NoReturn:
        """Ends the process with the message and exit code 2."""
        self.exit(2, f"eomgen: error: {one_line(message, 600)}; see {self.prog} --help\n")


def command(main: Callable[[], int]) -> int:
    """Runs a suite and returns its exit code; an error the user can cause is one line."""
    try:
        return main()
    except EomgenError as error:
        print(f"eomgen: error: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("eomgen: interrupted", file=sys.stderr)
        return 130


def require(package: str, purpose: str, extra: str) -> None:
    """Checks that a package is installed.

    Args:
        package: the module to be found.
        purpose: what it is needed for.
        extra: the extra of pyproject.toml that has it.

    Raises:
        UnsupportedError: it is not.
    """
    if find_spec(package) is None:
        raise UnsupportedError(f"{purpose} needs {package}, which is not installed; run pip install -e .[{extra}]")


def progress(text: str) -> None:
    """Shows a line on standard error at once."""
    print(text, file=sys.stderr, flush=True)


def cell_name(stage: str, path: str, kind: str, links: int) -> str:
    """The head of a progress line."""
    return f"{stage:<15}  {path:<18}  {kind:<12}  {links:>4} links  "


def machine(packages: Iterable[str]) -> dict[str, Any]:
    """What a time depends on: processor, system, compiler, versions, commit, date and load."""
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "cpu": _processor(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "load": round(os.getloadavg()[0], 2),
        "system": platform.platform(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        **_compiler(),
        "commit": _commit(),
        "packages": {"eomgen": __version__, **{name: _version(name) for name in packages}},
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _compiler() -> dict[str, str]:
    try:
        facts = backends.select("c").facts(False, ())
    except BuildError as error:
        return {"compiler": str(error), "flags": ""}
    return {"compiler": facts["compiler"], "flags": facts["flags"]}


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def _commit() -> str:
    """The checked-out commit, with a mark where sources differ from it (results do not count)."""
    try:
        commit = _git("rev-parse", "HEAD")
        changed = _git("status", "--porcelain", "--", ".", ":!results")
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return f"{commit} with changes" if changed else commit


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60)
    return done.stdout.strip()


def describe_machine(facts: Mapping[str, Any]) -> str:
    """The machine as a Markdown list."""
    packages = ", ".join(f"{name} {version}" for name, version in facts["packages"].items())
    return "\n".join(
        [
            f"* {facts['cpu']}, {facts['cores']} cores, load {facts['load']} at the start; {facts['system']}",
            f"* {facts['python']}; {packages}",
            f"* {facts['compiler']}; flags `{facts['flags']}`",
            f"* {facts['date']}; commit {facts['commit']}",
        ]
    )


def unit(seconds: float) -> tuple[str, float]:
    """The unit that suits a time, and its size in seconds."""
    return next(((name, size) for name, size in UNITS.items() if seconds >= 0.9995 * size), ("ns", UNITS["ns"]))


def seconds(value: float) -> str:
    """A time to three digits: 213 µs, 4.06 ms, 12.3 s."""
    name, size = unit(value)
    return f"{digits(value / size)} {name}"


def digits(value: float) -> str:
    """A positive number to three digits, without an exponent."""
    places = 2 if value < 9.995 else 1 if value < 99.95 else 0
    return f"{value:.{places}f}"


def span(values: Sequence[float]) -> str:
    """The smallest and the largest of some positive numbers."""
    return f"({digits(min(values))} – {digits(max(values))})"


def whole(number: float) -> str:
    """A number without its fraction, its thousands apart."""
    return f"{number:,.0f}".replace(",", " ")


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; all columns but the first are aligned to the right."""
    cells = [list(header), *([text.replace("|", "\\|") for text in row] for row in rows)]
    widths = [max(3, *(len(row[column]) for row in cells)) for column in range(len(header))]
    lines = [
        "| "
        + " | ".join(
            text.ljust(width) if column == 0 else text.rjust(width)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        )
        + " |"
        for row in cells
    ]
    rule = "|" + "|".join("-" * (width + 1) + (":" if column else "-") for column, width in enumerate(widths)) + "|"
    return "\n".join([lines[0], rule, *lines[1:]])


def folder(path: str) -> Path:
    """The output folder, made if need be.

    Raises:
        OptionError: it cannot be made or written.
    """
    place = Path(path).expanduser().absolute()
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OptionError(f"output folder {one_line(path, 200)} cannot be made ({error.strerror})") from None
    if not os.access(place, os.W_OK):
        raise OptionError(f"output folder {one_line(path, 200)} cannot be written")
    return place


def write(path: Path, text: str) -> None:
    """Writes a file in one step; nobody sees half of it."""
    private = path.with_name(f".{path.name}.{os.getpid()}")
    private.write_text(text, encoding="utf-8", newline="\n")
    private.replace(path)


@dataclass(frozen=True)
class Series:
    """A curve of a plot.

    Attributes:
        label: its entry in the legend; series of one label look alike and share the entry.
        points: (x, y), both positive.
        color: a Matplotlib colour.
        marker: a Matplotlib marker.
        line: a Matplotlib line style, "" for markers alone.
        heavy: whether the curve stands out.
    """

    label: str
    points: Sequence[tuple[float, float]]
    color: str
    marker: str
    line: str = "-"
    heavy: bool = False


def log_log(
    path: Path, panels: Mapping[str, Sequence[Series]], title: str, x: str, y: str, marks: Mapping[float, str]
) -> None:
    """Writes a picture of panels side by side with common axes, both logarithmic, and one legend below.

    Args:
        path: the file.
        panels: title -> curves.
        title: the title of the picture.
        x, y: what the axes show; the numbers of "time" are seconds and get units.
        marks: y -> text of horizontal marks.
    """
    from matplotlib.ticker import NullLocator

    figure, axes = pyplot().subplots(1, len(panels), figsize=(5.2 * len(panels) + 0.8, 7.4), sharey=True, squeeze=False)
    entries: dict[str, Any] = {}
    ticks: set[float] = set()
    for axis, (name, curves) in zip(axes[0], panels.items(), strict=True):
        for curve in curves:
            xs, ys = [point[0] for point in curve.points], [point[1] for point in curve.points]
            ticks.update(xs)
            (drawn,) = axis.plot(
                xs,
                ys,
                color=curve.color,
                marker=curve.marker,
                linestyle=curve.line or "none",
                linewidth=2.2 if curve.heavy else 1.1,
                markersize=(6 if curve.line else 9) if curve.heavy else 5,
                markerfacecolor=curve.color if curve.heavy else "white",
                zorder=3 if curve.heavy else 2,
            )
            entries.setdefault(curve.label, drawn)
        axis.set(xscale="log", yscale="log", title=name, xlabel=x)
        axis.grid(True, which="major", color="0.85", linewidth=0.6)
    shown = [tick for tick in (1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000) if tick <= max(ticks, default=1)]
    for axis in axes[0]:
        for value, text in marks.items():
            axis.axhline(value, color="0.4", linewidth=0.8, linestyle=(0, (6, 4)), zorder=1)
            axis.annotate(text, (0.99, value), (0, 3), xycoords=("axes fraction", "data"), textcoords="offset points",
                          ha="right", fontsize=8, color="0.35")  # fmt: skip
        axis.set_xlim(0.85, 1.2 * shown[-1])
        axis.set_xticks(shown, [str(tick) for tick in shown])
        axis.xaxis.set_minor_locator(NullLocator())
        number(axis.yaxis, _time if y == "time" else "{:g}".format)
    axes[0][0].set_ylabel(y)
    figure.suptitle(title)
    columns = -(-len(entries) // 3)
    figure.legend(entries.values(), entries.keys(), loc="lower center", ncols=columns, fontsize=9, frameon=False)
    figure.tight_layout(rect=(0, 0.115, 1, 1))
    save(figure, path, dpi=120)


def _time(value: float) -> str:
    """A power of ten of seconds: 10 ms."""
    name, size = unit(value)
    return f"{value / size:.0f} {name}"


def pyplot() -> Any:
    """Matplotlib's plots, drawn to files."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot


def number(axis: Any, text: Callable[[float], str] = "{:g}".format) -> None:
    """Writes numbers at the ticks of a logarithmic axis without powers of ten, and none at those between them."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axis.set_major_formatter(FuncFormatter(lambda value, _: text(value)))
    axis.set_minor_formatter(NullFormatter())


def save(figure: Any, path: Path, dpi: int) -> None:
    """Writes a Matplotlib figure in one step and closes it; nobody sees half of it."""
    private = path.with_name(f".{os.getpid()}.{path.name}")
    figure.savefig(private, dpi=dpi, metadata={"Software": None})
    private.replace(path)
    pyplot().close(figure)


def load(path: str, suite: str) -> dict[str, Any]:
    """The contents of the JSON that a suite wrote.

    Raises:
        OptionError: it cannot be read, or is something else.
    """
    try:
        found: dict[str, Any] = json.loads(Path(path).read_text(encoding="utf-8"))
        if found["suite"] == suite and found["records"] is not None:
            return found
    except OSError as error:
        raise OptionError(f"--from-json {shown(path)} cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError):
        pass
    raise OptionError(f"--from-json {shown(path)} is no {suite}.json; give a file that eomgen bench {suite} wrote")


def add_out(parser: argparse.ArgumentParser) -> None:
    """Adds the output folder."""
    default = str(ROOT / "results")
    parser.add_argument("--out", default=default, metavar="DIR", help="output folder (results of the checkout)")


def add_output(parser: argparse.ArgumentParser) -> None:
    """Adds the options that `produce` reads."""
    add_out(parser)
    parser.add_argument("--from-json", metavar="FILE", help="measure nothing; make table and plot from this file")


def produce(
    suite: str,
    options: argparse.Namespace,
    measure: Callable[[], dict[str, Any]],
    render: Callable[[dict[str, Any]], str],
    plot: Callable[[dict[str, Any], Path], None],
) -> dict[str, Any]:
    """Writes a suite's JSON, unless it is given by `--from-json`, and from it the table and the plot.

    Args:
        suite: its name.
        options: of the command line.
        measure: gives the contents of the JSON.
        render: makes the text of the table from them.
        plot: writes the plot from them.

    Returns:
        the contents of the JSON.

    Raises:
        OptionError: the folder cannot be written, or the JSON not be read.
    """
    place = folder(options.out)
    if options.from_json:
        found = load(options.from_json, suite)
    else:
        found = measure()
        write(place / f"{suite}.json", dumped(found))
    write(place / f"{suite}.md", render(found))
    plot(found, place / f"{suite}.png")
    print(f"wrote {place / suite}.md and {suite}.png" + ("" if options.from_json else f" and {suite}.json"))
    return found


def dumped(found: Mapping[str, Any]) -> str:
    """The JSON with a line for each record."""
    lines = [json.dumps(record, ensure_ascii=False) for record in found["records"]]
    rest = {key: value for key, value in found.items() if key != "records"}
    head = json.dumps({**rest, "records": []}, indent=1, ensure_ascii=False).removesuffix("[]\n}")
    return head + "[\n  " + ",\n  ".join(lines) + "\n ]\n}\n"
