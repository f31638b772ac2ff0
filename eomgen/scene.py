"""Scenes: planar trees of links as validated data. Nothing here is symbolic.

A `Scene` that exists is valid: it is checked when it is made, from Python as from a file. The meaning of the
link models is in `eomgen.links`; their keys, and the names and units of all a scene defines, are here.
"""

import keyword
import math
import numbers
import re
from collections.abc import Iterator, Mapping
from functools import cache, cached_property
from typing import Any, Literal, NamedTuple

import msgspec
from msgspec.structs import force_setattr

from eomgen.errors import SceneError, listed, one_line, shown, unknown

Length = float | Literal["free", "prescribed"]
Mode = Literal["free", "prescribed", "fixed"]


class Parameter(NamedTuple):
    """A number of the model: its name, its unit and the scene's value."""

    name: str
    unit: str
    value: float


class Quantity(NamedTuple):
    """What a key holds: the noun for messages, the unit and the least value."""

    noun: str
    unit: str
    least: float = -math.inf


_MASS = Quantity("a mass", "kg", 0.0)
_INERTIA = Quantity("a moment of inertia", "kg m^2", 0.0)
_ROD_LENGTH = Quantity("the length of a rod", "m", 0.0)
_FRACTION = Quantity("a fraction of the length", "1")
QUANTITIES = {
    "mass": _MASS,
    "rod_mass": _MASS,
    "housing_mass": _MASS,
    "masses": _MASS,
    "length": Quantity("a length", "m"),
    "rod_length": _ROD_LENGTH,
    "housing_length": _ROD_LENGTH,
    "center": Quantity("the place of a centre of mass", "m"),
    "inertia": _INERTIA,
    "rod_inertia": _INERTIA,
    "housing_inertia": _INERTIA,
    "fraction": _FRACTION,
    "fractions": _FRACTION,
    "stiffness": Quantity("a stiffness", "N/m", 0.0),
    "rest_length": Quantity("a rest length", "m"),
    "damping": Quantity("a damping", "N s/m", 0.0),
    "joint_stiffness": Quantity("a joint stiffness", "N m/rad", 0.0),
    "joint_rest_angle": Quantity("a rest angle", "rad"),
    "joint_damping": Quantity("a joint damping", "N m s/rad", 0.0),
    "gravity": Quantity("gravity", "m/s^2"),
}

_HEAD = ("name", "parent", "model", "hangs", "length")  # keys of every link, as a scene file shows them
ALONG = ("stiffness", "rest_length", "damping")  # springs and dampers along a link
IN_JOINT = ("joint_stiffness", "joint_rest_angle", "joint_damping")
SPRINGS = (*ALONG, *IN_JOINT)
_SPRING_OF_REST = {"rest_length": "stiffness", "joint_rest_angle": "joint_stiffness"}
_ITEM = {"masses": "mass", "fractions": "fraction"}  # masses -> mass1, mass2, ...


class Link(msgspec.Struct, frozen=True, kw_only=True, dict=True, forbid_unknown_fields=True, tag_field="model"):
    """What every link model has in common; a scene takes the models below only.

    A link goes from A to B; its angle is absolute. Positions on it are counted from A.

    Attributes:
        name: an identifier, unique in the scene.
        parent: an earlier link, whose far end carries this one, or "ground", the origin.
        hangs: whether B is what is attached to the parent, and A the free end.
        length: the coordinate s of the model: "free" (a coordinate), "prescribed" (an argument) or fixed (m).
        stiffness, rest_length, damping: of a spring (N/m, slack at m) and a damper (N s/m) along a length not fixed.
        joint_stiffness, joint_rest_angle, joint_damping: of a spring (N m/rad, slack at rad) and a damper (N m s/rad)
            between the parent, or the ground, and the link.
    """

    name: str
    parent: str = "ground"
    hangs: bool = False
    length: Length
    stiffness: float = 0.0
    rest_length: float = 0.0
    damping: float = 0.0
    joint_stiffness: float = 0.0
    joint_rest_angle: float = 0.0
    joint_damping: float = 0.0

    def __post_init__(self) -> None:
        for key in _numeric(type(self)):
            value = getattr(self, key)
            force_setattr(self, key, _floats(value) if key in _ITEM else _float(value))

    @property
    def model(self) -> str:
        """The name of the model, as in a scene file."""
        return str(self.__struct_config__.tag)

    @property
    def mode(self) -> Mode:
        """How the length behaves: free, prescribed or fixed."""
        return self.length if isinstance(self.length, str) else "fixed"

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The numbers the link needs, under short names ("mass"): no zero springs, no defaulted inertias."""
        return tuple(self._parameters())

    def _parameters(self) -> Iterator[Parameter]:
        own = _own(type(self))
        length = ("length",) if self.mode == "fixed" and "length" not in own else ()
        for key in (*own, *length, *filter(self._acts, SPRINGS)):
            value, unit = getattr(self, key), QUANTITIES[key].unit
            if isinstance(value, tuple):
                yield from (Parameter(f"{_ITEM[key]}{n}", unit, x) for n, x in enumerate(value, 1))
            elif value is not None:
                yield Parameter(key, unit, value)

    def _acts(self, key: str) -> bool:
        """Whether a spring's or damper's number is felt: it and its stiffness are not zero."""
        return bool(getattr(self, key) and getattr(self, _SPRING_OF_REST.get(key, key)))

    def to_dict(self) -> dict[str, Any]:
        """The link as it stands in a scene file: plain values, without the defaults."""
        return {
            key: list(value) if isinstance(value := getattr(self, key), tuple) else value
            for key in _keys(type(self))
            if key == "model" or getattr(self, key) != _defaults(type(self))[key]
        }


class Rigid(Link, frozen=True, kw_only=True, tag="rigid"):
    """A rigid rod from A to B.

    Attributes:
        mass: kg.
        length: m, positive; always fixed.
        center: where the centre of mass is, from A (the free end of a hanging link), m; None is the middle.
        inertia: about the centre of mass, kg m^2; None is that of a uniform rod.
        name, parent, hangs, joint_stiffness, joint_rest_angle, joint_damping: of every link, see `eomgen.scene.Link`.
    """

    mass: float
    length: float
    center: float | None = None
    inertia: float | None = None


class ElasticRod(Link, frozen=True, kw_only=True, tag="elastic-rod"):
    """A massless stretch of length s from A, then a uniform rigid rod that ends in B.

    Source: model 1a of Borisov and Rozenblat (2017).

    Attributes:
        mass: of the rod, kg.
        rod_length: m.
        inertia: about the rod's near end, at least mass rod_length^2/4, kg m^2; None is that of a uniform rod.
        name, parent, hangs, length, springs and dampers: of every link, see `eomgen.scene.Link`.
    """

    mass: float
    rod_length: float
    inertia: float | None = None


class Telescopic(Link, frozen=True, kw_only=True, tag="telescopic"):
    """A uniform rod fixed at A, and a uniform housing that slides along it, from s to B.

    Source: model 1b of Borisov and Rozenblat (2017).

    Attributes:
        rod_mass, housing_mass: kg.
        rod_length, housing_length: m.
        rod_inertia: about the rod's centre, kg m^2; None is that of a uniform rod.
        housing_inertia: about the housing's near end, at least housing_mass housing_length^2/4, kg m^2; None is that of
            a uniform rod.
        name, parent, hangs, length, springs and dampers: of every link, see `eomgen.scene.Link`.
    """

    rod_mass: float
    rod_length: float
    rod_inertia: float | None = None
    housing_mass: float
    housing_length: float
    housing_inertia: float | None = None


class JointMasses(Link, frozen=True, kw_only=True, tag="joint-masses"):
    """Three masses on a massless rod of length s.

    Source: model 1c of Borisov and Rozenblat (2017).

    Attributes:
        masses: three: at A, between, at B, kg.
        fraction: where the second is, as a part of the length from A.
        name, parent, hangs, length, springs and dampers: of every link, see `eomgen.scene.Link`.
    """

    masses: tuple[float, ...]
    fraction: float


class PointMasses(Link, frozen=True, kw_only=True, tag="point-masses"):
    """Any number of masses on a massless rod of length s.

    Source: model 1d of Borisov and Rozenblat (2017).

    Attributes:
        masses: kg.
        fractions: where each is, as a part of the length from A.
        name, parent, hangs, length, springs and dampers: of every link, see `eomgen.scene.Link`.
    """

    masses: tuple[float, ...]
    fractions: tuple[float, ...]


AnyLink = Rigid | ElasticRod | Telescopic | JointMasses | PointMasses
LINK_TYPES: dict[str, type[AnyLink]] = {
    "rigid": Rigid,
    "elastic-rod": ElasticRod,
    "telescopic": Telescopic,
    "joint-masses": JointMasses,
    "point-masses": PointMasses,
}


class Scene(msgspec.Struct, frozen=True, forbid_unknown_fields=True, dict=True):
    """A valid mechanism: a tree (or several) of links on the ground.

    Attributes:
        name: an identifier; names the compiled package.
        links: parents before their children.
        gravity: along -y, m/s^2.
    """

    name: str
    links: tuple[AnyLink, ...]
    gravity: float = 9.81

    def __post_init__(self) -> None:
        if isinstance(self.links, list):
            force_setattr(self, "links", tuple(self.links))
        force_setattr(self, "gravity", _float(self.gravity))
        _check_scene(self)

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """The index of every link's parent, -1 for the ground."""
        index = {link.name: i for i, link in enumerate(self.links)} | {"ground": -1}
        return tuple(index[link.parent] for link in self.links)

    @cached_property
    def children(self) -> tuple[tuple[int, ...], ...]:
        """The indices of every link's children, ascending."""
        found: list[list[int]] = [[] for _ in self.links]
        for i, parent in enumerate(self.parents):
            if parent >= 0:
                found[parent].append(i)
        return tuple(map(tuple, found))

    @cached_property
    def roots(self) -> tuple[int, ...]:
        """The links that stand on the ground."""
        return tuple(i for i, parent in enumerate(self.parents) if parent < 0)

    @cached_property
    def free(self) -> tuple[int, ...]:
        """The links whose length is a coordinate."""
        return tuple(i for i, link in enumerate(self.links) if link.mode == "free")

    @cached_property
    def prescribed(self) -> tuple[int, ...]:
        """The links whose length is a given function of time."""
        return tuple(i for i, link in enumerate(self.links) if link.mode == "prescribed")

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All numbers of the model under full names ("shank.mass"), gravity last and only if there is any."""
        own = [p._replace(name=f"{link.name}.{p.name}") for link in self.links for p in link.parameters]
        unit = QUANTITIES["gravity"].unit
        return (*own, Parameter("gravity", unit, self.gravity)) if self.gravity else tuple(own)

    def _names(self, angle: str, length: str) -> tuple[str, ...]:
        """One name for every angle, then one for every free length."""
        lengths = (f"{self.links[i].name}.{length}" for i in self.free)
        return (*(f"{link.name}.{angle}" for link in self.links), *lengths)

    def _units(self, angle: str, length: str) -> tuple[str, ...]:
        return (angle,) * len(self.links) + (length,) * len(self.free)

    @cached_property
    def q_names(self) -> tuple[str, ...]:
        """The coordinates."""
        return self._names("angle", "length")

    @cached_property
    def v_names(self) -> tuple[str, ...]:
        """Their rates."""
        return self._names("angle_rate", "length_rate")

    @cached_property
    def u_names(self) -> tuple[str, ...]:
        """The inputs: joint torques, then the longitudinal forces of the free lengths."""
        return self._names("torque", "force")

    @cached_property
    def w_names(self) -> tuple[str, ...]:
        """The prescribed lengths."""
        return tuple(f"{self.links[i].name}.length" for i in self.prescribed)

    @property
    def q_units(self) -> tuple[str, ...]:
        """The units of `q_names`."""
        return self._units("rad", "m")

    @property
    def v_units(self) -> tuple[str, ...]:
        """The units of `v_names`."""
        return self._units("rad/s", "m/s")

    @property
    def u_units(self) -> tuple[str, ...]:
        """The units of `u_names`."""
        return self._units("N m", "N")

    def to_dict(self) -> dict[str, Any]:
        """The scene as plain values, without the defaults; `Scene.from_dict` gives an equal scene."""
        gravity = {} if self.gravity == _defaults(Scene)["gravity"] else {"gravity": self.gravity}
        return {"name": self.name, **gravity, "links": [link.to_dict() for link in self.links]}

    def to_toml(self) -> str:
        """The text of a scene file that loads as an equal scene."""
        data = self.to_dict()
        links = data.pop("links")
        tables = [_toml_lines(data), *(["[[links]]", *_toml_lines(link)] for link in links)]
        return "\n\n".join("\n".join(lines) for lines in tables) + "\n"

    @classmethod
    def from_dict(cls, data: object, where: str = "scene") -> "Scene":
        """The scene described by plain values.

        Args:
            data: What `to_dict` gives or a TOML parser reads.
            where: The file or place the data came from: every message starts with it.

        Raises:
            SceneError: A key is unknown or missing, or a value is not allowed.
        """
        try:
            return _read_scene(data)
        except SceneError as error:
            raise SceneError(f"{one_line(where, 80)}: {error}") from None


def _float(value: Any) -> Any:
    """A real number as a float (-0.0 as 0.0: equal means identical), the rest as it is, to be refused."""
    if not _is_real(value):
        return value
    try:
        return float(value) + 0.0
    except OverflowError:  # an int too large for a float
        return value


def _floats(value: Any) -> Any:
    """A sequence of numbers, an array for one, as a tuple of floats; the rest as it is, to be refused."""
    if isinstance(value, (str, bytes, bytearray, Mapping)) or not hasattr(value, "__getitem__"):
        return value
    try:
        return tuple(map(_float, value))
    except TypeError:  # an array without axes
        return value


def _is_real(value: object) -> bool:
    return isinstance(value, (float, numbers.Real)) and not isinstance(value, bool)


def _toml_lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {_toml_value(value)}" for key, value in table.items()]


def _toml_value(value: Any) -> str:
    """TOML text of a flag, a list, a number or a string; our strings are identifiers and need no escapes."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml_value, value))}]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


# Reading plain values: which keys there are. What they may hold is checked when the scene is made.


@cache
def _own(model: type[Link]) -> tuple[str, ...]:
    """The keys a model adds to those of every link, in the order of its parameters."""
    return tuple(model.__annotations__)


@cache
def _numeric(model: type[Link]) -> tuple[str, ...]:
    """The keys that hold numbers."""
    return tuple(key for key in model.__struct_fields__ if key in QUANTITIES)


@cache
def _keys(struct: type[msgspec.Struct]) -> tuple[str, ...]:
    """The keys of a scene or link, in the order a scene file shows them."""
    if not issubclass(struct, Link):
        return struct.__struct_fields__
    return (*_HEAD, *(key for key in _own(struct) if key not in _HEAD), *SPRINGS)


@cache
def _defaults(struct: type[msgspec.Struct]) -> dict[str, Any]:
    """The default of every key; `msgspec.NODEFAULT` where the key is required."""
    return {field.name: field.default for field in msgspec.structs.fields(struct)}


def _read_scene(data: object) -> Scene:
    table = _table(data, "", "the scene")
    _check_keys(table, Scene, "", "a scene")
    if not isinstance(table["links"], (list, tuple)):
        raise SceneError(f"links = {shown(table['links'])} is not a list; write [[links]] above each link")
    return Scene(**{**table, "links": tuple(_read_link(i, link) for i, link in enumerate(table["links"]))})


def _read_link(i: int, data: object) -> AnyLink:
    table = dict(_table(data, f"links[{i}]: ", "the link"))
    label = _label(i, table.get("name"))
    if "model" not in table:
        raise SceneError(f"{label}missing key 'model'; it is one of {listed(LINK_TYPES)}")
    model = table.pop("model")
    if not isinstance(model, str) or model not in LINK_TYPES:
        raise SceneError(label + unknown("model", model, LINK_TYPES))
    _check_keys(table, LINK_TYPES[model], label, f"{'an' if model[0] == 'e' else 'a'} {model} link")
    return LINK_TYPES[model](**table)


def _table(data: object, label: str, what: str) -> Mapping[str, Any]:
    if isinstance(data, Mapping):
        return data
    raise SceneError(f"{label}{shown(data)} is not a table; {what} must be a table of keys and values")


def _check_keys(table: Mapping[str, Any], struct: type[msgspec.Struct], label: str, what: str) -> None:
    keys, defaults = _keys(struct), _defaults(struct)
    for key in table:
        if key == "gravity" and key not in keys:
            raise SceneError(f"{label}key 'gravity' belongs to the scene; move it above the first [[links]]")
        if key not in keys:
            raise SceneError(label + unknown("key", key, keys))
    required = [key for key in keys if defaults.get(key) is msgspec.NODEFAULT]
    for key in required:
        if key not in table:
            raise SceneError(f"{label}missing key {key!r}; {what} needs {listed(required)}")


# Checks: types and values. A label says where a value stands and ends in ": ".

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
_C_WORDS = """
alignas alignof asm auto bool break case char const constexpr continue default do double else enum extern
false float for fortran goto if inline int long nullptr register restrict return short signed sizeof static
static_assert struct switch thread_local true typedef typeof typeof_unqual union unsigned void volatile while
_Alignas _Alignof _Atomic _BitInt _Bool _Complex _Decimal128 _Decimal32 _Decimal64 _Generic _Imaginary
_Noreturn _Static_assert _Thread_local
"""
_RESERVED = frozenset([*keyword.kwlist, *_C_WORDS.split()])
_TAKEN = ("ground", "gravity")  # names that mean something else where a link's name could stand
_SLACK = 1e-12  # relative; an inertia typed in decimals may miss m l^2/4 by rounding


def _label(i: int, name: object) -> str:
    return f"links[{i}] {shown(name)}: " if isinstance(name, str) else f"links[{i}]: "


def _check_scene(scene: Scene) -> None:
    _check_name(scene.name, "")
    _check_number(scene.gravity, "gravity", QUANTITIES["gravity"], "")
    if not isinstance(scene.links, tuple):
        raise SceneError(f"links = {shown(scene.links)} is not a list; a scene needs a list of links")
    if not scene.links:
        raise SceneError("the scene has no links; give at least one")
    first: dict[str, int] = {}
    for i, link in enumerate(scene.links):
        if type(link) not in LINK_TYPES.values():
            allowed = listed(made.__name__ for made in LINK_TYPES.values())
            raise SceneError(f"links[{i}]: {shown(link)} is not a link; allowed: {allowed}")
        label = _label(i, link.name)
        _check_name(link.name, label, _TAKEN)
        if first.setdefault(link.name, i) != i:
            raise SceneError(f"{label}links[{first[link.name]}] has this name already; names must be unique")
        _check_link(link, label)
    for i, link in enumerate(scene.links):
        if link.parent != "ground" and first.get(link.parent, i) >= i:
            raise SceneError(_label(i, link.name) + _parent_fault(scene.links, first, i))


def _check_name(name: object, label: str, taken: tuple[str, ...] = ()) -> None:
    if not isinstance(name, str):
        raise SceneError(f"{label}name = {shown(name)} is not a string; a name must be an identifier")
    if not _IDENTIFIER.fullmatch(name):
        advice = "use at most 64 ASCII letters, digits and _, no digit first"
        raise SceneError(f"{label}name = {shown(name)} is not an identifier; {advice}")
    if name in _RESERVED or name in taken:
        owner = "eomgen" if name in taken else "Python or C"
        raise SceneError(f"{label}name = {name!r} is a reserved word of {owner}; choose another name")


def _check_number(value: object, key: str, quantity: Quantity, label: str) -> None:
    must = "a finite number" + (" >= 0" if quantity.least == 0 else "")
    if type(value) is not float:
        fault = "is too large" if _is_real(value) else "is not a number"
    elif not math.isfinite(value):
        fault = "is not finite"
    elif value < quantity.least:
        fault, must = "is negative", ">= 0"
    else:
        return
    raise SceneError(f"{label}{key} = {shown(value)} {fault}; {quantity.noun} must be {must}")


def _check_link(link: AnyLink, label: str) -> None:
    if not isinstance(link.parent, str):
        raise SceneError(f"{label}parent = {shown(link.parent)} is not a string; name a link or ground")
    if not isinstance(link.hangs, bool):
        raise SceneError(f"{label}hangs = {shown(link.hangs)} is not a flag; it must be true or false")
    _check_length(link, label)
    for key in (*_own(type(link)), *SPRINGS):
        value = getattr(link, key)
        if key in _ITEM:
            _check_list(value, key, label)
        elif value is not None or _defaults(type(link))[key] is not None:
            _check_number(value, key, QUANTITIES[key], label)
    _check_model(link, label)


def _check_length(link: AnyLink, label: str) -> None:
    length: object = link.length
    if isinstance(link, Rigid) and isinstance(length, str):
        others = listed(model for model in LINK_TYPES if model != "rigid")
        advice = f"a rigid link needs a number > 0; lengths vary in {others}"
        raise SceneError(f"{label}length = {shown(length)} is not a number; {advice}")
    if isinstance(length, str):
        if length not in ("free", "prescribed"):
            raise SceneError(label + unknown("length", length, ("free", "prescribed", "a number")))
        return
    _check_number(length, "length", QUANTITIES["length"], label)
    if isinstance(link, Rigid) and link.length <= 0:
        raise SceneError(f"{label}length = {link.length!r} is not positive; a rigid length must be > 0")
    for key in ALONG:
        if getattr(link, key) != 0:
            advice = "only a free or prescribed length has a spring or damper along it: leave the key out"
            raise SceneError(f"{label}{key} = {shown(getattr(link, key))} on a fixed length; {advice}")


def _check_list(values: object, key: str, label: str) -> None:
    if not isinstance(values, tuple):
        raise SceneError(f"{label}{key} = {shown(values)} is not a list; it must be a list of numbers")
    for k, value in enumerate(values):
        _check_number(value, f"{key}[{k}]", QUANTITIES[key], label)


def _check_model(link: AnyLink, label: str) -> None:
    """What the numbers of one model must fulfil together."""
    match link:
        case ElasticRod():
            _check_end_inertia(link, "inertia", "mass", "rod_length", label)
        case Telescopic():
            _check_end_inertia(link, "housing_inertia", "housing_mass", "housing_length", label)
        case JointMasses() if len(link.masses) != 3:
            raise SceneError(f"{label}masses has length {len(link.masses)}; a joint-masses link needs exactly 3")
        case PointMasses() if not link.masses:
            raise SceneError(f"{label}masses is empty; a point-masses link needs at least one mass")
        case PointMasses() if len(link.masses) != len(link.fractions):
            counts = f"masses has length {len(link.masses)} but fractions {len(link.fractions)}"
            raise SceneError(f"{label}{counts}; every mass needs one fraction")


def _check_end_inertia(link: Link, inertia: str, mass: str, length: str, label: str) -> None:
    """An inertia about the end of a rod is at least m l^2/4: the rest is central and not negative."""
    given = getattr(link, inertia)
    least = getattr(link, mass) * getattr(link, length) * getattr(link, length) / 4
    if given is not None and given < least * (1 - _SLACK):
        advice = f"about a rod's end it must be >= {mass} {length}^2/4 = {least!r}"
        raise SceneError(f"{label}{inertia} = {given!r} leaves a negative central inertia; {advice}")


def _parent_fault(links: tuple[AnyLink, ...], first: Mapping[str, int], i: int) -> str:
    """Why the parent of link i is neither the ground nor an earlier link."""
    parent = links[i].parent
    if parent not in first:
        return unknown("parent", parent, ("ground", *(link.name for link in links[:i])))
    path = {links[i].name: None}  # a dict for its order and its quick `in`
    while parent in first and parent not in path:
        path[parent] = None
        parent = links[first[parent]].parent
    if parent == links[i].name:
        ring = listed(path) if len(path) > 1 else "the link itself"
        return f"parent = {links[i].parent!r} makes a cycle ({ring}); let one link stand on an earlier one"
    return f"parent = {links[i].parent!r} is a later link; parents stand before their children: move it up"
