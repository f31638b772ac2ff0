"""The arithmetic of accuracies "high" and "fast", against certified values."""

from __future__ import annotations

import math
import subprocess
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import eomgen
from bench.cases import CASES, line, random_state, tree
from eomgen import certify, functions, hard, pipeline
from eomgen.cli import main
from eomgen.errors import OptionError, UnsupportedError
from tests.conftest import Compiled
from tests.test_sincos import FLAGS, HERE, RUNTIME, variants

flint = pytest.importorskip("flint", reason="certified errors need python-flint")

MOST, MOST_CONDITION = 4, 1e12  # eps, and the condition number up to which "high" promises it
SCENES = ("rods", "walker", "lumped", "elastic")  # of the catalogue
EPS = float(np.finfo(np.float32).eps / np.finfo(np.float64).eps)  # of float in that of double


# ---- twofolds ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=list(variants()), ids=lambda variant: variant[0])
def check(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The driver that applies the operations of eomgen_twofold.h, in a build."""
    name, flags = request.param
    program = tmp_path_factory.mktemp("twofold") / name
    source = str(HERE / "c" / "twofold_check.c")
    subprocess.run(["cc", *FLAGS, *flags, f"-I{RUNTIME}", source, "-o", str(program), "-lm"], check=True)
    return program


def applied(program: Path, what: str, x: np.ndarray) -> np.ndarray:
    """The results, (states, outputs, 2); a state alone has the bits of a lane."""
    done = subprocess.run([program, what], input=np.ascontiguousarray(x).tobytes(), capture_output=True, check=True)
    found = np.frombuffer(done.stdout).reshape(len(x), -1, 2, 2)
    assert np.array_equal(found[:, :, 0].view(np.int64), found[:, :, 1].view(np.int64))
    return found[:, :, 0]


def twofolds(hi: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Twofolds with these leading parts."""
    lo = hi * 2.0**-54 * rng.uniform(-1, 1, hi.shape)
    lo[::3] = 0
    return np.stack([hi, np.where(hi + lo == hi, lo, 0)], axis=-1)


def ball(x: Any) -> Any:
    """The exact value of a twofold."""
    return flint.arb(float(x[0])) + flint.arb(float(x[1]))


def lost(found: Any, exact: Any) -> float:
    """The relative error's exponent of 2."""
    error = abs(ball(found) - exact) / abs(exact)
    return math.log2(float(error.upper()) or 2.0**-300)


def test_sines_of_twofolds(check: Path) -> None:
    """Small angles, whole turns, the neighbourhood of multiples of pi/2, and exponents up to the largest."""
    rng = np.random.default_rng(7)
    quarters = np.arange(1, 300) * (np.pi / 2)
    huge = 10.0 ** rng.uniform(-300, 308, 600) * rng.choice([-1, 1], 600)
    hardest = [6381956970095103 * 2.0**797, 2.0**20, np.nextafter(2.0**20, np.inf), -(2.0**21), 1e15, 1e22, 2.0**1023]
    hi = np.concatenate([rng.uniform(-4, 4, 600), rng.uniform(-(2.0**20), 2.0**20, 600), quarters, huge, hardest])
    x = twofolds(hi, rng)
    x[-len(hardest) :, 1] = 0
    found = applied(check, "sincos", x)
    with flint.ctx.workprec(2400):
        for angle, values in zip(x, found, strict=True):
            for value, exact in zip(values, ball(angle).sin_cos(), strict=True):
                # Two large parts can cancel; then the sum, taken to a twofold's precision, is what counts.
                cancelled = abs(angle[1]) > 1 and float(abs(exact).upper()) < 1e-3
                assert lost(value, exact) < (-85 if cancelled else -97), angle


def test_sines_without_a_value(check: Path) -> None:
    x = np.array([[np.inf, 0], [np.nan, 0], [-np.inf, 0], [1.0, 0]])
    found = applied(check, "sincos", x)
    assert np.isnan(found[:3]).all()
    assert found[3, :, 0] == pytest.approx([math.sin(1), math.cos(1)], rel=1e-15)


def test_arithmetic_of_twofolds(check: Path) -> None:
    """Every operation keeps the precision its source proves; sums that cancel too."""
    rng = np.random.default_rng(8)
    x, y = twofolds(rng.normal(size=400), rng), twofolds(rng.normal(size=400), rng)
    y[:100] = -x[:100] * (1 + 2.0**-40)
    y[:, 0], y[:, 1] = y[:, 0] + y[:, 1], y[:, 1] - ((y[:, 0] + y[:, 1]) - y[:, 0])
    pairs = np.stack([x, y], axis=1)
    operations = {"add": lambda a, b: a + b, "mul": lambda a, b: a * b, "div": lambda a, b: a / b}
    with flint.ctx.workprec(400):
        for name, operation in operations.items():
            for (a, b), value in zip(pairs, applied(check, name, pairs), strict=True):
                assert lost(value[0], operation(ball(a), ball(b))) < -101
        for a, value in zip(x, applied(check, "invert", abs(x)), strict=True):
            if a[0] > 0:
                assert lost(value[0], 1 / ball(abs(a))) < -101


# ---- models ------------------------------------------------------------------------------------------------


def certified(cases: Sequence[hard.Case], method: str, **options: Any) -> dict[tuple[str, str], tuple[float, float]]:
    """The certified scaled error of every function, in eps of float64, and κ₂ of M, in cases of one scene."""
    module = pipeline.compile(cases[0].scene, method, **options)
    names = functions.select(pipeline.derive(cases[0].scene, method), None)
    found = {}
    for case in cases:
        exact = certify.Exact(case.scene)
        condition, _ = exact.mass_conditions(case.values)
        for name in names:
            arguments = [case.values[array.name] for array in functions.program(exact.equations, name).inputs]
            with np.errstate(all="ignore"):
                computed = getattr(module, name)(*arguments)
            unknown = name == "forward_dynamics" and condition == math.inf
            error = math.inf if unknown else certify.errors(computed, exact.values(name, case.values))[0]
            found[case.name, name] = error, condition
    return found


@pytest.mark.parametrize("solver", ["dense", "articulated"])
@pytest.mark.parametrize("scene", SCENES)
def test_high_is_right_to_the_last_digits(scene: str, solver: str) -> None:
    """Over the catalogue: also where the condition number is far beyond 1e12, if a mass is not subnormal."""
    cases = [case for case in hard.cases() if case.scene.name == scene]
    method = "articulated" if solver == "articulated" else "matrix"
    errors = certified(cases, method, accuracy="high", solver=solver, loops=False)
    assert max(condition for _, condition in errors.values()) > 1e3
    for key, (error, condition) in errors.items():
        assert error <= MOST or (error == math.inf and condition > MOST_CONDITION), key
        assert error <= 1 or "subnormal" in key[0], key


def test_high_in_long_chains() -> None:
    (case,) = (case for case in hard.cases() if case.name == "chain100: random")
    module = pipeline.compile(case.scene, functions=["forward_dynamics"], accuracy="high")
    exact = certify.Exact(case.scene).values("forward_dynamics", case.values)
    assert certify.errors(module.forward_dynamics(*(case.values[name] for name in "qvup")), exact)[0] <= 1


def test_high_needs_no_fused_operations() -> None:
    cases = [case for case in hard.cases() if case.scene.name == "lumped"]
    errors = certified(cases, "matrix", accuracy="high", portable=True)
    assert max(error for error, _ in errors.values()) <= 1


def test_high_where_standard_fails() -> None:
    """Masses that grow a million-fold towards the tip cost the dense elimination nine digits."""
    heavy = {i: {"mass": 1e6 ** (i / 9)} for i in range(10)}
    scene = tree("heavy_tip", line(10), "rigid", changes=heavy)
    state = random_state(scene, 3)
    exact, worst = certify.Exact(scene), {}
    for accuracy in ("standard", "high"):
        options = {"solver": "dense", "loops": False, "accuracy": accuracy}
        module = pipeline.compile(scene, functions=["forward_dynamics"], **options)
        balls = exact.values("forward_dynamics", {**state._asdict(), "p": module.p})
        worst[accuracy] = certify.errors(module.forward_dynamics(state.q, state.v, state.u, module.p), balls)[0]
    assert worst["high"] <= MOST
    assert worst["standard"] > 100


def test_fast_rounds_as_float() -> None:
    """Within what rounding to 24 bits explains, wherever the angles are: their differences are reduced as doubles."""
    cases = hard.cases_of(CASES["rigid_3"])
    for key, (error, condition) in certified(cases, "articulated", accuracy="fast").items():
        assert error / EPS <= 8 * 3 + 2 * condition, key


@pytest.mark.parametrize("accuracy", ["fast", "high"])
@pytest.mark.parametrize("case", ["models_5", "springs"])
def test_lanes_have_the_bits_of_single_states(case: str, accuracy: str, compiled: Compiled) -> None:
    """Far angles and singular states among them disturb nobody else."""
    module = compiled(case, "matrix", "c", accuracy=accuracy)
    states = random_state(module, 5, (37,))
    states.q[3, 0], states.q[11, 1] = 3e7, np.inf
    states.q[20, len(module.u_names) - 1] = 0.0
    arguments = {"forward_dynamics": "qvuw", "energy": "qvw", "mass_matrix": "qw", "joints": "qw"}
    for name, letters in arguments.items():
        function = getattr(module, name)
        with np.errstate(invalid="ignore"):
            together = function(*states.of(letters), module.p)
            alone = np.array([function(*(x[i] for x in states.of(letters)), module.p) for i in range(37)])
        assert np.array_equal(together, alone, equal_nan=True)
        assert np.isnan(together[11]).any()
    assert np.isfinite(together[[3, 20]]).all()


@pytest.mark.parametrize("accuracy", ["fast", "high"])
def test_singular_states_are_nan_and_raise(accuracy: str, compiled: Compiled) -> None:
    module = compiled("point_masses_2", "matrix", "c", accuracy=accuracy)
    state = random_state(module, 1)
    state.q[2:] = 0.0
    with np.errstate(invalid="raise"), pytest.raises(FloatingPointError):
        module.forward_dynamics(state.q, state.v, state.u, module.p)
    with np.errstate(invalid="ignore"):
        assert np.isnan(module.forward_dynamics(state.q, state.v, state.u, module.p)).all()


@pytest.mark.parametrize(("accuracy", "most"), [("fast", 2e-4), ("high", 1e-14)])
def test_loops(accuracy: str, most: float) -> None:
    """A tree in loops computes what the straight-line code of standard accuracy does."""
    scene = tree("branches12", (-1, 0, 1, 1, 3, 4, 4, 6, 7, 8, 9, 9), ("rigid", "point-masses") * 6)
    names = ["forward_dynamics", "mass_matrix", "energy", "jacobian"]
    looped = pipeline.compile(scene, "articulated", loops=True, accuracy=accuracy, functions=names)
    straight = pipeline.compile(scene, "articulated", "numpy", loops=False, functions=names)
    states = random_state(scene, 4, (20,))
    for name in names:
        letters = functions.FUNCTIONS[name].arguments
        found, expected = (getattr(m, name)(*states.of(letters), m.p) for m in (looped, straight))
        rounded = 10 if name == "jacobian" else 1  # of straight-line code, which is the less accurate there
        assert abs(found - expected).max() <= rounded * most * abs(expected).max(), name


@pytest.mark.parametrize("options", [{"steps": 20}, {"steps": 20, "method": "dop853", "rtol": 1e-6}], ids=str)
@pytest.mark.parametrize(("accuracy", "most"), [("fast", 1e-4), ("high", 1e-12)])
def test_rollouts(accuracy: str, most: float, options: dict[str, Any], compiled: Compiled) -> None:
    def ends(module: ModuleType) -> np.ndarray:
        state = random_state(module, 2, (19,))
        u = np.zeros((19, 1, len(module.u_names)))
        return np.concatenate(module.rollout(state.q, state.v, u, module.p, 1e-3, **options), axis=-1)

    expected = ends(compiled("models_5", "matrix", "c"))
    assert (
        abs(ends(compiled("models_5", "matrix", "c", accuracy=accuracy)) - expected).max() < most * abs(expected).max()
    )


def test_derivatives_are_right_too(compiled: Compiled) -> None:
    """Functions that are built on request keep the module's accuracy."""
    high, standard = (compiled("rigid_2", "matrix", "c", accuracy=accuracy) for accuracy in ("high", "standard"))
    state = random_state(high, 9, (30,))
    found = high.jacobian(*state.of("qvu"), high.p)
    expected = standard.jacobian(*state.of("qvu"), standard.p)
    assert 0 < abs(found - expected).max() < 1e-13 * abs(expected).max()


# ---- bad input ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"accuracy": "hgih"}, "unknown accuracy 'hgih'; allowed: fast, standard, high (did you mean 'high'?)"),
        ({"accuracy": "high", "backend": "numpy"}, "accuracy 'high' needs the C back end, not 'numpy'; allowed"),
        ({"accuracy": "fast", "dtypes": ["float32"]}, "accuracy 'fast' is for arguments in float64, not float32;"),
    ],
)
def test_options_that_cannot_be(options: dict[str, Any], message: str) -> None:
    with pytest.raises(OptionError) as error:
        eomgen.compile(CASES["rigid_1"], **options)
    assert message in str(error.value)


def test_functions_that_high_does_not_have() -> None:
    sympy = pytest.importorskip("sympy")
    t, m = sympy.symbols("t m", positive=True)
    x = sympy.Function("x")(t)
    equations = eomgen.lagrangian(m * x.diff(t) ** 2 / 2, sympy.exp(x), [x], {m: 2.0})
    with pytest.raises(UnsupportedError, match="accuracy 'high' has no exp, which these equations use; allowed: sums"):
        pipeline.compile(equations, accuracy="high")
    assert pipeline.compile(equations, accuracy="fast").forward_dynamics([0.0], [0.0], [0.0], [2.0]) == -0.5


def test_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compile", "--links", "1", "--model", "rigid", "--accuracy", "high"]) == 0
    assert "forward_dynamics" in capsys.readouterr().out
    assert main(["compile", "--links", "1", "--accuracy", "higher"]) == 2
    assert "unknown accuracy 'higher'" in capsys.readouterr().err


def test_the_module_tells_its_accuracy(compiled: Compiled) -> None:
    assert compiled("rigid_1", "matrix", "c", accuracy="high").info["options"]["accuracy"] == "high"
