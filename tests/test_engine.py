"""The same motion as an independent engine: MuJoCo, on rigid chains and trees and on rods that slide.

MuJoCo measures a joint against its parent, eomgen against the horizontal; the engine's accelerations are summed
along the tree before they are compared.
"""

from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import eomgen
from bench.cases import CASES, JOINT, State, line, tree
from eomgen.frontends import METHODS
from eomgen.scene import ElasticRod, Rigid, Scene
from tests.conftest import RandomState

mujoco = pytest.importorskip("mujoco", reason="MuJoCo, the independent engine, is not installed (extra 'test')")

SCENES = {
    "chain": CASES["rigid_5"],
    "tree": tree("tree", (-1, 0, 1, 1, 0, -1, 5), "rigid", hanging=(3, 6)),
    "weightless": tree("weightless", line(4), "rigid", gravity=0.0),
    "centers": CASES["centers"],
    "springs": CASES["joint_springs"],
    "sliding": tree("sliding", (-1, 0, 1, 1), ("elastic-rod", "rigid", "elastic-rod", "elastic-rod"), changes={
        0: {"inertia": 0.5}, 1: JOINT, 2: {"stiffness": 80.0, "rest_length": 0.2, "damping": 3.0},
    }),
}  # fmt: skip


def attributes(**values: Any) -> dict[str, str]:
    """Numbers to the last bit, as XML attributes."""
    return {
        name: " ".join(repr(float(x)) for x in np.atleast_1d(value)) if not isinstance(value, str) else value
        for name, value in values.items()
    }


def document(scene: Scene) -> str:
    """The scene in MuJoCo's language: a body per link, with a hinge about z and perhaps a slide along its own x."""
    root = ElementTree.Element("mujoco")
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    ElementTree.SubElement(root, "option", attributes(gravity=(0, -scene.gravity, 0)))
    places: list[tuple[ElementTree.Element, float]] = [(ElementTree.SubElement(root, "worldbody"), 0.0)]
    for link, parent in zip(scene.links, scene.parents, strict=True):
        above, end = places[parent + 1]
        body = ElementTree.SubElement(above, "body", attributes(name=link.name, pos=(end, 0, 0)))
        hinge = {"stiffness": link.joint_stiffness, "springref": link.joint_rest_angle, "damping": link.joint_damping}
        ElementTree.SubElement(body, "joint", attributes(name=f"{link.name}.angle", axis=(0, 0, 1), **hinge))
        mass, center, inertia, far = shape(link)
        if link.mode == "free":
            slide = {"stiffness": link.stiffness, "springref": link.rest_length, "damping": link.damping}
            name = f"{link.name}.length"
            ElementTree.SubElement(body, "joint", attributes(name=name, type="slide", axis=(1, 0, 0), **slide))
        tensor = (inertia, inertia, inertia)  # only the one about z is felt
        ElementTree.SubElement(body, "inertial", attributes(pos=(center, 0, 0), mass=mass, diaginertia=tensor))
        places.append((body, far))
    return ElementTree.tostring(root, encoding="unicode")


def shape(link: Rigid | ElasticRod) -> tuple[float, float, float, float]:
    """Mass, centre and central inertia of a link, and its far end, at the length zero; from the contract's words."""
    if isinstance(link, ElasticRod):
        from_end = link.mass * link.rod_length**2 / 3 if link.inertia is None else link.inertia
        return link.mass, link.rod_length / 2, from_end - link.mass * link.rod_length**2 / 4, link.rod_length
    center = link.length / 2 if link.center is None else link.center
    inertia = link.mass * link.length**2 / 12 if link.inertia is None else link.inertia
    start = link.length if link.hangs else 0.0
    return link.mass, center - start, max(inertia, 1e-14), -link.length if link.hangs else link.length


def relative(scene: Scene, absolute: np.ndarray) -> np.ndarray:
    """The joints' share of absolute angles; lengths stay."""
    joint = absolute.copy()
    for i, parent in enumerate(scene.parents):
        if parent >= 0:
            joint[i] -= absolute[parent]
    return joint


def absolute(scene: Scene, joint: np.ndarray) -> np.ndarray:
    total = joint.copy()
    for i, parent in enumerate(scene.parents):
        if parent >= 0:
            total[i] += total[parent]
    return total


class Engine:
    """MuJoCo's accelerations and energy of a scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.model = mujoco.MjModel.from_xml_string(document(scene))
        self.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        joints = [self.model.joint(name) for name in scene.q_names]
        self.place = [int(joint.dofadr[0]) for joint in joints]  # MuJoCo orders joints depth first
        assert self.model.nq == self.model.nv == len(scene.q_names)

    def run(self, q: np.ndarray, v: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, list[float]]:
        data = mujoco.MjData(self.model)
        data.qpos[self.place], data.qvel[self.place] = relative(self.scene, q), relative(self.scene, v)
        data.qfrc_applied[self.place] = u
        mujoco.mj_forward(self.model, data)
        return absolute(self.scene, data.qacc[self.place]), [data.energy[1], data.energy[0]]


def rows(states: State) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    return zip(states.q, states.v, states.u, strict=True)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", SCENES)
def test_forward_dynamics(name: str, method: str, random_state: RandomState) -> None:
    """Both eliminate in double precision, each in its own angles: n eps cond M of the largest is wrong, about 1e-13."""
    scene = SCENES[name]
    module = eomgen.compile(scene, method, "numpy")
    states = random_state(scene, 12, (20,))
    engine = Engine(scene)
    expected = np.array([engine.run(q, v, u)[0] for q, v, u in rows(states)])
    found = module.forward_dynamics(states.q, states.v, states.u, module.p)
    assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("name", SCENES)
def test_energy(name: str, random_state: RandomState) -> None:
    """Kinetic and potential, springs included: sums of some 50 terms in both programs, some 10 eps off."""
    scene = SCENES[name]
    module = eomgen.compile(scene, "matrix", "numpy")
    states = random_state(scene, 13, (20,))
    engine = Engine(scene)
    expected = np.array([engine.run(q, v, u)[1] for q, v, u in rows(states)])
    found = module.energy(states.q, states.v, module.p)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
