"""Certified errors: compiled results against enclosures that are proved to hold the exact value.

An expression is evaluated in ball arithmetic (python-flint's `arb`; Johansson 2017) from the exact binary inputs, at a
precision that is raised until every ball is tight. The error of a compiled result is then a guaranteed figure, not
the difference of two approximations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from types import ModuleType
from typing import Any

import numpy as np

from eomgen import functions, pipeline
from eomgen.errors import OptionError, UnsupportedError, unknown
from eomgen.frontends.mechanism import LinkSymbols
from eomgen.hard import Case, State
from eomgen.ir.derivative import Tape
from eomgen.ir.expr import Node, reachable
from eomgen.ir.interpret import Label, Operators, evaluate
from eomgen.ir.program import Array, parts
from eomgen.looped import LOOPED
from eomgen.scene import Scene

FAR = 8  # rad: back ends correct differences of angles from here on for their rounding
TIGHT = 80  # bits that an enclosure must share with the exact value
MOST_BITS = 1 << 13
CONDITION_BITS = 1 << 12  # for condition numbers up to 1e600
MOST_LINKS = 24  # with every pair of links written down
SOLVED = ("forward_dynamics", "jacobian", "parameter_jacobian")  # functions that divide by the mass matrix

# What is measured: name -> method, loops over links, solver.
FORMS: dict[str, tuple[str, bool, str]] = {
    "lagrange": ("lagrange", False, "dense"),
    "recursive": ("recursive", False, "dense"),
    "matrix": ("matrix", False, "dense"),
    "articulated": ("articulated", False, "articulated"),
    "articulated loops": ("articulated", True, "articulated"),
}


def import_flint() -> Any:
    """python-flint.

    Raises:
        UnsupportedError: it is not installed.
    """
    try:
        import flint
    except ImportError:
        raise UnsupportedError(
            "certified errors need python-flint, which is not installed; pip install python-flint"
        ) from None
    return flint


class Balls(Operators):
    """Real numbers as balls of `arb`, at flint's current precision."""

    def __init__(self) -> None:
        self.flint = import_flint()

    def constant(self, value: int | Fraction) -> Any:
        return self.flint.arb(value.numerator) / self.flint.arb(value.denominator)

    def turn(self, angle: Node, values: Mapping[Node, Any], label: Label) -> tuple[Any, Any]:
        sine, cosine = values[angle].sin_cos()
        return cosine, sine

    def function(self, name: str, a: Any) -> Any:
        return getattr(a, name)()


def enclose(outputs: Sequence[Node], given: Mapping[Node, float]) -> list[Any]:
    """Balls that hold the exact values, with at least `TIGHT` correct bits each (or within 2^-1100 of zero).

    Args:
        outputs: the expressions.
        given: values of the symbols, taken as the binary numbers they are.

    Raises:
        UnsupportedError: python-flint is missing, or the values cannot be enclosed (a singular state).
    """
    flint = import_flint()
    bits, tiny = 256, flint.arb(2) ** -1100  # less than any float
    while bits <= MOST_BITS:
        with flint.ctx.workprec(bits):
            balls = evaluate(outputs, _balls(given), Balls())
            # A ball around an exact zero has no relative accuracy; it is tight once it is far below any other number.
            if all(ball.rel_accuracy_bits() >= TIGHT or abs(ball) < tiny for ball in balls):
                return balls
        bits *= 2
    raise UnsupportedError("the exact values cannot be enclosed; is the state singular?")


def _balls(given: Mapping[Node, Any]) -> dict[Node, Any]:
    """Binary numbers as balls without a radius, if the precision holds them."""
    return {node: _ball(value) for node, value in given.items()}


def _ball(value: float) -> Any:
    numerator, denominator = np.longdouble(value).as_integer_ratio()
    return import_flint().arb(numerator) / denominator


@dataclass(frozen=True)
class Certificate:
    """The certified error of one function of one module in one case.

    Attributes:
        scene, case: the scene's name and that of the state.
        method, backend, dtype, function: what was measured; method is a name of `FORMS`.
        scaled: the largest error over the largest entry of the result, in eps of the type; infinite if the result is
            not finite, NaN if it is and there is no exact one.
        componentwise: the largest relative error of an entry, in eps; infinite where a zero is missed.
        condition: of the function at the state, see `Exact.condition`; zero for long chains, where it is not computed.
        mass_condition: κ₂ of the mass matrix.
        unit_condition: κ₂ of the mass matrix scaled to a diagonal of ones; it does not depend on units.
        n: the number of coordinates.
        written: what rounding explains of the method as it is written, see `Exact.written`; computed where the error is
            above the bound, zero elsewhere.
    """

    scene: str
    case: str
    method: str
    backend: str
    dtype: str
    function: str
    scaled: float
    componentwise: float
    condition: float
    mass_condition: float
    unit_condition: float
    n: int
    written: float = 0.0

    @property
    def possible(self) -> float:
        """The error, in eps, that an eps of change in the arguments or in the elements of M explains."""
        return max(1.0, self.condition, self.unit_condition if self.function in SOLVED else 0.0)

    @property
    def bound(self) -> float:
        """8 n + 2 κ, in eps."""
        return 8.0 * self.n + 2.0 * self.possible

    @property
    def passed(self) -> bool:
        """Whether the error is explained; that there is no result, by a mass matrix singular to rounding."""
        if self.scaled == math.inf:
            return self.function in SOLVED and self.mass_condition * float(np.finfo(self.dtype).eps) >= 1
        return self.scaled <= max(self.bound, self.written)


class Exact:
    """The exact values of a scene's functions, and how much they magnify changes.

    All methods give the same functions (`eomgen.verification`), so one serves all: the articulated recursion, which is
    the shortest and has exact zeros where angles are equal.

    Args:
        scene: the scene.
        method: the method whose expressions are evaluated.
    """

    def __init__(self, scene: Scene, method: str = "articulated") -> None:
        self.equations = pipeline.derive(scene, method)
        self.links: list[LinkSymbols] = self.equations.mechanism.links  # type: ignore[attr-defined]

    def values(self, name: str, state: State) -> list[Any]:
        """Balls around the result of a function, see `enclose`."""
        nodes, given = self._expressions(name, state)
        return enclose(nodes, given)

    def condition(self, name: str, state: State) -> float:
        """How many eps the largest entry of a result moves if every argument moves by an eps of its own.

        max_i Σ_j |∂f_i/∂x_j| w_j / max_i |f_i| with w_j = |x_j| (Rice 1966). An angle is a point of the circle, so its
        w is 1 rad.
        """
        nodes, given = self._expressions(name, state)
        angles = {link.angle for link in self.links}
        return _moved(nodes, given, list(given), lambda node, value: 1 if node in angles else abs(value))

    def written(self, name: str, state: State) -> float:
        """How many eps it moves if the result of every operation does: what rounding does to the method as written.

        The sum above, over the operations in place of the arguments (Linnainmaa 1976; at first order). A difference of
        angles of which only sines and cosines are taken counts as `FAR` at most: back ends lose no more of it.
        """
        nodes, given = self._expressions(name, state)
        operations = [node for node in reachable(nodes) if node.args]
        other = {arg for node in operations if node.op not in ("sin", "cos") for arg in node.args}
        turns = {node for node in operations if node.op == "sub" and all(arg in given for arg in node.args)} - other
        return _moved(
            nodes, given, operations, lambda node, value: min(abs(value), FAR if node in turns else abs(value))
        )

    def mass_conditions(self, state: State) -> tuple[float, float]:
        """κ₂ of the mass matrix as it is, and scaled to a diagonal of ones."""
        flint = import_flint()
        n, balls = len(self.equations.q), self.values("mass_matrix", state)
        with flint.ctx.workprec(CONDITION_BITS):
            mass = [ball.mid() for ball in balls]
            roots = [mass[i * n + i].sqrt().mid() for i in range(n)]
            unit = [element / (roots[k // n] * roots[k % n]) for k, element in enumerate(mass)]
            return tuple(_condition(flint.arb_mat(n, n, entries)) for entries in (mass, unit))  # type: ignore[return-value]

    def _expressions(self, name: str, state: State) -> tuple[list[Node], dict[Node, Any]]:
        """A function's expressions and the values of its symbols."""
        (block,) = parts(functions.program(self.equations, name).blocks)
        values = {node: state[place.array].flat[place.indices[0]] for node, place in block.loads.items()}
        return [store.node for store in block.stores], values


def _moved(
    nodes: Sequence[Node], given: Mapping[Node, Any], wrt: Sequence[Node], weight: Callable[[Node, Any], Any]
) -> float:
    """max_i Σ_j |∂f_i/∂x_j| w_j / max_i |f_i| in balls of `CONDITION_BITS`."""
    flint = import_flint()
    slopes = [Tape([node]).reverse(wrt) for node in nodes]
    with flint.ctx.workprec(CONDITION_BITS):
        flat = [*nodes, *wrt, *(slope for row in slopes for slope in row)]
        values = [ball.mid() for ball in evaluate(flat, _balls(given), Balls())]
        weights = [weight(node, value) for node, value in zip(wrt, values[len(nodes) :], strict=False)]
        largest, moved = max(abs(value) for value in values[: len(nodes)]), flint.arb(0)
        for i in range(len(nodes) + len(wrt), len(values), len(wrt)):
            terms = (abs(slope) * w for slope, w in zip(values[i : i + len(wrt)], weights, strict=True))
            moved = max(moved, sum(terms, flint.arb(0)))
        return float(moved / largest) if largest else math.inf


def _condition(matrix: Any) -> float:
    """κ₂ = ‖A‖ ‖A⁻¹‖ of a matrix of balls."""
    try:
        inverse = matrix.inv()
    except ZeroDivisionError:
        return math.inf
    with np.errstate(over="ignore"):
        return float(np.exp(_log_norm(matrix) + _log_norm(inverse)))


def _log_norm(matrix: Any) -> float:
    """The logarithm of ‖A‖, whose elements need not be in the range of floats."""
    elements = [element.mid() for element in matrix.entries()]
    largest = max(abs(element) for element in elements)
    scaled = np.array([float(element / largest) for element in elements]).reshape(matrix.nrows(), -1)
    return float(largest.log()) + math.log(float(np.linalg.norm(scaled, 2)))


def check_options(names: Sequence[str] | None, dtypes: Sequence[str] | None) -> None:
    """Refuses what is no function and no number type, before any work.

    Raises:
        OptionError: there is none of that name.
    """
    for name in names or ():
        if name not in functions.FUNCTIONS:
            raise OptionError(unknown("function", name, functions.FUNCTIONS))
    if dtypes:
        pipeline.check_dtypes(dtypes)


def measure(
    cases: Sequence[Case],
    methods: Sequence[str] | None = None,
    backends: Sequence[str] = ("c", "numpy"),
    names: Sequence[str] | None = None,
    dtypes: Sequence[str] = ("float64",),
    progress: Callable[[str], None] | None = None,
) -> list[Certificate]:
    """The certified errors of compiled functions in some cases.

    The numbers of a case are rounded to each type first; what leaves the type's range is left out for it.

    Args:
        cases: the cases; those whose scenes have one name share modules.
        methods: of `FORMS`; default all. Scenes of more than `MOST_LINKS` links are measured as loops only, and their
            forward dynamics only.
        backends: "c", "numpy" or both.
        names: functions, default all that a module has by itself.
        dtypes: number types.
        progress: told what is being done.

    Raises:
        OptionError: there is no such function.
        UnsupportedError: python-flint is missing.
    """
    import_flint()
    tell = progress or (lambda text: None)
    found: list[Certificate] = []
    for name in dict.fromkeys(case.scene.name for case in cases):
        own = [case for case in cases if case.scene.name == name]
        scene = own[0].scene
        tell(f"exact values of {scene.name}")
        exact = Exact(scene)
        long = len(scene.links) > MOST_LINKS
        chosen = functions.select(exact.equations, names)
        if long:
            chosen = [name for name in chosen if name == "forward_dynamics"]
        modules: dict[tuple[str, str], ModuleType] = {}
        written = {"articulated": exact}
        for method in ["articulated loops"] if long else methods or FORMS:
            if method not in FORMS:
                raise OptionError(unknown("method", method, FORMS))
            origin, looped, solver = FORMS[method]
            kept = [name for name in chosen if not looped or name in LOOPED]
            if origin not in written:
                written[origin] = Exact(scene, origin)
            for backend in backends if kept else ():
                tell(f"modules of {scene.name}: {method}, {backend}")
                modules[method, backend] = pipeline.compile(
                    written[origin].equations,
                    backend=backend,
                    dtypes=dtypes,
                    functions=kept,
                    loops=looped,
                    solver=solver,
                )
        for case in own:
            for dtype in dtypes:
                tell(f"errors of {case.name}, {dtype}")
                found += _measure(case, dtype, written, modules, chosen)
    return found


def _measure(
    case: Case,
    dtype: str,
    written: Mapping[str, Exact],
    modules: Mapping[tuple[str, str], ModuleType],
    chosen: Sequence[str],
) -> list[Certificate]:
    """The certificates of one case in one type, none where arguments or exact results leave the type's range."""
    with np.errstate(over="ignore"):
        values = {letter: np.asarray(value, dtype) for letter, value in case.values.items()}
    least = np.finfo(dtype).tiny
    for letter, value in case.values.items():
        rounded = values[letter]
        if np.any((rounded != value) & ~((np.abs(rounded) >= least) & np.isfinite(rounded))):
            return []
    exact = written["articulated"]
    n = len(exact.equations.q)
    if len(exact.links) > MOST_LINKS:
        module = pipeline.compile(exact.equations, functions=["mass_matrix"])
        arguments = [case.values[array.name] for array in _inputs(exact, "mass_matrix")]
        conditions = float(np.linalg.cond(module.mass_matrix(*arguments))), float(module.condition(*arguments))
    else:
        conditions = exact.mass_conditions(values)
    found, largest = [], _ball(np.finfo(dtype).max)  # type: ignore[arg-type]
    for name in chosen:
        singular = name in SOLVED and conditions[1] == math.inf
        balls = [] if singular else exact.values(name, values)
        if math.isfinite(conditions[0]) and any(abs(ball) > largest for ball in balls):
            continue  # no number of the type is right
        condition = exact.condition(name, values) if not singular and len(exact.links) <= MOST_LINKS else 0.0
        arguments = [values[array.name] for array in _inputs(exact, name)]
        for (method, backend), module in modules.items():
            if name in vars(module):
                with np.errstate(all="ignore"):
                    computed = getattr(module, name)(*arguments)
                labels = case.scene.name, case.name, method, backend, dtype, name
                item = Certificate(*labels, *errors(computed, balls), condition, *conditions, n)
                if item.bound < item.scaled < math.inf:
                    item = replace(item, written=written[FORMS[method][0]].written(name, values))
                found.append(item)
    return found


def _inputs(exact: Exact, name: str) -> tuple[Array, ...]:
    return functions.inputs(exact.equations.symbols, functions.FUNCTIONS[name])


def errors(computed: Any, balls: Sequence[Any]) -> tuple[float, float]:
    """Upper bounds of the scaled and the componentwise error, in eps of the result's type.

    Args:
        computed: the result.
        balls: around its exact elements; none if the state is singular.
    """
    flat = np.asarray(computed).reshape(-1)
    if not np.all(np.isfinite(flat)):
        return math.inf, math.inf
    if not balls:
        return math.nan, math.nan
    eps = float(np.finfo(flat.dtype).eps)
    with import_flint().ctx.workprec(4 * TIGHT):
        upper = [float(abs(ball - _ball(got)).upper()) for got, ball in zip(flat, balls, strict=True)]
    sizes = [float(abs(ball).lower()) for ball in balls]
    scale = max(sizes)
    relative = max(
        error / size if size else (float("inf") if error else 0.0) for error, size in zip(upper, sizes, strict=True)
    )
    return (max(upper) / scale if scale else max(upper)) / eps, relative / eps


def as_rows(certificates: Sequence[Certificate]) -> list[dict[str, Any]]:
    """Plain data for JSON, with the bound and the verdict; what is infinite is null."""
    rows = [{**asdict(item), "bound": item.bound, "passed": item.passed} for item in certificates]
    return [
        {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}
        for row in rows
    ]
