"""Link models: the constants by hand, and the meaning of `hangs` and of a fixed length."""

from fractions import Fraction
from typing import Any

import pytest

from eomgen.catalog import chain
from eomgen.links import MODELS, Affine, Body, affine
from eomgen.scene import LINK_TYPES, ElasticRod, JointMasses, Link, PointMasses, Rigid, Telescopic

ROD: dict[str, Any] = {"name": "a", "mass": 3.0, "rod_length": 2.0}
SLIDE: dict[str, Any] = {
    "name": "a", "rod_mass": 3.0, "rod_length": 2.0, "housing_mass": 6.0, "housing_length": 4.0,
}  # fmt: skip
LUMPS: dict[str, Any] = {"name": "a", "masses": (1.0, 2.0, 4.0), "fraction": 0.25}
POINTS: dict[str, Any] = {"name": "a", "masses": (1.0, 2.0), "fractions": (0.0, 0.75)}

BY_HAND = [
    (Rigid(name="a", mass=3, length=2), [(3, 1, 0, 1)], (2, 0)),
    (Rigid(name="a", mass=3, length=2, center=0.5, inertia=7), [(3, 0.5, 0, 7)], (2, 0)),
    (Rigid(name="a", mass=3, length=2, center=0.5, hangs=True), [(3, -1.5, 0, 1)], (-2, 0)),
    (ElasticRod(length="free", **ROD), [(3, 1, 1, 1)], (2, 1)),
    (ElasticRod(length="free", inertia=5, **ROD), [(3, 1, 1, 2)], (2, 1)),
    (ElasticRod(length="prescribed", hangs=True, **ROD), [(3, -1, 0, 1)], (-2, -1)),
    (ElasticRod(length=0.5, **ROD), [(3, 1.5, 0, 1)], (2.5, 0)),
    (ElasticRod(length=0.5, hangs=True, **ROD), [(3, -1, 0, 1)], (-2.5, 0)),
    (Telescopic(length="free", **SLIDE), [(3, 1, 0, 1), (6, 2, 1, 8)], (4, 1)),
    (
        Telescopic(length="free", rod_inertia=9, housing_inertia=25, **SLIDE),
        [(3, 1, 0, 9), (6, 2, 1, 1)],
        (4, 1),
    ),
    (Telescopic(length="free", hangs=True, **SLIDE), [(3, -3, -1, 1), (6, -2, 0, 8)], (-4, -1)),
    (Telescopic(length=0.5, **SLIDE), [(3, 1, 0, 1), (6, 2.5, 0, 8)], (4.5, 0)),
    (Telescopic(length=0.5, hangs=True, **SLIDE), [(3, -3.5, 0, 1), (6, -2, 0, 8)], (-4.5, 0)),
    (JointMasses(length="free", **LUMPS), [(1, 0, 0, 0), (2, 0, 0.25, 0), (4, 0, 1, 0)], (0, 1)),
    (
        JointMasses(length="free", hangs=True, **LUMPS),
        [(1, 0, -1, 0), (2, 0, -0.75, 0), (4, 0, 0, 0)],
        (0, -1),
    ),
    (JointMasses(length=2, **LUMPS), [(1, 0, 0, 0), (2, 0.5, 0, 0), (4, 2, 0, 0)], (2, 0)),
    (JointMasses(length=2, hangs=True, **LUMPS), [(1, -2, 0, 0), (2, -1.5, 0, 0), (4, 0, 0, 0)], (-2, 0)),
    (PointMasses(length="free", **POINTS), [(1, 0, 0, 0), (2, 0, 0.75, 0)], (0, 1)),
    (PointMasses(length="free", hangs=True, **POINTS), [(1, 0, -1, 0), (2, 0, -0.25, 0)], (0, -1)),
    (PointMasses(length=2, **POINTS), [(1, 0, 0, 0), (2, 1.5, 0, 0)], (2, 0)),
    (PointMasses(length=2, hangs=True, **POINTS), [(1, -2, 0, 0), (2, -0.5, 0, 0)], (-2, 0)),
]


def numbers(link: Link) -> dict[str, float]:
    return {p.name: p.value for p in link.parameters}


@pytest.mark.parametrize(("link", "bodies", "joint"), BY_HAND)
def test_by_hand(link: Link, bodies: list[tuple[float, ...]], joint: tuple[float, float]) -> None:
    assert affine(link, numbers(link)) == Affine(tuple(Body(*body) for body in bodies), joint)


@pytest.mark.parametrize("model", sorted(set(MODELS) - {"rigid"}))
@pytest.mark.parametrize("hangs", [False, True])
def test_fixed_is_free_at_that_length(model: str, hangs: bool) -> None:
    (free,) = chain(1, model, hangs=hangs).links
    (fixed,) = chain(1, model, length=0.75, hangs=hangs).links
    one, two = affine(free, numbers(free)), affine(fixed, numbers(fixed))
    assert [body.alpha + body.beta * 0.75 for body in one.bodies] == [body.alpha for body in two.bodies]
    assert one.joint[0] + one.joint[1] * 0.75 == two.joint[0]


def constants(result: Affine) -> list[Any]:
    return [*result.joint, *(x for body in result.bodies for x in body)]


@pytest.mark.parametrize(("link", "bodies", "joint"), BY_HAND)
def test_structure_is_ints_and_no_float_is_made(link: Link, bodies: Any, joint: Any) -> None:
    """With exact values everything stays exact, and what the model itself makes 0 or 1 is an int."""
    result = affine(link, {name: Fraction(value) for name, value in numbers(link).items()})
    assert {type(x) for x in constants(result)} <= {int, Fraction}
    assert result == Affine(tuple(Body(*body) for body in bodies), joint)
    if link.mode == "fixed":
        assert all(type(body.beta) is int for body in result.bodies)
        assert type(result.joint[1]) is int
    elif not link.hangs:
        assert all(type(body.alpha) is int for body in result.bodies if body.alpha == 0)


def test_zero_numbers_are_no_structure() -> None:
    """A mass at the fraction 0.0 keeps its fraction: the value may change, the equations may not."""
    link = PointMasses(name="a", length="free", masses=(1,), fractions=(0,))
    (body,) = affine(link, numbers(link)).bodies
    assert type(body.beta) is float
    assert type(body.alpha) is int


def test_every_model_has_constants() -> None:
    assert list(MODELS) == list(LINK_TYPES)
