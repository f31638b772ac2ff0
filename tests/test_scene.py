"""Scenes: what they say of themselves, what they refuse and in which words, and the way to files and back."""

import array
import json
import pickle
import re
import tomllib
from fractions import Fraction
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from eomgen.catalog import chain
from eomgen.errors import BuildError, CheckError, EomgenError, SceneError, listed, one_line, shown, unknown
from eomgen.scene import (
    LINK_TYPES,
    QUANTITIES,
    SPRINGS,
    ElasticRod,
    JointMasses,
    Link,
    Parameter,
    PointMasses,
    Rigid,
    Scene,
    Telescopic,
)
from eomgen.scene_file import load_scene

REQUIRED: dict[str, dict[str, Any]] = {
    "rigid": {"mass": 2.0, "length": 0.5},
    "elastic-rod": {"length": "free", "mass": 2.0, "rod_length": 0.5},
    "telescopic": {
        "length": "free", "rod_mass": 2.0, "rod_length": 0.5, "housing_mass": 3.0, "housing_length": 0.25,
    },
    "joint-masses": {"length": "free", "masses": [0.5, 1.0, 0.5], "fraction": 0.6},
    "point-masses": {"length": "free", "masses": [0.7, 1.5], "fractions": [0.0, 0.6]},
}  # fmt: skip


def a_link(model: str = "rigid", name: str = "shank", **changes: Any) -> dict[str, Any]:
    """A valid link of the model as a table; a change to None takes the key out."""
    table = {"name": name, "model": model, **REQUIRED[model], **changes}
    return {key: value for key, value in table.items() if value is not None}


def a_scene(*links: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {"name": "leg", "links": list(links or [a_link()]), **changes}


def refusal(data: object, where: str = "leg.toml") -> str:
    """The message that refuses the data: one line, not long, the place first."""
    with pytest.raises(SceneError) as caught:
        Scene.from_dict(data, where)
    text = str(caught.value)
    assert text.startswith(f"{where}: ")
    assert text.isprintable()
    assert len(text) < 400
    return text.removeprefix(f"{where}: ")


# What a scene says of itself


def test_tree_and_names() -> None:
    scene = Scene(
        "leg",
        (
            PointMasses(name="shank", length="free", masses=(1,), fractions=(1,)),
            ElasticRod(name="thigh", parent="shank", length="prescribed", mass=1, rod_length=1),
            Rigid(name="trunk", parent="thigh", mass=1, length=1),
            ElasticRod(name="swing", parent="thigh", hangs=True, length=0, mass=1, rod_length=1),
            JointMasses(name="post", length="free", masses=(1, 1, 1), fraction=0.5),
        ),
    )
    assert scene.parents == (-1, 0, 1, 1, -1)
    assert scene.children == ((1,), (2, 3), (), (), ())
    assert scene.roots == (0, 4)
    assert [link.mode for link in scene.links] == ["free", "prescribed", "fixed", "fixed", "free"]
    assert [link.model for link in scene.links][:3] == ["point-masses", "elastic-rod", "rigid"]
    assert scene.free == (0, 4)
    assert scene.prescribed == (1,)
    angles = ("shank", "thigh", "trunk", "swing", "post")
    assert scene.q_names == (*(f"{name}.angle" for name in angles), "shank.length", "post.length")
    assert scene.v_names[4:] == ("post.angle_rate", "shank.length_rate", "post.length_rate")
    assert scene.u_names[4:] == ("post.torque", "shank.force", "post.force")
    assert scene.w_names == ("thigh.length",)
    assert scene.q_units == ("rad",) * 5 + ("m",) * 2
    assert scene.v_units == ("rad/s",) * 5 + ("m/s",) * 2
    assert scene.u_units == ("N m",) * 5 + ("N",) * 2
    assert scene.q_names is scene.q_names
    assert scene.parameters[-1] == Parameter("gravity", "m/s^2", 9.81)
    assert scene.parameters[0] == Parameter("shank.mass1", "kg", 1.0)


@pytest.mark.parametrize(
    ("table", "names"),
    [
        (a_link("rigid"), "mass length"),
        (a_link("rigid", center=0.0, inertia=0.0), "mass length center inertia"),
        (a_link("elastic-rod"), "mass rod_length"),
        (a_link("elastic-rod", inertia=0.125, length=0.0), "mass rod_length inertia length"),
        (a_link("telescopic"), "rod_mass rod_length housing_mass housing_length"),
        (
            a_link("telescopic", rod_inertia=0.0, housing_inertia=1.0),
            "rod_mass rod_length rod_inertia housing_mass housing_length housing_inertia",
        ),
        (a_link("joint-masses", length=1), "mass1 mass2 mass3 fraction length"),
        (a_link("point-masses", length="prescribed"), "mass1 mass2 fraction1 fraction2"),
        (
            a_link("elastic-rod", stiffness=1.0, rest_length=2.0, damping=3.0),
            "mass rod_length stiffness rest_length damping",
        ),
        (
            a_link("elastic-rod", rest_length=2.0, damping=3.0, joint_rest_angle=1.0),
            "mass rod_length damping",
        ),
        (
            a_link(joint_stiffness=1.0, joint_rest_angle=-2.0, joint_damping=3.0),
            "mass length joint_stiffness joint_rest_angle joint_damping",
        ),
        (a_link(joint_stiffness=1.0), "mass length joint_stiffness"),
    ],
)
def test_only_needed_parameters(table: dict[str, Any], names: str) -> None:
    scene = Scene.from_dict(a_scene(table, gravity=0))
    (link,) = scene.links
    assert [p.name for p in link.parameters] == names.split()
    assert [p.name for p in scene.parameters] == [f"shank.{name}" for name in names.split()]


def test_units_of_parameters() -> None:
    springs: dict[str, Any] = {
        key: 1.0 for key in Link.__struct_fields__ if "stiff" in key or "damp" in key or "rest" in key
    }
    (link,) = Scene.from_dict(a_scene(a_link("elastic-rod", inertia=1.0, **springs))).links
    units = {p.name: p.unit for p in link.parameters}
    assert units == {
        "mass": "kg", "rod_length": "m", "inertia": "kg m^2", "stiffness": "N/m", "rest_length": "m",
        "damping": "N s/m", "joint_stiffness": "N m/rad", "joint_rest_angle": "rad",
        "joint_damping": "N m s/rad",
    }  # fmt: skip


def test_scenes_are_values() -> None:
    one = Scene("leg", [Rigid(name="a", mass=np.float32(0.5), length=Fraction(1, 2))], 0)  # type: ignore[arg-type]
    two = Scene.from_dict({"name": "leg", "links": [a_link(name="a", mass=0.5)], "gravity": -0.0})
    assert one == two
    assert hash(one) == hash(two)
    assert type(one.links[0].length) is float
    assert repr(two.gravity) == "0.0"  # no negative zero: equal scenes are identical to the last bit
    assert pickle.loads(pickle.dumps(one)) == one
    assert one.parameters is one.parameters


@pytest.mark.parametrize(
    "masses",
    [[1, 2], range(1, 3), array.array("f", [1, 2]), np.array([1, 2]), np.float32([1, 2]), np.array([2, 1])[::-1]],
    ids=repr,
)  # fmt: skip
def test_a_sequence_of_masses_becomes_a_tuple(masses: Any) -> None:
    link = PointMasses(name="a", length=1, masses=masses, fractions=np.linspace(0, 1, 2))  # type: ignore[arg-type]
    assert link.masses == (1.0, 2.0)
    assert all(type(mass) is float for mass in link.masses)
    assert hash(Scene("leg", (link,)))
    assert Scene.from_dict({"name": "leg", "links": [{**link.to_dict(), "masses": masses}]}) == Scene("leg", (link,))


@pytest.mark.parametrize("struct", [*LINK_TYPES.values(), Scene], ids=lambda struct: struct.__name__)
def test_docstrings_tell_keys_and_units(struct: Any) -> None:
    """Those of a model's own; what every link has stands in `Link`."""
    keys = struct.__struct_fields__ if struct is Scene else [*struct.__annotations__, "name", "parent", "hangs"]
    told = struct.__doc__ + (Link.__doc__ or "")
    for key in keys:
        assert re.search(rf"^        .*\b{key}\b.*: ", struct.__doc__, re.MULTILINE), key
        unit = QUANTITIES[key].unit if key in QUANTITIES else "1"
        assert unit == "1" or re.search(rf"\b{re.escape(unit)}\b", struct.__doc__), key
    for key in SPRINGS if struct is not Scene else ():
        assert re.search(rf"\b{key}\b", told)
        assert QUANTITIES[key].unit in told
    if struct not in (Scene, Rigid):
        assert re.search(r"Source: model 1[a-d] of Borisov and Rozenblat \(2017\)", struct.__doc__)


def test_every_key_is_known_to_the_writer() -> None:
    for struct in LINK_TYPES.values():
        (link,) = Scene.from_dict(a_scene(a_link(model := str(struct.__struct_config__.tag)))).links
        text = refusal(a_scene(a_link(model, nonsense_key=1)))
        listed_keys = text.split("allowed: ")[1].split(", ")
        assert sorted(listed_keys) == sorted([*link.__struct_fields__, "model"])


# There and back


NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
POSITIVE = st.floats(min_value=0, allow_infinity=False, exclude_min=True)
SIZES = st.floats(min_value=0, allow_infinity=False)
SMALL = st.floats(min_value=0, max_value=1e3)
NAMES = st.from_regex(r"[a-z][A-Za-z0-9_]{0,8}_", fullmatch=True)  # the last _ avoids every reserved word


@st.composite
def links(draw: st.DrawFn, name: str, parents: list[str]) -> Link:
    """A random valid link."""
    model = draw(st.sampled_from(sorted(LINK_TYPES)))
    length = draw(POSITIVE) if model == "rigid" else draw(st.sampled_from(["free", "prescribed"]) | NUMBERS)
    common: dict[str, Any] = {
        "name": name,
        "parent": draw(st.sampled_from(["ground", *parents])),
        "hangs": draw(st.booleans()),
        "length": length,
        "joint_stiffness": draw(SIZES),
        "joint_rest_angle": draw(NUMBERS),
        "joint_damping": draw(SIZES),
    }
    if isinstance(length, str):
        common |= {"stiffness": draw(SIZES), "rest_length": draw(NUMBERS), "damping": draw(SIZES)}
    if model == "rigid":
        optional: dict[str, Any] = {"center": draw(st.none() | NUMBERS), "inertia": draw(st.none() | SIZES)}
        return Rigid(mass=draw(SIZES), **optional, **common)
    if model == "elastic-rod":
        mass, rod = draw(SMALL), draw(SMALL)
        inertia = draw(st.none() | st.floats(min_value=1, max_value=2).map(lambda x: x * (mass * rod * rod / 4)))
        return ElasticRod(mass=mass, rod_length=rod, inertia=inertia, **common)
    if model == "telescopic":
        sizes = draw(st.tuples(SIZES, SIZES, st.none() | SIZES, SMALL, SMALL))
        own = dict(zip(LINK_TYPES[model].__annotations__, sizes, strict=False))
        return Telescopic(**own, **common)  # type: ignore[arg-type]
    if model == "joint-masses":
        return JointMasses(masses=draw(st.tuples(SIZES, SIZES, SIZES)), fraction=draw(NUMBERS), **common)
    pairs = draw(st.lists(st.tuples(SIZES, NUMBERS), min_size=1, max_size=4))
    masses, fractions = zip(*pairs, strict=True)
    return PointMasses(masses=masses, fractions=fractions, **common)


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    """A random valid scene."""
    names = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    made = [draw(links(name, names[:i])) for i, name in enumerate(names)]
    return Scene(draw(NAMES), tuple(made), draw(NUMBERS))  # type: ignore[arg-type]


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(scenes())
def test_round_trips(scene: Scene) -> None:
    for data in (scene.to_dict(), json.loads(json.dumps(scene.to_dict())), tomllib.loads(scene.to_toml())):
        back = Scene.from_dict(data)
        assert back == scene
        assert repr(back) == repr(scene)  # a float's repr tells its bits
    assert Scene.from_dict(scene.to_dict()).to_toml() == scene.to_toml()


def test_defaults_are_not_written() -> None:
    data = a_scene(a_link("telescopic"), a_link("rigid", "thigh", parent="shank", hangs=True))
    scene = Scene.from_dict(data)
    assert scene.to_dict() == data
    assert scene.to_toml() == (
        'name = "leg"\n\n[[links]]\nname = "shank"\nmodel = "telescopic"\nlength = "free"\n'
        "rod_mass = 2.0\nrod_length = 0.5\nhousing_mass = 3.0\nhousing_length = 0.25\n\n"
        '[[links]]\nname = "thigh"\nparent = "shank"\nmodel = "rigid"\nhangs = true\nlength = 0.5\n'
        "mass = 2.0\n"
    )


# What is refused, and in which words

NEGATIVE = "is negative; a mass must be >= 0"
BAD_LINKS = [
    ("rigid", {"mass": -1.0}, f"mass = -1.0 {NEGATIVE}"),
    ("rigid", {"mass": "heavy"}, "mass = 'heavy' is not a number; a mass must be a finite number >= 0"),
    ("rigid", {"mass": True}, "mass = True is not a number"),
    ("rigid", {"mass": [1.0]}, "mass = [1.0] is not a number"),
    ("rigid", {"mass": float("nan")}, "mass = nan is not finite"),
    ("rigid", {"mass": 10**400}, "mass = 1000"),
    ("rigid", {"mass": 10**5000}, "mass = <int> is too large"),
    ("rigid", {"center": float("inf")}, "center = inf is not finite"),
    ("rigid", {"center": "mid"}, "center = 'mid' is not a number; the place of a centre of mass must be"),
    ("rigid", {"inertia": -1e-9}, "inertia = -1e-09 is negative; a moment of inertia must be >= 0"),
    ("rigid", {"length": 0}, "length = 0.0 is not positive"),
    ("rigid", {"length": "free"}, "length = 'free' is not a number; a rigid link needs a number > 0"),
    ("rigid", {"length": "prescribed"}, "length = 'prescribed' is not a number"),
    ("rigid", {"length": False}, "length = False is not a number"),
    ("rigid", {"stiffness": 1.0}, "stiffness = 1.0 on a fixed length; only a free or prescribed"),
    ("rigid", {"joint_stiffness": -1.0}, "joint_stiffness = -1.0 is negative"),
    ("rigid", {"joint_damping": -1.0}, "joint_damping = -1.0 is negative"),
    ("rigid", {"joint_rest_angle": float("inf")}, "joint_rest_angle = inf is not finite"),
    ("rigid", {"hangs": 1}, "hangs = 1 is not a flag; it must be true or false"),
    ("rigid", {"parent": 3}, "parent = 3 is not a string"),
    ("rigid", {"parent": []}, "parent = [] is not a string"),
    ("elastic-rod", {"length": "fre"}, "unknown length 'fre'; allowed: free, prescribed, a number (did"),
    ("elastic-rod", {"length": float("-inf")}, "length = -inf is not finite"),
    ("elastic-rod", {"rod_length": -0.1}, "rod_length = -0.1 is negative; the length of a rod must be >= 0"),
    ("elastic-rod", {"inertia": 0.1}, "inertia = 0.1 leaves a negative central inertia; about a rod"),
    ("elastic-rod", {"inertia": 0.1}, "must be >= mass rod_length^2/4 = 0.125"),
    ("elastic-rod", {"stiffness": -1.0}, "stiffness = -1.0 is negative"),
    ("elastic-rod", {"damping": -1.0}, "damping = -1.0 is negative"),
    ("elastic-rod", {"rest_length": float("nan")}, "rest_length = nan is not finite"),
    ("elastic-rod", {"length": 1.0, "damping": 2.0}, "damping = 2.0 on a fixed length"),
    ("elastic-rod", {"length": 1.0, "rest_length": 2.0}, "rest_length = 2.0 on a fixed length"),
    ("telescopic", {"rod_mass": -1.0}, f"rod_mass = -1.0 {NEGATIVE}"),
    ("telescopic", {"rod_inertia": -1.0}, "rod_inertia = -1.0 is negative"),
    ("telescopic", {"housing_inertia": 0.0}, "housing_inertia = 0.0 leaves a negative central inertia"),
    ("telescopic", {"housing_length": "x"}, "housing_length = 'x' is not a number"),
    ("joint-masses", {"masses": [1.0, 2.0]}, "masses has length 2; a joint-masses link needs exactly 3"),
    ("joint-masses", {"masses": [1.0, -2.0, 0]}, f"masses[1] = -2.0 {NEGATIVE}"),
    ("joint-masses", {"fraction": "half"}, "fraction = 'half' is not a number"),
    ("point-masses", {"masses": 1.0}, "masses = 1.0 is not a list; it must be a list of numbers"),
    ("point-masses", {"masses": [[1.0], 2.0]}, "masses[0] = [1.0] is not a number"),
    ("point-masses", {"masses": np.ones((2, 2))}, "masses[0] = array([1., 1.]) is not a number"),
    ("point-masses", {"masses": np.array(1.0)}, "masses = array(1.) is not a list; it must be a list of numbers"),
    ("point-masses", {"masses": np.array(["1", "2"])}, "masses[0] = '1' is not a number"),
    ("point-masses", {"masses": {0: 1.0, 1: 2.0}}, "masses = {0: 1.0, 1: 2.0} is not a list"),
    ("point-masses", {"masses": {1.0}}, "masses = {1.0} is not a list"),
    ("point-masses", {"masses": b"ab"}, "masses = b'ab' is not a list"),
    ("point-masses", {"masses": [], "fractions": []}, "masses is empty"),
    ("point-masses", {"masses": [1.0]}, "masses has length 1 but fractions 2; every mass needs"),
    ("point-masses", {"fractions": [0.0, float("inf")]}, "fractions[1] = inf is not finite"),
]  # fmt: skip
BAD_KEYS = [
    ("point-masses", {"mases": [1.0]}, "unknown key 'mases'; allowed: name, parent, model, hangs"),
    ("point-masses", {"mases": [1.0]}, "(did you mean 'masses'?)"),
    ("point-masses", {"mass": 1.0}, "unknown key 'mass'; allowed:"),
    ("rigid", {"gravity": 0.0}, "key 'gravity' belongs to the scene; move it above the first [[links]]"),
    ("rigid", {"mass": None}, "missing key 'mass'; a rigid link needs name, length, mass"),
    ("elastic-rod", {"length": None}, "missing key 'length'; an elastic-rod link needs name, length, mass"),
]  # fmt: skip


@pytest.mark.parametrize(("model", "changes", "words"), BAD_LINKS + BAD_KEYS)
def test_bad_link(model: str, changes: dict[str, Any], words: str) -> None:
    text = refusal(a_scene(a_link("rigid", "first"), a_link(model, **changes)))
    assert text.startswith("links[1] 'shank': ")
    assert words in text


@pytest.mark.parametrize(("model", "changes", "words"), BAD_LINKS)
def test_bad_link_from_python(model: str, changes: dict[str, Any], words: str) -> None:
    table = a_link(model, **changes)
    del table["model"]
    with pytest.raises(SceneError) as caught:
        Scene("leg", (LINK_TYPES[model](**table),))
    assert words in str(caught.value)
    assert str(caught.value).startswith("links[0] 'shank': ")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "name = '' is not an identifier"),
        ("a b", "name = 'a b' is not an identifier; use at most 64 ASCII letters"),
        ("1a", "is not an identifier"),
        ("голень", "name = 'голень' is not an identifier"),
        ("a\n", r"name = 'a\n' is not an identifier"),
        ("a\x1b[31m", r"name = 'a\x1b[31m' is not an identifier"),
        ("a" * 65, "(65 characters) is not an identifier"),
        ("a" * 10_000, "(10000 characters) is not an identifier"),
        ("\x00" * 10_000, "(10000 characters) is not an identifier"),
        ("class", "name = 'class' is a reserved word of Python or C; choose another"),
        ("double", "name = 'double' is a reserved word of Python or C"),
        ("ground", "name = 'ground' is a reserved word of eomgen"),
        ("gravity", "name = 'gravity' is a reserved word of eomgen"),
        (5, "name = 5 is not a string"),
        ([], "name = [] is not a string"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_bad_name(name: Any, words: str) -> None:
    assert words in refusal(a_scene(a_link(name=name)))


def test_good_names() -> None:
    for name in ("a" * 64, "_", "Shank_2", "match", "angle"):
        assert Scene.from_dict(a_scene(a_link(name=name))).links[0].name == name
    assert Scene.from_dict(a_scene(name="ground")).name == "ground"


@pytest.mark.parametrize(
    ("parents", "words"),
    [
        (("ground", "x"), "links[1] 'b': unknown parent 'x'; allowed: ground, a"),
        (("ground", "grund"), "(did you mean 'ground'?)"),
        (("ground", "b"), "links[1] 'b': parent = 'b' makes a cycle (the link itself)"),
        (("b", "a"), "links[0] 'a': parent = 'b' makes a cycle (a, b); let one link stand on an earlier one"),
        (("b", "ground"), "links[0] 'a': parent = 'b' is a later link; parents stand before their children"),
        (("b", "c", "b"), "links[0] 'a': parent = 'b' is a later link"),
        (("b", "c", "x"), "links[0] 'a': parent = 'b' is a later link"),
        (("ground", "a\n" * 5000), "(10000 characters)"),
    ],
)
def test_bad_parent(parents: tuple[str, ...], words: str) -> None:
    tables = [a_link(name=name, parent=parent) for name, parent in zip("abc", parents, strict=False)]
    assert words in refusal(a_scene(*tables))


def test_long_cycle_and_many_names_make_a_short_message() -> None:
    count = 20_000
    names = [f"link{i}" for i in range(count)]
    ring = [a_link(name=name, parent=names[(i + 1) % count]) for i, name in enumerate(names)]
    assert "makes a cycle (link0, link1, " in refusal(a_scene(*ring))
    line = [a_link(name=name) for name in names]
    line[-1]["parent"] = "lonk1"
    assert "allowed: ground, link0, " in refusal(a_scene(*line))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ([], "[] is not a table; the scene must be a table of keys and values"),
        ({}, "missing key 'name'; a scene needs name, links"),
        ({"name": "leg"}, "missing key 'links'"),
        (a_scene(gravty=1), "unknown key 'gravty'; allowed: name, links, gravity (did you mean 'gravity'?)"),
        ({5: 1}, "unknown key 5; allowed:"),
        ({"x" * 10_000: 1}, "unknown key 'xxx"),
        (a_scene(name="a b"), "name = 'a b' is not an identifier"),
        (a_scene(name=1), "name = 1 is not a string"),
        (a_scene(gravity="down"), "gravity = 'down' is not a number; gravity must be a finite number"),
        (a_scene(gravity=float("nan")), "gravity = nan is not finite"),
        (a_scene(gravity=True), "gravity = True is not a number"),
        (a_scene(links=a_link()), "is not a list; write [[links]] above each link"),
        (a_scene(links=[]), "the scene has no links; give at least one"),
        (a_scene(links=[5]), "links[0]: 5 is not a table; the link must be a table"),
        (a_scene(a_link(model="rigid"), a_link()), "links[1] 'shank': links[0] has this name already"),
        (a_scene({"name": "a"}), "links[0] 'a': missing key 'model'; it is one of rigid, elastic-rod"),
        (a_scene({"model": "rigid", "mass": 1}), "links[0]: missing key 'name'"),
        (a_scene({"name": "a", "model": "ridgid"}), "unknown model 'ridgid'; allowed: rigid, elastic-rod"),
        (a_scene({"name": "a", "model": "ridgid"}), "(did you mean 'rigid'?)"),
        (a_scene({"name": "a", "model": []}), "links[0] 'a': unknown model []; allowed:"),
    ],
)  # fmt: skip
def test_bad_scene(data: object, words: str) -> None:
    assert words in refusal(data)


@pytest.mark.parametrize(
    ("links", "words"),
    [
        (5, "links = 5 is not a list"),
        ((5,), "links[0]: 5 is not a link; allowed: Rigid, ElasticRod, Telescopic, JointMasses, PointMasses"),
        ((Link(name="a", length=1),), "is not a link; allowed: Rigid"),
    ],
)
def test_bad_links_from_python(links: Any, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        Scene("leg", links)
    assert words in str(caught.value)


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=80) | st.binary(max_size=9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner, max_size=3),
    max_leaves=6,
)
KEYS = st.sampled_from([*Link.__struct_fields__, "model", "mass", "masses", "fractions", "rod_length", "links"])


@given(
    st.sampled_from(sorted(LINK_TYPES)),
    st.dictionaries(KEYS, JUNK, max_size=2),
    st.dictionaries(st.sampled_from(["name", "gravity", "links", "x"]), JUNK, max_size=1),
)
def test_junk_gives_a_scene_or_one_line(model: str, in_link: dict[str, Any], in_scene: dict[str, Any]) -> None:
    data = a_scene({**a_link(model), **in_link}, **in_scene)
    try:
        assert Scene.from_dict(data).parameters is not None
    except SceneError:
        refusal(data)


def test_replacing_checks_again() -> None:
    scene = chain(2)
    assert msgspec.structs.replace(scene, gravity=0).gravity == 0
    with pytest.raises(SceneError, match="gravity = inf is not finite"):
        msgspec.structs.replace(scene, gravity=float("inf"))


def test_inertia_may_miss_the_least_value_by_rounding() -> None:
    least = 2.0 * 0.5 * 0.5 / 4
    assert Scene.from_dict(a_scene(a_link("elastic-rod", inertia=least * (1 - 1e-13))))
    refusal(a_scene(a_link("elastic-rod", inertia=least * (1 - 1e-11))))
    assert Scene.from_dict(a_scene(a_link("elastic-rod", inertia=0, rod_length=0)))


# Files


def write(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def file_refusal(path: Path | str) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    text = str(caught.value)
    assert text.isprintable()
    assert len(text) < 400
    return text


CONTRACT = """
name = "leg"
gravity = 9.81                    # m/s², along -y
[[links]]
name = "shank"
parent = "ground"
model = "point-masses"
hangs = false
length = "free"
masses = [0.7, 1.5, 0.7]
fractions = [0.0, 0.595, 1]
"""


def test_load(tmp_path: Path) -> None:
    expected = PointMasses(name="shank", length="free", masses=(0.7, 1.5, 0.7), fractions=(0, 0.595, 1))
    scene = load_scene(write(tmp_path / "leg.toml", CONTRACT))
    assert scene == Scene("leg", (expected,))
    assert load_scene(str(write(tmp_path / "bom.toml", "\ufeff" + CONTRACT))) == scene
    assert load_scene(write(tmp_path / "back.toml", scene.to_toml())) == scene


def test_file_name_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "walker.toml", Scene.from_dict(a_scene()).to_toml().replace("mass = 2.0", "mass = -1"))
    assert file_refusal("walker.toml") == f"walker.toml: links[0] 'shank': mass = -1.0 {NEGATIVE}"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"name = 'a\xff'", "byte 9 is not UTF-8; save the file as UTF-8"),
        ("name = ", "not TOML: Invalid value (at end of document)"),
        ("name = 'a'\nlinks = [\n  {]", "(at line 3, column 4)"),
        (f"x = {'9' * 5000}", "not TOML: Exceeds the limit"),
        (f"x = {'[' * 5_000}", "nested too deeply"),
        (f"[{'k' * 10_000}]\n[{'k' * 10_000}]", "twice (at line 2, column 1000"),
        ("name = 1979-05-27\nlinks = []", "name = datetime.date(1979, 5, 27) is not a string"),
        ("", "missing key 'name'"),
        ("\x00", "not TOML"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_bad_file(tmp_path: Path, text: str | bytes, words: str) -> None:
    message = file_refusal(write(tmp_path / "leg.toml", text))
    assert words in message
    assert "leg.toml: " in message


@pytest.mark.parametrize("path", [None, 3, b"leg.toml", {"name": "leg"}])
def test_no_path(path: Any) -> None:
    with pytest.raises(SceneError) as refusal:
        load_scene(path)
    assert str(refusal.value) == f"{path!r} is no path; give the path of a scene file (TOML)"


def test_unreadable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "no such file" in file_refusal(tmp_path / "none.toml")
    assert "is a directory" in file_refusal(tmp_path)
    assert "cannot be read (embedded null byte); check the path" in file_refusal("a\0b")
    assert "cannot be read (File name too long)" in file_refusal("x" * 10_000)

    def refuse(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refuse)
    assert "leg.toml: cannot be read (Permission denied); check the path" in file_refusal("leg.toml")


# The texts of errors


def test_exit_codes() -> None:
    assert (SceneError.exit_code, CheckError.exit_code, BuildError.exit_code) == (2, 1, 3)
    assert issubclass(BuildError, EomgenError)


def test_unknown() -> None:
    methods = ("lagrange", "recursive", "matrix")
    assert unknown("method", "matrx", methods) == (
        "unknown method 'matrx'; allowed: lagrange, recursive, matrix (did you mean 'matrix'?)"
    )
    assert unknown("method", "x", methods) == "unknown method 'x'; allowed: lagrange, recursive, matrix"
    assert unknown("method", None, methods) == "unknown method None; allowed: lagrange, recursive, matrix"
    assert len(unknown("method", "a" * 10_000, [f"a{i}" for i in range(10_000)])) < 400


def test_shown() -> None:
    class Rude:
        def __repr__(self) -> str:
            raise RuntimeError

    assert shown("a") == "'a'"
    assert shown("a" * 1000) == f"'{'a' * 50}'... (1000 characters)"
    assert shown("\r\x1b\u202e") == r"'\r\x1b\u202e'"
    assert shown(Rude()) == "<Rude>"
    assert len(shown(list(range(10**5)))) < 60
    assert shown(np.zeros((2, 2))).isprintable()


def test_one_line_and_listed() -> None:
    assert one_line("a\nb") == r"a\nb"
    assert one_line("a" * 50 + "b" * 50, 12) == "aaaaaaaa...bbbb"
    assert listed(["a", "b"]) == "a, b"
    assert listed("x" * 100 for _ in range(9)) == f"{'x' * 100}, {'x' * 100}, ..."
