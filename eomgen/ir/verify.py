"""The verifier: what a well-formed program is. It runs between the passes.

A violation is a mistake of eomgen, never of a user, so it raises AssertionError.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from eomgen.ir.expr import BINARY, LEAVES, UNARY, Node
from eomgen.ir.program import Block, Place, Program, Rounds, Step, Store, Turns

NOTHING, ZERO, VALUE = range(3)  # what an element of an array holds


def verify(program: Program, after: str = "") -> None:
    """Checks a program.

    Args:
        program: the program.
        after: the pass that made it, for the message.

    Raises:
        AssertionError: an operation is unknown, a symbol is not loaded, a graph is mixed with another, an index
            is out of its array, an element is read before it is written or written twice (but for a carried one and
            a zero that is replaced), an input is written, constants depend on more than p, an output element is
            missing, the turns of loops are not their iterations, or a round needs what another one leaves.
    """
    try:
        _Check(program).run()
    except AssertionError as error:
        raise AssertionError(f"{program.name}, after {after or 'construction'}: {error}") from None


class _Check:
    def __init__(self, program: Program) -> None:
        self.program = program
        self.arrays = program.arrays
        names = [a.name for a in (*program.inputs, program.output, *program.scratch)]
        assert len(set(names)) == len(names), f"array names {names} are not unique"
        self.state = {array.name: bytearray([VALUE]) * array.size for array in program.inputs}
        self.state |= {array.name: bytearray(array.size) for array in (program.output, *program.scratch)}

    def run(self) -> None:
        for step in self.program.constants:
            self._step(step, reads=("input p", "constants"), writes="constants")
        for step in self.program.blocks:
            self._step(step, reads=("input", "constants", "work", "carried", "output"), writes="output work carried")
        missing = self.state[self.program.output.name].count(NOTHING)
        assert not missing, f"{missing} elements of {self.program.output.name} are never stored"

    def _step(self, step: Step, reads: tuple[str, ...], writes: str) -> None:
        if isinstance(step, Rounds):
            self._rounds(step, reads, writes)
            return
        for block in step.parts:
            self._block(block, reads, writes)
        if isinstance(step, Turns):
            turns = Counter(step.order)
            counts = {number: block.count for number, block in enumerate(step.parts)}
            assert turns == counts, f"{step.title!r}: the turns {dict(turns)} are not the iterations {counts}"
            assert not any(block.inner for block in step.parts), f"{step.title!r}: a loop inside takes no turns"
        if isinstance(step, Block) and step.looped and not _arrays(step.loads.values()) & _arrays(_stores(step)):
            self._all_at_once(step)
        else:
            for block, k, i in step.iterations():
                self._once(block, k, i)

    def _rounds(self, step: Rounds, reads: tuple[str, ...], writes: str) -> None:
        """The first round like steps without a loop around them; in the others only what moves is different."""
        blocks = step.parts
        for block in blocks:
            sound = block.rounds == step.count and block.inner is None
            assert sound, f"block {block.title!r} is not one of {step.count} rounds"
        moving = [place for block in blocks for place in block.loads.values() if place.inner]
        stored = [store for block in blocks for store in block.stores if store.place.inner]
        left = _arrays(place for block in blocks for place in _stores(block) if not place.inner)
        both = _arrays(moving) & _arrays(store.place for store in stored)
        assert not both, f"{step.title!r} both loads and stores {sorted(both)} by rounds"
        before = [name for name in left if any(self.state[name])]
        assert not before, f"{step.title!r} stores into {sorted(before)} again"
        for part in step.steps:
            self._step(part, reads, writes)
        for place in moving:
            self._loaded(step.title, place.array, _moved(place))
        for store in stored:
            at, state = _moved(store.place), np.frombuffer(self.state[store.place.array], np.uint8)
            assert not store.add, f"{step.title!r} adds to {store.place.array} by rounds"
            inside = at.min() >= 0 and at.max() < len(state)
            assert inside, f"{step.title!r} stores outside the {len(state)} elements of {store.place.array}"
            again = np.bincount(at).max() > 1 or state[at].any()
            assert not again, f"{step.title!r} stores elements of {store.place.array} twice"
            state[at] = VALUE

    def _loaded(self, title: str, array: str, at: NDArray[np.intp]) -> None:
        """Reads of some elements of an array."""
        state = np.frombuffer(self.state[array], np.uint8)
        outside = (at < 0) | (at >= len(state))
        absent = at[outside | (state[np.where(outside, 0, at)] == NOTHING)]
        assert not absent.size, f"block {title!r} reads {array}[{absent[0]}], which has no value"

    def _once(self, block: Block, k: int, i: int) -> None:
        """Reads and writes of one iteration."""
        read = {(place.array, place.index(k, i)) for place in block.loads.values()}
        for array, index in read:
            known = 0 <= index < len(self.state[array]) and self.state[array][index]
            assert known, f"block {block.title!r} reads {array}[{index}], which has no value"
        for store in block.stores:
            name, index = store.place.array, store.place.index(k, i)
            at_once = (name, index) in read and self.arrays[name].role != "carried"
            assert not at_once, f"block {block.title!r} reads and writes {name}[{index}] at once"
            self._store(store, [index])

    def _all_at_once(self, block: Block) -> None:
        """Reads and writes of all iterations of a block that reads nothing it writes."""
        k, i = np.arange(block.count), np.zeros(block.count, np.intp)
        if block.inner:
            lists = [[*block.inner.values(iteration)] for iteration in range(block.count)]
            k, i = np.repeat(k, [*map(len, lists)]), np.array([*chain.from_iterable(lists)], np.intp)

        def indices(place: Place) -> NDArray[np.intp]:
            return _array(place.indices)[k] + (_array(place.inner)[i] if place.inner else 0)

        for place in block.loads.values():
            self._loaded(block.title, place.array, indices(place))
        for store in block.stores:
            at, state = indices(store.place), np.frombuffer(self.state[store.place.array], np.uint8)
            sound = at.size > 0 and at.min() >= 0 and at.max() < len(state) and np.bincount(at).max() == 1
            if sound and not store.add and np.all(state[at] != VALUE):
                state[at] = np.where(state[at] == NOTHING, _stored(store), VALUE)
            else:
                self._store(store, at.tolist())

    def _block(self, block: Block, reads: tuple[str, ...], writes: str) -> None:
        owner = {node.graph for node in block.nodes()}
        assert len(owner) <= 1, f"block {block.title!r} mixes graphs"
        for node in block.nodes():
            if node not in block.loads:
                self._node(node, block)
        inner = len(block.inner.following) if block.inner else block.rounds if block.rounds > 1 else 0
        if block.inner:
            assert len(block.inner.first) == block.count, f"{len(block.inner.first)} lists for {block.count} iterations"
        for place in (*block.loads.values(), *_stores(block)):
            assert place.array in self.arrays, f"block {block.title!r} names the unknown array {place.array!r}"
            assert len(place.indices) == block.count, f"{len(place.indices)} indices of {place.array} for {block.count}"
            assert len(place.inner) in (0, inner), (
                f"{len(place.inner)} indices of {place.array} for {inner} inside or around"
            )
        for place in block.loads.values():
            role = self.arrays[place.array].role
            allowed = role in reads or f"{role} {place.array}" in reads
            assert allowed, f"block {block.title!r} may not read {place.array}"
        for store in block.stores:
            assert self.arrays[store.place.array].role in writes.split(), f"{store.place.array} may not be written here"

    def _node(self, node: Node, block: Block) -> None:
        count = {**dict.fromkeys(UNARY, 1), **dict.fromkeys(BINARY, 2), **dict.fromkeys(LEAVES, 0)}
        assert node.op in count, f"unknown operation {node.op!r}"
        assert len(node.args) == count[node.op], f"{node.op} with {len(node.args)} operands"
        assert node.op != "symbol", f"block {block.title!r} does not load the symbol {node.name!r}"

    def _store(self, store: Store, indices: Iterable[int]) -> None:
        """A zero may be stored first and added to, or replaced once."""
        name, state = store.place.array, self.state[store.place.array]
        for index in indices:
            assert 0 <= index < len(state), f"{name}[{index}] is outside its {len(state)} elements"
            before = state[index]
            if store.add:
                assert before, f"{name}[{index}] is added to before it has a value"
            else:
                again = before == VALUE and self.arrays[name].role != "carried"
                assert not again, f"{name}[{index}] is stored twice"
            state[index] = VALUE if before else _stored(store)


def _moved(place: Place) -> NDArray[np.intp]:
    """The indices in all rounds but the first."""
    return (_array(place.indices)[:, None] + _array(place.inner)[1:]).ravel()


def _stores(block: Block) -> list[Place]:
    return [store.place for store in block.stores]


def _arrays(places: Iterable[Place]) -> set[str]:
    return {place.array for place in places}


def _stored(store: Store) -> int:
    return ZERO if store.node is store.node.graph.zero else VALUE


def _array(indices: Sequence[int]) -> NDArray[np.intp]:
    if isinstance(indices, range):
        return np.arange(indices.start, indices.stop, indices.step)
    return np.array(indices, dtype=np.intp)
