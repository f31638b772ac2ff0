"""carry: an array of which nobody reads anything but what was stored last is one element.

What flows from neighbour to neighbour along a chain is such a value. It then has one place in the cache, or a register,
instead of one per link.
"""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import replace

from eomgen.ir.program import Block, Place, Program, Rounds, Step, Turns, parts


def run(program: Program) -> Program:
    """The program with its work arrays made as short as that."""
    carried = {array.name for array in program.scratch if array.role == "work" and array.size > 1}
    for block in parts(program.blocks):
        carried -= {store.place.array for store in block.stores if store.add}
        carried -= {place.array for place, _ in _places(block) if block.inner is not None or place.inner}
    last: dict[str, int] = {}
    for place, index, stored in _accesses(program.blocks, carried):
        if stored:
            last[place.array] = index
        elif last.get(place.array) != index:
            carried.discard(place.array)
    scratch = (replace(a, shape=(1,), role="carried") if a.name in carried else a for a in program.scratch)

    def moved(old: Place) -> Place:
        return Place(old.array, (0,) * len(old.indices)) if old.array in carried else old

    def changed(old: Block) -> Block:
        loads = {node: moved(at) for node, at in old.loads.items()}
        return replace(old, loads=loads, stores=tuple(replace(store, place=moved(store.place)) for store in old.stores))

    def single(old: Block | Turns) -> Block | Turns:
        return replace(old, parts=tuple(map(changed, old.parts))) if isinstance(old, Turns) else changed(old)

    def step(old: Step) -> Step:
        return replace(old, steps=tuple(map(single, old.steps))) if isinstance(old, Rounds) else single(old)

    return replace(program, blocks=tuple(map(step, program.blocks)), scratch=tuple(scratch))


def _places(block: Block) -> list[tuple[Place, bool]]:
    """The places of a block in the order of access, and whether something is stored there."""
    return [*((place, False) for place in block.loads.values()), *((store.place, True) for store in block.stores)]


def _accesses(steps: tuple[Step, ...], arrays: Set[str]) -> Iterator[tuple[Place, int, bool]]:
    """Every access to some arrays in order, of rounds in the first: its place, the index there, whether it stores."""
    for step in steps:
        if isinstance(step, Rounds):
            yield from _accesses(step.steps, arrays)
            continue
        accesses = {
            id(block): [(place, stored) for place, stored in _places(block) if place.array in arrays]
            for block in step.parts
        }
        if any(accesses.values()):
            for block, k, _ in step.iterations():
                for place, stored in accesses[id(block)]:
                    yield place, place.indices[k], stored
