"""`eomgen verify` passes where all is well, and sees a planted error wherever one is planted.

Also the verifier of programs: every rule, on programs made by hand.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import pytest

from bench.cases import CASES
from eomgen import frontends, passes, verification
from eomgen.backends.c.printer import CPrinter
from eomgen.backends.numpy.printer import NumPyPrinter
from eomgen.catalog import chain, walker
from eomgen.cli import main
from eomgen.errors import OptionError, SingularError
from eomgen.frontends import articulated, lagrange
from eomgen.frontends.articulated import ArticulatedEquations
from eomgen.frontends.matrix import MatrixEquations
from eomgen.frontends.mechanism import MechanismEquations
from eomgen.frontends.recursive import RecursiveEquations
from eomgen.ir.expr import Graph, Node
from eomgen.ir.program import Array, Block, Inner, Place, Program, Rounds, Store, Turns
from eomgen.ir.statements import Text
from eomgen.ir.verify import verify as verify_program
from eomgen.verification import scaled_error, verify

METHODS = tuple(frontends.METHODS)
WRONG = Fraction(10**12 + 1, 10**12)  # the factor of a planted error: no tolerance may hide it

# All is well


@pytest.mark.parametrize(
    "name", ["rigid_2", "point_masses_2", "telescopic_3_prescribed", "springs", "massless", "fork"]
)
def test_passes_with_numpy(name: str) -> None:
    result = verify(CASES[name], backends=["numpy"], states=3)
    assert result.passed
    assert result.failures == 0
    assert list(result.programs) == list(METHODS)
    assert {item.function for item in result.measured} == set(result.identical)
    assert all(item.error < item.bound for item in result.measured)
    assert result.checks == 4 * (2 * len(result.identical) + 1)


def test_passes_with_every_back_end(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", "--links", "1", "--model", "elastic-rod", "--length", "prescribed", "--states", "2"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.endswith("chain1: all checks passed\n")
    for word in (*METHODS, "forward_dynamics", "prescribed_forces", "matrix/c", "articulated/numpy", "bound", "eps"):
        assert word in out
    assert "DIFFERENT" not in out
    assert "FAILED" not in out


def test_a_back_end_named_twice(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", "--links", "1", "--backend", "numpy", "--backend", "numpy", "--states", "1"]) == 0
    assert "all checks passed" in capsys.readouterr().out


def test_errors_of_options_and_scenes() -> None:
    with pytest.raises(OptionError, match="unknown back end 'fortran'"):
        verify(chain(1), backends=["fortran"])
    with pytest.raises(SingularError, match=r"swing_shank\.length has no inertia"):
        verify(walker(length="free"), backends=["numpy"])


def test_progress_is_told() -> None:
    told: list[str] = []
    verify(chain(1), backends=["numpy"], states=1, progress=told.append)
    assert told == [text for method in METHODS for text in (f"identity of {method}", f"errors of {method}, numpy")]


@pytest.mark.parametrize(
    ("computed", "exact", "error"),
    [
        ([1.0, 2.0], [1, 2], 0.0),
        ([1.0, 2.5], [1, 2], 0.25),
        ([[1.0], [3.0]], [1, 4], 0.25),
        ([0.5], [0], 0.5),
        ([float("nan"), 1.0], [1, 1], float("inf")),
        ([float("inf")], [1], float("inf")),
    ],
)
def test_scaled_error(computed: Any, exact: list[int], error: float) -> None:
    assert scaled_error(computed, [Fraction(value) for value in exact]) == error


# Planted errors in the methods

Plant = Callable[[pytest.MonkeyPatch], None]


def wrong_property(owner: type, name: str, spoil: Callable[[Any], Any]) -> Plant:
    """Spoils the value of a cached property of a method's equations."""

    def plant(patch: pytest.MonkeyPatch) -> None:
        right = vars(owner)[name].func
        planted = cached_property(lambda self: spoil(right(self)))
        planted.__set_name__(owner, name)
        patch.setattr(owner, name, planted)

    return plant


def wrong_function(owner: Any, name: str, spoil: Callable[[Any], Any]) -> Plant:
    """Spoils the result of a function or method."""

    def plant(patch: pytest.MonkeyPatch) -> None:
        right = getattr(owner, name)
        patch.setattr(owner, name, lambda *arguments: spoil(right(*arguments)))

    return plant


def one(position: int) -> Callable[[Any], Any]:
    """Scales one element of a vector."""

    def spoil(values: Any) -> Any:
        spoiled = list(values)
        spoiled[position] = spoiled[position] * WRONG
        return type(values)(spoiled)

    return spoil


def corner(i: int, j: int) -> Callable[[Any], Any]:
    """Scales one element of a matrix, here without its mirror image."""

    def spoil(rows: Any) -> Any:
        return type(rows)(one(j)(row) if number == i else row for number, row in enumerate(rows))

    return spoil


def part(name: str, position: int) -> Callable[[Any], Any]:
    """Scales one element of a part of the bias."""
    return lambda parts: {**parts, name: one(position)(parts[name])}


def added(parts: dict[str, Any]) -> dict[str, Any]:
    """Adds something tiny to the gravity part, which could be zero."""
    first, *rest = parts["gravity"]
    return {**parts, "gravity": (first + Fraction(1, 10**15), *rest)}


PLANTED: dict[str, tuple[str, Plant, set[str]]] = {
    "matrix, A": (
        "matrix",
        wrong_property(MatrixEquations, "A", corner(1, 1)),
        {"mass_matrix", "inverse_dynamics", "energy"},
    ),
    "matrix, half of A": ("matrix", wrong_property(MatrixEquations, "A", corner(0, 1)), {"mass_matrix", "energy"}),
    "matrix, B": ("matrix", wrong_property(MatrixEquations, "B", corner(1, 0)), {"bias", "inverse_dynamics"}),
    "matrix, C": ("matrix", wrong_property(MatrixEquations, "C", one(1)), {"bias"}),
    "matrix, D": ("matrix", wrong_property(MatrixEquations, "D", corner(0, 0)), {"bias"}),
    "matrix, E": ("matrix", wrong_property(MatrixEquations, "E", corner(0, 1)), {"mass_matrix", "energy"}),
    "matrix, G": ("matrix", wrong_property(MatrixEquations, "G", corner(1, 1)), {"mass_matrix", "energy"}),
    "matrix, H": ("matrix", wrong_property(MatrixEquations, "H", corner(0, 1)), {"bias"}),
    "matrix, K": ("matrix", wrong_property(MatrixEquations, "K", one(0)), {"bias"}),
    "matrix, Λ": ("matrix", wrong_property(MatrixEquations, "Lambda", corner(0, 1)), {"bias"}),
    "matrix, potential": (
        "matrix",
        wrong_property(MatrixEquations, "potential", lambda node: node * WRONG),
        {"energy"},
    ),
    "recursive, border": (
        "recursive",
        wrong_property(RecursiveEquations, "_borders", lambda found: [(P * WRONG, slope) for P, slope in found]),
        {"mass_matrix", "bias"},
    ),
    "recursive, corner": ("recursive", wrong_function(RecursiveEquations, "_corner", one(0)), {"mass_matrix"}),
    "recursive, energy": (
        "recursive",
        wrong_property(RecursiveEquations, "kinetic", lambda node: node * WRONG),
        {"energy"},
    ),
    "recursive, gravity": ("recursive", wrong_property(RecursiveEquations, "bias_parts", added), {"bias"}),
    "articulated, forward": (
        "articulated",
        wrong_function(articulated, "_apart", lambda node: node * WRONG),
        {"forward_dynamics"},
    ),
    "articulated, inverse": (
        "articulated",
        wrong_property(ArticulatedEquations, "inverse_dynamics", one(0)),
        {"inverse_dynamics"},
    ),
    "articulated, mass matrix": (
        "articulated",
        wrong_property(ArticulatedEquations, "mass_matrix", corner(0, 0)),
        {"mass_matrix"},
    ),
    "articulated, bias": ("articulated", wrong_property(ArticulatedEquations, "bias", one(2)), {"bias"}),
    "articulated, energy": ("articulated", wrong_property(ArticulatedEquations, "_energies", one(1)), {"energy"}),
    "lagrange, kinetic": (
        "lagrange",
        wrong_function(lagrange, "energies", one(0)),
        {"mass_matrix", "bias", "energy", "forward_dynamics", "inverse_dynamics"},
    ),
    "lagrange, gravity": ("lagrange", wrong_function(lagrange, "energies", one(1)), {"bias", "energy"}),
}


def outcome(text: str) -> dict[str, dict[str, str]]:
    """The first table of the report: quantity -> method -> word."""
    lines = text.splitlines()
    header = re.split(r"\s{2,}", lines[0])[1:]
    rows = {}
    for line in lines[2 : lines.index("")]:
        name, *words = re.split(r"\s{2,}", line)
        rows[name] = dict(zip(header, words, strict=True))
    return rows


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_error_is_found(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """A coefficient that is off by a trillionth: exit code 1, and the table names the method and the quantities."""
    method, plant, quantities = PLANTED[name]
    plant(monkeypatch)
    monkeypatch.setattr(verification, "_errors", lambda *arguments: [])  # the exact test alone must see it
    monkeypatch.setattr(verification.pipeline, "compile", lambda *arguments, **options: None)
    assert main(["verify", "--links", "2", "--backend", "numpy", "--states", "1"]) == 1
    out, err = capsys.readouterr()
    assert re.fullmatch(rf"eomgen: error: \d+ of \d+ checks failed for scene 'chain2': .* of {method}.*\n", err)
    table = outcome(out)
    differing = {quantity for quantity, row in table.items() if "DIFFERENT" in row.values()}
    assert quantities <= differing
    for quantity in differing - {"programs after passes"}:
        blamed = {column for column, word in table[quantity].items() if word == "DIFFERENT"}
        assert blamed == {method}  # the odd one out


def test_a_planted_error_in_full(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The whole command with its own report; the compiled functions are right about the wrong equations."""
    PLANTED["matrix, A"][1](monkeypatch)
    assert main(["verify", "--links", "2", "--backend", "numpy", "--states", "1"]) == 1
    out, err = capsys.readouterr()
    assert outcome(out)["mass_matrix"] == {
        method: "DIFFERENT" if method == "matrix" else "identical" for method in METHODS
    }
    assert "FAILED" in out.splitlines()[-1]
    assert err.startswith("eomgen: error: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize("name", ["prescribed_forces", "joints"])
def test_the_other_functions_are_compared_too(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    owner: type = MatrixEquations if name == "prescribed_forces" else MechanismEquations
    spoil = one(0) if name == "prescribed_forces" else corner(0, 1)
    right = vars(owner)[name].func
    planted = cached_property(lambda self: spoil(right(self)) if self.method == "matrix" else right(self))
    planted.__set_name__(owner, name)
    monkeypatch.setattr(owner, name, planted)
    result = verify(CASES["telescopic_3_prescribed"], backends=["numpy"], states=1)
    wrong = [
        (quantity, method) for quantity, row in result.identical.items() for method, same in row.items() if not same
    ]
    assert wrong == [(name, "matrix")]
    assert not result.passed


# Planted errors after the methods


def only(monkeypatch: pytest.MonkeyPatch, method: str = "matrix") -> None:
    monkeypatch.setattr(frontends, "METHODS", {method: frontends.METHODS[method]})


@pytest.mark.parametrize(("backend", "printer"), [("c", CPrinter), ("numpy", NumPyPrinter)])
def test_a_wrong_constant_in_the_emitted_text_is_measured(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], backend: str, printer: type
) -> None:
    """The methods and programs stay identical; the compiled energy is off by far more than rounding explains."""
    right = printer.constant

    def constant(self: Any, node: Node) -> Text:
        printed = right(self, node)
        return Text(printed.text.replace("0.5", "0.50000000001"), printed.rank, printed.depth, node)

    only(monkeypatch)
    monkeypatch.setattr(printer, "constant", constant)
    assert main(["verify", "--links", "1", "--backend", backend, "--states", "2"]) == 1
    out, err = capsys.readouterr()
    assert "DIFFERENT" not in out
    failed = [line for line in out.splitlines() if re.search(r"\d FAILED", line)]
    assert [line.split()[0] for line in failed] == ["energy"]
    assert f"matrix/{backend}" in out
    assert err.count("\n") == 1


@pytest.mark.parametrize("operator", [" + ", " - "])
def test_a_wrong_sign_in_the_emitted_text_is_measured(monkeypatch: pytest.MonkeyPatch, operator: str) -> None:
    right = NumPyPrinter.operation

    def operation(self: NumPyPrinter, node: Node, args: list[Text]) -> Text:
        printed = right(self, node, args)
        flipped = {" + ": " - ", " - ": " + "}[operator]
        return Text(printed.text.replace(operator, flipped), printed.rank, printed.depth, node)

    only(monkeypatch)
    monkeypatch.setattr(NumPyPrinter, "operation", operation)
    with np.errstate(invalid="ignore"):  # pivots may come out negative
        result = verify(chain(2), backends=["numpy"], states=2)
    assert all(same for row in result.identical.values() for same in row.values())
    assert result.programs == {"matrix": True}
    assert {item.function for item in result.measured if not item.passed} >= {"bias", "mass_matrix"} - (
        {"mass_matrix"} if operator == " - " else set()
    )
    assert not result.passed


def spoiled(program: Program) -> Program:
    """A pass that leaves a well-formed program of another function: its last result is doubled."""
    *before, last = program.blocks
    *stores, store = last.stores
    return replace(program, blocks=(*before, replace(last, stores=(*stores, replace(store, node=store.node + 1)))))


def dropped(program: Program) -> Program:
    """A pass that loses a result."""
    *before, last = program.blocks
    return replace(program, blocks=(*before, replace(last, stores=last.stores[:-1])))


def test_a_pass_that_changes_a_program_is_found(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    only(monkeypatch)
    monkeypatch.setattr(passes, "DEFAULT", (*passes.DEFAULT, ("spoil", spoiled)))
    assert main(["verify", "--links", "1", "--backend", "numpy", "--states", "1"]) == 1
    out, _ = capsys.readouterr()
    table = outcome(out)
    assert table["programs after passes"] == {"matrix": "DIFFERENT"}
    assert "DIFFERENT" not in [
        word for name, row in table.items() if name != "programs after passes" for word in row.values()
    ]


def test_a_pass_that_breaks_a_program_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(passes, "DEFAULT", (passes.DEFAULT[0], ("drop", dropped), passes.DEFAULT[1]))
    with pytest.raises(AssertionError, match="forward_dynamics, after drop: 1 elements of out are never stored"):
        verify(chain(1), backends=["numpy"], states=1)


# The verifier of programs


def parts() -> dict[str, Any]:
    """A valid program with constants and a loop, to be changed in one place."""
    graph = Graph()
    q, p, c, total, a = (graph.symbol(name) for name in ("q", "p", "c", "total", "a"))
    return {
        "graph": graph,
        "q": q,
        "inputs": (Array("q", (3,), "input", ("q0", "q1", "q2")), Array("p", (3,), "input", ("p0", "p1", "p2"))),
        "output": Array("out", (4,), "output"),
        "constants": (Block("squares", {p: Place("p", (0, 1, 2))}, (Store(Place("c", (0, 1, 2)), p * p),), 3),),
        "blocks": (
            Block("start", {q: Place("q", (1,))}, (Store(Place("sums", (0,)), q), Store(Place("out", (3,)), -q))),
            Block(
                "sums",
                {total: Place("sums", (0, 1, 2)), c: Place("c", (0, 1, 2)), q: Place("q", (2, 1, 0))},
                (Store(Place("sums", (1, 2, 3)), total + c * q), Store(Place("out", (0, 1, 2)), graph.sin(total))),
                3,
            ),
            Block(
                "more",
                {total: Place("sums", (3,)), a: Place("out", (0,))},
                (Store(Place("out", (3,)), total * a, add=True),),
            ),
        ),
        "scratch": (Array("c", (3,), "constants"), Array("sums", (4,), "work")),
    }


def program(changes: Mapping[str, Any]) -> Program:
    kept = {name: value for name, value in {**parts(), **changes}.items() if name not in ("graph", "q")}
    return Program("f", "a function", **kept)


def block(index: int, kind: str = "blocks", **changes: Any) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Changes one block."""

    def change(found: dict[str, Any]) -> dict[str, Any]:
        blocks = list(found[kind])
        made = {name: value(found, blocks[index]) if callable(value) else value for name, value in changes.items()}
        blocks[index] = replace(blocks[index], **made)
        return {kind: tuple(blocks)}

    return change


def extra(
    make: Callable[[Graph, Node], tuple[dict[Node, Place], tuple[Store, ...]]], kind: str = "blocks", count: int = 1
) -> Any:
    """Appends a block."""

    def change(found: dict[str, Any]) -> dict[str, Any]:
        loads, stores = make(found["graph"], found["q"])
        return {kind: (*found[kind], Block("extra", loads, stores, count))}

    return change


def loaded(array: str, *indices: int) -> Any:
    """A load of an element by a new symbol that is stored in nothing but a sum."""

    def make(graph: Graph, q: Node) -> Any:
        x = graph.symbol("x")
        return {x: Place(array, indices)}, (Store(Place("out", (3,) * len(indices)), x, add=True),)

    return make


def stored(array: str, *indices: int, add: bool = False) -> Any:
    return lambda graph, q: ({}, (Store(Place(array, indices), graph.one, add),))


def unknown_operation(graph: Graph, q: Node) -> Any:
    return {}, (Store(Place("out", (3,)), Node(graph, 10**6, "tan", (graph.one,)), add=True),)


def too_many_operands(graph: Graph, q: Node) -> Any:
    return {}, (Store(Place("out", (3,)), Node(graph, 10**6, "sin", (graph.one, graph.one)), add=True),)


def other_graph(graph: Graph, q: Node) -> Any:
    other = Graph()
    return {}, (Store(Place("out", (3,)), graph.one, add=True), Store(Place("out", (3,)), other.one, add=True))


def paired(found: dict[str, Any], first: Sequence[int] = (-1, 0, 0), **changes: Any) -> dict[str, Any]:
    """A symmetric matrix of three rows, pair by pair over zeros."""
    graph, every = Graph(), range(3)
    a, b = graph.symbol("a"), graph.symbol("b")
    zeros = Block("zeros", {}, (Store(Place("out", range(9)), graph.zero),), 9)
    fill = Block(
        "pairs",
        {a: Place("q", every), b: Place("p", (0, 0, 0), every)},
        (Store(Place("out", (0, 3, 6), every), a * b), Store(Place("out", every, (0, 3, 6)), a * b)),
        3,
        Inner(first, (-1, 0, 1)),
    )
    blocks = (zeros, replace(fill, **changes))
    return {"output": Array("out", (3, 3), "output"), "constants": (), "blocks": blocks, "scratch": ()}


def in_turns(found: dict[str, Any], order: Sequence[int]) -> dict[str, Any]:
    """The running sum of the program as two loops, of its first and last link and of the one between."""
    start, loop, more = found["blocks"]

    def part(*links: int) -> Block:
        loads = {x: replace(place, indices=[place.indices[k] for k in links]) for x, place in loop.loads.items()}
        stores = [
            replace(store, place=replace(store.place, indices=[store.place.indices[k] for k in links]))
            for store in loop.stores
        ]
        return replace(loop, loads=loads, stores=tuple(stores), count=len(links))

    return {"blocks": (start, Turns("sums in turns", (part(0, 2), part(1)), tuple(order)), more)}


def in_rounds(found: dict[str, Any], number: int = 1, **changes: Any) -> dict[str, Any]:
    """A matrix column by column, in each the products of q up to a row times an element of p; a block is changed."""
    graph, every = Graph(), range(3)
    q, x = graph.symbol("q"), graph.symbol("x")
    start = Block("start", {x: Place("p", (0,), every)}, (Store(Place("sums", (0,)), x),), rounds=3)
    walk = Block(
        "walk",
        {q: Place("q", every), x: Place("sums", every)},
        (Store(Place("sums", (1, 2, 3)), q * x), Store(Place("out", (0, 3, 6), every), q * x)),
        3,
        rounds=3,
    )
    steps = [start, walk]
    if changes:
        steps[number] = replace(steps[number], **{key: value(steps[number]) for key, value in changes.items()})
    blocks = (Rounds("columns", tuple(step for step in steps if step.stores)),)
    return {
        "output": Array("out", (3, 3), "output"),
        "constants": (),
        "blocks": blocks,
        "scratch": found["scratch"][1:],
    }


def moved(block: Block, array: str, *inner: int) -> dict[Node, Place]:
    """The loads of a block, from other elements by rounds."""
    return {
        x: Place(array, place.indices, inner) if place.array == array else place for x, place in block.loads.items()
    }


def last_moved(block: Block, *inner: int, add: bool = False) -> tuple[Store, ...]:
    """The stores of a block, the last one into other elements by rounds."""
    first, last = block.stores
    return first, replace(last, place=replace(last.place, inner=inner), add=add)


def stored_before(found: dict[str, Any]) -> dict[str, Any]:
    changed = in_rounds(found)
    (rounds,) = changed["blocks"]
    early = Block("early", {}, (Store(Place("sums", (3,)), rounds.steps[1].stores[0].node.graph.zero),))
    return {**changed, "blocks": (early, rounds)}


RULES: dict[str, tuple[Callable[[dict[str, Any]], dict[str, Any]], str]] = {
    "unknown operation": (extra(unknown_operation), "unknown operation 'tan'"),
    "operands": (extra(too_many_operands), "sin with 2 operands"),
    "free symbol": (block(0, loads={}), "'start' does not load the symbol 'q'"),
    "graphs": (extra(other_graph), "'extra' mixes graphs"),
    "array names": (lambda f: {"scratch": (*f["scratch"], Array("q", (1,), "work"))}, "array names .* are not unique"),
    "input written": (extra(stored("q", 0)), "q may not be written here"),
    "parameter written": (extra(stored("p", 0), "constants"), "p may not be written here"),
    "constants written late": (extra(stored("c", 0)), "c may not be written here"),
    "work written early": (extra(stored("sums", 0), "constants"), "sums may not be written here"),
    "output written early": (extra(stored("out", 0), "constants"), "out may not be written here"),
    "constants of the state": (
        extra(lambda graph, q: ({q: Place("q", (0,))}, (Store(Place("c", (0,)), q),)), "constants"),
        "'extra' may not read q",
    ),
    "constants of work": (extra(loaded("sums", 0), "constants"), "'extra' may not read sums"),
    "input out of range": (extra(loaded("q", 3)), r"reads q\[3\], which has no value"),
    "negative index": (extra(loaded("q", -1)), r"reads q\[-1\], which has no value"),
    "read before written": (block(0, stores=lambda f, b: b.stores[1:]), r"'sums' reads sums\[0\], which has no value"),
    "read in a loop before written": (
        block(
            1, loads=lambda f, b: {n: Place("sums", (0, 2, 2)) if p.array == "sums" else p for n, p in b.loads.items()}
        ),
        r"'sums' reads sums\[2\], which has no value",
    ),
    "constant never computed": (lambda f: {"constants": ()}, r"reads c\[0\], which has no value"),
    "store out of range": (extra(stored("out", 4)), r"out\[4\] is outside its 4 elements"),
    "store at a negative index": (extra(stored("sums", -1)), r"sums\[-1\] is outside its 4 elements"),
    "sum at a negative index": (extra(stored("sums", -1, add=True)), r"sums\[-1\] is outside its 4 elements"),
    "stored twice": (extra(stored("out", 0)), r"out\[0\] is stored twice"),
    "stored twice in a loop": (extra(stored("sums", 2, 2), count=2), r"sums\[2\] is stored twice"),
    "sum without a start": (block(0, stores=lambda f, b: b.stores[:1]), r"out\[3\] is added to before it has a value"),
    "indices of a load": (extra(loaded("q", 0, 1), count=1), "2 indices of q for 1"),
    "too few indices of a load": (extra(loaded("q", 0), count=2), "1 indices of q for 2"),
    "too few indices of a store": (extra(stored("out", 3, add=True), count=2), "indices"),
    "too many indices of a store": (extra(stored("out", 3, 3, add=True)), "indices"),
    "unknown array loaded": (extra(loaded("nowhere", 0)), "nowhere"),
    "unknown array stored": (extra(stored("nowhere", 0)), "nowhere"),
    "result missing": (block(1, stores=lambda f, b: b.stores[:1]), r"reads out\[0\]|never stored"),
    "results missing": (lambda f: {"output": Array("out", (6,), "output")}, "2 elements of out are never stored"),
    "read and added to": (
        extra(
            lambda graph, q: (
                {q: Place("out", (3,))},
                (Store(Place("out", (3,)), graph.one, add=True), Store(Place("out", (2,)), q, add=True)),
            )
        ),
        r"reads and writes out\[3\] at once",
    ),
    "pair stored twice": (lambda f: paired(f, first=(0, 0, 0)), r"out\[0\]"),
    "inner loop too long": (
        lambda f: paired(f, inner=Inner((-1, 0, 0), (-1, 0))),
        "3 indices of p for 2 inside or around",
    ),
    "inner loop without lists": (lambda f: paired(f, inner=Inner((0,), (-1, 0, 1))), "1 lists for 3 iterations"),
    "no inner loop": (lambda f: paired(f, inner=None), "3 indices of p for 0 inside or around"),
    "turns too early": (lambda f: in_turns(f, (1, 0, 0)), r"reads sums\[1\], which has no value"),
    "too few turns": (lambda f: in_turns(f, (0, 1)), r"the turns \{0: 1, 1: 1\} are not the iterations \{0: 2, 1: 1\}"),
    "too few rounds": (lambda f: in_rounds(f, rounds=lambda b: 2), "block 'walk' is not one of 3 rounds"),
    "a round after another": (
        lambda f: in_rounds(f, 0, stores=lambda b: ()),
        r"'walk' reads sums\[0\], which has no value",
    ),
    "rounds after others": (stored_before, r"'columns' stores into \['sums'\] again"),
    "a round reads outside": (
        lambda f: in_rounds(f, 0, loads=lambda b: moved(b, "p", 0, 1, 3)),
        r"'columns' reads p\[3\], which has no value",
    ),
    "a round stores outside": (
        lambda f: in_rounds(f, stores=lambda b: last_moved(b, 0, 1, 3)),
        "'columns' stores outside the 9 elements of out",
    ),
    "a round stores again": (
        lambda f: in_rounds(f, stores=lambda b: last_moved(b, 0, 1, 1)),
        "'columns' stores elements of out twice",
    ),
    "a round adds": (
        lambda f: in_rounds(f, stores=lambda b: last_moved(b, 0, 1, 2, add=True)),
        r"out\[0\] is added to before it has a value",
    ),
    "a round reads its results": (
        lambda f: in_rounds(f, 0, loads=lambda b: {x: Place("out", (0,), range(3)) for x in b.loads}),
        r"'columns' both loads and stores \['out'\] by rounds",
    ),
    "a list in a round": (lambda f: in_rounds(f, inner=lambda b: Inner((0,) * 3, (-1,) * 3)), "'walk' is not one of 3"),
    "indices by rounds": (lambda f: in_rounds(f, 0, loads=lambda b: moved(b, "p", 0, 1)), "2 indices of p for 3"),
    "turns of nothing": (lambda f: in_turns(f, (0, 1, 2)), "are not the iterations"),
}


def test_a_program_in_order() -> None:
    verify_program(program({}))
    verify_program(program(paired({})))
    verify_program(program(in_turns(parts(), (0, 1, 0))))
    verify_program(program(in_rounds(parts())))
    for _, run_pass in passes.DEFAULT:
        verify_program(run_pass(program({})))


@pytest.mark.parametrize("name", RULES)
def test_rules_of_programs(name: str) -> None:
    change, words = RULES[name]
    broken = program(change(parts()))
    with pytest.raises(AssertionError, match=f"^f, after some pass: .*({words})"):
        verify_program(broken, after="some pass")


def test_construction_is_named() -> None:
    with pytest.raises(AssertionError, match=r"^f, after construction: "):
        verify_program(program({"constants": ()}))
