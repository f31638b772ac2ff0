"""Table 1 of the paper, reproduced and extended: the time to generate the equations of motion.

`eomgen bench table1` measures eomgen's methods (through pytest-benchmark, `bench.test_generation`) and other ways
to the same equations (`bench.generation`), checks every cell for identical dynamics and writes `table1.json`;
`table1.md` and `table1.png` are made from that file alone.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from bench import report
from bench.generation import CONTENDERS
from bench.generation.mechanism import NOMINAL
from bench.process import require_posix
from eomgen.errors import CheckError, OptionError, one_line, shown, unknown

METHODS = ("lagrange", "recursive", "matrix", "articulated")
DENSE = METHODS[:3]  # the mass matrix and the bias; articulated is the accelerations, in O(n)
KINDS = {"point-masses": "point masses, free lengths", "elastic-rod": "elastic rods, free lengths", "rigid": "rigid"}
PAPER = Path(__file__).with_name("paper.toml")
PACKAGES = ("numpy", "sympy", "casadi", "symengine", "cython", "msgspec", "pytest", "pytest-benchmark")

LADDER = (1, 2, 3, 4, 5, 7, 10, 14, 20, 30, 50, 100, 200, 500, 1000)
CONTENDER_LADDER = (1, 2, 3, 5, 7, 10, 20, 50)  # fewer, as every cell is several processes
LONG = (100, 1000)  # added for articulated where the range reaches 50
DENSE_UP_TO = 100
STAGED = (1, 2, 3, 5, 10)  # links for which code generation and compilation are timed too
STAGED_LONG = (100, 1000)  # the same for articulated
AT_ONCE = 2  # contender cells that are expected to take over LONG_CELL seconds run this many at a time
LONG_CELL = 5.0

FRONT_END, FRESH, CODE, BUILD = "front end", "fresh process", "code generation", "compilation"

LABELS = {
    "lagrange": "eomgen lagrange",
    "recursive": "eomgen recursive",
    "matrix": "eomgen matrix",
    "articulated": "eomgen articulated",
    "sympy_lagrange": "SymPy LagrangesMethod",
    "sympy_kane": "SymPy KanesMethod",
    "sympy_matrix": "SymPy, matrix method",
    "casadi_lagrange": "CasADi, Lagrange",
    "casadi_matrix": "CasADi, matrix method",
    "symengine_lagrange": "SymEngine, Lagrange",
    "symengine_matrix": "SymEngine, matrix method",
}
STYLES = {  # colour, marker, line
    "lagrange": ("#0072b2", "o", "-"),
    "recursive": ("#009e73", "s", "-"),
    "matrix": ("#d55e00", "D", "-"),
    "articulated": ("#000000", "^", "-"),
    "sympy_lagrange": ("#cc3311", "o", "--"),
    "sympy_kane": ("#cc3311", "v", "-."),
    "sympy_matrix": ("#cc3311", "D", ":"),
    "casadi_lagrange": ("#7a7a7a", "o", "--"),
    "casadi_matrix": ("#7a7a7a", "D", ":"),
    "symengine_lagrange": ("#aa4499", "o", "--"),
    "symengine_matrix": ("#aa4499", "D", ":"),
}
PAPER_STYLE = {"lagrange": ("#0072b2", "*"), "recursive": ("#009e73", "P"), "matrix": ("#d55e00", "X")}

Record = dict[str, Any]


class Sizes(NamedTuple):
    """Numbers of links to measure."""

    dense: tuple[int, ...]
    articulated: tuple[int, ...]
    contenders: tuple[int, ...]


def sizes(text: str) -> Sizes:
    """The sizes that `--links` asks for: a range "1..50" (steps of about √2 in it) or a list "1,3,9".

    Raises:
        OptionError: it is neither, or a number is not from 1 to 1000.
    """
    first, dots, last = text.partition("..")
    words = [first, last] if dots else text.split(",")
    numbers = [int(word) if re.fullmatch(r"\s*[0-9]{1,9}\s*", word) else 0 for word in words]
    if not all(1 <= n <= LADDER[-1] for n in numbers) or (dots and numbers[0] > numbers[1]):
        raise OptionError(
            f"--links {shown(text)} is not allowed; give a range such as 1..50 or a list such as 1,3,10, "
            f"of numbers from 1 to {LADDER[-1]}"
        )
    if not dots:
        chosen = sorted(set(numbers))
        return Sizes(tuple(n for n in chosen if n <= DENSE_UP_TO), tuple(chosen), tuple(n for n in chosen if n <= 50))
    low, high = numbers
    ladder = sorted({low, high} | {n for n in LADDER if low <= n <= high})
    long = LONG if high >= 50 else ()
    return Sizes(
        dense=tuple(n for n in ladder if n <= DENSE_UP_TO),
        articulated=tuple(sorted({*ladder, *long})),
        contenders=tuple(n for n in CONTENDER_LADDER if low <= n <= high),
    )


class Settings(NamedTuple):
    """What one run measures.

    Attributes:
        cells: [method, kind, links] by stage, for pytest.
        fresh: (method, kind, links) to measure in fresh processes.
        contenders: (contender, kind) -> links, ascending.
        limit: seconds for a derivation.
        budget: seconds of timed rounds in a cell.
        repeats: fresh processes per cell, of which the median counts, ...
        repeated: ... where a derivation takes less than these seconds.
    """

    cells: dict[str, list[list[Any]]]
    fresh: list[tuple[str, str, int]]
    contenders: dict[tuple[str, str], tuple[int, ...]]
    limit: float
    budget: float
    repeats: int = 3
    repeated: float = LONG_CELL


def settings(chosen: Sizes, kinds: Sequence[str], limit: float, contenders: bool) -> Settings:
    """The full sweep."""
    links = {method: chosen.articulated if method == "articulated" else chosen.dense for method in METHODS}
    staged = [
        [method, kind, n]
        for kind in kinds
        for method in METHODS
        for n in links[method]
        if n in STAGED or (method == "articulated" and n in STAGED_LONG)
    ]
    fresh = [(method, kind, n) for kind in kinds for method in METHODS for n in links[method] if n <= 3]
    fresh += [(method, "rigid", n) for method in METHODS for n in links[method] if n in (50, 1000) and "rigid" in kinds]
    return Settings(
        cells={
            FRONT_END: [[method, kind, n] for kind in kinds for method in METHODS for n in links[method]],
            CODE: staged,
            BUILD: staged,
        },
        fresh=fresh,
        contenders={(name, kind): chosen.contenders for kind in kinds for name in CONTENDERS if contenders},
        limit=limit,
        budget=0.3,
    )


def quick_settings(kinds: Sequence[str], limit: float, contenders: bool) -> Settings:
    """A sweep of the cells that the targets need, for a look within seconds."""
    cells: list[list[Any]] = [[method, kind, n] for kind in kinds for method in METHODS for n in (1, 3, 10)]
    long = [(method, 50) for method in ("recursive", "matrix")] + [("articulated", 1000)]
    cells += [[method, "rigid", n] for method, n in long if "rigid" in kinds]
    staged: list[list[Any]] = [[method, kinds[0], 3] for method in METHODS[2:]]
    fresh = [(method, kind, 3) for kind in kinds for method in METHODS if kind != "rigid"]
    fresh += [(method, "rigid", 50) for method in ("recursive", "matrix") if "rigid" in kinds]
    peers: dict[tuple[str, str], tuple[int, ...]] = {
        (name, kind): (3, 50) if kind == "rigid" and not name.startswith("sympy") else (3,)
        for kind in kinds
        for name in CONTENDERS
        if contenders
    }
    cells_by_stage = {FRONT_END: cells, CODE: staged, BUILD: staged}
    return Settings(cells_by_stage, fresh, peers, min(limit, 15.0), budget=0.03, repeated=0.01)


# Measuring. A record has path, kind, links and stage; seconds (the median), iqr, min, rounds, check and
# max_error; and a problem, which is empty in a cell that counts.


def measure_rounds(plan: Settings) -> list[Record]:
    """The cells of pytest-benchmark, run in a process of their own.

    Raises:
        CheckError: pytest did not get as far as measuring.
    """
    with tempfile.TemporaryDirectory(prefix="eomgen-bench-") as place:
        results, junit, log = (Path(place) / name for name in ("benchmark.json", "junit.xml", "pytest.log"))
        heard = os.dup(2)
        options = {**plan.cells, "limit": plan.limit, "budget": plan.budget, "progress": heard}
        environment = {**os.environ, "EOMGEN_CACHE": f"{place}/cache", "EOMGEN_TABLE1_PLAN": json.dumps(options)}
        command = [sys.executable, "-m", "pytest", "bench/test_generation.py", "-q", "--benchmark-only"]
        command += ["--capture=no", "-p", "no:cacheprovider", f"--basetemp={place}/tests"]
        command += ["-W", "ignore::pytest_benchmark.logger.PytestBenchmarkWarning"]  # a cell that fails untimed
        command += [f"--benchmark-json={results}", f"--junitxml={junit}"]
        with log.open("w") as stream:
            code = subprocess.run(
                command, cwd=report.ROOT, env=environment, stdout=stream, stderr=stream, pass_fds=[heard], check=False
            ).returncode
        os.close(heard)
        if code not in (0, 1) or not junit.is_file():
            lines = log.read_text(errors="replace").strip().splitlines() or [""]
            raise CheckError(f"pytest ended with exit code {code}: {one_line(lines[-1], 300)}")
        measured = json.loads(results.read_text())["benchmarks"] if results.is_file() else []
        records = [_round_record(item) for item in measured]
        return records + list(_failures(junit))


def _round_record(item: Mapping[str, Any]) -> Record:
    stats = item["stats"]
    times = {"seconds": stats["median"], "iqr": stats["iqr"], "min": stats["min"], "rounds": stats["rounds"]}
    return {**item["extra_info"], **times, "problem": ""}


def _failures(junit: Path) -> Iterator[Record]:
    """The cells that have no time, with the reason."""
    for case in ElementTree.parse(junit).iter("testcase"):
        for failure in [*case.iter("failure"), *case.iter("error")]:
            name, _, rest = case.get("name", "").removeprefix("test_").partition("[")
            method, kind, links = rest.removesuffix("]").split("/")
            reason = failure.get("message", "").removeprefix("Failed: ").partition("\n")[0]
            reason = reason if reason.startswith((">", "error: ")) else f"error: {reason}"
            cell = {"path": method, "kind": kind, "links": int(links), "stage": name.replace("_", " ")}
            yield {**cell, "problem": one_line(reason, 160)}


def measure_fresh(plan: Settings) -> list[Record]:
    """eomgen under the protocol of the contenders: the first derivation of a fresh process."""
    records = []
    for method, kind, links in plan.fresh:
        command = [sys.executable, "-m", "bench.test_generation", method, kind, str(links)]
        first = _process(command, plan.limit)
        more = [*command, "unchecked"]
        records.append(_show(_merged(first, more, plan, path=method, kind=kind, links=links)))
    return records


def measure_contenders(plan: Settings) -> list[Record]:
    """Every contender on every kind, with more links until it takes too long.

    Cells that take seconds are measured once; those that are expected to are left for the end, when two run
    at a time.
    """
    series = [_Contender(name, kind, links, plan) for (name, kind), links in plan.contenders.items()]
    for contender in series:
        contender.advance(LONG_CELL)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        list(pool.map(lambda contender: contender.advance(math.inf), series))
    return [record for contender in series for record in contender.records]


class _Contender:
    """One contender on one kind, from few links to many."""

    def __init__(self, name: str, kind: str, links: Sequence[int], plan: Settings) -> None:
        self.name, self.kind, self.plan = name, kind, plan
        self.left = list(links)
        self.records: list[Record] = []

    def advance(self, until: float) -> None:
        """Measures cells until none is left or the next is expected to take longer than `until` seconds."""
        while self.left and (expected := self._expected(self.left[0])) <= until:
            cell = {"path": self.name, "kind": self.kind, "links": self.left.pop(0)}
            limit, package = self.plan.limit, self.name.split("_")[0]
            if find_spec(package) is None:
                self.records.append(_show({**cell, "stage": FRESH, "problem": "not installed"}))
                self.left.clear()
            elif expected > 1.25 * limit:
                record = {**cell, "stage": FRESH, "problem": f"> {limit:g} s", "expected": expected}
                self.records.append(_show(record))
                self.left.clear()
            else:
                self._measure(cell)

    def _measure(self, cell: Record) -> None:
        words = [self.name, self.kind, str(cell["links"])]
        command = [sys.executable, "-m", "bench.generation.one", *words]
        first = _process(command, self.plan.limit)
        self.records.append(_show(_merged(first, command, self.plan, **cell)))
        if self.records[-1]["problem"]:
            self.left.clear()

    def _expected(self, links: int) -> float:
        """Seconds for a size by the growth of the two before; n² where there is but one."""
        known = [(record["links"], record["seconds"]) for record in self.records if not record["problem"]]
        if not known:
            return 0.0
        (n, seconds), growth = known[-1], 2.0
        if len(known) > 1:
            before, less = known[-2]
            growth = max(math.log(seconds / less) / math.log(n / before), 0.0)
        return float(seconds * (links / n) ** growth)


def _process(command: Sequence[str], limit: float) -> Record:
    """The record that a fresh process prints. The limit is for the derivation; 30 s more are for the rest."""
    try:
        done = subprocess.run(command, cwd=report.ROOT, capture_output=True, text=True, timeout=limit + 30, check=False)
    except subprocess.TimeoutExpired:
        return {"problem": f"> {limit:g} s"}
    try:
        record: Record = json.loads(done.stdout.strip().splitlines()[-1])
    except (IndexError, ValueError):
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        return {"problem": one_line(f"error: {lines[-1]}", 160)}
    if record["seconds"] > limit:
        return {"problem": f"> {limit:g} s"}
    return {**record, "problem": f"error: {record['error']}" if "error" in record else ""}


def _merged(first: Record, again: Sequence[str], plan: Settings, **cell: Any) -> Record:
    """The record of a cell: its first process, and repeats of a short one."""
    runs = [first]
    short = first.get("seconds", math.inf) < plan.repeated
    while short and not runs[-1]["problem"] and len(runs) < plan.repeats:
        runs.append(_process(again, plan.limit))
    record: Record = {**cell, "stage": FRESH, "problem": runs[-1]["problem"]}
    if record["problem"]:
        return record
    times = sorted(run["seconds"] for run in runs)
    quartiles = statistics.quantiles(times, n=4, method="inclusive") if len(times) > 1 else times * 3
    record.update(seconds=statistics.median(times), iqr=quartiles[2] - quartiles[0], min=times[0], rounds=len(times))
    return {**record, "check": first.get("check", "numeric"), "max_error": first["max_error"]}


def _show(record: Record) -> Record:
    """Shows a record and gives it back."""
    what = record["problem"] or report.seconds(record["seconds"])
    report.progress(report.cell_name(record["stage"], record["path"], record["kind"], record["links"]) + what)
    return record


def measure(plan: Settings, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Everything that goes into `table1.json`."""
    start = time.monotonic()
    facts = report.machine(PACKAGES)
    records = measure_rounds(plan) + measure_fresh(plan) + measure_contenders(plan)
    return {
        "suite": "table1",
        "arguments": dict(arguments),
        "limit": plan.limit,
        "machine": facts,
        "published": tomllib.loads(PAPER.read_text(encoding="utf-8")),
        "minutes": round((time.monotonic() - start) / 60, 1),
        "records": records,
    }


# Rendering, from the JSON alone.


class Data:
    """The contents of `table1.json`."""

    def __init__(self, found: Mapping[str, Any]) -> None:
        self.found = found
        self.records: list[Record] = found["records"]
        self.table = {(r["path"], r["kind"], r["links"], r["stage"]): r for r in self.records}
        self.kinds = [kind for kind in KINDS if any(r["kind"] == kind for r in self.records)]
        self.published: dict[str, dict[str, float]] = found["published"]["table1"]

    def seconds(self, path: str, kind: str, links: int, stage: str = FRESH) -> float | None:
        """The time of a cell, if it has one."""
        record = self.table.get((path, kind, links, stage))
        return record["seconds"] if record and not record["problem"] else None

    def cell(self, path: str, kind: str, links: int, stage: str) -> str:
        """A cell as a table shows it."""
        record = self.table.get((path, kind, links, stage))
        if record is None:
            return "–"
        if record["problem"]:
            problem = str(record["problem"])
            return f"{problem} †" if "expected" in record else one_line(problem, 48)
        return report.seconds(record["seconds"])

    def printed(self, method: str, links: int) -> float | None:
        """The paper's time."""
        time_ = self.published.get(method, {})
        return time_.get(str(links)) if isinstance(time_, dict) else None


class Target(NamedTuple):
    """A target: the cell, what was measured, what is asked for, and whether it is met (None: not measured)."""

    cell: str
    measured: str
    target: str
    met: bool | None


def targets(data: Data) -> list[Target]:
    """The targets of generation; 4 and 3 ms of CasADi and SymEngine are those of Lagrange's equations."""
    free = [kind for kind in data.kinds if kind != "rigid"]
    rows = [_against(data, method, kind, 3, "sympy_lagrange", 1000) for kind in free for method in METHODS]
    for name in ("casadi_lagrange", "symengine_lagrange"):
        rows += [_against(data, method, kind, 3, name) for kind in free for method in METHODS]
    if "rigid" in data.kinds:
        rows += [_against(data, method, "rigid", 50, "casadi_lagrange") for method in ("matrix", "recursive")]
    for kind in data.kinds:
        ours = data.seconds("articulated", kind, 1000) or data.seconds("articulated", kind, 1000, FRONT_END)
        if ours is not None:
            rows.append(Target(f"articulated, 1000 {kind} links", report.seconds(ours), "< 500 ms", ours < 0.5))
    return rows


def beyond(data: Data) -> list[Target]:
    """The same against the matrix method written in CasADi and SymEngine, which nobody asked for."""
    names = ("casadi_matrix", "symengine_matrix")
    cells = [(kind, 3) for kind in data.kinds if kind != "rigid"] + [("rigid", 50)] * ("rigid" in data.kinds)
    return [
        _against(data, method, kind, n, name)
        for name in names
        for kind, n in cells
        for method in ("recursive", "matrix")
    ]


def _against(data: Data, method: str, kind: str, links: int, name: str, factor: int = 1) -> Target:
    """Whether a method is `factor` times as fast as a contender, or no slower."""
    ours, theirs = data.seconds(method, kind, links), data.seconds(name, kind, links)
    cell = f"{method}, {links} {kind} links"
    wanted = f"≥ {factor} × faster than {LABELS[name]}" if factor > 1 else f"≤ {LABELS[name]}"
    if ours is None or theirs is None:
        return Target(cell, "not measured", wanted, None)
    measured = f"{report.seconds(ours)} against {report.seconds(theirs)}: {report.digits(theirs / ours)} ×"
    return Target(cell, measured, wanted, ours * factor <= theirs)


def _targets(rows: Iterable[Target]) -> str:
    rows = list(rows)
    if all(row.met is None for row in rows):
        return "None of their cells was measured."
    header = ["cell", "measured", "target", "met"]
    return report.markdown(header, [[row.cell, row.measured, row.target, report.MET[row.met]] for row in rows])


def render(data: Data) -> str:
    """`table1.md`."""
    found, source = data.found, data.found["published"]["source"]
    limit = found["limit"]
    parts = [
        "# Time to generate the equations of motion",
        f"Written by `eomgen bench table1` from `table1.json` ({found['minutes']} minutes). Beside it, "
        f"{source['authors']}, {source['journal']}, Table 1 ({source['program']}; machine {source['machine']}).",
        report.describe_machine(found["machine"]),
        _method(data, limit),
        "## Targets",
        "Fresh processes on both sides; × is how many times longer the other takes.",
        _targets(targets(data)),
        "Beyond the targets: against the matrix method written in CasADi and SymEngine.",
        _targets(beyond(data)),
    ]
    if "point-masses" in data.kinds:
        parts += ["## Beside the published table", _published(data)]
    for kind in data.kinds:
        parts += [f"## Chain of links: {KINDS[kind]}", _sweep(data, kind)]
    if any(ratios := [_ratios(data, kind) for kind in data.kinds]):
        parts += [
            "## Ratios at 3 links",
            "How many times longer each takes than eomgen, fresh processes on both sides.",
        ]
        parts += filter(None, ratios)
    if any(r["stage"] == CODE for r in data.records):
        parts += ["## Stages", *_stages(data)]
    failed = [r for r in data.records if r["problem"].startswith("error")]
    if failed:
        lines = [f"* {r['stage']}, {r['path']}, {r['links']} {r['kind']} links: {r['problem']}" for r in failed]
        parts += ["## Failed cells", "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def _method(data: Data, limit: float) -> str:
    spread = sorted(r["iqr"] / r["seconds"] for r in data.records if not r["problem"] and r["rounds"] > 2)
    quartiles = f"{spread[len(spread) // 2]:.0%} in half of them, {spread[-1]:.0%} in the worst" if spread else "none"
    worst = max((r["max_error"] for r in data.records if not r["problem"]), default=math.nan)
    return (
        "Times are medians of cold derivations: every round has a graph of its own and the scene or mechanism is "
        "all it is given. `lagrange`, `recursive`, `matrix` and all contenders end with the complete mass matrix and "
        "bias, `articulated` with the accelerations. Every eomgen row is measured by pytest-benchmark in one process; "
        "rows of the contenders, and eomgen where it is compared with them, are the first derivation of a fresh "
        "process (median of 3 below 5 s, otherwise one run, two at a time), imports not counted. The garbage "
        "collector is on; before a round of pytest-benchmark what is older is collected or frozen. Every cell is "
        "checked before it counts: eomgen's methods against each other exactly, in a prime field, up to 20 links; "
        "every path against an independent numeric reference "
        f"(largest difference {worst:.0e} of the largest entry). Interquartile range over median, in cells of 3 rounds "
        f"and more: {quartiles}. † not run: by the growth of the two sizes before, it takes more than {limit:g} s. "
        "– not measured."
    )


def _published(data: Data) -> str:
    links = (1, 2, 3)
    rows = []
    for method in DENSE:
        paper = [data.printed(method, n) for n in links]
        ours = [data.seconds(method, "point-masses", n, FRONT_END) for n in links]
        ratio = [f"{p / t:.0f} ×" if p and t else "–" for p, t in zip(paper, ours, strict=True)]
        rows.append(
            [
                method,
                *(f"{p:.3f} s" if p else "–" for p in paper),
                *(report.seconds(t) if t else "–" for t in ours),
                *ratio,
            ]
        )
    sides = ("paper", "eomgen", "ratio")
    return report.markdown(["method", *(f"{side}, {_links(n)}" for side in sides for n in links)], rows)


def _links(n: int) -> str:
    return f"{n} link" if n == 1 else f"{n} links"


def _sweep(data: Data, kind: str) -> str:
    stages = {path: FRONT_END if path in METHODS else FRESH for path in LABELS}
    mine = [r for r in data.records if r["kind"] == kind and stages[r["path"]] == r["stage"]]
    links = sorted({r["links"] for r in mine})
    rows = []
    if kind == "point-masses":
        for method in DENSE:
            printed = [data.printed(method, n) for n in links]
            rows.append([f"paper, {method}", *(f"{p:.3f} s" if p else "–" for p in printed)])
    for path, label in LABELS.items():
        if any(r["path"] == path for r in mine):
            rows.append([label, *(data.cell(path, kind, n, stages[path]) for n in links)])
    return report.markdown(["links", *map(str, links)], rows)


def _ratios(data: Data, kind: str) -> str:
    names = [name for name in CONTENDERS if data.seconds(name, kind, 3) is not None]
    rows = []
    for method in METHODS:
        if ours := data.seconds(method, kind, 3) or data.seconds(method, kind, 3, FRONT_END):
            ratios = [(data.seconds(name, kind, 3) or math.nan) / ours for name in names]
            rows.append([method, report.seconds(ours), *(f"{report.digits(ratio)} ×" for ratio in ratios)])
    return report.markdown([kind, "eomgen", *(LABELS[name] for name in names)], rows) if rows and names else ""


def _stages(data: Data) -> list[str]:
    parts = [
        "Front end (scene to equations), code generation (equations to the C of `forward_dynamics`: elimination, in "
        "the form that `eomgen compile` chooses for the size, passes, text) and compilation (that C to a module; the "
        "wrapper's object exists already)."
    ]
    for kind in data.kinds:
        staged = [r for r in data.records if r["kind"] == kind and r["stage"] == CODE]
        links = sorted({r["links"] for r in staged})
        rows = []
        for method in METHODS:
            for stage in (FRONT_END, CODE, BUILD):
                if any(r["path"] == method for r in staged):
                    rows.append([f"{method}, {stage}", *(data.cell(method, kind, n, stage) for n in links)])
        if rows:
            parts += [report.markdown([f"{kind}, links", *map(str, links)], rows)]
    return parts


def plot(data: Data, path: Path) -> None:
    """`table1.png`: time against links, a panel for each kind."""
    panels: dict[str, list[report.Series]] = {}
    for kind in data.kinds:
        curves = panels.setdefault(KINDS[kind], [])
        for name, (color, marker, line) in STYLES.items():
            stage = FRONT_END if name in METHODS else FRESH
            cells = sorted(
                (r["links"], r["seconds"])
                for r in data.records
                if (r["path"], r["kind"], r["stage"]) == (name, kind, stage) and not r["problem"]
            )
            if cells:
                curves.append(report.Series(LABELS[name], cells, color, marker, line, heavy=name in METHODS))
        if kind == "point-masses":
            for method, (color, marker) in PAPER_STYLE.items():
                points = [(n, p) for n in (1, 2, 3) if (p := data.printed(method, n))]
                label = f"paper 2017, {method}"
                curves.append(report.Series(label, points, color, marker, "", heavy=True))
    title = "Time to generate the equations of motion of a chain"
    limit = data.found["limit"]
    report.log_log(path, panels, title, "links", "time", {limit: f"limit, {limit:g} s"})


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The options, with `sizes` and `kinds` decoded."""
    parser = report.Parser(
        prog="eomgen bench table1",
        description="Times the generation of equations beside the paper's Table 1 and other tools; "
        "writes table1.json, table1.md and table1.png.",
        epilog="examples:\n  eomgen bench table1 --links 1..50        the full sweep, about 10 minutes\n"
        "  eomgen bench table1 --quick              the cells of the targets, under a minute\n"
        "  eomgen bench table1 --from-json results/table1.json",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--links", default="1..50", metavar="A..B", help="a range (default 1..50) or a list: 1,3,10")
    parser.add_argument("--kinds", default=",".join(KINDS), metavar="A,B", help=f"among {', '.join(KINDS)} (all)")
    parser.add_argument("--quick", action="store_true", help="the cells of the targets, with fewer runs")
    parser.add_argument("--no-contenders", action="store_true", help="eomgen alone")
    parser.add_argument("--limit", type=float, default=60.0, metavar="S", help="seconds for a derivation (60)")
    report.add_output(parser)
    options = parser.parse_args(arguments)
    options.sizes = sizes(options.links)
    options.kinds = [word.strip() for word in options.kinds.split(",")]
    for kind in options.kinds:
        if kind not in NOMINAL:
            raise OptionError(unknown("kind", kind, KINDS))
    if not 1 <= options.limit <= 3600:
        raise OptionError(f"--limit {options.limit:g} is not allowed; give seconds from 1 to 3600")
    return options


def measured(options: argparse.Namespace) -> dict[str, Any]:
    """The contents of `table1.json`, the targets among them."""
    for package in ("pytest", "pytest_benchmark"):
        report.require(package, "bench table1", "bench")
    require_posix("table1")
    arguments = {"links": options.links, "kinds": options.kinds, "quick": options.quick}
    contenders = not options.no_contenders
    if options.quick:
        plan = quick_settings(options.kinds, options.limit, contenders)
    else:
        plan = settings(options.sizes, options.kinds, options.limit, contenders)
    found = measure(plan, arguments)
    found["targets"] = [row._asdict() for row in targets(Data(found))]
    return found


def main() -> int:
    """Runs the suite; the exit code is 1 where a cell derived different dynamics or failed."""
    options = parse()
    report.require("matplotlib", "the plot of table1", "bench")
    found = report.produce(
        "table1",
        options,
        lambda: measured(options),
        lambda found: render(Data(found)),
        lambda found, path: plot(Data(found), path),
    )
    records = found["records"]
    failed = [r for r in records if r["problem"].startswith("error")]
    if failed:
        raise CheckError(f"{len(failed)} of {len(records)} cells failed; the first: {failed[0]['problem']}")
    return 0


if __name__ == "__main__":
    sys.exit(report.command(main))
