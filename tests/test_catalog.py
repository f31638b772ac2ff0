"""Ready scenes: the chain and the walker of the paper."""

from typing import Any

import pytest

from eomgen.catalog import WALKER_ANGLES, WALKER_RATES, chain, walker
from eomgen.errors import EomgenError, OptionError, SceneError
from eomgen.links import affine
from eomgen.scene import LINK_TYPES, ElasticRod, JointMasses, PointMasses, Scene


def test_default_chain() -> None:
    scene = chain(3)
    assert scene.name == "chain3"
    assert scene.gravity == 9.81
    assert [link.name for link in scene.links] == ["link1", "link2", "link3"]
    assert scene.parents == (-1, 0, 1)
    assert scene.free == (0, 1, 2)
    assert scene.links[1] == PointMasses(
        name="link2", parent="link1", length="free", masses=(0.25, 0.5, 0.25), fractions=(0, 0.5, 1)
    )


@pytest.mark.parametrize("model", sorted(LINK_TYPES))
def test_chain_of_every_model(model: str) -> None:
    scene = chain(2, model, hangs=True, gravity=0)
    assert scene.gravity == 0
    assert scene.links[0].mode == ("fixed" if model == "rigid" else "free")
    assert all(link.hangs and link.model == model for link in scene.links)
    assert chain(2, model, length=0.5).links[1].length == 0.5
    assert Scene.from_dict(scene.to_dict()) == scene


@pytest.mark.parametrize("model", sorted(LINK_TYPES))
def test_chain_links_weigh_a_kilogram_and_span_a_metre(model: str) -> None:
    (link,) = chain(1, model).links
    bodies, (alpha, beta) = affine(link, {p.name: p.value for p in link.parameters})
    assert sum(body.mass for body in bodies) == 1
    assert alpha + beta * (0.5 if alpha == 0.5 else 1) == 1


def test_chain_lengths() -> None:
    assert chain(1, "elastic-rod", "prescribed").prescribed == (0,)
    assert chain(1, "rigid").links[0].length == 1.0
    with pytest.raises(SceneError, match="a rigid link needs a number"):
        chain(1, "rigid", "free")


@pytest.mark.parametrize("links", [0, -1, 100_001, 2.0, True, "3", None])
def test_chain_refuses_numbers_of_links(links: Any) -> None:
    with pytest.raises(OptionError, match="is not allowed; give an integer from 1 to 100000") as caught:
        chain(links)
    assert len(str(caught.value)) < 400


def test_chain_refuses_a_number_too_long_to_print() -> None:
    with pytest.raises(OptionError, match="links = <int> is not allowed"):
        chain(10**5000)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: chain(1, "point-mass"), "unknown model 'point-mass'; allowed: rigid, .*did you mean"),
        (lambda: chain(1, []), r"unknown model \[\]"),  # type: ignore[arg-type]
        (lambda: chain(1, length="fixed"), "unknown length 'fixed'"),  # type: ignore[arg-type]
        (lambda: chain(1, gravity=float("nan")), "gravity = nan is not finite"),
        (lambda: chain(1, hangs=1), "hangs = 1 is not a flag"),  # type: ignore[arg-type]
        (lambda: walker("rod"), r"unknown walker links 'rod'; allowed: rods, lumped \(did you"),
        (lambda: walker([]), r"unknown walker links \[\]"),  # type: ignore[arg-type]
        (lambda: walker(length=float("inf")), "links.0. 'stance_shank': length = inf is not finite"),
    ],
)  # fmt: skip
def test_options_refused(make: Any, words: str) -> None:
    with pytest.raises(EomgenError, match=words) as caught:
        make()
    assert str(caught.value).isprintable()


def test_walker_of_rods() -> None:
    scene = walker()
    names = ["stance_shank", "stance_thigh", "swing_thigh", "swing_shank", "trunk"]
    assert scene.name == "walker"
    assert scene.gravity == 9.81
    assert [link.name for link in scene.links] == names
    assert scene.parents == (-1, 0, 1, 2, 1)
    assert [link.hangs for link in scene.links] == [False, False, True, True, False]
    assert scene.prescribed == (0, 1, 2, 3, 4)
    rods = [link for link in scene.links if isinstance(link, ElasticRod)]
    assert [rod.mass for rod in rods] == [2.91, 8.93, 8.93, 2.91, 28.93]
    assert [rod.rod_length for rod in rods] == [0.385, 0.477, 0.477, 0.385, 0.771]


def test_walker_of_lumped_masses() -> None:
    scene = walker("lumped", length=0.5)
    assert scene.parents == walker().parents
    assert [link.length for link in scene.links] == [0.5] * 5
    lumps = [link for link in scene.links if isinstance(link, JointMasses)]
    assert [link.fraction for link in lumps] == [0.595, 0.545, 0.545, 0.595, 0.5]
    assert lumps[0].masses == (2.91 / 4, 2.91 / 2, 2.91 / 4)
    assert sum(sum(link.masses) for link in lumps) == pytest.approx(52.61)


def test_walker_starts_as_in_the_paper() -> None:
    assert WALKER_ANGLES == (1.68, 1.70, 1.21, 0.39, 1.57)
    assert WALKER_RATES == (-1.57, -2.92, -0.19, -2.83, -0.07)
