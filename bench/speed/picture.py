"""`speed.png`: time against links in batches and one at a time, and how far each target is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bench import report
from bench.speed.data import LABELS, Data
from bench.speed.page import BATCHED, ONE_AT_A_TIME
from bench.speed.targets import Target, targets

STYLES = {  # colour, marker, line
    "ours": ("#0072b2", "o", "-"),
    "ours-batch": ("#0072b2", "s", "--"),
    "ours-one": ("#0072b2", "D", "-"),
    "hand-simd": ("#000000", "^", "-"),
    "hand-inlined": ("#000000", "v", "-"),
    "hand-libm": ("#000000", "v", ":"),
    "heyoka": ("#d55e00", "o", "-"),
    "heyoka-recursion": ("#d55e00", "o", ":"),
    "casadi": ("#009e73", "D", "-"),
    "casadi-recursion": ("#009e73", "D", ":"),
    "symforce": ("#cc79a7", "s", "-"),
    "numba": ("#e69f00", "P", "-"),
    "jax": ("#56b4e9", "X", "-"),
    "pinocchio": ("#882255", "v", "-"),
    "mujoco": ("#7a7a7a", "s", "-"),
    "pydy": ("#7a7a7a", "*", "--"),
}
AXES = ((0.055, 0.24), (0.335, 0.24), (0.81, 0.18))  # left edges and widths of the panels of the picture


def plot(data: Data, path: Path) -> None:
    """`speed.png`: time against links in batches and one at a time, and how far each target is."""
    from matplotlib.ticker import NullLocator

    rows = [row for row in targets(data) if row.share is not None]
    figure = report.pyplot().figure(figsize=(19, 10.4))
    batch, single, aims = (figure.add_axes((left, 0.14, width, 0.78)) for left, width in AXES)
    batch.sharey(single)
    entries: dict[str, Any] = {}
    panels = ((batch, BATCHED, "Batches of states"), (single, ONE_AT_A_TIME, "One state at a time, compiled loop"))
    for axis, names, title in panels:
        for who in names:
            color, marker, line = STYLES[who]
            points = [(n, v) for n in (2, 5, 10, 20, 50) if (v := data.value(who, "rigid", n)) is not None]
            heavy = who.startswith("ours")
            if points:
                (drawn,) = axis.plot(
                    *zip(*points, strict=True), color=color, marker=marker, linestyle=line,
                    linewidth=2.4 if heavy else 1.2, markersize=7 if heavy else 5.5,
                    markerfacecolor=color if heavy else "white", zorder=3 if heavy else 2,
                )  # fmt: skip
                entries.setdefault(LABELS[who], drawn)
        axis.set(xscale="log", yscale="log", title=title, xlabel="rigid links", xlim=(1.7, 60))
        axis.grid(True, which="major", color="0.85", linewidth=0.6)
        axis.set_xticks([2, 5, 10, 20, 50], ["2", "5", "10", "20", "50"])
        axis.xaxis.set_minor_locator(NullLocator())
        report.number(axis.yaxis)
    batch.set_ylabel("forward dynamics, ns per state, one core")
    _aims(aims, rows)
    figure.suptitle("Speed of compiled modules beside hand-written C and other tools", fontsize=14)
    figure.legend(
        entries.values(),
        entries.keys(),
        loc="lower left",
        bbox_to_anchor=(0.05, 0.01),
        ncols=6,
        fontsize=9,
        frameon=False,
    )
    report.save(figure, path, dpi=100)


def _aims(axis: Any, rows: Sequence[Target]) -> None:
    """A dot for each target: what was measured over what is allowed."""
    places = range(len(rows))
    shares = [min(max(row.share or 0.0, 1e-2), 20.0) for row in rows]
    colors = ["#009e73" if row.met else "#cc3311" for row in rows]
    axis.hlines(places, [1.0] * len(rows), shares, color=colors, linewidth=1.4, zorder=2)
    axis.scatter(shares, places, color=colors, s=26, zorder=3)
    axis.axvline(1.0, color="0.3", linewidth=1.0, zorder=1)
    axis.set(xscale="log", title="Measured over allowed (left of 1: met)", ylim=(len(rows) - 0.4, -0.6))
    low, high = min([*shares, 0.3]), max([*shares, 3.0])
    axis.set_xlim(low / 1.25, high * 1.25)
    axis.set_yticks(list(places), [f"{row.what}  {row.target}" for row in rows], fontsize=7)
    ticks = [tick for tick in (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 20) if low / 1.25 <= tick <= high * 1.25]
    axis.set_xticks(ticks)
    report.number(axis.xaxis)
    axis.grid(True, axis="x", which="major", color="0.85", linewidth=0.6)
    axis.tick_params(axis="y", length=0)
