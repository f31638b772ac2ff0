"""The functions a module can offer: their arguments, shapes and where their expressions come from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from eomgen import sensitivity
from eomgen.errors import OptionError, unknown
from eomgen.ir.equations import Equations, Symbols
from eomgen.ir.expr import Node
from eomgen.ir.program import Array, Place, Program, flatten, straight

Build = Callable[[Equations], Sequence[Node]]


@dataclass(frozen=True)
class Function:
    """An entry of `FUNCTIONS`.

    Attributes:
        arguments: its arguments before p, by their letters; w is dropped where nothing is prescribed.
        shape: the shape of the result from (n, k, m, p): coordinates, prescribed lengths, links, parameters; -1 where
            the number of expressions decides.
        build: the result's expressions, flattened.
        doc: one line.
        default: whether it is built without being asked for.
        parameters: whether p is its last argument; otherwise the scene's numbers are in the code.
    """

    arguments: str
    shape: Callable[[int, int, int, int], tuple[int, ...]]
    build: Build
    doc: str
    default: bool = True
    parameters: bool = True


FUNCTIONS: dict[str, Function] = {
    "forward_dynamics": Function(
        "qvuw", lambda n, k, m, p: (n,), lambda e: e.forward_dynamics, "accelerations a of M a + h = Q(u)"
    ),
    "inverse_dynamics": Function(
        "qvaw", lambda n, k, m, p: (n,), lambda e: e.inverse_dynamics, "inputs u that give the accelerations a"
    ),
    "mass_matrix": Function(
        "qw", lambda n, k, m, p: (n, n), lambda e: flatten(e.mass_matrix), "mass matrix M of M a + h = Q(u)"
    ),
    "bias": Function("qvw", lambda n, k, m, p: (n,), lambda e: e.bias, "bias h: M a + h = Q(u)"),
    "energy": Function(
        "qvw", lambda n, k, m, p: (2,), lambda e: (e.kinetic, e.potential), "kinetic and potential energy, J"
    ),
    "prescribed_forces": Function(
        "qvaw", lambda n, k, m, p: (k,), lambda e: e.prescribed_forces, "forces along the prescribed lengths, N"
    ),
    "joints": Function(
        "qw", lambda n, k, m, p: (m, 2), lambda e: flatten(e.joints), "far-end position of every link, m"
    ),
    "jacobian": Function(
        "qvuw",
        lambda n, k, m, p: (n, 3 * n),
        sensitivity.jacobian,
        "derivatives of the accelerations by (q, v, u), side by side",
        default=False,
    ),
    "parameter_jacobian": Function(
        "qvuw",
        lambda n, k, m, p: (n, p),
        sensitivity.parameter_jacobian,
        "derivatives of the accelerations by p",
        default=False,
    ),
    "regressor": Function(
        "qvaw",
        lambda n, k, m, p: (n, -1),
        lambda e: sensitivity.regressor(e).nodes,
        "matrix Y with u = Y b, b the parameters (b_names) that inverse dynamics is linear in",
        default=False,
        parameters=False,
    ),
}


def available(equations: Equations) -> list[str]:
    """The functions these equations have, in the order of `FUNCTIONS`."""
    absent = {"prescribed_forces"} if not equations.w else set()
    if not has_links(equations):
        absent |= {"joints", "regressor"}
    if not equations.p:
        absent.add("parameter_jacobian")
    return [name for name in FUNCTIONS if name not in absent]


def has_links(equations: Equations) -> bool:
    """Whether the equations come from a scene."""
    return hasattr(equations, "mechanism")


def select(equations: Equations, names: Sequence[str] | None) -> list[str]:
    """The requested functions in the order of `FUNCTIONS`; None asks for the default ones.

    Raises:
        OptionError: a name is unknown, or the equations do not have the function.
    """
    offered = available(equations)
    if names is None:
        return [name for name in offered if FUNCTIONS[name].default]
    if isinstance(names, str):
        names = [names]
    for name in names:
        if name not in offered:
            raise OptionError(unknown("function", name, offered))
    if not names:
        raise OptionError(f"no function requested; allowed: {', '.join(offered)}")
    return [name for name in offered if name in names]


def inputs(symbols: Symbols, function: Function) -> tuple[Array, ...]:
    """The input arrays of a function: its arguments, w only where something is prescribed, p last."""
    nodes = {"q": symbols.q, "v": symbols.v, "a": symbols.a, "u": symbols.u, "p": symbols.p}
    arrays: list[Array] = []
    for letter in function.arguments + ("p" if function.parameters else ""):
        if letter == "w":
            if not symbols.w:
                continue
            elements = [node for row in symbols.w for node in row]
            shape: tuple[int, ...] = (len(symbols.w), 3)
        else:
            elements, shape = list(nodes[letter]), (len(nodes[letter]),)
        names = tuple(node.name for node in elements)
        units = tuple(symbols.units.get(node, "") for node in elements)
        arrays.append(Array(letter, shape, "input", names, units))
    return tuple(arrays)


def program(equations: Equations, name: str) -> Program:
    """The function of this name as a straight-line program."""
    function = FUNCTIONS[name]
    nodes = function.build(equations)
    symbols = equations.symbols if function.parameters else sensitivity.regressor(equations).symbols
    m = len(equations.joints) if has_links(equations) else 0
    shape = function.shape(len(symbols.q), len(symbols.w), m, len(symbols.p))
    if shape[-1] == -1:
        shape = (shape[0], len(nodes) // shape[0])
    loads = {node: Place(slot.array, (slot.index,)) for node, slot in symbols.slots.items()}
    return Program(
        name=name,
        doc=function.doc,
        inputs=inputs(symbols, function),
        output=Array("out", shape, "output"),
        blocks=(straight(function.doc, loads, [("out", i, node) for i, node in enumerate(nodes)]),),
    )
