"""What flows along a chain has one place, and no bit of any result changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from msgspec.structs import replace

import eomgen
from eomgen import hard, loops
from eomgen.ir.expr import Graph
from eomgen.ir.interpret import Floats, run
from eomgen.ir.program import Array, Block, Place, Program, Store, Turns
from eomgen.ir.verify import verify
from eomgen.looped import LOOPED
from eomgen.passes import carry, hoist
from eomgen.scene import Scene

FLOWS = {"inertia_p_up", "inertia_d_up", "inertia_e_up", "force_u_up", "force_n_up", "torque_up"}


def looped(scene: Scene, name: str) -> Program:
    return hoist.run(loops.program(eomgen.derive(scene, "articulated").mechanism, name))


def carried(program: Program) -> set[str]:
    return {array.name for array in program.scratch if array.role == "carried"}


def alternating(links: int) -> Scene:
    """A chain of rods and of rods whose inertia is given, in turns."""
    scene = eomgen.chain(links, "rigid")
    changed = (replace(link, inertia=0.2 + 0.1 * k) if k % 3 else link for k, link in enumerate(scene.links))
    return Scene("alternating", tuple(changed))


def branched(links: int) -> Scene:
    """Every link carries the next but the last, which hangs on the fourth."""
    scene = eomgen.chain(links, "rigid")
    *others, last = scene.links
    return Scene("branched", (*others, replace(last, parent=scene.links[3].name)))


SCENES = [eomgen.chain(12, "rigid"), eomgen.chain(9), alternating(12), branched(10)]


def test_what_flows_along_a_chain_is_carried() -> None:
    found = carry.run(looped(eomgen.chain(20, "rigid"), "forward_dynamics"))
    assert carried(found) == {*FLOWS, "acceleration_u_down1", "acceleration_n_down1"}
    assert all(array.size == 1 for array in found.scratch if array.role == "carried")


def test_sums_of_several_children_are_not() -> None:
    found = carry.run(looped(branched(20), "forward_dynamics"))
    assert not carried(found) & FLOWS
    assert "inertia_p_up" in {array.name for array in found.scratch if array.size == 20}


@pytest.mark.parametrize("name", [name for name in LOOPED if name != "prescribed_forces"])
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_every_bit_stays(scene: Scene, name: str) -> None:
    before, state = looped(scene, name), hard.random_state(scene)
    state["p"] = np.array([value for link in scene.links for _, _, value in link.parameters] + [scene.gravity])
    inputs = {array.name: np.ravel(state[array.name]).tolist() for array in before.inputs}
    after = carry.run(before)
    verify(after)
    results = [np.array(run(program, inputs, Floats()), float) for program in (before, after)]
    assert np.array_equal(*results)


@pytest.mark.parametrize(
    ("backend", "accuracy"), [("c", "fast"), ("c", "standard"), ("c", "high"), ("numpy", "standard")]
)
def test_loops_in_turns(backend: str, accuracy: str) -> None:
    """The links of a kind do not stand in a row, and still each finds what its neighbour left."""
    scene = alternating(12)
    program = carry.run(looped(scene, "forward_dynamics"))
    assert any(isinstance(step, Turns) for step in program.blocks)
    assert carried(program) == {*FLOWS, "acceleration_u_down1", "acceleration_n_down1"}
    state, results = hard.random_state(scene), []
    for form in (True, False):
        module = eomgen.compile(
            scene, "articulated", backend, accuracy=accuracy, loops=form, functions=["forward_dynamics"]
        )
        results.append(module.forward_dynamics(state["q"], state["v"], state["u"], module.p))
    scale = np.abs(results[1]).max() * (2.0**-18 if accuracy == "fast" else 2.0**-45)
    assert np.allclose(*results, rtol=0, atol=scale)


def handed_on(reads: Sequence[int]) -> Program:
    """Four links each store their number; later blocks read some of them."""
    graph = Graph()
    x = graph.symbol("x")
    fill = Block("fill", {x: Place("q", range(4))}, (Store(Place("kept", range(4)), x * x),), 4)
    load = Block("read", {x: Place("kept", reads)}, (Store(Place("out", range(len(reads))), x),), len(reads))
    arrays = Array("q", (4,), "input"), Array("out", (len(reads),), "output"), Array("kept", (4,), "work")
    return Program("f", "", arrays[:1], arrays[1], (fill, load), scratch=arrays[2:])


@pytest.mark.parametrize(("reads", "expected"), [((3,), {"kept"}), ((3, 3), {"kept"}), ((2,), set()), ((3, 0), set())])
def test_only_what_was_stored_last(reads: Sequence[int], expected: set[str]) -> None:
    before = handed_on(reads)
    after = carry.run(before)
    assert carried(after) == expected
    inputs = {"q": [2.0, 3.0, 5.0, 7.0]}
    assert run(after, inputs, Floats()) == run(before, inputs, Floats()) == [inputs["q"][i] ** 2 for i in reads]
