"""The records of a run, the names of what is in them, and their values with units."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from bench import report

Record = dict[str, Any]
Sample = dict[str, Any]

STATES = 100_000  # in a batch
FEW = 2_000  # in a batch that stays in the cache
SOME = 10_000  # in a batch of contenders that take microseconds per state; it also is the number of trajectories
TREE = "random tree"  # in place of the method: articulated, on a tree of every kind of links in random order
LABELS = {
    "ours": "eomgen, row-major",
    "ours-batch": "eomgen, batch-contiguous",
    "ours-numpy": "eomgen, NumPy back end",
    "ours-one": "eomgen, C loop",
    "hand-simd": "hand-written C, SIMD",
    "hand-inlined": "hand-written C, inlined sincos",
    "hand-libm": "hand-written C, libm",
    "heyoka": "heyoka",
    "heyoka-recursion": "heyoka, recursion typed in",
    "casadi": "CasADi's C",
    "casadi-recursion": "CasADi's C, recursion typed in",
    "symforce": "SymForce's C++",
    "numba": "Numba, recursion by hand",
    "jax": "JAX, recursion by hand",
    "pinocchio": "Pinocchio",
    "mujoco": "MuJoCo",
    "pydy": "PyDy",
}
CASES = {
    "rigid": "rigid links",
    "point-masses": "free-length links",
    "jacobian": "rigid links, Jacobian",
    "rollout": "rigid links, rollout",
    "rigid, cache": "rigid links, in cache",
    "jacobian, cache": "rigid links, Jacobian, in cache",
    "cached": "rigid links, compile with the wrapper cached",
    "virgin": "rigid links, compile on a virgin cache",
}


def new_record(who: str, case: str, links: int) -> Record:
    return {"who": who, "case": case, "links": links, "problem": "", "values": {}, "facts": {}}


def add(record: Record, sample: Sample) -> None:
    """Adds a round's sample to its record; one that has no answer spoils the record."""
    record["problem"] = record["problem"] or sample.get("problem", "")
    for name, value in sample.get("values", {}).items():
        record["values"].setdefault(name, []).append(value)
    record["facts"].update(sample.get("facts", {}))


class Data:
    """The contents of `speed.json`."""

    def __init__(self, found: Mapping[str, Any]) -> None:
        self.found = found
        self.records: list[Record] = found["records"]
        self.table = {(r["who"], r["case"], r["links"]): r for r in self.records}

    def record(self, who: str, case: str, links: int) -> Record | None:
        """A record, if it was measured (it may have a problem)."""
        return self.table.get((who, case, links))

    def values(self, who: str, case: str, links: int, metric: str = "ns") -> list[float]:
        """The values of the rounds; none where something went wrong."""
        record = self.record(who, case, links)
        return list(record["values"].get(metric, [])) if record and not record["problem"] else []

    def value(self, who: str, case: str, links: int, metric: str = "ns") -> float | None:
        """The median over the rounds."""
        values = self.values(who, case, links, metric)
        return statistics.median(values) if values else None

    def problem(self, who: str, case: str, links: int) -> str:
        """Why there is no value."""
        record = self.record(who, case, links)
        return (record["problem"] or "not measured") if record else "not measured"


def unit_of(value: float, metric: str) -> tuple[str, float]:
    """The unit that suits a value of a metric, in the metric's own: nanoseconds, seconds or MB."""
    base = {"seconds": 1.0, "build": 1.0, "extra": 0.0, "extra_new": 0.0, "peak": 0.0}.get(metric, 1e-9)
    if not base:
        return "MB", 1.0
    name, size = report.unit(value * base)
    return name, size / base


def amount(value: float, metric: str) -> str:
    """A value with its unit."""
    unit, size = unit_of(value, metric)
    return f"{report.digits(value / size)} {unit}"


def spread(values: Sequence[float], text: str, metric: str = "") -> str:
    """A median with the smallest and largest of its rounds, in its unit."""
    if len(values) < 2:
        return text
    size = unit_of(statistics.median(values), metric)[1] if metric else 1.0
    return f"{text} {report.span([value / size for value in values])}"
