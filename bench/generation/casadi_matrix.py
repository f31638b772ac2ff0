"""The matrix method in CasADi: the table as whole matrices, by outer products of its columns, in SX.

Writing the elements one by one from Python takes CasADi longer than this, from 3 links on, and longer than
Lagrange's equations from 4 links on.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from bench.generation.mechanism import Mechanism, Vector
from bench.generation.table import sums

VERSION = f"CasADi {ca.CasadiMeta.version()}"

Derived = tuple[ca.SX, ...]


def _above(matrix: ca.SX) -> ca.SX:
    """The part above the diagonal: rows of ancestors."""
    return ca.triu(matrix, False)


def derive(mechanism: Mechanism) -> Derived:
    """The symbols q, v and p and the symbolic mass matrix and bias of a mechanism."""
    n, size = mechanism.links, len(mechanism.coordinates)
    q, v = ca.SX.sym("q", size), ca.SX.sym("v", size)
    p = ca.SX.sym("p", len(mechanism.parameters))
    named = dict(zip(mechanism.parameters, ca.vertsplit(p), strict=True))
    columns = [ca.SX(ca.vertcat(*values)) for values in sums(mechanism, ca.vertsplit(q), named)]
    length, slope, arm, arm_slope, turning, mixed, sliding = columns
    phi, omega, g = q[:n], v[:n], named["g"]
    differences = ca.repmat(phi, 1, n) - ca.repmat(phi.T, n, 1)
    c, d = ca.cos(_above(differences)), ca.sin(_above(differences))
    # A φ̈ + E s̈ + B φ̇² + 2 D (φ̇ ṡ) + g C
    a, b = _above(length @ arm.T * c), _above(length @ arm.T * d)
    mass_matrix = a + a.T + ca.diag(turning)
    bias = (b - b.T) @ omega**2 + g * arm * ca.cos(phi)
    if not mechanism.free:
        return q, v, p, mass_matrix, bias
    # Eᵀ φ̈ + G s̈ + H φ̇² + 2 Λ (φ̇ ṡ) + g K
    e = _above(slope @ arm.T * d).T - _above(length @ arm_slope.T * d)
    f = _above(slope @ arm.T * c).T + _above(length @ arm_slope.T * c) + ca.diag(mixed)
    upper, turn = _above(slope @ arm_slope.T * c), _above(slope @ arm_slope.T * d)
    products = 2 * omega * v[n:]
    bias += f @ products
    # H = -Dᵀ
    lengths = -f.T @ omega**2 + (turn - turn.T) @ products + g * arm_slope * ca.sin(phi)
    mass_matrix = ca.blockcat([[mass_matrix, e], [e.T, upper + upper.T + ca.diag(sliding)]])
    return q, v, p, mass_matrix, ca.vertcat(bias, lengths)


def evaluate(derived: Derived, mechanism: Mechanism, q: Vector, v: Vector) -> tuple[Vector, Vector]:
    """See `bench.generation.one.Contender`."""
    function = ca.Function("equations", derived[:3], derived[3:])
    mass_matrix, bias = function(q, v, list(mechanism.parameters.values()))
    return np.asarray(mass_matrix.full()), np.asarray(bias.full())[:, 0]
