"""Build, check and time the hand-written C: ``python bench/handwritten/measure.py --links 2 5 10 20 --json``.

`Scalar` and `Simd` are also what other benchmarks import: they compile for a number of links and give a call
without arguments to time.
"""

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import argparse
import ctypes
import json
import tempfile

import numpy as np

from bench.peers import harness, mechanism

HERE = Path(__file__).resolve().parent


class Chain:
    """The compiled code for `links` links and the parameters of one chain."""

    source: str
    function: str

    def __init__(self, links, flags=(), mass=None, length=None, gravity=mechanism.GRAVITY):
        self.links = links
        with tempfile.TemporaryDirectory() as folder:
            sources = [HERE / self.source]
            self.library = harness.compile_c(sources, Path(folder), [f"-DN={links}", *flags])
        self.parameters = ctypes.create_string_buffer(self.library.chain_size() + 64)
        values = [np.ones(links) if a is None else np.ascontiguousarray(a, float) for a in (mass, length)]
        self.library.chain_setup(self._parameters(), *map(harness.pointer, values), ctypes.c_double(gravity))

    def _parameters(self):
        return ctypes.c_void_p(-(-ctypes.addressof(self.parameters) // 64) * 64)

    def call(self, phi, omega, tau, out):
        """A call that computes all states; arrays as `rows` makes them."""
        function, parameters = getattr(self.library, self.function), self._parameters()
        count = ctypes.c_long(phi.size // self.links)
        pointers = [harness.pointer(a) for a in (phi, omega, tau)]
        last = harness.pointer(out)
        return lambda: function(count, *pointers, parameters, last)


class Scalar(Chain):
    """One state at a time; arrays of shape (batch, links)."""

    source, function = "scalar.c", "scalar_batch"

    @staticmethod
    def rows(array):
        return harness.aligned(array)


class Simd(Chain):
    """Eight states to a vector; arrays of shape (links, batch)."""

    source, function = "simd.c", "simd_forward"

    @staticmethod
    def rows(array):
        return harness.aligned(array.T)


VARIANTS = {
    "scalar": (Scalar, ()),
    "scalar, inlined sincos": (Scalar, ("-DINLINE_SINCOS",)),
    "simd": (Simd, ()),
}


def check(kind, links, flags, batch=1003):
    """The largest scaled error on a chain of unequal links (and a batch that is no multiple of eight)."""
    mass, length = np.linspace(1, 2, links), np.linspace(1, 0.6, links)
    states = mechanism.states(links, batch, 1)
    chain = kind(links, flags, mass, length)
    arrays = [kind.rows(a) for a in states]
    out = kind.rows(np.full_like(states[0], np.nan))
    chain.call(*arrays, out)()
    got = out.T if kind is Simd else out
    return mechanism.scaled_error(got, mechanism.reference(*states, mass=mass, length=length))


def exact_error(got, states):
    """The scaled error of a few of the timed states against 60 digits; None without mpmath."""
    rows = harness.rows(len(got))
    try:
        return mechanism.scaled_error(got[rows], mechanism.exact(*(a[rows] for a in states)))
    except ImportError:
        return None


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--links", type=int, nargs="+", default=[2, 5, 10, 20])
    parser.add_argument("--batch", type=int, default=100_000)
    parser.add_argument("--repeats", type=int, default=25)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    harness.one_core()
    for links in args.links:
        states = mechanism.states(links, args.batch)
        for name, (kind, flags) in VARIANTS.items():
            chain = kind(links, flags)
            arrays = [kind.rows(a) for a in states]
            out = kind.rows(np.zeros_like(states[0]))
            call = chain.call(*arrays, out)
            call()
            errors = [check(kind, links, flags), exact_error(out.T if kind is Simd else out, states)]
            times = np.array(harness.timed(call, args.repeats)) / args.batch * 1e9
            report = harness.wrong(*errors) | {
                "peer": f"hand-written C, {name}",
                "links": links,
                "batch": args.batch,
                "ns_per_state": float(np.median(times)),
                "spread": [float(times.min()), float(times.max())],
                "max_error": errors[0],
                "error_60_digits": errors[1],
            }
            if args.json:
                print(json.dumps(report), flush=True)
            else:
                low, high = report["spread"]
                print(
                    f"{links:3} links  {name:28} {report['ns_per_state']:8.2f} ns  ({low:.2f} to {high:.2f})"
                    f"  error {report['max_error']:.1e}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
