"""hoist: what depends on parameters only moves to blocks that run once per set of parameters.

A work array whose every element depends on p alone is filled at the rate of the parameters; a single such value
inside other blocks is computed there too, kept in the array `c` and loaded from it. A plain parameter stays an
input. Blocks keep their order, loops stay loops.
"""

from __future__ import annotations

from dataclasses import replace

from eomgen.ir.expr import LEAVES, Node
from eomgen.ir.program import (
    Array,
    Block,
    Place,
    Program,
    Rounds,
    Step,
    Store,
    Turns,
    invariant,
    needed,
    parts,
    take_turns,
)


def run(program: Program) -> Program:
    """The program with its parameter-only values hoisted."""
    arrays = _invariant_arrays(program)
    constants: list[Step] = []
    late: list[Step] = []
    size = 0

    def split(block: Block) -> tuple[Block, Block]:
        nonlocal size
        fixed = invariant(block.nodes(), block.loads, {"p", *arrays})
        early = tuple(store for store in block.stores if store.place.array in arrays)
        late = tuple(store for store in block.stores if store.place.array not in arrays)
        places: dict[Node, Place] = {}
        for node in _frontier(block, fixed, late) if block.inner is None else ():
            places[node] = Place("c", tuple(range(size, size + block.count)))
            size += block.count
        early += tuple(Store(place, node) for node, place in places.items())
        moved = needed(replace(block, title=f"constants of {block.title}", stores=early, rounds=1))
        return moved, needed(replace(block, loads={**block.loads, **places}, stores=late))

    def hoisted(step: Block | Turns) -> Block | Turns | None:
        """What is left of a step; the rest joins the constants."""
        order = step.order if isinstance(step, Turns) else ()
        early, late = zip(*map(split, step.parts), strict=True)
        merged = take_turns(f"constants of {step.title}", early, order)
        if merged is not None:
            constants.append(merged)
        return take_turns(step.title, late, order)

    for step in program.blocks:
        if isinstance(step, Rounds):
            late.append(replace(step, steps=tuple(left for part in step.steps if (left := hoisted(part)) is not None)))
        elif (left := hoisted(step)) is not None:
            late.append(left)
    scratch = [replace(a, role="constants") if a.name in arrays else a for a in program.scratch]
    if size:
        scratch.insert(0, Array("c", (size,), "constants"))
    return replace(program, blocks=tuple(late), constants=(*program.constants, *constants), scratch=tuple(scratch))


def _invariant_arrays(program: Program) -> set[str]:
    """The work arrays that receive nothing but what depends on p."""
    found = {array.name for array in program.scratch if array.role == "work"}
    while True:
        moving: set[str] = set()
        for block in parts(program.blocks):
            fixed = invariant(block.nodes(), block.loads, {"p", *found})
            moving |= {store.place.array for store in block.stores if store.node not in fixed}
        if not moving & found:
            return found
        found -= moving


def _frontier(block: Block, fixed: set[Node], stores: tuple[Store, ...]) -> list[Node]:
    """Parameter-only operations whose value something at the rate of states uses."""
    wanted: set[Node] = {store.node for store in stores}
    for node in replace(block, stores=stores).nodes():
        if node not in fixed and node not in block.loads:
            wanted.update(node.args)
    found = (node for node in wanted if node in fixed and node.op not in LEAVES and node not in block.loads)
    return sorted((node for node in found if _operations(node)), key=lambda node: node.id)


def _operations(node: Node) -> bool:
    """Whether hoisting saves anything: a sign alone does not."""
    return node.op != "neg" or node.args[0].op not in LEAVES
