"""Speed against error: every form in which forward dynamics can be compiled, beside what users would pick instead.

`eomgen bench pareto` measures nanoseconds per state and the certified error of each variant on some scenes, in one
process and in turns, and runs the scripts of `bench/peers` that have the scene. It writes `pareto.json`; `pareto.md`
and `pareto.png` are made from that file alone.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bench import process, report
from bench.peers import harness, mechanism
from eomgen import certify, chain, hard, pipeline, walker
from eomgen.errors import CheckError, one_line
from eomgen.scene import Scene

PACKAGES = ("numpy", "cython", "python-flint", "casadi", "heyoka", "mujoco", "pin", "symforce", "jax", "numba", "pydy")
PEERS = ("casadi", "heyoka", "symforce", "numba", "jax", "pinocchio", "mujoco", "pydy")
MASSES = ("casadi", "heyoka")  # peers that have links of free length
STATES = 20_000  # in a batch
SAMPLE = 32  # states whose errors are certified
ROUNDS = 11
LIMIT = 120.0  # seconds for a peer to derive, compile, check and measure

Record = dict[str, Any]


class Problem(NamedTuple):
    """A scene, its states, and the peers' name for it.

    Attributes:
        name: of the scene, for people.
        scene: the scene.
        case: the hard case whose state is taken, None for random states.
        mechanism, links: what the peers' scripts call it; "" where they do not have it.
    """

    name: str
    scene: Scene
    case: hard.Case | None = None
    mechanism: str = ""
    links: int = 0


class Variant(NamedTuple):
    """A form of forward dynamics.

    Attributes:
        label: its name in tables.
        options: of `eomgen.compile`.
        sines: of absolute angles, multiplied where links meet, of the differences of angles, or both.
    """

    label: str
    options: Mapping[str, Any]
    sines: str

    @property
    def dtype(self) -> str:
        return str(self.options.get("dtypes", ["float64"])[0])


DENSE = {"method": "matrix", "solver": "dense"}
MIXED = {"method": "articulated", "solver": "dense", "loops": False}
WALKS = {"method": "articulated", "solver": "articulated"}
DEFAULT = Variant("default", {}, "")
VARIANTS = (
    DEFAULT,
    *(
        Variant(f"{name}, {form}", {**extra, **options}, sines)
        for name, extra in {
            "C": {},
            "C, fast": {"accuracy": "fast"},
            "C, high": {"accuracy": "high"},
            "C, float32": {"dtypes": ["float32"]},
            "C, longdouble": {"dtypes": ["longdouble"]},
            "NumPy": {"backend": "numpy"},
            "NumPy, float32": {"backend": "numpy", "dtypes": ["float32"]},
        }.items()
        for form, options, sines in (
            ("dense", DENSE, "products"),
            ("dense, differences", MIXED, "both"),
            ("articulated", WALKS, "differences"),
        )
        if form != "dense, differences" or name in ("C", "C, high")
    ),
)


def problems(quick: bool) -> list[Problem]:
    """The scenes: chains, the walker, and three of the hard cases."""
    cases = {case.name: case for case in hard.cases()}
    names = ("rods: nearly folded", "rods: masses to 1e+12", "lumped: 1d of 1e-06 m")
    found = [Problem(f"{n} rigid links", chain(n, model="rigid"), None, "rigid", n) for n in (2, 5, 10, 20)]
    found.append(Problem("5 links of free length", chain(5), None, "point-masses", 5))
    found.append(Problem("walker", walker()))
    found += [Problem(name, cases[name].scene, cases[name]) for name in names]
    return [found[1], found[-1]] if quick else found


def states(problem: Problem) -> dict[str, np.ndarray]:
    """A batch: random states, or the state of the hard case with other rates and inputs."""
    if problem.mechanism:
        q, v, u = mechanism.states(problem.links, STATES, 0, problem.mechanism)
        return {"q": q, "v": v, "u": u, "w": np.empty((STATES, 0, 3))}
    rng = np.random.default_rng(0)
    if problem.case:
        batch = {name: np.repeat(problem.case.state[name][None], STATES, 0) for name in "qvuw"}
        for name in "vu":
            batch[name] *= rng.uniform(0.5, 1.5, batch[name].shape)
        return batch
    made = [hard.random_state(problem.scene, seed) for seed in range(SAMPLE)]
    return {name: np.resize([state[name] for state in made], (STATES, *made[0][name].shape)) for name in "qvuw"}


class Exact:
    """Certified values of a scene's accelerations at the sample of a batch."""

    def __init__(self, problem: Problem, batch: Mapping[str, np.ndarray]) -> None:
        self.exact, self.batch = certify.Exact(problem.scene), batch
        self.rows = harness.rows(STATES, SAMPLE)  # the peers take the same
        self.p = np.array([parameter.value for parameter in problem.scene.parameters])
        self.found: dict[str, list[list[Any]]] = {}

    def values(self, dtype: str) -> list[list[Any]]:
        """Enclosures, from arguments rounded to a type as a function of that type gets them."""
        if dtype not in self.found:
            rounded = {name: array[self.rows].astype(dtype) for name, array in self.batch.items()}
            self.found[dtype] = [
                self.exact.values(
                    "forward_dynamics",
                    {"p": self.p.astype(dtype), **{name: array[k] for name, array in rounded.items()}},
                )
                for k in range(len(self.rows))
            ]
        return self.found[dtype]

    def error(self, computed: np.ndarray) -> float:
        """The largest scaled error of the sample, a proven bound."""
        eps = float(np.finfo(computed.dtype).eps)
        pairs = zip(computed[self.rows], self.values(str(computed.dtype)), strict=True)
        return max(certify.errors(found, exact)[0] for found, exact in pairs) * eps


def own(problem: Problem) -> list[Record]:
    """All variants, timed in turns."""
    batch = states(problem)
    exact = Exact(problem, batch)
    calls, records = [], []
    for variant in VARIANTS:
        module = pipeline.compile(problem.scene, functions=["forward_dynamics"], **variant.options)
        arguments = [batch[name].astype(variant.dtype) for name in "qvuw" if name != "w" or module.w_names]
        arguments.append(module.p.astype(variant.dtype))
        out = np.empty(batch["q"].shape, variant.dtype)
        call = partial(module.forward_dynamics, *arguments, out=out)
        with np.errstate(all="ignore"):
            call()
        calls.append(call)
        form = module.info["forms"]["forward_dynamics"]
        records.append(
            {
                "scene": problem.name,
                "who": "eomgen",
                "variant": variant.label,
                "form": form,
                "sines": variant.sines or ("differences" if "articulated" in form else "products"),
                "error": exact.error(out),
                "ns": [],
            }
        )
    for _ in range(ROUNDS):
        for call, record in zip(calls, records, strict=True):
            with np.errstate(all="ignore"):
                [seconds] = harness.timed(call, 1)
            record["ns"].append(seconds / STATES * 1e9)
    for record in records:
        _show(record)
    return records


def peers(problem: Problem) -> Iterator[Record]:
    """The scripts of other tools that have this mechanism."""
    for who in PEERS if problem.mechanism == "rigid" else MASSES if problem.mechanism else ():
        words = [sys.executable, f"bench/peers/{who}.py", "--json", "--links", str(problem.links)]
        words += ["--batch", str(STATES), "--repeats", str(ROUNDS), "--check", "1000", "--sample", str(SAMPLE)]
        words += ["--mechanism", problem.mechanism] if problem.mechanism != "rigid" else []
        record: Record = {"scene": problem.name, "who": who, "variant": "", "problem": "", "ns": []}
        done = process.run(words, LIMIT)
        found = (done.answers() or [{"error": done.problem}])[-1]
        if "error" in found or found.get("error_60_digits") is None:
            record["problem"] = one_line(found.get("error", "no mpmath"), 100)
        else:
            record |= {"ns": [found["spread"][0], found["ns_per_state"]], "error": found["error_60_digits"]}
        _show(record)
        yield record


def _show(record: Record) -> None:
    what = f"{record['who']} {record['variant']}".strip()
    figures = record.get("problem") or f"{_ns(record):.4g} ns  {record['error']:.1e}"
    report.progress(f"{record['scene']:<24} {what:<36} {figures}")


def _ns(record: Record) -> float:
    """Nanoseconds per state: the median of ours, what the script reports of a peer."""
    return float(statistics.median(record["ns"]) if record["who"] == "eomgen" else record["ns"][-1])


def front(records: Sequence[Record]) -> list[Record]:
    """Those that nothing surpasses in both speed and error, fastest first."""
    kept: list[Record] = []
    for record in sorted(records, key=lambda r: (_ns(r), r["error"])):
        if math.isfinite(record["error"]) and (not kept or record["error"] < kept[-1]["error"]):
            kept.append(record)
    return kept


def slack(records: Sequence[Record]) -> float:
    """How many times longer the default takes than the fastest that is at least as accurate.

    A variant of the default's form and error is the same code; how its time differs is chance.
    """
    (default,) = (r for r in records if r["variant"] == DEFAULT.label)
    others = (r for r in records if (r.get("form"), r["error"]) != (default["form"], default["error"]))
    return max([1.0, *(_ns(default) / _ns(r) for r in others if r["error"] <= default["error"])])


def measure(quick: bool) -> dict[str, Any]:
    """Everything that goes into `pareto.json`."""
    start, facts = time.monotonic(), report.machine(PACKAGES)
    records: list[Record] = []
    with tempfile.TemporaryDirectory(prefix="eomgen-pareto-") as folder:
        before = os.environ.get("EOMGEN_CACHE")
        os.environ["EOMGEN_CACHE"] = folder
        try:
            for problem in problems(quick):
                records += [*own(problem), *peers(problem)]
        finally:
            os.environ.pop("EOMGEN_CACHE")
            if before is not None:
                os.environ["EOMGEN_CACHE"] = before
    minutes = round((time.monotonic() - start) / 60, 1)
    return {"suite": "pareto", "machine": facts, "minutes": minutes, "records": records}


# The table and the picture.


def by_scene(found: Mapping[str, Any]) -> dict[str, list[Record]]:
    """The records of each scene that have an answer."""
    scenes: dict[str, list[Record]] = {}
    for record in found["records"]:
        scenes.setdefault(record["scene"], []).extend([] if record.get("problem") else [record])
    return scenes


def render(found: Mapping[str, Any]) -> str:
    """`pareto.md`."""
    scenes = by_scene(found)
    parts = [
        "# Speed against error",
        f"Written by `eomgen bench pareto` from `pareto.json` ({found['minutes']} minutes).",
        report.describe_machine(found["machine"]),
        f"Forward dynamics in batches of {STATES} states, one core. ns: the median of {ROUNDS} rounds in which the "
        "variants take turns (smallest – largest); a peer's is the median of as many repeats in a process of its own. "
        "Both come after a call that does not count, so that the arrays are in the cache if they fit. "
        f"Error: the largest of {SAMPLE} states, scaled by a state's largest acceleration; eomgen's is a proven bound "
        "(ball arithmetic), a peer's is measured against 60 digits. Arguments rounded to float32 count as exact for "
        "float32. **Bold**: on the Pareto front, nothing is both faster and more accurate. The peers' scripts have the "
        "chains only.",
        "## The default",
        report.markdown(
            ["scene", "form of the default", "ns", "error", "times the fastest other that is as accurate"],
            [_default_row(name, records) for name, records in scenes.items()],
        ),
    ]
    for name, records in scenes.items():
        best = {id(record) for record in front(records)}
        table = [_row(record, id(record) in best) for record in sorted(records, key=_ns)]
        parts += [f"## {name}", report.markdown(["variant", "sines", "ns", "", "error"], table)]
    problems = [f"* {r['scene']}, {r['who']}: {r['problem']}" for r in found["records"] if r.get("problem")]
    if problems:
        parts += ["## Not measured", "\n".join(problems)]
    return "\n\n".join(parts) + "\n"


def _default_row(name: str, records: Sequence[Record]) -> list[str]:
    (default,) = (r for r in records if r["variant"] == DEFAULT.label)
    return [name, default["form"], report.digits(_ns(default)), f"{default['error']:.1e}", f"{slack(records):.2f}"]


def _row(record: Record, best: bool) -> list[str]:
    label = record["variant"] or record["who"]
    spread = report.span(record["ns"]) if record["variant"] else ""
    cells = [label, record.get("sines", ""), report.digits(_ns(record)), spread, f"{record['error']:.1e}"]
    return [f"**{cell}**" if best and cell else cell for cell in cells]


COLORS = {"C, fast": "#e69f00", "C, high": "#009e73", "C, float32": "#cc79a7", "C, longdouble": "#56b4e9",
          "NumPy, float32": "#d55e00", "NumPy": "#882255", "C": "#0072b2", "default": "#0072b2"}  # fmt: skip
MARKERS = {"articulated": "o", "dense": "s", "dense, differences": "D"}


def plot(found: Mapping[str, Any], path: Path) -> None:
    """`pareto.png`: a panel for each scene, the front as a line, the default with a ring."""
    from matplotlib.lines import Line2D
    from matplotlib.ticker import LogLocator

    scenes = by_scene(found)
    columns = min(3, len(scenes))
    lines = -(-len(scenes) // columns)
    figure, axes = report.pyplot().subplots(lines, columns, figsize=(6 * columns, 4.4 * lines + 1.2), squeeze=False)
    for axis, (name, records) in zip(axes.flat, scenes.items(), strict=False):
        best = front(records)
        axis.step([_ns(r) for r in best], [r["error"] for r in best], where="post", color="0.6", linewidth=1, zorder=1)
        for record in records:
            if not math.isfinite(record["error"]):
                continue
            at = (_ns(record), max(record["error"], 1e-20))
            if record["variant"]:
                family, form = _parts(record["variant"])
                axis.plot(*at, MARKERS.get(form, "o"), color=COLORS[family], markersize=7, zorder=3)
                if family == "default":
                    axis.plot(*at, "o", markersize=15, markerfacecolor="none", markeredgecolor="black", zorder=4)
            else:
                axis.plot(*at, "x", color="0.25", markersize=6, zorder=2)
                axis.annotate(record["who"], at, (4, 3), textcoords="offset points", fontsize=7, color="0.25")
        axis.set(xscale="log", yscale="log", title=name)
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        report.number(axis.xaxis)
        axis.grid(True, which="major", color="0.88", linewidth=0.6)
    for axis in axes.flat[len(scenes) :]:
        axis.set_visible(False)
    for axis in axes[-1]:
        axis.set_xlabel("ns per state, one core")
    for axis in axes[:, 0]:
        axis.set_ylabel("certified error")
    entries = [Line2D([], [], color=color, marker="o", linestyle="", label=family)
               for family, color in COLORS.items() if family != "default"]  # fmt: skip
    entries += [
        Line2D([], [], color="0.3", marker=marker, linestyle="", label=form) for form, marker in MARKERS.items()
    ]
    entries.append(Line2D([], [], color="black", marker="o", linestyle="", markersize=13, markerfacecolor="none",
                          label="the default"))  # fmt: skip
    entries.append(Line2D([], [], color="0.25", marker="x", linestyle="", label="other tools"))
    entries.append(Line2D([], [], color="0.6", label="Pareto front"))
    figure.suptitle("Forward dynamics: speed against error", fontsize=14)
    figure.legend(handles=entries, loc="lower center", ncols=7, fontsize=9, frameon=False)
    figure.tight_layout(rect=(0, 0.75 / (4.4 * lines + 1.2), 1, 0.99))
    report.save(figure, path, dpi=100)


def _parts(label: str) -> tuple[str, str]:
    """The family and the form in a variant's label."""
    for form in sorted(MARKERS, key=len, reverse=True):
        if label.endswith(f", {form}"):
            return label.removesuffix(f", {form}"), form
    return label, ""


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The options."""
    parser = report.Parser(
        prog="eomgen bench pareto",
        description="Measures speed against certified error; writes pareto.json, pareto.md and pareto.png. Run it on a "
        "quiet machine, with the Python that has the contenders installed.",
    )
    parser.add_argument("--quick", action="store_true", help="two scenes only")
    report.add_output(parser)
    return parser.parse_args(arguments)


def main() -> int:
    """Runs the suite; the exit code is 1 where a default gives no answer."""
    options = parse()
    report.require("matplotlib", "the plot of pareto", "bench")
    report.require("flint", "certified errors", "bench")
    found = report.produce("pareto", options, lambda: measure(options.quick), render, plot)
    lost = [r["scene"] for r in found["records"] if r["variant"] == DEFAULT.label and not math.isfinite(r["error"])]
    if lost:
        raise CheckError(f"the default gives no answer for {', '.join(lost)}")
    return 0


if __name__ == "__main__":
    sys.exit(report.command(main))
