"""Rollouts: of the promised order or error, alike in both back ends, in lanes as alone, refusing nonsense."""

import functools
import importlib
import pickle
import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp
from scipy.integrate._ivp import dop853_coefficients
from sympy.physics.mechanics import dynamicsymbols

import eomgen
from bench.cases import CASES, line, random_state, tree
from eomgen.backends import BACKENDS
from tests.conftest import Compiled

BOTH = pytest.mark.parametrize("backend", BACKENDS)
METHODS = pytest.mark.parametrize("method", ["rk4", "euler", "dop853"])
FIXED = pytest.mark.parametrize("method", ["rk4", "euler"])
FUNCTIONS = ("forward_dynamics", "energy")
PENDULUM, LIFT = "rigid_2", "elastic_rod_3_prescribed"
TYPES = ("float32", "float64", "longdouble")
Get = Callable[[str, str], ModuleType]


@pytest.fixture
def get(compiled: Compiled) -> Get:
    """A module of a case and back end."""

    def module(case: str, backend: str) -> ModuleType:
        return compiled(case, "matrix", backend, functions=FUNCTIONS)

    return module


PLAIN = importlib.import_module("eomgen.backends._rollout")


def by_arrays(forward: Any) -> Any:
    """A rollout of forward dynamics with array operations, step by step: what the kernel must do."""
    return PLAIN.Rollout(SimpleNamespace(forward_dynamics=forward))


def problem(module: ModuleType, seed: int, batch: tuple[int, ...] = (), intervals: int = 3) -> dict[str, Any]:
    """Arguments of a rollout: every trajectory with inputs, lengths, parameters and a step of its own."""
    random = np.random.default_rng(seed)
    state = random_state(module, seed, batch)
    n, k = state.q.shape[-1], state.w.shape[-2]
    given = {"q": state.q, "v": state.v, "u": random.uniform(-5, 5, (*batch, intervals, n))}
    if k:
        shape = (*batch, intervals, k)
        parts = [random.uniform(low, high, shape) for low, high in ((0.4, 1.0), (-1, 1), (-3, 3))]
        given["w"] = np.stack(parts, axis=-1)
    p = module.p * random.uniform(0.9, 1.1, (*batch, module.p.size))
    return {**given, "p": p, "dt": random.uniform(0.002, 0.004, batch)}


def reference(
    module: ModuleType, given: dict[str, Any], duration: float, rtol: float = 3e-14, atol: float = 1e-14
) -> tuple[np.ndarray, np.ndarray]:
    """The same by SciPy's DOP853, with tight tolerances, interval after interval."""
    q, v, n = given["q"], given["v"], given["q"].shape[-1]
    found = []
    for j, u in enumerate(given["u"]):

        def slope(t: float, y: np.ndarray, u: np.ndarray = u, j: int = j) -> np.ndarray:
            now = []
            if "w" in given:
                s, rate, acceleration = given["w"][j].T
                now = [np.stack([s + t * rate + t**2 / 2 * acceleration, rate + t * acceleration, acceleration], -1)]
            return np.concatenate([y[n:], module.forward_dynamics(y[:n], y[n:], u, *now, given["p"])])

        done = solve_ivp(slope, (0, duration), np.concatenate([q, v]), "DOP853", rtol=rtol, atol=atol)
        q, v = done.y[:n, -1], done.y[n:, -1]
        found.append((q, v))
    return np.array([q for q, _ in found]), np.array([v for _, v in found])


# Order


@BOTH
@pytest.mark.parametrize(("case", "intervals"), [(PENDULUM, 2), (LIFT, 3)])
@pytest.mark.parametrize(("method", "order", "steps"), [("rk4", 4, (64, 128, 256)), ("euler", 1, (800, 1600, 3200))])
def test_order(
    case: str, intervals: int, method: str, order: int, steps: tuple[int, ...], backend: str, get: Get
) -> None:
    """The error against a fine integration, over the step: prescribed lengths are quadratic within an interval."""
    module = get(case, backend)
    if backend == "numpy":
        steps = steps[:2]
    given = problem(module, 3, (), intervals)
    duration = 0.15
    exact = np.concatenate(reference(module, given, duration), axis=-1)
    errors = []
    for count in steps:
        found = module.rollout(**{**given, "dt": duration / count}, steps=count * intervals, method=method)
        errors.append(np.abs(np.concatenate(found, axis=-1) - exact).max())
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert abs(slope + order) < 0.15, errors
    assert errors[-1] < 1e-2 if order == 1 else errors[-1] < 1e-6


@BOTH
@pytest.mark.parametrize(("method", "dt", "drift"), [("rk4", 1e-3, 1e-8), ("euler", 1e-4, 1e-2)])
def test_energy_drift(method: str, dt: float, drift: float, backend: str, get: Get) -> None:
    """Nothing drives or brakes the double pendulum: its energy stays, within the error of the method."""
    module = get(PENDULUM, backend)
    seconds = 2.0 if backend == "c" else 0.2
    steps = round(seconds / dt)
    q, v = module.rollout([0.3, 0.9], [0.0, 0.0], np.zeros((20, 2)), module.p, dt, steps, method)
    total = module.energy(q, v, module.p).sum(axis=-1)
    first = module.energy([0.3, 0.9], [0.0, 0.0], module.p).sum()
    assert np.abs(total - first).max() < drift * np.abs(module.energy(q, v, module.p)).max()
    assert np.ptp(v) > 1


# The kernel does what the array operations do


@METHODS
@pytest.mark.parametrize("case", [PENDULUM, LIFT])
@pytest.mark.parametrize("batch", [(), (1,), (5,), (19,), (2, 3)], ids=str)
@pytest.mark.parametrize("steps", [None, 3, 12])
def test_kernel_is_the_array_operations_bit_for_bit(
    steps: int | None, batch: tuple[int, ...], case: str, method: str, get: Get
) -> None:
    module = get(case, "c")
    given = problem(module, 5, batch)
    expected = by_arrays(module.forward_dynamics)(**given, steps=steps, method=method)
    for found, array in zip(module.rollout(**given, steps=steps, method=method), expected, strict=True):
        assert found.shape == (*batch, 3, len(module.q_names))
        assert found.tobytes() == array.tobytes()


@METHODS
@pytest.mark.parametrize("case", [PENDULUM, LIFT])
def test_back_ends_agree(case: str, method: str, get: Get) -> None:
    first, second = (get(case, backend) for backend in ("c", "numpy"))
    given = problem(first, 8, (7,), 4)
    for a, b in zip(*(module.rollout(**given, steps=16, method=method) for module in (first, second)), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10)


@METHODS
@pytest.mark.parametrize("case", [PENDULUM, LIFT])
@pytest.mark.parametrize("own", [True, False], ids=["own parameters", "one set of parameters"])
def test_batch_is_its_trajectories_bit_for_bit(own: bool, case: str, method: str, get: Get) -> None:
    """Of every length from 1 to 40: all remainders of lanes and streams."""
    module = get(case, "c")
    given = problem(module, 11, (40,), 2)
    if not own:
        given["p"] = module.p
    alone = [
        module.rollout(**{key: x if x is module.p else x[k] for key, x in given.items()}, steps=4, method=method)
        for k in range(40)
    ]
    for size in range(1, 41):
        part = {key: x if x is module.p else x[:size] for key, x in given.items()}
        together = module.rollout(**part, steps=4, method=method)
        for i in (0, 1):
            assert together[i].tobytes() == np.stack([pair[i] for pair in alone[:size]]).tobytes(), size


@METHODS
@BOTH
@pytest.mark.parametrize("varying", ["q", "v", "u", "w", "p", "dt"])
def test_any_argument_may_be_the_one_that_varies(varying: str, backend: str, method: str, get: Get) -> None:
    """Leading axes broadcast: one trajectory per value of the argument."""
    module = get(LIFT, backend)
    many, one = problem(module, 2, (6,)), problem(module, 4)
    found = module.rollout(**{**one, varying: many[varying]}, steps=6, method=method)
    for k in range(6):
        alone = module.rollout(**{**one, varying: many[varying][k]}, steps=6, method=method)
        for i in (0, 1):
            assert found[i].shape == (6, 3, 3)
            np.testing.assert_allclose(found[i][k], alone[i], rtol=1e-12, atol=1e-12)


@METHODS
@BOTH
def test_axes_of_arguments_broadcast(backend: str, method: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 6)
    shapes = {"q": (4, 1), "u": (3,), "p": (2, 1, 1), "dt": (4, 1)}
    wide = given | {
        name: np.broadcast_to(given[name], (*shape, *np.shape(given[name]))) for name, shape in shapes.items()
    }
    one = module.rollout(**given, method=method)
    for i, found in enumerate(module.rollout(**{**given, **wide}, method=method)):
        assert found.shape == (2, 4, 3, 3, 3)
        np.testing.assert_allclose(found, np.broadcast_to(one[i], found.shape), rtol=1e-12, atol=1e-12)


LAYOUTS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "by columns": np.asfortranarray,
    "every second trajectory": lambda x: np.repeat(x, 2, axis=0)[::2],
    "backwards": lambda x: x[::-1].copy()[::-1],
    "read-only": lambda x: np.frombuffer(x.tobytes(), x.dtype).reshape(x.shape),
    "swapped bytes": lambda x: x.astype(x.dtype.newbyteorder()),
    "every second number": lambda x: np.repeat(x, 2, axis=-1)[..., ::2],
    "axes of the intervals first": lambda x: np.moveaxis(np.moveaxis(x, 0, -1).copy(), -1, 0),
    "nested lists": lambda x: x.tolist(),  # type: ignore[dict-item,return-value]
}


@METHODS
@BOTH
@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts(layout: str, backend: str, method: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 3, (19,)) | {"p": module.p}
    changed = {name: LAYOUTS[layout](x) if np.ndim(x) > 1 else x for name, x in given.items()}
    first, second = (module.rollout(**arguments, steps=6, method=method) for arguments in (given, changed))
    for a, b in zip(first, second, strict=True):
        assert a.tobytes() == b.tobytes()


@BOTH
def test_steps(backend: str, get: Get) -> None:
    """By default one step per interval; more of them are the same as more, equal, intervals."""
    module = get(PENDULUM, backend)
    given = problem(module, 1, (), 3)
    first, default = module.rollout(**given, steps=3), module.rollout(**given)
    finer = module.rollout(**given, steps=12)
    split = module.rollout(**{**given, "u": np.repeat(given["u"], 4, axis=0)})
    for i in (0, 1):
        assert first[i].tobytes() == default[i].tobytes()
        assert finer[i].tobytes() == split[i][3::4].tobytes()


@METHODS
@BOTH
@pytest.mark.parametrize("shape", [(0,), (3, 0)])
def test_no_trajectories(shape: tuple[int, ...], backend: str, method: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 1, shape)
    assert [found.shape for found in module.rollout(**given, method=method)] == [(*shape, 3, 3)] * 2


@METHODS
@BOTH
def test_arguments_are_not_written(method: str, backend: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 4, (9,))
    copies = {name: x.copy() for name, x in given.items()}
    module.rollout(**given, method=method)
    assert all(given[name].tobytes() == copies[name].tobytes() for name in given)


# Number types


@pytest.fixture(scope="module", params=BACKENDS)
def typed(request: pytest.FixtureRequest) -> ModuleType:
    """Modules with all types."""
    return eomgen.compile(CASES[PENDULUM], "recursive", request.param, dtypes=TYPES, functions=["forward_dynamics"])


@FIXED
@pytest.mark.parametrize("dtype", TYPES)
def test_types(dtype: str, method: str, typed: ModuleType) -> None:
    """A rollout computes in the type of its arrays, whatever Python number the step is."""
    given = problem(typed, 9, (37,)) | {"p": typed.p}
    expected = typed.rollout(**given, steps=6, method=method)
    arrays = {name: x.astype(dtype) for name, x in given.items()}
    eps = float(np.finfo(dtype).eps)
    for steps in (arrays, arrays | {"dt": 0.003}):
        found = typed.rollout(**steps, steps=6, method=method)
        assert [x.dtype for x in found] == [np.dtype(dtype)] * 2
    found = typed.rollout(**arrays, steps=6, method=method)
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a.astype(float), b, rtol=0, atol=max(100 * eps, 1e-13) * np.abs(b).max())


@METHODS
def test_no_digit_of_a_long_double_is_lost(method: str, typed: ModuleType) -> None:
    """In no time at all nothing changes."""
    given = {name: x.astype("longdouble") for name, x in (problem(typed, 2) | {"p": typed.p}).items()}
    given |= {"q": given["q"] / 3, "v": given["v"] / 7, "dt": np.longdouble("1e-30")}
    q, v = typed.rollout(**given, method=method)
    assert (q == given["q"]).all()
    assert (v == given["v"]).all()


@METHODS
@BOTH
def test_single_precision_alone(method: str, backend: str) -> None:
    """A module without float64 integrates, too."""
    module = eomgen.compile(CASES[PENDULUM], backend=backend, dtypes="float32", functions=["forward_dynamics"])
    given = {name: x.astype("float32") for name, x in (problem(module, 9, (5,)) | {"p": module.p}).items()}
    for dt in (given["dt"], np.float32(0.002), 0.002):
        found = module.rollout(**{**given, "dt": dt}, method=method)
        assert [x.dtype for x in found] == [np.dtype("float32")] * 2


@BOTH
def test_integers(backend: str, get: Get) -> None:
    module = get(PENDULUM, backend)
    found = module.rollout([0, 1], [0, 0], [[0, 0], [1, 2]], module.p, 1, method="euler")
    floats = module.rollout([0.0, 1.0], [0.0, 0.0], [[0.0, 0.0], [1.0, 2.0]], module.p, 1.0, method="euler")
    assert [x.tobytes() for x in found] == [x.tobytes() for x in floats]


# Refusals

WRONG: dict[str, tuple[dict[str, Any], type[Exception], str]] = {
    "dt zero": ({"dt": 0}, ValueError, r"dt = 0 is not positive; give the step in seconds"),
    "dt negative": ({"dt": -0.01}, ValueError, r"dt = -0\.01 is not positive"),
    "dt nan": ({"dt": float("nan")}, ValueError, r"dt = nan is not positive"),
    "dt infinite": ({"dt": float("inf")}, ValueError, r"dt = inf is not positive"),
    "dt zero for one": ({"dt": np.array([0.1, 0.0])}, ValueError, r"dt = .* is not positive"),
    "steps no multiple": ({"steps": 7}, ValueError, r"steps = 7 is no positive multiple of the 3 intervals of u"),
    "steps too few": ({"steps": 1}, ValueError, r"steps = 1 is no positive multiple of the 3 intervals"),
    "no steps": ({"steps": 0}, ValueError, r"steps = 0 is no positive multiple"),
    "negative steps": ({"steps": -3}, ValueError, r"steps = -3 is no positive multiple"),
    "half steps": ({"steps": 4.5}, ValueError, r"steps = 4\.5 is no positive multiple"),
    "steps nan": ({"steps": float("nan")}, ValueError, r"steps = nan is no positive multiple"),
    "steps infinite": ({"steps": float("inf")}, ValueError, r"steps = inf is no positive multiple"),
    "unknown method": ({"method": "rk45"}, ValueError, r"unknown method 'rk45'; allowed: 'rk4', 'euler', 'dop853'$"),
    "u with one axis": ({"u": np.zeros(3)}, ValueError, r"u has 1 axes; give \(\.\.\., t, nu\)"),
    "u without intervals": ({"u": np.zeros((0, 3))}, ValueError, r"no positive multiple of the 0 intervals of u"),
    "u too wide": ({"u": np.zeros((3, 4))}, ValueError, r"mismatch in its core dimension"),
    "q too long": ({"q": np.zeros(4)}, ValueError, r"mismatch in its core dimension"),
    "v scalar": ({"v": 0.0}, ValueError, r"does not have enough dimensions"),
    "p too short": ({"p": np.ones(3)}, ValueError, r"mismatch in its core dimension"),
    "w of one state": ({"w": np.ones((3, 3))}, ValueError, r"\bw has|Input operand 3"),
    "w with fewer intervals": ({"w": np.ones((2, 3, 3))}, ValueError, r"\bw has|Input operand 3"),
    "w with more intervals": ({"w": np.ones((4, 3, 3))}, ValueError, r"\bw has|Input operand 3"),
    "batches that do not broadcast": (
        {"q": np.ones((2, 3)), "u": np.zeros((3, 3, 3))}, ValueError, r"broadcast"
    ),
    "unknown argument": ({"step": 3}, TypeError, r"takes q, v, u, w, p, dt, steps, method, rtol, atol, each once"),
    "complex q": ({"q": np.ones(3) * 1j}, TypeError, r"not supported for the input types|[Cc]ast|complex"),
}  # fmt: skip


TOLERANCES: dict[str, tuple[dict[str, Any], str]] = {
    "rtol zero": ({"rtol": 0}, r"rtol = 0 is not positive; give a tolerance, a number"),
    "rtol negative": ({"rtol": -1e-6}, r"rtol = -1e-06 is not positive"),
    "rtol nan": ({"rtol": float("nan")}, r"rtol = nan is not positive"),
    "rtol infinite": ({"rtol": float("inf")}, r"rtol = inf is not positive"),
    "rtol too small": ({"rtol": 2e-14}, r"rtol = 2e-14 is below 100 eps of the number type; give at least 2\.22e-14"),
    "rtol text": ({"rtol": "tight"}, r"rtol = 'tight' is not positive; give a tolerance, a number"),
    "atol zero": ({"atol": 0.0}, r"atol = 0\.0 is not positive"),
    "atol negative": ({"atol": -1}, r"atol = -1 is not positive"),
    "atol infinite": ({"atol": float("inf")}, r"atol = inf is not positive"),
    "atol for each": ({"atol": [1e-6] * 6}, r"atol = \[.*\] is not positive; give a tolerance, a number"),
    "rtol for rk4": (
        {"rtol": 1e-6, "method": "rk4"}, r"rtol = 1e-06 is for the method 'dop853'; the steps of 'rk4' are dt"
    ),
    "atol for euler": (
        {"atol": 1e-6, "method": "euler"}, r"atol = 1e-06 is for the method 'dop853'; the steps of 'euler' are dt"
    ),
}  # fmt: skip


@BOTH
@pytest.mark.parametrize("what", TOLERANCES)
def test_wrong_tolerances_are_refused(what: str, backend: str, get: Get) -> None:
    changes, message = TOLERANCES[what]
    module = get(LIFT, backend)
    with pytest.raises(ValueError, match=f"^{message}") as caught:
        module.rollout(**{**problem(module, 1), "method": "dop853", **changes})
    assert "\n" not in str(caught.value)


@METHODS
@BOTH
@pytest.mark.parametrize("what", WRONG)
def test_wrong_arguments_are_refused(what: str, backend: str, method: str, get: Get) -> None:
    """In one line, before anything is computed."""
    changes, kind, message = WRONG[what]
    module = get(LIFT, backend)
    with pytest.raises(kind, match=message) as caught:
        module.rollout(**{**problem(module, 1), "method": method, **changes})
    assert type(caught.value) is kind
    assert "\n" not in str(caught.value)


@BOTH
def test_missing_and_repeated_arguments(backend: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 1)
    for name in given:
        rest = {key: x for key, x in given.items() if key != name}
        with pytest.raises(TypeError, match=rf"^rollout\(\) is missing {name}; it takes q, v, u, w, p, dt, steps, me"):
            module.rollout(**rest)
    with pytest.raises(TypeError, match="each once"):
        module.rollout(given["q"], **given)
    with pytest.raises(TypeError, match="each once"):
        module.rollout(*given.values(), 3, "dop853", 1e-6, 1e-6, 1)
    with pytest.raises(TypeError, match="rollout\\(\\) is missing q, v"):
        module.rollout()
    without = get(PENDULUM, backend)
    with pytest.raises(TypeError, match=r"rollout\(\) takes q, v, u, p, dt, steps, method, rtol, atol, each once"):
        without.rollout(**{**problem(without, 1), "w": np.ones((3, 3, 3))})


@BOTH
def test_positions(backend: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 1)
    for a, b in zip(
        module.rollout(**given, steps=6, method="euler"), module.rollout(*given.values(), 6, "euler"), strict=True
    ):
        assert a.tobytes() == b.tobytes()


# Singular states


@METHODS
@BOTH
@pytest.mark.parametrize("lanes", [1, 5, 21])
def test_singular_state_is_lost_alone(lanes: int, method: str, backend: str, compiled: Compiled) -> None:
    """A link of length zero has no direction: NaN in its trajectory, and the flag `invalid`; the others go on."""
    module = compiled("point_masses_2", "matrix", backend, functions=("forward_dynamics",))
    state = random_state(module, 5, (lanes,))
    arguments = (np.zeros((3, 4)), module.p, 1e-3)
    good = module.rollout(state.q, state.v, *arguments, method=method)
    assert np.isfinite(good).all()
    lost = lanes // 2
    state.q[lost, 2] = 0.0
    with np.errstate(invalid="raise"), pytest.raises(FloatingPointError, match="invalid value encountered"):
        module.rollout(state.q, state.v, *arguments, method=method)
    with np.errstate(invalid="ignore"):
        found = module.rollout(state.q, state.v, *arguments, method=method)
    for a, b in zip(found, good, strict=True):
        assert np.isnan(a[lost]).any(axis=-1).all()
        assert np.delete(a, lost, axis=0).tobytes() == np.delete(b, lost, axis=0).tobytes()


# Error control


def settled(rtol: float) -> dict[str, Any]:
    return {"method": "dop853", "rtol": rtol, "atol": rtol}


def test_coefficients_are_those_of_the_method() -> None:
    """Those of SciPy where they are doubles, and of order 8 with all digits: quadrature and the sums of the rows."""
    options = PLAIN._constants(np.dtype("longdouble"))[3:]
    eps = float(np.finfo("longdouble").eps)
    nodes, flat = np.array([0, *options[:11]]), list(options[11:])
    full = np.zeros((14, 12), "longdouble")
    for row, first, last in zip(full, PLAIN.FIRST, PLAIN.LAST, strict=True):
        for stage in (0, *range(first, last)):
            row[stage] = flat.pop(0)
    assert not flat
    expected = [*dop853_coefficients.A[1:12, :12], dop853_coefficients.B]
    np.testing.assert_array_equal(full[:12].astype(float), expected)
    np.testing.assert_array_equal(full[12].astype(float), dop853_coefficients.E5[:12])
    np.testing.assert_allclose(full[13].astype(float), dop853_coefficients.E3[:12], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(nodes.astype(float), dop853_coefficients.C[:12])
    for k, row in enumerate(full[:11]):
        assert abs(row.sum() - nodes[k + 1]) <= 4 * eps * np.abs(row).sum()
    for k in range(8):
        assert abs((full[11] * nodes**k).sum() - 1 / np.longdouble(k + 1)) <= 8 * eps * np.abs(full[11]).sum()
    # The estimates vanish for the quadratures that the lower orders do exactly, and for no further one.
    for row, order in ((full[12], 5), (full[13], 3)):
        found = [abs(float((row * nodes**k).sum())) for k in range(order + 1)]
        assert max(found[:order]) <= 8 * eps * float(np.abs(row).sum())
        assert found[order] > 1e-4


@BOTH
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10])
def test_steps_are_those_of_scipy(rtol: float, backend: str, get: Get) -> None:
    """From rest: the error is SciPy's at the same tolerance, not just as small."""
    module = get(PENDULUM, backend)
    q, v, u, p = np.array([0.3, 0.9]), np.zeros(2), np.array([[1.0, -2.0]]), module.p

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[2:], module.forward_dynamics(y[:2], y[2:], u[0], p)])

    exact, theirs = (
        solve_ivp(slope, (0, 1.5), [*q, *v], "DOP853", rtol=tight, atol=tight).y[:, -1] for tight in (3e-14, rtol)
    )
    ours = np.concatenate(module.rollout(q, v, u, p, 1.5, **settled(rtol)), axis=-1)[0]
    error = np.abs(theirs - exact).max()
    assert rtol / 100 < error < 100 * rtol
    assert np.abs(ours - theirs).max() < 0.01 * error + 1e-12


@BOTH
@pytest.mark.parametrize(("case", "intervals"), [(PENDULUM, 2), (LIFT, 3)])
def test_error_follows_the_tolerance(case: str, intervals: int, backend: str, get: Get) -> None:
    """Inputs jump and prescribed lengths break at the ends of intervals: a step across one would spoil the order."""
    module = get(case, backend)
    given = problem(module, 3, (), intervals)
    exact = np.concatenate(reference(module, given, 0.5), axis=-1)
    tolerances = [1e-3, 1e-5, 1e-7, 1e-9, 1e-11]
    errors = []
    for rtol in tolerances:
        found = module.rollout(**{**given, "dt": 0.5}, **settled(rtol))
        errors.append(np.abs(np.concatenate(found, axis=-1) - exact).max())
    assert 0.8 < np.polyfit(np.log(tolerances), np.log(errors), 1)[0] < 1.2


def test_error_over_intervals_is_that_of_scipy(get: Get) -> None:
    """In the mean: SciPy begins every interval with a step found anew, so the steps are others, of the same error."""
    module = get(LIFT, "c")
    ratios = []
    for seed in range(6):
        given = problem(module, seed)
        exact = np.concatenate(reference(module, given, 0.3), axis=-1)
        for rtol in (1e-5, 1e-7, 1e-9):
            ours = np.concatenate(module.rollout(**{**given, "dt": 0.3}, **settled(rtol)), axis=-1)
            theirs = np.concatenate(reference(module, given, 0.3, rtol, rtol), axis=-1)
            ratios.append(np.abs(ours - exact).max() / np.abs(theirs - exact).max())
    assert 0.3 < np.exp(np.mean(np.log(ratios))) < 3


@BOTH
def test_period_of_a_rod(backend: str, get: Get) -> None:
    """A rod on a pivot, 2 rad from hanging: its quarter periods are K(sin 1) sqrt(2 l/3 g), an elliptic integral."""
    module = get("rigid_1", backend)
    (lengths,) = (x for name, x in zip(module.p_names, module.p, strict=True) if name.endswith("length"))
    gravity = module.p[module.p_names.index("gravity")]
    quarter = float(mpmath.ellipk(mpmath.sin(1) ** 2) * mpmath.sqrt(mpmath.mpf(2) * lengths / 3 / gravity))
    q, v = module.rollout([2 - np.pi / 2], [0.0], np.zeros((4, 1)), module.p, quarter, **settled(1e-13))
    np.testing.assert_allclose(q[:, 0] + np.pi / 2, [0, -2, 0, 2], rtol=0, atol=1e-11)
    fastest = np.sqrt(3 * gravity / lengths * (1 - np.cos(2)))
    np.testing.assert_allclose(v[:, 0], [-fastest, 0, fastest, 0], rtol=0, atol=1e-11)


@BOTH
def test_point_mass_flies_on_a_parabola(backend: str) -> None:
    """Past the joint at 1 cm, where the link turns at 200 rad/s; in Cartesian coordinates it only falls."""
    scene = tree("flight", line(1), "point-masses", changes={0: {"masses": (1.0,), "fractions": (1.0,)}})
    module = eomgen.compile(scene, backend=backend, functions=["forward_dynamics"])
    x, y, vx, vy, g = -1.0, 0.01, 2.0, 9.81 / 4, 9.81
    s = np.hypot(x, y)
    start = [np.arctan2(y, x), s], [(x * vy - y * vx) / s**2, (x * vx + y * vy) / s]
    q, v = module.rollout(*start, np.zeros((20, 2)), module.p, 0.05, **settled(1e-13))
    t = np.linspace(0.05, 1, 20)
    c, d = np.cos(q[:, 0]), np.sin(q[:, 0])
    turned, grown = q[:, 1] * v[:, 0], v[:, 1]
    found = [q[:, 1] * c, q[:, 1] * d, grown * c - turned * d, grown * d + turned * c]
    exact = [x + vx * t, y + vy * t - g * t**2 / 2, vx + 0 * t, vy - g * t]
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-11)
    assert np.abs(v).max() > 100


def test_energy_drift_follows_the_tolerance(get: Get) -> None:
    module = get(PENDULUM, "c")
    first = module.energy([0.3, 0.9], [0.0, 0.0], module.p).sum()
    drift = []
    for rtol in (1e-6, 1e-9, 1e-12):
        q, v = module.rollout([0.3, 0.9], [0.0, 0.0], np.zeros((5, 2)), module.p, 1.0, **settled(rtol))
        energy = module.energy(q, v, module.p)
        drift.append(np.abs(energy.sum(axis=-1) - first).max() / np.abs(energy).max())
    # Some hundred steps, of a tolerance each
    assert (np.array(drift) < [1e-4, 1e-7, 1e-10]).all()
    assert drift[0] > 100 * drift[1] > 10_000 * drift[2]


@BOTH
def test_steps_are_limited(backend: str, get: Get, monkeypatch: pytest.MonkeyPatch) -> None:
    """A motion that takes more of them in an interval is lost; in shorter intervals it is not."""
    module = get("rigid_1", backend)
    rollout = sys.modules[type(module.rollout).__module__]
    monkeypatch.setattr(rollout, "MOST_TRIES", 60)
    rollout._constants.cache_clear()
    try:
        whole, parts = (
            functools.partial(module.rollout, [1.0], [0.0], np.zeros((t, 1)), module.p, 20 / t, **settled(1e-9))
            for t in (1, 40)
        )
        with np.errstate(invalid="raise"), pytest.raises(FloatingPointError, match="invalid value encountered"):
            whole()
        with np.errstate(invalid="ignore"):
            assert np.isnan(whole()).all()
        assert np.isfinite(parts()).all()
    finally:
        rollout._constants.cache_clear()


class Counted:
    """Forward dynamics that counts what it does."""

    def __init__(self, forward: Any) -> None:
        self.forward, self.nin, self.types = forward, forward.nin, forward.types
        self.states, self.singular = 0, 0

    def __call__(self, *arguments: Any) -> Any:
        found = self.forward(*arguments)
        self.states += found.size // found.shape[-1]
        self.singular += int(np.isnan(found).any(axis=-1).sum())
        return found


def test_no_more_evaluations_than_scipy(get: Get) -> None:
    """The kernel does what the array operations do, so theirs are counted."""
    module = get(PENDULUM, "c")
    q, v, u = np.array([1.2, 2.0]), np.zeros(2), np.zeros((1, 2))

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[2:], module.forward_dynamics(y[:2], y[2:], u[0], module.p)])

    theirs = solve_ivp(slope, (0, 2.0), [*q, *v], "DOP853", rtol=1e-8, atol=1e-8).nfev
    counted = Counted(module.forward_dynamics)
    by_arrays(counted)(q, v, u, module.p, 2.0, **settled(1e-8))
    assert 0.8 * theirs < counted.states <= theirs + 1  # one to check the shapes


def test_step_is_carried_over_the_ends_of_intervals(get: Get) -> None:
    """Intervals that are shorter than the steps take one step each, once the first step has been found."""
    module = get(PENDULUM, "c")
    counted = Counted(module.forward_dynamics)
    by_arrays(counted)([1.2, 2.0], [0.0, 0.0], np.zeros((100, 2)), module.p, 1e-3, **settled(1e-6))
    assert counted.states < 13 * 105


@BOTH
def test_duration_is_that_of_all_steps(backend: str, get: Get) -> None:
    """dt and steps mean a duration, however it is divided."""
    module = get(LIFT, backend)
    given = problem(module, 3, (4,)) | {"dt": 0.25}
    first = module.rollout(**given, method="dop853")
    second = module.rollout(**{**given, "dt": 0.0625}, steps=12, method="dop853")
    assert [x.tobytes() for x in first] == [x.tobytes() for x in second]


@BOTH
def test_tolerances_by_default(backend: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 3, (4,)) | {"dt": 0.25, "method": "dop853"}
    root = 2.0**-26
    for a, b in zip(module.rollout(**given), module.rollout(**given, rtol=root, atol=root), strict=True):
        assert a.tobytes() == b.tobytes()


@pytest.mark.parametrize("dtype", TYPES)
def test_types_of_controlled_steps(dtype: str, typed: ModuleType) -> None:
    """Each type comes as near to the motion as its tightest tolerance, and the kernel keeps all digits."""
    given = problem(typed, 9, (7,)) | {"p": typed.p, "dt": 0.2}
    arrays = {name: np.asarray(x).astype(dtype) for name, x in given.items()}
    tight = 100 * float(np.finfo(dtype).eps)
    found = typed.rollout(**arrays, **settled(tight * 1.01))
    assert [x.dtype for x in found] == [np.dtype(dtype)] * 2
    wide = {name: np.asarray(x).astype("longdouble") for name, x in given.items()}
    exact = typed.rollout(**wide, **settled(2e-17))
    for a, b in zip(found, exact, strict=True):
        assert np.abs(a - b).max() < 100 * tight * np.abs(b).max()
    for a, b in zip(found, by_arrays(typed.forward_dynamics)(**arrays, **settled(tight * 1.01)), strict=True):
        if typed.backend == "c":
            assert (a == b).all()
    with pytest.raises(ValueError, match="is below 100 eps of the number type"):
        typed.rollout(**arrays, **settled(tight * 0.99))


@BOTH
def test_coefficients_have_the_digits_of_the_computation(backend: str, get: Get) -> None:
    """float32 arrays in a module of float64: the numbers are converted, the method is not."""
    module = get(PENDULUM, backend)
    given = {name: np.float32(x) for name, x in (problem(module, 9, (5,)) | {"dt": 0.125}).items()}
    wide = {name: x.astype(float) for name, x in given.items()}
    for a, b in zip(module.rollout(**given, **settled(1e-12)), module.rollout(**wide, **settled(1e-12)), strict=True):
        assert a.dtype == np.float64
        assert a.tobytes() == b.tobytes()


def by_potential(potential: Callable[[Any], Any], backend: str) -> ModuleType:
    """A unit mass on a line in a potential."""
    x = dynamicsymbols("x")
    kinetic = x.diff(dynamicsymbols._t) ** 2 / 2
    equations = eomgen.lagrangian(kinetic, potential(x), [x], parameters={})
    return eomgen.compile(equations, backend=backend, functions=["forward_dynamics"])


@BOTH
def test_motion_that_ends_is_nan_from_there(backend: str) -> None:
    """x'' = 2 x^3 from x = v = 1 is x = 1/(1 - t): it reaches infinity at t = 1, in the second interval."""
    module = by_potential(lambda x: -(x**4) / 2, backend)
    start, u = (np.array([[1.0], [0.0]]), np.array([[1.0], [0.0]])), np.zeros((3, 1))
    with np.errstate(invalid="raise"), pytest.raises(FloatingPointError, match="invalid value encountered"):
        module.rollout(*start, u, module.p, 0.75, **settled(1e-12))
    with np.errstate(invalid="ignore"):
        q, v = module.rollout(*start, u, module.p, 0.75, **settled(1e-12))
    np.testing.assert_allclose([q[0, 0, 0], v[0, 0, 0]], [4, 16], rtol=1e-9)
    assert np.isnan(q[0, 1:]).all() and np.isnan(v[0, 1:]).all()
    assert (q[1] == 0).all() and (v[1] == 0).all()


@BOTH
@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("which", ["q", "u", "p"])
def test_what_is_not_finite_gives_nan(which: str, bad: float, backend: str, get: Get) -> None:
    """In its trajectory, from its interval on; the steps come to an end."""
    module = get(LIFT, backend)
    given = problem(module, 2, (5,)) | {"dt": 0.05}
    good = module.rollout(**given, method="dop853")
    given[which] = given[which].copy()
    given[which][(2, 1, 0) if which == "u" else (2, 0)] = bad
    with np.errstate(invalid="ignore"):
        found = module.rollout(**given, method="dop853")
    for a, b in zip(found, good, strict=True):
        kept = 1 if which == "u" else 0
        assert np.isnan(a[2, kept:]).all()
        assert a[2, :kept].tobytes() == b[2, :kept].tobytes()
        assert np.delete(a, 2, axis=0).tobytes() == np.delete(b, 2, axis=0).tobytes()


def test_steps_that_were_given_up_raise_no_flag() -> None:
    """x'' = sqrt(x), thrown towards 0 and turning at 0.01: a step that is tried passes 0, the motion does not."""
    module = by_potential(lambda x: -sympy.Rational(2, 3) * x ** sympy.Rational(3, 2), "c")
    arguments = np.array([1.0]), np.array([-1.1546]), np.zeros((1, 1)), module.p, 5.0
    counted = Counted(module.forward_dynamics)
    expected = by_arrays(counted)(*arguments, **settled(1e-2))
    assert counted.singular > 0
    with np.errstate(all="raise"):
        found = module.rollout(*arguments, **settled(1e-2))
    assert [x.tobytes() for x in found] == [x.tobytes() for x in expected]


# The function itself


def test_only_beside_forward_dynamics() -> None:
    module = eomgen.compile(CASES["rigid_1"], backend="numpy", functions=["energy"])
    assert "rollout" not in module.__all__
    assert not hasattr(module, "rollout")


@BOTH
def test_pickles_by_reference(backend: str, get: Get) -> None:
    module = get(PENDULUM, backend)
    assert pickle.loads(pickle.dumps(module.rollout)) is module.rollout
    assert module.rollout.__name__ == "rollout"
    assert "dt: the step" in module.rollout.__doc__


@METHODS
@BOTH
def test_folded_numbers(method: str, backend: str) -> None:
    """p has no element and remains an argument."""
    module = eomgen.compile(
        CASES["joint_springs"], "articulated", backend, fold=True, functions=["forward_dynamics"], loops=True
    )
    state = random_state(CASES["joint_springs"], 1, (18,))
    found = module.rollout(state.q, state.v, np.zeros((2, 3)), module.p, 1e-3, steps=4, method=method)
    plain = eomgen.compile(CASES["joint_springs"], backend="numpy", functions=["forward_dynamics"])
    expected = plain.rollout(state.q, state.v, np.zeros((2, 3)), plain.p, 1e-3, steps=4, method=method)
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10)
