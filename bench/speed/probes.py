"""Probes: what needs a process of its own and is no contender. Each returns a sample."""

from __future__ import annotations

import ctypes
import os
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from bench.process import MEGABYTE, resident
from bench.speed.data import Sample

REPEATED = 5  # calls in a row by each thread


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

    def peak() -> float:
        return resident(resource.getrusage(resource.RUSAGE_SELF))

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
    from bench.peers import harness  # here, as it sets the number of threads

    module = _five_links()
    harness.one_core()
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
    times = harness.timed(call, 15)
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
