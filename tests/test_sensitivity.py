"""The Jacobians of forward dynamics and the regressor of inverse dynamics: right, alike over methods, on request."""

import subprocess
import sys
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

import eomgen
from bench.cases import CASES, State, random_state
from eomgen import pipeline
from eomgen.backends import BACKENDS
from eomgen.errors import EomgenError, OptionError
from eomgen.frontends import METHODS
from eomgen.frontends.mechanism import Mechanism, MechanismEquations
from eomgen.functions import FUNCTIONS
from eomgen.ir.count import operations
from eomgen.ir.derivative import Tape
from eomgen.ir.equations import Equations
from eomgen.ir.expr import Node
from eomgen.ir.interpret import Digits, evaluate, fingerprint, run
from eomgen.scene import Scene
from eomgen.sensitivity import Regressor
from tests.conftest import Compiled
from tests.exact import exact
from tests.rounding import RunningError
from tests.scenes import scenes

SOME = ["rigid_3", "models_5", "telescopic_4_mixed", "hanging_branch", "springs", "massless"]
MORE = [*SOME, "point_masses_3", "roots", "centers", "weightless", "weightless_springs", "walker_rods_prescribed"]
RANDOM = settings(
    max_examples=25, derandomize=True, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow]
)


def jacobian(equations: Equations, name: str) -> list[Node]:
    """The elements of a Jacobian, row by row."""
    return list(FUNCTIONS[name].build(equations))


def directions(equations: Equations, name: str) -> list[Node]:
    """What the columns of a Jacobian are derivatives by."""
    return list(equations.p) if name == "parameter_jacobian" else [*equations.q, *equations.v, *equations.u]


# Against differences


def values_of(equations: Equations, state: State, arithmetic: Digits) -> dict[Node, Any]:
    """The 60-digit value of every symbol at a state."""
    symbols = equations.symbols
    rows = [node for row in symbols.w for node in row]
    given = [(symbols.q, state.q), (symbols.v, state.v), (symbols.a, state.a), (symbols.u, state.u)]
    given += [(tuple(rows), state.w.ravel()), (symbols.p, np.array(symbols.p_values))]
    return {node: arithmetic.number(x) for nodes, array in given for node, x in zip(nodes, array, strict=True)}


@pytest.mark.parametrize("name", ["jacobian", "parameter_jacobian"])
@pytest.mark.parametrize(
    ("case", "method"), [(case, method) for case in ["models_5", "springs"] for method in METHODS]
    + [("rigid_3", "matrix"), ("telescopic_4_mixed", "recursive"), ("hanging_branch", "articulated")],
)  # fmt: skip
def test_against_central_differences(case: str, method: str, name: str) -> None:
    """In 60 digits a step of 1e-20 leaves an error of about 1e-40 in the difference."""
    equations = eomgen.derive(CASES[case], method)
    arithmetic = Digits(60)
    values = values_of(equations, random_state(CASES[case], 4), arithmetic)
    n, step = len(equations.q), arithmetic.number(2.0**-66)
    found = evaluate(jacobian(equations, name), values, arithmetic)
    columns = directions(equations, name)
    assert len(found) == n * len(columns)
    for j, x in enumerate(columns):
        ahead, behind = (
            evaluate(equations.forward_dynamics, {**values, x: values[x] + sign * step}, arithmetic) for sign in (1, -1)
        )
        for i in range(n):
            difference = (ahead[i] - behind[i]) / (2 * step)
            error = abs(found[i * len(columns) + j] - difference)
            assert error <= 1e-25 * (1 + abs(difference)), (i, x.name)


@pytest.mark.parametrize("name", ["jacobian", "parameter_jacobian"])
@pytest.mark.parametrize("case", MORE)
def test_is_the_derivative_of_forward_dynamics_exactly(case: str, name: str) -> None:
    """By way of inverse dynamics or by differentiating the elimination itself: the same function."""
    equations = eomgen.derive(CASES[case], "matrix")
    tape = Tape(equations.forward_dynamics)
    columns = [tape.forward({x: equations.graph.one}) for x in directions(equations, name)]
    direct = [column[i] for i in range(len(equations.q)) for column in columns]
    assert exact(jacobian(equations, name)) == exact(direct)


# Over methods


@pytest.mark.parametrize("case", MORE)
def test_methods_agree(case: str) -> None:
    found = {}
    for method in METHODS:
        equations = eomgen.derive(CASES[case], method)
        found[method] = fingerprint([*jacobian(equations, "jacobian"), *jacobian(equations, "parameter_jacobian")])
    assert all(values == found["matrix"] for values in found.values())


@pytest.mark.parametrize("case", SOME)
def test_folded_numbers_are_the_parameters(case: str) -> None:
    scene = CASES[case]
    values = {parameter.name: Fraction(parameter.value) for parameter in scene.parameters}
    folded = eomgen.derive(scene, "matrix", fold=True)
    named = jacobian(eomgen.derive(scene, "matrix"), "jacobian")
    assert fingerprint(jacobian(folded, "jacobian")) == fingerprint(named, given=values)
    with pytest.raises(OptionError, match="unknown function 'parameter_jacobian'"):
        pipeline.programs(folded, ["parameter_jacobian"])


@pytest.mark.parametrize("method", ["matrix", "articulated"])
@pytest.mark.parametrize("case", SOME)
def test_shape(case: str, method: str) -> None:
    """(n, 2 n + nu) and (n, np), in the order q, v, u: the last columns are M⁻¹ times what an input exerts."""
    scene = CASES[case]
    n, nu, size = len(scene.q_names), len(scene.u_names), len(scene.parameters)
    first, second = pipeline.programs(eomgen.derive(scene, method), ["jacobian", "parameter_jacobian"])
    assert (first.name, first.output.shape) == ("jacobian", (n, 2 * n + nu))
    assert (second.name, second.output.shape) == ("parameter_jacobian", (n, size))
    assert first.signature.endswith(f"->({n},{2 * n + nu})")


def test_jacobian_is_never_dearer_than_the_matrix_forms() -> None:
    """The residual with fewer operations is differentiated."""
    for case in SOME:
        matrix = jacobian(eomgen.derive(CASES[case], "matrix"), "jacobian")
        for method in ("lagrange", "articulated"):
            other = jacobian(eomgen.derive(CASES[case], method), "jacobian")
            assert operations(other).total() <= operations(matrix).total()


def test_of_energies() -> None:
    """Equations of one's own have Jacobians, too, and no regressor."""
    sympy = pytest.importorskip("sympy", reason="energies are SymPy expressions")
    x, drag = sympy.Function("x")(sympy.Symbol("t")), sympy.Symbol("drag")
    equations = eomgen.lagrangian(
        2 * x.diff() ** 2, sympy.cos(x), [x], parameters={drag: 0.3}, dissipation=drag * x.diff() ** 2 / 2
    )
    module = eomgen.compile(equations, backend="numpy", functions=["jacobian", "parameter_jacobian"])
    # 4 ẍ = u + sin x - drag ẋ
    found = module.jacobian([0.7], [0.2], [1.0], module.p)
    np.testing.assert_allclose(found, [[np.cos(0.7) / 4, -0.3 / 4, 1 / 4]], rtol=1e-15)
    np.testing.assert_allclose(module.parameter_jacobian([0.7], [0.2], [1.0], module.p), [[-0.2 / 4]], rtol=1e-15)
    with pytest.raises(OptionError, match="unknown function 'regressor'"):
        pipeline.programs(equations, ["regressor"])
    with pytest.raises(AttributeError, match="regressor"):
        _ = module.regressor


# The regressor


def exact_parameters(scene: Scene) -> dict[str, Fraction]:
    """The inertial and elastic parameters of a scene, from the bodies of its links, without rounding."""
    found: dict[str, Fraction] = {}
    mechanism = Mechanism(scene, fold=True)
    for link in mechanism.links:
        bodies = [tuple(Fraction(mechanism.graph.node(x).value) for x in body) for body in link.bodies]
        sums = {
            "mass": sum(m for m, _, _, _ in bodies),
            "mass_alpha": sum(m * a for m, a, _, _ in bodies),
            "mass_beta": sum(m * b for m, _, b, _ in bodies),
            "mass_alpha2": sum(m * a**2 + inertia for m, a, _, inertia in bodies),
            "mass_alpha_beta": sum(m * a * b for m, a, b, _ in bodies),
            "mass_beta2": sum(m * b**2 for m, _, b, _ in bodies),
        }
        elastic = ("stiffness", "damping", "joint_stiffness", "joint_damping")
        sums |= {name: Fraction(link.value(name).value) for name in elastic}
        found |= {f"{link.name}.{name}": Fraction(value) for name, value in sums.items()}
    return found


def product(regressor: Regressor, b: Mapping[str, Fraction]) -> list[Node]:
    """Y b"""
    graph, width = regressor.symbols.graph, len(regressor.names)
    rows = [regressor.nodes[i : i + width] for i in range(0, len(regressor.nodes), width)]
    return [graph.sum(y * b[name] for y, name in zip(row, regressor.names, strict=True)) for row in rows]


def assert_regressor(scene: Scene) -> None:
    """Y b is inverse dynamics exactly, and `values` is b to rounding."""
    equations = eomgen.derive(scene, "matrix", fold=True)
    assert isinstance(equations, MechanismEquations)
    regressor, b = Regressor(equations), exact_parameters(scene)
    assert fingerprint(product(regressor, b)) == fingerprint(equations.inverse_dynamics)
    found = dict(zip(regressor.names, regressor.values, strict=True))
    for name, value in b.items():
        scale = max(abs(other) for other in b.values())
        assert abs(float(value) - found.get(name, 0.0)) <= 1e-14 * scale, name


@pytest.mark.parametrize("case", CASES)
def test_regressor_times_parameters_is_inverse_dynamics(case: str) -> None:
    assert_regressor(CASES[case])


@RANDOM
@given(scenes())
def test_regressor_of_random_scenes(scene: Scene) -> None:
    assert_regressor(scene)


@pytest.mark.parametrize("case", SOME)
def test_regressor_is_linear_in_other_parameters_too(case: str) -> None:
    """Y does not know the scene's masses: it serves those of a scene with all of them, and its springs, tripled."""
    scene = CASES[case]
    factor = {"stiffness", "damping", "mass", "masses", "inertia"}
    links = [
        {key: _times(value, 3) if {*key.split("_")} & factor else value for key, value in link.items()}
        for link in scene.to_dict()["links"]
    ]
    heavy = Scene.from_dict({**scene.to_dict(), "links": links})
    equations = eomgen.derive(scene, "matrix", fold=True)
    assert isinstance(equations, MechanismEquations)
    found = product(Regressor(equations), exact_parameters(heavy))
    assert fingerprint(found) == fingerprint(eomgen.derive(heavy, "matrix", fold=True).inverse_dynamics)


def _times(value: Any, factor: int) -> Any:
    return [x * factor for x in value] if isinstance(value, list) else value * factor


def test_regressor_of_a_pendulum() -> None:
    """u = (Σ m α² + J) φ̈ + g Σ m α cos φ: by hand."""
    scene = Scene("pendulum", (eomgen.Rigid(name="bob", mass=3.0, length=2.0, joint_damping=0.5),))
    module = eomgen.compile(scene, backend="numpy", functions=["regressor"])
    assert module.b_names == ("bob.mass", "bob.mass_alpha", "bob.mass_alpha2", "bob.joint_damping")
    np.testing.assert_allclose(module.b, [3.0, 3.0, 4.0, 0.5], rtol=1e-15)
    found = module.regressor([0.6], [-0.3], [1.7])
    np.testing.assert_allclose(found, [[0.0, 9.81 * np.cos(0.6), 1.7, -0.3]], rtol=1e-14)


# Compiled


def call(module: ModuleType, name: str, states: State) -> np.ndarray:
    """A function of a module by name at some states."""
    p = (module.p,) if FUNCTIONS[name].parameters else ()
    return np.asarray(getattr(module, name)(*states.of(FUNCTIONS[name].arguments), *p))


COMPILED = [("rigid_3", "matrix", "c"), ("springs", "articulated", "c")]
EVALUATED = [(case, method, "numpy") for case, method in zip(SOME, [*METHODS, *METHODS], strict=False)]
DERIVATIVES = ("jacobian", "parameter_jacobian", "regressor")


@pytest.mark.parametrize(("case", "method", "backend"), COMPILED + EVALUATED)
def test_right_to_rounding(case: str, method: str, backend: str, compiled: Compiled) -> None:
    """Every element is as near to its 60 digits as the rounding of the operations must leave it."""
    module = compiled(case, method, backend, functions=(*DERIVATIVES, "inverse_dynamics"))
    batch = random_state(module, 17, (3,))
    arithmetic = RunningError()
    for program in pipeline.programs(eomgen.derive(CASES[case], method), DERIVATIVES):
        found = call(module, program.name, batch)
        assert found.shape == (3, *program.output.shape)
        for k in range(3):
            arrays = {letter: array[k].ravel() for letter, array in batch._asdict().items()} | {"p": module.p}
            inputs = {a.name: [arithmetic.number(x) for x in arrays[a.name]] for a in program.inputs}
            expected = run(program, inputs, arithmetic)
            errors = arithmetic.errors(found[k].ravel(), expected)
            assert (errors <= np.finfo(float).eps * np.array([x.bound for x in expected])).all(), program.name
            scale = max(abs(float(x.value)) for x in expected)
            assert errors.max() <= 1e-10 * scale, program.name


@pytest.mark.parametrize(("case", "method", "backend"), COMPILED + EVALUATED)
def test_regressor_in_numbers(case: str, method: str, backend: str, compiled: Compiled) -> None:
    module = compiled(case, method, backend, functions=(*DERIVATIVES, "inverse_dynamics"))
    batch = random_state(module, 3, (50,))
    u = call(module, "inverse_dynamics", batch)
    np.testing.assert_allclose(call(module, "regressor", batch) @ module.b, u, rtol=0, atol=1e-12 * np.abs(u).max())


@pytest.mark.parametrize(("case", "method", "backend"), COMPILED)
def test_batch_is_its_states_bit_for_bit(case: str, method: str, backend: str, compiled: Compiled) -> None:
    module = compiled(case, method, backend, functions=(*DERIVATIVES, "inverse_dynamics"))
    batch = random_state(module, 8, (21,))
    for name in DERIVATIVES:
        alone = [call(module, name, State(*(x[k] for x in batch))) for k in range(21)]
        assert call(module, name, batch).tobytes() == np.stack(alone).tobytes(), name


# On request


@pytest.mark.parametrize("backend", BACKENDS)
def test_built_when_asked_for(backend: str, compiled: Compiled) -> None:
    """A default module has none of it, and the attribute once asked for stays."""
    module = compiled("elastic_rod_2", "recursive", backend)
    assert not {*DERIVATIVES, "b", "b_names"} & {*module.__all__, *vars(module)}
    states = random_state(module, 5, (4,))
    whole = compiled("elastic_rod_2", "recursive", "numpy", functions=(*DERIVATIVES, "inverse_dynamics"))
    for name in DERIVATIVES:
        np.testing.assert_allclose(call(module, name, states), call(whole, name, states), rtol=1e-10, atol=1e-10)
        assert getattr(module, name) is getattr(module, name)
    assert (module.b_names, module.b) == (whole.b_names, whole.b)
    assert len(module.b) == len(module.b_names) == module.regressor(*states.of("qvaw")).shape[-1]
    with pytest.raises(AttributeError, match="has no attribute 'jacobians'"):
        _ = module.jacobians


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("options", [{"fold": True}, {"functions": ["regressor"]}, {"fold": True, "accuracy": "high"}])
def test_products_beyond_float64_are_refused(options: dict[str, Any], backend: str) -> None:
    """(1e160 m)², where it is computed before the code is written."""
    if backend == "numpy" and "accuracy" in options:
        return
    scene = eomgen.chain(1, "rigid", length=1e160)
    with pytest.raises(EomgenError, match=r"1e3\d\d .*float64|regressor's b is inf"):
        eomgen.compile(scene, backend=backend, **options)


def test_request_keeps_types_and_fold() -> None:
    module = eomgen.compile(CASES["rigid_2"], "lagrange", "numpy", fold=True, dtypes=("float32", "float64"))
    state = State(*(x.astype("float32") for x in random_state(module, 2)))
    found = module.jacobian(state.q, state.v, state.u, module.p.astype("float32"))
    assert found.dtype == np.float32
    plain = eomgen.compile(CASES["rigid_2"], "lagrange", "numpy")
    np.testing.assert_allclose(found, plain.jacobian(state.q, state.v, state.u, plain.p), rtol=2e-4, atol=2e-4)
    with pytest.raises((AttributeError, EomgenError), match="parameter_jacobian"):
        _ = module.parameter_jacobian


def python(code: str, *arguments: str) -> str:
    """What a new Python process prints."""
    done = subprocess.run(
        [sys.executable, "-I", "-c", code, *arguments], text=True, capture_output=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    ("package", "names"), [("plain_leg", None), ("leg_with_regressor", ["forward_dynamics", "regressor"])]
)
def test_package_without_eomgen(package: str, names: Sequence[str] | None, tmp_path: Path) -> None:
    """What was not built cannot be had, and the error says so; the rest works."""
    eomgen.compile(CASES["rigid_2"], backend="numpy", functions=names, out=tmp_path / package)
    code = """
import importlib, sys
sys.modules["eomgen"] = None  # "import eomgen" fails
sys.path.insert(0, sys.argv[1])
leg = importlib.import_module(sys.argv[2])
print(leg.forward_dynamics([0.1, 0.2], [0, 0], [0, 0], leg.p).shape, hasattr(leg, "jacobian"), hasattr(leg, "b"))
try:
    leg.jacobian
except AttributeError as error:
    print(error)
"""
    first, second = python(code, str(tmp_path), package).splitlines()
    assert first == f"(2,) False {names is not None}"
    assert second == (
        f"jacobian was not built into {package!r} and eomgen is not installed to build it; "
        "compile with functions=[..., 'jacobian']"
    )


def test_package_with_eomgen(tmp_path: Path) -> None:
    module = eomgen.compile(CASES["rigid_2"], "recursive", "numpy", out=tmp_path / "leg_on_request")
    states = random_state(module, 1, (3,))
    assert call(module, "jacobian", states).shape == (3, 2, 6)
    assert module.jacobian.signature == "(2),(2),(2),(5)->(2,6)"
