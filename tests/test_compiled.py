"""Compiled modules of both back ends: right to the rounding, and arrays behave as NumPy's own functions treat them."""

import functools
import json
import os
import pickle
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest

import eomgen
from bench.cases import CASES, State, random_state
from eomgen import pipeline
from eomgen.backends import BACKENDS
from eomgen.errors import OptionError, UnsupportedError
from eomgen.functions import FUNCTIONS
from eomgen.ir.equations import Equations
from eomgen.ir.interpret import run
from tests.conftest import Compiled
from tests.rounding import Rounded, RunningError

ROOT = Path(__file__).parents[1]


class Form(NamedTuple):
    """A case, its method, and options of `eomgen.compile`."""

    case: str
    method: str
    options: tuple[tuple[str, Any], ...] = ()

    def __str__(self) -> str:
        return " ".join([self.case, self.method, *(f"{key}={value}" for key, value in self.options)])


DENSE = (("solver", "dense"),)
LOOPS = (("loops", True),)
COMPILED = [
    Form("walker_rods_prescribed", "matrix"),
    Form("springs", "recursive", DENSE),
    Form("models_5", "articulated"),
    Form("point_masses_3", "lagrange", DENSE),
    Form("hanging_branch", "articulated", LOOPS),
]
EVALUATED = [
    *COMPILED,
    Form("rigid_5", "matrix", DENSE),
    Form("rigid_5", "articulated", LOOPS),
    Form("telescopic_4_mixed", "lagrange", DENSE),
    Form("massless", "recursive"),
    Form("roots", "lagrange"),
    Form("springs", "articulated", LOOPS),
    Form("weightless_springs", "articulated"),
]
ARRAYS = COMPILED[0]  # where the arrays are what matters: five angles, and a w
BOTH = pytest.mark.parametrize("backend", BACKENDS)


def compiled_form(compiled: Compiled, form: Form, backend: str, **options: Any) -> ModuleType:
    return compiled(form.case, form.method, backend, **dict(form.options), **options)


@pytest.fixture(params=BACKENDS)
def module(request: pytest.FixtureRequest, compiled: Compiled) -> ModuleType:
    """The module that array handling is tested on, of each back end."""
    return compiled_form(compiled, ARRAYS, request.param)


def call(module: ModuleType, name: str, states: State, p: Any = None, **keywords: Any) -> Any:
    """A function of a module by name at some states."""
    return getattr(module, name)(*states.of(FUNCTIONS[name].arguments), module.p if p is None else p, **keywords)


def functions_of(module: ModuleType) -> list[str]:
    """The functions that were built, not those that would be on request."""
    return [name for name in FUNCTIONS if name in module.__all__]


# Accuracy

STATES = 5
EPS = float(np.finfo(float).eps)


@functools.cache
def expected(form: Form, fold: bool = False, dtype: str = "float64") -> list[dict[str, list[Rounded]]]:
    """For each of some random states, every program in 60 digits with the bound of its rounding."""
    equations = eomgen.derive(CASES[form.case], form.method, fold)
    programs = pipeline.programs(equations, **dict(form.options))
    states, arithmetic = states_of(form.case, dtype), RunningError()
    p = np.asarray(equations.symbols.p_values, dtype)

    def numbers(array: np.ndarray) -> list[Rounded]:
        return [arithmetic.number(x) for x in array.ravel()]

    results = []
    for k in range(STATES):
        inputs = {letter: numbers(array[k]) for letter, array in states._asdict().items()} | {"p": numbers(p)}
        results.append({
            program.name: run(program, {array.name: inputs[array.name] for array in program.inputs}, arithmetic)
            for program in programs
        })  # fmt: skip
    return results


def states_of(case: str, dtype: str) -> State:
    return State(*(x.astype(dtype) for x in random_state(CASES[case], seed=11, batch=(STATES,))))


def assert_right_to_rounding(
    module: ModuleType, reference: list[dict[str, list[Rounded]]], states: State, dtype: str = "float64"
) -> None:
    """Every element of every function is as near to its 60 digits as the operations' own rounding must leave it.

    For the elimination, where a bound that follows every operation is too wide, also as near as the condition of M
    leaves it (n eps cond M of the largest element; Higham 2002, theorem 10.4). Every bound says something: it is
    below 1e4 eps of the largest element.
    """
    eps = float(np.finfo(dtype).eps)
    p = module.p.astype(dtype)
    condition = np.linalg.cond(call(module, "mass_matrix", states, p).astype(float))
    for name in functions_of(module):
        found = call(module, name, states, p)
        assert found.dtype == dtype
        for k, elements in enumerate(found.reshape(STATES, -1)):
            exact = reference[k][name]
            scale = max(abs(float(x.value)) for x in exact)
            bounds = eps * np.array([x.bound for x in exact])
            if name == "forward_dynamics":
                bounds = np.minimum(bounds, len(module.q_names) * eps * condition[k] * scale)
            errors = RunningError().errors(elements, exact)
            assert (errors <= bounds).all(), f"{name}: {errors / eps} eps"
            assert (bounds <= 1e4 * eps * scale).all(), name


@pytest.mark.parametrize(
    ("form", "backend"), [(form, "c") for form in COMPILED] + [(form, "numpy") for form in EVALUATED], ids=str
)
def test_right_to_rounding(form: Form, backend: str, compiled: Compiled) -> None:
    module = compiled_form(compiled, form, backend)
    assert (module.backend, module.method) == (backend, form.method)
    assert_right_to_rounding(module, expected(form), states_of(form.case, "float64"))


@BOTH
def test_folded_numbers(backend: str, compiled: Compiled) -> None:
    """The numbers are compiled in: p has no element, and a batch needs none either."""
    form = Form("joint_springs", "matrix")
    module = compiled_form(compiled, form, backend, fold=True)
    assert module.p.shape == (0,)
    assert module.p_names == ()
    states = states_of(form.case, "float64")
    assert_right_to_rounding(module, expected(form, fold=True), states)
    unfolded = call(compiled_form(compiled, form, "numpy"), "bias", states)
    # Both are right to below 1e4 eps of the largest element, see above.
    np.testing.assert_allclose(call(module, "bias", states), unfolded, rtol=0, atol=1e4 * EPS * np.abs(unfolded).max())
    assert call(module, "energy", states, np.empty((STATES, 0))).shape == (STATES, 2)


@BOTH
@pytest.mark.parametrize("dtype", ["float32", "float64", "longdouble"])
def test_types(dtype: str, backend: str, compiled: Compiled) -> None:
    """A function computes in the smallest offered type that holds its arguments, to that type's rounding."""
    form = Form("point_masses_2", "matrix")
    module = compiled_form(compiled, form, backend, dtypes=("float32", "float64", "longdouble"))
    states = states_of(form.case, dtype)
    assert_right_to_rounding(module, expected(form, dtype=dtype), states, dtype)
    mixed = module.bias(states.q.astype("float32"), states.v, module.p)
    assert mixed.dtype == np.result_type(dtype, float)


@BOTH
def test_types_that_are_not_offered(backend: str, compiled: Compiled) -> None:
    module = compiled_form(compiled, ARRAYS, backend)
    states = random_state(module, 1)
    single = State(*(x.astype("float32") for x in states))
    assert call(module, "bias", single, module.p.astype("float32")).dtype == np.float64
    with pytest.raises(TypeError, match="ufunc 'joints' not supported for the input types"):
        module.joints(states.q.astype("longdouble"), states.w, module.p)
    with pytest.raises(OptionError, match="unknown dtype 'float16'; allowed: float64, float32, longdouble"):
        eomgen.compile(CASES["rigid_1"], backend=backend, dtypes=("float16",))


# Batches


@pytest.mark.parametrize("form", COMPILED, ids=str)
@pytest.mark.parametrize("states", [1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 33])
def test_batch_is_its_states_bit_for_bit(form: Form, states: int, compiled: Compiled) -> None:
    """A lane of the vector code rounds as the code for one state does."""
    module = compiled_form(compiled, form, "c")
    batch = random_state(module, states, (states,))
    for name in functions_of(module):
        together = call(module, name, batch)
        alone = np.stack([call(module, name, State(*(x[k] for x in batch))) for k in range(states)])
        assert together.tobytes() == alone.tobytes(), name


def each(module: ModuleType, name: str, arguments: Sequence[np.ndarray]) -> np.ndarray:
    """The function state by state, over the broadcast batch."""
    cores = [1] * (len(arguments) - 2) + [2, 1]  # w has rows
    split = [(x.shape[: x.ndim - core], x.shape[x.ndim - core :]) for x, core in zip(arguments, cores, strict=True)]
    batch = np.broadcast_shapes(*(leading for leading, _ in split))
    full = [np.broadcast_to(x, (*batch, *core)) for x, (_, core) in zip(arguments, split, strict=True)]
    results = [getattr(module, name)(*(x[index] for x in full)) for index in np.ndindex(*batch)]
    return np.array(results).reshape(*batch, *results[0].shape)


@pytest.mark.parametrize(
    "shapes",
    [
        [(3,), (), (), (), ()],
        [(), (), (), (), (3,)],
        [(4, 1), (1, 3), (), (3,), ()],
        [(4, 1), (1, 3), (2, 1, 1), (3,), (4, 1)],
        [(6,), (6,), (6,), (6,), (6,)],
        [(2, 3), (2, 3), (2, 3), (2, 3), (2, 1)],
        [(1,), (1,), (1,), (1,), (1,)],
        [(9, 9), (9, 9), (9, 9), (9, 9), (1, 1)],
    ],
    ids=str,
)
def test_broadcasting(shapes: list[tuple[int, ...]], module: ModuleType) -> None:
    """Leading axes broadcast, those of p too."""
    one = random_state(module, 2)
    q, v, u, w = (
        np.stack([getattr(random_state(module, k), letter) for k in range(int(np.prod(shape)))]).reshape(
            *shape, *getattr(one, letter).shape
        )
        for letter, shape in zip("qvuw", shapes, strict=False)
    )
    factors = np.random.default_rng(0).uniform(0.9, 1.1, (*shapes[-1], module.p.size))
    arguments = [q, v, u, w, module.p * factors]
    found = module.forward_dynamics(*arguments)
    # NumPy's sine may round differently for long and short arrays; elimination multiplies that (see above).
    np.testing.assert_allclose(found, each(module, "forward_dynamics", arguments), rtol=1e-10)


@pytest.mark.parametrize("shape", [(0,), (3, 0), (0, 2)])
def test_no_states(shape: tuple[int, ...], module: ModuleType) -> None:
    none = random_state(module, 1, shape)
    assert call(module, "forward_dynamics", none).shape == (*shape, 5)
    assert call(module, "mass_matrix", none).shape == (*shape, 5, 5)


LAYOUTS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "every second state": lambda x: np.repeat(x, 2, axis=0)[::2],
    "every second element": lambda x: np.repeat(x, 2, axis=-1)[..., ::2],
    "backwards": lambda x: x[::-1].copy()[::-1],
    "elements backwards": lambda x: x[..., ::-1].copy()[..., ::-1],
    "by columns": np.asfortranarray,
    "unaligned": lambda x: np.frombuffer(b"." + x.tobytes(), np.uint8)[1:].view(x.dtype).reshape(x.shape),
    "swapped bytes": lambda x: x.astype(x.dtype.newbyteorder()),
    "read-only": lambda x: np.frombuffer(x.tobytes(), x.dtype).reshape(x.shape),
    "nested lists": lambda x: x.tolist(),  # type: ignore[dict-item,return-value]
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts(layout: str, module: ModuleType) -> None:
    states = random_state(module, 4, (19,))
    change = LAYOUTS[layout]
    for name in functions_of(module):
        arguments = [*states.of(FUNCTIONS[name].arguments), module.p]
        expected_ = getattr(module, name)(*arguments)
        found = getattr(module, name)(*(change(x) for x in arguments))
        assert found.tobytes() == expected_.tobytes(), name


def test_integers(module: ModuleType) -> None:
    q, w = np.arange(5), np.ones((5, 3), int)
    floats = module.joints(q.astype(float), w.astype(float), module.p)
    assert module.joints(q, w, module.p).tobytes() == floats.tobytes()
    assert module.joints([0, 1, 2, 3, 4], w.tolist(), module.p).shape == (5, 2)


# Results into arrays that are given


@pytest.mark.parametrize("states", [3, 37])
@pytest.mark.parametrize("name", ["forward_dynamics", "mass_matrix"])
def test_out(name: str, states: int, module: ModuleType) -> None:
    batch = random_state(module, 6, (states,))
    expected_ = call(module, name, batch)
    spread = np.full((2 * states, *expected_.shape[1:]), -7.0)
    for out in (np.empty_like(expected_), np.asfortranarray(np.empty_like(expected_)), spread[::2]):
        assert call(module, name, batch, out=out) is out
        assert out.tobytes() == expected_.tobytes()
    assert (spread[1::2] == -7).all()
    arguments = (*batch.of(FUNCTIONS[name].arguments), module.p)
    assert getattr(module, name)(*arguments, out).tobytes() == expected_.tobytes()
    assert getattr(module, name)(*arguments, out=(out,)) is out
    narrow = np.empty(expected_.shape, np.float32)
    assert call(module, name, batch, out=narrow).tobytes() == expected_.astype(np.float32).tobytes()


@pytest.mark.parametrize("shift", [0, 1, -1])
@pytest.mark.parametrize("letter", "qvu")
def test_out_that_overlaps_an_argument(letter: str, shift: int, module: ModuleType) -> None:
    """As if the arguments had been copied first; 5000 states are more than are evaluated together."""
    states = random_state(module, 8, (5000,))
    expected_ = call(module, "forward_dynamics", states)
    memory = np.zeros((5002, 5))
    argument, out = memory[1:-1], memory[1 + shift : 5001 + shift]
    argument[:] = getattr(states, letter)
    call(module, "forward_dynamics", states._replace(**{letter: argument}), out=out)
    assert out.tobytes() == expected_.tobytes()


def test_one_result_into_a_batch(module: ModuleType) -> None:
    """As with any ufunc, `out` may have more states than the arguments: the result is broadcast."""
    state = random_state(module, 1)
    out = np.empty((3, 5))
    call(module, "bias", state, out=out)
    assert (out == call(module, "bias", state)).all()


# Refusals, in NumPy's own words

WRONG: dict[str, Callable[[State, np.ndarray], dict[str, Any]]] = {
    "short q": lambda s, p: {"q": s.q[:-1]},
    "long v": lambda s, p: {"v": np.append(s.v, 1)},
    "empty u": lambda s, p: {"u": s.u[:0]},
    "scalar q": lambda s, p: {"q": 0.5},
    "flat w": lambda s, p: {"w": s.w.ravel()},
    "few rows of w": lambda s, p: {"w": s.w[:-1]},
    "few columns of w": lambda s, p: {"w": s.w[:, :2]},
    "long p": lambda s, p: {"p": np.append(p, 1)},
    "batches of q and v": lambda s, p: {"q": np.stack([s.q] * 3), "v": np.stack([s.v] * 4)},
    "batches of w and p": lambda s, p: {"w": np.stack([s.w] * 3), "p": np.ones((2, 2, p.size))},
    "short out": lambda s, p: {"out": np.empty(4)},
    "scalar out": lambda s, p: {"out": np.empty(())},
    "batch of out": lambda s, p: {"q": np.stack([s.q] * 3), "out": np.empty((2, 5))},
    "read-only out": lambda s, p: {"out": np.frombuffer(bytes(40))},
    "uneven list": lambda s, p: {"q": [[1.0], [1.0, 2.0]]},
}


def refusal(module: ModuleType, kind: type[Exception], changes: dict[str, Any]) -> str:
    """The message that refuses changed arguments of forward_dynamics."""
    state = random_state(module, 1)
    arguments = {**{letter: getattr(state, letter) for letter in "qvuw"}, "p": module.p, **changes}
    keywords = {name: arguments.pop(name) for name in list(arguments) if name not in {*"qvuwp"}}
    with pytest.raises(kind) as caught:
        module.forward_dynamics(*arguments.values(), **keywords)
    return str(caught.value)


@pytest.mark.parametrize("what", WRONG)
def test_wrong_shapes_are_refused_alike(what: str, compiled: Compiled) -> None:
    modules = [compiled_form(compiled, ARRAYS, backend) for backend in BACKENDS]
    wrong = WRONG[what](random_state(modules[0], 1), modules[0].p)
    first, second = (refusal(module, ValueError, wrong) for module in modules)
    assert first == second


@pytest.mark.parametrize(
    ("argument", "value"),
    [("q", 1j * np.ones(5)), ("q", ["a"] * 5), ("q", np.ones(5, object)), ("out", [0.0] * 5), ("out", np.ones(5, int))],
    ids=["complex", "text", "objects", "out a list", "out of integers"],
)
def test_wrong_types_are_refused_alike(argument: str, value: Any, compiled: Compiled) -> None:
    first, second = (
        refusal(compiled_form(compiled, ARRAYS, backend), TypeError, {argument: value}) for backend in BACKENDS
    )
    assert first == second


@pytest.mark.parametrize("count", [0, 4, 7])
def test_wrong_numbers_of_arguments_are_refused(count: int, module: ModuleType) -> None:
    with pytest.raises(TypeError, match=f"takes from 5 to 6 positional arguments but {count} were given"):
        module.forward_dynamics(*[np.zeros(5)] * count)


# Refusals of eomgen's, before anything is built


def message_of(error: type[Exception], call: Callable[..., Any], *arguments: Any, **options: Any) -> str:
    """The one line of a refusal."""
    with pytest.raises(error) as caught:
        call(*arguments, **options)
    text = str(caught.value)
    assert text.isprintable()
    return text


@pytest.mark.parametrize("given", ["hopper.toml", Path("hopper.toml"), eomgen.chain(1).to_dict(), None, 5])
@pytest.mark.parametrize("call", [eomgen.compile, eomgen.derive])
def test_what_is_no_scene(call: Callable[[Any], Any], given: Any) -> None:
    text = message_of(OptionError, call, given)
    assert re.match(r"('hopper.toml'|PosixPath\('hopper.toml'\)|{'name': .*}.*|None|5) is no scene; ", text)
    assert "use eomgen.load_scene(path) for a file, eomgen.Scene.from_dict(table) for a dictionary" in text


def test_compile_documents_what_it_raises() -> None:
    for error in ("OptionError", "UnsupportedError", "SingularError", "BuildError"):
        assert f"        {error}: " in (eomgen.compile.__doc__ or "")


def test_what_is_no_equations() -> None:
    scene = eomgen.chain(1)
    assert "are no equations; use eomgen.derive(scene, method='recursive')" in message_of(
        OptionError, eomgen.extend, scene, scene.links[0]
    )


def lagrangian() -> Equations:
    """A falling mass."""
    sympy = pytest.importorskip("sympy")
    x, v, m, g = sympy.symbols("x v m g")
    return eomgen.lagrangian(m * v**2 / 2, m * g * x, [x], {m: 2.0, g: 9.81}, v=[v])


@pytest.mark.parametrize("method", ["lagrange", "matrix", "articulated", "yours"])
def test_options_that_equations_have_settled(method: str) -> None:
    """A method is refused that is neither theirs nor the default; and fold, where there are parameters."""
    yours = method == "yours"
    equations = lagrangian() if yours else eomgen.derive(eomgen.chain(1), method)
    options: dict[str, Any] = {"backend": "numpy", "functions": ["energy"]}
    assert "unknown method 'nonsense'" in message_of(OptionError, eomgen.compile, equations, "nonsense", **options)
    text = message_of(UnsupportedError, eomgen.compile, equations, "recursive", **options)
    assert f"method 'recursive' is not that of the equations, {equations.method!r}; leave it out" in text
    text = message_of(UnsupportedError, eomgen.compile, equations, fold=True, **options)
    advice = "write the numbers into the energies" if yours else "give fold to eomgen.derive"
    assert f"fold=True comes too late for equations with {len(equations.p)} parameters; {advice}" in text
    assert eomgen.compile(equations, **options).method == equations.method
    assert eomgen.compile(equations, equations.method, **options).method == equations.method


def test_equations_that_are_folded_already() -> None:
    equations = eomgen.derive(eomgen.chain(1), fold=True)
    assert len(eomgen.compile(equations, backend="numpy", functions=["energy"], fold=True).p) == 0


# Singular states


@BOTH
@pytest.mark.parametrize("method", ["matrix", "articulated"])
@pytest.mark.parametrize("states", [1, 3, 17])
def test_singular_state(states: int, method: str, backend: str, compiled: Compiled) -> None:
    """A link of length zero has no direction: NaN for that state, the flag `invalid`, and nothing for the others."""
    module = compiled("point_masses_2", method, backend)
    batch = random_state(module, 5, (states,))
    good = call(module, "forward_dynamics", batch)
    assert np.isfinite(good).all()
    lost = states // 2
    batch.q[lost, 2] = 0.0
    with np.errstate(invalid="raise"), pytest.raises(FloatingPointError, match="invalid value encountered"):
        call(module, "forward_dynamics", batch)
    with np.errstate(invalid="ignore"):
        found = call(module, "forward_dynamics", batch)
    assert np.isnan(found[lost, 0])
    assert np.delete(found, lost, axis=0).tobytes() == np.delete(good, lost, axis=0).tobytes()
    # What divides by nothing stays finite.
    with np.errstate(invalid="raise"):
        assert np.isfinite(call(module, "mass_matrix", batch)).all()
        assert np.isfinite(call(module, "inverse_dynamics", batch)).all()


@BOTH
@pytest.mark.parametrize("dtype", ["float64", "float32", "longdouble"])
@pytest.mark.parametrize(("method", "threshold"), [("matrix", 16), ("recursive", 16), ("articulated", 8)])
def test_both_sides_of_a_pivot(method: str, threshold: int, dtype: str, backend: str) -> None:
    """A rod with a mass of x on its end and a mass of 1 on the next in line with it: the last pivot is x.

    Its reference is x + 1 in the mass matrix, and x + 1/2, a mean over directions, in the articulated inertia.
    """
    rods = [
        eomgen.JointMasses(name=name, parent=parent, length=1.0, masses=(0.0, 0.0, mass), fraction=0.5)
        for name, parent, mass in (("near", "ground", 0.5), ("far", "near", 1.0))
    ]
    solver = "articulated" if method == "articulated" else "dense"
    module = eomgen.compile(
        eomgen.Scene("pair", tuple(rods)),
        method=method,
        backend=backend,
        functions=["forward_dynamics"],
        dtypes=[dtype],
        solver=solver,
    )
    p, x = module.p.astype(dtype), module.p_names.index("near.mass3")
    rng = np.random.default_rng(3)
    q, v, u = rng.normal(size=(3, 37, 2)).astype(dtype)
    v[11] = 0
    for place, safe in ((threshold - 1, False), (threshold + 1, True)):
        p[x] = place * np.finfo(dtype).eps
        q[11] = 1.0, 0.0
        alone = np.stack([module.forward_dynamics(*state, p) for state in zip(q, v, u, strict=True)])
        q[11] = 0.0
        with np.errstate(invalid="ignore"):
            found, one = module.forward_dynamics(q, v, u, p), module.forward_dynamics(q[11], v[11], u[11], p)
        assert np.isfinite(found[11]).all() == np.isfinite(one).all() == safe
        assert np.isnan(found[11]).any() == (not safe)
        assert np.array_equal(np.delete(found, 11, axis=0), np.delete(alone, 11, axis=0))
        if safe:
            assert np.array_equal(found[11], one)
            with np.errstate(invalid="raise"):
                module.forward_dynamics(q, v, u, p)
        else:
            with np.errstate(invalid="raise"), pytest.raises(FloatingPointError):
                module.forward_dynamics(q, v, u, p)


@BOTH
def test_nan_stays_in_its_state(backend: str, compiled: Compiled) -> None:
    module = compiled_form(compiled, ARRAYS, backend)
    batch = random_state(module, 5, (11,))
    good = call(module, "forward_dynamics", batch)
    batch.v[4, 1] = np.nan
    with np.errstate(invalid="ignore"):
        found = call(module, "forward_dynamics", batch)
    assert np.isnan(found[4]).any()
    assert np.delete(found, 4, axis=0).tobytes() == np.delete(good, 4, axis=0).tobytes()


# The module itself


@BOTH
def test_names_and_facts(backend: str, compiled: Compiled) -> None:
    module = compiled("telescopic_4_mixed", "recursive", backend, functions=("joints", "bias"))
    scene = CASES["telescopic_4_mixed"]
    assert functions_of(module) == ["bias", "joints"]
    names = [(module.q_names, scene.q_names), (module.v_names, scene.v_names), (module.u_names, scene.u_names)]
    assert all(found == scenes_ for found, scenes_ in names)
    assert module.w_names == scene.w_names == ("link2.length",)
    assert dict(zip(module.p_names, module.p, strict=True)) == {p.name: p.value for p in scene.parameters}
    assert module.bias.signature == "(6),(6),(1,3),(18)->(6)"
    assert module.scene == scene.to_dict()
    assert set(module.info["operations"]) == {"bias", "joints"}
    with pytest.raises(ValueError, match="read-only"):
        module.p[0] = 1.0


@BOTH
def test_help_tells_shapes(backend: str) -> None:
    module = eomgen.compile(eomgen.chain(2), backend=backend, functions=["forward_dynamics", "jacobian", "regressor"])
    for name in ("forward_dynamics", "jacobian", "regressor"):
        letters = "qva" if name == "regressor" else "qvup"
        given = [module.p if letter == "p" else np.ones((3, 4)) for letter in letters]
        function = getattr(module, name)
        size = ", ".join(map(str, function(*given).shape[1:]))
        shapes = ", ".join(f"{letter} (..., {x.shape[-1]})" for letter, x in zip(letters, given, strict=True))
        assert f"{name}({', '.join(letters)})\n" in function.__doc__
        assert f"{shapes} -> (..., {size}); SI units" in function.__doc__


@BOTH
def test_functions_by_name(backend: str) -> None:
    with pytest.raises(OptionError, match="unknown function 'torque_of'"):
        eomgen.compile(CASES["rigid_1"], backend=backend, functions=["torque_of"])


def python(*arguments: str, env: dict[str, str] | None = None, **keywords: Any) -> str:
    """What a new Python process prints."""
    command = [sys.executable, *arguments]
    done = subprocess.run(command, env=env, text=True, capture_output=True, timeout=120, check=False, **keywords)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_pickles_by_reference(module: ModuleType, tmp_path: Path) -> None:
    """Module and functions come back as themselves, and in another process as the same of the cache."""
    again, function = pickle.loads(pickle.dumps((module, module.forward_dynamics)))
    assert again is module
    assert function is module.forward_dynamics
    state = random_state(module, 9)
    arguments = (*state.of("qvuw"), module.p)
    (tmp_path / "work").write_bytes(pickle.dumps((module, module.bias, module.forward_dynamics, arguments)))
    code = """
import pickle, sys
module, bias, function, arguments = pickle.load(open(sys.argv[1], "rb"))
assert module.bias is bias
sys.stdout.write(function(*arguments).tobytes().hex())
"""
    printed = python("-c", code, str(tmp_path / "work"), env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert printed == module.forward_dynamics(*arguments).tobytes().hex()


@BOTH
def test_a_function_pickles_alone(backend: str, tmp_path: Path) -> None:
    """Not as that of another model, which the reading process has loaded before."""
    scenes = [eomgen.chain(2, "rigid", hangs=hangs) for hangs in (False, True)]
    model, other = (eomgen.compile(scene, backend=backend, functions=["forward_dynamics"]) for scene in scenes)
    (tmp_path / "work").write_bytes(pickle.dumps(model.forward_dynamics))
    code = f"""
import importlib, pickle, sys
other = importlib.import_module({other.__name__!r})
function = pickle.load(open(sys.argv[1], "rb"))
assert function is not other.forward_dynamics
sys.stdout.write(function([1.0, 1.0], [0.0, 0.0], [0.0, 0.0], other.p).tobytes().hex())
"""
    printed = python("-c", code, str(tmp_path / "work"), env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert printed == model.forward_dynamics([1.0, 1.0], [0.0, 0.0], [0.0, 0.0], model.p).tobytes().hex()


@pytest.mark.skipif(not hasattr(np.add, "__dict__"), reason="ufuncs of this NumPy do not know their module")
def test_pickling_a_function_builds_none() -> None:
    """Other models are not asked for a function of its name, which they would compile."""
    without, model = (eomgen.compile(eomgen.chain(1), method, functions=[name]) for method, name in
                      (("matrix", "energy"), ("lagrange", "jacobian")))  # fmt: skip
    assert pickle.loads(pickle.dumps(model.jacobian)) is model.jacobian
    assert "jacobian" not in vars(without)


def test_threads(module: ModuleType) -> None:
    """Many calls at a time, of one state and of many, each right."""
    batches = [random_state(module, seed, (size,)) for seed, size in enumerate([1, 400, 3, 1000, 17, 64] * 4)]
    names = ["forward_dynamics", "mass_matrix", "energy"]
    expected_ = [[call(module, name, batch).tobytes() for name in names] for batch in batches]

    def work(batch: State) -> list[bytes]:
        return [call(module, name, batch).tobytes() for name in names]

    with ThreadPoolExecutor(6) as pool:
        assert list(pool.map(work, batches)) == expected_


@BOTH
@pytest.mark.parametrize("fold", [False, True])
def test_what_was_not_built(backend: str, fold: bool) -> None:
    """It says so and what to do; what there cannot be is unknown."""
    names = ["forward_dynamics"]
    module = eomgen.compile(CASES["rigid_2"], backend=backend, functions=names, fold=fold)
    for name in ("inverse_dynamics", "mass_matrix", "bias", "energy", "joints"):
        text = message_of(AttributeError, getattr, module, name)
        assert text == f"{name} was not built into {module.__name__!r}; compile with functions=[..., {name!r}]"
    assert "compile with functions=[..., 'mass_matrix']" in message_of(AttributeError, getattr, module, "condition")
    unknown = ["prescribed_forces", "energie", "w", *(["parameter_jacobian"] if fold else [])]
    for name in unknown:  # nothing is prescribed; a folded module has no parameters
        text = message_of(AttributeError, getattr, module, name)
        assert text == f"module {module.__name__!r} has no attribute {name!r}"
    walker = eomgen.compile(eomgen.walker(), backend="numpy", functions=["energy"])
    assert "functions=[..., 'prescribed_forces']" in message_of(AttributeError, getattr, walker, "prescribed_forces")
    assert "functions=[..., 'forward_dynamics']" in message_of(AttributeError, getattr, walker, "rollout")


def test_what_was_not_built_of_a_system() -> None:
    """There is no scene to build derivatives of when they are asked for."""
    module = eomgen.compile(lagrangian(), backend="numpy", functions=["energy"])
    for name in ("forward_dynamics", "jacobian", "parameter_jacobian"):
        assert f"compile with functions=[..., '{name}']" in message_of(AttributeError, getattr, module, name)
    for name in ("joints", "regressor", "b", "prescribed_forces"):
        assert "has no attribute" in message_of(AttributeError, getattr, module, name)


@BOTH
def test_package_on_its_own(backend: str, tmp_path: Path) -> None:
    """A written package imports with NumPy alone: where eomgen cannot be imported, with nothing else on the path."""
    path = sys.path.copy()
    name = f"alone_{backend}"
    module = eomgen.compile(
        CASES["rigid_2"], backend=backend, out=tmp_path / name, functions=["forward_dynamics", "energy"]
    )
    assert (module.__name__, sys.path) == (name, path)
    state = random_state(module, 1, (3,))
    code = f"""
import json, sys
sys.modules["eomgen"] = None  # "import eomgen" fails
sys.path.insert(0, {str(tmp_path)!r})
import {name} as leg, numpy
try:
    leg.bias
except AttributeError as error:
    assert str(error) == "bias was not built into '{name}'; compile with functions=[..., 'bias']", error
q, v, u = map(numpy.array, json.loads(sys.argv[1]))
foreign = [m for m in sys.modules if m.split(".")[0] in ("eomgen", "msgspec", "Cython", "sympy", "mpmath")]
assert foreign == ["eomgen"], foreign
print(json.dumps([leg.forward_dynamics(q, v, u, leg.p).tolist(), leg.energy(q, v, leg.p).tolist()]))
"""
    text = json.dumps([x.tolist() for x in (state.q, state.v, state.u)])
    a, energy = json.loads(python("-I", "-c", code, text, cwd="/"))
    assert np.array(a).tobytes() == call(module, "forward_dynamics", state).tobytes()
    assert np.array(energy).tobytes() == call(module, "energy", state).tobytes()
