"""`speed.md`, from the JSON alone."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence

from bench import report
from bench.speed.data import CASES, LABELS, SOME, STATES, TREE, Data, amount, spread
from bench.speed.targets import Target, beyond, targets
from eomgen.errors import one_line

ONE_AT_A_TIME = ("ours-one", "hand-libm", "hand-inlined", "casadi", "casadi-recursion", "symforce", "numba")
BATCHED = (
    "ours", "ours-batch", "hand-simd", "heyoka", "heyoka-recursion", "casadi", "symforce", "numba", "jax", "pinocchio",
    "mujoco", "pydy",
)  # fmt: skip
SINCOS_FLOPS = 45  # in a pair by eomgen_real.h, where a fused multiply-add counts two


def render(data: Data) -> str:
    """`speed.md`."""
    rows = targets(data)
    judged = [row for row in rows if row.met is not None]
    missed = sum(not row.met for row in judged)
    parts = [
        "# Speed of compiled modules",
        f"Written by `eomgen bench speed` from `speed.json` ({data.found['minutes']} minutes).",
        report.describe_machine(data.found["machine"]),
        _method(data),
        "## Targets",
        f"{len(judged) - missed} of {len(judged)} met.",
        _targets(rows),
    ]
    if more := beyond(data):
        parts += [
            "## Beyond the targets",
            "Against the contenders with the recursion typed in, and in other layouts.",
            report.markdown(
                ["what: against", "measured", "ratio", "of the fastest"],
                [[r.what, r.measured, r.ratio, r.fastest] for r in more],
            ),
        ]
    parts += [
        "## Batches",
        "Nanoseconds per state on one core, median of the rounds (smallest – largest).",
        _sweep(data, BATCHED, "rigid", "ns"),
        "## One state at a time",
        "Nanoseconds per state in a compiled loop; constants of the parameters are computed once.",
        _sweep(data, ONE_AT_A_TIME, "rigid", "ns"),
        "## One call from Python",
        _sweep(data, [who for who in LABELS if who != "hand-simd"], "rigid", "single", links=(5,)),
        "## Compile times",
        "eomgen: the whole process, all default functions. The others: derivation and compilation of forward dynamics "
        "alone, in a running process.",
        _compiles(data),
        "## Operations and the machine's limit",
        *_operations(data),
        "## Threads",
        _threads(data),
    ]
    if problems := [r for r in data.records if r["problem"]]:
        lines = [
            f"* {LABELS.get(r['who'], r['who'])}, {r['links']} {CASES.get(r['case'], 'links')}: {r['problem']}"
            for r in problems
        ]
        parts += ["## Not measured", "\n".join(lines)]
    return "\n\n".join(part for part in parts if part) + "\n"


def _targets(rows: Sequence[Target]) -> str:
    header = ["what: against", "measured", "ratio", "of the fastest", "target", "met"]
    cells = [[r.what, r.measured, r.ratio, r.fastest, r.target, report.MET[r.met]] for r in rows]
    return report.markdown(header, cells)


def _method(data: Data) -> str:
    found = data.found
    worst: dict[bool, float] = {}
    for r in data.records:
        own = r["who"].startswith("ours")
        worst[own] = max(worst.get(own, 0.0), r["facts"].get("error_60_digits", 0.0))
    rounds = f"{found['rounds']} round{'s' if found['rounds'] > 1 else ''}"
    return (
        f"Every contender is a fresh process on one core, one after another, the whole set in {rounds} (contenders of "
        "no target in the first only). In a process the median of the repeats counts; a ratio is taken within a round, "
        "and the median of the rounds stands here with the smallest and the largest. Beside it stands the ratio of the "
        "fastest repeats of all rounds, which other work on the machine disturbs least. Batches have "
        f"{report.whole(STATES)} states, those of contenders that take microseconds {report.whole(SOME)}. Before a "
        "process measures, it compares its answers for these states with an independent reference, a sample of them in "
        f"60 digits: largest scaled error {worst.get(True, 0):.0e} (eomgen), {worst.get(False, 0):.0e} (others). Load "
        f"of the machine at the end: {found['machine'].get('load_after')}."
    )


def _cell(data: Data, who: str, case: str, links: int, metric: str) -> str:
    values = data.values(who, case, links, metric)
    if not values:
        record = data.record(who, case, links)
        return one_line(record["problem"].partition(": ")[0], 30) if record and record["problem"] else "–"
    return spread(values, amount(statistics.median(values), metric), metric)


def _sweep(data: Data, names: Sequence[str], case: str, metric: str, links: Sequence[int] = ()) -> str:
    """A table of contenders against links."""
    mine = [r for r in data.records if r["who"] in names and r["case"] == case]
    links = links or sorted({r["links"] for r in mine})
    rows = []
    for who in names:
        records = [r for r in mine if r["who"] == who and r["links"] in links]
        if any(metric in r["values"] or r["problem"] for r in records):
            rows.append([LABELS[who], *(_cell(data, who, case, n, metric) for n in links)])
    return report.markdown(["links", *map(str, links)], rows) if rows else "Not measured."


def _compiles(data: Data) -> str:
    links = sorted({r["links"] for r in data.records if r["case"] in ("cached", "virgin")} | {5, 20, 50})
    rows = []
    for case, text in (("cached", "wrapper cached"), ("virgin", "virgin cache")):
        for method in ("matrix", "articulated", TREE):
            if any(r["who"] == f"eomgen {method}" and r["case"] == case for r in data.records):
                cells = [_cell(data, f"eomgen {method}", case, n, "seconds") for n in links]
                rows.append([f"eomgen compile, {method}, {text}", *cells])
    for who in ("casadi", "casadi-recursion", "heyoka", "symforce", "numba", "jax", "pydy"):
        if any(r["who"] == who and r["case"] == "rigid" for r in data.records):
            rows.append([LABELS[who], *(_cell(data, who, "rigid", n, "build") for n in links)])
    return report.markdown(["links", *map(str, links)], rows) if rows else "Not measured."


def flops(operations: Mapping[str, int]) -> int:
    """Floating-point operations behind counted ones: a sine and cosine of one angle are a polynomial each."""
    pairs = max(operations.get("sin", 0), operations.get("cos", 0))
    plain = sum(count for name, count in operations.items() if name not in ("sin", "cos"))
    return plain + SINCOS_FLOPS * pairs


def _operations(data: Data) -> Iterator[str]:
    peak = data.value("peak", "probe", 0, "gflops")
    if peak is None:
        yield f"Not measured: {data.problem('peak', 'probe', 0)}."
        return
    lanes = (data.record("peak", "probe", 0) or {"facts": {}})["facts"].get("lanes")
    yield (
        f"Independent fused multiply-adds in vectors of {lanes} doubles, compiled with a module's flags, reach "
        f"{report.digits(peak)} GFLOP/s on one core. Counted operations are those of the emitted code (a sine, a "
        f"cosine and a pivot's inverse are one each); behind them a pair of sine and cosine has {SINCOS_FLOPS} "
        "floating-point operations. A kernel in which every operation were half of a fused multiply-add could reach "
        "100 %; an addition or product that stands alone reaches half of that, a division far less."
    )
    rows = []
    for r in data.records:
        if "operations" not in r["facts"] or r["problem"] or "ns" not in r["values"]:
            continue
        counted = r["facts"]["operations"]
        evaluations = 4 if r["case"] == "rollout" else 1
        rate = flops(counted) * evaluations / statistics.median(r["values"]["ns"])
        rows.append(
            [
                f"{LABELS[r['who']]}, {r['links']} {CASES[r['case']]}",
                str(sum(counted.values()) * evaluations),
                str(counted.get("pivot_inverse", 0) * evaluations),
                str(flops(counted) * evaluations),
                report.digits(rate),
                f"{rate / peak:.0%}",
            ]
        )
    header = ["kernel", "operations", "of them divisions", "floating-point operations", "GFLOP/s", "of the peak"]
    yield report.markdown(header, rows)


def _threads(data: Data) -> str:
    record = data.record("threads", "probe", 5)
    if not record or record["problem"]:
        return f"Not measured: {data.problem('threads', 'probe', 5)}."
    values = {int(name): values for name, values in record["values"].items()}
    rows = []
    for threads, times in sorted(values.items()):
        gains = [one / many for one, many in zip(values[1], times, strict=True)]
        rows.append(
            [
                str(threads),
                spread(times, amount(statistics.median(times), "ns"), "ns"),
                spread(gains, f"{report.digits(statistics.median(gains))} ×"),
            ]
        )
    states = report.whole(record["facts"]["states"])
    text = f"A batch of {states} states of 5 rigid links, a slice for each thread of a pool:"
    return f"{text}\n\n" + report.markdown(["threads", "per state", "gain"], rows)
