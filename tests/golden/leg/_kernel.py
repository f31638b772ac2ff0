"""leg: equations of motion by the matrix method (eomgen VERSION)

The functions take an array namespace xp (numpy, jax.numpy, ...), a type for the numbers that no float64 holds
exactly, and sequences of arrays over states (q[0], q[1], ...), and return a list of such arrays. The `Function`
objects give them the shapes and the broadcasting of generalised ufuncs.
"""

from ._gufunc import Function, all_small, pivot_inverse, sincos_difference



def _forward_dynamics_constants(xp, number, p):
    c = [0.0] * 7
    # constants of accelerations a of M a + h = Q(u)
    t0 = p[7] * p[9]
    t1 = p[8] * p[10]
    t2 = t0 + t1
    t0 = p[9] * t0
    t1 = p[10] * t1
    t0 += t1
    t1 = p[7] + p[8]
    t3 = p[0] * p[3]
    t4 = p[1] * p[4]
    t5 = t3 + t4
    t6 = p[2] * p[5]
    t5 += t6
    t3 = p[3] * t3
    t4 = p[4] * t4
    t3 += t4
    t6 = p[5] * t6
    t3 += t6
    t6 = t1 + t5
    t4 = t1 + t3
    c[0] = t2
    c[1] = t0
    c[2] = t1
    c[3] = t5
    c[4] = t3
    c[5] = t6
    c[6] = t4
    return (c,)


def _forward_dynamics(xp, number, q, v, u, w, p, c):
    c, = c
    out = [0.0] * 3
    # accelerations a of M a + h = Q(u)
    t0 = q[2] * c[4]
    t1 = q[2] * t0
    t2 = q[2] * q[2]
    t2 = c[2] * t2
    t1 += t2
    t2 = xp.cos(q[0])
    t3 = xp.cos(q[1])
    t4 = t2 * t3
    t5 = xp.sin(q[0])
    t6 = xp.sin(q[1])
    t7 = t5 * t6
    t4 += t7
    t7 = w[0] * c[0]
    t8 = q[2] * t7
    t9 = t4 * t8
    t10 = w[0] * c[1]
    t11 = w[0] * t10
    t11 = pivot_inverse(xp, t11, t11)
    t12 = t9 * t11
    t13 = t9 * t12
    t13 = t1 - t13
    t14 = t3 * t5
    t6 = t2 * t6
    t14 -= t6
    t6 = t14 * t7
    t15 = t6 * t11
    t9 = t9 * t15
    t6 = t6 * t15
    t6 = c[6] - t6
    t6 = pivot_inverse(xp, t6, c[6])
    t16 = t9 * t6
    t9 = t9 * t16
    t13 -= t9
    t1 = pivot_inverse(xp, t13, t1)
    t13 = u[0] - u[1]
    t9 = v[1] * v[1]
    t8 = t14 * t8
    t17 = t9 * t8
    t18 = v[0] * v[2]
    t18 *= 2.0
    t19 = q[2] * c[2]
    t0 = t0 + t19
    t20 = t18 * t0
    t21 = v[1] * w[1]
    t21 *= 2.0
    t22 = q[2] * c[0]
    t23 = t4 * t22
    t23 = t21 * t23
    t23 += t20
    t17 += t23
    t22 = t14 * t22
    t22 = w[2] * t22
    t17 -= t22
    t22 = q[2] * c[3]
    t22 += t19
    t22 *= t2
    t22 *= p[11]
    t17 += t22
    t17 = t13 - t17
    t13 = t4 * t7
    t18 = t18 * t13
    t10 = t21 * t10
    t18 += t10
    t10 = v[0] * v[0]
    t8 = t10 * t8
    t18 -= t8
    t7 = t3 * t7
    t7 *= p[11]
    t18 += t7
    t18 = u[1] - t18
    t7 = t18 * t12
    t17 -= t7
    t7 = p[6] * v[2]
    t14 = t14 * c[0]
    t14 = t21 * t14
    t0 = t10 * t0
    t13 = t9 * t13
    t13 += t0
    t14 -= t13
    t4 = t4 * c[0]
    t4 = w[2] * t4
    t14 += t4
    t5 = t5 * c[5]
    t5 *= p[11]
    t14 += t5
    t14 += t7
    t14 = u[2] - t14
    t7 = t18 * t15
    t14 -= t7
    t7 = t16 * t14
    t17 += t7
    t17 *= t1
    t11 = t18 * t11
    t14 = t6 * t14
    t16 = t16 * t17
    t14 += t16
    t15 = t15 * t14
    t12 = t12 * t17
    t15 += t12
    t11 -= t15
    out[0] = t17
    out[1] = t11
    out[2] = t14
    return out


forward_dynamics = Function(
    "forward_dynamics",
    "forward_dynamics(q, v, u, w, p)\n\nAccelerations a of M a + h = Q(u).\n\nq (..., 3), v (..., 3), u (..., 3), w (..., 1, 3), p (..., 12) -> (..., 3); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((3,), (3,), (3,), (1, 3), (12,)),
    (3,),
    "(3),(3),(3),(1,3),(12)->(3)",
    _forward_dynamics_constants,
    True,
    _forward_dynamics,
    4096,
    ('float64',),
)
forward_dynamics.__module__ = __name__


def _inverse_dynamics_constants(xp, number, p):
    c = [0.0] * 7
    # constants of inputs u that give the accelerations a
    t0 = p[7] * p[9]
    t1 = p[8] * p[10]
    t2 = t0 + t1
    t0 = p[9] * t0
    t1 = p[10] * t1
    t0 += t1
    t1 = p[7] + p[8]
    t3 = p[0] * p[3]
    t4 = p[1] * p[4]
    t5 = t3 + t4
    t6 = p[2] * p[5]
    t5 += t6
    t3 = p[3] * t3
    t4 = p[4] * t4
    t3 += t4
    t6 = p[5] * t6
    t3 += t6
    t6 = t1 + t5
    t4 = t1 + t3
    c[0] = t2
    c[1] = t0
    c[2] = t1
    c[3] = t5
    c[4] = t3
    c[5] = t6
    c[6] = t4
    return (c,)


def _inverse_dynamics(xp, number, q, v, a, w, p, c):
    c, = c
    out = [0.0] * 3
    # inputs u that give the accelerations a
    t0 = v[1] * v[1]
    t1 = xp.cos(q[1])
    t2 = xp.sin(q[0])
    t3 = t1 * t2
    t4 = xp.cos(q[0])
    t5 = xp.sin(q[1])
    t6 = t4 * t5
    t3 -= t6
    t6 = w[0] * c[0]
    t7 = q[2] * t6
    t8 = t3 * t7
    t9 = t0 * t8
    t10 = v[0] * v[2]
    t10 *= 2.0
    t11 = q[2] * c[4]
    t12 = q[2] * c[2]
    t13 = t11 + t12
    t14 = t10 * t13
    t15 = v[1] * w[1]
    t15 *= 2.0
    t16 = t4 * t1
    t5 = t2 * t5
    t16 += t5
    t5 = q[2] * c[0]
    t17 = t16 * t5
    t17 = t15 * t17
    t17 += t14
    t9 += t17
    t5 = t3 * t5
    t5 = w[2] * t5
    t9 -= t5
    t5 = q[2] * c[3]
    t5 += t12
    t5 *= t4
    t5 *= p[11]
    t9 += t5
    t11 = q[2] * t11
    t5 = q[2] * q[2]
    t5 = c[2] * t5
    t11 += t5
    t11 = a[0] * t11
    t7 = t16 * t7
    t5 = a[1] * t7
    t5 += t11
    t5 = t9 + t5
    t9 = t16 * t6
    t10 = t10 * t9
    t11 = w[0] * c[1]
    t4 = t15 * t11
    t10 += t4
    t4 = v[0] * v[0]
    t8 = t4 * t8
    t10 -= t8
    t1 = t1 * t6
    t1 *= p[11]
    t10 += t1
    t7 = a[0] * t7
    t11 = w[0] * t11
    t11 = a[1] * t11
    t7 += t11
    t6 = t3 * t6
    t11 = a[2] * t6
    t7 += t11
    t7 = t10 + t7
    t5 += t7
    t10 = p[6] * v[2]
    t3 = t3 * c[0]
    t3 = t15 * t3
    t13 = t4 * t13
    t9 = t0 * t9
    t9 += t13
    t3 -= t9
    t16 = t16 * c[0]
    t16 = w[2] * t16
    t3 += t16
    t2 = t2 * c[5]
    t2 *= p[11]
    t3 += t2
    t3 += t10
    t6 = a[1] * t6
    t10 = a[2] * c[6]
    t6 += t10
    t6 = t3 + t6
    out[0] = t5
    out[1] = t7
    out[2] = t6
    return out


inverse_dynamics = Function(
    "inverse_dynamics",
    "inverse_dynamics(q, v, a, w, p)\n\nInputs u that give the accelerations a.\n\nq (..., 3), v (..., 3), a (..., 3), w (..., 1, 3), p (..., 12) -> (..., 3); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((3,), (3,), (3,), (1, 3), (12,)),
    (3,),
    "(3),(3),(3),(1,3),(12)->(3)",
    _inverse_dynamics_constants,
    True,
    _inverse_dynamics,
    4096,
    ('float64',),
)
inverse_dynamics.__module__ = __name__


def _mass_matrix_constants(xp, number, p):
    c = [0.0] * 5
    # constants of mass matrix M of M a + h = Q(u)
    t0 = p[7] * p[9]
    t1 = p[8] * p[10]
    t2 = t0 + t1
    t0 = p[9] * t0
    t1 = p[10] * t1
    t0 += t1
    t1 = p[7] + p[8]
    t3 = p[0] * p[3]
    t3 *= p[3]
    t4 = p[1] * p[4]
    t4 *= p[4]
    t3 += t4
    t4 = p[2] * p[5]
    t4 *= p[5]
    t3 += t4
    t4 = t1 + t3
    c[0] = t2
    c[1] = t0
    c[2] = t1
    c[3] = t3
    c[4] = t4
    return (c,)


def _mass_matrix(xp, number, q, w, p, c):
    c, = c
    out = [0.0] * 9
    # mass matrix M of M a + h = Q(u)
    t0 = q[2] * c[3]
    t0 *= q[2]
    t1 = q[2] * q[2]
    t1 = c[2] * t1
    t0 += t1
    t1 = xp.cos(q[0])
    t2 = xp.cos(q[1])
    t3 = t1 * t2
    t4 = xp.sin(q[0])
    t5 = xp.sin(q[1])
    t6 = t4 * t5
    t3 += t6
    t6 = w[0] * c[0]
    t7 = q[2] * t6
    t7 *= t3
    t3 = w[0] * c[1]
    t3 *= w[0]
    t4 = t2 * t4
    t5 = t1 * t5
    t4 -= t5
    t6 = t4 * t6
    out[0] = t0
    out[1] = t7
    out[2] = 0.0
    out[3] = t7
    out[4] = t3
    out[5] = t6
    out[6] = 0.0
    out[7] = t6
    out[8] = c[4]
    return out


mass_matrix = Function(
    "mass_matrix",
    "mass_matrix(q, w, p)\n\nMass matrix M of M a + h = Q(u).\n\nq (..., 3), w (..., 1, 3), p (..., 12) -> (..., 3, 3); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((3,), (1, 3), (12,)),
    (3, 3),
    "(3),(1,3),(12)->(3,3)",
    _mass_matrix_constants,
    True,
    _mass_matrix,
    4096,
    ('float64',),
)
mass_matrix.__module__ = __name__


def _bias_constants(xp, number, p):
    c = [0.0] * 6
    # constants of bias h: M a + h = Q(u)
    t0 = p[7] * p[9]
    t1 = p[8] * p[10]
    t2 = t0 + t1
    t0 = p[9] * t0
    t1 = p[10] * t1
    t0 += t1
    t1 = p[7] + p[8]
    t3 = p[0] * p[3]
    t4 = p[1] * p[4]
    t5 = t3 + t4
    t6 = p[2] * p[5]
    t5 += t6
    t3 = p[3] * t3
    t4 = p[4] * t4
    t3 += t4
    t6 = p[5] * t6
    t3 += t6
    t6 = t1 + t5
    c[0] = t2
    c[1] = t0
    c[2] = t1
    c[3] = t5
    c[4] = t3
    c[5] = t6
    return (c,)


def _bias(xp, number, q, v, w, p, c):
    c, = c
    out = [0.0] * 3
    # bias h: M a + h = Q(u)
    t0 = v[1] * v[1]
    t1 = xp.cos(q[1])
    t2 = xp.sin(q[0])
    t3 = t1 * t2
    t4 = xp.cos(q[0])
    t5 = xp.sin(q[1])
    t6 = t4 * t5
    t3 -= t6
    t6 = w[0] * c[0]
    t7 = q[2] * t6
    t7 *= t3
    t8 = t0 * t7
    t9 = v[0] * v[2]
    t9 *= 2.0
    t10 = q[2] * c[4]
    t11 = q[2] * c[2]
    t10 += t11
    t12 = t9 * t10
    t13 = v[1] * w[1]
    t13 *= 2.0
    t14 = t4 * t1
    t5 = t2 * t5
    t14 += t5
    t5 = q[2] * c[0]
    t15 = t14 * t5
    t15 = t13 * t15
    t15 += t12
    t8 += t15
    t5 = t3 * t5
    t5 = w[2] * t5
    t8 -= t5
    t5 = q[2] * c[3]
    t5 += t11
    t5 *= t4
    t5 *= p[11]
    t8 += t5
    t5 = t14 * t6
    t9 = t9 * t5
    t4 = w[0] * c[1]
    t4 = t13 * t4
    t9 += t4
    t4 = v[0] * v[0]
    t7 = t4 * t7
    t9 -= t7
    t6 = t1 * t6
    t6 *= p[11]
    t9 += t6
    t6 = p[6] * v[2]
    t3 = t3 * c[0]
    t3 = t13 * t3
    t10 = t4 * t10
    t5 = t0 * t5
    t5 += t10
    t3 -= t5
    t14 = t14 * c[0]
    t14 = w[2] * t14
    t3 += t14
    t2 = t2 * c[5]
    t2 *= p[11]
    t3 += t2
    t3 += t6
    out[0] = t8
    out[1] = t9
    out[2] = t3
    return out


bias = Function(
    "bias",
    "bias(q, v, w, p)\n\nBias h: M a + h = Q(u).\n\nq (..., 3), v (..., 3), w (..., 1, 3), p (..., 12) -> (..., 3); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((3,), (3,), (1, 3), (12,)),
    (3,),
    "(3),(3),(1,3),(12)->(3)",
    _bias_constants,
    True,
    _bias,
    4096,
    ('float64',),
)
bias.__module__ = __name__


def _energy_constants(xp, number, p):
    c = [0.0] * 6
    # constants of kinetic and potential energy, J
    t0 = p[7] * p[9]
    t1 = p[8] * p[10]
    t2 = t0 + t1
    t0 = p[9] * t0
    t1 = p[10] * t1
    t0 += t1
    t1 = p[7] + p[8]
    t3 = p[0] * p[3]
    t4 = p[1] * p[4]
    t5 = t3 + t4
    t6 = p[2] * p[5]
    t5 += t6
    t3 = p[3] * t3
    t4 = p[4] * t4
    t3 += t4
    t6 = p[5] * t6
    t3 += t6
    t6 = t1 + t3
    c[0] = t2
    c[1] = t0
    c[2] = t1
    c[3] = t5
    c[4] = t3
    c[5] = t6
    return (c,)


def _energy(xp, number, q, v, w, p, c):
    c, = c
    out = [0.0] * 2
    # kinetic and potential energy, J
    t0 = q[2] * c[4]
    t0 *= q[2]
    t1 = q[2] * q[2]
    t1 = c[2] * t1
    t0 += t1
    t0 = v[0] * t0
    t1 = xp.cos(q[0])
    t2 = xp.cos(q[1])
    t3 = t1 * t2
    t4 = xp.sin(q[0])
    t5 = xp.sin(q[1])
    t6 = t4 * t5
    t3 += t6
    t6 = w[0] * c[0]
    t7 = q[2] * t6
    t7 *= t3
    t8 = v[1] * t7
    t8 += t0
    t2 = t2 * t4
    t1 = t1 * t5
    t2 -= t1
    t1 = q[2] * c[0]
    t1 *= t2
    t1 = w[1] * t1
    t1 *= 2.0
    t8 -= t1
    t8 *= v[0]
    t1 = v[2] * c[5]
    t3 = t3 * c[0]
    t0 = w[1] * t3
    t0 = t1 + t0
    t0 *= v[2]
    t8 += t0
    t7 = v[0] * t7
    t0 = w[0] * c[1]
    t0 *= w[0]
    t0 = v[1] * t0
    t7 += t0
    t2 = t2 * t6
    t2 = v[2] * t2
    t2 *= 2.0
    t7 += t2
    t7 *= v[1]
    t8 += t7
    t3 = v[2] * t3
    t7 = w[1] * c[1]
    t7 = t3 + t7
    t7 *= w[1]
    t8 += t7
    t8 *= 0.5
    t7 = q[2] * c[3]
    t3 = q[2] * c[2]
    t7 += t3
    t7 *= t4
    t6 = t5 * t6
    t6 += t7
    t6 *= p[11]
    out[0] = t8
    out[1] = t6
    return out


energy = Function(
    "energy",
    "energy(q, v, w, p)\n\nKinetic and potential energy, J.\n\nq (..., 3), v (..., 3), w (..., 1, 3), p (..., 12) -> (..., 2); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((3,), (3,), (1, 3), (12,)),
    (2,),
    "(3),(3),(1,3),(12)->(2)",
    _energy_constants,
    True,
    _energy,
    4096,
    ('float64',),
)
energy.__module__ = __name__


def _prescribed_forces_constants(xp, number, p):
    c = [0.0] * 2
    # constants of forces along the prescribed lengths, N
    t0 = p[7] * p[9]
    t1 = p[8] * p[10]
    t2 = t0 + t1
    t0 = p[9] * t0
    t1 = p[10] * t1
    t0 += t1
    c[0] = t2
    c[1] = t0
    return (c,)


def _prescribed_forces(xp, number, q, v, a, w, p, c):
    c, = c
    out = [0.0] * 1
    # forces along the prescribed lengths, N
    t0 = xp.cos(q[0])
    t1 = xp.cos(q[1])
    t2 = t0 * t1
    t3 = xp.sin(q[0])
    t4 = xp.sin(q[1])
    t5 = t3 * t4
    t2 += t5
    t5 = t2 * c[0]
    t5 = a[2] * t5
    t3 = t1 * t3
    t0 = t0 * t4
    t3 -= t0
    t0 = q[2] * c[0]
    t1 = t3 * t0
    t1 = a[0] * t1
    t5 -= t1
    t1 = w[2] * c[1]
    t6 = v[0] * v[0]
    t0 = t2 * t0
    t0 = t6 * t0
    t6 = v[1] * v[1]
    t2 = w[0] * c[1]
    t2 = t6 * t2
    t2 = t0 + t2
    t0 = v[0] * v[2]
    t0 *= 2.0
    t3 = t3 * c[0]
    t3 = t0 * t3
    t2 += t3
    t2 = t1 - t2
    t2 = t5 + t2
    t4 = t4 * c[0]
    t4 *= p[11]
    t2 += t4
    out[0] = t2
    return out


prescribed_forces = Function(
    "prescribed_forces",
    "prescribed_forces(q, v, a, w, p)\n\nForces along the prescribed lengths, N.\n\nq (..., 3), v (..., 3), a (..., 3), w (..., 1, 3), p (..., 12) -> (..., 1); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((3,), (3,), (3,), (1, 3), (12,)),
    (1,),
    "(3),(3),(3),(1,3),(12)->(1)",
    _prescribed_forces_constants,
    True,
    _prescribed_forces,
    4096,
    ('float64',),
)
prescribed_forces.__module__ = __name__


def _joints(xp, number, q, w, p, c):
    out = [0.0] * 4
    # far-end position of every link, m
    t0 = xp.cos(q[0])
    t0 *= q[2]
    t1 = xp.sin(q[0])
    t1 *= q[2]
    t2 = xp.cos(q[1])
    t2 = w[0] * t2
    t2 += t0
    t3 = xp.sin(q[1])
    t3 = w[0] * t3
    t3 += t1
    out[0] = t0
    out[1] = t1
    out[2] = t2
    out[3] = t3
    return out


joints = Function(
    "joints",
    "joints(q, w, p)\n\nFar-end position of every link, m.\n\nq (..., 3), w (..., 1, 3), p (..., 12) -> (..., 2, 2); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ((3,), (1, 3), (12,)),
    (2, 2),
    "(3),(1,3),(12)->(2,2)",
    None,
    True,
    _joints,
    4096,
    ('float64',),
)
joints.__module__ = __name__
