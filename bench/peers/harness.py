"""What the peers' scripts share: arguments, one core, timing, the check and the line of JSON.

Each script calls ``main(name, load, make)``.  ``load()`` imports the tool; ``make(tool, case)`` builds what
is needed and returns a `Peer`.
"""
# ruff: noqa: E402 (the paths and the number of threads must be set first)

import os

for _name in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "VECLIB_MAXIMUM", "NUMBA"):
    os.environ[f"{_name}_NUM_THREADS"] = "1"

import argparse
import ctypes
import importlib.metadata
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bench.peers import mechanism

TOLERANCE = 1e-8  # of a state's largest number: far above rounding, far below a wrong term
SAMPLE = 8  # states checked against 60 digits


@dataclass
class Case:
    """What is asked: the options, the states (rows) and a folder for generated files."""

    links: int
    mechanism: str
    options: argparse.Namespace
    q: np.ndarray
    v: np.ndarray
    u: np.ndarray
    folder: Path


@dataclass
class Peer:
    """What a peer offers: `batch()` computes all states, `result()` gives their accelerations."""

    batch: Callable[[], Any]
    result: Callable[[], np.ndarray]
    single: Callable[[], Any] | None = None
    want: Callable[[], np.ndarray] | None = None  # what `result` should be, if not the accelerations
    exact: Callable[[np.ndarray], np.ndarray] | None = None  # the same to 60 digits, for some rows (or their first)
    states: int | None = None  # states per call of `batch`, if not all
    note: str = ""
    keep: tuple = ()  # what must stay alive
    extra: dict = field(default_factory=dict)


def one_core():
    """Keep this process, and what it starts, on one core."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def timed(call, repeats):
    """Seconds of each of `repeats` calls, after one that does not count."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return times


def per_call(call, repeats=7, budget=0.1):
    """Median seconds of one call out of runs of `budget` seconds."""
    for _ in range(10):
        call()
    start = time.perf_counter()
    call()
    count = max(3, min(100_000, int(budget / max(1e-7, time.perf_counter() - start))))
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(count):
            call()
        times.append((time.perf_counter() - start) / count)
    return float(np.median(times))


def compile_c(sources, folder, flags=(), compiler="gcc", name="peer"):
    """Compile C files to a shared library and load it."""
    library = folder / f"{name}.so"
    command = [compiler, "-O3", "-march=native", "-fPIC", "-shared", *map(str, sources), "-o", str(library)]
    subprocess.run([*command, *flags, "-lm"], check=True)
    return ctypes.CDLL(str(library))


def aligned(array):
    """A copy that starts on a cache line, row-major."""
    raw = np.empty(array.size + 8)
    start = -raw.ctypes.data % 64 // 8
    found = raw[start : start + array.size].reshape(array.shape)
    found[...] = array
    return found


def pointer(array):
    """The address of a contiguous array for ctypes."""
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)


def rows(count, sample=SAMPLE):
    """Which of `count` states are compared with 60 digits."""
    return np.unique(np.linspace(0, count - 1, sample).astype(int))


def wrong(*errors):
    """What a report says of answers with such errors, if they are wrong; None is an error that was not measured."""
    worst = np.max([error or 0.0 for error in errors])  # NaN stays NaN
    return {} if worst < TOLERANCE else {"error": f"wrong answer: scaled error {worst:.1e}"}


def main(name, load, make, package=None, options=(), mechanisms=("rigid",)):
    """Run one peer as a script; `options` are (flag, settings) pairs for argparse."""
    parser = argparse.ArgumentParser(prog=name)
    parser.add_argument("--links", type=int, default=5)
    parser.add_argument("--batch", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--mechanism", choices=mechanisms, default="rigid")
    parser.add_argument("--check", type=int, metavar="N", help="states checked in double precision (all)")
    parser.add_argument("--sample", type=int, metavar="N", default=SAMPLE, help="of all, checked against 60 digits")
    parser.add_argument("--json", action="store_true", help="one line of JSON instead of a table")
    for flag, settings in options:
        parser.add_argument(flag, **settings)
    args = parser.parse_args()
    one_core()
    report = {"peer": name}
    try:
        tool = load()
        report["version"] = getattr(tool, "__version__", None) or importlib.metadata.version(package or name)
    except (ImportError, importlib.metadata.PackageNotFoundError) as error:
        report["error"] = f"does not install: {error}"
    else:
        folder = Path(tempfile.mkdtemp(prefix=f"peer-{name}-"))
        try:
            report |= _measure(tool, make, args, folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    if args.json:
        print(json.dumps(report))
    else:
        for key, value in report.items():
            print(f"{key:28} {value:.6g}" if isinstance(value, float) else f"{key:28} {value}")
    sys.exit(0)


def _measure(tool, make, args, folder):
    q, v, u = mechanism.states(args.links, args.batch, args.seed, args.mechanism)
    case = Case(args.links, args.mechanism, args, q, v, u, folder)
    start = time.perf_counter()
    peer = make(tool, case)
    first = time.perf_counter() - start
    peer.batch()
    got = np.array(peer.result())
    count = min(len(got), args.check or len(got))
    want = peer.want() if peer.want else mechanism.reference(q[:count], v[:count], u[:count], args.mechanism)
    error = mechanism.scaled_error(got[: len(want)], want)
    exact_error = _error_of_sample(peer, case, got[: len(want)] if peer.want else got)
    count = peer.states or args.batch
    times = np.array(timed(peer.batch, args.repeats)) / count * 1e9
    return wrong(error, exact_error) | {
        "mechanism": args.mechanism,
        "links": args.links,
        "batch": args.batch,
        "ns_per_state": float(np.median(times)),
        "spread": [float(times.min()), float(times.max())],
        "ns_single_call_from_python": per_call(peer.single) * 1e9 if peer.single else None,
        "build_seconds": first,
        "max_error": error,
        "error_60_digits": exact_error,
        "states_checked": len(want),
        **peer.extra,
        "note": peer.note,
    }


def _error_of_sample(peer, case, got):
    """The scaled error of a few states against 60 digits; None where nothing has so many."""
    sample = rows(len(got), case.options.sample)
    if peer.want and not peer.exact:
        return None
    try:
        if peer.exact:
            exact = peer.exact(sample)
        else:
            exact = mechanism.exact(case.q[sample], case.v[sample], case.u[sample], case.mechanism)
    except ImportError:  # no mpmath
        return None
    return mechanism.scaled_error(got[sample[: len(exact)]], exact)
