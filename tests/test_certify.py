"""Certified errors: enclosures hold exact values, and measured errors are bounds."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen import certify
from eomgen.cli import main
from eomgen.errors import UnsupportedError
from eomgen.ir.expr import Graph
from eomgen.verification import EPS

flint = pytest.importorskip("flint", reason="certified errors need python-flint")


def test_enclosures_hold_rational_values() -> None:
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    (ball,) = certify.enclose([(x * x - y) / (x + 3)], {x: 0.1, y: 2.5})
    exact = (Fraction(0.1) ** 2 - Fraction(2.5)) / (Fraction(0.1) + 3)
    with flint.ctx.workprec(1000):
        assert ball.overlaps(flint.arb(exact.numerator) / exact.denominator)
    assert ball.rel_accuracy_bits() >= certify.TIGHT


def test_precision_is_raised_until_the_digits_are_there() -> None:
    """A difference that cancels to a few digits, of sines of an angle that takes a thousand bits to reduce."""
    graph = Graph()
    x = graph.symbol("x")
    (ball,) = certify.enclose([graph.sin(x + 1) - graph.sin(x) * graph.cos(graph.one) - graph.cos(x)], {x: 1e300})
    assert ball.rel_accuracy_bits() >= certify.TIGHT


def test_flint_keeps_its_precision() -> None:
    before = flint.ctx.prec
    graph = Graph()
    certify.enclose([graph.sin(graph.symbol("x"))], {graph.symbol("x"): 1.0})
    assert flint.ctx.prec == before


def test_errors_are_upper_bounds() -> None:
    """A result that is off by a known number of units in the last place is measured as such."""
    with flint.ctx.workprec(256):
        third = flint.arb(1) / 3
    wrong = np.array([np.nextafter(1 / 3, 1), 1.0])
    scaled, relative = certify.errors(wrong, [third, flint.arb(1)])
    true = abs(float(Fraction(wrong[0]) - Fraction(1, 3))) / EPS
    assert scaled == pytest.approx(true)
    assert relative == pytest.approx(3 * true)
    assert certify.errors(np.array([math.nan]), [third]) == (math.inf, math.inf)


def test_a_singular_state_has_no_certificate() -> None:
    equations = eomgen.derive(eomgen.chain(1))
    given = dict.fromkeys(equations.symbols.slots, 0.0)
    with pytest.raises(UnsupportedError, match="singular"):
        certify.enclose(list(equations.forward_dynamics), given)


@pytest.mark.parametrize("scene", [eomgen.chain(2), eomgen.walker()], ids=["chain", "walker"])
def test_hard_states_stay_within_the_bound(scene: eomgen.Scene) -> None:
    """8 n eps + 2 κ eps: what rounding of the data and of n eliminations explains."""
    found = certify.certify(scene, methods=("matrix", "articulated"), backends=("numpy",), names=["forward_dynamics"])
    assert {item.state for item in found} >= {"aligned", "folded", "angles of 1e15"}
    for item in found:
        if item.state not in ("fast and nearly aligned", "angles of all sizes"):  # angles, not M, are the hard part
            assert item.scaled <= 8 * 10 + 2 * item.condition, item


def test_the_command_writes_its_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "errors.json"
    words = ["verify", "--links", "1", "--model", "rigid", "--backend", "numpy", "--certify", "--json", str(out)]
    assert main(words) == 0
    assert "angles of 1e15" in capsys.readouterr().out
    rows = json.loads(out.read_text())
    assert {row["function"] for row in rows} >= {"forward_dynamics", "bias"}
    assert main([*words[:-3], "--json", str(out)]) == 2
