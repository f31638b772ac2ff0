"""The order in which a block evaluates its nodes."""

from __future__ import annotations

from eomgen.ir.expr import LEAVES, Node
from eomgen.ir.program import Block


def order(block: Block) -> list[Node]:
    """The operations of a block, operands first, each as late as a walk from the stores allows.

    A depth-first walk from the stores in their order keeps a value close to its first use.
    """
    done: set[Node] = set(block.loads)
    result: list[Node] = []
    for store in block.stores:
        stack: list[tuple[Node, bool]] = [(store.node, False)]
        while stack:
            node, ready = stack.pop()
            if node in done or node.op in LEAVES:
                continue
            if ready:
                done.add(node)
                result.append(node)
            else:
                stack.append((node, True))
                stack.extend((arg, False) for arg in reversed(node.args))
    return result
