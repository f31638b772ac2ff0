"""The cost that a method promises, as operations against links; no clock.

Small chains show the law exactly (differences of the counts), long ones its exponent.
"""

import math
import sys
from collections.abc import Sequence

import pytest

import eomgen
from bench.cases import line, tree
from eomgen import backends, functions, pipeline
from eomgen.catalog import chain
from eomgen.frontends import METHODS
from eomgen.ir.count import operations
from eomgen.ir.equations import Equations
from eomgen.ir.expr import Node, reachable
from eomgen.ir.text import dump
from eomgen.scene import LINK_TYPES
from tests.depth import shallow_stack
from tests.exact import exact, quantities

DENSE = ["matrix", "recursive", "lagrange"]
LINEAR = ["forward_dynamics", "inverse_dynamics", "bias", "energy", "joints"]
SETTLED = range(7, 13)  # the first and the last few links of a chain need less than those between


def needed(equations: Equations, names: list[str]) -> int:
    """Operations that some functions need together."""
    return sum(operations(node for name in names for node in functions.FUNCTIONS[name].build(equations)).values())


def counts(method: str, model: str, links: range, names: list[str]) -> list[int]:
    return [needed(eomgen.derive(chain(n, model), method), names) for n in links]


def second_differences(values: list[int]) -> set[int]:
    return {a - 2 * b + c for a, b, c in zip(values, values[1:], values[2:], strict=False)}


def exponent(method: str, model: str, links: int, names: list[str]) -> float:
    """The slope of operations against links between n and 2 n links, both logarithmic."""
    few, many = counts(method, model, range(links, 2 * links + 1, links), names)
    return math.log2(many / few)


@pytest.mark.parametrize("model", LINK_TYPES)
@pytest.mark.parametrize("method", DENSE)
def test_matrix_forms_grow_with_the_square(method: str, model: str) -> None:
    """Every pair of links costs the same, so the second difference of the count is a constant, and not zero."""
    (difference,) = second_differences(counts(method, model, SETTLED, ["mass_matrix", "bias"]))
    assert difference > 0


@pytest.mark.parametrize("model", ["rigid", "point-masses"])
@pytest.mark.parametrize("method", ["matrix", "recursive"])
def test_exponent_of_the_matrix_forms(method: str, model: str) -> None:
    assert 1.8 < exponent(method, model, 40, ["mass_matrix", "bias"]) < 2.2


def test_exponent_of_lagrange() -> None:
    """Lower than 2 as yet: differentiating costs much per link, beside what it costs per pair of links."""
    assert 1.6 < exponent("lagrange", "rigid", 30, ["mass_matrix", "bias"]) < 2.2


@pytest.mark.parametrize("name", LINEAR)
@pytest.mark.parametrize("model", LINK_TYPES)
def test_articulated_grows_with_the_links(model: str, name: str) -> None:
    """Every link costs the same, so the count grows in equal steps."""
    values = counts("articulated", model, SETTLED, [name])
    assert second_differences(values) == {0}
    assert values[1] > values[0]


@pytest.mark.parametrize("name", ["forward_dynamics", "inverse_dynamics"])
@pytest.mark.parametrize("model", ["rigid", "point-masses", "elastic-rod"])
def test_exponent_of_articulated(model: str, name: str) -> None:
    assert 0.95 < exponent("articulated", model, 100, [name]) < 1.05


def test_a_tree_is_cheaper_than_a_chain() -> None:
    """Pairs on different branches cost nothing: ten legs of two links need no more than ten times one leg's work."""
    parents = [parent for leg in range(10) for parent in (-1, 2 * leg)]
    legs = needed(eomgen.derive(tree("legs", parents, "elastic-rod")), ["mass_matrix", "bias"])
    leg = needed(eomgen.derive(tree("leg", line(2), "elastic-rod")), ["mass_matrix", "bias"])
    assert legs == 10 * leg


# Depth


def nesting(outputs: Sequence[Node]) -> int:
    """The longest way from an expression to a symbol or constant."""
    levels: dict[Node, int] = {}
    for node in reachable(outputs):
        levels[node] = 1 + max((levels[arg] for arg in node.args), default=0)
    return max(levels.values())


def everything(method: str, links: int) -> int:
    """Derives, fingerprints, passes, dumps and prints a chain of elastic rods; the length of all texts."""
    equations = eomgen.derive(chain(links, "elastic-rod"), method)
    exact([node for nodes in quantities(equations).values() for node in nodes])
    programs = pipeline.programs(equations)
    model = pipeline.describe(equations, programs, ("float64",), {})
    texts = [dump(program) for program in programs]
    for backend in backends.BACKENDS.values():
        texts += backend.emit(model).values()
    return sum(map(len, texts))


@pytest.mark.parametrize("method", METHODS)
def test_nothing_recurses_on_the_depth_of_an_expression(method: str) -> None:
    """60 calls are enough for 12 links, whose expressions are nested deeper."""
    assert nesting(eomgen.derive(chain(12, "elastic-rod"), method).forward_dynamics) > 120
    everything(method, 1)  # imports and regular expressions, which do nest, are done once
    with shallow_stack(60):
        assert everything(method, 12) > 0


def test_a_thousand_links() -> None:
    assert sys.getrecursionlimit() == 1000
    equations = eomgen.derive(chain(1000), "articulated")
    assert len(equations.forward_dynamics) == len(equations.inverse_dynamics) == 2000
    accelerations = exact(equations.forward_dynamics)
    assert exact(equations.inverse_dynamics, dict(zip(equations.a, accelerations, strict=True))) == exact(equations.u)
    (program,) = pipeline.programs(equations, ["energy"])
    assert dump(program).startswith("energy ")
