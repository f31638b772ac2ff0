"""The back ends from hand-made programs: every operation, loops, pairs, turns, one state and many, every type."""

import importlib.util
import itertools
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from eomgen import backends, passes
from eomgen.backends import cache
from eomgen.errors import OptionError
from eomgen.ir.expr import BINARY, LEAVES, UNARY, Graph, Node, reachable
from eomgen.ir.interpret import Digits, Floats, run
from eomgen.ir.program import Array, Block, Inner, Place, Program, Rounds, Store, Turns, needed, straight
from eomgen.ir.statements import decimal
from eomgen.model import Model
from eomgen.passes import chunk

DTYPES = ("float32", "float64", "longdouble")
EPS = {dtype: float(np.finfo(dtype).eps) for dtype in DTYPES}
THIRD = Fraction(1, 3)

# Of x, y, z > 0 from the state and m, r > 0 from the parameters.
Build = Callable[[Graph, Node, Node, Node, Node, Node], Node]
EXPRESSIONS: dict[str, Build] = {
    "load": lambda g, x, y, z, m, r: x,
    "parameter": lambda g, x, y, z, m, r: m,
    "negative parameter": lambda g, x, y, z, m, r: -m,
    "parameters only": lambda g, x, y, z, m, r: (m * r - 1) / (m + r),
    "constant": lambda g, x, y, z, m, r: g.constant(-2.5),
    "third": lambda g, x, y, z, m, r: g.constant(THIRD),
    "third of": lambda g, x, y, z, m, r: x * THIRD - y * -THIRD,
    "tenth": lambda g, x, y, z, m, r: x + 0.1,
    "large": lambda g, x, y, z, m, r: x * Fraction(10**30, 7) / Fraction(10**30, 3),
    "small": lambda g, x, y, z, m, r: x * Fraction(3, 10**30) * 2.0**90,
    "whole": lambda g, x, y, z, m, r: (x - 16777217) + 16777216,
    "add": lambda g, x, y, z, m, r: x + y,
    "sub": lambda g, x, y, z, m, r: x - (y - (z - m)),
    "mul": lambda g, x, y, z, m, r: x * y * (z * m),
    "div": lambda g, x, y, z, m, r: x / y / (z / r),
    "neg": lambda g, x, y, z, m, r: -x,
    "signs": lambda g, x, y, z, m, r: -((x - 3) * (y / -(z + 1))) - -(m * -x),
    "nested signs": lambda g, x, y, z, m, r: -(-(x - y) * m - (-(x - y) / z)),
    "difference of products": lambda g, x, y, z, m, r: x * y - z * m,
    "product less": lambda g, x, y, z, m, r: x * (y + z) - m,
    "less product": lambda g, x, y, z, m, r: m - x / y * z,
    "sum of sums": lambda g, x, y, z, m, r: (x + y) - (z - x) - (y + (m - r)),
    "quotient of sums": lambda g, x, y, z, m, r: (x + y) / (z + m) * (x - 7) / (y + r),
    "sin": lambda g, x, y, z, m, r: g.sin(x),
    "cos": lambda g, x, y, z, m, r: g.cos(y),
    "sin and cos": lambda g, x, y, z, m, r: g.sin(x + y) * g.cos(x + y) - g.sin(-z),
    "sin of a parameter": lambda g, x, y, z, m, r: g.sin(m) * x,
    "cos of a constant": lambda g, x, y, z, m, r: g.cos(g.constant(2)) + x,
    "large angle": lambda g, x, y, z, m, r: g.cos(x * 1000),
    "sqrt": lambda g, x, y, z, m, r: g.sqrt(x * y),
    "exp": lambda g, x, y, z, m, r: g.exp(x - y),
    "log": lambda g, x, y, z, m, r: g.log(z),
    "functions of parameters": lambda g, x, y, z, m, r: x * g.sqrt(m) + g.exp(r) * g.log(m + 3),
    "pivot_inverse": lambda g, x, y, z, m, r: g.pivot_inverse(x, y),
    "pivots": lambda g, x, y, z, m, r: x * g.pivot_inverse(y + z, m) + g.pivot_inverse(m, r),
    "deep": lambda g, x, y, z, m, r: (((((x * y + z) * x + y) * z + x) * y + m) * z + x) * y - ((x - y) * z - r) * x,
    "shared": lambda g, x, y, z, m, r: (x * y + 1) * (x * y + 1) + -(x * y),
}
STATE, PARAMETERS = np.array([1.7, 0.6, 2.9]), np.array([1.25, 0.4])


def coverage() -> Program:
    """All expressions as one program; its inputs are q (x, y) and the matrix w (z at its place 1, 2)."""
    graph = Graph()
    x, y, z, m, r = (graph.symbol(name) for name in "xyzmr")
    loads = {x: Place("q", (0,)), y: Place("q", (1,)), z: Place("w", (5,)), m: Place("p", (0,)), r: Place("p", (1,))}
    inputs = (
        Array("q", (2,), "input", ("x", "y")),
        Array("w", (2, 3), "input", ("a", "b", "c", "d", "e", "z")),
        Array("p", (2,), "input", ("m", "r"), ("kg", "")),
    )
    outputs = [("out", i, make(graph, x, y, z, m, r)) for i, make in enumerate(EXPRESSIONS.values())]
    output = Array("out", (len(outputs),), "output")
    return Program("coverage", "every operation", inputs, output, (straight("all", loads, outputs),))


def loop(links: int = 6) -> Program:
    """Sums from the tips of a tree to its root, scaled and stored in turned order, and the sum of all.

    Indices are affine (forwards, backwards, in steps of 3, at rest) and tables; sums have two children.
    """
    parents = (-1, 0, 0, 2, 2, 4)
    graph = Graph()
    q, p, total, w = (graph.symbol(name) for name in "qptw")
    names, back = tuple(range(links)), tuple(range(links - 1, 0, -1))
    blocks = (
        Block(
            "own",
            {q: Place("q", names), p: Place("p", names)},
            (Store(Place("sums", names), q * graph.sqrt(p)),),
            links,
        ),
        Block("start", {}, (Store(Place("out", (2 * links,)), graph.zero),)),
        Block(
            "tips to root",
            {total: Place("sums", back), q: Place("q", (1,) * len(back))},
            (Store(Place("sums", tuple(parents[i] for i in back)), total * q, add=True),),
            len(back),
        ),
        Block(
            "results",
            {total: Place("sums", names), w: Place("w", tuple(3 * i + 1 for i in names)), p: Place("p", names)},
            (
                Store(Place("out", names[::-1]), total * p - w),
                Store(Place("out", tuple(links + (5 * i + 2) % links for i in names)), graph.sin(w) / total),
                Store(Place("out", (2 * links,) * links), -total, add=True),
            ),
            links,
        ),
    )
    inputs = (
        Array("q", (links,), "input", tuple(f"q{i}" for i in names)),
        Array("w", (links, 3), "input", tuple(f"w{i}" for i in range(3 * links))),
        Array("p", (links,), "input", tuple(f"p{i}" for i in names)),
    )
    output, sums = Array("out", (2 * links + 1,), "output"), Array("sums", (links,), "work")
    return Program("loop", "sums over a tree", inputs, output, blocks, scratch=(sums,))


PARENTS = (-1, 0, 0, 2, 2, 4)


def square() -> Program:
    """A symmetric matrix: q_i p_j² + sin q_j for i above j in a tree, zero for other branches."""
    graph, n = Graph(), len(PARENTS)
    upper, lower, p, own = (graph.symbol(name) for name in ("upper", "lower", "p", "own"))
    every, rest, rows = range(n), (0,) * n, range(0, n * n, n)
    zero = Block("zeros", {}, (Store(Place("out", range(n * n)), graph.zero),), n * n)
    diagonal = Block("diagonal", {own: Place("q", every)}, (Store(Place("out", range(0, n * n, n + 1)), own),), n)
    element = upper * (p * p) + graph.sin(lower)
    pairs = Block(
        "pairs",
        {upper: Place("q", rest, every), lower: Place("q", every), p: Place("p", every)},
        (Store(Place("out", every, rows), element), Store(Place("out", rows, every), element)),
        n,
        Inner(PARENTS, PARENTS),
    )
    inputs = tuple(Array(letter, (n,), "input", tuple(f"{letter}{i}" for i in every)) for letter in "qp")
    return Program("square", "a matrix by pairs", inputs, Array("out", (n, n), "output"), (zero, diagonal, pairs))


def turns() -> Program:
    """From the root of a tree to its tips, a number at every link that two kinds of links pass on differently."""
    graph, kinds = Graph(), (0, 2, 1, 2, 1, 2)
    q, p, above = (graph.symbol(name) for name in ("q", "p", "above"))
    values = q * p, above + q * (p * p), above * graph.cos(q) - p
    blocks: list[Block] = []
    for kind, value in enumerate(values):
        links = [i for i in range(6) if kinds[i] == kind]
        places = {q: Place("q", links), p: Place("p", links), above: Place("down", [PARENTS[i] for i in links])}
        stores = Store(Place("down", links), value), Store(Place("out", [5 - i for i in links]), value * q)
        blocks.append(needed(Block(f"kind {kind}", places, stores, len(links))))
    inputs = tuple(Array(letter, (6,), "input", tuple(f"{letter}{i}" for i in range(6))) for letter in "qp")
    step = Turns("root to tips", tuple(blocks), kinds)
    scratch = (Array("down", (6,), "work"),)
    return Program("turns", "two kinds of links", inputs, Array("out", (6,), "output"), (step,), scratch=scratch)


def columns() -> Program:
    """A matrix column by column: p_i² + q_i² times the products of q up to a row, less a third."""
    graph, every = Graph(), range(3)
    q, p, x, own = (graph.symbol(name) for name in ("q", "p", "x", "own"))
    squares = Block("squares", {q: Place("q", (2, 1, 0))}, (Store(Place("own", (2, 1, 0)), q * q),), 3)
    start = Block(
        "start",
        {p: Place("p", (0,), every), own: Place("own", (0,), every)},
        (Store(Place("down", (0,)), p * p + own),),
        rounds=3,
    )
    walk = Block(
        "walk",
        {q: Place("q", every), x: Place("down", every)},
        (Store(Place("down", (1, 2, 3)), q * x), Store(Place("out", (0, 3, 6), every), q * x - THIRD)),
        3,
        rounds=3,
    )
    inputs = tuple(Array(letter, (3,), "input", tuple(f"{letter}{i}" for i in every)) for letter in "qp")
    scratch = Array("own", (3,), "work"), Array("down", (4,), "work")
    blocks = squares, Rounds("columns", (start, walk))
    return Program("columns", "a matrix by columns", inputs, Array("out", (3, 3), "output"), blocks, scratch=scratch)


def differences() -> Program:
    """Sines of differences of arguments and parameters beside those of single ones; one difference has other uses."""
    graph = Graph()
    x, y, z, r = (graph.symbol(name) for name in "xyzr")
    loads = {x: Place("q", (0,)), y: Place("q", (1,)), z: Place("q", (2,)), r: Place("p", (0,))}
    turns = [x, y - x, z - y, x - r]
    sines = [*map(graph.sin, turns), *map(graph.cos, [*turns[:2], turns[3]]), (z - y) * (z - y) - THIRD]
    inputs = (Array("q", (3,), "input", ("x", "y", "z")), Array("p", (1,), "input", ("r",)))
    outputs = [("out", i, node) for i, node in enumerate(sines)]
    block = straight("all", loads, outputs)
    return Program("differences", "sines of differences", inputs, Array("out", (len(sines),), "output"), (block,))


def only(name: str) -> Program:
    """A program without inputs of the state that matter: constants and parameters only."""
    graph = Graph()
    p = graph.symbol("p0")
    outputs = [("out", 0, graph.zero), ("out", 1, p), ("out", 2, -p), ("out", 3, p * p + THIRD), ("out", 4, -graph.one)]
    inputs = (Array("q", (1,), "input", ("q0",)), Array("p", (1,), "input", ("p0",)))
    return Program(
        name, "no state", inputs, Array("out", (5,), "output"), (straight("all", {p: Place("p", (0,))}, outputs),)
    )


PROGRAMS: dict[str, Callable[[], Program]] = {
    "coverage": coverage,
    "loop": loop,
    "square": square,
    "turns": turns,
    "columns": columns,
    "differences": differences,
    "still": lambda: only("still"),
}


def arguments(program: Program, batch: tuple[int, ...] = (), dtype: str = "float64") -> list[np.ndarray[Any, Any]]:
    """Positive inputs, the same for every seed; a batch varies by the state, p does not."""
    rng = np.random.default_rng(7)
    found = []
    for array in program.inputs:
        values = rng.uniform(0.4, 2.5, (*(() if array.name == "p" else batch), *array.shape))
        if program.name == "coverage" and not batch:
            values = {"q": STATE[:2], "w": np.array([[9, 9, 9], [9, 9, STATE[2]]]), "p": PARAMETERS}[array.name]
        found.append(np.asarray(values).astype("float32").astype(dtype))
    return found


def load(folder: Path, name: str) -> ModuleType:
    """The package in a folder, imported under a name of its own."""
    spec = importlib.util.spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


COUNTER = itertools.count()


def built(
    folder: Path, backend: str, programs: Sequence[Program], dtypes: tuple[str, ...] = ("float64",)
) -> ModuleType:
    """The package that a back end makes of programs."""
    names = {f"{kind}_names": () for kind in "qvuwp"}
    facts = {"scene": {}, "method": "hand", "info": {}}
    model = Model("hand_made", "programs made by hand", tuple(programs), names, (), facts, dtypes)
    target = backends.select(backend)
    cache.write(folder, target.emit(model))
    target.build(folder, model, False)
    return load(folder, f"hand_made_{next(COUNTER)}")


@pytest.fixture(scope="session")
def modules(tmp_path_factory: pytest.TempPathFactory) -> dict[str, ModuleType]:
    """All programs after the passes, by back end, for all types."""
    programs = [passes.run(make()) for make in PROGRAMS.values()]
    return {name: built(tmp_path_factory.mktemp(name), name, programs, DTYPES) for name in backends.BACKENDS}


def exact(program: Program, values: Sequence[np.ndarray[Any, Any]]) -> list[float]:
    """The result in 40 digits, from the exact inputs."""
    digits = Digits(40)
    given = {a.name: [digits.number(v) for v in x.flat] for a, x in zip(program.inputs, values, strict=True)}
    return run(program, given, digits)


def largest(got: Any, expected: Sequence[Any], dtype: str) -> float:
    """The largest difference over the expected value (at least 1), in eps of the type."""
    context = Digits(40).context
    pairs = zip(np.asarray(got).flat, expected, strict=True)
    return float(max(abs(context.mpf(str(value)) - e) / max(abs(e), 1) for value, e in pairs)) / EPS[dtype]


@pytest.mark.parametrize("backend", backends.BACKENDS)
@pytest.mark.parametrize("name", PROGRAMS)
def test_is_the_interpreters_value(modules: dict[str, ModuleType], name: str, backend: str) -> None:
    """Beside the reference interpreter in float64; fused multiply-adds and sines differ by a few eps."""
    program = PROGRAMS[name]()
    values = arguments(program)
    expected = run(program, {a.name: list(x.flat) for a, x in zip(program.inputs, values, strict=True)}, Floats())
    got = getattr(modules[backend], name)(*values)
    assert got.shape == program.output.shape
    np.testing.assert_allclose(got.reshape(-1), expected, rtol=16 * EPS["float64"], atol=16 * EPS["float64"])


# Bounds in eps: an error of half an eps an operation, amplified by what cancels. "whole" and "large angle" lose
# digits of float32 by construction: their numbers are beyond its 24 bits.
BOUND = 12
HARD = {("whole", "float32"), ("large angle", "float32")}


@pytest.mark.parametrize("backend", backends.BACKENDS)
@pytest.mark.parametrize(
    ("name", "dtype"), [pair for pair in itertools.product(EXPRESSIONS, DTYPES) if pair not in HARD]
)
def test_every_type_has_its_own_precision(modules: dict[str, ModuleType], name: str, backend: str, dtype: str) -> None:
    """Constants such as 1/3, sines and square roots have the precision of the type, not that of another."""
    program, position = coverage(), list(EXPRESSIONS).index(name)
    values = arguments(program, dtype=dtype)
    got = modules[backend].coverage(*values)
    assert got.dtype == dtype
    assert largest(got[position : position + 1], exact(program, values)[position : position + 1], dtype) < BOUND


@pytest.mark.parametrize("dtype", ["float32", "longdouble"])
@pytest.mark.parametrize("backend", backends.BACKENDS)
@pytest.mark.parametrize("name", ["loop", "square", "turns", "still"])
def test_loops_in_every_type(modules: dict[str, ModuleType], name: str, backend: str, dtype: str) -> None:
    program = PROGRAMS[name]()
    values = arguments(program, dtype=dtype)
    assert largest(getattr(modules[backend], name)(*values), exact(program, values), dtype) < BOUND


def bits(array: np.ndarray[Any, Any]) -> list[Any]:
    """Values to compare exactly; the padding of long doubles is no part of them."""
    assert not np.isnan(array).any()
    return array.tolist()


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("states", [1, 2, 7, 8, 37])
@pytest.mark.parametrize("name", PROGRAMS)
def test_one_state_and_many_give_the_same_bits(
    modules: dict[str, ModuleType], name: str, states: int, dtype: str
) -> None:
    function, program = getattr(modules["c"], name), PROGRAMS[name]()
    *state, p = arguments(program, (states,), dtype)
    batch = function(*state, p)
    assert batch.shape == (states, *program.output.shape)
    for i in range(states):
        assert bits(batch[i]) == bits(function(*(x[i] for x in state), p))


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("backend", backends.BACKENDS)
def test_sines_of_differences(modules: dict[str, ModuleType], backend: str, dtype: str) -> None:
    """Of angles of all sizes: nothing is lost, and no state has other bits because of its neighbours."""
    sizes = [0.7, 3.0, -2.5, 11.0, 40.0, -1e3, 1e6, 3e-8, 1e15, -1e15, 2.0**40]
    q = np.array(list(itertools.product(sizes, repeat=3)), dtype)
    p = np.array([0.7], dtype)
    function, program = modules[backend].differences, differences()
    found = function(q, p)
    for state in range(0, len(q), 7):
        assert largest(found[state], exact(program, [q[state], p]), dtype) < 4, q[state]
        if backend == "c":
            assert bits(function(q[state], p)) == bits(found[state])
    ordinary = q[np.abs(q).max(axis=1) < 4]
    alone = function(ordinary, p)
    for far in (30.0, 1e15):
        assert (function(np.concatenate([ordinary, np.full((1, 3), [far, 0.7, far], dtype)]), p)[:-1] == alone).all()


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("backend", backends.BACKENDS)
def test_far_differences_of_near_angles(modules: dict[str, ModuleType], backend: str, dtype: str) -> None:
    """No angle reaches 8 rad, differences do: they are corrected whether a neighbour is far or not."""
    q = np.array(list(itertools.product([5.1, -5.3, 7.9, -7.7], repeat=3)), dtype)
    function, p = modules[backend].differences, np.array([0.7], dtype)
    with_far = np.concatenate([q, np.full((1, 3), [30.0, 0.7, 1e15], dtype)])
    assert (function(q, p) == function(with_far, p)[:-1]).all()


@pytest.mark.parametrize("backend", backends.BACKENDS)
@pytest.mark.parametrize("name", PROGRAMS)
def test_parameters_of_their_own_for_every_state(modules: dict[str, ModuleType], name: str, backend: str) -> None:
    """What depends on parameters only is computed anew where p changes from state to state."""
    function, program = getattr(modules[backend], name), PROGRAMS[name]()
    *state, p = arguments(program, (9,))
    varied = p * np.linspace(1, 2, 9)[:, None]
    batch = function(*state, varied)
    for i in range(9):
        np.testing.assert_allclose(batch[i], function(*(x[i] for x in state), varied[i]), rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("backend", backends.BACKENDS)
def test_strides_and_broadcasting(modules: dict[str, ModuleType], backend: str) -> None:
    function, program = modules[backend].coverage, coverage()
    q, w, p = arguments(program, (5, 3))
    expected = function(q, w, p)
    turned = np.asfortranarray(w)[:, ::-1]
    np.testing.assert_array_equal(function(q[:, ::-1], turned, p)[:, ::-1], expected)
    np.testing.assert_allclose(function(q[:, :1], w[:1], p)[2, 1], function(q[2, 0], w[0, 1], p), rtol=1e-14)
    out = np.zeros((5, 3, 2, len(EXPRESSIONS)))[:, :, 1]
    assert function(q, w, p, out=out) is out
    np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize("backend", backends.BACKENDS)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("states", [1, 8, 33])
@pytest.mark.parametrize("reference", ["one", "least"])
def test_unsafe_pivots(modules: dict[str, ModuleType], backend: str, dtype: str, states: int, reference: str) -> None:
    """NaN and the flag up to 16 eps of the reference and the least normal number, 1/pivot from the next number on.

    In a batch NaN is for that state only, and the others have the bits that they have alone.
    """
    kind, function = np.finfo(dtype), modules[backend].coverage
    beside = np.ones((), dtype) if reference == "one" else np.zeros((), dtype)
    bound = 16 * kind.eps * beside + kind.tiny
    q, w, p = arguments(coverage(), (states,), dtype)
    position, lost = list(EXPRESSIONS).index("pivot_inverse"), states // 2
    alone = np.stack([function(q[i], w[i], p)[position] for i in range(states)])
    for pivot, safe in [(bound, False), (np.nextafter(bound, kind.max, dtype=dtype), True), (-bound, False)]:
        q[lost] = [pivot, beside]
        with np.errstate(all="ignore"):
            got = function(q, w, p)[:, position]
            one = function(q[lost], w[lost], p)[position]
        expected = 1 / pivot if safe else np.nan
        assert np.array_equal([got[lost], one], [expected, expected], equal_nan=True)
        assert np.array_equal(np.delete(got, lost), np.delete(alone, lost))
        with np.errstate(all="ignore", invalid="raise"):
            if safe:
                function(q, w, p)
                continue
            with pytest.raises(FloatingPointError):
                function(q, w, p)


def test_all_operations_are_covered() -> None:
    graph = Graph()
    symbols = [graph.symbol(name) for name in "xyzmr"]
    used = {node.op for node in reachable(make(graph, *symbols) for make in EXPRESSIONS.values())}
    assert used == {*UNARY, *BINARY, *LEAVES}


@pytest.mark.parametrize("backend", backends.BACKENDS)
def test_long_programs_in_pieces(tmp_path: Path, backend: str) -> None:
    """Both the state's and the parameters' parts are cut, and the pieces hand their values on."""
    graph = Graph()
    q, p = graph.symbol("q"), graph.symbol("p")
    still, moving = p, q
    for i in range(40):
        still = still * p + graph.sin(still) / (i + 1)
        moving = moving * graph.cos(still) + still
    loads = {q: Place("q", (0,)), p: Place("p", (0,))}
    inputs = (Array("q", (1,), "input", ("q",)), Array("p", (1,), "input", ("p",)))
    whole = Program(
        "long_",
        "long",
        inputs,
        Array("out", (2,), "output"),
        (straight("all", loads, [("out", 0, moving), ("out", 1, still)]),),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(passes, "DEFAULT", (passes.DEFAULT[0], ("chunk", lambda program: chunk.run(program, 12))))
        program = passes.run(whole)
    assert len(program.constants) > 1
    assert len(program.blocks) > 1
    values = [np.array([0.7]), np.array([0.3])]
    got = built(tmp_path, backend, [program]).long_(*values)
    assert largest(got, exact(whole, values), "float64") < 100


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1, "1.0"),
        (-3, "-3.0"),
        (Fraction(1, 2), "0.5"),
        (10**22, "1e+22"),
    ],
)
def test_numbers_that_a_double_holds(value: Fraction, text: str) -> None:
    assert decimal(value) == text


@pytest.mark.parametrize(
    "value",
    [THIRD, -THIRD, Fraction(2, 3) * 10**40, Fraction(10**30, 7), Fraction(1, 7 * 10**200), Fraction(10**23 + 1)],
)
def test_other_numbers_have_digits_for_every_type(value: Fraction) -> None:
    """As text they are nearer to the value than any type of 64 bits of mantissa can tell (113 is not promised)."""
    text = decimal(value).rstrip("lL")
    assert abs(Fraction(text) - value) < abs(value) * Fraction(1, 2**66)
    assert float(text) == float(value)


def test_back_ends_are_found_by_name() -> None:
    assert list(backends.BACKENDS) == ["c", "numpy"]
    with pytest.raises(OptionError, match=r"unknown back end 'nunpy'; allowed: c, numpy \(did you mean 'numpy'\?\)"):
        backends.select("nunpy")
