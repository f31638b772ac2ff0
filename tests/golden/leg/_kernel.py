"""leg: equations of motion by the matrix method (eomgen VERSION)

The functions take an array namespace xp (numpy, jax.numpy, ...), a type for the numbers that no float64 holds
exactly, and sequences of arrays over states (q[0], q[1], ...), and return a list of such arrays. The `Function`
objects give them the shapes and the broadcasting of generalised ufuncs.
"""

from ._gufunc import Function, pivot_inverse



def _forward_dynamics_constants(xp, number, p):
    c = [0.0] * 7
    # constants of accelerations a of M a + h = Q(u)
    t0 = p[7] * p[9]
    t1 = p[8] * p[10]
    c[0] = t0 + t1
    c[1] = p[9] * t0 + p[10] * t1
    t2 = p[7] + p[8]
    c[2] = t2
    t3 = p[0] * p[3]
    t4 = p[1] * p[4]
    t5 = p[2] * p[5]
    t6 = t3 + t4 + t5
    c[3] = t6
    t7 = p[3] * t3 + p[4] * t4 + p[5] * t5
    c[4] = t7
    c[5] = t2 + t6
    c[6] = t2 + t7
    return (c,)


def _forward_dynamics(xp, number, q, v, u, w, p, c):
    c, = c
    out = [0.0] * 3
    # accelerations a of M a + h = Q(u)
    t0 = q[2] * c[4]
    t1 = q[2] * t0 + c[2] * (q[2] * q[2])
    s2 = xp.sin(q[0])
    c2 = xp.cos(q[0])
    s3 = xp.sin(q[1])
    c3 = xp.cos(q[1])
    t4 = c2 * c3 + s2 * s3
    t5 = w[0] * c[0]
    t6 = q[2] * t5
    t7 = t4 * t6
    t8 = w[0] * c[1]
    t9 = w[0] * t8
    t10 = pivot_inverse(xp, t9, t9)
    t11 = t7 * t10
    t12 = c3 * s2 - c2 * s3
    t13 = t12 * t5
    t14 = t13 * t10
    t15 = t7 * t14
    t16 = pivot_inverse(xp, c[6] - t13 * t14, c[6])
    t17 = t15 * t16
    t18 = pivot_inverse(xp, t1 - t7 * t11 - t15 * t17, t1)
    t19 = v[1] * v[1]
    t20 = t12 * t6
    t21 = 2.0 * (v[0] * v[2])
    t22 = q[2] * c[2]
    t23 = t0 + t22
    t24 = 2.0 * (v[1] * w[1])
    t25 = q[2] * c[0]
    t26 = t19 * t20 + t21 * t23 + t24 * (t4 * t25) - w[2] * (t12 * t25) + p[11] * (c2 * (q[2] * c[3] + t22))
    t27 = t4 * t5
    t28 = v[0] * v[0]
    t29 = u[1] - (t21 * t27 + t24 * t8 - t28 * t20 + p[11] * (c3 * t5))
    t30 = p[6] * v[2] + t24 * (t12 * c[0]) - (t28 * t23 + t19 * t27) + w[2] * (t4 * c[0]) + p[11] * (s2 * c[5])
    t31 = u[2] - t30 - t29 * t14
    t32 = t18 * (u[0] - u[1] - t26 - t29 * t11 + t17 * t31)
    out[0] = t32
    t33 = t16 * t31 + t17 * t32
    out[2] = t33
    out[1] = t29 * t10 - (t14 * t33 + t11 * t32)
    return out


forward_dynamics = Function(
    "forward_dynamics",
    "forward_dynamics(q, v, u, w, p)\n\naccelerations a of M a + h = Q(u).",
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
    c[0] = t0 + t1
    c[1] = p[9] * t0 + p[10] * t1
    t2 = p[7] + p[8]
    c[2] = t2
    t3 = p[0] * p[3]
    t4 = p[1] * p[4]
    t5 = p[2] * p[5]
    t6 = t3 + t4 + t5
    c[3] = t6
    t7 = p[3] * t3 + p[4] * t4 + p[5] * t5
    c[4] = t7
    c[5] = t2 + t6
    c[6] = t2 + t7
    return (c,)


def _inverse_dynamics(xp, number, q, v, a, w, p, c):
    c, = c
    out = [0.0] * 3
    # inputs u that give the accelerations a
    t0 = v[1] * v[1]
    s1 = xp.sin(q[1])
    c1 = xp.cos(q[1])
    s2 = xp.sin(q[0])
    c2 = xp.cos(q[0])
    t3 = c1 * s2 - c2 * s1
    t4 = w[0] * c[0]
    t5 = q[2] * t4
    t6 = t3 * t5
    t7 = 2.0 * (v[0] * v[2])
    t8 = q[2] * c[4]
    t9 = q[2] * c[2]
    t10 = t8 + t9
    t11 = 2.0 * (v[1] * w[1])
    t12 = c2 * c1 + s2 * s1
    t13 = q[2] * c[0]
    t14 = t0 * t6 + t7 * t10 + t11 * (t12 * t13) - w[2] * (t3 * t13) + p[11] * (c2 * (q[2] * c[3] + t9))
    t15 = t12 * t5
    t16 = t14 + a[0] * (q[2] * t8 + c[2] * (q[2] * q[2])) + a[1] * t15
    t17 = t12 * t4
    t18 = w[0] * c[1]
    t19 = v[0] * v[0]
    t20 = t3 * t4
    t21 = t7 * t17 + t11 * t18 - t19 * t6 + p[11] * (c1 * t4) + a[0] * t15 + a[1] * (w[0] * t18) + a[2] * t20
    out[1] = t21
    out[0] = t16 + t21
    t22 = p[6] * v[2] + t11 * (t3 * c[0]) - (t19 * t10 + t0 * t17) + w[2] * (t12 * c[0]) + p[11] * (s2 * c[5])
    out[2] = t22 + a[1] * t20 + a[2] * c[6]
    return out


inverse_dynamics = Function(
    "inverse_dynamics",
    "inverse_dynamics(q, v, a, w, p)\n\ninputs u that give the accelerations a.",
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
    # constants of mass matrix M
    t0 = p[7] * p[9]
    t1 = p[8] * p[10]
    c[0] = t0 + t1
    c[1] = p[9] * t0 + p[10] * t1
    t2 = p[7] + p[8]
    c[2] = t2
    t3 = p[3] * (p[0] * p[3]) + p[4] * (p[1] * p[4]) + p[5] * (p[2] * p[5])
    c[3] = t3
    c[4] = t2 + t3
    return (c,)


def _mass_matrix(xp, number, q, w, p, c):
    c, = c
    out = [0.0] * 9
    # mass matrix M
    out[0] = q[2] * (q[2] * c[3]) + c[2] * (q[2] * q[2])
    s0 = xp.sin(q[0])
    c0 = xp.cos(q[0])
    s1 = xp.sin(q[1])
    c1 = xp.cos(q[1])
    t2 = w[0] * c[0]
    t3 = (c0 * c1 + s0 * s1) * (q[2] * t2)
    out[1] = t3
    out[3] = t3
    out[4] = w[0] * (w[0] * c[1])
    t4 = (c1 * s0 - c0 * s1) * t2
    out[5] = t4
    out[7] = t4
    out[2] = 0.0
    out[6] = 0.0
    out[8] = c[4]
    return out


mass_matrix = Function(
    "mass_matrix",
    "mass_matrix(q, w, p)\n\nmass matrix M.",
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
    c[0] = t0 + t1
    c[1] = p[9] * t0 + p[10] * t1
    t2 = p[7] + p[8]
    c[2] = t2
    t3 = p[0] * p[3]
    t4 = p[1] * p[4]
    t5 = p[2] * p[5]
    t6 = t3 + t4 + t5
    c[3] = t6
    c[4] = p[3] * t3 + p[4] * t4 + p[5] * t5
    c[5] = t2 + t6
    return (c,)


def _bias(xp, number, q, v, w, p, c):
    c, = c
    out = [0.0] * 3
    # bias h: M a + h = Q(u)
    t0 = v[1] * v[1]
    s1 = xp.sin(q[1])
    c1 = xp.cos(q[1])
    s2 = xp.sin(q[0])
    c2 = xp.cos(q[0])
    t3 = c1 * s2 - c2 * s1
    t4 = w[0] * c[0]
    t5 = t3 * (q[2] * t4)
    t6 = 2.0 * (v[0] * v[2])
    t7 = q[2] * c[2]
    t8 = q[2] * c[4] + t7
    t9 = 2.0 * (v[1] * w[1])
    t10 = c2 * c1 + s2 * s1
    t11 = q[2] * c[0]
    t12 = t0 * t5 + t6 * t8 + t9 * (t10 * t11) - w[2] * (t3 * t11) + p[11] * (c2 * (q[2] * c[3] + t7))
    out[0] = t12
    t13 = t10 * t4
    t14 = v[0] * v[0]
    out[1] = t6 * t13 + t9 * (w[0] * c[1]) - t14 * t5 + p[11] * (c1 * t4)
    t15 = p[6] * v[2] + t9 * (t3 * c[0]) - (t14 * t8 + t0 * t13) + w[2] * (t10 * c[0]) + p[11] * (s2 * c[5])
    out[2] = t15
    return out


bias = Function(
    "bias",
    "bias(q, v, w, p)\n\nbias h: M a + h = Q(u).",
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
    c[0] = t0 + t1
    c[1] = p[9] * t0 + p[10] * t1
    t2 = p[7] + p[8]
    c[2] = t2
    t3 = p[0] * p[3]
    t4 = p[1] * p[4]
    t5 = p[2] * p[5]
    c[3] = t3 + t4 + t5
    t6 = p[3] * t3 + p[4] * t4 + p[5] * t5
    c[4] = t6
    c[5] = t2 + t6
    return (c,)


def _energy(xp, number, q, v, w, p, c):
    c, = c
    out = [0.0] * 2
    # kinetic and potential energy, J
    s0 = xp.sin(q[0])
    c0 = xp.cos(q[0])
    s1 = xp.sin(q[1])
    c1 = xp.cos(q[1])
    t2 = c0 * c1 + s0 * s1
    t3 = w[0] * c[0]
    t4 = t2 * (q[2] * t3)
    t5 = c1 * s0 - c0 * s1
    t6 = v[0] * (q[2] * (q[2] * c[4]) + c[2] * (q[2] * q[2])) + v[1] * t4 - 2.0 * (w[1] * (t5 * (q[2] * c[0])))
    t7 = t2 * c[0]
    t8 = v[1] * (v[0] * t4 + v[1] * (w[0] * (w[0] * c[1])) + 2.0 * (v[2] * (t5 * t3)))
    t9 = v[0] * t6 + v[2] * (v[2] * c[5] + w[1] * t7) + t8 + w[1] * (v[2] * t7 + w[1] * c[1])
    out[0] = 0.5 * t9
    out[1] = p[11] * (s0 * (q[2] * c[3] + q[2] * c[2]) + s1 * t3)
    return out


energy = Function(
    "energy",
    "energy(q, v, w, p)\n\nkinetic and potential energy, J.",
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
    c[0] = t0 + t1
    c[1] = p[9] * t0 + p[10] * t1
    return (c,)


def _prescribed_forces(xp, number, q, v, a, w, p, c):
    c, = c
    out = [0.0] * 1
    # forces along the prescribed lengths, N
    s0 = xp.sin(q[0])
    c0 = xp.cos(q[0])
    s1 = xp.sin(q[1])
    c1 = xp.cos(q[1])
    t2 = c0 * c1 + s0 * s1
    t3 = c1 * s0 - c0 * s1
    t4 = q[2] * c[0]
    t5 = a[2] * (t2 * c[0]) - a[0] * (t3 * t4) + w[2] * c[1] - (v[0] * v[0] * (t2 * t4) + v[1] * v[1] * (w[0] * c[1]) + 2.0 * (v[0] * v[2]) * (t3 * c[0]))
    out[0] = t5 + p[11] * (s1 * c[0])
    return out


prescribed_forces = Function(
    "prescribed_forces",
    "prescribed_forces(q, v, a, w, p)\n\nforces along the prescribed lengths, N.",
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
    s0 = xp.sin(q[0])
    c0 = xp.cos(q[0])
    t1 = q[2] * c0
    out[0] = t1
    t2 = q[2] * s0
    out[1] = t2
    s3 = xp.sin(q[1])
    c3 = xp.cos(q[1])
    out[2] = t1 + w[0] * c3
    out[3] = t2 + w[0] * s3
    return out


joints = Function(
    "joints",
    "joints(q, w, p)\n\nfar-end position of every link, m.",
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
