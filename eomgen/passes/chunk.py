"""chunk: long straight-line blocks are cut into bounded ones, so that compile time grows linearly.

Compilers take more than linear time in the length of a function. A value that a later piece needs is kept in
the array `t` (or `ct` at the rate of the parameters). A difference whose sine is wanted is computed anew, since a
back end corrects the sine for its rounding. A number that goes to many places, as the zeros of a matrix do, is stored
in a loop.
"""

from __future__ import annotations

from dataclasses import replace

from eomgen.ir.expr import Node
from eomgen.ir.program import Array, Block, Place, Program, Step, Store, needed
from eomgen.ir.schedule import order
from eomgen.ir.statements import is_difference

LIMIT = 600
MANY = 100  # places of a number


def run(program: Program, limit: int = LIMIT) -> Program:
    """The program with no straight-line block longer than about `limit` operations."""
    scratch = list(program.scratch)
    constants = _pieces(program.constants, "ct", "constants", scratch, limit)
    blocks = _pieces(program.blocks, "t", "work", scratch, limit)
    return replace(program, constants=constants, blocks=blocks, scratch=tuple(scratch))


def _pieces(blocks: tuple[Step, ...], array: str, role: str, scratch: list[Array], limit: int) -> tuple[Step, ...]:
    pieces: list[Step] = []
    size = 0
    for block in (part for step in blocks for part in _without_numbers(step)):
        if not isinstance(block, Block) or block.looped or len(nodes := order(block)) <= limit * 3 // 2:
            pieces.append(block)
            continue
        count = -(-len(nodes) // limit)
        length = -(-len(nodes) // count)
        home = {node: position // length for position, node in enumerate(nodes)}
        last: dict[Node, int] = {}
        for node in nodes:
            for arg in node.args:
                if arg in home:
                    last[arg] = max(last.get(arg, 0), home[node])
        turns = {arg for node in nodes if node.op in ("sin", "cos") for arg in node.args if is_difference(arg, block)}
        stores: list[list[Store]] = [[] for _ in range(count)]
        for store in block.stores:
            stores[home.get(store.node, 0)].append(store)
        kept: dict[Node, Place] = {}
        for node in nodes:
            if last.get(node, 0) > home[node] and node not in turns:
                kept[node] = Place(array, (size,))
                stores[home[node]].append(Store(kept[node], node))
                size += 1
        for piece in range(count):
            known = {node: place for node, place in kept.items() if home[node] < piece}
            title = f"{block.title}, part {piece + 1} of {count}"
            pieces.append(needed(Block(title, {**block.loads, **known}, tuple(stores[piece]))))
    if size:
        scratch.append(Array(array, (size,), "constants" if role == "constants" else "work"))
    return tuple(pieces)


def _without_numbers(step: Step) -> list[Step]:
    """A straight-line block without the numbers that it stores in many places of an array, after loops for these.

    One with nothing but numbers stays: a back end makes a table of it.
    """
    if not isinstance(step, Block) or step.looped or all(store.node.op == "constant" for store in step.stores):
        return [step]
    places: dict[tuple[Node, str], list[int]] = {}
    for store in step.stores:
        if store.node.op == "constant" and not store.add:
            places.setdefault((store.node, store.place.array), []).append(store.place.indices[0])
    many = {key: indices for key, indices in places.items() if len(indices) >= MANY}
    loops = [
        Block(f"{step.title}, {node.value} in many places", {}, (Store(Place(array, indices), node),), len(indices))
        for (node, array), indices in many.items()
    ]
    left = tuple(store for store in step.stores if (store.node, store.place.array) not in many or store.add)
    return [*loops, replace(step, stores=left)]
