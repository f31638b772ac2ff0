"""Which form a function takes: straight-line code or loops over links, dense or articulated elimination.

The formulas of a method stand in straight-line code. Loops are always those of the recursion: the other methods
write down every pair of links, so from some number of links on their code takes longer to compile and to run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from eomgen import functions, loops
from eomgen.errors import OptionError, UnsupportedError, unknown
from eomgen.frontends.articulated import ArticulatedEquations
from eomgen.frontends.mechanism import Mechanism, MechanismEquations
from eomgen.ir.count import block_operations
from eomgen.ir.equations import Equations
from eomgen.ir.program import Program
from eomgen.looped import LOOPED
from eomgen.passes import hoist

SOLVERS = ("auto", "dense", "articulated")
LINKS_PER_GROUP = 2  # on average; with smaller groups the loops are longer than what they replace
LOOPED_FROM = 8  # links; from there on loops run as fast as straight-line code and compile several times faster
LOOPED_COLUMNS = {"jacobian": 16, "parameter_jacobian": 10}  # coordinates; the same for matrices, of any kinds of links
DENSE_PAIRS = 1000  # products of a dense elimination; beyond, the recursion always has fewer operations
MOST_STRAIGHT_LINKS = 60  # for functions that have no loops: their text grows like n³
MOST_DENSE_LINKS = 300  # a method that writes every pair of links down


def programs(equations: Equations, names: Sequence[str], looped: bool | None, solver: str) -> list[Program]:
    """The programs of some functions in the form that suits the scene.

    Args:
        equations: the equations.
        names: functions that the equations have.
        looped: loops over links (those of the recursion, whatever the method), straight-line code of the method's
            own, or None to decide by the number of links.
        solver: "auto", "dense" or "articulated", for forward dynamics.

    Raises:
        OptionError: no such solver; or loops (or the articulated solver) where they cannot be.
        UnsupportedError: too many links for straight-line code, in a function that has no loops or is to have none.
    """
    if solver not in SOLVERS:
        raise OptionError(unknown("solver", solver, SOLVERS))
    if not isinstance(equations, MechanismEquations):
        if looped or solver == "articulated":
            raise OptionError("loops and the articulated solver need a scene; these equations come from energies")
        return [functions.program(equations, name) for name in names]
    walking = isinstance(equations, ArticulatedEquations)
    repeats = _repeats(equations.mechanism) if looped is None else looped
    if repeats and solver == "dense" and (looped or walking):
        raise OptionError("the dense solver cannot be written as loops; use solver 'articulated' or loops=False")
    found: list[Program] = []
    for name in names:
        as_loops = repeats
        if looped is None and name in LOOPED_COLUMNS:
            as_loops = _solves_by_columns(equations, name)
        if as_loops and not (name == "forward_dynamics" and solver == "dense"):
            found.append(_looped(equations, name, looped))
        else:
            found.append(_straight(equations, name, solver))
    return found


def _repeats(mechanism: Mechanism) -> bool:
    """Whether there are enough links, and enough of a kind, for loops."""
    m = len(mechanism.links)
    return m >= LOOPED_FROM and m >= LINKS_PER_GROUP * len(loops.groups(mechanism).members)


def _solves_by_columns(equations: MechanismEquations, name: str) -> bool:
    """Whether a matrix of derivatives is loops: if it has many columns, or if that is far more accurate.

    By the parameters of point masses on a free length, straight-line code loses s̈ - s φ̇² in its parts.
    """
    cancels = name == "parameter_jacobian" and equations.mechanism.scene.free
    return bool(cancels) or len(equations.q) >= LOOPED_COLUMNS[name]


def _straight(equations: MechanismEquations, name: str, solver: str) -> Program:
    """A function as straight-line code.

    Raises:
        UnsupportedError: the method would write down too many pairs of links.
    """
    m = len(equations.mechanism.links)
    if equations.method != "articulated" and m > MOST_DENSE_LINKS:
        raise UnsupportedError(
            f"{name} of {m} links by method {equations.method!r} would write down {m * (m + 1) // 2} pairs of links; "
            f"allowed: up to {MOST_DENSE_LINKS}; use method 'articulated', whose cost grows with the number of links"
        )
    solved = _solved(equations, name, solver)
    program = functions.program(solved, name)
    if name != "forward_dynamics":
        return program
    walked = isinstance(solved, ArticulatedEquations) and not isinstance(solved, _Dense)
    return replace(program, form="articulated recursion" if walked else "dense elimination")


def _looped(equations: MechanismEquations, name: str, asked: bool | None) -> Program:
    """A function as loops; one that has no such form is written out if loops were not asked for and it is short."""
    if name in LOOPED:
        return replace(loops.program(equations.mechanism, name), form="recursion in loops over links")
    m = len(equations.mechanism.links)
    if asked or m > MOST_STRAIGHT_LINKS:
        raise UnsupportedError(
            f"{name} cannot be written as loops over links; allowed for {m} links: {', '.join(LOOPED)} "
            f"(straight-line code up to {MOST_STRAIGHT_LINKS} links)"
        )
    return _straight(equations, name, "auto")


def _solved(equations: MechanismEquations, name: str, solver: str) -> MechanismEquations:
    """The equations whose forward dynamics is to be taken."""
    walking = isinstance(equations, ArticulatedEquations)
    if name != "forward_dynamics" or (walking and solver != "dense"):
        return equations
    if walking:
        return _Dense(equations.mechanism)
    if solver == "dense":
        return equations
    walked = ArticulatedEquations(equations.mechanism)
    if solver == "articulated" or _dense_pairs(equations) > DENSE_PAIRS:
        return walked
    return min(equations, walked, key=_per_state)


def _dense_pairs(equations: MechanismEquations) -> int:
    """Pairs of coordinates above each coordinate: what a dense elimination has to update."""
    mechanism = equations.mechanism
    sizes = [1 + link.free for link in mechanism.links]
    total = 0
    for i, size in enumerate(sizes):
        above = size + sum(sizes[j] for j in mechanism.ancestors(i))
        total += size * above * above
    return total


def _per_state(equations: MechanismEquations) -> int:
    """Operations of forward dynamics per state."""
    return block_operations(hoist.run(functions.program(equations, "forward_dynamics")).blocks).total()


class _Dense(ArticulatedEquations):
    """The articulated method's mass matrix and bias, solved densely."""

    forward_dynamics = MechanismEquations.forward_dynamics
