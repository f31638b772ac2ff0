"""Rollouts: of the promised order, alike in both back ends, in lanes as alone, and refusing what makes no sense."""

import importlib.util
import pickle
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from bench.cases import CASES, random_state
from eomgen.backends import BACKENDS, package
from tests.conftest import Compiled

BOTH = pytest.mark.parametrize("backend", BACKENDS)
METHODS = pytest.mark.parametrize("method", ["rk4", "euler"])
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


def by_arrays(module: ModuleType) -> Any:
    """A rollout of the same forward dynamics with array operations, step by step: what the kernel must do."""
    spec = importlib.util.spec_from_file_location("plain_rollout", package.ROLLOUT)
    assert spec is not None
    assert spec.loader is not None
    plain = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(plain)
    return plain.Rollout(SimpleNamespace(forward_dynamics=module.forward_dynamics))


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


def reference(module: ModuleType, given: dict[str, Any], duration: float) -> tuple[np.ndarray, np.ndarray]:
    """The same by SciPy's DOP853 with tight tolerances, interval after interval."""
    q, v, n = given["q"], given["v"], given["q"].shape[-1]
    found = []
    for j, u in enumerate(given["u"]):

        def slope(t: float, y: np.ndarray, u: np.ndarray = u, j: int = j) -> np.ndarray:
            now = []
            if "w" in given:
                s, rate, acceleration = given["w"][j].T
                now = [np.stack([s + t * rate + t**2 / 2 * acceleration, rate + t * acceleration, acceleration], -1)]
            return np.concatenate([y[n:], module.forward_dynamics(y[:n], y[n:], u, *now, given["p"])])

        done = solve_ivp(slope, (0, duration), np.concatenate([q, v]), "DOP853", rtol=3e-14, atol=1e-14)
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
    expected = by_arrays(module)(**given, steps=steps, method=method)
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


@BOTH
@pytest.mark.parametrize("varying", ["q", "v", "u", "w", "p", "dt"])
def test_any_argument_may_be_the_one_that_varies(varying: str, backend: str, get: Get) -> None:
    """Leading axes broadcast: one trajectory per value of the argument."""
    module = get(LIFT, backend)
    many, one = problem(module, 2, (6,)), problem(module, 4)
    found = module.rollout(**{**one, varying: many[varying]}, steps=6)
    for k in range(6):
        alone = module.rollout(**{**one, varying: many[varying][k]}, steps=6)
        for i in (0, 1):
            assert found[i].shape == (6, 3, 3)
            np.testing.assert_allclose(found[i][k], alone[i], rtol=1e-12, atol=1e-12)


@BOTH
def test_axes_of_arguments_broadcast(backend: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 6)
    shapes = {"q": (4, 1), "u": (3,), "p": (2, 1, 1), "dt": (4, 1)}
    wide = given | {
        name: np.broadcast_to(given[name], (*shape, *np.shape(given[name]))) for name, shape in shapes.items()
    }
    one = module.rollout(**given)
    for i, found in enumerate(module.rollout(**{**given, **wide})):
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


@BOTH
@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts(layout: str, backend: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 3, (19,)) | {"p": module.p}
    changed = {name: LAYOUTS[layout](x) if np.ndim(x) > 1 else x for name, x in given.items()}
    for a, b in zip(module.rollout(**given, steps=6), module.rollout(**changed, steps=6), strict=True):
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


@BOTH
@pytest.mark.parametrize("shape", [(0,), (3, 0)])
def test_no_trajectories(shape: tuple[int, ...], backend: str, get: Get) -> None:
    module = get(LIFT, backend)
    given = problem(module, 1, shape)
    assert [found.shape for found in module.rollout(**given)] == [(*shape, 3, 3)] * 2


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


@METHODS
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


@BOTH
def test_single_precision_alone(backend: str) -> None:
    """A module without float64 integrates, too."""
    module = eomgen.compile(CASES[PENDULUM], backend=backend, dtypes="float32", functions=["forward_dynamics"])
    given = {name: x.astype("float32") for name, x in (problem(module, 9, (5,)) | {"p": module.p}).items()}
    for dt in (given["dt"], np.float32(0.002), 0.002):
        found = module.rollout(**{**given, "dt": dt})
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
    "unknown method": ({"method": "rk45"}, ValueError, r"unknown method 'rk45'; allowed: 'rk4', 'euler'"),
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
    "unknown argument": ({"step": 3}, TypeError, r"rollout\(\) takes q, v, u, w, p, dt, steps, method, each once"),
    "complex q": ({"q": np.ones(3) * 1j}, TypeError, r"not supported for the input types|[Cc]ast|complex"),
}  # fmt: skip


@BOTH
@pytest.mark.parametrize("what", WRONG)
def test_wrong_arguments_are_refused(what: str, backend: str, get: Get) -> None:
    """In one line, before anything is computed."""
    changes, kind, message = WRONG[what]
    module = get(LIFT, backend)
    with pytest.raises(kind, match=message) as caught:
        module.rollout(**{**problem(module, 1), **changes})
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
        module.rollout(*given.values(), 3, "rk4", 1)
    with pytest.raises(TypeError, match="rollout\\(\\) is missing q, v"):
        module.rollout()
    without = get(PENDULUM, backend)
    with pytest.raises(TypeError, match=r"rollout\(\) takes q, v, u, p, dt, steps, method, each once"):
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


@BOTH
def test_folded_numbers(backend: str) -> None:
    """p has no element and remains an argument."""
    module = eomgen.compile(
        CASES["joint_springs"], "articulated", backend, fold=True, functions=["forward_dynamics"], loops=True
    )
    state = random_state(CASES["joint_springs"], 1, (18,))
    found = module.rollout(state.q, state.v, np.zeros((2, 3)), module.p, 1e-3, steps=4)
    plain = eomgen.compile(CASES["joint_springs"], backend="numpy", functions=["forward_dynamics"])
    expected = plain.rollout(state.q, state.v, np.zeros((2, 3)), plain.p, 1e-3, steps=4)
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10)
