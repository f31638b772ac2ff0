"""Operation counts: what a program computes, by kind and rate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from eomgen.ir.expr import LEAVES, Node, reachable
from eomgen.ir.program import Program, Step, parts


def operations(outputs: Iterable[Node]) -> Counter[str]:
    """Operations by kind that some expressions need, shared ones once; signs are not counted."""
    return Counter(node.op for node in reachable(outputs) if node.op not in LEAVES and node.op != "neg")


def block_operations(steps: Iterable[Step]) -> Counter[str]:
    """Operations by kind over all iterations of some blocks."""
    total: Counter[str] = Counter()
    for block in parts(steps):
        times = block.times()
        for node in block.nodes():
            if node not in block.loads and node.op not in LEAVES and node.op != "neg":
                total[node.op] += times
        total["add"] += times * sum(store.add for store in block.stores)
    return +total


def program_operations(program: Program) -> dict[str, Counter[str]]:
    """Operations per state ("state") and per set of parameters ("parameters")."""
    return {"state": block_operations(program.blocks), "parameters": block_operations(program.constants)}
