"""carry: an array of which nobody reads anything but what was stored last is one element.

What flows from neighbour to neighbour along a chain is such a value. It then has one place in the cache, or a register,
instead of one per link.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from eomgen.ir.program import Block, Place, Program, Step, Turns, parts


def run(program: Program) -> Program:
    """The program with its work arrays made as short as that."""
    carried = {array.name for array in program.scratch if array.role == "work" and array.size > 1}
    carried -= {store.place.array for block in parts(program.blocks) for store in block.stores if store.add}
    last: dict[str, int] = {}
    for array, index, stored in _accesses(program.blocks):
        if stored:
            last[array] = index
        elif last.get(array) != index:
            carried.discard(array)
    scratch = (replace(a, shape=(1,), role="carried") if a.name in carried else a for a in program.scratch)

    def place(old: Place) -> Place:
        return Place(old.array, (0,) * len(old.indices)) if old.array in carried else old

    def block(old: Block) -> Block:
        loads = {node: place(at) for node, at in old.loads.items()}
        return replace(old, loads=loads, stores=tuple(replace(store, place=place(store.place)) for store in old.stores))

    def step(old: Step) -> Step:
        return replace(old, parts=tuple(map(block, old.parts))) if isinstance(old, Turns) else block(old)

    return replace(program, blocks=tuple(map(step, program.blocks)), scratch=tuple(scratch))


def _accesses(steps: tuple[Step, ...]) -> Iterator[tuple[str, int, bool]]:
    """Array and index of everything read and stored, in order."""
    for step in steps:
        for block, k, i in step.iterations():
            for place in block.loads.values():
                yield place.array, place.index(k, i), False
            for store in block.stores:
                yield store.place.array, store.place.index(k, i), True
