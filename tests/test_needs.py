"""Only what a scene needs is built: no gravity, no spring, no length and no function that it does not have."""

from collections.abc import Mapping

import pytest

import eomgen
from bench.cases import ALONG, CASES, JOINT, VARIABLE, line, tree
from eomgen import backends, pipeline
from eomgen.errors import OptionError
from eomgen.frontends import METHODS
from eomgen.ir.count import program_operations
from eomgen.ir.equations import Equations
from eomgen.ir.expr import reachable
from eomgen.ir.program import Program
from eomgen.scene import Scene
from tests.exact import quantities

WEIGHED = ("forward_dynamics", "inverse_dynamics", "bias", "energy")  # the functions that gravity acts in
LENGTHS = (".length_rate", ".length_acceleration", ".force")


def symbols(equations: Equations, *names: str) -> set[str]:
    """The symbols that some functions need, or all of them."""
    found = quantities(equations)
    nodes = [node for name in names or found for node in found[name]]
    return {node.name for node in reachable(nodes) if node.op == "symbol"}


def programs(scene: Scene, method: str) -> dict[str, Program]:
    """The programs of a method, with its own way of elimination."""
    solver = "articulated" if method == "articulated" else "dense"
    return {program.name: program for program in pipeline.programs(eomgen.derive(scene, method), solver=solver)}


def per_state(scene: Scene, method: str) -> dict[str, dict[str, int]]:
    """Operations of every function that are done for each state."""
    return {name: dict(program_operations(program)["state"]) for name, program in programs(scene, method).items()}


def total(counted: Mapping[str, int]) -> int:
    return sum(counted.values())


# Gravity


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("model", ["rigid", "telescopic", "point-masses"])
def test_without_gravity(model: str, method: str) -> None:
    heavy, light = (tree("chain", line(3), model, gravity=g) for g in (9.81, 0.0))
    equations = eomgen.derive(light, method)
    assert "gravity" not in symbols(equations)
    assert "gravity" not in [node.name for node in equations.p]
    assert all(node is equations.graph.zero for node in equations.bias_parts["gravity"])
    with_, without = per_state(heavy, method), per_state(light, method)
    assert [name for name in with_ if total(without[name]) < total(with_[name])] == list(WEIGHED)
    assert {name: with_[name] for name in ("mass_matrix", "joints")} == {
        name: without[name] for name in ("mass_matrix", "joints")
    }


# Lengths


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("model", VARIABLE)
def test_a_fixed_length_costs_what_a_rigid_link_costs(model: str, method: str) -> None:
    """What distinguishes the models are numbers; they are put together once per set of parameters.

    Lagrange's method writes down every body, so there a model of one body only can cost the same. In the articulated
    elimination inertia of the bodies and of their distances are terms apart: an operation per link may differ.
    """
    fixed, rigid = tree("fixed", line(3), model, 0.6), tree("rigid", line(3), "rigid")
    assert fixed.q_names == rigid.q_names
    assert not [name for name in symbols(eomgen.derive(fixed, method)) if name.endswith(LENGTHS)]
    if method != "lagrange" or model == "elastic-rod":
        costs, expected = per_state(fixed, method), per_state(rigid, method)
        if method == "articulated" and model != "elastic-rod":
            found, one_body = costs.pop("forward_dynamics"), expected.pop("forward_dynamics")
            assert abs(total(found) - total(one_body)) <= 3
        assert costs == expected


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("model", VARIABLE)
def test_a_prescribed_length_has_no_equation(model: str, method: str) -> None:
    scene = tree("given", line(3), model, ("prescribed", "free", "prescribed"))
    equations = eomgen.derive(scene, method)
    assert [node.name for node in equations.q] == ["link1.angle", "link2.angle", "link3.angle", "link2.length"]
    assert len(equations.mass_matrix) == len(equations.bias) == len(equations.forward_dynamics) == 4
    assert [row[0].name for row in equations.w] == list(scene.w_names) == ["link1.length", "link3.length"]
    assert {name for name in symbols(equations) if name.endswith(".force")} == {"link2.force"}
    # The motion of a prescribed length acts in the bias, and its value alone in M and the joints.
    given = {"link1.length_acceleration", "link3.length_acceleration", "link1.length_rate", "link3.length_rate"}
    assert given & symbols(equations, "mass_matrix", "joints") == set()
    assert given & symbols(equations, "energy") == {"link1.length_rate", "link3.length_rate"}
    assert "link1.length_acceleration" in symbols(equations, "bias")


@pytest.mark.parametrize("method", METHODS)
def test_cost_rises_with_the_freedom_of_the_lengths(method: str) -> None:
    fixed, prescribed, free = (
        total(per_state(tree("chain", line(3), "elastic-rod", length), method)["forward_dynamics"])
        for length in (0.6, "prescribed", "free")
    )
    assert fixed < prescribed < free


@pytest.mark.parametrize("method", METHODS)
def test_functions_of_prescribed_lengths_are_for_scenes_that_have_them(method: str) -> None:
    assert "prescribed_forces" not in programs(CASES["rigid_1"], method)
    assert "w" not in programs(CASES["rigid_1"], method)["bias"].arrays
    assert programs(CASES["walker_rods_prescribed"], method)["bias"].arrays["w"].shape == (5, 3)


# Springs


@pytest.mark.parametrize("method", METHODS)
def test_without_springs(method: str) -> None:
    """A spring of stiffness zero is none; each number that stands in a scene brings its own terms and no others."""
    lengths = ("free", "prescribed", None)
    models = ("elastic-rod", "telescopic", "rigid")

    def scene(changes: dict[str, float]) -> Scene:
        return tree("chain", line(3), models, lengths, changes={1: changes})

    bare = eomgen.derive(scene({}), method)
    assert all(node is bare.graph.zero for node in bare.bias_parts["springs"])
    assert not [node.name for node in bare.p if "stiffness" in node.name or "damping" in node.name]
    slack = scene({**dict.fromkeys([*ALONG, *JOINT], 0.0), "rest_length": 0.3, "joint_rest_angle": 0.1})
    assert per_state(slack, method) == per_state(scene({}), method)
    for key in ("stiffness", "damping", "joint_stiffness", "joint_damping"):
        sprung = eomgen.derive(scene({key: 2.0}), method)
        assert symbols(sprung) - symbols(bare) == {f"link2.{key}"}
        felt = per_state(scene({key: 2.0}), method)
        unfelt = per_state(scene({}), method)
        # A damper stores no energy, a spring acts wherever gravity does; along the prescribed length both act
        # in the force that the length needs, and nowhere else.
        in_joint, stores = key.startswith("joint"), key.endswith("stiffness")
        changed = {"forward_dynamics", "inverse_dynamics", "bias"} if in_joint else {"prescribed_forces"}
        assert {name for name in felt if felt[name] != unfelt[name]} == changed | ({"energy"} if stores else set())


# Functions


def emitted(scene: Scene, backend: str, functions: list[str] | None) -> str:
    """All text that a back end writes for a scene, but for the words that name what was not built."""
    equations = eomgen.derive(scene)
    built = pipeline.programs(equations, functions)
    model = pipeline.describe(equations, built, ("float64",), {})
    files = backends.BACKENDS[backend].emit(model)
    files["__init__.py"] = files["__init__.py"].partition("def __getattr__(")[0]
    return "\n".join(files.values())


@pytest.mark.parametrize("backend", backends.BACKENDS)
@pytest.mark.parametrize("name", ["mass_matrix", "energy", "joints", "bias", "prescribed_forces"])
def test_an_unrequested_function_has_no_code(name: str, backend: str) -> None:
    scene = CASES["walker_rods_prescribed"]
    alone, all_ = emitted(scene, backend, [name]), emitted(scene, backend, None)
    others = [other for other in programs(scene, "matrix") if other != name]
    assert [other for other in others if other in alone] == []
    assert [other for other in others if other not in all_] == []
    assert len(alone) < len(all_) / 2


def test_functions_that_do_not_exist() -> None:
    equations = eomgen.derive(CASES["rigid_1"])
    for names in (["prescribed_forces"], ["energie"]):
        with pytest.raises(OptionError, match=f"unknown function '{names[0]}'; allowed: forward_dynamics, "):
            pipeline.programs(equations, names)
    with pytest.raises(OptionError, match="no function requested"):
        pipeline.programs(equations, [])


@pytest.mark.parametrize("method", METHODS)
def test_what_nobody_reads_is_not_built(method: str) -> None:
    """The joints of a chain need no element of M: reading them makes a few nodes per link."""

    def nodes(links: int, *read: str) -> int:
        equations = eomgen.derive(tree("chain", line(links), "rigid"), method)
        before = len(equations.graph)
        for name in read:
            _ = getattr(equations, name)
        return len(equations.graph) - before

    few, more, many = (nodes(links, "joints") for links in (5, 10, 15))
    assert more - few == many - more
    assert few < nodes(5, "joints", "mass_matrix", "bias") / 3
