"""Derivatives on the graph: forward mode (directional) and reverse mode (gradients).

Both walk a tape (the reachable nodes, operands first) once, so the cost is a small multiple of the size of
the expression and no expression swells. (Griewank & Walther 2008, chapters 3.1 and 3.2.)
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence

from eomgen.ir.expr import Node, reachable


def partials(node: Node) -> tuple[Node, ...]:
    """The derivative of an operation with respect to each operand; sums and products are up to the tape."""
    graph, args = node.graph, node.args
    match node.op:
        case "sub":
            return graph.one, graph.constant(-1)
        case "div":
            return 1 / args[1], -(node / args[1])
        case "neg":
            return (graph.constant(-1),)
        case "sin":
            return (graph.cos(args[0]),)
        case "cos":
            return (-graph.sin(args[0]),)
        case "sqrt":
            return (1 / (2 * node),)
        case "exp":
            return (node,)
        case "log":
            return (1 / args[0],)
        case "pivot_inverse":
            return -(node * node), graph.zero
    raise AssertionError(f"no derivative of {node.op}")


class Tape:
    """The nodes of some outputs in order, ready to be differentiated several times.

    Args:
        outputs: the expressions.
        leaves: nodes that count as independent variables, whatever they are made of.
    """

    def __init__(self, outputs: Sequence[Node], leaves: Container[Node] = ()) -> None:
        self.outputs = tuple(outputs)
        self.nodes = [node for node in reachable(self.outputs, leaves) if node.args and node not in leaves]

    def forward(self, seeds: Mapping[Node, Node]) -> tuple[Node, ...]:
        """The derivative of every output along the direction that `seeds` gives to symbols."""
        tangents = dict(seeds)
        get = tangents.get
        for node in self.nodes:
            args, op = node.args, node.op
            first = get(args[0])
            second = get(args[1]) if len(args) == 2 else None
            if first is None and second is None:
                continue
            if op == "mul":
                a, b = args
                left = None if first is None else first * b
                right = None if second is None else a * second
            elif op == "add" or op == "sub":
                left = first
                right = second if op == "add" or second is None else -second
            else:
                slopes = partials(node)
                left = None if first is None else slopes[0] * first
                right = None if second is None else slopes[1] * second
            total = right if left is None else left if right is None else left + right
            assert total is not None
            if total is not total.graph.zero:
                tangents[node] = total
        return tuple(get(output) or output.graph.zero for output in self.outputs)

    def reverse(self, wrt: Sequence[Node]) -> tuple[Node, ...]:
        """The gradient of the sum of the outputs with respect to the given nodes."""
        depends = set(wrt)  # on them; nothing else needs an adjoint
        for node in self.nodes:
            if not depends.isdisjoint(node.args):
                depends.add(node)
        adjoints: dict[Node, Node] = {}
        for output in self.outputs:
            adjoints[output] = adjoints[output] + 1 if output in adjoints else output.graph.one
        for node in reversed(self.nodes):
            if node not in depends or node not in adjoints:
                continue
            adjoint, args, op = adjoints[node], node.args, node.op
            if op == "mul":
                slopes: Sequence[Node | None] = args[::-1]
            else:
                slopes = (None, None) if op == "add" else partials(node)
            for arg, slope in zip(args, slopes, strict=True):
                if arg in depends:
                    share = adjoint if slope is None else adjoint * slope
                    adjoints[arg] = adjoints[arg] + share if arg in adjoints else share
        return tuple(adjoints.get(node, node.graph.zero) for node in wrt)
