"""What is measured, in which order, and the run itself."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bench import report
from bench.speed.cells import Cell, Place, compilation, hand, ours, peer, probe, script
from bench.speed.data import FEW, SOME, TREE, Record, Sample, add, new_record
from bench.speed.targets import COMPILED

ROUNDS = 3
PACKAGES = (
    "numpy", "cython", "msgspec", "mpmath", "casadi", "heyoka", "mujoco", "pin", "symforce", "jax", "numba", "pydy",
)  # fmt: skip


def chain_cells(links: int, rounds: int, variants: bool) -> Iterator[Cell]:
    """Everything on a chain of rigid links that the targets name."""
    yield hand(links, rounds)
    yield ours("ours", "rigid", links, rounds=rounds)
    yield ours("ours-batch", "rigid", links, "--layout", "batch", rounds=rounds)
    yield peer("heyoka", "rigid", links, rounds=rounds)
    yield ours("ours-one", "rigid", links, "--scalar", rounds=rounds, repeats=15)
    yield peer("casadi", "rigid", links, rounds=rounds)
    if variants:
        yield peer("heyoka-recursion", "rigid", links, rounds=rounds)
        yield peer("casadi-recursion", "rigid", links, rounds=rounds)


def cache_cells(rounds: int) -> Iterator[Cell]:
    """Batches that stay in the cache: what the kernels do where memory does not limit them."""
    for n in (5, 20):
        words = ("--batch", FEW, "--repeats", 301)
        yield script("hand", "rigid, cache", n, "bench/handwritten/measure.py", *words, rounds=rounds)
        yield ours("ours", "rigid, cache", n, rounds=rounds, batch=FEW, repeats=301)
        yield ours("ours-batch", "rigid, cache", n, "--layout", "batch", rounds=rounds, batch=FEW, repeats=301)
    yield ours("ours", "jacobian, cache", 5, "--function", "jacobian", rounds=rounds, batch=FEW, repeats=301)
    yield peer("casadi", "jacobian, cache", 5, "--jacobian", rounds=rounds, batch=FEW, repeats=51)


def other_cells(rounds: int, trajectories: int, memory: int) -> Iterator[Cell]:
    """The rest of the targets but for compile times."""
    masses = ("--mechanism", "point-masses")
    yield ours("ours", "point-masses", 5, *masses, rounds=rounds)
    yield ours("ours-batch", "point-masses", 5, *masses, "--layout", "batch", rounds=rounds)
    yield peer("heyoka", "point-masses", 5, *masses, rounds=rounds)
    yield peer("casadi", "point-masses", 5, *masses, rounds=rounds)
    yield ours("ours-numpy", "rigid", 5, "--backend", "numpy", rounds=rounds, repeats=9)
    yield ours("ours", "jacobian", 5, "--function", "jacobian", rounds=rounds)
    yield peer("casadi", "jacobian", 5, "--jacobian", rounds=rounds)
    yield ours("ours", "rollout", 5, "--rollout", rounds=rounds, batch=trajectories, repeats=3)
    yield peer("mujoco", "rollout", 5, "--rollout", rounds=rounds, batch=SOME, repeats=3)
    yield probe("peak", 0, rounds=rounds)
    yield probe("threads", 5, rounds=rounds)
    yield probe("memory", 5, memory, "c", rounds=1)
    yield probe("memory-numpy", 5, memory, "numpy", rounds=1)


def plan(quick: bool) -> list[Cell]:
    """What is measured, in the order of a round."""
    if quick:
        return [
            *(cell for n in (5, 20) for cell in chain_cells(n, 1, variants=False)),
            peer("numba", "rigid", 5, batch=SOME),
            *other_cells(1, trajectories=1000, memory=1_000_000),
            *(compilation(n, "matrix", False, 1) for n in (5, 20)),
            *(compilation(n, "articulated", False, 1) for n in (50, 1000)),
            compilation(1000, TREE, False, 1),
            compilation(5, "matrix", True, 1),
        ]
    cells = [cell for n in (2, 5, 10, 20) for cell in chain_cells(n, ROUNDS, variants=True)]
    cells.append(peer("numba", "rigid", 5, rounds=ROUNDS, batch=SOME))
    cells += other_cells(ROUNDS, trajectories=SOME, memory=10_000_000)
    cells += cache_cells(ROUNDS)
    for n, method, _ in COMPILED:
        cells += [compilation(n, method, False, ROUNDS), compilation(n, method, True, 1)]
    for name in ("symforce", "numba", "jax", "pinocchio", "mujoco", "pydy"):
        cells += [peer(name, "rigid", n, batch=SOME) for n in (2, 5, 10, 20) if (name, n) != ("numba", 5)]
    cells.append(ours("ours", "rigid", 50, "--method", "articulated", batch=2000))
    return [*cells, *(peer(name, "rigid", 50, batch=2000) for name in ("heyoka", "casadi"))]


def measure(quick: bool) -> dict[str, Any]:
    """What goes into `speed.json` but for the targets."""
    start = time.monotonic()
    facts = report.machine(PACKAGES)
    cells = plan(quick)
    records: dict[tuple[str, str, int], Record] = {}
    with tempfile.TemporaryDirectory(prefix="eomgen-speed-") as folder:
        place = Place(Path(folder, "models"), Path(folder, "compiles"))
        for turn in range(1 if quick else ROUNDS):
            for cell in cells:
                if turn >= cell.rounds:
                    continue
                for who, sample in cell.measure(place):
                    record = records.setdefault((who, cell.case, cell.links), new_record(who, cell.case, cell.links))
                    add(record, sample)
                    _show(turn, record, sample)
    return {
        "suite": "speed",
        "arguments": {"quick": quick},
        "rounds": 1 if quick else ROUNDS,
        "machine": {**facts, "load_after": round(os.getloadavg()[0], 2)},
        "minutes": round((time.monotonic() - start) / 60, 1),
        "records": list(records.values()),
    }


def _show(turn: int, record: Record, sample: Sample) -> None:
    values = sample.get("values", {})
    if "ns" in values:
        what = f"{report.digits(values['ns'])} ns"
    elif "seconds" in values:
        what = report.seconds(values["seconds"])
    else:
        what = ", ".join(f"{name} {value:.4g}" for name, value in values.items())
    head = report.cell_name(f"round {turn + 1}", record["who"], record["case"], record["links"])
    report.progress(head + (sample.get("problem") or what))
