"""The parts of `eomgen bench pareto`: what lies on the front, and that measured errors are those of the results."""

import math

import numpy as np
import pytest

from bench import pareto
from eomgen import chain, pipeline


def record(ns: float, error: float, variant: str = "x") -> pareto.Record:
    return {"scene": "s", "who": "eomgen", "variant": variant, "sines": "", "form": "", "ns": [ns] * 3, "error": error}


def test_the_front_has_what_nothing_surpasses() -> None:
    found = [record(1, 1e-6), record(2, 1e-7), record(3, 1e-7), record(4, 1e-15, "default"), record(9, 1e-16)]
    found += [record(5, 2e-16), record(0.5, math.inf), record(20, 1e-16)]
    assert [r["ns"][0] for r in pareto.front(found)] == [1, 2, 4, 5, 9]
    assert pareto.slack(found) == 1
    assert pareto.slack([*found, record(2.5, 1e-15)]) == 1  # the same code, measured again
    assert pareto.slack([*found, record(2.5, 0.9e-15)]) == 4 / 2.5


def test_the_table_marks_the_front() -> None:
    found = {"minutes": 0, "machine": pareto.report.machine([]), "records": [record(4, 1e-15, "default"), record(5, 1)]}
    found["records"].append({"scene": "s", "who": "casadi", "variant": "", "problem": "not installed", "ns": []})
    text = pareto.render(found)
    assert "| **default** |" in text.replace("  ", " ")
    assert "**x**" not in text
    assert "* s, casadi: not installed" in text


def test_errors_are_those_of_the_results(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("flint")
    monkeypatch.setattr(pareto, "STATES", 7)
    problem = pareto.Problem("2 rigid links", chain(2, model="rigid"), None, "rigid", 2)
    batch = pareto.states(problem)
    exact = pareto.Exact(problem, batch)
    module = pipeline.compile(problem.scene, backend="numpy", functions=["forward_dynamics"])
    found = module.forward_dynamics(batch["q"], batch["v"], batch["u"], module.p)
    assert exact.error(found) < 1e-13
    found[3] *= 1 + 1e-9
    assert exact.error(found) == pytest.approx(1e-9, rel=1e-3)
    assert exact.error(np.float32(found)) > 1e-8
