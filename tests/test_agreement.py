"""Every method gives the same functions, over all cases and over random scenes, exactly."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import eomgen
from bench.cases import CASES, line, link, tree
from eomgen import pipeline
from eomgen.errors import OptionError, SceneError
from eomgen.frontends import METHODS
from eomgen.frontends.recursive import RecursiveEquations
from eomgen.ir.derivative import Tape
from eomgen.ir.equations import Equations
from eomgen.ir.expr import Node
from eomgen.ir.interpret import PrimeField, run
from eomgen.regularity import check
from eomgen.scene import Scene
from tests.exact import differences, exact, exact_groups, flat, quantities, results
from tests.scenes import scenes

LETTERS = "ABCDEGHKΛ"
OTHERS = [method for method in METHODS if method != "matrix"]
RANDOM = settings(
    max_examples=60, derandomize=True, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow]
)


def named_matrices(equations: Equations) -> dict[str, Sequence[Node]]:
    """The elements of the paper's matrices by letter."""
    return {letter: flat(equations[letter]) for letter in LETTERS}


def assert_methods_agree(scene: Scene) -> None:
    """All quantities of all methods, and the named matrices of the methods that have them."""
    equations = {method: eomgen.derive(scene, method) for method in METHODS}
    expected = exact_groups(quantities(equations["matrix"]))
    for method in OTHERS:
        assert not differences(expected, exact_groups(quantities(equations[method]))), method
    matrices = [exact_groups(named_matrices(equations[method])) for method in ("matrix", "recursive")]
    assert not differences(*matrices)


@pytest.mark.parametrize("case", CASES)
def test_methods_agree(case: str) -> None:
    assert_methods_agree(CASES[case])


@RANDOM
@given(scenes())
def test_methods_agree_on_random_scenes(scene: Scene) -> None:
    check(eomgen.derive(scene))  # what is compared is finite
    assert_methods_agree(scene)


@pytest.mark.parametrize("case", CASES)
def test_the_kinetic_energy_is_that_of_differentiated_positions(case: str) -> None:
    """T of `lagrange` takes a velocity about a joint in polar coordinates; here nothing but positions is known."""
    equations = eomgen.derive(CASES[case], "lagrange")
    mechanism = equations.mechanism
    ends: list[tuple[Node, Node]] = []
    kinetic = mechanism.graph.zero
    flow = {link.angle: link.rate for link in mechanism.links}
    flow |= {link.length: link.length_rate for link in mechanism.links if link.varies}
    for body_link, parent in zip(mechanism.links, mechanism.parents, strict=True):
        x, y = ends[parent] if parent >= 0 else (mechanism.graph.zero,) * 2
        ends.append((x + body_link.L * body_link.cos, y + body_link.L * body_link.sin))
        for body in body_link.bodies:
            reach = body_link.reach(body.alpha, body.beta)
            vx, vy = Tape((x + reach * body_link.cos, y + reach * body_link.sin)).forward(flow)
            kinetic = kinetic + (body.mass * (vx * vx + vy * vy) + body.inertia * body_link.rate * body_link.rate) / 2
    assert exact([equations.kinetic]) == exact([kinetic])


def test_a_changed_coefficient_is_seen() -> None:
    """What makes the agreement above worth something: a relative change of 1e-12 in one element is found."""
    equations = eomgen.derive(CASES["models_5"])
    M = flat(equations.mass_matrix)
    changed = [*M[:-1], M[-1] * (1 + Fraction(1, 10**12))]
    assert [i for i, (a, b) in enumerate(zip(exact(M), exact(changed), strict=True)) if a != b] == [len(M) - 1]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", ["models_5", "springs", "centers", "walker_rods_prescribed", "weightless"])
def test_folded_numbers_are_the_parameters(case: str, method: str) -> None:
    scene = CASES[case]
    values = {parameter.name: Fraction(parameter.value) for parameter in scene.parameters}
    named = exact_groups(quantities(eomgen.derive(scene, method)), given=values)
    folded = eomgen.derive(scene, method, fold=True)
    assert folded.p == folded.symbols.p_values == ()
    assert not differences(named, exact_groups(quantities(folded)))


@pytest.mark.parametrize("method", ["matrix", "recursive"])
def test_matrices_by_letter(method: str) -> None:
    equations = eomgen.derive(CASES["telescopic_3"], method)
    assert set(equations.matrices) == set(LETTERS)
    assert equations["L"] == equations["Λ"]  # L is the paper's letter
    with pytest.raises(KeyError):
        equations["Z"]


# Programs: after all passes, in every form, still the functions that the equations say

FORMS: dict[str, tuple[str, dict[str, Any]]] = {
    "dense": ("matrix", {"solver": "dense"}),
    "automatic": ("lagrange", {}),
    "other solver": ("recursive", {"solver": "articulated"}),
    "walks": ("articulated", {"loops": False}),
    "walks, dense": ("articulated", {"loops": False, "solver": "dense"}),
    "loops": ("articulated", {"loops": True}),
}


def assert_programs_compute(equations: Equations, options: dict[str, Any]) -> None:
    field = PrimeField()
    expected = exact_groups(results(equations))
    found = {
        program.name: run(program, {a.name: [field.random(s) for s in a.symbols] for a in program.inputs}, field)
        for program in pipeline.programs(equations, **options)
    }
    assert not differences(expected, found)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("case", ["models_5", "telescopic_4_mixed", "roots", "hanging_branch", "springs", "weightless"])
def test_programs_compute_the_equations(case: str, form: str) -> None:
    method, options = FORMS[form]
    assert_programs_compute(eomgen.derive(CASES[case], method), options)


@settings(RANDOM, max_examples=40)
@given(scenes(), st.booleans())
def test_loops_over_random_scenes(scene: Scene, fold: bool) -> None:
    assert_programs_compute(eomgen.derive(scene, "articulated", fold), {"loops": True})


# Growing by one link


def grown(scene: Scene) -> RecursiveEquations:
    """The equations of a scene, derived for its first link and extended link by link."""
    equations = eomgen.derive(Scene(scene.name, scene.links[:1], scene.gravity), "recursive")
    for link_ in scene.links[1:]:
        equations = eomgen.extend(equations, link_)
    return equations


def assert_grown_is_whole(scene: Scene) -> None:
    equations = grown(scene)
    whole = eomgen.derive(scene, "recursive")
    assert equations.mechanism.scene == scene
    assert equations.symbols.p_values == whole.symbols.p_values
    expected, found = ({**quantities(e), **named_matrices(e)} for e in (whole, equations))
    assert not differences(exact_groups(expected), exact_groups(found))


@pytest.mark.parametrize(
    "case", ["rigid_5", "point_masses_5", "telescopic_4_mixed", "roots", "hanging_branch", "springs"]
)
def test_extended_link_by_link(case: str) -> None:
    assert_grown_is_whole(CASES[case])


@settings(RANDOM, max_examples=30)
@given(scenes())
def test_extended_random_scenes(scene: Scene) -> None:
    assert_grown_is_whole(scene)


def test_extending_keeps_the_shorter_equations() -> None:
    scene = CASES["springs"]
    shorter = eomgen.derive(Scene("shorter", scene.links[:-1]), "recursive")
    before = exact_groups(quantities(shorter))
    eomgen.extend(shorter, scene.links[-1])
    eomgen.extend(shorter, scene.links[-1])  # twice from the same start
    assert not differences(before, exact_groups(quantities(shorter)))


def new_nodes(links: int, parent: int) -> int:
    """Nodes that M and h need when a chain of telescopic links, already read, gets one more link."""
    equations = eomgen.derive(tree("chain", line(links), "telescopic"), "recursive")
    _ = equations.mass_matrix, equations.bias
    before = len(equations.graph)
    longer = eomgen.extend(equations, link(links, parent, "telescopic"))
    _ = longer.mass_matrix, longer.bias
    return len(equations.graph) - before


def test_a_link_on_the_ground_costs_the_same_whatever_stands_beside_it() -> None:
    assert new_nodes(2, -1) == new_nodes(12, -1)


def test_a_step_costs_the_depth_of_the_new_link() -> None:
    """The step itself, before any matrix is read: a sum and the cosine and sine of a difference per link above."""

    def step(links: int) -> int:
        start = eomgen.derive(tree("chain", line(links - 1), "rigid"), "recursive")
        equations = eomgen.extend(start, link(links - 1, links - 2, "rigid"))
        before = len(equations.graph)
        eomgen.extend(equations, link(links, links - 1, "rigid"))
        return len(equations.graph) - before

    costs = [step(links) for links in range(4, 10)]
    assert {b - a for a, b in pairwise(costs)} == {costs[1] - costs[0]}
    assert costs[1] - costs[0] <= 8


def test_only_grown_equations_are_extended() -> None:
    more = link(1, 0, "rigid")
    with pytest.raises(OptionError, match="method 'matrix' cannot be extended; derive with method 'recursive'"):
        eomgen.extend(eomgen.derive(CASES["rigid_1"]), more)
    with pytest.raises(SceneError, match="has this name already"):
        eomgen.extend(eomgen.derive(CASES["rigid_1"], "recursive"), link(0, -1, "rigid"))
