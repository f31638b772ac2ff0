"""Programs with loops over links, for long chains: the walks of the articulated method, one loop per run of links.

A run is a stretch of consecutive links of one kind. Its steps are built once, on stand-in symbols, and become a
block with as many iterations as the run has links; what flows between links, and what one walk leaves for the
next, lives in arrays indexed by link. The text does not grow with the number of links.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

from eomgen.frontends import articulated
from eomgen.frontends.articulated import Flow, Ground, Results, Walk
from eomgen.frontends.mechanism import LinkSymbols, Mechanism
from eomgen.functions import FUNCTIONS, inputs
from eomgen.ir.expr import Graph, Node, reachable
from eomgen.ir.program import Array, Block, Place, Program, Store, needed, straight

SYMBOLS = ("angle", "rate", "acceleration", "torque", "length", "length_rate", "length_acceleration", "force")
Outputs = dict[str, dict[int, int]]  # result name -> link -> index in the output


@dataclass(frozen=True)
class Looped:
    """How a function is computed by walks.

    Attributes:
        walks: makes the walks.
        outputs: where the results of the links go.
        add: the results of all links are summed.
        columns: the walks after the first run once per coordinate, with that unit acceleration, for a column each.
    """

    walks: Callable[[Ground], list[Walk]]
    outputs: Callable[[Mechanism], Outputs]
    add: bool = False
    columns: bool = False


def _coordinates(mechanism: Mechanism, angle: str = "angle") -> Outputs:
    m = len(mechanism.links)
    return {angle: {i: i for i in range(m)}, "length": {i: m + k for k, i in enumerate(mechanism.scene.free)}}


def _prescribed(mechanism: Mechanism) -> Outputs:
    return {"length": {i: k for k, i in enumerate(mechanism.scene.prescribed)}}


def _each(mechanism: Mechanism, index: Callable[[int], int]) -> dict[int, int]:
    return {i: index(i) for i in range(len(mechanism.links))}


LOOPED: dict[str, Looped] = {
    "forward_dynamics": Looped(articulated.forward_dynamics, _coordinates),
    "inverse_dynamics": Looped(articulated.newton_euler, lambda mechanism: _coordinates(mechanism, "torque")),
    "mass_matrix": Looped(articulated.unit_accelerations, _coordinates, columns=True),
    "bias": Looped(articulated.no_accelerations, _coordinates),
    "energy": Looped(
        articulated.energy,
        lambda mechanism: {"kinetic": _each(mechanism, lambda i: 0), "potential": _each(mechanism, lambda i: 1)},
        add=True,
    ),
    "prescribed_forces": Looped(articulated.newton_euler, _prescribed),
    "joints": Looped(
        articulated.joints,
        lambda mechanism: {"x": _each(mechanism, lambda i: 2 * i), "y": _each(mechanism, lambda i: 2 * i + 1)},
    ),
}


def groups(mechanism: Mechanism) -> list[list[int]]:
    """The links in runs: consecutive ones whose steps are the same."""
    scene = mechanism.scene

    def kind(i: int) -> tuple[object, ...]:
        link, parent = scene.links[i], scene.parents[i]
        numbers = tuple(value for _, _, value in link.parameters) if mechanism.fold else ()
        names = tuple(short for short, _, _ in link.parameters)
        shared = parent >= 0 and len(scene.children[parent]) > 1
        return (link.model, link.mode, link.hangs, names, numbers, parent < 0, shared, not scene.children[i])

    found: list[list[int]] = []
    for i in range(len(scene.links)):
        if found and kind(found[-1][0]) == kind(i):
            found[-1].append(i)
        else:
            found.append([i])
    return found


def program(mechanism: Mechanism, name: str) -> Program:
    """The function of this name as loops over links."""
    return _Builder(mechanism, name).build()


@dataclass(frozen=True)
class _Ground:
    graph: Graph
    gravity: Node


class _Parent:
    """The stand-in for a parent, of which a joint spring needs the angle and the rate."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.angle = graph.symbol(f"parent of {name}.angle")
        self.rate = graph.symbol(f"parent of {name}.angle_rate")


class _Run:
    """Consecutive links of one kind.

    Attributes:
        members: the links.
        symbols: the stand-in for each of them.
        tables: for every stand-in symbol its array and, by link, its index.
        root, tip: whether the links have no parent, no children.
        computed: nodes that blocks so far have computed -> position of the block.
    """

    def __init__(self, mechanism: Mechanism, members: list[int], graph: Graph) -> None:
        scene = mechanism.scene
        link = scene.links[members[0]]
        self.members = members
        self.root, self.tip = scene.parents[members[0]] < 0, not scene.children[members[0]]
        self.computed: dict[Node, int] = {}
        if mechanism.fold:
            values = {short: graph.constant(value) for short, _, value in link.parameters}
        else:
            values = {short: graph.symbol(f"{link.name}.{short}") for short, _, _ in link.parameters}
        parent = None if self.root else _Parent(graph, link.name)
        self.symbols = LinkSymbols(link, graph, values, parent)  # type: ignore[arg-type]
        self.tables: dict[Node, tuple[str, dict[int, int]]] = {}
        self._tabulate(mechanism, [(getattr(self.symbols, name), attrgetter(name)) for name in SYMBOLS])
        self._tabulate(mechanism, [(node, _Value(short)) for short, node in values.items()])
        if parent is not None:
            above = [(parent.angle, attrgetter("parent.angle")), (parent.rate, attrgetter("parent.rate"))]
            self._tabulate(mechanism, above)

    def _tabulate(self, mechanism: Mechanism, pairs: Sequence[tuple[Node, Callable[[LinkSymbols], Node]]]) -> None:
        """Notes where a stand-in symbol is found for every member, from what it stands for."""
        slots = mechanism.symbols.slots
        for stand_in, real in pairs:
            nodes = {i: real(mechanism.links[i]) for i in self.members}
            if nodes[self.members[0]] in slots:
                array = slots[nodes[self.members[0]]].array
                self.tables[stand_in] = (array, {i: slots[node].index for i, node in nodes.items()})


@dataclass(frozen=True)
class _Value:
    """Reads a parameter of a link."""

    short: str

    def __call__(self, link: LinkSymbols) -> Node:
        return link.values[self.short]


class _Builder:
    """Builds one program."""

    def __init__(self, mechanism: Mechanism, name: str) -> None:
        self.mechanism, self.name, self.scene = mechanism, name, mechanism.scene
        self.looped, self.function = LOOPED[name], FUNCTIONS[name]
        self.graph = Graph()
        self.shared: dict[Node, tuple[str, int]] = {}
        gravity = self.graph.zero
        if self.scene.gravity and mechanism.fold:
            gravity = self.graph.constant(self.scene.gravity)
        elif self.scene.gravity:
            gravity = self.graph.symbol("gravity")
            self.shared[gravity] = ("p", len(mechanism.symbols.p) - 1)
        self.ground = _Ground(self.graph, gravity)
        self.runs = [_Run(mechanism, members, self.graph) for members in groups(mechanism)]
        self.run_of = {i: run for run in self.runs for i in run.members}
        self.flowing: set[tuple[int, _Run, int]] = set()  # (walk, run, quantity) that can be other than zero
        self.scratch: dict[str, Array] = {}
        self.blocks: list[Block] = []

    def build(self) -> Program:
        """The program."""
        n, k, m = len(self.mechanism.symbols.q), len(self.mechanism.symbols.w), len(self.mechanism.links)
        outputs = self.looped.outputs(self.mechanism)
        target = "column" if self.looped.columns else "sum" if self.looped.add else "out"
        if self.looped.add:
            self.scratch[target] = Array(target, (len(outputs),), "work")
            self.blocks.append(_zeros([target], range(len(outputs)), self.graph))
        first = 0
        walks, steps = self._steps()
        for w, walk in enumerate(walks):
            self._zero_sums(w, walk)
            for run, (flow, results) in zip(self._order(walk), steps[w], strict=True):
                self._block(w, walk, run, flow, results, outputs, target)
            if w == 0:
                first = len(self.blocks)
        if self.looped.add:
            sums = [self.graph.symbol(f"sum of {name}") for name in outputs]
            loads = {node: Place(target, (i,)) for i, node in enumerate(sums)}
            self.blocks.append(straight("sums", loads, [("out", i, node) for i, node in enumerate(sums)]))
        if self.looped.columns:
            self.scratch["a"] = Array("a", (n,), "work")
            self.scratch[target] = Array(target, (n,), "work")
        blocks = tuple(needed(block) for block in self.blocks if block.stores)
        first = sum(1 for block in self.blocks[:first] if block.stores)
        return Program(
            name=self.name,
            doc=self.function.doc,
            inputs=inputs(self.mechanism.symbols, self.function),
            output=Array("out", self.function.shape(n, k, m), "output"),
            blocks=blocks[:first] if self.looped.columns else blocks,
            columns=blocks[first:] if self.looped.columns else (),
            scratch=tuple(self.scratch.values()),
        )

    def _order(self, walk: Walk) -> list[_Run]:
        return self.runs[::-1] if walk.upward else self.runs

    def _steps(self) -> tuple[list[Walk], list[list[tuple[Flow, Results]]]]:
        """The walks, and what every step gives, with zeros where nothing flows.

        What flows out of one run decides what can flow into others, or into itself, so the quantities that can be
        other than zero grow until nothing changes.
        """
        while True:
            before = len(self.flowing)
            walks = self.looped.walks(self.ground)
            steps = [[self._step(w, walk, run) for run in self._order(walk)] for w, walk in enumerate(walks)]
            if len(self.flowing) == before:
                return walks, steps

    def _step(self, w: int, walk: Walk, run: _Run) -> tuple[Flow, Results]:
        flow, results = walk.step(run.symbols, self._inflow(w, walk, run))
        for quantity, node in enumerate(flow):
            if node is not self.graph.zero:
                self.flowing.update((w, target, quantity) for target in self._targets(walk, run))
        return flow, results

    def _targets(self, walk: Walk, run: _Run) -> list[_Run]:
        """The runs that the outflow of a run enters."""
        if walk.upward:
            links: Iterable[int] = (self.scene.parents[i] for i in run.members)
        else:
            links = (child for i in run.members for child in self.scene.children[i])
        return list(dict.fromkeys(self.run_of[i] for i in links if i >= 0))

    def _inflow(self, w: int, walk: Walk, run: _Run) -> Flow:
        if run.root and not walk.upward:
            return walk.start
        numbers = range(len(walk.names))
        return tuple(
            self.graph.symbol(f"{self._flow_name(w, walk, k)} of {run.symbols.name}")
            if (w, run, k) in self.flowing
            else self.graph.zero
            for k in numbers
        )

    def _flow_name(self, w: int, walk: Walk, quantity: int) -> str:
        """The array of a flowing quantity; it exists once something flows."""
        return f"{walk.names[quantity]}_{'up' if walk.upward else 'down'}{w or ''}"

    def _flow_array(self, w: int, walk: Walk, quantity: int) -> str:
        name = self._flow_name(w, walk, quantity)
        self.scratch.setdefault(name, Array(name, (len(self.scene.links),), "work"))
        return name

    def _zero_sums(self, w: int, walk: Walk) -> None:
        """Sums over several children start at zero."""
        several = [i for i, children in enumerate(self.scene.children) if len(children) > 1]
        if walk.upward and several:
            flowing = [k for k in range(len(walk.names)) if any((w, run, k) in self.flowing for run in self.runs)]
            self.blocks.append(_zeros([self._flow_array(w, walk, k) for k in flowing], several, self.graph))

    def _block(
        self, w: int, walk: Walk, run: _Run, flow: Flow, results: Results, outputs: Outputs, target: str
    ) -> None:
        """Appends the block of one run in one walk."""
        visit = run.members[::-1] if walk.upward else run.members
        parents = [self.scene.parents[i] for i in visit]
        for k, node in enumerate(self._inflow(w, walk, run)):
            if node.op == "symbol" and node not in self.shared:
                source = {i: i if walk.upward else self.scene.parents[i] for i in run.members}
                run.tables[node] = (self._flow_array(w, walk, k), source)
        loads = {node: Place(array, tuple(table[i] for i in visit)) for node, (array, table) in run.tables.items()}
        loads |= {node: Place(array, (index,) * len(visit)) for node, (array, index) in self.shared.items()}
        stores: list[Store] = []
        reached = self._targets(walk, run)
        for k, node in enumerate(flow):
            if any((w, other, k) in self.flowing for other in reached):
                add = walk.upward and any(len(self.scene.children[parent]) > 1 for parent in parents)
                if not (add and node is self.graph.zero):
                    place = Place(self._flow_array(w, walk, k), tuple(parents if walk.upward else visit))
                    stores.append(Store(place, node, add))
        for name, node in results.items():
            if visit[0] in outputs.get(name, {}):
                place = Place(target, tuple(outputs[name][i] for i in visit))
                stores.append(Store(place, node, self.looped.add))
        loads |= self._kept(run, [store.node for store in stores], loads, visit)
        wanted = [*(store.node for store in stores), *results.values()]
        for node in reachable(wanted, loads):
            if node.args and node not in loads:
                run.computed.setdefault(node, len(self.blocks))
        title = f"{self._title(run)}, {'tips to root' if walk.upward else 'root to tips'}"
        self.blocks.append(Block(title, loads, tuple(stores), len(visit)))

    def _kept(self, run: _Run, wanted: list[Node], loads: Mapping[Node, Place], visit: list[int]) -> dict[Node, Place]:
        """Loads for what earlier blocks of the run have computed; they are made to store it.

        What depends on parameters only is left to the hoisting pass.
        """
        kept: dict[Node, Place] = {}
        for node in reachable(wanted, {**loads, **run.computed}):
            if node in loads or node not in run.computed or _is_still(node, loads):
                continue
            source = self.blocks[run.computed[node]]
            name = f"kept{sum(array.startswith('kept') for array in self.scratch)}"
            self.scratch[name] = Array(name, (len(run.members),), "work")
            table = {i: position for position, i in enumerate(run.members)}
            run.tables[node] = (name, table)
            upward = source.title.endswith("tips to root")
            order = run.members[::-1] if upward else run.members
            store = Store(Place(name, tuple(table[i] for i in order)), node)
            self.blocks[run.computed[node]] = replace(source, stores=(*source.stores, store))
            kept[node] = Place(name, tuple(table[i] for i in visit))
        return kept

    def _title(self, run: _Run) -> str:
        first, last = (self.scene.links[run.members[position]].name for position in (0, -1))
        return first if first == last else f"{first} to {last}"


def _zeros(arrays: list[str], indices: Sequence[int], graph: Graph) -> Block:
    stores = tuple(Store(Place(array, tuple(indices)), graph.zero) for array in arrays)
    return Block("sums start at zero", {}, stores, len(indices))


def _is_still(node: Node, loads: Mapping[Node, Place]) -> bool:
    """Whether a value depends on parameters only."""
    return all(item.args or item.op == "constant" or loads[item].array == "p" for item in reachable([node], loads))
