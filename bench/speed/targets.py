"""What is asked for, and whether it is met."""

from __future__ import annotations

import math
import statistics
from typing import NamedTuple

from bench import report
from bench.speed.data import FEW, LABELS, TREE, Data, amount, spread

COMPILED = (  # links, method, seconds allowed with the wrapper cached
    (5, "matrix", 0.7),
    (5, "articulated", 0.7),
    (20, "matrix", 1.5),
    (20, "articulated", 1.5),
    (50, "matrix", 2.0),
    (50, "articulated", 2.0),
    (1000, "articulated", 5.0),
    (1000, TREE, 6.0),
)


class Target(NamedTuple):
    """A target: what is compared, what was measured, the ratio, what is asked for, and whether it is met.

    Attributes:
        fastest: the ratio of the fastest repeats of all rounds, which disturbances change least.
        share: the measured ratio (or its inverse, or the value) over what is allowed; at most 1 where it is met.
    """

    what: str
    measured: str
    ratio: str
    target: str
    share: float | None
    fastest: str = ""

    @property
    def met(self) -> bool | None:
        return None if self.share is None else self.share <= 1


class Side(NamedTuple):
    """What is on one side of a ratio."""

    who: str
    case: str
    links: int
    metric: str = "ns"
    times: float = 1.0

    def label(self) -> str:
        name = LABELS.get(self.who, self.who)
        if self.case in ("rollout", "jacobian", "jacobian, cache"):
            name += f", {self.case.partition(',')[0]}"
        return name if self.times == 1 else f"{self.times:g} × {name}"


def ratios(data: Data, ours: Side, theirs: Side) -> list[float]:
    """Our time over theirs, round by round where both have as many; otherwise of the medians."""
    a = data.values(ours.who, ours.case, ours.links, ours.metric)
    b = data.values(theirs.who, theirs.case, theirs.links, theirs.metric)
    if not a or not b:
        return []
    if len(a) == len(b):
        return [x * ours.times / (y * theirs.times) for x, y in zip(a, b, strict=True)]
    return [statistics.median(a) * ours.times / (statistics.median(b) * theirs.times)]


def compared(
    data: Data, what: str, ours: Side, theirs: Side, most: float = math.inf, least: float = math.inf, asked: bool = True
) -> Target:
    """Our time against theirs: at most `most` of it, or theirs at least `least` of ours."""
    faster = least < math.inf
    if not asked:
        target = "–"
    elif faster:
        target = f"≥ {least:g} × faster" if least > 1 else "no slower"
    else:
        target = f"≤ {most:g} ×"
    what = f"{what}: {theirs.label()}"
    found = ratios(data, ours, theirs)
    if not found:
        lacking = ours if not data.values(ours.who, ours.case, ours.links, ours.metric) else theirs
        reason = data.problem(lacking.who, lacking.case, lacking.links)
        return Target(what, f"{LABELS.get(lacking.who, lacking.who)}: {reason}", "–", target, None)
    sides = []
    for side in (ours, theirs):
        value = data.value(side.who, side.case, side.links, side.metric)
        assert value is not None
        sides.append(amount(value * side.times, side.metric))
    ratio, fastest = statistics.median(found), _fastest(data, ours, theirs)
    if faster:
        found, ratio, fastest = sorted(1 / r for r in found), 1 / ratio, 1 / fastest
    share = None if not asked else least / ratio if faster else ratio / most
    both = f"{sides[0]} / {sides[1]}"
    return Target(what, both, spread(found, f"{report.digits(ratio)} ×"), target, share, f"{report.digits(fastest)} ×")


def _fastest(data: Data, ours: Side, theirs: Side) -> float:
    a, b = (min(data.values(side.who, side.case, side.links, "best")) * side.times for side in (ours, theirs))
    return a / b


def bounded(data: Data, what: str, side: Side, most: float, less: float = 0.0) -> Target:
    """A value of ours (less a number) against a bound."""
    target = f"≤ {amount(most, side.metric)}" + (" more" if less else "")
    values = data.values(side.who, side.case, side.links, side.metric)
    if not values:
        return Target(what, data.problem(side.who, side.case, side.links), "–", target, None)
    value = statistics.median(values)
    if less:
        shown_value = f"{amount(value, side.metric)} – {amount(less, side.metric)}"
    else:
        shown_value = spread(values, amount(value, side.metric), side.metric)
    return Target(what, shown_value, "", target, max(value - less, 0.0) / most)


def targets(data: Data) -> list[Target]:
    """The targets of speed, a row each."""
    rows: list[Target] = []
    for n in (5, 10, 20):
        row, contiguous = Side("ours", "rigid", n), Side("ours-batch", "rigid", n)
        what, simd, heyoka = f"{n} rigid links, batch", Side("hand-simd", "rigid", n), Side("heyoka", "rigid", n)
        rows.append(compared(data, f"{what}, row-major", row, simd, most=1.25))
        if n == 5:
            rows.append(compared(data, f"{what}, batch-contiguous", contiguous, simd, most=1.1))
        rows.append(compared(data, f"{what}, row-major", row, heyoka, least=2.5 if n == 5 else 3))
        if n == 5:
            rows.append(compared(data, f"{what}, row-major", row, Side("casadi", "rigid", n), least=10))
    for n in (2, 5, 10, 20):
        one, what = Side("ours-one", "rigid", n), f"{n} rigid links, one at a time"
        rows += [compared(data, what, one, Side(who, "rigid", n), most=1.1) for who in ("hand-libm", "hand-inlined")]
        rows.append(compared(data, what, one, Side("casadi", "rigid", n), least=1))
    rows.append(bounded(data, "one call from Python, 5 rigid links", Side("ours", "rigid", 5, "single"), 1200))
    free, what = Side("ours", "point-masses", 5), "5 free-length links, batch"
    rows.append(compared(data, what, free, Side("heyoka", "point-masses", 5), least=4))
    rows.append(compared(data, what, free, Side("casadi", "point-masses", 5), least=8))
    five = Side("ours", "rigid", 5)
    what = "NumPy back end, 5 rigid links, batch"
    rows.append(compared(data, what, Side("ours-numpy", "rigid", 5), five, most=12))
    jacobian, what = Side("ours", "jacobian", 5), "Jacobian, 5 rigid links, batch"
    rows.append(compared(data, what, jacobian, five, most=4))
    rows.append(compared(data, what, jacobian, Side("casadi", "jacobian", 5), least=5))
    rollout, what = Side("ours", "rollout", 5), "rollout, 5 rigid links, RK4, per step"
    rows.append(compared(data, what, rollout, five._replace(times=4), most=1.1))
    rows.append(compared(data, what, rollout, Side("mujoco", "rollout", 5), least=10))
    for n, method, most in COMPILED:
        who = f"eomgen {method}"
        rows.append(bounded(data, f"compile {n} links, {method}", Side(who, "cached", n, "seconds"), most))
        less = data.value(who, "cached", n, "seconds")
        if less and data.record(who, "virgin", n):
            what = f"compile {n} links, {method}, virgin cache"
            rows.append(bounded(data, what, Side(who, "virgin", n, "seconds"), 2.0, less))
    for method in ("articulated", TREE):
        side = Side(f"eomgen {method}", "cached", 1000, "peak")
        rows.append(bounded(data, f"compile 1000 links, {method}: memory", side, 500.0))
    record = data.record("memory", "probe", 5)
    states = f"{record['facts'].get('states', 0):.0e}".replace("e+0", "e") if record else "1e7"
    what = f"memory of a batch of {states} states beyond its arrays"
    for who, metric, text in (
        ("memory", "extra", ""),
        ("memory", "extra_new", ", new result"),
        ("memory-numpy", "extra", ", NumPy back end"),
    ):
        rows.append(bounded(data, f"{what}{text}", Side(who, "probe", 5, metric), 64.0))
    return [row for row in rows if not (data.found["arguments"]["quick"] and "not measured" in row.measured)]


def beyond(data: Data) -> list[Target]:
    """Ratios that nobody asked for, against the contenders at their best."""
    rows: list[Target] = []
    for n in (2, 5, 10, 20):
        row, contiguous, one = (Side(who, "rigid", n) for who in ("ours", "ours-batch", "ours-one"))
        what = f"{n} rigid links"
        rows += [
            compared(data, f"{what}, batch-contiguous", contiguous, Side("hand-simd", "rigid", n), asked=False),
            compared(data, f"{what}, row-major", row, Side("heyoka-recursion", "rigid", n), least=1, asked=False),
            compared(data, f"{what}, one at a time", one, Side("casadi-recursion", "rigid", n), least=1, asked=False),
        ]
    four = Side("ours-batch", "rigid", 5, times=4)
    rows.append(compared(data, "rollout, 5 rigid links, per step", Side("ours", "rollout", 5), four, asked=False))
    free = Side("ours-batch", "point-masses", 5)
    what = "5 free-length links, batch-contiguous"
    rows.append(compared(data, what, free, Side("heyoka", "point-masses", 5), least=1, asked=False))
    few = f"{report.whole(FEW)} states (in cache)"
    for n in (5, 20):
        simd, what = Side("hand-simd", "rigid, cache", n), f"{n} rigid links, {few}"
        for who, layout in (("ours", "row-major"), ("ours-batch", "batch-contiguous")):
            rows.append(compared(data, f"{what}, {layout}", Side(who, "rigid, cache", n), simd, asked=False))
    jacobian, what = Side("ours", "jacobian, cache", 5), f"Jacobian, 5 rigid links, {few}"
    rows.append(compared(data, what, jacobian, Side("ours", "rigid, cache", 5), asked=False))
    rows.append(compared(data, what, jacobian, Side("casadi", "jacobian, cache", 5), least=1, asked=False))
    return [row for row in rows if row.ratio != "–"]
