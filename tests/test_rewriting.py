"""Rewriting keeps errors: programs before and after each pass, and as loops, evaluated in floats on the catalogue.

That it keeps the functions is decided exactly elsewhere (`eomgen verify`, tests/test_verify.py).
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
import pytest

from eomgen import functions, hard, loops, pipeline
from eomgen.frontends import METHODS
from eomgen.ir.interpret import Floats, run
from eomgen.ir.program import Program
from eomgen.passes import chunk, hoist

certify = pytest.importorskip("eomgen.certify")
pytest.importorskip("flint", reason="certified errors need python-flint")

CASES = {case.name: case for case in hard.cases() if case.scene.name in ("rods", "lumped", "elastic", "walker")}
FAMILIES = {case.scene.name: case.scene for case in CASES.values()}
NAMES = ("forward_dynamics", "inverse_dynamics", "bias", "energy")
# Loops evaluate the steps of straight-line code in another order of sums, and fold fewer zeros.
LARGEST_FACTOR = 2.0
SHORT_PIECES = functools.partial(chunk.run, limit=10)  # so that these programs are cut, too


@functools.cache
def exact(family: str) -> certify.Exact:
    return certify.Exact(FAMILIES[family])


def result(program: Program, values: hard.State) -> np.ndarray:
    inputs = {array.name: values[array.name].reshape(-1) for array in program.inputs}
    with np.errstate(all="ignore"):
        return np.array([float(x) for x in run(program, inputs, Floats())])


def error(program: Program, case: hard.Case) -> float:
    return certify.errors(result(program, case.values), exact(case.scene.name).values(program.name, case.values))[0]


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rewrite", [hoist.run, SHORT_PIECES], ids=["hoist", "chunk"])
def test_passes_keep_every_bit(rewrite: Callable[[Program], Program], method: str, family: str) -> None:
    """They move operations and do not change them, so the factor is one; NaN stays NaN."""
    equations = pipeline.derive(FAMILIES[family], method)
    changed = set()
    for name in NAMES:
        before = functions.program(equations, name)
        after = rewrite(before)
        if after.constants or len(after.blocks) > 1:
            changed.add(name)
        for case in CASES.values():
            if case.scene.name == family:
                assert np.array_equal(result(after, case.values), result(before, case.values), equal_nan=True), (
                    case.name
                )
    assert len(changed) >= 3


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("name", NAMES)
def test_loops_keep_errors(name: str, family: str) -> None:
    """To a factor, and half a last place, where the straight-line program is right to less than that."""
    equations = pipeline.derive(FAMILIES[family], "articulated")
    straight, looped = functions.program(equations, name), loops.program(equations.mechanism, name)
    for case in CASES.values():
        if case.scene.name == family:
            before, after = error(straight, case), error(looped, case)
            assert after <= LARGEST_FACTOR * max(before, 0.5), (case.name, before, after)
