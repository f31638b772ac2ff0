"""pendulum: equations of motion by the matrix method (eomgen VERSION)

The functions take an array namespace xp (numpy, jax.numpy, ...), a type for the numbers that no float64 holds
exactly, and sequences of arrays over states (q[0], q[1], ...), and return a list of such arrays. The `Function`
objects give them the shapes and the broadcasting of generalised ufuncs.
"""

from ._gufunc import Function, all_small, pivot_inverse, sincos_difference



def _forward_dynamics_constants(xp, number, p):
    c = [0.0] * 2
    # constants of accelerations a of M a + h = Q(u)
    t0 = 0.5 * p[1]
    t1 = p[0] * t0
    t2 = p[0] * p[1]
    t2 *= p[1]
    t2 = t2 / 12.0
    t0 = t0 * t1
    t0 += t2
    t0 = pivot_inverse(xp, t0, t0)
    c[0] = t1
    c[1] = t0
    return (c,)


def _forward_dynamics(xp, number, q, v, u, p, c):
    c, = c
    out = [0.0] * 1
    # accelerations a of M a + h = Q(u)
    t0 = q[0] - p[3]
    t0 *= p[2]
    t1 = xp.cos(q[0])
    t1 = c[0] * t1
    t1 *= p[4]
    t0 += t1
    t0 = u[0] - t0
    t0 *= c[1]
    out[0] = t0
    return out


forward_dynamics = Function(
    "forward_dynamics",
    "forward_dynamics(q, v, u, p)\n\nAccelerations a of M a + h = Q(u).\n\nq (..., 1), v (..., 1), u (..., 1), p (..., 5) -> (..., 1); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((1,), (1,), (1,), (5,)),
    (1,),
    "(1),(1),(1),(5)->(1)",
    _forward_dynamics_constants,
    True,
    _forward_dynamics,
    4096,
    ('float64',),
)
forward_dynamics.__module__ = __name__


def _inverse_dynamics_constants(xp, number, p):
    c = [0.0] * 2
    # constants of inputs u that give the accelerations a
    t0 = 0.5 * p[1]
    t1 = p[0] * t0
    t2 = p[0] * p[1]
    t2 *= p[1]
    t2 = t2 / 12.0
    t0 = t0 * t1
    t0 += t2
    c[0] = t1
    c[1] = t0
    return (c,)


def _inverse_dynamics(xp, number, q, v, a, p, c):
    c, = c
    out = [0.0] * 1
    # inputs u that give the accelerations a
    t0 = q[0] - p[3]
    t0 *= p[2]
    t1 = xp.cos(q[0])
    t1 = c[0] * t1
    t1 *= p[4]
    t0 += t1
    t1 = a[0] * c[1]
    t1 = t0 + t1
    out[0] = t1
    return out


inverse_dynamics = Function(
    "inverse_dynamics",
    "inverse_dynamics(q, v, a, p)\n\nInputs u that give the accelerations a.\n\nq (..., 1), v (..., 1), a (..., 1), p (..., 5) -> (..., 1); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((1,), (1,), (1,), (5,)),
    (1,),
    "(1),(1),(1),(5)->(1)",
    _inverse_dynamics_constants,
    True,
    _inverse_dynamics,
    4096,
    ('float64',),
)
inverse_dynamics.__module__ = __name__


def _mass_matrix_constants(xp, number, p):
    c = [0.0] * 1
    # constants of mass matrix M of M a + h = Q(u)
    t0 = p[0] * p[1]
    t0 *= p[1]
    t0 = t0 / 12.0
    t1 = 0.5 * p[1]
    t2 = p[0] * t1
    t2 *= t1
    t2 += t0
    c[0] = t2
    return (c,)


def _mass_matrix(xp, number, q, p, c):
    c, = c
    out = [0.0] * 1
    # mass matrix M of M a + h = Q(u)
    out[0] = c[0]
    return out


mass_matrix = Function(
    "mass_matrix",
    "mass_matrix(q, p)\n\nMass matrix M of M a + h = Q(u).\n\nq (..., 1), p (..., 5) -> (..., 1, 1); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((1,), (5,)),
    (1, 1),
    "(1),(5)->(1,1)",
    _mass_matrix_constants,
    True,
    _mass_matrix,
    4096,
    ('float64',),
)
mass_matrix.__module__ = __name__


def _bias_constants(xp, number, p):
    c = [0.0] * 1
    # constants of bias h: M a + h = Q(u)
    t0 = 0.5 * p[1]
    t0 *= p[0]
    c[0] = t0
    return (c,)


def _bias(xp, number, q, v, p, c):
    c, = c
    out = [0.0] * 1
    # bias h: M a + h = Q(u)
    t0 = q[0] - p[3]
    t0 *= p[2]
    t1 = xp.cos(q[0])
    t1 = c[0] * t1
    t1 *= p[4]
    t0 += t1
    out[0] = t0
    return out


bias = Function(
    "bias",
    "bias(q, v, p)\n\nBias h: M a + h = Q(u).\n\nq (..., 1), v (..., 1), p (..., 5) -> (..., 1); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((1,), (1,), (5,)),
    (1,),
    "(1),(1),(5)->(1)",
    _bias_constants,
    True,
    _bias,
    4096,
    ('float64',),
)
bias.__module__ = __name__


def _energy_constants(xp, number, p):
    c = [0.0] * 3
    # constants of kinetic and potential energy, J
    t0 = 0.5 * p[1]
    t1 = p[0] * t0
    t2 = p[0] * p[1]
    t2 *= p[1]
    t2 = t2 / 12.0
    t0 = t0 * t1
    t0 += t2
    t2 = 0.5 * p[2]
    c[0] = t1
    c[1] = t0
    c[2] = t2
    return (c,)


def _energy(xp, number, q, v, p, c):
    c, = c
    out = [0.0] * 2
    # kinetic and potential energy, J
    t0 = v[0] * c[1]
    t0 *= v[0]
    t0 *= 0.5
    t1 = xp.sin(q[0])
    t1 = c[0] * t1
    t1 *= p[4]
    t2 = q[0] - p[3]
    t2 = t2 * t2
    t2 *= c[2]
    t1 += t2
    out[0] = t0
    out[1] = t1
    return out


energy = Function(
    "energy",
    "energy(q, v, p)\n\nKinetic and potential energy, J.\n\nq (..., 1), v (..., 1), p (..., 5) -> (..., 2); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((1,), (1,), (5,)),
    (2,),
    "(1),(1),(5)->(2)",
    _energy_constants,
    True,
    _energy,
    4096,
    ('float64',),
)
energy.__module__ = __name__


def _joints(xp, number, q, p, c):
    out = [0.0] * 2
    # far-end position of every link, m
    t0 = xp.cos(q[0])
    t0 = p[1] * t0
    t1 = xp.sin(q[0])
    t1 = p[1] * t1
    out[0] = t0
    out[1] = t1
    return out


joints = Function(
    "joints",
    "joints(q, p)\n\nFar-end position of every link, m.\n\nq (..., 1), p (..., 5) -> (..., 1, 2); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((1,), (5,)),
    (1, 2),
    "(1),(5)->(1,2)",
    None,
    True,
    _joints,
    4096,
    ('float64',),
)
joints.__module__ = __name__
