"""Cells: a cell is one process; it gives samples of one or more records, which its name tells."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from bench.process import run
from bench.speed.data import STATES, TREE, Sample
from eomgen.errors import one_line

CHECKED = 20_000  # states compared with the reference in double precision
LIMIT = 60.0  # seconds a process may take to derive, compile, check and measure, unless a cell says otherwise
HAND = {
    "hand-written C, simd": "hand-simd",
    "hand-written C, scalar": "hand-libm",
    "hand-written C, scalar, inlined sincos": "hand-inlined",
}
METRICS = {"ns_per_state": "ns", "ns_single_call_from_python": "single", "build_seconds": "build"}
FACTS = ("version", "operations", "max_error", "error_60_digits", "states_checked", "note", "ns_plain_c_interface")


class Place(NamedTuple):
    """Where a run keeps what it builds: the modules that are measured, and the cache of the compile times."""

    models: Path
    compiles: Path

    def environment(self, cache: Path | None = None) -> dict[str, str]:
        """For a process: its cache, and temporary files where they go with the run even if it is stopped."""
        return {**os.environ, "EOMGEN_CACHE": str(cache or self.models), "TMPDIR": str(self.models.parent)}


class Cell(NamedTuple):
    """A process to run in each of the first `rounds` rounds.

    Attributes:
        who, case, links: the record that its samples belong to; a script of several contenders names each itself.
        measure: runs it and gives (who, sample) pairs.
        rounds: in how many rounds it is run.
    """

    who: str
    case: str
    links: int
    measure: Callable[[Place], Iterable[tuple[str, Sample]]]
    rounds: int


def script(who: str, case: str, links: int, path: str, *options: object, rounds: int = 1, limit: float = LIMIT) -> Cell:
    """A contender's script, which prints a line of JSON for each thing it measures."""
    words = [path, "--json", "--links", str(links), *map(str, options)]

    def measure(place: Place) -> Iterator[tuple[str, Sample]]:
        done = run([sys.executable, *words], limit, place.environment())
        found = done.answers()
        for line in found:
            if "error" in line:
                problem = one_line(line["error"].replace("does not install", "not installed"), 120)
                yield HAND.get(line["peer"], who), {"problem": problem}
                continue
            values = {short: line[name] for name, short in METRICS.items() if line.get(name) is not None}
            values["best"] = line["spread"][0]
            facts = {name: line[name] for name in FACTS if line.get(name) is not None}
            yield HAND.get(line["peer"], who), {"values": values, "facts": facts}
        if not found:
            yield who, {"problem": done.problem}

    return Cell(who, case, links, measure, rounds)


def compilation(links: int, method: str, virgin: bool, rounds: int) -> Cell:
    """`eomgen compile` of a new model as a whole process, with the wrapper's objects cached or with nothing cached."""

    def measure(place: Place) -> Iterator[tuple[str, Sample]]:
        shutil.rmtree(place.compiles / ("" if virgin else "models"), ignore_errors=True)
        words = ["-m", "eomgen", "compile", "--links", str(links), "--model", "rigid", "--method", method]
        if method == TREE:
            text = f"import eomgen, bench.cases; eomgen.compile(bench.cases.random_tree({links}), 'articulated')"
            words = ["-c", text]
        environment = place.environment(place.compiles)
        if not virgin and not (place.compiles / "wrapper").is_dir():
            run([sys.executable, "-m", "eomgen", "compile", "--links", "1"], LIMIT, environment)
        done = run([sys.executable, *words], LIMIT, environment)
        if done.code != 0:
            yield f"eomgen {method}", {"problem": done.problem}
        else:
            yield f"eomgen {method}", {"values": {"seconds": done.seconds, "peak": done.peak}, "facts": {}}

    return Cell(f"eomgen {method}", "virgin" if virgin else "cached", links, measure, rounds)


def probe(name: str, links: int, *options: object, rounds: int) -> Cell:
    """A probe of `bench.speed.probes`, in a process of its own."""

    def measure(place: Place) -> Iterator[tuple[str, Sample]]:
        words = [sys.executable, "-m", "bench.speed", "--probe", name, *map(str, options)]
        done = run(words, 2 * LIMIT, place.environment())
        found = done.answers() if done.code == 0 else []
        yield name, found[-1] if found else {"problem": done.problem}

    return Cell(name, "probe", links, measure, rounds)


def peer(
    who: str, case: str, links: int, *options: object, rounds: int = 1, batch: int = STATES, repeats: int = 15
) -> Cell:
    """The script of a contender; the name's second part is the algorithm typed in."""
    name, _, algorithm = who.partition("-")
    words: list[object] = ["--batch", batch, "--repeats", repeats, "--check", CHECKED, *options]
    if algorithm:
        words += ["--algorithm", algorithm]
    return script(who, case, links, f"bench/peers/{name}.py", *words, rounds=rounds)


def ours(
    who: str, case: str, links: int, *options: object, rounds: int = 1, batch: int = STATES, repeats: int = 31
) -> Cell:
    """eomgen in the same harness."""
    words = ("--batch", batch, "--repeats", repeats, "--check", CHECKED, *options)
    return script(who, case, links, "bench/peers/ours.py", *words, rounds=rounds)


def hand(links: int, rounds: int) -> Cell:
    """The hand-written C, in all its variants."""
    return script("hand", "rigid", links, "bench/handwritten/measure.py", "--batch", STATES, rounds=rounds)
