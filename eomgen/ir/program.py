"""Programs: what back ends receive. They know arrays, indices and expressions, and no mechanics.

A `Program` computes one function. It is a list of blocks; a block evaluates its expressions and stores them.
A block of count 1 is straight-line code; a larger count is a loop, in which element k of every index list
belongs to iteration k. Blocks at the rate of the parameters come first, in a list of their own: they need p
only, and leave what the others need of it in the array `c`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

from eomgen.ir.expr import Node, reachable

Role = Literal["input", "output", "constants", "work"]


@dataclass(frozen=True)
class Array:
    """A named array of scalars.

    Attributes:
        name: its name, an identifier.
        shape: its shape; indices are into the flattened array, the last axis running fastest.
        role: input, output, constants (filled at the rate of the parameters) or work.
        symbols: for an input, the names of its elements.
        units: their units, as many, or none.
    """

    name: str
    shape: tuple[int, ...]
    role: Role
    symbols: tuple[str, ...] = ()
    units: tuple[str, ...] = ()

    @property
    def labels(self) -> list[str]:
        """The elements' names with their units, for comments."""
        units = self.units or ("",) * len(self.symbols)
        return [f"{name} ({unit})" if unit else name for name, unit in zip(self.symbols, units, strict=True)]

    @property
    def size(self) -> int:
        return math.prod(self.shape)


@dataclass(frozen=True)
class Place:
    """An element of an array for every iteration of a block."""

    array: str
    indices: tuple[int, ...]


@dataclass(frozen=True)
class Store:
    """Puts the value of a node into a place, or adds it to what is there."""

    place: Place
    node: Node
    add: bool = False


@dataclass(frozen=True)
class Block:
    """Expressions evaluated together.

    Attributes:
        title: what is computed, for comments.
        loads: where the values of nodes come from that this block does not compute.
        stores: what it leaves behind, in order.
        count: the number of iterations.
    """

    title: str
    loads: dict[Node, Place]
    stores: tuple[Store, ...]
    count: int = 1

    def nodes(self) -> list[Node]:
        """Everything the block evaluates or loads, operands first."""
        return reachable((store.node for store in self.stores), self.loads)


@dataclass(frozen=True)
class Program:
    """One function.

    Attributes:
        name: its name.
        doc: one line for users.
        inputs: the input arrays in the order of the arguments.
        output: the output array.
        blocks: at the rate of states, in order.
        constants: blocks at the rate of the parameters, run before the others.
        columns: blocks that run after the others once per row of a square output: the array `a` is a unit vector,
            the array `column` they fill becomes the column of that number.
        scratch: the arrays of the roles `constants` and `work`.
        form: how it is computed where there is a choice, for people.
    """

    name: str
    doc: str
    inputs: tuple[Array, ...]
    output: Array
    blocks: tuple[Block, ...]
    constants: tuple[Block, ...] = ()
    columns: tuple[Block, ...] = ()
    scratch: tuple[Array, ...] = field(default=())
    form: str = ""

    @property
    def arrays(self) -> dict[str, Array]:
        return {array.name: array for array in (*self.inputs, self.output, *self.scratch)}

    @property
    def signature(self) -> str:
        """The generalised-ufunc signature; every dimension is a number, so NumPy refuses a wrong shape."""
        inputs = ",".join(dimensions(array) for array in self.inputs)
        return f"{inputs}->{dimensions(self.output)}"

    def size(self, role: Role) -> int:
        """Elements of all arrays of a role."""
        return sum(array.size for array in self.scratch if array.role == role)


def dimensions(array: Array) -> str:
    """(5) or (2,3); an array without elements gets a label, as NumPy has no dimension 0."""
    return "(" + ",".join(str(size) if size else f"{array.name}0" for size in array.shape) + ")"


def straight(title: str, loads: dict[Node, Place], outputs: Iterable[tuple[str, int, Node]]) -> Block:
    """A straight-line block that stores nodes at (array, index), loading only what it needs."""
    stores = tuple(Store(Place(array, (index,)), node) for array, index, node in outputs)
    return needed(Block(title, loads, stores))


def needed(block: Block) -> Block:
    """The block without the loads that nothing in it uses."""
    used = block.nodes()
    loads = {node: block.loads[node] for node in used if node in block.loads}
    return Block(block.title, loads, block.stores, block.count)


def flatten(rows: Sequence[Sequence[Node]]) -> tuple[Node, ...]:
    """The elements of a matrix row by row."""
    return tuple(node for row in rows for node in row)
