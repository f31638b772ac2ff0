"""SymPy expressions to nodes and back, and equations from a user's own energies."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.errors import OptionError, UnsupportedError
from eomgen.ir.equations import Equations
from eomgen.ir.expr import Graph
from eomgen.ir.interpret import fingerprint

sympy = pytest.importorskip("sympy")
mechanics = pytest.importorskip("sympy.physics.mechanics")

from eomgen.symbolic import from_sympy, lagrangian, to_sympy  # noqa: E402

X, Y = sympy.symbols("x y", real=True)

EXPRESSIONS: list[Any] = [
    X + Y - 3,
    X * Y * sympy.Rational(2, 3),
    -X / Y,
    (X - Y) ** 3 / (X + 1) ** 2,
    sympy.sqrt(X + 2) * (Y + 1) ** sympy.Rational(-3, 2),
    sympy.sin(X) * sympy.cos(X - 2 * Y),
    sympy.exp(-X) * sympy.log(Y + 4),
    sympy.Integer(7),
    X * 0.1,
]


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_there_and_back(expression: Any) -> None:
    graph = Graph()
    node = from_sympy(expression, graph, {X: graph.symbol("x"), Y: graph.symbol("y")})
    (back,) = to_sympy([node])
    assert sympy.simplify(sympy.nsimplify(back - expression, rational=True)) == 0
    assert from_sympy(back, graph, {X: graph.symbol("x"), Y: graph.symbol("y")}) is not None


def test_tan_becomes_a_quotient() -> None:
    graph = Graph()
    x = graph.symbol("x")
    assert from_sympy(sympy.tan(X), graph, {X: x}) is graph.sin(x) / graph.cos(x)


def test_numbers_are_exact() -> None:
    graph = Graph()
    assert from_sympy(sympy.Float(0.1), graph, {}) is graph.constant(Fraction(0.1))
    assert from_sympy(sympy.Rational(1, 3), graph, {}) is graph.constant(Fraction(1, 3))
    assert abs(from_sympy(sympy.pi, graph, {}).value - Fraction(str(sympy.pi.evalf(50)))) < Fraction(1, 10**48)
    assert from_sympy(2, graph, {}) is graph.constant(2)


def test_names_in_sympy() -> None:
    graph = Graph()
    x, y = graph.symbol("x"), graph.symbol("y")
    mass = sympy.Symbol("m_1")
    assert to_sympy([x * y, -x], {"x": mass}) == [mass * Y, -mass]
    assert to_sympy([graph.pivot_inverse(x, y)]) == [1 / X]


def test_deep_expressions_from_sympy() -> None:
    """The walk through a SymPy expression does not recurse either."""
    expression = X
    for _ in range(2000):
        expression = sympy.Add(1, sympy.Mul(2, expression, evaluate=False), evaluate=False)
    graph = Graph()
    x = graph.symbol("x")
    node = from_sympy(expression, graph, {X: x})
    assert fingerprint([node]) == fingerprint([graph.constant(2**2000) * x + (2**2000 - 1)])


# A cart with a pendulum and a double pendulum in relative coordinates, beside SymPy's LagrangesMethod.

T_ = mechanics.dynamicsymbols._t


def cart_pole() -> tuple[Any, Any, list[Any], dict[Any, float], Any]:
    """Track position and pole angle; a spring and viscous friction on the cart."""
    x, theta = mechanics.dynamicsymbols("x theta")
    M, m, l, g, k, d = sympy.symbols("M m l g k d")  # noqa: E741
    xd, td = x.diff(T_), theta.diff(T_)
    kinetic = M * xd**2 / 2 + m * ((xd + l * td * sympy.cos(theta)) ** 2 + (l * td * sympy.sin(theta)) ** 2) / 2
    potential = m * g * l * sympy.cos(theta) + k * x**2 / 2
    return kinetic, potential, [x, theta], {M: 1.2, m: 0.3, l: 0.7, g: 9.81, k: 4.0, d: 0.5}, d * xd**2 / 2


def double_pendulum() -> tuple[Any, Any, list[Any], dict[Any, float], Any]:
    """Two point masses; the second angle is relative to the first rod."""
    a, b = mechanics.dynamicsymbols("a b")
    m1, m2, l1, l2, g = sympy.symbols("m1 m2 l1 l2 g")
    x1, y1 = l1 * sympy.sin(a), -l1 * sympy.cos(a)
    x2, y2 = x1 + l2 * sympy.sin(a + b), y1 - l2 * sympy.cos(a + b)
    speeds = [(x.diff(T_) ** 2 + y.diff(T_) ** 2) for x, y in ((x1, y1), (x2, y2))]
    kinetic = (m1 * speeds[0] + m2 * speeds[1]) / 2
    return kinetic, g * (m1 * y1 + m2 * y2), [a, b], {m1: 0.9, m2: 1.4, l1: 0.5, l2: 0.8, g: 9.81}, 0


SYSTEMS: dict[str, Callable[[], tuple[Any, Any, list[Any], dict[Any, float], Any]]] = {
    "cart_pole": cart_pole,
    "double_pendulum": double_pendulum,
}
Peer = Callable[[Any, Any, Any], tuple[Any, Any]]


@pytest.fixture(scope="module", params=SYSTEMS)
def system(request: pytest.FixtureRequest) -> tuple[Equations, Peer]:
    """Our equations, and SymPy's mass matrix and forcing vector as numbers."""
    kinetic, potential, q, parameters, dissipation = SYSTEMS[request.param]()
    ours = lagrangian(kinetic, potential, q, parameters, dissipation=dissipation)
    method = mechanics.LagrangesMethod(kinetic - potential, q)
    method.form_lagranges_equations()
    rates = [item.diff(T_) for item in q]
    damping = sympy.Matrix([sympy.diff(dissipation, rate) for rate in rates])
    symbols = sympy.symbols(f"q0:{len(q)} v0:{len(q)}")
    values = {**dict(zip(rates, symbols[len(q) :], strict=True)), **dict(zip(q, symbols, strict=False)), **parameters}
    numbers = [matrix.subs(values) for matrix in (method.mass_matrix, method.forcing - damping)]
    peer = sympy.lambdify(symbols, numbers, "numpy")

    def evaluate(q: Any, v: Any, u: Any) -> tuple[Any, Any]:
        mass, forcing = peer(*q, *v)
        return mass, forcing[:, 0] + u

    return ours, evaluate


@pytest.fixture(scope="module", params=["numpy", "c"])
def module(request: pytest.FixtureRequest, system: tuple[Equations, Peer]) -> ModuleType:
    return eomgen.compile(system[0], backend=request.param)


def test_dynamics_are_those_of_sympy(system: tuple[Equations, Peer], module: ModuleType) -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        q, v, u = rng.uniform(-2, 2, (3, 2))
        mass, forcing = system[1](q, v, u)
        a = np.linalg.solve(mass, forcing)
        np.testing.assert_allclose(module.mass_matrix(q, module.p), mass, rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(u - module.bias(q, v, module.p), forcing, rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(module.forward_dynamics(q, v, u, module.p), a, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(module.inverse_dynamics(q, v, a, module.p), u, rtol=1e-12, atol=1e-12)


def test_energy_is_the_users(system: tuple[Equations, Peer], module: ModuleType) -> None:
    q, v = np.array([0.3, -1.1]), np.array([0.7, 2.0])
    kinetic, potential = module.energy(q, v, module.p)
    mass, _ = system[1](q, v, 0)
    assert kinetic == pytest.approx(v @ mass @ v / 2, rel=1e-14)
    step = np.array([1e-6, 0])
    slope = (module.energy(q + step, v, module.p)[1] - module.energy(q - step, v, module.p)[1]) / 2e-6
    at_rest = module.bias(q, 0 * v, module.p)
    assert at_rest[0] == pytest.approx(slope, rel=1e-7, abs=1e-8)
    assert np.isfinite(potential)


def test_the_module_describes_itself(module: ModuleType) -> None:
    names = {"x": ("x", "theta"), "a": ("a", "b")}[module.q_names[0]]
    assert module.q_names == names
    assert module.v_names == tuple(f"{name}.rate" for name in names)
    assert module.u_names == tuple(f"{name}.force" for name in names)
    assert module.w_names == ()
    assert module.method == "lagrange"
    assert module.scene == {}
    assert not hasattr(module, "joints")
    assert len(module.p) == len(module.p_names)


def test_plain_symbols_with_given_rates(tmp_path: Path) -> None:
    """A pendulum on a spring in plain symbols; the package stands alone in a folder."""
    r, phi, rd, phid, m, k, g = sympy.symbols("r phi rd phid m k g")
    equations = lagrangian(
        m * (rd**2 + r**2 * phid**2) / 2,
        k * (r - 1) ** 2 / 2 - m * g * r * sympy.cos(phi),
        [r, phi],
        {m: 2.0, k: 30.0, g: 9.81},
        v=[rd, phid],
    )
    module = eomgen.compile(equations, backend="numpy", out=tmp_path / "spring_pendulum")
    assert module.p_names == ("m", "k", "g")
    q, v, u = np.array([1.2, 0.4]), np.array([0.3, -0.8]), np.array([1.0, 2.0])
    a = [
        q[0] * v[1] ** 2 - 15 * (q[0] - 1) + 9.81 * np.cos(q[1]) + u[0] / 2,
        (u[1] / 2 - 9.81 * q[0] * np.sin(q[1]) - 2 * q[0] * v[0] * v[1]) / q[0] ** 2,
    ]
    np.testing.assert_allclose(module.forward_dynamics(q, v, u, module.p), a, rtol=1e-13)


def test_functions_of_other_kinds(tmp_path: Path) -> None:
    """sqrt, exp, log and tan in an energy, differentiated and compiled."""
    x, v = sympy.symbols("x v")
    potential = sympy.sqrt(x**2 + 1) + sympy.exp(-x) + sympy.log(x + 3) + sympy.tan(x / 2)
    equations = lagrangian(v**2 * (2 + x**2) / 2, potential, [x], v=[v])
    module = eomgen.compile(equations, backend="numpy", functions=["bias", "energy"])
    at = np.array([0.7])
    force = float(sympy.diff(potential, x).subs(x, 0.7))
    assert module.bias(at, np.array([1.5]), module.p)[0] == pytest.approx(0.7 * 1.5**2 + force, rel=1e-14)
    assert module.energy(at, np.array([1.5]), module.p)[1] == pytest.approx(float(potential.subs(x, 0.7)), rel=1e-14)


# Errors

Q, V, M, K = sympy.symbols("q qd m k")
F = sympy.Function("f")


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (
            lambda: lagrangian(M * V**2 / 2, 0, [Q], v=[V]),
            OptionError,
            r"contain 'm', which is no coordinate, rate or parameter; give its value",
        ),
        (lambda: lagrangian(V**2 / 2, K * Q, [Q], {M: 1}, v=[V]), OptionError, "contain 'k', which is no coordinate"),
        (lambda: lagrangian(V**2 / 2, 0, [Q], v=[V], dissipation=K * V**2), OptionError, "contain 'k'"),
        (lambda: lagrangian(V**2 / 2, F(Q), [Q], v=[V]), OptionError, r"contain 'f\(q\)'"),
        (
            lambda: lagrangian(V**2 / 2, sympy.asin(Q), [Q], v=[V]),
            UnsupportedError,
            "'asin' is not supported; allowed: sums, products",
        ),
        (lambda: lagrangian(V**2 / 2, sympy.Abs(Q), [Q], v=[V]), UnsupportedError, "'Abs' is not supported"),
        (lambda: lagrangian(V**2 / 2, Q**V, [Q], v=[V]), UnsupportedError, "'Pow' is not supported"),
        (
            lambda: lagrangian(V**2 / 2, Q ** sympy.Rational(1, 3), [Q], v=[V]),
            UnsupportedError,
            "'Pow' is not supported",
        ),
        (lambda: lagrangian(V**2 / 2, sympy.I * Q, [Q], v=[V]), UnsupportedError, "'ImaginaryUnit' is not supported"),
        (lambda: lagrangian(V**2 / 2, sympy.oo, [Q], v=[V]), UnsupportedError, "'oo' is no finite number"),
        (lambda: lagrangian(V**2 / 2, sympy.nan, [Q], v=[V]), UnsupportedError, "'nan' is no finite number"),
        (lambda: lagrangian(V**2 / 2, sympy.zoo, [Q], v=[V]), UnsupportedError, "is not"),
        (lambda: lagrangian(0, 0, []), OptionError, "no coordinates; give at least one in q"),
        (
            lambda: lagrangian(V**2 / 2, 0, [Q]),
            OptionError,
            r"q are plain symbols, so their rates must be given: v=\[...\]",
        ),
        (
            lambda: lagrangian(V**2 / 2, 0, [Q], v=[V, K]),
            OptionError,
            "2 rates in v for 1 coordinates in q; give one each",
        ),
        (lambda: lagrangian(V**2 / 2, 0, [Q], v=[]), OptionError, "0 rates in v for 1 coordinates"),
        (
            lambda: lagrangian(V**2 / 2, 0, [Q], {Q: 1.0}, v=[V]),
            OptionError,
            "name 'q' stands twice among coordinates and parameters",
        ),
        (
            lambda: lagrangian(V**2 / 2, 0, [Q], {sympy.Symbol("q", positive=True): 1.0}, v=[V]),
            OptionError,
            "name 'q' stands twice",
        ),
        (
            lambda: lagrangian(V**2 / 2, 0, [sympy.Symbol("x y")], v=[V]),
            OptionError,
            "name 'x y' is no identifier; rename the symbol",
        ),
        (
            lambda: lagrangian(V**2 / 2, 0, [Q], {sympy.Symbol("θ"): 1.0}, v=[V]),
            OptionError,
            "name '.*' is no identifier",
        ),
        (
            lambda: lagrangian(V**2 / 2, 0, [sympy.Symbol('*/ int main() {system("x");} /*')], v=[V]),
            OptionError,
            "is no identifier",
        ),
        (
            lambda: lagrangian(V**2 / 2, 0, [sympy.Symbol("9" * 10_000)], v=[V]),
            OptionError,
            r"\(10000 characters\) is no identifier",
        ),
    ],
)
def test_refused(make: Callable[[], object], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words) as caught:
        make()
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 400


def test_text_is_not_evaluated(tmp_path: Path) -> None:
    """An energy is an expression; a string is refused, not handed to `sympify`, which would run it."""
    mark = tmp_path / "mark"
    with pytest.raises((OptionError, UnsupportedError)):
        lagrangian(V**2 / 2, f"__import__('pathlib').Path({str(mark)!r}).touch() or 1", [Q], v=[V])
    assert not mark.exists()


def test_an_energy_is_a_scalar() -> None:
    """qᵀ M q / 2 written with matrices is a 1 × 1 matrix: refused with a word of advice, not with a TypeError."""
    with pytest.raises((OptionError, UnsupportedError)):
        lagrangian(sympy.Matrix([[V**2 / 2]]), 0, [Q], v=[V])


def test_a_parameter_without_a_number() -> None:
    with pytest.raises(OptionError, match="m"):
        lagrangian(M * V**2 / 2, 0, [Q], {M: "heavy"}, v=[V])


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_parameter_that_is_not_finite(value: float) -> None:
    with pytest.raises(OptionError, match="m"):
        lagrangian(M * V**2 / 2, 0, [Q], {M: value}, v=[V])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"functions": ["joints"]}, "unknown function 'joints'; allowed: forward_dynamics"),
        ({"functions": ["prescribed_forces"]}, "unknown function 'prescribed_forces'"),
        ({"loops": True}, "need a scene"),
        ({"solver": "articulated"}, "need a scene"),
    ],
)
def test_what_only_scenes_have(options: dict[str, Any], words: str) -> None:
    equations = lagrangian(V**2 / 2, 0, [Q], v=[V])
    with pytest.raises(OptionError, match=words):
        eomgen.compile(equations, backend="numpy", **options)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_a_coordinate_without_mass(backend: str) -> None:
    """The mass matrix is singular, so nothing is a result, whatever is coupled to it."""
    x, y, vx, vy = sympy.symbols("x y vx vy", real=True)
    equations = lagrangian(vx**2 / 2, y**2, [x, y], v=[vx, vy])
    module = eomgen.compile(equations, backend=backend, functions=["forward_dynamics"])
    with np.errstate(invalid="ignore"):
        assert np.isnan(module.forward_dynamics([1.0, 2.0], [0.0, 0.0], [5.0, 7.0], module.p)).all()


def test_without_sympy(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(UnsupportedError, match=r"needs SymPy, which is not installed; pip install sympy"):
        lagrangian(V**2 / 2, 0, [Q], v=[V])


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_a_rate_without_kinetic_energy(backend: str) -> None:
    """A mass matrix that is singular in every state gives NaN and the flag, not garbage."""
    x, y, xd, yd = sympy.symbols("x y xd yd")
    equations = lagrangian(xd**2 / 2, x * y, [x, y], v=[xd, yd])
    module = eomgen.compile(equations, backend=backend, functions=["forward_dynamics"])
    one = np.ones(2)
    with np.errstate(invalid="ignore"):
        assert np.isnan(module.forward_dynamics(one, one, one, module.p)).any()
    with np.errstate(invalid="raise"), pytest.raises(FloatingPointError):
        module.forward_dynamics(one, one, one, module.p)
