"""Certified errors: compiled results against enclosures that are proved to hold the exact value.

An expression is evaluated in ball arithmetic (python-flint's `arb`; Johansson 2017) from the exact binary inputs, at a
precision that is raised until every ball is tight. The error of a compiled result is then a guaranteed figure, not
the difference of two approximations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from eomgen import functions, pipeline
from eomgen.errors import UnsupportedError
from eomgen.frontends import METHODS
from eomgen.hard import hard_states
from eomgen.ir.expr import Node
from eomgen.ir.interpret import Label, Operators, evaluate
from eomgen.scene import Scene

TIGHT = 80  # bits that an enclosure must share with the exact value
MOST_BITS = 1 << 13


def import_flint() -> Any:
    """python-flint.

    Raises:
        UnsupportedError: it is not installed.
    """
    try:
        import flint
    except ImportError:
        raise UnsupportedError(
            "certified errors need python-flint, which is not installed; pip install 'eomgen[certify]'"
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
    """Balls that hold the exact values, with at least `TIGHT` correct bits each (or within 2^-900 of zero).

    Args:
        outputs: the expressions.
        given: values of the symbols, taken as the binary numbers they are.

    Raises:
        UnsupportedError: python-flint is missing, or the values cannot be enclosed (a singular state).
    """
    flint = import_flint()
    bits, tiny = 256, 2.0**-900
    while bits <= MOST_BITS:
        with flint.ctx.workprec(bits):
            exact = {node: flint.arb(_ratio(value)[0]) / _ratio(value)[1] for node, value in given.items()}
            balls = evaluate(outputs, exact, Balls())
            # A ball around an exact zero has no relative accuracy; it is tight once it is far below any other number.
            if all(ball.rel_accuracy_bits() >= TIGHT or abs(ball) < tiny for ball in balls):
                return balls
        bits *= 2
    raise UnsupportedError("the exact values cannot be enclosed; is the state singular?")


def _ratio(value: float) -> tuple[int, int]:
    return np.longdouble(value).as_integer_ratio()


@dataclass(frozen=True)
class Certificate:
    """The certified error of one function of one module at one state.

    Attributes:
        method, backend, dtype, function, state: what was measured.
        scaled: the largest error over the largest entry of the result, in eps of the type.
        componentwise: the largest relative error of an entry, in eps; infinite where a zero is missed.
        condition: κ₂ of the mass matrix at the state.
    """

    method: str
    backend: str
    dtype: str
    function: str
    state: str
    scaled: float
    componentwise: float
    condition: float


def certify(
    scene: Scene,
    methods: Sequence[str] = tuple(METHODS),
    backends: Sequence[str] = ("c", "numpy"),
    names: Sequence[str] | None = None,
    progress: Callable[[str], None] | None = None,
) -> list[Certificate]:
    """The certified errors of a scene's functions at its hard states.

    Raises:
        UnsupportedError: python-flint is missing.
    """
    import_flint()
    found: list[Certificate] = []
    for method in methods:
        equations = pipeline.derive(scene, method)
        solver = "articulated" if method == "articulated" else "dense"
        chosen = functions.select(equations, names)
        for backend in backends:
            if progress:
                progress(f"certified errors of {method}, {backend}")
            module = pipeline.compile(equations, backend=backend, functions=chosen, loops=False, solver=solver)
            for state, drawn in hard_states(scene).items():
                values = {**drawn, "p": np.array(equations.symbols.p_values)}
                given = {node: values[slot.array].flat[slot.index] for node, slot in equations.symbols.slots.items()}
                mass = [float(ball.mid()) for ball in enclose([x for row in equations.mass_matrix for x in row], given)]
                condition = float(np.linalg.cond(np.array(mass).reshape(len(equations.q), -1)))
                for name in chosen:
                    nodes = list(functions.FUNCTIONS[name].build(equations))
                    program = functions.program(equations, name)
                    computed = getattr(module, name)(*(values[array.name] for array in program.inputs))
                    scaled, relative = errors(computed, enclose(nodes, given))
                    found.append(Certificate(method, backend, "float64", name, state, scaled, relative, condition))
    return found


def errors(computed: Any, balls: Sequence[Any]) -> tuple[float, float]:
    """Upper bounds of the scaled and the componentwise error, in eps of the result's type."""
    flint = import_flint()
    flat = np.asarray(computed).reshape(-1)
    if not np.all(np.isfinite(flat)):
        return float("inf"), float("inf")
    eps = float(np.finfo(flat.dtype).eps)
    differences = [
        abs(ball - flint.arb(*_ratio(got)[:1]) / _ratio(got)[1]) for got, ball in zip(flat, balls, strict=True)
    ]
    upper = [float(difference.upper()) for difference in differences]
    sizes = [float(abs(ball).lower()) for ball in balls]
    scale = max(sizes)
    relative = max(
        error / size if size else (float("inf") if error else 0.0) for error, size in zip(upper, sizes, strict=True)
    )
    return (max(upper) / scale if scale else max(upper)) / eps, relative / eps


def as_rows(certificates: Sequence[Certificate]) -> list[dict[str, Any]]:
    """Plain data for JSON."""
    return [asdict(certificate) for certificate in certificates]
