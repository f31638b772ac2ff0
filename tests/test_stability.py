"""The parts of `eomgen bench stability`: its reference, its measures, its tables. Nothing here is timed."""

from pathlib import Path

import numpy as np
import pytest

import eomgen
from bench import report, stability
from bench.cases import line, tree
from bench.extrapolation import motion
from eomgen.errors import CheckError

flint = pytest.importorskip("flint", reason="the reference needs python-flint")

DOUBLE, FLIGHT = stability.problems()[0], stability.flight()


def test_reference_flies_on_the_parabola() -> None:
    """Beyond 30 digits, 0.6 mm past the joint at 5000 rad/s."""
    state, _, _ = stability.solve(FLIGHT, 34)
    exact = [x.mid().str(40, radius=False) for x in stability.on_a_parabola(FLIGHT)]
    assert stability.scaled(state, exact) < 1e-28


def test_reference_swings_as_a_spring_does() -> None:
    """A mass on a spring without gravity: s = r + a cos(ω t), ω² = k/m = 25."""
    scene = tree(
        "spring", line(1), "point-masses", gravity=0.0,
        changes={0: {"masses": (2.0,), "fractions": (1.0,), "stiffness": 50.0, "rest_length": 0.5}},
    )  # fmt: skip
    found = motion(eomgen.derive(scene), [0.75, 0.625], [0.0, 0.0], 3.0, 30)
    with flint.ctx.workprec(200):
        exact = flint.arb(0.5) + flint.arb(0.125) * (flint.arb(25).sqrt() * 3).cos()
        assert abs(float(found.q[1] - exact)) < 1e-29


def test_extrapolation_has_the_digits_that_are_asked_for() -> None:
    """Fewer digits, larger errors: of the order of the tolerance, grown by some hundred steps."""
    for digits in (12, 20, 28):
        state, _, _ = stability.solve(FLIGHT, digits)
        exact = [x.mid().str(40, radius=False) for x in stability.on_a_parabola(FLIGHT)]
        assert 10.0 ** -(digits + 6) < stability.scaled(state, exact) < 10.0 ** -(digits - 6)


def test_flint_keeps_its_precision() -> None:
    before = flint.ctx.prec
    stability.solve(FLIGHT._replace(end=0.01), 20)
    assert flint.ctx.prec == before


def stored() -> dict[str, stability.Record]:
    found = report.load(str(stability.REFERENCE), "stability reference")
    return {record["problem"]: record for record in found["records"]}


@pytest.mark.parametrize("problem", stability.problems(), ids=lambda p: p.name)
def test_every_motion_has_its_reference(problem: stability.Problem) -> None:
    found = stability.reference(problem, stored())
    assert found["difference"] < stability.AGREED
    assert len(found["state"]) == 2 * len(problem.q)


def test_stored_reference_is_that_of_an_independent_run() -> None:
    """SciPy's DOP853 finds the damped springs' end to what it can."""
    problem = next(p for p in stability.problems() if "damped" in p.name)
    model = eomgen.compile(problem.scene, functions=["forward_dynamics"])
    state = stability.by_scipy("DOP853", problem, model, 1e-13)()
    assert stability.scaled(state, stored()[problem.name]["state"]) < 1e-11


def test_reference_of_another_motion_is_refused() -> None:
    with pytest.raises(CheckError, match="run eomgen bench stability --reference"):
        stability.reference(DOUBLE._replace(q=(1.2, 2.1)), stored())
    with pytest.raises(CheckError, match="has no motion 'new'"):
        stability.reference(DOUBLE._replace(name="new"), stored())


def test_scaled_error_is_of_the_worse_half() -> None:
    assert stability.scaled([1.0, 4.0, 0.0, 10.0], ["1.0", "4.5", "0.0", "10.0"]) == pytest.approx(0.5 / 4.5)
    assert stability.scaled([1.0, 4.0, 3.0, 10.0], ["1.0", "4.0", "0.0", "10.0"]) == pytest.approx(0.3)


@pytest.mark.parametrize("who", [who for who in stability.INTEGRATORS if who != "heyoka"])
def test_integrators_find_the_parabola(who: str) -> None:
    """At a moderate setting, well away from the joint."""
    problem = FLIGHT._replace(end=0.3)
    model = eomgen.compile(problem.scene, functions=["forward_dynamics", "jacobian"])
    state = stability.INTEGRATORS[who].make(problem, model, 3000 if who == "rk4" else 1e-9)()
    exact = [x.mid().str(40, radius=False) for x in stability.on_a_parabola(problem)]
    assert stability.scaled(state, exact) < 1e-6


def test_drift_is_relative_to_the_largest_energy() -> None:
    model = eomgen.compile(DOUBLE.scene, backend="numpy", functions=["energy"])
    start = np.array([*DOUBLE.q, *DOUBLE.v])
    assert stability.drift(DOUBLE, model, start) == 0
    kinetic = model.energy(start[:2], np.array([0.0, 0.1]), model.p)[0]
    moved = np.array([*DOUBLE.q, 0.0, 0.1])
    potential = abs(model.energy(start[:2], np.zeros(2), model.p)[1])
    assert stability.drift(DOUBLE, model, moved) == pytest.approx(kinetic / potential)


def example() -> stability.Data:
    """A run as it could be: DOP853 and heyoka on two motions, one failure."""
    run = {"problem_met": "", "repeats": 5, "drift": 1e-14}
    head = {"source": "x", "difference": 1e-24, "amplification": 2e6, "state": []}
    records = [
        {"problem": DOUBLE.name, "who": "reference", **head},
        {"problem": DOUBLE.name, "who": "compiled", "setting": 1e-11, "seconds": 0.05, "error": 1e-6, **run},
        {"problem": DOUBLE.name, "who": "compiled", "setting": 1e-13, "seconds": 0.02, "error": 2e-8, **run},
        {"problem": DOUBLE.name, "who": "dop853", "setting": 1e-13, "seconds": 0.08, "error": 1e-8, **run},
        {"problem": DOUBLE.name, "who": "rk4", "setting": 1e5, "seconds": 0.01, "error": 2e-9, **run},
        {"problem": DOUBLE.name, "who": "heyoka", "setting": 1e-16, "seconds": 0.001, "error": 1e-11, **run},
        {"problem": FLIGHT.name, "who": "reference", **head, "difference": 0.0},
        {"problem": FLIGHT.name, "who": "rk4", "setting": 1e3, "problem_met": "unstable"},
        {"problem": FLIGHT.name, "who": "heyoka", "setting": 1e-16, "problem_met": "not installed"},
    ]
    names = ("cpu", "cores", "load", "system", "python", "compiler", "flags", "date", "commit")
    return stability.Data(
        {"records": records, "minutes": 1.0, "machine": {**dict.fromkeys(names, "x"), "packages": {}}}
    )


def test_tables_say_what_was_measured() -> None:
    text = stability.render(example())
    assert "20.0 × heyoka's time: **missed**" in text
    assert "One eps of the initial state has grown to 4e-10" in text
    assert "| eomgen rollout, RK4, 1e+05 steps: the fastest no less accurate |" in text
    assert "| eomgen rollout, RK4    |" in text and "unstable" in text and "not installed" in text


def test_target_stays_open_without_heyoka() -> None:
    data = example()
    at = next(k for k, r in enumerate(data.records) if r["who"] == "heyoka")
    data.records[at] = {"problem": DOUBLE.name, "who": "heyoka", "setting": 1e-6, "problem_met": "not installed"}
    assert "Open: heyoka not installed." in stability.render(data)


def test_picture_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    stability.plot(example(), tmp_path / "stability.png")
    assert (tmp_path / "stability.png").stat().st_size > 10_000


def test_steps_are_round_numbers() -> None:
    assert stability._powers(2.5, 4, 0.5) == (320, 1000, 3200, 10000)
