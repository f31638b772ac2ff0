"""The verifier: what a well-formed program is. It runs between the passes.

A violation is a mistake of eomgen, never of a user, so it raises AssertionError.
"""

from __future__ import annotations

from eomgen.ir.expr import BINARY, LEAVES, UNARY, Node
from eomgen.ir.program import Block, Program, Store


def verify(program: Program, after: str = "") -> None:
    """Checks a program.

    Args:
        program: the program.
        after: the pass that made it, for the message.

    Raises:
        AssertionError: an operation is unknown, a symbol is not loaded, a graph is mixed with another, an index
            is out of its array, an element is read before it is written or written twice, an input is written,
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

    def run(self) -> None:
        for block in self.program.constants:
            self._block(block, reads=("input p", "constants"), writes="constants")
        for block in self.program.blocks:
            self._block(block, reads=("input", "constants", "work", "output"), writes="output work")
        if self.program.columns:
            n = self.program.output.shape[0]
            assert self.program.output.shape == (n, n), "columns need a square output"
            self.written["a"] = set(range(n))
            for block in self.program.columns:
                self._block(block, reads=("input", "constants", "work"), writes="work")
            assert self.written["column"] == set(range(n)), "a column is not filled"
            self.written[self.program.output.name] = set(range(n * n))
        missing = self.program.output.size - len(self.written[self.program.output.name])
        assert not missing, f"{missing} elements of {self.program.output.name} are never stored"

    def _block(self, block: Block, reads: tuple[str, ...], writes: str) -> None:
        owner = {node.graph for node in block.nodes()}
        assert len(owner) <= 1, f"block {block.title!r} mixes graphs"
        for node in block.nodes():
            if node not in block.loads:
                self._node(node, block)
        for place in (*block.loads.values(), *(store.place for store in block.stores)):
            assert place.array in self.arrays, f"block {block.title!r} names the unknown array {place.array!r}"
            assert len(place.indices) == block.count, f"{len(place.indices)} indices of {place.array} for {block.count}"
        for place in block.loads.values():
            role = self.arrays[place.array].role
            allowed = role in reads or f"{role} {place.array}" in reads
            assert allowed, f"block {block.title!r} may not read {place.array}"
        for k in range(block.count):
            for place in block.loads.values():
                known = place.indices[k] in self.written[place.array]
                assert known, f"block {block.title!r} reads {place.array}[{place.indices[k]}], which has no value"
            read = {(place.array, place.indices[k]) for place in block.loads.values()}
            for store in block.stores:
                assert (store.place.array, store.place.indices[k]) not in read, (
                    f"block {block.title!r} reads and writes {store.place.array}[{store.place.indices[k]}] at once"
                )
                self._store(store, k, writes)

    def _node(self, node: Node, block: Block) -> None:
        count = {**dict.fromkeys(UNARY, 1), **dict.fromkeys(BINARY, 2), **dict.fromkeys(LEAVES, 0)}
        assert node.op in count, f"unknown operation {node.op!r}"
        assert len(node.args) == count[node.op], f"{node.op} with {len(node.args)} operands"
        assert node.op != "symbol", f"block {block.title!r} does not load the symbol {node.name!r}"

    def _store(self, store: Store, k: int, writes: str) -> None:
        name, index = store.place.array, store.place.indices[k]
        array = self.arrays[name]
        assert array.role in writes.split(), f"{name} may not be written here"
        assert 0 <= index < array.size, f"{name}[{index}] is outside its {array.size} elements"
        if store.add:
            assert index in self.written[name], f"{name}[{index}] is added to before it has a value"
        else:
            assert index not in self.written[name], f"{name}[{index}] is stored twice"
            self.written[name].add(index)
