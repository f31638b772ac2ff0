"""One cold derivation in a fresh process: ``python -m bench.generation.one CONTENDER KIND LINKS``.

Prints one line of JSON. ``seconds`` is ``derive`` alone, on the wall clock: the library is imported before,
and nothing of it has been used. The exit code is 1, and the line has ``error``, where the equations are not
those of the reference. The caller sets a time limit.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib
import json
import sys
import time
from typing import Any, Protocol, cast

import numpy as np

from bench.generation import CONTENDERS
from bench.generation.mechanism import NOMINAL, Mechanism, Vector

TOLERANCE = 1e-9  # of the largest entry: far above rounding in double precision, far below a wrong term


class Contender(Protocol):
    """What a contender's module offers."""

    VERSION: str

    def derive(self, mechanism: Mechanism) -> Any:
        """The complete symbolic mass matrix and bias of a mechanism: this is what is timed."""

    def evaluate(self, derived: Any, mechanism: Mechanism, q: Vector, v: Vector) -> tuple[Vector, Vector]:
        """The mass matrix (n, n) and the bias (n) of a state.

        Args:
            derived: What ``derive`` returned for a mechanism of this kind and size.
            mechanism: The mechanism whose parameter values count.
            q: Its coordinates (n).
            v: Their rates (n).
        """


def max_error(contender: Contender, derived: Any, mechanism: Mechanism) -> float:
    """The largest difference from the reference at two random states, scaled by the largest entry.

    The links are equal in the first state and unequal in the second.
    """
    errors = []
    for seed, spread in enumerate((0.0, 0.05)):
        checked = dataclasses.replace(mechanism, spread=spread)
        q, v = checked.random_state(seed)
        values = contender.evaluate(derived, checked, q, v)
        for ours, theirs in zip(checked.reference(q, v), values, strict=True):
            if ours.shape != theirs.shape:
                raise ValueError(f"the shape {theirs.shape} of a result is wrong: it must be {ours.shape}")
            errors.append(float(np.max(np.abs(theirs - ours)) / np.max(np.abs(ours))))
    return float(np.max(errors))  # NaN stays NaN


def measure(name: str, mechanism: Mechanism) -> dict[str, Any]:
    """The record of one derivation; cold only in a process that has derived nothing before.

    Args:
        name: One of ``CONTENDERS``.
        mechanism: What to derive the equations of.

    Raises:
        ImportError: The contender's library is not installed.
    """
    contender = cast(Contender, importlib.import_module(f"bench.generation.{name}"))
    start = time.perf_counter()
    derived = contender.derive(mechanism)
    seconds = time.perf_counter() - start
    error = max_error(contender, derived, mechanism)
    record: dict[str, Any] = {
        "contender": name,
        "kind": mechanism.kind,
        "links": mechanism.links,
        "seconds": seconds,
        "version": contender.VERSION,
        "max_error": error,
    }
    if not error < TOLERANCE:
        record["error"] = f"the equations differ from the reference by {error:.1e}, more than {TOLERANCE:.0e}"
    return record


def main() -> int:
    """Prints the record of one derivation; the exit code is 1 where its equations are wrong."""
    parser = argparse.ArgumentParser(prog="python -m bench.generation.one", description=__doc__)
    parser.add_argument("contender", choices=CONTENDERS)
    parser.add_argument("kind", choices=list(NOMINAL))
    parser.add_argument("links", type=int)
    arguments = parser.parse_args()
    record = measure(arguments.contender, Mechanism(arguments.kind, arguments.links))
    print(json.dumps(record))
    return 1 if "error" in record else 0


if __name__ == "__main__":
    sys.exit(main())
