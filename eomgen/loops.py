"""Programs with loops over links, for long chains and large trees: the walks of the recursion.

Links are gathered in groups of one kind. The steps of a group are built once, on stand-in symbols, and become a
block with as many iterations as the group has links; what flows between links, and what one walk leaves for the
next, is put into arrays indexed by link (the pass `carry` shortens those it can). Where the links of a kind stand in a
row, a group is such a run, and a walk is one loop after the other. Where they do not, a group has all links of a kind,
and the loops of a walk take turns in the order of the links. So the text grows with the number of kinds, not with the
number of links. Springs make no kind: where links of a group differ in them, small loops before the walks leave each
link's spring forces in arrays. Walks that solve for the columns of a matrix have a loop around them.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

from eomgen import linearised
from eomgen.frontends.articulated import Flow, Results, Walk
from eomgen.frontends.mechanism import LinkSymbols, Mechanism
from eomgen.functions import FUNCTIONS, inputs
from eomgen.ir.expr import Graph, Node, reachable
from eomgen.ir.program import (
    Array,
    Block,
    Inner,
    Place,
    Program,
    Rounds,
    Step,
    Store,
    Turns,
    invariant,
    needed,
    parts,
    straight,
    take_turns,
)
from eomgen.looped import AXES, COLUMNS, LOOPED, Product, axis_of, coordinates
from eomgen.scene import ALONG, IN_JOINT, SPRINGS

SYMBOLS = ("angle", "rate", "acceleration", "torque", "length", "length_rate", "length_acceleration", "force")
SPRUNG = {  # what a step takes of a link's springs -> the keys it depends on: an array, where links differ in these
    "spring": ALONG,
    "joint_spring": IN_JOINT,
    "spring_energy": SPRINGS,
    "stiffness": ALONG,
    "damping": ALONG,
    "joint_stiffness": IN_JOINT,
    "joint_damping": IN_JOINT,
}
NUMBERS = "numbers"  # the array of folded numbers that differ between links of a kind
MANY_GROUPS = 24  # with more, tips are no kind of their own: that is faster, but takes time to compile
RUNS_PER_KIND = 2  # with more, on average, a loop per kind whose iterations take turns is shorter than one per run


@dataclass(frozen=True)
class Groups:
    """The links in groups whose steps are the same.

    Attributes:
        members: the links of every group, in order.
        merged: whether the groups hold all links of a kind, and not runs of neighbours.
    """

    members: list[list[int]]
    merged: bool


def groups(mechanism: Mechanism) -> Groups:
    """The links in runs where there are few of them, otherwise by kind."""
    found = _groups(mechanism, tips=True)
    return found if len(found.members) <= MANY_GROUPS else _groups(mechanism, tips=False)


def _groups(mechanism: Mechanism, tips: bool) -> Groups:
    """The same; tips: whether links without children are a kind of their own."""
    scene = mechanism.scene
    kinds: dict[tuple[object, ...], list[int]] = {}
    runs: list[list[int]] = []
    last: tuple[object, ...] = ()
    for i, (link, parent) in enumerate(zip(scene.links, scene.parents, strict=True)):
        names = tuple(short for short, _, _ in link.parameters if short not in SPRINGS)
        kind = (link.model, link.mode, link.hangs, names, parent < 0, tips and not scene.children[i])
        kinds.setdefault(kind, []).append(i)
        here = (*kind, parent >= 0 and len(scene.children[parent]) > 1)
        if here == last:
            runs[-1].append(i)
        else:
            runs.append([i])
        last = here
    merged = len(runs) > RUNS_PER_KIND * len(kinds)
    return Groups(list(kinds.values()) if merged else runs, merged)


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


def _springs(names: Iterable[str]) -> tuple[frozenset[str], frozenset[str]]:
    """Those of some parameters that are of springs and dampers along a link, and in its joint."""
    given = frozenset(names)
    return given.intersection(ALONG), given.intersection(IN_JOINT)


class _Run:
    """Links of one kind, or links that have nothing in common but their springs.

    Attributes:
        members: the links.
        forces: those of `FORCES` that come from arrays, as the links differ in springs.
        symbols: the stand-in for each of them.
        tables: for every stand-in symbol its array and, by link, its index.
        numbers: folded numbers that differ between the links.
        root: whether the links have no parent.
        computed: nodes that blocks so far have computed -> position of the block, and the links as it visits them.
    """

    def __init__(self, mechanism: Mechanism, members: list[int], graph: Graph, first_number: int) -> None:
        scene = mechanism.scene
        link = scene.links[members[0]]
        numbers = {i: {short: value for short, _, value in scene.links[i].parameters} for i in members}
        differ = {
            keys: len({frozenset(given).intersection(keys) for given in numbers.values()}) > 1
            for keys in SPRUNG.values()
        }
        common = set.intersection(*map(set, numbers.values()))
        self.members = members
        self.forces = [name for name, keys in SPRUNG.items() if differ[keys]]
        self.root = scene.parents[members[0]] < 0
        self.computed: dict[Node, tuple[int, list[int]]] = {}
        self.numbers: list[float] = []
        values: dict[str, Node] = {}
        folded: dict[Node, dict[int, int]] = {}
        for short, value in numbers[members[0]].items():
            if any(differ[keys] for keys in (ALONG, IN_JOINT) if short in keys):
                continue
            values[short] = graph.symbol(f"{link.name}.{short}")
            if short not in common:
                continue
            each = [numbers[i][short] for i in members]
            if mechanism.fold and len(set(each)) == 1:
                values[short] = graph.constant(value)
            elif mechanism.fold:
                start = first_number + len(self.numbers)
                folded[values[short]] = {i: start + k for k, i in enumerate(members)}
                self.numbers += each
        parent = None if self.root else _Parent(graph, link.name)
        self.symbols = LinkSymbols(link, graph, values, parent)  # type: ignore[arg-type]
        self.tables: dict[Node, tuple[str, dict[int, int]]] = {node: (NUMBERS, at) for node, at in folded.items()}
        self._tabulate(mechanism, [(getattr(self.symbols, name), attrgetter(name)) for name in SYMBOLS])
        self._tabulate(mechanism, [(node, _Value(short)) for short, node in values.items() if short in common])
        for name in self.forces:
            node = graph.symbol(f"{link.name}.{name}")
            if name in SPRINGS:
                values[name] = node
            else:
                setattr(self.symbols, name, node)
            self.tables[node] = (name, {i: i for i in members})
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
        self.looped, self.function, self.outputs = LOOPED[name], FUNCTIONS[name], LOOPED[name].outputs(mechanism)
        symbols = mechanism.symbols
        shape = self.function.shape(len(symbols.q), len(symbols.w), len(mechanism.links), len(symbols.p))
        self.output = Array("out", shape, "output")
        self.rounds = self.output.shape[-1] // max(1, len(self.looped.sides))
        self.graph = Graph()
        self.shared: dict[Node, tuple[str, int]] = {}
        gravity = self.graph.zero
        if self.scene.gravity and mechanism.fold:
            gravity = self.graph.constant(self.scene.gravity)
        elif self.scene.gravity:
            gravity = self.graph.symbol("gravity")
            self.shared[gravity] = ("p", len(mechanism.symbols.p) - 1)
        self.ground = _Ground(self.graph, gravity)
        found = groups(mechanism)
        self.merged = found.merged
        self.numbers: list[float] = []
        self.runs = [self._run(members) for members in found.members]
        self.run_of = {i: run for run in self.runs for i in run.members}
        self.flowing: set[tuple[int, _Run, int]] = set()  # (walk, run, quantity) that can be other than zero
        self.vectors: dict[str, dict[int, int]] = {}  # array -> number of a vector -> its link
        self.scratch: dict[str, Array] = {}
        self.blocks: list[Block] = []

    def _run(self, members: list[int]) -> _Run:
        run = _Run(self.mechanism, members, self.graph, len(self.numbers))
        self.numbers += run.numbers
        return run

    def build(self) -> Program:
        """The program."""
        for array in dict.fromkeys(array for array, _ in self.outputs.values() if array != "out"):
            size = 1 + max(max(at.values(), default=0) for name, at in self.outputs.values() if name == array)
            self.scratch[array] = Array(array, (self.output.size if array == COLUMNS else size,), "work")
        if self.looped.zeros:
            size = {**self.scratch, "out": self.output}[self.looped.zeros].size
            self.blocks.append(_zeros([self.looped.zeros], range(size), self.graph))
        if self.looped.slopes:
            self.blocks += self._slopes()
        walks, steps = self._steps()
        starts: list[int] = []
        for w, walk in enumerate(walks):
            first = len(self.blocks)
            self._zero_sums(w, walk)
            starts.append(len(self.blocks))
            for run, (flow, results) in zip(self._order(walk), steps[w], strict=True):
                self._block(w, walk, run, flow, results)
            if walk.columns:
                self.blocks[first:] = [replace(block, rounds=self.rounds) for block in self.blocks[first:]]
            if w + 1 == self.looped.before:
                self.blocks += self._pairs(self.looped.products(self.mechanism))
        if "sum" in self.scratch:
            sums = [self.graph.symbol(f"sum of {name}") for name in self.outputs]
            loads = {node: Place("sum", (i,)) for i, node in enumerate(sums)}
            self.blocks.append(straight("sums", loads, [("out", i, node) for i, node in enumerate(sums)]))
        merged = list(_in_rounds(self._merged(walks, starts)))
        blocks = [*self._before(merged), *merged]
        stored = {store.place.array for block in parts(blocks) for store in block.stores}
        return Program(
            name=self.name,
            doc=self.function.doc,
            inputs=inputs(self.mechanism.symbols, self.function),
            output=self.output,
            blocks=tuple(blocks),
            scratch=tuple(array for array in self.scratch.values() if array.name in stored),
        )

    def _merged(self, walks: list[Walk], starts: list[int]) -> Iterator[Block | Turns]:
        """The blocks that store what is read, those of a walk merged where groups take turns."""
        blocks = list(map(needed, self.blocks))
        read = {place.array for block in blocks for place in block.loads.values()} | {"out"}
        stores = (tuple(store for store in block.stores if store.place.array in read) for block in blocks)
        blocks = [needed(replace(block, stores=kept)) for block, kept in zip(blocks, stores, strict=True)]
        position = 0
        for start, walk in zip(starts if self.merged else (), walks, strict=False):
            yield from (block for block in blocks[position:start] if block.stores)
            order = self._order(walk)
            number = {i: k for k, run in enumerate(order) for i in run.members}
            links = range(len(self.scene.links))
            turns = [number[i] for i in (reversed(links) if walk.upward else links)]
            position = start + len(order)
            step = take_turns(f"all links, {_direction(walk)}", blocks[start:position], turns)
            if step is not None:
                yield step
        yield from (block for block in blocks[position:] if block.stores)

    def _alike(self, of: Callable[[int], tuple[str, ...]]) -> Iterator[tuple[tuple[str, ...], _Run]]:
        """Links for which `of` gives the same names, in runs that have springs of one kind."""
        alike: dict[tuple[tuple[str, ...], object], list[int]] = {}
        for i, link in enumerate(self.scene.links):
            if names := of(i):
                kind = _springs(short for short, _, _ in link.parameters), link.mode, self.run_of[i].root
                alike.setdefault((names, kind), []).append(i)
        for (names, _), members in alike.items():
            yield names, self._run(members)

    def _slopes(self) -> Iterator[Block]:
        """Blocks with the derivatives by the parameters of springs."""
        springs = [tuple(x for x, _, _ in link.parameters if x in SPRINGS) for link in self.scene.links]
        for _, run in self._alike(springs.__getitem__):
            stores: list[Store] = []
            for name, node in linearised.spring_slopes(run.symbols).items():
                array, indices = self.outputs[name]
                if node is not self.graph.zero and run.members[0] in indices:
                    stores.append(Store(Place(array, [indices[i] for i in run.members]), node))
            yield self._of_springs(run, stores)

    def _of_springs(self, run: _Run, stores: Sequence[Store]) -> Block:
        """A block for the springs of a run."""
        members = run.members
        loads = {node: Place(array, [table[i] for i in members]) for node, (array, table) in run.tables.items()}
        return needed(Block(f"springs of {self._title(run)}", loads, tuple(stores), len(members)))

    def _before(self, steps: Sequence[Step]) -> list[Block]:
        """Blocks with what the others want from arrays: springs of links that differ in them, and folded numbers."""
        wanted = {place.array for block in parts(steps) for place in block.loads.values()}
        blocks: list[Block] = []
        for names, run in self._alike(lambda i: tuple(name for name in self.run_of[i].forces if name in wanted)):
            nodes = [run.symbols.value(name) if name in SPRINGS else getattr(run.symbols, name) for name in names]
            stores = [Store(Place(name, run.members), node) for name, node in zip(names, nodes, strict=True)]
            blocks.append(self._of_springs(run, stores))
        for name in SPRUNG:
            if name in wanted:
                self.scratch[name] = Array(name, (len(self.scene.links),), "work")
        if self.numbers:
            self.scratch[NUMBERS] = Array(NUMBERS, (len(self.numbers),), "work")
            values = [(NUMBERS, i, self.graph.constant(value)) for i, value in enumerate(self.numbers)]
            blocks.insert(0, straight("numbers of the links", {}, values))
        return blocks

    def _pairs(self, products: Sequence[Product]) -> list[Block]:
        """Elements of a matrix for pairs of links, a block for those products that go through the same pairs."""
        alike: dict[tuple[tuple[tuple[int, int], ...], ...], list[Product]] = {}
        for product in products:
            ends = (self.vectors.get(axis_of(name, AXES[0]), {}) for name in (product.below, product.above))
            below, above = (tuple(sorted(found.items())) for found in ends)
            if below and above:
                alike.setdefault((below, above), []).append(product)
        blocks = [self._paired(dict(below), dict(above), found) for (below, above), found in alike.items()]
        return [block for block in blocks if block.inner and max(block.inner.first) >= 0]

    def _paired(self, below: dict[int, int], above: dict[int, int], products: Sequence[Product]) -> Block:
        """Products of every vector and those of the links above its own.

        The vectors above one are a list: those of the parent, then those of its own parent, ...

        Args:
            below, above: the link of every vector by its number.
            products: the products.
        """
        own: dict[int, list[int]] = {}
        for number, link in above.items():
            own.setdefault(link, []).append(number)
        head, following = [-1] * len(self.scene.links), [-1] * (1 + max(above))
        for link, parent in enumerate(self.scene.parents):
            numbers = [*own.get(link, ()), head[parent] if parent >= 0 else -1]
            head[link] = numbers[0]
            for number, after in itertools.pairwise(numbers):
                following[number] = after
        parents = (self.scene.parents[link] for link in below.values())
        first = [head[parent] if parent >= 0 else -1 for parent in parents]
        count, zeros, every = len(below), (0,) * len(below), range(len(following))
        loads: dict[Node, Place] = {}
        stores: list[Store] = []
        for product in products:
            upper = [self.graph.symbol(axis_of(product.above, axis)) for axis in AXES]
            lower = [self.graph.symbol(axis_of(product.below, axis)) for axis in AXES]
            loads |= {node: Place(node.name, zeros, every) for node in upper}
            loads |= {node: Place(node.name, [*below]) for node in lower}
            element = self.graph.sum(x * y for x, y in zip(upper, lower, strict=True))
            for array, start, low, high in product.places:
                place = Place(array, [start + low * number for number in below], [high * i for i in every])
                stores.append(Store(place, element))
        return Block("pairs of links", loads, tuple(stores), count, Inner(first, following))

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
        """Sums over several children start at zero, and over none, where tips are no kind of their own, they are."""
        added = {self.scene.parents[i] for run in self.runs if self._adds(walk, run) for i in run.members} - {-1}
        flowing = [(run, k) for number, run, k in self.flowing if number == w]
        if walk.upward:
            added |= {i for run, _ in flowing for i in run.members if not self.scene.children[i]}
        if added:
            arrays = [self._flow_array(w, walk, k) for k in sorted({k for _, k in flowing})]
            self.blocks.append(_zeros(arrays, sorted(added), self.graph))

    def _adds(self, walk: Walk, run: _Run) -> bool:
        """Whether what flows out of a run is added to what comes from other children."""
        children, parents = self.scene.children, self.scene.parents
        return walk.upward and any(len(children[parents[i]]) > 1 for i in run.members if parents[i] >= 0)

    def _block(self, w: int, walk: Walk, run: _Run, flow: Flow, results: Results) -> None:
        """Appends the block of one run in one walk."""
        visit = run.members[::-1] if walk.upward else run.members
        parents = [self.scene.parents[i] for i in visit]
        for k, node in enumerate(self._inflow(w, walk, run)):
            if node.op == "symbol" and node not in self.shared:
                source = {i: i if walk.upward else self.scene.parents[i] for i in run.members}
                run.tables[node] = (self._flow_array(w, walk, k), source)
        moving = self._moving() if walk.columns else {}
        if walk.columns:
            run.tables |= self._right(run)
        loads = {
            node: Place(array, tuple(table[i] for i in visit), moving.get(array, ()))
            for node, (array, table) in run.tables.items()
        }
        loads |= {node: Place(array, (index,) * len(visit)) for node, (array, index) in self.shared.items()}
        stores: list[Store] = []
        reached, add = self._targets(walk, run), self._adds(walk, run)
        for k, node in enumerate(flow):
            enters = any((w, other, k) in self.flowing for other in reached)
            if enters and not (add and node is self.graph.zero):
                place = Place(self._flow_array(w, walk, k), tuple(parents if walk.upward else visit))
                stores.append(Store(place, node, add))
        for name, node in results.items():
            target, indices = self.outputs.get(name, ("", {}))
            add = self.looped.add and target == self.looped.zeros
            if visit[0] in indices and not (add and node is self.graph.zero):
                place = Place(target, tuple(indices[i] for i in visit), moving.get(target, ()))
                stores.append(Store(place, node, add))
                if target not in ("out", self.looped.zeros):
                    self.vectors.setdefault(target, {}).update({indices[i]: i for i in visit})
        stored = [store.node for store in stores]
        wanted = [*stored, *results.values()]
        loads |= self._kept(run, wanted if walk.columns else stored, loads, visit)
        for node in reachable(wanted, loads):
            if node.args and node not in loads:
                run.computed.setdefault(node, (len(self.blocks), visit))
        title = f"{self._title(run)}, {_direction(walk)}"
        self.blocks.append(Block(title, loads, tuple(stores), len(visit)))

    def _moving(self) -> dict[str, range]:
        """What the number of a round adds to the index of a right-hand side, and of a result."""
        n, rounds = self.output.shape[0], self.rounds
        return {COLUMNS: range(0, rounds * n, n), "out": range(rounds)} if rounds > 1 else {}

    def _right(self, run: _Run) -> dict[Node, tuple[str, dict[int, int]]]:
        """Where the right-hand sides of the first round are found."""
        found: dict[Node, tuple[str, dict[int, int]]] = {}
        for coordinate, indices in coordinates(self.mechanism).items():
            if run.members[0] in indices:
                for k, side in enumerate(self.looped.sides):
                    table = {i: k * self.rounds * self.output.shape[0] + index for i, index in indices.items()}
                    found[linearised.right(run.symbols, coordinate, side)] = COLUMNS, table
        return found

    def _kept(self, run: _Run, wanted: list[Node], loads: Mapping[Node, Place], visit: list[int]) -> dict[Node, Place]:
        """Loads for what earlier blocks of the run have computed; they are made to store it.

        What depends on parameters only is left to the hoisting pass.
        """
        kept: dict[Node, Place] = {}
        left = invariant(reachable(wanted, loads), loads, {"p"})
        for node in reachable(wanted, {**loads, **run.computed}):
            if node in loads or node not in run.computed or node in left:
                continue
            position, order = run.computed[node]
            source = self.blocks[position]
            name = f"kept{sum(array.startswith('kept') for array in self.scratch)}"
            self.scratch[name] = Array(name, (len(run.members),), "work")
            table = {i: k for k, i in enumerate(run.members)}
            run.tables[node] = (name, table)
            store = Store(Place(name, tuple(table[i] for i in order)), node)
            self.blocks[position] = replace(source, stores=(*source.stores, store))
            kept[node] = Place(name, tuple(table[i] for i in visit))
        return kept

    def _title(self, run: _Run) -> str:
        first, last = (self.scene.links[run.members[position]].name for position in (0, -1))
        if self.merged and len(run.members) > 1:
            return f"{first} and {len(run.members) - 1} more of its kind"
        return first if first == last else f"{first} to {last}"


def _in_rounds(steps: Iterable[Block | Turns]) -> Iterator[Step]:
    """The steps, those that belong to rounds together."""
    for count, group in itertools.groupby(steps, key=lambda step: step.parts[0].rounds):
        if count > 1:
            yield Rounds("column by column", tuple(group))
        else:
            yield from group


def _direction(walk: Walk) -> str:
    return "tips to root" if walk.upward else "root to tips"


def _zeros(arrays: list[str], indices: Sequence[int], graph: Graph) -> Block:
    stores = tuple(Store(Place(array, indices), graph.zero) for array in arrays)
    return Block("sums start at zero", {}, stores, len(indices))
