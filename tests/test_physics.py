"""The equations say what mechanics says: one link by hand, a free flight, energy, and the structure of M.

Identities are tested exactly (see `tests/exact.py`); what is integrated or needs eigenvalues, in floating point.
"""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.integrate import solve_ivp

import eomgen
from bench.cases import CASES, line, tree
from eomgen.frontends import METHODS
from eomgen.frontends.mechanism import MechanismEquations
from eomgen.ir.derivative import Tape
from eomgen.ir.equations import Equations
from eomgen.ir.expr import Node
from eomgen.ir.interpret import Floats, evaluate
from eomgen.ir.program import flatten
from eomgen.scene import Scene
from tests.conftest import Compiled, RandomState
from tests.exact import P, differences, dot, exact, exact_groups, quantities
from tests.scenes import scenes

EPS = np.finfo(float).eps
SAMPLE = [
    "rigid_3", "elastic_rod_4_mixed", "joint_masses_4_mixed", "models_5", "roots", "hanging_branch", "weightless",
    "springs", "weightless_springs", "centers", "walker_rods_prescribed", "walker_lumped_free",
]  # fmt: skip


# One link by hand: the paper's equations (1) to (4), with the gravity arm of (1) where the rod's centre is


class Symbols:
    """The symbols of a one-link scene by short names: `s.mass`, `s.length_rate`."""

    def __init__(self, equations: Equations) -> None:
        self._graph = equations.graph

    def __getattr__(self, name: str) -> Node:
        return self._graph.symbol("gravity" if name == "gravity" else f"link1.{name}")

    @property
    def cos(self) -> Node:
        return self._graph.cos(self.angle)

    @property
    def sin(self) -> Node:
        return self._graph.sin(self.angle)


def rigid(s: Symbols) -> list[Node]:
    """(J + m c²) φ̈ + g m c cos φ"""
    inertia = s.inertia + s.mass * s.center * s.center
    return [inertia * s.angle_acceleration + s.gravity * s.mass * s.center * s.cos]


def elastic_rod(s: Symbols) -> list[Node]:
    """(I + m (ξ² + l ξ)) φ̈ + m (2 ξ + l) ξ̇ φ̇ + g m (ξ + l/2) cos φ and m ξ̈ - m (ξ + l/2) φ̇² + g m sin φ"""
    m, rod, x = s.mass, s.rod_length, s.length
    inertia, center = s.inertia + m * (x * x + rod * x), x + rod / 2
    turning = inertia * s.angle_acceleration + m * (2 * x + rod) * s.length_rate * s.angle_rate
    sliding = m * s.length_acceleration - m * center * s.angle_rate * s.angle_rate
    return [turning + s.gravity * m * center * s.cos, sliding + s.gravity * m * s.sin]


def telescopic(s: Symbols) -> list[Node]:
    """As the elastic rod, for the housing, and the rod's own inertia and weight."""
    m1, l1, m2, l2, x = s.rod_mass, s.rod_length, s.housing_mass, s.housing_length, s.length
    inertia = s.rod_inertia + m1 * l1 * l1 / 4 + s.housing_inertia + m2 * (x * x + l2 * x)
    turning = inertia * s.angle_acceleration + m2 * (2 * x + l2) * s.length_rate * s.angle_rate
    sliding = m2 * s.length_acceleration - m2 * (x + l2 / 2) * s.angle_rate * s.angle_rate
    weight = m1 * l1 / 2 + m2 * (x + l2 / 2)
    return [turning + s.gravity * weight * s.cos, sliding + s.gravity * m2 * s.sin]


def lumped(s: Symbols, masses: list[tuple[Node, Node | int]]) -> list[Node]:
    """θ l² φ̈ + 2 θ l l̇ φ̇ + g μ l cos φ and θ l̈ - θ l φ̇² + g μ sin φ, with μ = Σ m n and θ = Σ m n²"""
    length = s.length
    first, second = sum(m * n for m, n in masses), sum(m * n * n for m, n in masses)
    turning = second * length * (length * s.angle_acceleration + 2 * s.length_rate * s.angle_rate)
    sliding = second * (s.length_acceleration - length * s.angle_rate * s.angle_rate)
    return [turning + s.gravity * first * length * s.cos, sliding + s.gravity * first * s.sin]


def joint_masses(s: Symbols) -> list[Node]:
    """The mass at the joint does not move."""
    return lumped(s, [(s.mass2, s.fraction), (s.mass3, 1)])


def point_masses(s: Symbols) -> list[Node]:
    """Four masses at their fractions."""
    return lumped(s, [(getattr(s, f"mass{k}"), getattr(s, f"fraction{k}")) for k in range(1, 5)])


BY_HAND: dict[str, tuple[Callable[[Symbols], list[Node]], dict[str, float]]] = {
    "rigid": (rigid, {"center": 0.3, "inertia": 0.2}),
    "elastic-rod": (elastic_rod, {"inertia": 0.2}),
    "telescopic": (telescopic, {"rod_inertia": 0.1, "housing_inertia": 0.2}),
    "joint-masses": (joint_masses, {}),
    "point-masses": (point_masses, {}),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("model", BY_HAND)
def test_one_link_by_hand(model: str, method: str) -> None:
    write, numbers = BY_HAND[model]
    equations = eomgen.derive(tree("one", line(1), model, changes={0: numbers}), method)
    assert exact(equations.inverse_dynamics) == exact(write(Symbols(equations)))


UNIFORM: dict[str, dict[str, Callable[[Symbols], Node]]] = {
    "rigid": {"center": lambda s: s.length / 2, "inertia": lambda s: s.mass * s.length * s.length / 12},
    "elastic-rod": {"inertia": lambda s: s.mass * s.rod_length * s.rod_length / 3},
    "telescopic": {
        "rod_inertia": lambda s: s.rod_mass * s.rod_length * s.rod_length / 12,
        "housing_inertia": lambda s: s.housing_mass * s.housing_length * s.housing_length / 3,
    },
}


@pytest.mark.parametrize("model", UNIFORM)
def test_default_numbers_are_those_of_uniform_rods(model: str) -> None:
    given_, default = (
        eomgen.derive(tree("one", line(1), model, changes={0: numbers})) for numbers in (BY_HAND[model][1], {})
    )
    s = Symbols(given_)
    uniform = {getattr(s, name): exact([write(s)])[0] for name, write in UNIFORM[model].items()}
    assert exact(given_.inverse_dynamics, uniform) == exact(default.inverse_dynamics)


# A free flight


@pytest.mark.parametrize("masses", [{"masses": (2.0,), "fractions": (1.0,)}, {}], ids=["one mass", "four masses"])
@pytest.mark.parametrize("method", METHODS)
def test_free_link_flies_on_a_parabola(method: str, masses: dict[str, tuple[float, ...]]) -> None:
    """With no torque and no force nothing but gravity acts, reduced by μ/θ where some mass is not at the far end.

    Every mass moves as its fraction of the far end, so θ z̈ = -g μ: the end flies on a parabola.
    """
    scene = tree("flight", line(1), "point-masses", changes={0: masses})
    module = eomgen.compile(scene, method, "numpy")
    (link,) = scene.links
    first, second = (sum(m * n**k for m, n in zip(link.masses, link.fractions, strict=True)) for k in (1, 2))
    start, velocity = np.array([0.6, -0.3]), np.array([1.1, 4.0])
    angle, length = np.arctan2(start[1], start[0]), np.hypot(*start)
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    state = [angle, length, velocity @ across / length, velocity @ along]

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[2:], module.forward_dynamics(x[:2], x[2:], np.zeros(2), module.p)])

    times = np.linspace(0, 0.7, 8)
    flight = solve_ivp(rate, (0, 0.7), state, method="DOP853", t_eval=times, rtol=1e-12, atol=1e-12)
    assert flight.success
    ends = module.joints(flight.y[:2].T, module.p)[:, 0]
    fall = -scene.gravity * first / second * times**2 / 2
    exact_ends = start + velocity * times[:, None] + np.stack([0 * times, fall], axis=-1)
    # The integrator keeps each step's error below 1e-12; some hundred steps of a motion that is not unstable.
    np.testing.assert_allclose(ends, exact_ends, atol=1e-10, rtol=0)


# Energy


def power_of_inputs(equations: MechanismEquations, u: list[Node]) -> Node:
    """Each torque on the turn of its joint, each force on its length; what the prescribed lengths' forces give."""
    m, parents = len(equations.mechanism.links), equations.mechanism.parents
    rates = list(equations.v[:m])
    turns = [rate - rates[parent] if parent >= 0 else rate for rate, parent in zip(rates, parents, strict=True)]
    power = dot(u, [*turns, *equations.v[m:]])
    return power + equations.graph.sum(
        force * rate for force, (_, rate, _) in zip(equations.prescribed_forces, equations.w, strict=True)
    )


def power_of_dampers(equations: MechanismEquations) -> Node:
    """What all dampers take."""
    total = equations.graph.zero
    for link in equations.mechanism.links:
        turn = link.rate - (link.parent.rate if link.parent else 0)
        total = total + link.value("damping") * link.length_rate * link.length_rate
        total = total + link.value("joint_damping") * turn * turn
    return total


def energy_rate(equations: MechanismEquations, accelerations: list[Node]) -> Node:
    """d(T + V)/dt along the motion."""
    flow = dict(zip((*equations.q, *equations.v), (*equations.v, *accelerations), strict=True))
    for length, rate, acceleration in equations.w:
        flow |= {length: rate, rate: acceleration}
    return Tape([equations.kinetic + equations.potential]).forward(flow)[0]


def assert_energy_balance(equations: MechanismEquations) -> None:
    """dE/dt = power of u and of the prescribed lengths - power of the dampers, for any accelerations."""
    taken = power_of_dampers(equations)
    gained = energy_rate(equations, list(equations.a))
    given_ = power_of_inputs(equations, list(equations.inverse_dynamics))
    assert exact([gained]) == exact([given_ - taken])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", SAMPLE)
def test_energy_balance(case: str, method: str) -> None:
    assert_energy_balance(eomgen.derive(CASES[case], method))


@settings(max_examples=40, derandomize=True, deadline=None, database=None)
@given(scenes())
def test_energy_balance_of_random_scenes(scene: Scene) -> None:
    assert_energy_balance(eomgen.derive(scene, "matrix"))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", ["models_5", "roots", "springs", "walker_lumped_free"])
def test_energy_is_kept_or_changed_by_the_inputs_alone(case: str, method: str) -> None:
    """dE/dt of a motion that the inputs cause is their power less the dampers'; with neither it is zero.

    Prescribed lengths give power of their own, so those of the case stand still here.
    """
    equations = eomgen.derive(CASES[case], method)
    still = {symbol: 0 for row in equations.w for symbol in row[1:]}
    gained = energy_rate(equations, list(equations.forward_dynamics))
    balance = power_of_inputs(equations, list(equations.u)) - power_of_dampers(equations)
    assert exact([gained], still) == exact([balance], still)
    dampers = {p: 0 for p in equations.p if p.name.endswith("damping")}
    assert exact([gained], {**still, **dampers, **dict.fromkeys(equations.u, 0)}) == [0]
    assert exact([gained], still) != [0]


# The structure of the equations


def unit(equations: Equations, j: int | None) -> dict[Node, int]:
    """Accelerations of zero but for a unit one of coordinate j."""
    return {a: int(i == j) for i, a in enumerate(equations.a)}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", SAMPLE)
def test_mass_matrix_by_unit_accelerations(case: str, method: str) -> None:
    """Column j of M is what a unit acceleration of coordinate j asks for, less what none does: the bias."""
    equations = eomgen.derive(CASES[case], method)
    force = equations.generalised_force(equations.inverse_dynamics)
    rest = exact(force, unit(equations, None))
    assert rest == exact(equations.bias)
    n = len(equations.q)
    columns = [exact(force, unit(equations, j)) for j in range(n)]
    expected = exact(flatten(equations.mass_matrix))
    assert [(columns[j][i] - rest[i]) % P for i in range(n) for j in range(n)] == expected


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", CASES)
def test_mass_matrix_is_symmetric_and_positive_definite(case: str, method: str, random_state: RandomState) -> None:
    equations = eomgen.derive(CASES[case], method)
    M = equations.mass_matrix
    assert exact(flatten(M)) == exact(flatten(tuple(zip(*M, strict=True))))
    states, n = random_state(CASES[case], seed=7, batch=(30,)), len(M)
    values = dict(zip(equations.p, equations.symbols.p_values, strict=True))
    values |= dict(zip(equations.q, states.q.T, strict=True))
    values |= {row[0]: s for row, s in zip(equations.w, states.w[..., 0].T, strict=True)}
    found = evaluate(flatten(M), values, Floats())
    matrices = np.stack([np.broadcast_to(element, 30) for element in found], axis=-1).reshape(30, n, n)
    eigenvalues = np.linalg.eigvalsh(matrices)
    # An eigenvalue is known up to about n eps of the largest; a smaller one would say nothing.
    assert (eigenvalues[:, 0] > 10 * n * EPS * eigenvalues[:, -1]).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", SAMPLE)
def test_inverse_of_forward_dynamics_is_the_torque(case: str, method: str) -> None:
    equations = eomgen.derive(CASES[case], method)
    accelerations = dict(zip(equations.a, exact(equations.forward_dynamics), strict=True))
    assert exact(equations.inverse_dynamics, accelerations) == exact(equations.u)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", ["models_5", "hanging_branch", "walker_rods_prescribed"])
def test_inverse_of_forward_dynamics_in_numbers(
    case: str, method: str, random_state: RandomState, compiled: Compiled
) -> None:
    module = compiled(case, method)
    s = random_state(module, seed=3, batch=(50,))
    a = module.forward_dynamics(*s.of("qvuw"), module.p)
    u = module.inverse_dynamics(*s.of("qv"), a, *s.of("w"), module.p)
    M = module.mass_matrix(*s.of("qw"), module.p)
    size = np.abs(M).sum(axis=-1).max(axis=-1) * np.abs(a).max(axis=-1) + np.abs(s.u).max(axis=-1)
    # Elimination of a positive definite system solves one whose matrix is off by some n eps of M: the residual, which
    # is the error of u, is as small beside |M| |a|, whatever the condition of M.
    assert (np.abs(u - s.u).max(axis=-1) <= len(module.q_names) * EPS * size).all()


def test_bias_is_the_sum_of_its_parts() -> None:
    equations = eomgen.derive(CASES["springs"])
    parts = exact_groups(equations.bias_parts)
    assert [sum(values) % P for values in zip(*parts.values(), strict=True)] == exact(equations.bias)
    assert not any(exact(equations.bias_parts["gravity"], {equations.mechanism.gravity: 0}))


def test_two_roots_are_two_mechanisms() -> None:
    """Neither feels the other."""
    both = eomgen.derive(tree("two", (-1, -1), ("telescopic", "rigid")))
    alone = eomgen.derive(tree("alone", (-1,), "telescopic"))
    together, single = quantities(both), quantities(alone)
    found = {name: [together[name][i] for i in (0, 2)] for name in ("bias", "forward_dynamics", "inverse_dynamics")}
    assert not differences(exact_groups(found), exact_groups({name: single[name] for name in found}))
