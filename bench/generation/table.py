"""The paper's matrices in any algebra: what the matrix contenders fill their matrices with.

Source: A. V. Borisov, G. M. Rozenblat, Computer Research and Modeling, 2017, 9(2), 201-210, equations (5) to
(8) in the general form of an affine link. Only what the mechanism needs is written: rigid links have A, B, C.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from bench.generation.mechanism import Mechanism, Scalar

Rows = list[list[Scalar]]


class Sums(NamedTuple):
    """What the table needs of each link, in link order: the paper's symbol and the meaning.

    Attributes:
        length: L, the distance to the far end.
        slope: L', its derivative by the length coordinate.
        arm: P, the mass times distance of the link and all it carries.
        arm_slope: P', its derivative by the length coordinate.
        turning: The diagonal of A.
        mixed: The diagonal of D.
        sliding: The diagonal of G.
    """

    length: list[Scalar]
    slope: list[Scalar]
    arm: list[Scalar]
    arm_slope: list[Scalar]
    turning: list[Scalar]
    mixed: list[Scalar]
    sliding: list[Scalar]


def sums(mechanism: Mechanism, q: Sequence[Scalar], p: Mapping[str, Scalar]) -> Sums:
    """The sums of every link.

    Args:
        mechanism: The mechanism.
        q: Its coordinates, all angles and then all free lengths.
        p: Its parameters by name.
    """
    result = Sums([], [], [], [], [], [], [])
    below: Scalar = 0  # the mass of all links beyond
    for i in reversed(range(mechanism.links)):
        link, s = mechanism.link(i, p), q[mechanism.links + i] if mechanism.free else 0
        bodies = [(body, body.alpha + body.beta * s) for body in link.bodies]
        length, slope = link.alpha + link.beta * s, link.beta
        result.length.append(length)
        result.slope.append(slope)
        result.arm.append(sum(b.mass * r for b, r in bodies) + length * below)
        result.arm_slope.append(sum(b.mass * b.beta for b, _ in bodies) + slope * below)
        result.turning.append(sum(b.mass * r**2 + b.inertia for b, r in bodies) + length**2 * below)
        result.mixed.append(sum(b.mass * b.beta * r for b, r in bodies) + length * slope * below)
        result.sliding.append(sum(b.mass * b.beta**2 for b, _ in bodies) + slope**2 * below)
        below = below + sum(body.mass for body in link.bodies)
    for values in result:
        values.reverse()
    return result


def elements(
    mechanism: Mechanism,
    q: Sequence[Scalar],
    p: Mapping[str, Scalar],
    cos: Callable[[Scalar], Scalar],
    sin: Callable[[Scalar], Scalar],
) -> dict[str, Rows]:
    """The rows of the matrices by the paper's letters; the columns C and K have one entry a row.

    Args:
        mechanism: The mechanism, of n links.
        q: Its coordinates, all angles and then all free lengths.
        p: Its parameters by name.
        cos: The cosine of the algebra.
        sin: The sine of the algebra.
    """
    n = mechanism.links
    length, slope, arm, arm_slope, turning, mixed, sliding = sums(mechanism, q, p)
    letters = "ABEDGHL" if mechanism.free else "AB"
    table: dict[str, Rows] = {letter: [[0] * n for _ in range(n)] for letter in letters}
    table["C"] = [[arm[i] * cos(q[i])] for i in range(n)]
    pairs = [(i, j, cos(q[i] - q[j]), sin(q[i] - q[j])) for j in range(n) for i in range(j)]
    for i in range(n):
        table["A"][i][i] = turning[i]
    for i, j, c, d in pairs:  # i is an ancestor of j
        table["A"][i][j] = table["A"][j][i] = length[i] * arm[j] * c
        table["B"][i][j] = length[i] * arm[j] * d
        table["B"][j][i] = -table["B"][i][j]
    if not mechanism.free:
        return table
    table["K"] = [[arm_slope[i] * sin(q[i])] for i in range(n)]
    for i in range(n):
        table["D"][i][i] = mixed[i]
        table["H"][i][i] = -mixed[i]
        table["G"][i][i] = sliding[i]
    for i, j, c, d in pairs:
        table["D"][i][j] = length[i] * arm_slope[j] * c
        table["D"][j][i] = slope[i] * arm[j] * c
        table["E"][i][j] = -length[i] * arm_slope[j] * d
        table["E"][j][i] = slope[i] * arm[j] * d
        table["G"][i][j] = table["G"][j][i] = slope[i] * arm_slope[j] * c
        table["H"][i][j] = -table["D"][j][i]
        table["H"][j][i] = -table["D"][i][j]
        table["L"][i][j] = slope[i] * arm_slope[j] * d
        table["L"][j][i] = -table["L"][i][j]
    return table
