"""Programs: what back ends receive. They know arrays, indices and expressions, and no mechanics.

A `Program` computes one function. It is a list of blocks; a block evaluates its expressions and stores them.
A block of count 1 is straight-line code; a larger count is a loop, in which element k of every index list
belongs to iteration k. Loops can be merged into one whose iterations take turns, and a loop can go around several
steps. Blocks at the rate of the parameters come first, in a list of their own: they need p only, and leave what the
others need of it in the array `c`.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from eomgen.ir.expr import Node, reachable

Role = Literal["input", "output", "constants", "work", "carried"]


@dataclass(frozen=True)
class Array:
    """A named array of scalars.

    Attributes:
        name: its name, an identifier.
        shape: its shape; indices are into the flattened array, the last axis running fastest.
        role: input, output, constants (filled at the rate of the parameters), work, or carried: one element that hands
            a value on, from an iteration to the next or to a later block.
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
    """An element of an array for every iteration of a block.

    Attributes:
        array: the array.
        indices: the index by iteration.
        inner: what the loop inside the block's iterations, or the one around the block, adds to it by the value of
            its variable.
    """

    array: str
    indices: Sequence[int]
    inner: Sequence[int] = ()

    def index(self, k: int, i: int = 0) -> int:
        """The index in iteration k, in iteration i of the loop inside or around."""
        return self.indices[k] + self.inner[i] if self.inner else self.indices[k]


@dataclass(frozen=True)
class Store:
    """Puts the value of a node into a place, or adds it to what is there.

    All loads of an iteration come before its stores.
    """

    place: Place
    node: Node
    add: bool = False


@dataclass(frozen=True)
class Inner:
    """A loop inside a loop, along a list: its variable is first[k], then following[it], until that is negative."""

    first: Sequence[int]
    following: Sequence[int]

    def values(self, k: int) -> Iterator[int]:
        """The values of the variable in iteration k of the outer loop."""
        i = self.first[k]
        while i >= 0:
            yield i
            i = self.following[i]


Iteration = tuple["Block", int, int]


@dataclass(frozen=True)
class Block:
    """Expressions evaluated together.

    Attributes:
        title: what is computed, for comments.
        loads: where the values of nodes come from that this block does not compute.
        stores: what it leaves behind, in order.
        count: the number of iterations.
        inner: a loop inside every iteration.
        rounds: how often a loop around it executes all of it, as part of a `Rounds`.
    """

    title: str
    loads: dict[Node, Place]
    stores: tuple[Store, ...]
    count: int = 1
    inner: Inner | None = None
    rounds: int = 1

    @property
    def parts(self) -> tuple[Block, ...]:
        return (self,)

    @property
    def looped(self) -> bool:
        """Whether it is a loop, or in one."""
        return self.count > 1 or self.inner is not None or self.rounds > 1

    def iterations(self) -> Iterator[Iteration]:
        """Every execution in order: the block, the iteration and the variable of the inner loop."""
        for k in range(self.count):
            for i in (0,) if self.inner is None else self.inner.values(k):
                yield self, k, i

    def times(self) -> int:
        """The number of executions."""
        return self.count * self.rounds if self.inner is None else sum(1 for _ in self.iterations())

    def nodes(self) -> list[Node]:
        """Everything the block evaluates or loads, operands first."""
        return reachable((store.node for store in self.stores), self.loads)


@dataclass(frozen=True)
class Turns:
    """Loops merged into one.

    Attributes:
        title: what is computed, for comments.
        parts: the loops.
        order: for every iteration of the whole the number of the loop whose next iteration it is.
    """

    title: str
    parts: tuple[Block, ...]
    order: tuple[int, ...]

    def iterations(self) -> Iterator[Iteration]:
        """Every execution in order, as of a block."""
        done = [0] * len(self.parts)
        for turn in self.order:
            yield self.parts[turn], done[turn], 0
            done[turn] += 1


@dataclass(frozen=True)
class Rounds:
    """Steps with a loop around them. What one round leaves in work arrays is of no meaning to the next.

    Attributes:
        title: what is computed, for comments.
        steps: what every round executes, in order; no loops inside iterations.
    """

    title: str
    steps: tuple[Block | Turns, ...]

    @property
    def count(self) -> int:
        """The number of rounds."""
        return self.steps[0].parts[0].rounds

    @property
    def parts(self) -> tuple[Block, ...]:
        return tuple(parts(self.steps))

    def iterations(self) -> Iterator[Iteration]:
        """Every execution in order, as of a block; the last number is the round."""
        for i in range(self.count):
            for step in self.steps:
                for block, k, _ in step.iterations():
                    yield block, k, i


Step = Block | Turns | Rounds


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
        scratch: the arrays of the roles `constants`, `work` and `carried`.
        form: how it is computed where there is a choice, for people.
    """

    name: str
    doc: str
    inputs: tuple[Array, ...]
    output: Array
    blocks: tuple[Step, ...]
    constants: tuple[Step, ...] = ()
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

    def size(self, *roles: Role) -> int:
        """Elements of all arrays of some roles."""
        return sum(array.size for array in self.scratch if array.role in roles)


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
    return replace(block, loads=loads)


def invariant(nodes: Iterable[Node], loads: Mapping[Node, Place], arrays: Container[str]) -> set[Node]:
    """Those of some nodes (operands first) that depend on constants and some arrays only.

    An element that a loop inside or around moves is none, as its place is not known here.
    """
    found: set[Node] = set()
    for node in nodes:
        if node in loads:
            if loads[node].array in arrays and not loads[node].inner:
                found.add(node)
        elif node.op != "symbol" and all(arg in found for arg in node.args):
            found.add(node)
    return found


def parts(steps: Iterable[Step]) -> Iterator[Block]:
    """The blocks of some steps, those that take turns one by one."""
    return (block for step in steps for block in step.parts)


def take_turns(title: str, blocks: Sequence[Block], order: Sequence[int]) -> Block | Turns | None:
    """The blocks with something to store, merged if they are several; None if there are none."""
    kept = [number for number, block in enumerate(blocks) if block.stores]
    if len(kept) < 2:
        return blocks[kept[0]] if kept else None
    place = {number: position for position, number in enumerate(kept)}
    return Turns(title, tuple(blocks[number] for number in kept), tuple(place[n] for n in order if n in place))


def flatten(rows: Sequence[Sequence[Node]]) -> tuple[Node, ...]:
    """The elements of a matrix row by row."""
    return tuple(node for row in rows for node in row)
