"""The link models as constants of one affine link.

A link has an attachment point A, a direction u and one length coordinate s. Each of its bodies stands at
A + r u with r = alpha + beta s, its far end B at A + L u with L = alpha_L + beta_L s. A model is nothing but
the constants of its bodies and of its far end.

Source: A. V. Borisov, G. M. Rozenblat, "New algorithms for composing differential equations of motion of an
exoskeleton with variable-length links", Computer Research and Modeling, 2017, 9(2), fig. 1a-1d; the rigid rod
is the case without a length coordinate.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, TypeAlias

from eomgen.scene import Link

# A float or a symbolic node: + - * / with each other and with ints. Zeros and ones that come from a model's
# structure are ints, so that a symbolic caller can tell them from numbers and fold them.
Scalar: TypeAlias = Any
Values: TypeAlias = Mapping[str, Scalar]


class Body(NamedTuple):
    """A body at r = alpha + beta s; `inertia` is its central moment of inertia."""

    mass: Scalar
    alpha: Scalar
    beta: Scalar
    inertia: Scalar


class Affine(NamedTuple):
    """The bodies of a link and (alpha, beta) of its far end."""

    bodies: tuple[Body, ...]
    joint: tuple[Scalar, Scalar]


def affine(link: Link, values: Values) -> Affine:
    """The constants of `link`, hanging and fixed lengths included.

    Args:
        link: The link; its numbers are not read.
        values: A float or a symbolic node for each of `link.parameters`, by its short name.

    Returns:
        Constants with the units of the values; every beta of a fixed link is the int 0.
    """
    result = MODELS[link.model](values)
    if link.hangs:
        result = _hanging(result)
    if link.mode == "fixed":
        result = _fixed(result, values["length"])
    return result


def rigid(values: Values) -> Affine:
    """A rigid rod of fixed length."""
    mass, length = values["mass"], values["length"]
    center = values["center"] if "center" in values else length / 2
    return Affine((Body(mass, center, 0, _central(values, "inertia", mass, length)),), (length, 0))


def elastic_rod(values: Values) -> Affine:
    """Fig. 1a: a massless stretch of length s, then a rigid rod; its inertia is about its near end."""
    mass, length = values["mass"], values["rod_length"]
    inertia = _from_end(values, "inertia", mass, length)
    return Affine((Body(mass, length / 2, 1, inertia),), (length, 1))


def telescopic(values: Values) -> Affine:
    """Fig. 1b: a rod fixed at A, and a housing that begins at s and slides along it."""
    rod_mass, rod_length = values["rod_mass"], values["rod_length"]
    mass, length = values["housing_mass"], values["housing_length"]
    rod = Body(rod_mass, rod_length / 2, 0, _central(values, "rod_inertia", rod_mass, rod_length))
    housing = Body(mass, length / 2, 1, _from_end(values, "housing_inertia", mass, length))
    return Affine((rod, housing), (length, 1))


def joint_masses(values: Values) -> Affine:
    """Fig. 1c: masses at A, at a fraction of the length s and at B."""
    places = (0, values["fraction"], 1)
    return Affine(tuple(Body(values[f"mass{k}"], 0, beta, 0) for k, beta in enumerate(places, 1)), (0, 1))


def point_masses(values: Values) -> Affine:
    """Fig. 1d: any number of masses at fractions of the length s."""
    count = sum(name.startswith("mass") for name in values)
    bodies = (Body(values[f"mass{k}"], 0, values[f"fraction{k}"], 0) for k in range(1, count + 1))
    return Affine(tuple(bodies), (0, 1))


MODELS: dict[str, Callable[[Values], Affine]] = {
    "rigid": rigid,
    "elastic-rod": elastic_rod,
    "telescopic": telescopic,
    "joint-masses": joint_masses,
    "point-masses": point_masses,
}


def _central(values: Values, key: str, mass: Scalar, length: Scalar) -> Scalar:
    """The central inertia given, or that of a uniform rod."""
    return values[key] if key in values else mass * length * length / 12


def _from_end(values: Values, key: str, mass: Scalar, length: Scalar) -> Scalar:
    """The central inertia that belongs to the one given about the rod's end, or that of a uniform rod."""
    if key not in values:
        return mass * length * length / 12  # m l^2/3 about the end, less m l^2/4
    return values[key] - mass * length * length / 4


def _hanging(link: Affine) -> Affine:
    """The link attached by its far end: r -> r - L, L -> -L."""
    far, rate = link.joint
    bodies = (Body(m, _less(alpha, far), _less(beta, rate), j) for m, alpha, beta, j in link.bodies)
    return Affine(tuple(bodies), (_less(0, far), _less(0, rate)))


def _fixed(link: Affine, length: Scalar) -> Affine:
    """The link with s = length: nothing of s remains."""
    bodies = (Body(m, _at(alpha, beta, length), 0, j) for m, alpha, beta, j in link.bodies)
    return Affine(tuple(bodies), (_at(*link.joint, length), 0))


def _less(a: Scalar, b: Scalar) -> Scalar:
    """a - b; what the structure makes zero stays as it is."""
    return a if _is(b, 0) else a - b


def _at(alpha: Scalar, beta: Scalar, s: Scalar) -> Scalar:
    """alpha + beta s; what the structure makes zero or one leaves no operation."""
    if _is(beta, 0):
        return alpha
    term = s if _is(beta, 1) else beta * s
    return term if _is(alpha, 0) else alpha + term


def _is(value: Scalar, constant: int) -> bool:
    return type(value) is int and value == constant
