"""Batches of the C back end: whatever the arrays look like, every state has the bits of a call of its own."""

import itertools
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.lib.stride_tricks import as_strided, sliding_window_view

import eomgen
from bench.cases import State, line, random_state, tree
from eomgen.backends import BACKENDS
from eomgen.functions import FUNCTIONS
from tests.conftest import Compiled

Change = Callable[[np.ndarray], np.ndarray]
MOST = 40  # states: more than two streams of the widest lanes of doubles
SIZES = range(1, MOST + 1)
LINKS = range(1, 12)  # from shorter to longer than a vector, and than rows have code for their number
NAMES = ("forward_dynamics", "mass_matrix", "energy")


def flags() -> set[str]:
    """What the processor offers, as far as Linux tells."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return set()
    return {word for row in text.splitlines() if row.startswith("flags") for word in row.split()}


BUILDS = {
    "native": ("", False),
    "portable": ("", True),
    "avx2": ("-mavx2 -mfma", True),
}


@pytest.fixture(scope="session")
def build(compiled: Compiled) -> Callable[..., ModuleType]:
    """Chains of rigid links of any number, built for this processor, for any, or for vectors of four doubles."""

    def get(links: int, kind: str = "native") -> ModuleType:
        options, portable = BUILDS[kind]
        if options and not {"avx2", "fma"} <= flags():
            pytest.skip("this processor has no AVX2")
        with pytest.MonkeyPatch.context() as patch:
            if options:
                patch.setenv("CC", f"cc {options}")
            scene = tree(f"chain{links}", line(links), "rigid")
            key = (links, kind)
            if key not in made:
                made[key] = eomgen.compile(scene, "matrix", "c", functions=NAMES, portable=portable)
        return made[key]

    made: dict[tuple[int, str], ModuleType] = {}
    return get


def call(module: ModuleType, name: str, states: State, **keywords: np.ndarray) -> np.ndarray:
    """A function of a module by name at some states."""
    return np.asarray(getattr(module, name)(*states.of(FUNCTIONS[name].arguments), module.p, **keywords))


def singles(module: ModuleType, name: str, states: State) -> np.ndarray:
    """The function state by state."""
    return np.stack([call(module, name, State(*(x[k] for x in states))) for k in range(len(states.q))])


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether all bits agree."""
    return a.shape == b.shape and a.tobytes() == b.tobytes()


# Layouts


def spread(axis: int, step: int) -> Change:
    """Elements `step` places apart, with others between."""

    def change(x: np.ndarray) -> np.ndarray:
        wide = np.repeat(x, abs(step), axis=axis)
        wide = wide if step > 0 else np.flip(wide, axis).copy()
        return wide[(slice(None),) * axis + (slice(None, None, step),)]

    return change


def padded(x: np.ndarray) -> np.ndarray:
    """Rows with other numbers between them."""
    wide = np.full((len(x), *(size + 3 for size in x.shape[1:])), np.nan, x.dtype)
    inner = wide[(slice(None), *(slice(1, 1 + size) for size in x.shape[1:]))]
    inner[:] = x
    return inner


def unaligned(x: np.ndarray) -> np.ndarray:
    """Records of an odd number of bytes."""
    records = np.zeros(len(x), [("flag", "i1"), ("x", x.dtype, x.shape[1:])])
    records["x"] = x
    return records["x"]


LAYOUTS: dict[str, Change] = {
    "rows": lambda x: x,
    "by columns": np.asfortranarray,
    "by columns, every second": lambda x: np.asfortranarray(np.repeat(x, 2, axis=0))[::2],
    "every second state": spread(0, 2),
    "every third element": spread(1, 3),
    "states backwards": spread(0, -1),
    "every second state backwards": spread(0, -2),
    "elements backwards": spread(1, -1),
    "columns backwards": lambda x: np.asfortranarray(x[::-1])[::-1],
    "padded rows": padded,
    "read-only": lambda x: np.frombuffer(x.tobytes(), x.dtype).reshape(x.shape),
    "unaligned": unaligned,
    "swapped bytes": lambda x: x.astype(x.dtype.newbyteorder()),
}


@pytest.mark.parametrize("links", LINKS)
@pytest.mark.parametrize("name", NAMES)
def test_every_number_of_states(name: str, links: int, build: Callable[..., ModuleType]) -> None:
    """All remainders of lanes and streams, in rows and by columns."""
    module = build(links)
    states = random_state(module, links, (MOST,))
    alone = singles(module, name, states)
    for size, change in itertools.product(SIZES, (np.ascontiguousarray, np.asfortranarray)):
        assert same(call(module, name, State(*(change(x[:size]) for x in states))), alone[:size]), size


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("links", LINKS)
def test_layouts(links: int, layout: str, build: Callable[..., ModuleType]) -> None:
    module, change = build(links), LAYOUTS[layout]
    states = random_state(module, links, (37,))
    for name in NAMES:
        expected = singles(module, name, states)
        changed = State(*(change(x) if x.size else x for x in states))
        assert all(np.array_equal(a, b) for a, b in zip(changed, states, strict=True))
        assert same(call(module, name, changed), expected), name
        one = State(*(x[3] for x in states))
        assert same(call(module, name, one), expected[3]), name


@pytest.mark.parametrize(
    "case",
    [*itertools.product((2, 5, 8, 10, 11), ("native",)), *itertools.product((5, 10), ("avx2", "portable")), None],
)
def test_each_argument_in_a_layout_of_its_own(
    case: tuple[int, str] | None, build: Callable[..., ModuleType], compiled: Compiled
) -> None:
    """Rows, rows with gaps and what is no row side by side; with lengths over time there is a fourth array."""
    driven = "point_masses_4_mixed"
    module = build(*case) if case else compiled(driven, "matrix", "c", functions=("forward_dynamics",))
    states = random_state(module, 7, (37,))
    expected = singles(module, "forward_dynamics", states)
    for layouts in itertools.product(("rows", "by columns", "padded rows", "every second state"), repeat=4):
        arguments = {
            letter: LAYOUTS[layout](getattr(states, letter)) for letter, layout in zip("qvu", layouts[:3], strict=True)
        }
        out = LAYOUTS[layouts[3]](np.full(expected.shape, -7.0))
        call(module, "forward_dynamics", states._replace(**arguments), out=out)
        assert same(np.ascontiguousarray(out), expected), layouts


@pytest.mark.parametrize("layout", [layout for layout in LAYOUTS if layout != "read-only"])
@pytest.mark.parametrize("links", [1, 3, 4, 8, 9])
def test_layouts_of_the_result(links: int, layout: str, build: Callable[..., ModuleType]) -> None:
    """`out` may be laid out in any way; what lies between its elements is left alone."""
    module = build(links)
    states = random_state(module, links, (37,))
    for name in NAMES:
        expected = call(module, name, states)
        out = LAYOUTS[layout](np.full(expected.shape, -7.0))
        base = out if out.base is None else out.base
        before = np.array(base, copy=True) if isinstance(base, np.ndarray) else None
        assert getattr(module, name)(*states.of(FUNCTIONS[name].arguments), module.p, out=out) is out
        assert same(np.asarray(out, "f8"), expected), name
        if before is not None and layout in ("padded rows", "every second state", "every third element"):
            out[...] = -7.0
            assert np.array_equal(base, before, equal_nan=True), name


@pytest.mark.parametrize("links", LINKS)
def test_one_value_for_all_states(links: int, build: Callable[..., ModuleType]) -> None:
    """An argument without states, or with a step of zero between them."""
    module = build(links)
    states = random_state(module, links, (29,))
    for letters in ("q", "v", "u", "qv", "vu", "qvu"):
        once = {letter: getattr(states, letter)[5] for letter in letters}
        full = states._replace(**{letter: np.repeat(x[None], 29, 0) for letter, x in once.items()})
        zero = states._replace(**{letter: np.broadcast_to(x, (29, links)) for letter, x in once.items()})
        expected = singles(module, "forward_dynamics", full)
        found = call(module, "forward_dynamics", states._replace(**once))
        assert same(np.broadcast_to(found, expected.shape), expected), letters
        assert same(call(module, "forward_dynamics", zero), expected), letters


@pytest.mark.parametrize("links", LINKS)
@pytest.mark.parametrize("step", [1, 2, 5])
def test_states_that_overlap(step: int, links: int, build: Callable[..., ModuleType]) -> None:
    """Windows into one line of numbers: rows of neighbours share elements."""
    module = build(links)
    states = random_state(module, links, (33,))
    windows = sliding_window_view(np.random.default_rng(links).uniform(-3, 3, 33 * step + links), links)[::step][:33]
    for letter in "qvu":
        changed = states._replace(**{letter: windows})
        expected = singles(module, "forward_dynamics", states._replace(**{letter: windows.copy()}))
        assert same(call(module, "forward_dynamics", changed), expected), letter


@pytest.mark.parametrize("shape", [(0,), (0, 3), (2, 0), (0, 0, 1)], ids=str)
@pytest.mark.parametrize("links", [1, 5, 9])
def test_no_states(links: int, shape: tuple[int, ...], build: Callable[..., ModuleType]) -> None:
    module = build(links)
    states = random_state(module, 1, shape)
    assert call(module, "forward_dynamics", states).shape == (*shape, links)
    assert call(module, "mass_matrix", states).shape == (*shape, links, links)


@pytest.mark.parametrize("links", [1, 2, 5, 8, 9])
def test_nothing_is_written_beside_the_result(links: int, build: Callable[..., ModuleType]) -> None:
    module = build(links)
    states = random_state(module, links, (MOST,))
    expected = call(module, "forward_dynamics", states)
    for size in SIZES:
        memory = np.full(size * links + 32, np.nan)
        out = memory[16 : 16 + size * links].reshape(size, links)
        call(module, "forward_dynamics", State(*(x[:size] for x in states)), out=out)
        assert same(out, expected[:size])
        assert np.isnan(memory[:16]).all()
        assert np.isnan(memory[16 + size * links :]).all()


@pytest.mark.parametrize("dtype", ["float64", "float32"])
@pytest.mark.parametrize("size", [16384, 16385, 16392])
def test_large_results_in_columns(size: int, dtype: str) -> None:
    """Many rows go past the cache in whole lines, wherever in one they begin; nothing beside them changes."""
    links, width = 16, 64 // np.dtype(dtype).itemsize
    module = eomgen.compile(
        eomgen.chain(links, "rigid"), "articulated", functions=["forward_dynamics"], dtypes=("float64", "float32")
    )
    states = random_state(module, 1, (size,))
    q, v, u, p = (x.astype(dtype) for x in (states.q, states.v, states.u, module.p))
    expected = module.forward_dynamics(q, v, u, p)
    columns = [np.asfortranarray(x) for x in (q, v, u)]
    for offset in (0, 1, 2, width - 1, width):
        memory = np.full(size * links + 3 * width, np.nan, dtype)
        start = -memory.ctypes.data % 64 // memory.itemsize + offset
        out = memory[start : start + size * links].reshape(links, size).T
        module.forward_dynamics(*columns, p, out=out)
        assert same(out, expected)
        assert np.isnan(memory[:start]).all()
        assert np.isnan(memory[start + size * links :]).all()
    columns[1] = out  # the result over an argument
    columns[1][...] = v
    module.forward_dynamics(*columns, p, out=columns[1])
    assert same(columns[1], expected)


GUARDED = """
import ctypes, importlib, mmap, sys
import numpy as np

sys.path.insert(0, sys.argv[1])
protect = ctypes.CDLL(None, use_errno=True).mprotect
protect.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
page = mmap.PAGESIZE
room, kept = 8 * page, []

def place(x, at_end):
    memory = mmap.mmap(-1, room + 2 * page)
    whole = np.frombuffer(memory, np.uint8)
    start = whole.ctypes.data
    assert protect(start, page, 0) == protect(start + page + room, page, 0) == 0
    kept.append(memory)
    at = page + room - x.nbytes if at_end else page
    inner = whole[at : at + x.nbytes].view(x.dtype).reshape(x.shape)
    inner[...] = x
    return inner

for name in sys.argv[2:]:
    module = importlib.import_module(name)
    n = len(module.q_names)
    x = np.random.default_rng(n).uniform(-1, 1, (40, n))
    expected = module.forward_dynamics(x, x, x, module.p)
    for at_end in (True, False):
        for size in range(1, 41):
            q, v, u, out, p = (place(y, at_end) for y in (x[:size], x[:size], x[:size], 0 * x[:size], module.p))
            module.forward_dynamics(q, v, u, p, out=out)
            assert out.tobytes() == expected[:size].tobytes()
            matrix = place(np.zeros((size, n, n)), at_end)
            module.mass_matrix(q, p, out=matrix)
            q, v, u, out = (place(np.ascontiguousarray(y[:size].T), at_end).T for y in (x, x, x, 0 * x))
            module.forward_dynamics(q, v, u, p, out=out)
            assert out.tobytes() == expected[:size].tobytes()
print("fine")
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="protects pages by Linux's own numbers")
@pytest.mark.parametrize("kind", BUILDS)
def test_nothing_is_read_or_written_beside_arrays(kind: str, build: Callable[..., ModuleType]) -> None:
    """Arrays that begin or end at a page which must not be touched."""
    folders = [Path(str(build(links, kind).__file__)).parent for links in (1, 2, 3, 4, 5, 7)]
    command = [sys.executable, "-c", GUARDED, str(folders[0].parent), *(folder.name for folder in folders)]
    done = subprocess.run(command, text=True, capture_output=True, timeout=120, check=False)
    assert done.stdout == "fine\n", (done.returncode, done.stderr)


@pytest.mark.parametrize("links", LINKS)
def test_out_that_overlaps_an_argument(links: int, build: Callable[..., ModuleType]) -> None:
    """As if the arguments had been copied first."""
    module = build(links)
    for size, shift, letter in itertools.product((3, 16, 41), (0, 1, -1, 2, -links, links), "qvu"):
        states = random_state(module, size, (size,))
        expected = call(module, "forward_dynamics", states)
        memory = np.zeros(size * links + 2 * links + 4)
        start = links + 2
        argument = memory[start : start + size * links].reshape(size, links)
        out = memory[start + shift : start + shift + size * links].reshape(size, links)
        argument[:] = getattr(states, letter)
        call(module, "forward_dynamics", states._replace(**{letter: argument}), out=out)
        assert same(out, expected), (size, shift, letter)


@pytest.mark.parametrize("links", LINKS)
def test_batch_contiguous_out_that_overlaps_an_argument(links: int, build: Callable[..., ModuleType]) -> None:
    """The same where the elements of a coordinate are adjacent, which kernels read and write in place."""
    module = build(links)
    for size, shift, letter in itertools.product((3, 16, 41, 100), (0, 1, -1, 8, -16, 33), "qvu"):
        states = random_state(module, size, (size,))
        expected = call(module, "forward_dynamics", states)
        memory = np.zeros((links, size + 66))
        argument = memory[:, 33 : 33 + size].T
        out = memory[:, 33 + shift : 33 + shift + size].T
        argument[:] = getattr(states, letter)
        fortran = State(*(np.asfortranarray(x) for x in states))
        call(module, "forward_dynamics", fortran._replace(**{letter: argument}), out=out)
        assert same(np.ascontiguousarray(out), expected), (size, shift, letter)


@pytest.mark.parametrize("links", LINKS)
def test_pitch(links: int, build: Callable[..., ModuleType]) -> None:
    """Adjacent states whose coordinates are at any distance: reversed, all the same, no multiple of a number."""
    module = build(links)
    states = random_state(module, links, (41,))
    expected = call(module, "forward_dynamics", states)
    odd = np.zeros((links, 41 * 8 + 4), np.uint8)
    for letter in "qvu":
        x = getattr(states, letter)
        backwards = np.ascontiguousarray(x.T[::-1])[::-1].T
        assert same(call(module, "forward_dynamics", states._replace(**{letter: backwards})), expected)
        apart = np.ndarray((links, 41), np.float64, odd.data, 0, (41 * 8 + 4, 8)).T
        apart[:] = x
        assert same(call(module, "forward_dynamics", states._replace(**{letter: apart})), expected)
        equal = np.broadcast_to(np.ascontiguousarray(x[:, 0]), (links, 41)).T
        wanted = call(module, "forward_dynamics", states._replace(**{letter: np.ascontiguousarray(equal)}))
        assert same(call(module, "forward_dynamics", states._replace(**{letter: equal})), wanted)


@pytest.mark.parametrize("accuracy", ["standard", "high"])
@pytest.mark.parametrize("parents", [line(2), line(5), (-1, 0, 0, 0, 0), line(12)], ids=str)
def test_out_that_is_an_argument(parents: tuple[int, ...], accuracy: str) -> None:
    """The very array: all of a state is read before any of its result is written."""
    functions = {"forward_dynamics": "qvu", "inverse_dynamics": "qva", "bias": "qv"}
    scene = tree("in_place", parents, "rigid")
    module = eomgen.compile(scene, functions=functions, accuracy=accuracy)
    for shape, change in itertools.product([(), (3,), (64,)], (np.ascontiguousarray, np.asfortranarray)):
        states = State(*map(change, random_state(module, 3, shape)))
        for name, letters in functions.items():
            expected = call(module, name, states)
            for letter in letters:
                memory = getattr(states, letter).copy(order="K")
                call(module, name, states._replace(**{letter: memory}), out=memory)
                assert same(np.ascontiguousarray(memory), expected), (name, letter, shape)


def test_out_that_is_an_argument_backwards(build: Callable[..., ModuleType]) -> None:
    module = build(5)
    states = random_state(module, 3, (27,))
    expected = call(module, "forward_dynamics", states)
    for change in (lambda x: x[::-1], lambda x: x[:, ::-1], lambda x: x[::-1, ::-1]):
        memory = states.q.copy()
        call(module, "forward_dynamics", states._replace(q=memory), out=change(memory))
        assert same(np.ascontiguousarray(change(memory)), expected)


# Batches with several axes, parameters per state


@pytest.mark.parametrize("axes", list(itertools.permutations(range(3))), ids=str)
@pytest.mark.parametrize("links", [1, 4, 5, 8])
def test_three_axes(links: int, axes: tuple[int, ...], build: Callable[..., ModuleType]) -> None:
    module = build(links)
    states = random_state(module, links, (3, 4, 5))
    turned = State(*(np.ascontiguousarray(x.transpose(*axes, *range(3, x.ndim))) for x in states))
    back = np.argsort(axes)
    changed = State(*(x.transpose(*back, *range(3, x.ndim)) for x in turned))
    flat = State(*(x.reshape(60, *x.shape[3:]) for x in states))
    for name in NAMES:
        expected = singles(module, name, flat)
        for found in (call(module, name, states), call(module, name, changed)):
            assert found.shape[:3] == (3, 4, 5)
            assert same(found.reshape(expected.shape), expected), name


@pytest.mark.parametrize("shape", [(17,), (1,), (2, 1), (1, 3), (2, 3)], ids=str)
@pytest.mark.parametrize("links", [1, 5, 9])
def test_parameters_per_state(links: int, shape: tuple[int, ...], build: Callable[..., ModuleType]) -> None:
    """What depends on parameters is computed anew for each state, to the same bits."""
    module = build(links)
    batch = shape if len(shape) == 1 else (2, 3)
    states = random_state(module, links, batch)
    p = module.p * np.random.default_rng(0).uniform(0.9, 1.1, (*shape, module.p.size))
    for name, change in itertools.product(NAMES, (np.ascontiguousarray, np.asfortranarray)):
        function = getattr(module, name)
        arguments = states.of(FUNCTIONS[name].arguments)
        found = function(*arguments, change(p))
        full = np.broadcast_to(p, (*batch, module.p.size))
        for k in np.ndindex(*batch):
            assert same(found[k], function(*(x[k] for x in arguments), full[k])), name


def test_parameters_with_strides(build: Callable[..., ModuleType]) -> None:
    """One set of parameters that does not lie in a row."""
    module = build(5)
    states = random_state(module, 2, (21,))
    expected = call(module, "forward_dynamics", states)
    wide = np.repeat(module.p, 2)[::2]
    zero = as_strided(module.p, (21, module.p.size), (0, 8), writeable=False)
    swapped = module.p.astype(module.p.dtype.newbyteorder())
    for p in (wide, module.p[::-1].copy()[::-1], zero, swapped, module.p.tolist()):
        assert same(module.forward_dynamics(states.q, states.v, states.u, p), expected)


# Types and builds


@pytest.mark.parametrize("dtype", ["float32", "float64", "longdouble"])
@pytest.mark.parametrize("case", ["rigid_3", "walker_rods_prescribed"])
def test_types(case: str, dtype: str, compiled: Compiled) -> None:
    """Lanes of single precision are twice as many; long doubles have none."""
    types = ("float32", "float64", "longdouble")
    module = compiled(case, "matrix", "c", functions=("forward_dynamics", "joints"), dtypes=types)
    states = State(*(x.astype(dtype) for x in random_state(module, 7, (70,))))
    p = module.p.astype(dtype)
    for name in ("forward_dynamics", "joints"):
        arguments, function = states.of(FUNCTIONS[name].arguments), getattr(module, name)
        alone = np.stack([function(*(x[k] for x in arguments), p) for k in range(70)])
        assert alone.dtype == dtype
        for size, change in itertools.product([*range(1, 20), 31, 32, 33, 48, 63, 64, 65, 70], LAYOUTS):
            if size > 9 and size % 8 > 1 and size != 70:
                continue
            found = function(*(LAYOUTS[change](x[:size]) for x in arguments), p)
            # Bytes of a long double that hold nothing are not compared.
            assert np.array_equal(found, alone[:size]), (size, change)
        own = np.tile(p, (19, 1))
        assert np.array_equal(function(*(x[:19] for x in arguments), own), alone[:19])


@pytest.mark.parametrize("kind", ["portable", "avx2"])
@pytest.mark.parametrize("links", [1, 2, 3, 4, 5, 7])
def test_other_builds(links: int, kind: str, build: Callable[..., ModuleType]) -> None:
    """Two or four lanes: the same to rounding, and to the bit within the build."""
    module, native = build(links, kind), build(links)
    assert module.info["flags"] != native.info["flags"]
    states = random_state(module, links, (MOST,))
    for name in NAMES:
        alone = singles(module, name, states)
        expected = call(native, name, states)
        np.testing.assert_allclose(alone, expected, rtol=1e-11, atol=1e-13 * np.abs(expected).max())
        for size in SIZES:
            assert same(call(module, name, State(*(x[:size] for x in states))), alone[:size]), size
        for change in LAYOUTS.values():
            assert same(call(module, name, State(*(change(x) if x.size else x for x in states))), alone), name


# Memory and threads

MEMORY = """
import importlib, os, resource, sys
import numpy as np

sys.path.insert(0, sys.argv[1])
module, layout, states = importlib.import_module(sys.argv[2]), sys.argv[3], int(sys.argv[4])
n = len(module.q_names)
shape = (states, n)
def make(seed):
    x = np.random.default_rng(seed).uniform(-1, 1, (n, states) if layout == "columns" else shape)
    return x.T if layout == "columns" else x
q, v, u = map(make, range(3))
if layout == "axes":
    q, v, u = (x.reshape(100, -1, n) for x in (q, v, u))
out = np.ones(q.shape)
module.forward_dynamics(q[:1], v[:1], u[:1], module.p)
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
before = peak()
module.forward_dynamics(q, v, u, module.p, out=out)
given = peak()
result = module.forward_dynamics(q, v, u, module.p)
print((given - before) / 2**20, (peak() - before - result.nbytes) / 2**20)
"""


@pytest.mark.parametrize("layout", ["rows", "columns", "axes"])
@pytest.mark.parametrize("backend", BACKENDS)
def test_memory(backend: str, layout: str, compiled: Compiled) -> None:
    """A million states need their arrays and little more."""
    module = compiled("rigid_5", "matrix", backend, functions=("forward_dynamics",))
    folder = Path(str(module.__file__)).parent
    states = 1_000_000 if backend == "c" else 500_000
    done = subprocess.run(
        [sys.executable, "-c", MEMORY, str(folder.parent), folder.name, layout, str(states)],
        text=True, capture_output=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    given, made = map(float, done.stdout.split())
    assert given < 64
    assert made < 64


@pytest.mark.parametrize("workers", [2, 3, 8])
def test_threads(workers: int, build: Callable[..., ModuleType]) -> None:
    """A batch in pieces over threads has the bits of the whole, with one result that all of them fill."""
    module = build(5)
    states = random_state(module, 1, (20_011,))
    for name in NAMES:
        expected = call(module, name, states)
        out = np.full_like(expected, np.nan)
        cuts = np.linspace(0, len(out), 5 * workers + 1).astype(int)

        def piece(first: int, last: int, name: str = name, out: np.ndarray = out) -> None:
            call(module, name, State(*(x[first:last] for x in states)), out=out[first:last])

        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(piece, cuts[:-1], cuts[1:]))
        assert same(out, expected), name


def test_threads_with_rollouts_and_types(compiled: Compiled) -> None:
    """Calls of several functions and types at a time do not disturb each other."""
    types = ("float32", "float64", "longdouble")
    module = compiled("rigid_3", "matrix", "c", functions=("forward_dynamics", "joints"), dtypes=types)

    def work(seed: int) -> list[np.ndarray]:
        states = random_state(module, seed, (301,))
        dtype = types[seed % 3]
        q, v, u, p = (x.astype(dtype) for x in (states.q, states.v, states.u, module.p))
        a = module.forward_dynamics(q, v, u, p)
        fixed = module.rollout(q, v, u[:, None], p, np.full((), 1e-3, dtype))
        return [a, module.joints(q, p), *fixed, *module.rollout(q, v, u[:, None], p, 1e-3, method="dop853")]

    expected = [work(seed) for seed in range(24)]
    with ThreadPoolExecutor(6) as pool:
        for found, alone in zip(pool.map(work, range(24)), expected, strict=True):
            assert all(np.array_equal(a, b) for a, b in zip(found, alone, strict=True))
