"""The eomgen side of Table 1, measured by pytest-benchmark; `bench.table1` plans the cells and runs this file.

Cold: every round has a scene and a graph of its own, made from nothing; the untimed set-up of a round builds the
scene. Every cell first proves that it derives the same dynamics as the other methods and as the reference of
`bench.generation.mechanism`; only then is it timed.

The garbage collector stays on, as it is for a user. Before the rounds of a cell everything older is collected and
then frozen (`gc.freeze`), and before every round the graph of the round before is collected: a round pays for
collections of its own nodes, not for what pytest or other rounds left. The result of a round is kept until it is
over, so that its disposal is not timed.

`python -m bench.test_generation METHOD KIND LINKS` is one cold derivation in a fresh process, as
`bench.generation.one` is for the contenders: one line of JSON.
"""

from __future__ import annotations

import dataclasses
import functools
import gc
import json
import os
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bench import report
from bench.generation.mechanism import NOMINAL, Mechanism, Vector
from bench.generation.one import TOLERANCE
from eomgen import backends, pipeline
from eomgen.backends import cache
from eomgen.errors import BuildError
from eomgen.ir.count import program_operations
from eomgen.ir.equations import Equations
from eomgen.ir.expr import Node
from eomgen.ir.interpret import Floats, PrimeField, evaluate, fingerprint
from eomgen.model import Model
from eomgen.scene import Scene

if TYPE_CHECKING:
    import pytest

METHODS = ("lagrange", "recursive", "matrix", "articulated")
KINDS = tuple(NOMINAL)
EXACT_UP_TO = 20  # links for which methods are compared exactly; beyond, with the numeric reference alone
PLAN = "EOMGEN_TABLE1_PLAN"  # the environment variable with the plan: JSON, the keys of DEFAULT_PLAN
DEFAULT_PLAN: dict[str, Any] = {
    "front end": [[method, kind, links] for kind in KINDS for method in METHODS for links in (1, 2, 3)],
    "code generation": [],
    "compilation": [],
    "limit": 60.0,  # s, for one derivation
    "budget": 0.3,  # s of timed rounds per cell
    "progress": 2,  # the file descriptor that hears of finished cells
}
SHORT = {  # eomgen's parameter -> the reference's, without the link
    "point-masses": {
        f"{name}{k + 1}": f"{letter}{k}" for name, letter in (("mass", "m"), ("fraction", "n")) for k in range(3)
    },
    "elastic-rod": {"mass": "m", "rod_length": "l", "inertia": "I"},
    "rigid": {"mass": "m", "length": "l", "center": "c", "inertia": "J"},
}


def scene(kind: str, links: int) -> Scene:
    """The scene of a mechanism, with the same parameters as the contenders have: no inertia is left to a default."""
    numbers = NOMINAL[kind]
    values: dict[str, Any] = {short: numbers[name] for short, name in SHORT[kind].items()}
    if kind == "point-masses":
        values = {"masses": [numbers[f"m{k}"] for k in range(3)], "fractions": [numbers[f"n{k}"] for k in range(3)]}
    values.setdefault("length", "free")
    chain = [
        {"name": f"link{i}", "parent": f"link{i - 1}" if i else "ground", "model": kind, **values} for i in range(links)
    ]
    return Scene.from_dict({"name": f"chain{links}", "links": chain})


def generate(given: Scene, method: str) -> Equations:
    """What is timed: all of the mass matrix and the bias, or the recursion's accelerations."""
    equations = pipeline.derive(given, method)
    wanted = ("forward_dynamics",) if method == "articulated" else ("mass_matrix", "bias")
    for name in wanted:  # equations are lazy: reading builds
        getattr(equations, name)
    return equations


# Checks. The generalised force of the reference acts on the angles and lengths; eomgen's u are joint torques.


def outputs(equations: Equations) -> list[Node]:
    """The expressions that were generated: accelerations, or M row by row and then h."""
    if equations.method == "articulated":
        return list(equations.forward_dynamics)
    return [*(node for row in equations.mass_matrix for node in row), *equations.bias]


def check(equations: Equations, kind: str, links: int) -> tuple[str, float]:
    """How the dynamics were compared ("exact" includes "numeric"), and the largest numeric error.

    Raises:
        AssertionError: they differ.
    """
    error = max_error(equations, kind, links)
    assert error < TOLERANCE, f"the equations differ from the reference by {error:.1e}, more than {TOLERANCE:.0e}"
    if links > EXACT_UP_TO:
        return "numeric", error
    found, (mass_matrix, bias) = fingerprint(outputs(equations)), _exact(kind, links)
    if equations.method == "articulated":
        # M a + h - Q(u) = 0 at a random point of the prime field
        force = fingerprint(equations.generalised_force(equations.u))
        rows = (sum(m * a for m, a in zip(row, found, strict=True)) for row in mass_matrix)
        left = ((row + h - Q) % PrimeField.P for row, h, Q in zip(rows, bias, force, strict=True))
        assert not any(left), "the accelerations do not solve the equations of the matrix method"
    else:
        assert found == [*(x for row in mass_matrix for x in row), *bias], "the equations differ between methods"
    return "exact", error


@functools.cache
def _exact(kind: str, links: int) -> tuple[list[list[int]], list[int]]:
    """M and h of the matrix method at a random point of the prime field."""
    values = fingerprint(outputs(generate(scene(kind, links), "matrix")))
    n = len(Mechanism(kind, links).coordinates)
    return [values[n * i : n * (i + 1)] for i in range(n)], values[n * n :]


def max_error(equations: Equations, kind: str, links: int) -> float:
    """The largest difference from the reference, scaled by the largest entry, with equal and unequal links.

    Accelerations a are judged by what is left of M a + h - Q(u) with the reference's M and h, scaled by the
    sizes of the three terms. Chains beyond 100 links, whose reference takes seconds, meet one state only.
    """
    errors = []
    for seed, spread in enumerate((0.0, 0.1 / links)):
        if links > 100 and not spread:
            continue
        state = _state(kind, links, seed, spread)
        u = np.random.default_rng(seed).uniform(-5, 5, len(equations.u))
        found = np.array(evaluate(outputs(equations), _given(equations, state, u), Floats()), dtype=float)
        errors.append(_difference(equations.method, found, state, u))
    return float(np.max(errors))  # NaN stays NaN


@dataclasses.dataclass(frozen=True)
class _State:
    """A mechanism in a state, with the reference's mass matrix M and bias h."""

    mechanism: Mechanism
    q: Vector
    v: Vector
    M: Vector
    h: Vector


@functools.cache
def _state(kind: str, links: int, seed: int, spread: float) -> _State:
    mechanism = Mechanism(kind, links, spread)
    q, v = mechanism.random_state(seed)
    return _State(mechanism, q, v, *mechanism.reference(q, v))


def _given(equations: Equations, state: _State, u: Vector) -> dict[Node, float]:
    """The values of all symbols in a state."""
    kind, values = state.mechanism.kind, state.mechanism.parameters
    given: dict[Node, float] = {}
    for nodes, numbers in ((equations.q, state.q), (equations.v, state.v), (equations.u, u)):
        given.update(zip(nodes, numbers.tolist(), strict=True))
    for node in equations.p:
        link, _, short = node.name.partition(".")
        given[node] = values[f"{SHORT[kind][short]}_{link.removeprefix('link')}" if short else "g"]
    return given


def _difference(method: str, found: Vector, state: _State, u: Vector) -> float:
    n = len(state.h)
    if method == "articulated":
        force = u.copy()
        force[: state.mechanism.links - 1] -= u[1 : state.mechanism.links]
        left = np.abs(state.M @ found + state.h - force)
        return float(np.max(left) / np.max(np.abs(state.M) @ np.abs(found) + np.abs(state.h) + np.abs(force)))
    M, h = found[: n * n].reshape(n, n), found[n * n :]
    scaled = [np.max(np.abs(a - b)) / np.max(np.abs(b)) for a, b in ((M, state.M), (h, state.h))]
    return float(np.max(scaled))


# Cells.


def plan() -> dict[str, Any]:
    """What to measure: the plan of the environment, or a short one for whoever runs pytest on this file."""
    return {**DEFAULT_PLAN, **json.loads(os.environ.get(PLAN, "{}"))}


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Makes one test of every planned cell."""
    stage = metafunc.function.__name__.removeprefix("test_").replace("_", " ")
    cells = plan()[stage]
    metafunc.parametrize(("method", "kind", "links"), cells, ids=["/".join(map(str, cell)) for cell in cells])


@contextmanager
def limited(limit: float) -> Iterator[None]:
    """Lets the body run no longer than `limit` seconds of wall clock.

    Raises:
        TimeoutError: it did.
    """

    def stop(*_: object) -> None:
        raise TimeoutError(f"> {limit:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, limit)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


class Cell:
    """One cell of the table: its checks and its rounds.

    Args:
        benchmark: the fixture of pytest-benchmark.
        stage: "front end", "code generation" or "compilation".
        method: one of `METHODS`.
        kind: one of `KINDS`.
        links: the number of links.
    """

    def __init__(self, benchmark: Any, stage: str, method: str, kind: str, links: int) -> None:
        self.benchmark = benchmark
        self.stage, self.method, self.kind, self.links = stage, method, kind, links
        self.kept: list[object] = []
        benchmark.extra_info.update(stage=stage, path=method, kind=kind, links=links)

    @contextmanager
    def measured(self) -> Iterator[None]:
        """Shows the cell when it is done; what goes wrong in it is its result."""
        name = report.cell_name(self.stage, self.method, self.kind, self.links)
        import pytest  # here, as a fresh process has no use for it

        try:
            yield
        except (AssertionError, BuildError, TimeoutError) as error:
            problem = str(error) if isinstance(error, TimeoutError) else f"error: {error}"
            self._tell(name + problem)
            pytest.fail(problem, pytrace=False)
        self._tell(name + report.seconds(self.benchmark.stats.stats.median))

    def _tell(self, line: str) -> None:
        os.write(plan()["progress"], f"{line}\n".encode())

    def fact(self, **facts: object) -> None:
        """Keeps something beside the times."""
        self.benchmark.extra_info.update(facts)

    def derive(self) -> Equations:
        """Equations of a graph of their own."""
        return generate(scene(self.kind, self.links), self.method)

    def checked(self) -> tuple[Equations, float]:
        """Equations that were checked, and the seconds that their derivation took."""
        given = scene(self.kind, self.links)
        with limited(plan()["limit"]):
            start = time.perf_counter()
            equations = generate(given, self.method)
            took = time.perf_counter() - start
        how, error = check(equations, self.kind, self.links)
        self.fact(check=how, max_error=error, nodes=len(equations.graph))
        return equations, took

    def rounds(self, target: Callable[..., object], prepare: Callable[[], Sequence[Any]], took: float) -> None:
        """Times rounds of `target`, each on what `prepare` gives it; `took` is what one takes about."""

        def setup() -> tuple[Sequence[Any], dict[str, Any]]:
            self.kept.clear()
            gc.collect()
            arguments = prepare()
            gc.collect()
            return arguments, {}

        def timed(*arguments: Any) -> None:
            self.kept.append(target(*arguments))

        count = 1 if took > 5 else min(max(int(plan()["budget"] / took), 3), 30)
        gc.collect()
        gc.freeze()
        try:
            with limited(plan()["limit"] * (count + 1)):
                self.benchmark.pedantic(timed, setup=setup, rounds=count)
        finally:
            gc.unfreeze()


def test_front_end(benchmark: Any, method: str, kind: str, links: int) -> None:
    """From the scene to the equations."""
    cell = Cell(benchmark, "front end", method, kind, links)
    with cell.measured():
        _, took = cell.checked()
        cell.rounds(generate, lambda: (scene(kind, links), method), took)


def program_text(equations: Equations) -> tuple[Model, dict[str, str]]:
    """What code generation makes of equations: programs, passes, C."""
    built = pipeline.programs(equations, ["forward_dynamics"])
    model = pipeline.describe(equations, built, ("float64",), {})
    return model, backends.select("c").emit(model)


def test_code_generation(benchmark: Any, method: str, kind: str, links: int) -> None:
    """From the equations to the C of `forward_dynamics`: elimination, program, passes, text."""
    cell = Cell(benchmark, "code generation", method, kind, links)
    with cell.measured():
        equations, _ = cell.checked()
        with limited(plan()["limit"]):
            start = time.perf_counter()
            model, files = program_text(equations)
            took = time.perf_counter() - start
        counts = program_operations(model.programs[0])
        cell.fact(operations=sum(counts["state"].values()), bytes=sum(map(len, files.values())))
        cell.rounds(program_text, lambda: (cell.derive(),), took)


def test_compilation(
    benchmark: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: str, kind: str, links: int
) -> None:
    """From the C of `forward_dynamics` to an extension module; the wrapper's object exists already."""
    cell, limit = Cell(benchmark, "compilation", method, kind, links), plan()["limit"]
    if shutil.which("timeout"):
        monkeypatch.setenv("CC", f"timeout {limit:g} {os.environ.get('CC') or 'cc'}")
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path.parent / "cache"))
    with cell.measured():
        equations, _ = cell.checked()
        backend = backends.select("c")
        try:
            module = pipeline.compile(equations, functions=["forward_dynamics"])
        except BuildError as error:
            raise (TimeoutError(f"> {limit:g} s") if "exit code 124" in str(error) else error) from None
        state, u = _state(kind, links, 1, 0.1 / links), np.ones(len(equations.u))
        values = _given(equations, state, u)
        found = module.forward_dynamics(state.q, state.v, u, [values[node] for node in equations.p])
        wrong = _difference("articulated", found, state, u)
        assert wrong < TOLERANCE, f"the compiled accelerations differ from the reference by {wrong:.1e}"
        cell.fact(max_error=wrong)
        model, files = program_text(equations)
        folders = (tmp_path / str(number) for number in range(1000))

        def prepare() -> tuple[Path, Model, bool]:
            folder = next(folders)
            cache.write(folder, files)
            return folder, model, False

        cell.rounds(backend.build, prepare, max(module.info["seconds"]["build"], 0.1))


def once(method: str, kind: str, links: int, checked: bool) -> dict[str, Any]:
    """The record of one derivation, cold only in a process that has derived nothing before."""
    given = scene(kind, links)
    gc.collect()  # imports are not timed, so neither is the collection of what they left
    start = time.perf_counter()
    equations = generate(given, method)
    took = time.perf_counter() - start
    record: dict[str, Any] = {"path": method, "kind": kind, "links": links, "seconds": took}
    if checked:
        try:
            record["check"], record["max_error"] = check(equations, kind, links)
        except AssertionError as error:
            record["error"] = str(error)
    return record


if __name__ == "__main__":
    print(json.dumps(once(sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4:] != ["unchecked"])))
