"""The NumPy back end on arrays of other libraries, and in blocks: the same functions."""

import tracemalloc
from collections.abc import Callable, Iterator
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import eomgen
from bench.cases import CASES, State, random_state
from eomgen.functions import FUNCTIONS
from tests.conftest import Compiled

BINARY = ("add", "sub", "mul", "truediv", "pow", "lt", "le", "gt", "ge", "eq", "ne")
UFUNCS = ("abs", "sin", "cos", "sqrt", "exp", "log")


class Array:
    """An array with what the Python array API demands and nothing else; it wraps one of NumPy."""

    def __init__(self, numbers: Any) -> None:
        self._numbers = np.asarray(numbers)
        self.dtype, self.ndim, self.shape = self._numbers.dtype, self._numbers.ndim, self._numbers.shape
        self.device = "cpu"

    def __array_namespace__(self, api_version: str | None = None) -> ModuleType:
        return NAMESPACE

    def __getitem__(self, key: Any) -> "Array":
        return Array(self._numbers[key])

    def __neg__(self) -> "Array":
        return Array(-self._numbers)

    def __float__(self) -> float:
        return float(self._numbers)


def _operator(name: str) -> Callable[[Array, Any], Array]:
    def apply(self: Array, other: Any) -> Array:
        if isinstance(other, Array):
            if (self.dtype.kind == "f") != (other.dtype.kind == "f") and "b" not in self.dtype.kind + other.dtype.kind:
                raise TypeError("the array API does not mix integers and floats")
            other = other._numbers
        elif not isinstance(other, (int, float)):
            return NotImplemented
        return Array(getattr(self._numbers, name)(other))

    return apply


for _name in BINARY:
    setattr(Array, f"__{_name}__", _operator(f"__{_name}__"))
    if _name in BINARY[:5]:
        setattr(Array, f"__r{_name}__", _operator(f"__r{_name}__"))


def _namespace() -> ModuleType:
    """The functions of such arrays, with the signatures of the standard."""

    def asarray(obj: Any, /, *, dtype: Any = None, device: Any = None, copy: Any = None) -> Array:
        return Array(np.array(obj._numbers if isinstance(obj, Array) else obj, dtype=dtype))

    def where(condition: Array, x1: Any, x2: Any, /) -> Array:
        return Array(np.where(condition._numbers, *(x._numbers if isinstance(x, Array) else x for x in (x1, x2))))

    def stack(arrays: Any, /, *, axis: int = 0) -> Array:
        return Array(np.stack([array._numbers for array in arrays], axis))

    def reshape(x: Array, /, shape: tuple[int, ...], *, copy: bool | None = None) -> Array:
        return Array(np.reshape(x._numbers, shape))

    def broadcast_to(x: Array, /, shape: tuple[int, ...]) -> Array:
        return Array(np.broadcast_to(x._numbers, shape))

    def ones_like(x: Array, /, *, dtype: Any = None, device: Any = None) -> Array:
        return Array(np.ones_like(x._numbers, dtype=dtype))

    def finfo(type_: Any, /) -> Any:
        kind = np.finfo(type_)
        return SimpleNamespace(eps=float(kind.eps), smallest_normal=float(kind.smallest_normal))

    def ufunc(name: str) -> Callable[[Array], Array]:
        def apply(x: Array, /) -> Array:
            if not isinstance(x, Array) or x.dtype.kind != "f":
                raise TypeError(f"{name} takes arrays of floats")
            return Array(getattr(np, name)(x._numbers))

        return apply

    made = ModuleType("plain_array_api")
    for function in (asarray, where, stack, reshape, broadcast_to, ones_like, finfo):
        setattr(made, function.__name__, function)
    for name in UFUNCS:
        setattr(made, name, ufunc(name))
    made.float32, made.float64, made.int64 = np.dtype("f4"), np.dtype("f8"), np.dtype("i8")  # type: ignore[attr-defined]
    return made


NAMESPACE = _namespace()


class Library(SimpleNamespace):
    """A library: `make` turns an array of NumPy into one of its own, `back` does the reverse, `kind` is its class."""

    make: Callable[[Any], Any]
    back: Callable[[Any], np.ndarray]
    kind: type


@pytest.fixture(params=["plain", "array_api_strict", "jax", "torch"])
def library(request: pytest.FixtureRequest) -> Iterator[Library]:
    """Each library that is installed; the first one always is."""
    name = request.param
    if name == "plain":
        yield Library(make=Array, back=lambda x: x._numbers, kind=Array)
    elif name == "array_api_strict":
        strict = pytest.importorskip(name, reason="the strict array API is not installed")
        yield Library(make=strict.asarray, back=np.asarray, kind=type(strict.zeros(1)))
    elif name == "jax":
        jax = pytest.importorskip(name, reason="JAX is not installed")
        before = jax.config.jax_enable_x64
        jax.config.update("jax_enable_x64", True)
        yield Library(make=jax.numpy.asarray, back=np.asarray, kind=jax.Array)
        jax.config.update("jax_enable_x64", before)
    else:
        torch = pytest.importorskip(name, reason="PyTorch is not installed")
        yield Library(make=lambda x: torch.asarray(np.array(x)), back=lambda x: x.numpy(), kind=torch.Tensor)


@pytest.fixture
def jax() -> Iterator[ModuleType]:
    """JAX in double precision."""
    module = pytest.importorskip("jax", reason="JAX is not installed")
    before = module.config.jax_enable_x64
    module.config.update("jax_enable_x64", True)
    yield module
    module.config.update("jax_enable_x64", before)


FORMS = [
    ("walker_rods_prescribed", "matrix", {}),
    ("springs", "articulated", {"loops": True}),
    ("point_masses_3", "articulated", {"loops": False}),
    ("joint_springs", "lagrange", {"fold": True}),
]


@pytest.fixture
def walker(compiled: Compiled) -> ModuleType:
    """The module where the arrays are what matters."""
    return compiled("walker_rods_prescribed", "matrix")


def arguments(module: ModuleType, name: str, states: State) -> list[np.ndarray]:
    """The arguments of a function, p included where it has one."""
    return [*states.of(FUNCTIONS[name].arguments), *([module.p] if FUNCTIONS[name].parameters else [])]


def assert_close(found: np.ndarray, expected: np.ndarray, rtol: float = 1e-10) -> None:
    """Equal but for the rounding of another library's sines, which elimination multiplies."""
    assert found.shape == expected.shape
    assert found.dtype == expected.dtype
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=rtol * np.abs(expected).max(initial=0))


# Any library


@pytest.mark.parametrize("batch", [(), (1,), (7,), (2, 3)], ids=str)
@pytest.mark.parametrize(("case", "method", "options"), FORMS, ids=[form[0] for form in FORMS])
def test_every_function(
    case: str, method: str, options: dict[str, bool], batch: tuple[int, ...], library: Library, compiled: Compiled
) -> None:
    module = compiled(case, method, **options)
    states = random_state(module, 3, batch)
    for name in (name for name in FUNCTIONS if name in module.__all__):
        given = arguments(module, name, states)
        found = getattr(module, name)(*map(library.make, given))
        assert isinstance(found, library.kind)
        assert_close(library.back(found), getattr(module, name)(*given))


def test_angles_of_mixed_size(library: Library, compiled: Compiled) -> None:
    """The recursion's differences of angles keep what rounding them loses; in JAX when compiled, too."""
    module = compiled("rigid_3", "articulated")
    state = random_state(module, 3, (4,))
    q = np.array([[0.7, 1e15, -0.3], [1e15, 0.7, 3e-8], [0.7, 1e6, 20.0], [0.3, -0.2, 3.0]])
    reduced = np.arctan2(np.sin(q), np.cos(q))
    expected = module.forward_dynamics(reduced, state.v, state.u, module.p)
    given = [library.make(x) for x in (q, state.v, state.u, module.p)]
    calls = [module.forward_dynamics]
    if library.kind.__module__.startswith("jax"):
        calls.append(pytest.importorskip("jax").jit(module.forward_dynamics))
    for call in calls:
        assert_close(library.back(call(*given)), expected, rtol=1e-13)


def test_derivatives(library: Library, compiled: Compiled) -> None:
    names = ("jacobian", "parameter_jacobian", "regressor")
    module = compiled("telescopic_4_mixed", "matrix", functions=names)
    states = random_state(module, 3, (4,))
    for name in names:
        given = arguments(module, name, states)
        assert_close(library.back(getattr(module, name)(*map(library.make, given))), getattr(module, name)(*given))


def test_parameters_of_the_module(library: Library, walker: ModuleType) -> None:
    """`p` of a module is an array of NumPy, and read-only; it goes with any other."""
    states = random_state(walker, 1, (3,))
    q, v, u, w = states.of("qvuw")
    expected = walker.forward_dynamics(q, v, u, w, walker.p)
    found = walker.forward_dynamics(library.make(q), library.make(v), library.make(u), library.make(w), walker.p)
    assert isinstance(found, library.kind)
    assert_close(library.back(found), expected)
    assert not walker.p.flags.writeable


@pytest.mark.parametrize("position", range(5))
def test_one_array_of_another_library(position: int, library: Library, walker: ModuleType) -> None:
    """One is enough; lists and arrays of NumPy join it."""
    given = arguments(walker, "forward_dynamics", random_state(walker, 1, (3,)))
    expected = walker.forward_dynamics(*given)
    mixed = [library.make(x) if k == position else x.copy() if k % 2 else x.tolist() for k, x in enumerate(given)]
    found = walker.forward_dynamics(*mixed)
    assert isinstance(found, library.kind)
    assert_close(library.back(found), expected)


def test_integers_do_not_truncate_others(library: Library, walker: ModuleType) -> None:
    """Whole numbers of another library are coordinates like any other, or are refused; nothing loses its fractions."""
    q, (_, v, _, _, w) = np.arange(5), random_state(walker, 2)
    expected = walker.energy(q.astype(float), v, w, walker.p)
    make = library.make
    for others in ((v, w, walker.p.copy()), (make(v), make(w), make(walker.p))):
        try:
            found = library.back(walker.energy(make(q), *others))
        except TypeError:
            continue
        assert_close(found, expected)


def test_single_precision(library: Library, compiled: Compiled) -> None:
    """The result has the type of the arguments."""
    module = compiled("rigid_3", "matrix", dtypes=("float32", "float64"))
    given = [x.astype("float32") for x in arguments(module, "forward_dynamics", random_state(module, 1, (5,)))]
    found = library.back(module.forward_dynamics(*map(library.make, given)))
    assert found.dtype == np.float32
    assert_close(found, module.forward_dynamics(*given), rtol=2e-5)


def test_broadcasting(library: Library, walker: ModuleType) -> None:
    q, v, u, w = random_state(walker, 1, (4, 1)).of("qvuw")
    p = walker.p * np.linspace(0.9, 1.1, 3)[:, None]
    given = (q, v[0], u[0, 0], w, p)
    found = library.back(walker.forward_dynamics(*map(library.make, given)))
    assert_close(found, walker.forward_dynamics(*given))


@pytest.mark.parametrize("shape", [(0,), (2, 0)], ids=str)
def test_no_states(shape: tuple[int, ...], library: Library, walker: ModuleType) -> None:
    for name in ("forward_dynamics", "mass_matrix"):
        given = arguments(walker, name, random_state(walker, 1, shape))
        found = library.back(getattr(walker, name)(*map(library.make, given)))
        assert found.shape == getattr(walker, name)(*given).shape


def test_wrong_shapes(library: Library, walker: ModuleType) -> None:
    """Refused in the words that NumPy's arrays are refused in."""
    q, v, u, w = random_state(walker, 1).of("qvuw")
    for wrong in (
        (q[:-1], v, u, w),
        (q, v, u, w[:, :2]),
        (q[0], v, u, w),
        (q[None].repeat(2, 0), v[None].repeat(3, 0), u, w),
    ):
        messages = []
        for make in (np.asarray, library.make):
            with pytest.raises(ValueError, match=r"forward_dynamics|broadcast") as caught:
                walker.forward_dynamics(*(make(np.asarray(x)) for x in (*wrong, walker.p)))
            messages.append(str(caught.value))
        assert messages[0] == messages[1]


def test_out_is_refused(library: Library, walker: ModuleType) -> None:
    """A new array is returned; out= is for NumPy's own."""
    given = arguments(walker, "forward_dynamics", random_state(walker, 1))
    others = [*map(library.make, given)]
    with pytest.raises(TypeError, match=r"^out= is for NumPy arrays$"):
        walker.forward_dynamics(*others, out=np.empty(5))
    with pytest.raises(TypeError, match=r"^out= is for NumPy arrays$"):
        walker.forward_dynamics(*others, out=others[0])
    with pytest.raises(TypeError, match="takes 5 positional arguments but 6 were given"):
        walker.forward_dynamics(*others, others[0])
    with pytest.raises(TypeError, match="return arrays must be of ArrayType"):
        walker.forward_dynamics(*given, out=others[0])
    with pytest.raises(TypeError, match="positional arguments but 4 were given"):
        walker.forward_dynamics(*others[:4])


@pytest.mark.filterwarnings("ignore:invalid value encountered")  # NumPy's, beneath some of the libraries
def test_singular_state(library: Library, compiled: Compiled) -> None:
    """NaN in the state that is lost, and nowhere else."""
    module = compiled("point_masses_2", "matrix")
    states = random_state(module, 5, (9,))
    states.q[4, 2] = 0.0
    given = arguments(module, "forward_dynamics", states)
    found = library.back(module.forward_dynamics(*map(library.make, given)))
    assert np.isnan(found[4]).any()
    assert np.isfinite(np.delete(found, 4, axis=0)).all()


# What a library does with functions


def test_jax_jit(jax: ModuleType, walker: ModuleType) -> None:
    """Traced once, compiled by XLA."""
    for name in ("forward_dynamics", "mass_matrix", "energy"):
        given = arguments(walker, name, random_state(walker, 3, (6,)))
        assert_close(np.asarray(jax.jit(getattr(walker, name))(*given)), getattr(walker, name)(*given), rtol=1e-9)


def test_jax_jit_of_loops(jax: ModuleType, compiled: Compiled) -> None:
    module = compiled("springs", "articulated", loops=True)
    given = arguments(module, "forward_dynamics", random_state(module, 3, (6,)))
    assert_close(np.asarray(jax.jit(module.forward_dynamics)(*given)), module.forward_dynamics(*given), rtol=1e-9)


def test_jax_grad_of_the_energy(jax: ModuleType, compiled: Compiled) -> None:
    """∂T/∂v is M v, and with everything at rest ∂V/∂q is the bias."""
    module = compiled("telescopic_3", "matrix")
    q, v, *_ = random_state(module, 4)

    def kinetic(v: Any) -> Any:
        return module.energy(jax.numpy.asarray(q), v, module.p)[0]

    def potential(q: Any) -> Any:
        return module.energy(q, jax.numpy.zeros(6), module.p)[1]

    momentum = np.asarray(jax.grad(kinetic)(jax.numpy.asarray(v)))
    np.testing.assert_allclose(momentum, module.mass_matrix(q, module.p) @ v, rtol=1e-11)
    weight = np.asarray(jax.jit(jax.grad(potential))(jax.numpy.asarray(q)))
    np.testing.assert_allclose(weight, module.bias(q, 0 * v, module.p), rtol=1e-11, atol=1e-12)


def test_jax_differentiates_forward_dynamics(jax: ModuleType, compiled: Compiled) -> None:
    """Its Jacobian is the one that is emitted, also mapped over states."""
    module = compiled("springs", "matrix", functions=("forward_dynamics", "jacobian"))
    q, v, u, w = random_state(module, 4, (3,)).of("qvuw")
    mapped = jax.vmap(jax.jacfwd(module.forward_dynamics, argnums=(0, 1, 2)), in_axes=(0, 0, 0, 0, None))
    found = np.concatenate([np.asarray(x) for x in mapped(q, v, u, w, module.p)], axis=-1)
    assert_close(found, module.jacobian(q, v, u, w, module.p), rtol=1e-9)


def test_torch_differentiates(compiled: Compiled) -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    module = compiled("telescopic_3", "matrix")
    q, v, *_ = random_state(module, 4, (5,))
    rates = torch.tensor(v, requires_grad=True)
    module.energy(torch.tensor(q), rates, torch.tensor(module.p))[:, 0].sum().backward()
    momentum = np.einsum("sij,sj->si", module.mass_matrix(q, module.p), v)
    np.testing.assert_allclose(rates.grad.numpy(), momentum, rtol=1e-11)


def test_torch_maps_and_differentiates_forward_dynamics(compiled: Compiled) -> None:
    """Operands that are written over are none that derivatives need, nor smaller than the result under `vmap`."""
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    module = compiled("springs", "matrix", functions=("forward_dynamics", "jacobian"))
    q, v, u, w = random_state(module, 4, (3,)).of("qvuw")
    tensors = [torch.tensor(x) for x in (q, v, u, w, module.p)]
    slopes = torch.func.jacrev(module.forward_dynamics, argnums=(0, 1, 2))
    mapped = torch.func.vmap(slopes, in_dims=(0, 0, 0, 0, None))
    found = np.concatenate([x.numpy() for x in mapped(*tensors)], axis=-1)
    assert_close(found, module.jacobian(q, v, u, w, module.p), rtol=1e-9)
    several = [*tensors[:4], torch.stack([tensors[4], 2 * tensors[4]])]
    for i in range(5):
        given = [*(x[0] for x in tensors[:4]), tensors[4]]
        given[i] = several[i]
        found = torch.func.vmap(module.forward_dynamics, in_dims=tuple(0 if j == i else None for j in range(5)))(*given)
        assert_close(found.numpy(), module.forward_dynamics(*[x.numpy() for x in given]), rtol=1e-12)


def test_torch_without_data(walker: ModuleType) -> None:
    """Tensors without data pass through: nothing is read as an array of NumPy."""
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    given = arguments(walker, "forward_dynamics", random_state(walker, 4, (5,)))
    found = walker.forward_dynamics(*(torch.empty(x.shape, dtype=torch.float64, device="meta") for x in given))
    assert (found.shape, found.device.type, found.dtype) == ((5, 5), "meta", torch.float64)


# Blocks


def in_blocks(module: ModuleType, name: str, block: int, given: list[np.ndarray]) -> np.ndarray:
    """A function evaluated in blocks of so many states."""
    function = getattr(module, name)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(function, "_block", block)
        return np.asarray(function(*given))


SHAPES = [
    [(300,), (300,), (300,), (300,), ()],
    [(300,), (), (), (), (300,)],
    [(300,), (300,), (1,), (), (1,)],
    [(20, 15), (20, 15), (20, 15), (20, 15), ()],
    [(20, 1), (1, 15), (15,), (), (20, 1)],
    [(3, 4, 25), (4, 25), (25,), (3, 1, 1), (4, 1)],
]


@pytest.mark.parametrize("shapes", SHAPES, ids=str)
@pytest.mark.parametrize("block", [1, 7, 64, 100, 299])
def test_blocks_are_the_whole(block: int, shapes: list[tuple[int, ...]], walker: ModuleType) -> None:
    """Wherever the blocks are cut, along whichever axes, with parameters per state or for all."""
    numbers = np.random.default_rng(1)
    cores = [(5,), (5,), (5,), (5, 3), (walker.p.size,)]
    given = [numbers.uniform(0.5, 1.5, (*shape, *core)) for shape, core in zip(shapes, cores, strict=True)]
    whole = in_blocks(walker, "forward_dynamics", 1000, given)
    assert whole.shape == (*np.broadcast_shapes(*shapes), 5)
    assert_close(in_blocks(walker, "forward_dynamics", block, given), whole)


@pytest.mark.parametrize("name", ["forward_dynamics", "mass_matrix", "energy", "joints"])
def test_several_blocks_of_the_usual_size(name: str, walker: ModuleType) -> None:
    function = getattr(walker, name)
    count = 3 * function._block + 17
    states = random_state(walker, 1, (count,))
    given = arguments(walker, name, states)
    found = function(*given)
    for first in range(0, count, 1000):
        part = [x if x is walker.p else x[first : first + 1000] for x in given]
        assert_close(found[first : first + 1000], function(*part))
    out = np.empty_like(found)
    assert function(*given, out=out) is out
    assert out.tobytes() == found.tobytes()


def test_out_that_overlaps_over_blocks(walker: ModuleType) -> None:
    """A block's result may lie where a later block's argument is read."""
    states = random_state(walker, 1, (500,))
    given = arguments(walker, "forward_dynamics", states)
    expected = in_blocks(walker, "forward_dynamics", 64, given)
    for shift in (-30, -1, 0, 1, 30):
        memory = np.zeros((560, 5))
        argument, out = memory[30:530], memory[30 + shift : 530 + shift]
        argument[:] = states.q
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(walker.forward_dynamics, "_block", 64)
            walker.forward_dynamics(argument, *given[1:], out=out)
        assert out.tobytes() == expected.tobytes(), shift


def test_temporaries_are_of_a_block() -> None:
    """What is allocated beside the result does not grow with the batch."""
    module = eomgen.compile(CASES["rigid_5"], backend="numpy", functions=["forward_dynamics"])
    peaks = []
    for count in (20_000, 80_000):
        states = random_state(module, 1, (count,))
        out = np.empty((count, 5))
        given = arguments(module, "forward_dynamics", states)
        module.forward_dynamics(*given, out=out)
        tracemalloc.start()
        module.forward_dynamics(*given, out=out)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 2**16
    assert peaks[1] < 2**24
