"""Loops over links: the same functions as straight-line code, in text that does not grow with the links."""

import importlib
import itertools
import random
import re
from collections.abc import Callable, Sequence
from types import ModuleType

import numpy as np
import pytest

import eomgen
from bench.cases import ALONG, CASES, JOINT, State, line, random_state, tree
from bench.cases import random_tree as every_kind
from eomgen import backends, choice, functions, loops, passes, pipeline
from eomgen.backends import BACKENDS
from eomgen.catalog import chain
from eomgen.errors import EomgenError, OptionError, UnsupportedError
from eomgen.frontends.articulated import ArticulatedEquations
from eomgen.functions import FUNCTIONS
from eomgen.ir.count import program_operations
from eomgen.ir.derivative import Tape
from eomgen.ir.equations import Equations
from eomgen.ir.interpret import PrimeField, run
from eomgen.ir.program import Program, Rounds, Turns, parts
from eomgen.ir.text import dump
from eomgen.looped import LOOPED
from eomgen.scene import LINK_TYPES, Length, Scene
from tests.conftest import Compiled
from tests.depth import shallow_stack
from tests.exact import differences, exact_groups, results

c_emit = importlib.import_module("eomgen.backends.c.emit")  # the package has a function of this name
LINEAR = ["forward_dynamics", "inverse_dynamics", "bias", "energy", "joints"]
METHODS = ["lagrange", "recursive", "matrix"]


def articulated(scene: Scene, fold: bool = False) -> ArticulatedEquations:
    """The equations that can become loops."""
    equations = eomgen.derive(scene, "articulated", fold)
    assert isinstance(equations, ArticulatedEquations)
    return equations


def repeats(program: Program) -> bool:
    """Whether a program has a loop."""
    return any(block.looped for block in parts((*program.constants, *program.blocks)))


# Equal to straight-line code


def assert_loops_are_exact(scene: Scene, fold: bool = False) -> None:
    """Every function as loops, before and after the passes, against the equations written out, in a prime field.

    Of the Jacobians it is the product with a random direction, against the derivative of forward dynamics along it.
    """
    equations, field = articulated(scene, fold), PrimeField()
    groups, slopes = dict(results(equations)), dict[str, list[int]]()
    tape = Tape(equations.forward_dynamics)
    for name, wrt in (("jacobian", (*equations.q, *equations.v, *equations.u)), ("parameter_jacobian", equations.p)):
        if wrt:
            direction = {x: equations.graph.symbol(f"direction of {x.name}") for x in wrt}
            groups[name] = tape.forward(direction)
            slopes[name] = [field.random(symbol.name) for symbol in direction.values()]
    expected = exact_groups(groups)
    found, hoisted = {}, {}
    for name in expected:
        program = loops.program(equations.mechanism, name)
        inputs = {a.name: [field.random(symbol) for symbol in a.symbols] for a in program.inputs}
        for values, written in ((found, program), (hoisted, passes.run(program))):
            values[name] = _along(run(written, inputs, field), slopes.get(name))
    assert not differences(expected, found)
    assert not differences(expected, hoisted)


def _along(values: list[int], direction: list[int] | None) -> list[int]:
    """The rows of a matrix times a direction, if there is one."""
    if direction is None:
        return values
    rows = (values[start : start + len(direction)] for start in range(0, len(values), len(direction)))
    return [sum(x * y for x, y in zip(row, direction, strict=True)) % PrimeField.P for row in rows]


@pytest.mark.parametrize("case", CASES)
def test_cases(case: str) -> None:
    assert_loops_are_exact(CASES[case])


@pytest.mark.parametrize("case", ["models_5", "hanging_branch", "springs", "centers", "walker_rods_prescribed"])
def test_folded_numbers(case: str) -> None:
    assert_loops_are_exact(CASES[case], fold=True)


def springs(numbers: random.Random, length: Length | None) -> dict[str, float]:
    """Springs and dampers of a link at random, in its joint and, where its length varies, along it."""
    sets: list[dict[str, float]] = [JOINT, {"joint_damping": 0.8}]
    if isinstance(length, str):
        sets += [ALONG, {**ALONG, **JOINT}, {"stiffness": 90.0, "joint_stiffness": 4.0}]
    return numbers.choice(sets)


def random_tree(seed: int) -> Scene:
    """A tree of up to 14 links in which neighbours are often of one kind, so that runs are long and branch."""
    numbers = random.Random(seed)
    count = numbers.randint(4, 14)
    few = numbers.sample(sorted(LINK_TYPES), k=numbers.choice([1, 1, 2]))
    back = numbers.choice([1, 2, 4, count])
    parents = [max(-1, i - numbers.randint(1, back)) if numbers.random() < 0.9 else -1 for i in range(count)]
    models = [numbers.choice(few)] * count
    for i in range(count):
        models[i] = numbers.choice(few) if numbers.random() < 0.2 else models[i - 1]
    # A length that moves no mass would make the scene singular, so tips do not hang.
    hanging = [i for i in range(count) if i in parents and numbers.random() < 0.15]
    lengths = [None if model == "rigid" else numbers.choice(["free", "prescribed", 0.6]) for model in models]
    changes = {i: springs(numbers, lengths[i]) for i in range(count) if numbers.random() < 0.2}
    return tree("random", parents, models, lengths, hanging, numbers.choice([9.81, 0.0]), changes)


def mixed_tree(seed: int, count: int = 16, few: Sequence[str] = ()) -> Scene:
    """A tree in which kinds of links alternate at random: every loop takes turns with others."""
    numbers = random.Random(seed)
    models = [numbers.choice(few or sorted(LINK_TYPES)) for _ in range(count)]
    back = numbers.choice([1, 3, count])
    parents = [-1, *(numbers.randint(max(0, i - back), i - 1) for i in range(1, count))]
    if seed % 4 == 0 and count > 4:
        parents[count // 2] = -1
    modes = numbers.choice([["free"], ["free", "prescribed"], ["free", "prescribed", 0.6]])
    lengths = [None if model == "rigid" else numbers.choice(modes) for model in models]
    hanging = [i for i in range(count) if seed % 2 and i in parents and numbers.random() < 0.2]
    changes = {i: springs(numbers, lengths[i]) for i in range(count) if seed % 3 == 0 and numbers.random() < 0.3}
    return tree("mixed", parents, models, lengths, hanging, numbers.choice([9.81, 0.0]), changes)


def in_turns(program: Program) -> bool:
    """Whether loops of a program take turns."""
    return any(isinstance(step, Turns) for step in program.blocks)


@pytest.mark.parametrize("seed", range(40))
def test_random_trees(seed: int) -> None:
    assert_loops_are_exact(random_tree(seed), fold=seed % 3 == 0)


@pytest.mark.parametrize("seed", range(40))
def test_random_trees_in_turns(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many links of a kind there are."""
    monkeypatch.setattr(loops, "RUNS_PER_KIND", 0)
    scene = mixed_tree(seed)
    assert_loops_are_exact(scene, fold=seed % 5 == 0)
    (program,) = pipeline.programs(articulated(scene), ["inverse_dynamics"], loops=True)
    assert in_turns(program)


@pytest.mark.parametrize("seed", range(12))
def test_random_trees_of_many_kinds(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of which tips are none of their own."""
    monkeypatch.setattr(loops, "MANY_GROUPS", 0)
    monkeypatch.setattr(loops, "RUNS_PER_KIND", seed % 2)
    assert_loops_are_exact((random_tree, mixed_tree)[seed % 2](seed), fold=seed % 5 == 0)


@pytest.mark.parametrize("case", CASES)
def test_cases_in_turns(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loops, "RUNS_PER_KIND", 0)
    assert_loops_are_exact(CASES[case])


@pytest.mark.parametrize(
    "parents",
    [
        (-1, 0, 0, 1, 2, 2),  # tips of one run: some alone on their parent, some not
        (-1, 0, 0, 1, 1, 2),
        (-1, -1, 0, 1, 1, 2, 3, 4),
        (-1, 0, 1, 2, 0, 4, 5, 0, 7, 8),  # three legs
        (-1, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6),  # a binary tree
        (-1, 0, 1, 2, 3, 1, 5, 6, 3, 8),
        (-1, -1, -1, 0, 1, 2, 3, 4, 5),  # three chains side by side
    ],
    ids=str,
)
@pytest.mark.parametrize("model", ["rigid", "telescopic"])
def test_branches_of_one_kind(model: str, parents: Sequence[int]) -> None:
    assert_loops_are_exact(tree("branches", parents, model))


def test_a_longer_chain() -> None:
    """Beyond what anyone would write out: 150 links, forward dynamics and its inverse."""
    equations, field = articulated(chain(150, "elastic-rod")), PrimeField()
    expected = exact_groups({name: results(equations)[name] for name in ("forward_dynamics", "inverse_dynamics")})
    for program in pipeline.programs(equations, list(expected)):
        assert repeats(program)
        inputs = {a.name: [field.random(symbol) for symbol in a.symbols] for a in program.inputs}
        assert run(program, inputs, field) == expected[program.name]


# The Jacobians, column by column


def test_jacobians_of_many_coordinates_are_looped() -> None:
    """Few are written out, which runs faster; a thousand links still are a short text."""
    for name, scene, repeated in (
        ("jacobian", chain(15, "rigid"), False),
        ("jacobian", chain(16, "rigid"), True),
        ("jacobian", chain(8, "point-masses"), True),
        ("jacobian", every_kind(12), True),
        ("parameter_jacobian", chain(9, "rigid"), False),
        ("parameter_jacobian", chain(10, "rigid"), True),
        ("parameter_jacobian", chain(1, "point-masses"), True),
    ):
        (program,) = pipeline.programs(articulated(scene), [name])
        assert repeats(program) == any(isinstance(step, Rounds) for step in program.blocks) == repeated
    for name, columns in (("jacobian", 3000), ("parameter_jacobian", 2001)):
        (program,) = pipeline.programs(eomgen.derive(chain(1000, "rigid"), "matrix"), [name])
        assert program.output.shape == (1000, columns)
        assert len(dump(program)) < 30_000


@pytest.mark.parametrize("name", choice.LOOPED_COLUMNS)
def test_jacobians_cost_the_square_of_the_links(name: str) -> None:
    counts = []
    for links in (50, 100, 200):
        (program,) = pipeline.programs(articulated(chain(links, "rigid")), [name])
        counts.append(program_operations(program)["state"].total())
    assert counts[2] / counts[1] == pytest.approx(4, rel=0.03)
    assert counts[1] / counts[0] == pytest.approx(4, rel=0.06)


@pytest.mark.parametrize("name", choice.LOOPED_COLUMNS)
def test_jacobians_solve_by_what_forward_dynamics_has_eliminated(name: str) -> None:
    """No division is in the loop around the columns."""
    for scene in (chain(20, "rigid"), chain(9, "elastic-rod"), chain(9, "point-masses"), every_kind(30)):
        (program,) = pipeline.programs(articulated(scene), [name])
        (rounds,) = (step for step in program.blocks if isinstance(step, Rounds))
        inside = {node.op for block in rounds.parts for node in block.nodes() if node not in block.loads}
        assert inside <= {"add", "sub", "mul", "neg", "constant"}
        assert rounds.count * len(LOOPED[name].sides) == program.output.shape[1]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    "scene",
    [every_kind(12), chain(16, "rigid"), mixed_tree(3, 24), chain(1)],
    ids=["kinds", "chain", "turns", "one link"],
)
def test_jacobians_compiled(backend: str, scene: Scene) -> None:
    names = [*choice.LOOPED_COLUMNS]
    looped, unrolled = (
        eomgen.compile(scene, "articulated", name, functions=names, loops=form)
        for name, form in ((backend, True), ("numpy", False))
    )
    states = random_state(scene, 3, (19,))
    for name in names:
        expected, found = (call(module, name, states) for module in (unrolled, looped))
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max(), err_msg=name)
        if backend == "c":
            alone = np.stack([call(looped, name, State(*(x[k] for x in states))) for k in range(19)])
            assert alone.tobytes() == found.tobytes(), name


# Compiled


def call(module: ModuleType, name: str, states: State) -> np.ndarray:
    """A function of a module by name at some states."""
    return np.asarray(getattr(module, name)(*states.of(FUNCTIONS[name].arguments), module.p))


@pytest.mark.parametrize(
    ("case", "backend"),
    [("springs", "c"), *((case, "numpy") for case in ("springs", "roots", "hanging_branch", "rigid_5", "models_5"))],
)
def test_compiled_loops_agree_with_unrolled_code(case: str, backend: str, compiled: Compiled) -> None:
    looped = compiled(case, "articulated", backend, loops=True)
    unrolled = compiled(case, "articulated", "numpy", loops=False)
    states = random_state(looped, 6, (21,))
    names = [name for name in FUNCTIONS if name in looped.__all__]
    assert {"forward_dynamics", "mass_matrix", "energy"} < {*names}
    for name in names:
        expected = call(unrolled, name, states)
        found = call(looped, name, states)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-11 * np.abs(expected).max(), err_msg=name)
        alone = np.stack([call(looped, name, State(*(x[k] for x in states))) for k in range(21)])
        if backend == "c":
            assert alone.tobytes() == found.tobytes(), name


@pytest.mark.parametrize("seed", range(6))
def test_random_trees_in_numpy(seed: int) -> None:
    scene = random_tree(seed)
    looped, unrolled = (eomgen.compile(scene, "articulated", "numpy", loops=form) for form in (True, False))
    states = random_state(scene, seed, (5,))
    for name in (name for name in FUNCTIONS if name in looped.__all__):
        expected = call(unrolled, name, states)
        atol = 1e-8 * np.abs(expected).max(initial=0)
        np.testing.assert_allclose(call(looped, name, states), expected, rtol=1e-6, atol=atol, err_msg=name)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("seed", range(3))
def test_loops_in_turns_compiled(backend: str, seed: int) -> None:
    """Three kinds at random, in both back ends, against straight-line code."""
    scene = mixed_tree(seed, 40, few=("rigid", "telescopic", "point-masses"))
    looped = eomgen.compile(scene, "articulated", backend, loops=True)
    unrolled = eomgen.compile(scene, "articulated", "numpy", loops=False)
    assert all("loops" in looped.info["forms"][name] for name in looped.info["operations"])
    states = random_state(scene, seed, (19,))
    for name in looped.info["operations"]:
        expected, found = call(unrolled, name, states), call(looped, name, states)
        atol = 1e-9 * np.abs(expected).max(initial=0)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=atol, err_msg=name)
        if backend == "c":
            alone = np.stack([call(looped, name, State(*(x[k] for x in states))) for k in range(19)])
            assert alone.tobytes() == found.tobytes(), name


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_branching_tree_compiled(backend: str) -> None:
    """Parents by table, many children, and more links than the threshold."""
    numbers = random.Random(5)
    parents = [-1, *(numbers.randrange(max(0, i - 6), i) for i in range(1, 40))]
    scene = tree("bush", parents, "rigid")
    module = eomgen.compile(scene, "articulated", backend, functions=["forward_dynamics", "inverse_dynamics", "joints"])
    states = random_state(module, 6, (9,))
    a = call(module, "forward_dynamics", states)
    u = call(module, "inverse_dynamics", states._replace(a=a))
    np.testing.assert_allclose(u, states.u, rtol=0, atol=1e-9 * np.abs(a).max())
    dense = eomgen.compile(scene, "matrix", "numpy", functions=["bias", "mass_matrix", "joints"], loops=False)
    torques = np.einsum("sij,sj->si", call(dense, "mass_matrix", states), a) + call(dense, "bias", states)
    pushed = states.u.copy()
    for i, parent in enumerate(parents):
        if parent >= 0:
            pushed[:, parent] -= states.u[:, i]
    np.testing.assert_allclose(torques, pushed, rtol=0, atol=1e-9 * np.abs(a).max())
    np.testing.assert_allclose(call(module, "joints", states), call(dense, "joints", states), rtol=0, atol=1e-12)


def test_a_thousand_links_compiled() -> None:
    """Scene to module and a state through it, forwards and back, in both back ends."""
    found = []
    for backend in BACKENDS:
        names = ["forward_dynamics", "inverse_dynamics"]
        module = eomgen.compile(chain(1000, "rigid"), "articulated", backend, functions=names)
        state = random_state(module, 1, (3,))
        a = call(module, "forward_dynamics", state)
        u = call(module, "inverse_dynamics", state._replace(a=a))
        assert np.abs(u - state.u).max() < 1e-6 * np.abs(state.u).max()
        found.append(a)
    np.testing.assert_allclose(*found, rtol=0, atol=1e-6 * np.abs(found[0]).max())


# The text

TABLE = re.compile(r" *static const (?:int at\d+|short turns)\[\] = .*\n")


def c_text(equations: Equations, name: str) -> str:
    """The C of one function."""
    (program,) = pipeline.programs(equations, [name])
    return str(c_emit.function(program))


@pytest.mark.parametrize("model", ["rigid", "point-masses", "elastic-rod"])
@pytest.mark.parametrize("name", [*LINEAR, "mass_matrix"])
def test_length_of_the_text(name: str, model: str) -> None:
    """A chain of 1000 links has the lines of a chain of 40; only numbers grow."""
    few, many = (c_text(articulated(chain(links, model)), name) for links in (40, 1000 if name in LINEAR else 200))
    assert few.count("\n") == many.count("\n")
    # The list of coordinates above one, of which a link of free length has two, is no arithmetic progression.
    assert many.count("static const int") == 2 * (name == "mass_matrix" and model != "rigid")
    assert len(TABLE.sub("", many)) < 1.1 * len(TABLE.sub("", few))


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", [*LINEAR, "mass_matrix"])
def test_length_of_the_text_of_any_order(name: str, seed: int) -> None:
    """A row for every kind, whatever the order of the links and however many there are: only tables grow."""
    kinds = ("rigid", "telescopic", "point-masses")
    sizes = (60, 240) if name == "mass_matrix" else (60, 240, 1000)
    texts = []
    for links in sizes:
        numbers = random.Random(seed * links)
        models = [*kinds, *(numbers.choice(kinds) for _ in range(links - 6)), *kinds]
        # The first three are inside the tree, the last three are tips.
        parents = [-1, 0, 1, 2, *(numbers.randrange(1, i) for i in range(4, links))]
        texts.append(c_text(articulated(tree("any", parents, models)), name))
    assert len({text.count("\n") for text in texts}) == 1
    assert all(len(TABLE.sub("", text)) < 1.1 * len(TABLE.sub("", texts[0])) for text in texts)


def test_springs_make_no_kinds() -> None:
    """Whatever springs the links of a chain have, it is as many loops as without, and small ones for the springs."""
    numbers = random.Random(1)
    changes = {i: springs(numbers, "free") for i in range(60) if numbers.random() < 0.7}
    plain, sprung = (articulated(tree("sprung", line(60), "telescopic", changes=each)) for each in ({}, changes))
    assert loops.groups(plain.mechanism).members == loops.groups(sprung.mechanism).members
    text, longer = (c_text(equations, "forward_dynamics") for equations in (plain, sprung))
    assert longer.count("\n") < 2 * text.count("\n")
    assert_loops_are_exact(tree("sprung", line(9), "telescopic", changes={i: changes.get(i, {}) for i in range(9)}))


def test_number_of_kinds() -> None:
    """A tree of links of every model and mode: standing and hanging, not tips and sprung ones besides."""
    found = loops.groups(articulated(every_kind(1000)).mechanism)
    assert found.merged
    assert len(found.members) == 2 * (1 + 4 * 3) + 1  # and the root


def test_tables_are_shared() -> None:
    """Indices that differ by a constant share a table, so tables are few beside what they index."""
    (program,) = pipeline.programs(articulated(mixed_tree(2, 40)), ["forward_dynamics"], loops=True)
    text = str(c_emit.function(program))
    body = TABLE.sub("", text)
    assert len(re.findall(r"at\d+\[k\]", body)) > 4 * len(TABLE.findall(text))


TREES = {
    "binary": lambda n: [(i - 1) // 2 if i else -1 for i in range(n)],
    "comb": lambda n: [*range(-1, n // 2 - 1), *range(n // 2)],
    "three chains": lambda n: [i if i < 0 else i % n for i in range(-3, n - 3)],
}


@pytest.mark.parametrize("shape", TREES)
@pytest.mark.parametrize("name", ["forward_dynamics", "energy"])
def test_length_of_the_text_of_a_tree(name: str, shape: str) -> None:
    """Where runs are long, trees are as short as chains: only tables grow with the links."""
    few, many = (c_text(articulated(tree("tree", TREES[shape](links), "rigid")), name) for links in (66, 258))
    assert few.count("\n") == many.count("\n")


@pytest.mark.parametrize("name", LINEAR)
def test_numpy_text_of_a_chain(name: str) -> None:
    """The module of the NumPy back end is as short, but for the names of its elements."""

    def kernel(links: int) -> str:
        equations = articulated(chain(links, "telescopic"))
        model = pipeline.describe(equations, pipeline.programs(equations, [name]), ("float64",), {})
        return BACKENDS["numpy"].emit(model)["_kernel.py"]

    few, many = kernel(40), kernel(1000)
    assert few.count("\n") == many.count("\n")
    assert len(many) < 1.1 * len(few)


def test_runs_become_loops() -> None:
    """Links of one kind in a row are one loop, however many kinds there are."""
    models = ["rigid"] * 12 + ["telescopic"] * 9 + ["rigid"] * 15
    equations = articulated(tree("kinds", line(36), models))
    (program,) = pipeline.programs(equations, ["joints"])
    # The root and the tip stand alone.
    assert [block.count for block in program.blocks] == [1, 11, 9, 14, 1]
    titles = [block.title.partition(",")[0] for block in program.blocks]
    assert titles == ["link1", "link2 to link12", "link13 to link21", "link22 to link35", "link36"]


@pytest.mark.parametrize("accuracy", ["fast", "standard", "high"])
def test_folded_numbers_stand_in_tables(accuracy: str) -> None:
    """Numbers that all links share are in the code, others in tables; the loops are those of parameters."""
    equal, unequal = chain(30, "rigid"), tree("unequal", line(30), "rigid")
    for scene in (equal, unequal):
        (program,) = pipeline.programs(articulated(scene, fold=True), ["joints"])
        assert len([*parts(program.blocks)]) == 3
        assert any(array.name == "numbers" for array in program.scratch) == (scene is unequal)
    names = ["forward_dynamics", "energy"]
    folded = eomgen.compile(unequal, functions=names, fold=True, accuracy=accuracy)
    plain = eomgen.compile(unequal, functions=names)
    states = random_state(unequal, 3, (20,))
    for name, letters in (("forward_dynamics", "qvu"), ("energy", "qv")):
        found, expected = (
            getattr(folded, name)(*states.of(letters), []),
            getattr(plain, name)(*states.of(letters), plain.p),
        )
        assert abs(found - expected).max() <= {"fast": 1e-3}.get(accuracy, 1e-12) * abs(expected).max()


def test_parents_by_table() -> None:
    """In a branching tree the position of a link's joint is that of its parent's end, which a table tells."""
    numbers = random.Random(2)
    parents = [-1, *(numbers.randrange(i) for i in range(1, 60))]
    (program,) = pipeline.programs(articulated(tree("bush", parents, "rigid")), ["joints"], loops=True)
    assert in_turns(program)
    reads = [
        place.indices for block in parts(program.blocks) for place in block.loads.values() if place.array == "x_down"
    ]
    assert sorted(index for indices in reads for index in indices) == sorted(parents[1:])
    irregular = {indices for indices in reads if len({b - a for a, b in itertools.pairwise(indices)}) > 1}
    assert len(irregular) == 2  # inside the tree, and tips
    tables = re.findall(r"static const int at\d+\[\] = \{([\d, ]+)\};", str(c_emit.function(program)))
    assert {", ".join(map(str, indices)) for indices in irregular} <= {*tables}


# Operations


@pytest.mark.parametrize("name", LINEAR)
@pytest.mark.parametrize("model", LINK_TYPES)
def test_operations_are_linear(model: str, name: str) -> None:
    """Every further link costs the same, per state and per set of parameters."""
    counts = []
    for links in (10, 20, 30, 100):
        (program,) = pipeline.programs(articulated(chain(links, model)), [name], loops=True)
        rates = program_operations(program)
        counts.append([sum(rates[rate].values()) for rate in ("state", "parameters")])
    for few, more, many, most in zip(*counts, strict=True):
        assert many - more == more - few
        assert most - many == 7 * (more - few)


@pytest.mark.parametrize("name", LINEAR)
@pytest.mark.parametrize("case", ["rigid_5", "point_masses_5", "telescopic_5", "springs", "hanging_branch"])
def test_loops_cost_about_what_straight_line_code_costs(case: str, name: str) -> None:
    """Only what happens to cancel between neighbours of unlike kinds is lost."""
    equations = articulated(CASES[case])
    looped, straight = (
        sum(program_operations(pipeline.programs(equations, [name], loops=form)[0])["state"].values())
        for form in (True, False)
    )
    assert looped <= 1.25 * straight + 10


# Every index in the C text

INDEX = re.compile(r"\[([^\[\]]*)\]")
TERM = r"(\d+ [+-] )?(\d+ \* )?[ki]( [+-] \d+)?"
AFFINE = re.compile(rf"(h|\d+|{TERM}|{TERM} \+ {TERM}|turn|turns\[turn\])?$")


def assert_sound(text: str) -> None:
    """Indices are affine in the loop variable or from a table, and a fused multiply-add has three operands."""
    body = re.sub(r"/\*.*?\*/", "", TABLE.sub("", text), flags=re.DOTALL)
    for index in INDEX.findall(re.sub(r"at\d+\[([ki])\]", r"\1", body)):
        assert AFFINE.match(index), index
    for start in (found.end() for found in re.finditer(r"FMA\(", body)):
        depth, commas = 1, 0
        for character in body[start:]:
            depth += (character in "([{") - (character in ")]}")
            commas += character == "," and depth == 1
            if not depth:
                break
        assert commas == 2, body[start - 4 : start + 80]


@pytest.mark.parametrize(
    "parents",
    [(-1, -1, -1, 0, 2), (-1, -1, 0, 2, 3), (-1, 0, 1, 0, 3, 0, 5), (-1, -1, 0, 1, 2, 3), (-1, 0, 1, 1, 2, 3)],
)
@pytest.mark.parametrize("model", LINK_TYPES)
def test_indices_with_strides(model: str, parents: Sequence[int]) -> None:
    """Where every second or third link is a parent, an index is a product and a sum inside products and sums."""
    for program in pipeline.programs(articulated(tree("legs", parents, model)), loops=True):
        assert_sound(str(c_emit.function(program)))


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("scene", [random_tree, mixed_tree])
def test_indices_of_random_trees(scene: Callable[[int], Scene], seed: int) -> None:
    for program in pipeline.programs(articulated(scene(seed)), loops=True):
        assert_sound(str(c_emit.function(program)))


# Which form is taken


def test_from_how_many_links() -> None:
    """Below the threshold straight-line code, from it on loops, and either when asked for."""
    below, above = (articulated(chain(choice.LOOPED_FROM - less, "rigid")) for less in (1, 0))
    assert not any(map(repeats, pipeline.programs(below, LINEAR)))
    assert all(map(repeats, pipeline.programs(above, LINEAR)))
    assert all(map(repeats, pipeline.programs(below, LINEAR, loops=True)))
    assert not any(map(repeats, pipeline.programs(above, LINEAR, loops=False)))
    assert 4 <= choice.LOOPED_FROM <= 60


@pytest.mark.parametrize("method", METHODS)
def test_loops_are_those_of_the_recursion(method: str) -> None:
    """The formulas of a method stand in straight-line code; from the threshold on they give way to loops."""
    below, above = (eomgen.derive(chain(choice.LOOPED_FROM - less, "rigid"), method) for less in (1, 0))
    names = [*LINEAR[1:], "mass_matrix"]
    assert not any(map(repeats, pipeline.programs(below, names)))
    looped = pipeline.programs(above, names)
    assert [dump(program) for program in looped] == [
        dump(program) for program in pipeline.programs(articulated(chain(choice.LOOPED_FROM, "rigid")), names)
    ]
    assert {program.form for program in looped} == {"recursion in loops over links"}
    own = pipeline.programs(above, names, loops=False)
    assert not any(map(repeats, own))
    assert not any(program.form for program in own)
    forward, bias = pipeline.programs(above, ["forward_dynamics", "bias"], solver="dense")
    assert (forward.form, repeats(forward), repeats(bias)) == ("dense elimination", False, True)


def test_runs_or_turns() -> None:
    """Long runs are loops of their own, one after the other; kinds that alternate take turns."""
    runs, alternating = ["rigid"] * 20 + ["telescopic"] * 20, ["rigid", "telescopic"] * 20
    for models, expected in ((runs, False), (alternating, True)):
        scene = tree("kinds", line(40), models)
        (program,) = pipeline.programs(articulated(scene), ["joints"])
        assert in_turns(program) == expected
        assert sum(block.count for block in parts(program.blocks)) == 40
    assert [len(step.parts) for step in program.blocks] == [4]  # root, tip, and the two kinds between
    assert program.blocks[0].order == (0, *(1, 2) * 19, 3)


def assert_refused(kind: type[EomgenError], message: str, scene: Scene, method: str, **options: object) -> None:
    """Refused by `compile` with one line that says what to do."""
    with pytest.raises(kind, match=message) as caught:
        eomgen.compile(scene, method, "numpy", **options)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize("links", [3, 40])
def test_dense_solver_has_no_loops(links: int) -> None:
    options = {"loops": True} if links == 3 else {}
    message = "^the dense solver cannot be written as loops; use solver 'articulated' or loops=False$"
    assert_refused(OptionError, message, chain(links, "rigid"), "articulated", solver="dense", **options)


@pytest.mark.parametrize("solver", ["dens", "", None, 3])
@pytest.mark.parametrize("method", ["matrix", "articulated"])
def test_unknown_solver(method: str, solver: object) -> None:
    message = r"^unknown solver .*; allowed: auto, dense, articulated"
    assert_refused(OptionError, message, chain(2, "rigid"), method, solver=solver)


@pytest.mark.parametrize("method", METHODS)
def test_too_many_links_for_pairs(method: str) -> None:
    links = choice.MOST_DENSE_LINKS + 1
    message = f"^joints of {links} links by method '{method}' would write down {links * (links + 1) // 2} pairs of .*"
    own = {"loops": False, "functions": ["joints"]}
    assert_refused(UnsupportedError, message + "use method 'articulated'", chain(links, "rigid"), method, **own)
    message = message.replace("joints", "forward_dynamics")
    assert_refused(UnsupportedError, message, chain(links, "rigid"), method, solver="dense")


@pytest.mark.parametrize("method", METHODS)
def test_a_thousand_links_by_any_method(method: str) -> None:
    """No pair of links is written down."""
    built = pipeline.programs(eomgen.derive(chain(1000, "rigid"), method))
    assert all(map(repeats, built))
    assert sum(len(dump(program)) for program in built) < 30_000


@pytest.mark.parametrize(("models", "looped"), [("rrrreeee", True), ("rrrreett", False)])
def test_loops_need_links_of_a_kind(models: str, looped: bool) -> None:
    """Two links of a kind on average: eight links in four groups are loops, in five they are not."""
    names = {"r": "rigid", "e": "elastic-rod", "t": "telescopic", "j": "joint-masses"}
    scene = tree("kinds", line(8), [names[letter] for letter in models])
    equations = articulated(scene)
    assert len(loops.groups(equations.mechanism).members) == (4 if looped else 5)
    assert all(repeats(program) == looped for program in pipeline.programs(equations, ["bias", "energy"]))


def test_a_function_without_loops() -> None:
    """A chain of middle length has it written out, a long one not; nor does one that must be loops."""
    name = "regressor"
    message = rf"^{name} cannot be written as loops over links; allowed for \d+ links: forward_dynamics, "
    for links, options in ((choice.MOST_STRAIGHT_LINKS + 1, {}), (3, {"loops": True})):
        scene = chain(links, "rigid")
        assert_refused(UnsupportedError, message, scene, "articulated", functions=[name], **options)
    assert name not in LOOPED
    (program,) = pipeline.programs(articulated(chain(choice.LOOPED_FROM, "rigid")), [name])
    assert not repeats(program)


def test_energies_have_no_loops() -> None:
    sympy = pytest.importorskip("sympy", reason="energies are SymPy expressions")
    x = sympy.Function("x")(sympy.Symbol("t"))
    equations = eomgen.lagrangian(x.diff() ** 2, sympy.cos(x), [x])
    for options in ({"loops": True}, {"solver": "articulated"}):
        with pytest.raises(OptionError, match="need a scene; these equations come from energies"):
            pipeline.programs(equations, **options)


# The solver


def solved(equations: Equations, solver: str) -> int:
    """Operations of forward dynamics with a solver, constants included."""
    (program,) = choice.programs(equations, ["forward_dynamics"], False if _walks(equations) else None, solver)
    return program_operations(passes.run(program))["state"].total()


def _walks(equations: Equations) -> bool:
    return isinstance(equations, ArticulatedEquations)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "case", ["rigid_1", "rigid_3", "rigid_5", "telescopic_3", "point_masses_5", "fork", "star", "roots", "springs"]
)
def test_automatic_solver_has_the_fewest_operations(case: str, method: str) -> None:
    counts = {solver: solved(eomgen.derive(CASES[case], method), solver) for solver in choice.SOLVERS}
    assert counts["auto"] == min(counts.values())


def test_either_solver_is_chosen_somewhere() -> None:
    """Short chains are solved densely, long ones by the recursion."""
    short, long_ = (
        {solver: solved(eomgen.derive(chain(links, "rigid")), solver) for solver in choice.SOLVERS} for links in (2, 12)
    )
    assert short["auto"] == short["dense"] < short["articulated"]
    assert long_["auto"] == long_["articulated"] < long_["dense"]


def test_dense_solver_of_the_recursion() -> None:
    """Method "articulated" solves densely only when told to."""
    equations = articulated(CASES["rigid_3"])
    counts = {solver: solved(equations, solver) for solver in choice.SOLVERS}
    assert counts["auto"] == counts["articulated"] != counts["dense"]


# Depth


def emitted(links: int) -> int:
    """Derives, dumps and prints a chain in both back ends; the length of all texts."""
    equations = articulated(chain(links, "point-masses"))
    built = pipeline.programs(equations, LINEAR)
    model = pipeline.describe(equations, built, ("float64",), {})
    texts = [dump(program) for program in built]
    for backend in backends.BACKENDS.values():
        texts += backend.emit(model).values()
    return sum(map(len, texts))


def test_a_thousand_links_do_not_recurse() -> None:
    emitted(choice.LOOPED_FROM)  # imports and regular expressions, which do nest, are done once
    with shallow_stack(60):
        assert emitted(1000) > 0


def test_every_function_is_looped_or_says_so() -> None:
    """What a scene has by default can be written as loops."""
    scene = CASES["walker_rods_prescribed"]
    assert functions.select(articulated(scene), None) == [name for name in LOOPED if FUNCTIONS[name].default]
    assert [name for name in LOOPED if not FUNCTIONS[name].default] == [*choice.LOOPED_COLUMNS]
