"""Certified errors: enclosures hold exact values, and measured errors are bounds."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import eomgen
from eomgen import certify, functions, hard, pipeline
from eomgen.cli import main
from eomgen.errors import OptionError, UnsupportedError
from eomgen.frontends import METHODS
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


def test_a_result_without_an_exact_value_is_an_error() -> None:
    """In a singular state NaN is right and a number is wrong, whatever it is."""
    labels = ("scene", "case", "matrix", "c", "float64", "forward_dynamics")
    for computed, passed in ((math.nan, True), (1.0, False)):
        item = certify.Certificate(*labels, *certify.errors(np.array([computed]), []), 0.0, math.inf, math.inf, 1)
        assert item.passed == passed
    scene = eomgen.chain(1)
    states = {**hard.random_state(scene), "q": np.array([0.3, 0.0])}
    found = certify.measure([hard.Case("chain1: no length", scene, states, "")], names=["forward_dynamics"])
    assert len(found) == 10
    assert all(item.scaled == math.inf and item.passed for item in found)


@pytest.mark.parametrize(
    ("function", "condition", "passed"),
    [("forward_dynamics", 1.1 / EPS, True), ("forward_dynamics", 0.9 / EPS, False), ("forward_dynamics", 10.0, False),
     ("jacobian", 10.0, False), ("inverse_dynamics", 1.1 / EPS, False)],
)  # fmt: skip
def test_no_result_is_right_in_singular_states_only(function: str, condition: float, passed: bool) -> None:
    labels = ("scene", "case", "matrix", "c", "float64", function)
    nothing = certify.Certificate(*labels, math.inf, math.inf, 1.0, condition, condition, 5)
    assert nothing.passed == passed


@pytest.mark.parametrize("names", [None, ["forward_dynamics", "jacobian"], ["jacobian"]])
def test_long_scenes_have_their_forward_dynamics_certified(
    names: list[str] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only that, by loops only: the exact Jacobian of a thousand links would take all memory."""
    monkeypatch.setattr(certify, "MOST_LINKS", 1)
    scene = eomgen.chain(2, "rigid")
    found = certify.measure([hard.Case("long", scene, hard.random_state(scene), "")], backends=["numpy"], names=names)
    expected = {("articulated loops", "forward_dynamics")} if names != ["jacobian"] else set()
    assert {(item.method, item.function) for item in found} == expected


def test_results_beyond_the_type_are_left_out() -> None:
    """Masses of 1e-200 kg: by a mass the accelerations change by 1e400 m/s² per kg."""
    (case,) = [case for case in hard.cases() if case.name == "rods: tiny masses"]
    found = certify.measure([case], ["articulated"], ["numpy"], ["forward_dynamics", "parameter_jacobian"])
    assert [item.function for item in found] == ["forward_dynamics"]


def test_a_singular_state_has_no_certificate() -> None:
    equations = eomgen.derive(eomgen.chain(1))
    given = dict.fromkeys(equations.symbols.slots, 0.0)
    with pytest.raises(UnsupportedError, match="singular"):
        certify.enclose(list(equations.forward_dynamics), given)


# Condition numbers


def test_the_condition_of_a_known_matrix() -> None:
    """One link of free length s: M is diagonal with θ₁ s² and θ₂, so κ₂ is their ratio, and 1 when scaled."""
    exact = certify.Exact(eomgen.chain(1))
    case = next(case for case in hard.cases_of(eomgen.chain(1)) if case.name.endswith("1e-06"))
    plain, unit = exact.mass_conditions(case.values)
    assert plain == pytest.approx(1e12, rel=1e-12)
    assert unit == pytest.approx(1, rel=1e-12)


def test_the_condition_of_a_known_function() -> None:
    """The far end of a rod, (l cos φ, l sin φ): slopes by φ and l, weighed with 1 rad and l."""
    scene = eomgen.chain(1, "rigid", length=2.0)
    state = {**hard.random_state(scene), "q": np.array([0.3]), "p": np.array([1.0, 2.0, 9.81])}
    condition = certify.Exact(scene).condition("joints", state)
    assert condition == pytest.approx((np.sin(0.3) + np.cos(0.3)) / np.cos(0.3), rel=1e-12)


def test_the_roundings_of_a_method_as_written() -> None:
    """(l cos φ, l sin φ): the cosine and the product, as large as the result. Sines keep what a difference loses."""
    rod = eomgen.chain(1, "rigid", length=2.0)
    state = {**hard.random_state(rod), "q": np.array([0.3]), "p": np.array([1.0, 2.0, 9.81])}
    assert certify.Exact(rod).written("joints", state) == pytest.approx(2)
    rods = hard.rods((1.0, 1.0), (1.0, 1.0))
    state = {**hard.random_state(rods), "q": np.array([1e15, 0.3]), "p": np.array([p.value for p in rods.parameters])}
    assert all(certify.Exact(rods, method).written("bias", state) < 100 for method in METHODS)
    state["v"] = np.array([1e4, 1e4])
    state["q"] = np.array([0.7, 0.7 + 1e-8])
    assert certify.Exact(rods, "matrix").written("bias", state) > 1e6 > 100 > certify.Exact(rods).written("bias", state)


# Measured errors

EVERY = {case.scene.name: case.scene for case in hard.cases()}


@pytest.mark.parametrize("family", EVERY)
def test_errors_are_within_the_target_in_every_hard_case(family: str) -> None:
    """8 n + 2 κ in eps: every function, method and back end, over the whole catalogue."""
    cases = [case for case in hard.cases() if case.scene.name == family]
    names = ["forward_dynamics", "energy"] if family == "crowded" else None  # the others take the compiler 20 s
    found = certify.measure(cases, names=names)
    assert {item.case for item in found} == {case.name for case in cases}
    assert {item.backend for item in found} == {"c", "numpy"}
    assert {item.method for item in found} in (set(certify.FORMS), {"articulated loops"})
    assert not [item for item in found if not item.passed or item.written]  # not even one that is explained
    if family == "chain1000":
        assert max(item.scaled for item in found) <= 100


def test_the_target_is_sharp() -> None:
    """Nearly all results have a target of hundreds of eps or less, so it is no blank cheque."""
    found = certify.measure([case for case in hard.cases() if case.scene.name == "rods"], ["matrix"], ["numpy"])
    assert np.median([item.bound for item in found]) < 100
    assert sum(item.bound > 1e4 for item in found) < len(found) / 10


@pytest.mark.parametrize("dtype", ["float32", "longdouble"])
def test_errors_in_other_types(dtype: str) -> None:
    names = ["forward_dynamics", "inverse_dynamics", "energy"]
    scenes = (hard.rods().name, hard.lumped().name)
    cases = [case for case in hard.cases() if case.scene.name in scenes]
    found = certify.measure(cases, ["matrix", "articulated"], names=names, dtypes=[dtype])
    assert not [item for item in found if not item.passed]
    measured = {item.case for item in found}
    assert {"rods: aligned", "lumped: 1c of 1e-06 m"} <= measured
    # What does not fit into the type is left out.
    assert ("rods: huge masses" in measured) == (dtype == "longdouble")


def test_functions_on_request() -> None:
    names = ["jacobian", "parameter_jacobian", "regressor"]
    cases = hard.cases_of(eomgen.chain(1), "random", "fast")
    found = certify.measure(cases, ["matrix", "articulated loops"], names=names)
    expected = {(name, "matrix") for name in names} | {(name, "articulated loops") for name in names[:2]}
    assert {(item.function, item.method) for item in found} == expected
    assert max(item.scaled for item in found if item.case == "chain1: random") < 5
    assert not [item for item in found if not item.passed]


def test_derivatives_of_fast_point_masses_by_their_parameters() -> None:
    """Straight-line code loses what is left of s̈ - s φ̇² at 1e4 rad/s; what modules have by default does not."""
    cases = hard.cases_of(eomgen.chain(2), "fast")
    methods = ["matrix", "articulated loops"]
    straight, looped = certify.measure(cases, methods, backends=["c"], names=["parameter_jacobian"])
    assert looped.scaled < 10 < 1e6 < straight.scaled
    (program,) = pipeline.programs(eomgen.derive(cases[0].scene, "matrix"), ["parameter_jacobian"])
    assert program.form == "recursion in loops over links"


def test_an_error_above_the_target_is_seen(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    compiled = pipeline.compile

    def wrong(*arguments: object, **options: object) -> SimpleNamespace:
        module = compiled(*arguments, **options)  # type: ignore[arg-type]
        energy = lambda *state: module.energy(*state) * (1 + 1e-12)  # noqa: E731
        return SimpleNamespace(**{**vars(module), "energy": energy})

    monkeypatch.setattr(certify.pipeline, "compile", wrong)
    words = ["verify", "--hard", "--backend", "numpy", "--functions"]
    monkeypatch.setattr(hard, "cases", lambda: hard.cases_of(eomgen.chain(1, "rigid"), "random"))
    assert main([*words, "joints"]) == 0
    assert main([*words, "joints,energy"]) == 1
    out, err = capsys.readouterr()
    assert "FAILED" in out
    assert "certified errors are not explained, the worst: energy of" in err


def test_the_methods_are_those_of_the_package() -> None:
    assert {method for method, _, _ in certify.FORMS.values()} == set(METHODS)
    with pytest.raises(OptionError, match="unknown method 'matrx'"):
        certify.measure(hard.cases_of(eomgen.chain(1), "random"), ["matrx"])


@pytest.mark.parametrize("name", ["forward_dynamics", "inverse_dynamics", "energy"])
@pytest.mark.parametrize("family", ["rods", "lumped", "elastic"])
def test_all_methods_have_one_enclosure(family: str, name: str) -> None:
    """The exact values come from one method; those of the others overlap them."""
    exact = certify.Exact(EVERY[family])
    for method in METHODS:
        equations = eomgen.derive(EVERY[family], method)
        nodes = list(functions.FUNCTIONS[name].build(equations))
        for case in [case for case in hard.cases() if case.scene.name == family][::5]:
            slots = equations.symbols.slots.items()
            given = {node: case.values[slot.array].flat[slot.index] for node, slot in slots}
            with flint.ctx.workprec(4096):
                pairs = zip(certify.enclose(nodes, given), exact.values(name, case.values), strict=True)
                assert all(mine.overlaps(other) for mine, other in pairs), case.name


def test_the_command_writes_its_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "errors.json"
    words = ["verify", "--links", "1", "--model", "rigid", "--backend", "numpy", "--certify", "--json", str(out)]
    assert main([*words, "--dtypes", "float64,float32"]) == 0
    shown = capsys.readouterr().out
    assert "angles of 1e15" in shown
    assert "eps of float32" in shown
    rows = json.loads(out.read_text(), parse_constant=pytest.fail)
    assert {row["function"] for row in rows} >= {"forward_dynamics", "bias"}
    assert {row["dtype"] for row in rows} == {"float64", "float32"}
    assert all(row["passed"] and row["bound"] >= 8 for row in rows)
    assert main([*words[:-3], "--json", str(out)]) == 2
    assert main(["verify", "--hard", "--links", "1"]) == 2
    assert "--hard has scenes of its own" in capsys.readouterr().err


def test_a_file_that_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is refused before anything is built; nothing is left of the attempt, and a file that stands there stays."""
    monkeypatch.setattr("eomgen.verification.verify", None)
    words = ["verify", "--links", "1", "--certify", "--json"]
    for path, reason in {"none/x.json": "No such file or directory", ".": "Is a directory", "a\0b": "null"}.items():
        assert main([*words, f"{tmp_path}/{path}"]) == 2
        shown = capsys.readouterr()
        assert (shown.out, shown.err.count("\n")) == ("", 1)
        assert "cannot be written" in shown.err
        assert reason in shown.err
    (tmp_path / "old.json").write_text("mine")
    for name in ("new.json", "old.json"):
        assert main(["verify", "none.toml", "--certify", "--json", str(tmp_path / name)]) == 2
        assert "no such file" in capsys.readouterr().err
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("old.json", "mine")]


def test_the_catalogue_from_the_command_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    cases = tuple(case for case in hard.cases() if case.scene.name in ("rods", "lumped"))
    monkeypatch.setattr(hard, "cases", lambda: cases)
    assert main(["verify", "--hard", "--backend", "c", "--functions", "forward_dynamics"]) == 0
    out = capsys.readouterr().out
    assert all(case.name in out for case in cases)
    assert " 0 FAILED" in out
