"""The speed of compiled modules, beside hand-written C and what users would pick instead.

`eomgen bench speed` runs every contender of the targets in a fresh process, one after another, the whole set in
several rounds; a ratio is taken within a round. Every process checks its answers, a sample of them against 60 digits,
before it measures. It writes `speed.json`; `speed.md` and `speed.png` are made from that file alone.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import math
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from threading import Timer
from typing import Any, NamedTuple

from bench import report
from eomgen.errors import CheckError, OptionError, UnsupportedError, one_line, shown

PACKAGES = (
    "numpy", "cython", "msgspec", "mpmath", "casadi", "heyoka", "mujoco", "pin", "symforce", "jax", "numba", "pydy",
)  # fmt: skip
ROUNDS = 3
LIMIT = 60.0  # seconds a process may take to derive, compile, check and measure, unless a cell says otherwise
STATES = 100_000  # in a batch
FEW = 2_000  # in a batch that stays in the cache
SOME = 10_000  # in a batch of contenders that take microseconds per state; it also is the number of trajectories
CHECKED = 20_000  # states compared with the reference in double precision
REPEATED = 5  # calls in a row by each thread
MEGABYTE = 1e6

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
TREE = "random tree"  # in place of the method: articulated, on a tree of three kinds of links in random order
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
HAND = {
    "hand-written C, simd": "hand-simd",
    "hand-written C, scalar": "hand-libm",
    "hand-written C, scalar, inlined sincos": "hand-inlined",
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
ONE_AT_A_TIME = ("ours-one", "hand-libm", "hand-inlined", "casadi", "casadi-recursion", "symforce", "numba")
BATCHED = (
    "ours", "ours-batch", "hand-simd", "heyoka", "heyoka-recursion", "casadi", "symforce", "numba", "jax", "pinocchio",
    "mujoco", "pydy",
)  # fmt: skip

AXES = ((0.055, 0.24), (0.335, 0.24), (0.81, 0.18))  # left edges and widths of the panels of the picture
SINCOS_FLOPS = 45  # in a pair by eomgen_real.h, where a fused multiply-add counts two

Record = dict[str, Any]
Sample = dict[str, Any]


class Finished(NamedTuple):
    """A process that has ended.

    Attributes:
        code: its exit code; None if it was stopped at the limit.
        lines: its standard output.
        error: the last line of its standard error.
        seconds: its wall time.
        peak: the most memory that it, or a process it started, had resident, in MB.
    """

    code: int | None
    lines: list[str]
    error: str
    seconds: float
    peak: float


def run(command: Sequence[str], limit: float, environment: Mapping[str, str]) -> Finished:
    """Runs a command at the root of the checkout; at the limit it ends with all it has started."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        start = time.perf_counter()
        process = subprocess.Popen(
            command, cwd=report.ROOT, env=environment, stdout=out, stderr=err, start_new_session=True
        )
        late: list[bool] = []

        def stop() -> None:
            late.append(True)
            os.killpg(process.pid, signal.SIGKILL)

        timer = Timer(limit, stop)
        timer.start()
        try:
            _, status, usage = os.wait4(process.pid, 0)
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            raise
        finally:
            timer.cancel()
        seconds = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for stream in (out, err):
            stream.seek(0)
            texts.append(stream.read().strip().splitlines())
        unit = 1 if sys.platform == "darwin" else 1024
        code, peak = process.returncode, usage.ru_maxrss * unit / MEGABYTE
        last = texts[1][-1] if texts[1] else f"exit code {code}"
        return Finished(None if late else code, texts[0], last, seconds, peak)


# Cells. A cell is one process; it gives samples of one or more records, which its name tells.


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


METRICS = {"ns_per_state": "ns", "ns_single_call_from_python": "single", "build_seconds": "build"}
FACTS = ("version", "operations", "max_error", "error_60_digits", "states_checked", "note", "ns_plain_c_interface")


def script(who: str, case: str, links: int, path: str, *options: object, rounds: int = 1, limit: float = LIMIT) -> Cell:
    """A contender's script, which prints a line of JSON for each thing it measures."""
    words = [path, "--json", "--links", str(links), *map(str, options)]

    def measure(place: Place) -> Iterator[tuple[str, Sample]]:
        done = run([sys.executable, *words], limit, place.environment())
        if done.code is None:
            yield who, {"problem": f"> {limit:g} s"}
            return
        found = [json.loads(line) for line in done.lines if line.startswith("{")]
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
            yield who, {"problem": one_line(f"error: {done.error}", 160)}

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
            problem = f"> {LIMIT:g} s" if done.code is None else f"error: {done.error}"
            yield f"eomgen {method}", {"problem": one_line(problem, 160)}
        else:
            yield f"eomgen {method}", {"values": {"seconds": done.seconds, "peak": done.peak}, "facts": {}}

    return Cell(f"eomgen {method}", "virgin" if virgin else "cached", links, measure, rounds)


def probe(name: str, links: int, *options: object, rounds: int) -> Cell:
    """A probe of this file, in a process of its own."""

    def measure(place: Place) -> Iterator[tuple[str, Sample]]:
        words = [sys.executable, "-m", "bench.speed", "--probe", name, *map(str, options)]
        done = run(words, 2 * LIMIT, place.environment())
        if done.code != 0 or not done.lines:
            problem = f"> {2 * LIMIT:g} s" if done.code is None else f"error: {done.error}"
            yield name, {"problem": one_line(problem, 160)}
        else:
            yield name, json.loads(done.lines[-1])

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


def measure(quick: bool, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Everything that goes into `speed.json`."""
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
        "arguments": dict(arguments),
        "rounds": 1 if quick else ROUNDS,
        "machine": {**facts, "load_after": round(os.getloadavg()[0], 2)},
        "minutes": round((time.monotonic() - start) / 60, 1),
        "records": list(records.values()),
    }


def new_record(who: str, case: str, links: int) -> Record:
    return {"who": who, "case": case, "links": links, "problem": "", "values": {}, "facts": {}}


def add(record: Record, sample: Sample) -> None:
    """Adds a round's sample to its record; one that has no answer spoils the record."""
    record["problem"] = record["problem"] or sample.get("problem", "")
    for name, value in sample.get("values", {}).items():
        record["values"].setdefault(name, []).append(value)
    record["facts"].update(sample.get("facts", {}))


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


# Probes: what needs a process of its own and is no contender. Each returns a sample.


def _five_links(backend: str = "c") -> Any:
    import eomgen

    return eomgen.compile(eomgen.chain(5, model="rigid"), backend=backend, functions=["forward_dynamics"])


def probe_memory(states: str, backend: str) -> Sample:
    """The memory that a batch needs beyond its arguments and its result, given or new, in MB."""
    import resource

    import numpy as np

    module, count = _five_links(backend), int(states)
    module.forward_dynamics(*np.ones((3, 8, 5)), module.p)  # whatever a first call keeps
    random = np.random.default_rng(0)
    arrays = [np.empty((count, 5)) for _ in range(4)]
    for array in arrays:
        for k in range(0, count, 10_000):  # a block at a time, so that nothing else is ever as large
            random.standard_normal(out=array[k : k + 10_000])
    unit = (1 if sys.platform == "darwin" else 1024) / MEGABYTE

    def peak() -> float:
        return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)

    before = peak()
    start = time.perf_counter()
    module.forward_dynamics(*arrays[:3], module.p, out=arrays[3])
    seconds = time.perf_counter() - start
    given = peak() - before
    result = module.forward_dynamics(*arrays[:3], module.p)
    new = peak() - before - result.nbytes / MEGABYTE
    if not np.array_equal(result, arrays[3]):
        return {"problem": "error: the two results differ"}
    facts = {"states": count, "arrays": round(4 * arrays[0].nbytes / MEGABYTE)}
    return {"values": {"extra": given, "extra_new": max(new, 0.0), "ns": seconds / count * 1e9}, "facts": facts}


def probe_threads() -> Sample:
    """A batch cut into a slice for each thread: nanoseconds per state with 1, 2, ... threads."""
    import numpy as np

    module, count = _five_links(), 1_000_000
    random = np.random.default_rng(0)
    q, v, u = random.standard_normal((3, count, 5))
    alone, out = module.forward_dynamics(q, v, u, module.p), np.empty((count, 5))
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    values = {}
    for threads in sorted({1, 2, min(cores, 8)}):
        if threads > cores:
            continue
        cuts = [slice(count * k // threads, count * (k + 1) // threads) for k in range(threads)]
        with ThreadPoolExecutor(threads) as pool:

            def call(cut: slice) -> None:
                for _ in range(REPEATED):
                    module.forward_dynamics(q[cut], v[cut], u[cut], module.p, out=out[cut])

            times = []
            for _ in range(7):
                out[...] = np.nan
                start = time.perf_counter()
                list(pool.map(call, cuts))
                times.append(time.perf_counter() - start)
                if not np.array_equal(out, alone):
                    return {"problem": "error: threads change the result"}
        values[str(threads)] = statistics.median(times) / (REPEATED * count) * 1e9
    return {"values": values, "facts": {"cores": cores, "states": count}}


PEAK = """
#include "eomgen_real.h"

enum { CHAINS = 16 };

/* Fused multiply-adds in chains that do not wait for each other, `rounds` in each. */
double chains(long rounds, double a, double b)
{
    eom_f64v x[CHAINS], factor = eom_set_f64v(a), addend = eom_set_f64v(b);
    for (int i = 0; i < CHAINS; i++) x[i] = eom_set_f64v(i);
    for (long k = 0; k < rounds; k++) {
#pragma GCC unroll 16
        for (int i = 0; i < CHAINS; i++) x[i] = eom_fma_f64v(x[i], factor, addend);
    }
    double sum = 0;
    for (int i = 0; i < CHAINS; i++) sum += x[i][0];
    return sum;
}

long flops_per_round(void) { return 2L * CHAINS * EOM_LANES_F64; }
"""


def probe_peak() -> Sample:
    """The GFLOP/s of independent fused multiply-adds in this machine's vectors, compiled as modules are."""
    module = _five_links()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    sources, flags = Path(module.__file__).parent / "csrc", module.info["flags"].split()
    compiler = os.environ.get("CC") or "cc"
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder, "peak.c"), Path(folder, "peak.so")
        source.write_text(PEAK)
        words = [*compiler.split(), *flags, "-fvisibility=default", "-shared", f"-I{sources}", str(source)]
        subprocess.run([*words, "-o", str(library)], check=True)
        loaded = ctypes.CDLL(str(library))
    loaded.chains.restype = ctypes.c_double
    rounds = 2_000_000
    call = partial(loaded.chains, ctypes.c_long(rounds), ctypes.c_double(0.5), ctypes.c_double(1.0))
    call()
    times = []
    for _ in range(15):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    flops = rounds * loaded.flops_per_round()
    return {
        "values": {"gflops": flops / statistics.median(times) / 1e9, "most": flops / min(times) / 1e9},
        "facts": {"lanes": loaded.flops_per_round() // 32},
    }


PROBES: dict[str, Callable[..., Sample]] = {
    "memory": probe_memory,
    "memory-numpy": probe_memory,
    "threads": probe_threads,
    "peak": probe_peak,
}


# Rendering, from the JSON alone.


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


UNITS = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "ns": 1e-9}


def unit_of(value: float, metric: str) -> tuple[str, float]:
    """The unit that suits a value of a metric, in the metric's own: nanoseconds, seconds or MB."""
    base = {"seconds": 1.0, "build": 1.0, "extra": 0.0, "extra_new": 0.0, "peak": 0.0}.get(metric, 1e-9)
    if not base:
        return "MB", 1.0
    name = next((name for name, size in UNITS.items() if value * base >= 0.9995 * size), "ns")
    return name, UNITS[name] / base


def amount(value: float, metric: str) -> str:
    """A value with its unit."""
    unit, size = unit_of(value, metric)
    return f"{report.digits(value / size)} {unit}"


def spread(values: Sequence[float], text: str, metric: str = "") -> str:
    """A median with the smallest and largest of its rounds, in its unit."""
    if len(values) < 2:
        return text
    size = unit_of(statistics.median(values), metric)[1] if metric else 1.0
    low, high = (report.digits(value / size) for value in (min(values), max(values)))
    return f"{text} ({low} – {high})"


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
    for n in (5, 20):
        simd, what = Side("hand-simd", "rigid, cache", n), f"{n} rigid links, {_whole(FEW)} states (in cache)"
        for who, layout in (("ours", "row-major"), ("ours-batch", "batch-contiguous")):
            rows.append(compared(data, f"{what}, {layout}", Side(who, "rigid, cache", n), simd, asked=False))
    jacobian, what = Side("ours", "jacobian, cache", 5), f"Jacobian, 5 rigid links, {_whole(FEW)} states (in cache)"
    rows.append(compared(data, what, jacobian, Side("ours", "rigid, cache", 5), asked=False))
    rows.append(compared(data, what, jacobian, Side("casadi", "jacobian, cache", 5), least=1, asked=False))
    return [row for row in rows if row.ratio != "–"]


def _targets(rows: Sequence[Target]) -> str:
    met = {True: "yes", False: "**no**", None: "–"}
    header = ["what: against", "measured", "ratio", "of the fastest", "target", "met"]
    return report.markdown(header, [[r.what, r.measured, r.ratio, r.fastest, r.target, met[r.met]] for r in rows])


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
        f"{_whole(STATES)} states, those of contenders that take microseconds {_whole(SOME)}. Before a process "
        "measures, it compares its answers for these states with an independent reference, a sample of them in 60 "
        f"digits: largest scaled error {worst.get(True, 0):.0e} (eomgen), {worst.get(False, 0):.0e} (others). Load of "
        f"the machine at the end: {found['machine'].get('load_after')}."
    )


def _whole(number: int) -> str:
    return f"{number:,}".replace(",", " ")


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
    text = f"A batch of {_whole(record['facts']['states'])} states of 5 rigid links, a slice for each thread of a pool:"
    return f"{text}\n\n" + report.markdown(["threads", "per state", "gain"], rows)


# The picture.


def plot(data: Data, path: Path) -> None:
    """`speed.png`: time against links in batches and one at a time, and how far each target is."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

    rows = [row for row in targets(data) if row.share is not None]
    figure = pyplot.figure(figsize=(19, 10.4))
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
        axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.yaxis.set_minor_formatter(NullFormatter())
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
    from matplotlib.ticker import FuncFormatter, NullFormatter

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
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.grid(True, axis="x", which="major", color="0.85", linewidth=0.6)
    axis.tick_params(axis="y", length=0)


# The command line.


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The options."""
    parser = report.Parser(
        prog="eomgen bench speed",
        description="Times compiled modules beside hand-written C and other tools; writes speed.json, speed.md and "
        "speed.png. Run it on a quiet machine, with the Python that has the contenders installed.",
        epilog="examples:\n  eomgen bench speed                       the full run, about 10 minutes\n"
        "  eomgen bench speed --quick               one round of the targets, about a minute\n"
        "  eomgen bench speed --from-json results/speed.json",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="one round, fewer sizes and contenders")
    parser.add_argument("--out", default="results", metavar="DIR", help="output folder (results)")
    parser.add_argument("--from-json", metavar="FILE", help="measure nothing; make table and plot from this file")
    parser.add_argument("--probe", nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.probe and options.probe[0] not in PROBES:
        raise OptionError(f"there is no probe {shown(options.probe[0])}")
    return options


def main() -> int:
    """Runs the suite; the exit code is 1 where something of eomgen failed or gave a wrong answer."""
    options = parse()
    if options.probe:
        name, *words = options.probe
        print(json.dumps(PROBES[name](*words)))
        return 0
    report.require("matplotlib", "the plot of speed", "bench")
    place = report.folder(options.out)
    if options.from_json:
        found = report.load(options.from_json, "speed")
    else:
        if not hasattr(os, "wait4"):
            raise UnsupportedError("bench speed needs a POSIX system for its time limits")
        found = measure(options.quick, {"quick": options.quick})
        found["targets"] = [{**row._asdict(), "met": row.met} for row in targets(Data(found))]
        report.write(place / "speed.json", report.dumped(found))
    data = Data(found)
    report.write(place / "speed.md", render(data))
    plot(data, place / "speed.png")
    print(f"wrote {place / 'speed.md'} and speed.png" + ("" if options.from_json else " and speed.json"))
    failed = [r for r in data.records if r["problem"] and r["who"].startswith(("ours", "eomgen", *PROBES))]
    if failed:
        first = failed[0]
        raise CheckError(f"{len(failed)} measurements failed; the first: {first['who']}: {first['problem']}")
    return 0


if __name__ == "__main__":
    sys.exit(report.command(main))
