"""The verifier: what a well-formed program is. It runs between the passes.

A violation is a mistake of eomgen, never of a user, so it raises AssertionError.
"""

from __future__ import annotations

from collections import Counter

from eomgen.ir.expr import BINARY, LEAVES, UNARY, Node
from eomgen.ir.program import Block, Program, Step, Store, Turns


def verify(program: Program, after: str = "") -> None:
    """Checks a program.

    Args:
        program: the program.
        after: the pass that made it, for the message.

    Raises:
        AssertionError: an operation is unknown, a symbol is not loaded, a graph is mixed with another, an index
            is out of its array, an element is read before it is written or written twice (but for a zero that is replaced), an input is written,
            constants depend on more than p, or an output element is missing.
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
        self.written = {array.name: set(range(array.size)) for array in program.inputs}
        self.written |= {array.name: set() for array in (program.output, *program.scratch)}
        self.zero: dict[str, set[int]] = {name: set() for name in self.written}

    def run(self) -> None:
        for step in self.program.constants:
            self._step(step, reads=("input p", "constants"), writes="constants")
        for step in self.program.blocks:
            self._step(step, reads=("input", "constants", "work", "output"), writes="output work")
        missing = self.program.output.size - len(self.written[self.program.output.name])
        assert not missing, f"{missing} elements of {self.program.output.name} are never stored"

    def _step(self, step: Step, reads: tuple[str, ...], writes: str) -> None:
        for block in step.parts:
            self._block(block, reads, writes)
        if isinstance(step, Turns):
            turns = Counter(step.order)
            counts = {number: block.count for number, block in enumerate(step.parts)}
            assert turns == counts, f"{step.title!r}: the turns {dict(turns)} are not the iterations {counts}"
            assert not any(block.inner for block in step.parts), f"{step.title!r}: a loop inside takes no turns"
        for block, k, i in step.iterations():
            read = {(place.array, place.index(k, i)) for place in block.loads.values()}
            for array, index in read:
                assert index in self.written[array], f"block {block.title!r} reads {array}[{index}], which has no value"
            for store in block.stores:
                array, index = store.place.array, store.place.index(k, i)
                at_once = f"block {block.title!r} reads and writes {array}[{index}] at once"
                assert (array, index) not in read, at_once
                self._store(store, index)

    def _block(self, block: Block, reads: tuple[str, ...], writes: str) -> None:
        owner = {node.graph for node in block.nodes()}
        assert len(owner) <= 1, f"block {block.title!r} mixes graphs"
        for node in block.nodes():
            if node not in block.loads:
                self._node(node, block)
        for place in (*block.loads.values(), *(store.place for store in block.stores)):
            assert place.array in self.arrays, f"block {block.title!r} names the unknown array {place.array!r}"
            assert len(place.indices) == block.count, f"{len(place.indices)} indices of {place.array} for {block.count}"
            assert not place.inner or block.inner, f"block {block.title!r} has no loop inside for {place.array}"
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

    def _store(self, store: Store, index: int) -> None:
        """A zero may be stored first and added to, or replaced once."""
        name = store.place.array
        written, zero = self.written[name], self.zero[name]
        assert 0 <= index < self.arrays[name].size, f"{name}[{index}] is outside its {self.arrays[name].size} elements"
        if store.add:
            assert index in written, f"{name}[{index}] is added to before it has a value"
            zero.discard(index)
        else:
            assert index not in written or index in zero, f"{name}[{index}] is stored twice"
            if store.node is store.node.graph.zero and index not in written:
                zero.add(index)
            else:
                zero.discard(index)
            written.add(index)
