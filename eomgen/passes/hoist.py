"""hoist: what depends on parameters only moves to blocks that run once per set of parameters.

A value that a state-rate block needs and that depends on p alone is computed by a block of `constants`, kept
in the array `c` and loaded from there. A plain parameter stays an input.
"""

from __future__ import annotations

from dataclasses import replace

from eomgen.ir.expr import LEAVES, Node
from eomgen.ir.program import Array, Block, Place, Program, Store, needed


def run(program: Program) -> Program:
    """The program with its parameter-only values hoisted out of straight-line and looped blocks alike."""
    constants: list[Block] = []
    blocks: list[Block] = []
    size = 0
    for block in program.blocks:
        still = _still(block)
        moved = list(_frontier(block, still))
        if not moved:
            blocks.append(block)
            continue
        places = {}
        for node in moved:
            places[node] = Place("c", tuple(range(size, size + block.count)))
            size += block.count
        stores = tuple(Store(places[node], node) for node in moved)
        constants.append(needed(Block(f"constants of {block.title}", block.loads, stores, block.count)))
        blocks.append(needed(replace(block, loads={**block.loads, **places})))
    if not size:
        return program
    scratch = (*program.scratch, Array("c", (size,), "constants"))
    return replace(program, blocks=tuple(blocks), constants=(*program.constants, *constants), scratch=scratch)


def _still(block: Block) -> set[Node]:
    """The nodes of a block that depend on constants and p only, leaves included."""
    still: set[Node] = set()
    for node in block.nodes():
        if node in block.loads:
            if block.loads[node].array == "p":
                still.add(node)
        elif all(arg in still for arg in node.args):
            still.add(node)
    return still


def _frontier(block: Block, still: set[Node]) -> list[Node]:
    """Parameter-only operations whose value something at the rate of states uses."""
    wanted: set[Node] = {store.node for store in block.stores}
    for node in block.nodes():
        if node not in still and node not in block.loads:
            wanted.update(node.args)
    found = (node for node in wanted if node in still and node.op not in LEAVES and node not in block.loads)
    return sorted((node for node in found if _operations(node)), key=lambda node: node.id)


def _operations(node: Node) -> bool:
    """Whether hoisting saves anything: a sign alone does not."""
    return node.op != "neg" or node.args[0].op not in LEAVES
