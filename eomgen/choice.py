"""Which form a function takes: dense or articulated elimination, straight-line code or loops over links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from eomgen import functions, loops
from eomgen.errors import OptionError, UnsupportedError, unknown
from eomgen.frontends.articulated import ArticulatedEquations
from eomgen.frontends.mechanism import MechanismEquations
from eomgen.ir.count import block_operations
from eomgen.ir.equations import Equations
from eomgen.ir.program import Program
from eomgen.passes import hoist

SOLVERS = ("auto", "dense", "articulated")
LINKS_PER_RUN = 2  # on average; with shorter runs the loops are longer than what they replace
LOOPED_FROM = 8  # links; from there on loops run as fast as straight-line code and compile several times faster
DENSE_PAIRS = 1000  # products of a dense elimination; beyond, the recursion always has fewer operations
MOST_STRAIGHT_LINKS = 60  # for functions that have no loops: their text grows like n³
MOST_DENSE_LINKS = 300  # a method that writes every pair of links down


def programs(equations: Equations, names: Sequence[str], looped: bool | None, solver: str) -> list[Program]:
    """The programs of some functions in the form that suits the scene.

    Args:
        equations: the equations.
        names: functions that the equations have.
        looped: loops over links, or None to decide by the number of links.
        solver: "auto", "dense" or "articulated", for forward dynamics.

    Raises:
        OptionError: no such solver; or loops (or the articulated solver) where they cannot be.
        UnsupportedError: too many links for a method that writes down every pair of them.
    """
    if solver not in SOLVERS:
        raise OptionError(unknown("solver", solver, SOLVERS))
    if not isinstance(equations, MechanismEquations):
        if looped or solver == "articulated":
            raise OptionError("loops and the articulated solver need a scene; these equations come from energies")
        return [functions.program(equations, name) for name in names]
    m = len(equations.mechanism.links)
    walking = isinstance(equations, ArticulatedEquations)
    if looped and not walking:
        raise OptionError(f"loops over links need method 'articulated', not {equations.method!r}")
    check_size(equations.method, m)
    repeats = m >= LOOPED_FROM and m >= LINKS_PER_RUN * len(loops.groups(equations.mechanism).members)
    if looped or (looped is None and walking and repeats):
        if solver == "dense":
            raise OptionError("the dense solver cannot be written as loops; use solver 'articulated' or loops=False")
        return [_looped(equations, name, looped) for name in names]
    found: list[Program] = []
    for name in names:
        solved = _solved(equations, name, solver)
        walked = isinstance(solved, ArticulatedEquations) and not isinstance(solved, _Dense)
        if name == "forward_dynamics" and walked and looped is None and repeats:
            found.append(_looped(equations, name, looped))
            continue
        form = "articulated recursion" if walked else "dense elimination"
        program = functions.program(solved, name)
        found.append(replace(program, form=form) if name == "forward_dynamics" else program)
    return found


def check_size(method: str, links: int) -> None:
    """Refuses a chain that a method would write down pair by pair.

    Raises:
        UnsupportedError: there are too many links for it.
    """
    if method != "articulated" and links > MOST_DENSE_LINKS:
        raise UnsupportedError(
            f"{links} links by method {method!r} would write down {links * (links + 1) // 2} pairs of links; "
            f"allowed: up to {MOST_DENSE_LINKS}; use method 'articulated', whose cost grows with the number of links"
        )


def _looped(equations: MechanismEquations, name: str, asked: bool | None) -> Program:
    """A function as loops; one that has no such form is written out if loops were not asked for and it is short."""
    if name in loops.LOOPED:
        return replace(loops.program(equations.mechanism, name), form="articulated recursion in loops over links")
    m = len(equations.mechanism.links)
    if asked or m > MOST_STRAIGHT_LINKS:
        raise UnsupportedError(
            f"{name} cannot be written as loops over links; allowed for {m} links: {', '.join(loops.LOOPED)} "
            f"(straight-line code up to {MOST_STRAIGHT_LINKS} links)"
        )
    return functions.program(equations, name)


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
