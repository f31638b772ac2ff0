"""chain4: equations of motion by the articulated method (eomgen VERSION)

The functions take an array namespace xp (numpy, jax.numpy, ...), a type for the numbers that no float64 holds
exactly, and sequences of arrays over states (q[0], q[1], ...), and return a list of such arrays. The `Function`
objects give them the shapes and the broadcasting of generalised ufuncs.
"""

from ._gufunc import Function, pivot_inverse



def _forward_dynamics_constants(xp, number, p):
    c = [0.0] * 7
    inertia_p_up = [0.0] * 4
    kept0 = [0.0] * 2
    kept1 = [0.0] * 2
    # constants of link4, tips to root
    t0 = p[18] * p[21]
    t1 = p[19] * p[22]
    t2 = p[20] * p[23]
    t3 = p[21] * t0 + p[22] * t1 + p[23] * t2
    t4 = t3 * t3
    t5 = pivot_inverse(xp, t4, t4)
    t6 = t3 * t5
    t7 = p[22] - p[21]
    t8 = p[23] - p[21]
    t9 = p[23] - p[22]
    t10 = t6 * (2.0 * (p[18] * p[19] * (t7 * t7) + p[18] * p[20] * (t8 * t8) + p[19] * p[20] * (t9 * t9)))
    inertia_p_up[2] = t10
    c[0] = (t0 + t1 + t2) * t6
    # constants of link2 to link3, tips to root
    for k in range(2):
        t0 = p[12 - 6 * k] * p[15 - 6 * k]
        t1 = p[13 - 6 * k] * p[16 - 6 * k]
        t2 = p[14 - 6 * k] * p[17 - 6 * k]
        t3 = 0.5 * inertia_p_up[2 - k]
        t4 = p[15 - 6 * k] * t0 + p[16 - 6 * k] * t1 + p[17 - 6 * k] * t2 + t3
        t5 = t4 * t4
        t6 = pivot_inverse(xp, t5, t5)
        t7 = t4 * t6
        kept0[1 - k] = t7
        t8 = p[16 - 6 * k] - p[15 - 6 * k]
        t9 = p[17 - 6 * k] - p[15 - 6 * k]
        t10 = p[17 - 6 * k] - p[16 - 6 * k]
        t11 = p[15 - 6 * k] - 1.0
        t12 = p[16 - 6 * k] - 1.0
        t13 = p[17 - 6 * k] - 1.0
        t14 = 2.0 * (p[12 - 6 * k] * p[13 - 6 * k] * (t8 * t8) + p[12 - 6 * k] * p[14 - 6 * k] * (t9 * t9) + p[13 - 6 * k] * p[14 - 6 * k] * (t10 * t10)) + inertia_p_up[2 - k] * (p[12 - 6 * k] * (t11 * t11) + p[13 - 6 * k] * (t12 * t12) + p[14 - 6 * k] * (t13 * t13))
        t15 = t7 * (t0 + t1 + t2 + t3)
        kept1[1 - k] = t15
        c[1 + k] = t15
        inertia_p_up[1 - k] = t7 * t14
    # constants of link1, root to tips
    t0 = p[0] * p[3]
    t1 = p[1] * p[4]
    t2 = p[2] * p[5]
    t3 = 0.5 * inertia_p_up[0]
    t4 = p[3] * t0 + p[4] * t1 + p[5] * t2 + t3
    t5 = t4 * t4
    t6 = pivot_inverse(xp, t5, t5)
    t7 = t4 * t6
    c[3] = t7
    c[4] = t7 * (t0 + t1 + t2 + t3)
    # constants of link4, root to tips
    t0 = p[18] * p[21]
    t1 = p[19] * p[22]
    t2 = p[20] * p[23]
    t3 = p[21] * t0 + p[22] * t1 + p[23] * t2
    t4 = t3 * t3
    t5 = pivot_inverse(xp, t4, t4)
    t6 = t3 * t5
    c[5] = t6
    c[6] = (t0 + t1 + t2) * t6
    return (c, inertia_p_up, kept0, kept1,)


def _forward_dynamics(xp, number, q, v, u, p, c):
    c, inertia_p_up, kept0, kept1, = c
    force_u_up = [0.0] * 1
    force_n_up = [0.0] * 1
    torque_up = [0.0] * 1
    acceleration_u_down1 = [0.0] * 1
    acceleration_n_down1 = [0.0] * 1
    kept2 = [0.0] * 2
    kept3 = [0.0] * 2
    kept4 = [0.0] * 2
    kept5 = [0.0] * 2
    kept6 = [0.0] * 2
    kept7 = [0.0] * 1
    kept8 = [0.0] * 1
    kept9 = [0.0] * 1
    kept10 = [0.0] * 1
    out = [0.0] * 8
    # link4, tips to root
    t0 = u[7] * c[0]
    t1 = q[3] - q[2]
    s2 = xp.sin(t1)
    c2 = xp.cos(t1)
    kept9[0] = c2
    t3 = q[7] * q[7]
    t4 = pivot_inverse(xp, t3, t3)
    t5 = q[7] * t4
    kept7[0] = t5
    t6 = u[3] * t5
    kept8[0] = t6
    t7 = c[0] * t6
    kept10[0] = s2
    force_u_up[0] = t0 * c2 - t7 * s2
    force_n_up[0] = t0 * s2 + t7 * c2
    torque_up[0] = u[3]
    # link2 to link3, tips to root
    for k in range(2):
        force_n_up_in = force_n_up[0]
        force_u_up_in = force_u_up[0]
        torque_up_in = torque_up[0]
        t0 = q[2 - k] - q[1 - k]
        s1 = xp.sin(t0)
        c1 = xp.cos(t0)
        kept5[1 - k] = c1
        t2 = u[6 - k] - force_u_up_in
        kept3[1 - k] = t2
        t3 = force_u_up_in + c[1 + k] * t2
        kept6[1 - k] = s1
        t4 = q[6 - k] * q[6 - k]
        t5 = pivot_inverse(xp, t4, t4)
        t6 = q[6 - k] * t5
        kept2[1 - k] = t6
        t7 = t6 * (u[2 - k] - torque_up_in) - force_n_up_in
        kept4[1 - k] = t7
        t8 = force_n_up_in + c[1 + k] * t7
        force_u_up[0] = c1 * t3 - s1 * t8
        force_n_up[0] = s1 * t3 + c1 * t8
        torque_up[0] = u[2 - k]
    # link1, root to tips
    force_n_up_in = force_n_up[0]
    force_u_up_in = force_u_up[0]
    torque_up_in = torque_up[0]
    s0 = xp.sin(q[0])
    c0 = xp.cos(q[0])
    t1 = p[24] * s0
    t2 = c[3] * (u[4] - force_u_up_in) - c[4] * t1
    acceleration_u_down1[0] = t1 + t2
    t3 = p[24] * c0
    t4 = q[4] * q[4]
    t5 = pivot_inverse(xp, t4, t4)
    t6 = q[4] * t5
    t7 = c[3] * (t6 * (u[0] - torque_up_in) - force_n_up_in) - c[4] * t3
    acceleration_n_down1[0] = t3 + t7
    out[0] = t6 * (t7 - 2.0 * (v[0] * v[4]))
    out[4] = t2 + q[4] * t6 * (q[4] * (v[0] * v[0]))
    # link2 to link3, root to tips
    for k in range(2):
        acceleration_n_down1_in = acceleration_n_down1[0]
        acceleration_u_down1_in = acceleration_u_down1[0]
        t0 = kept5[k] * acceleration_u_down1_in + kept6[k] * acceleration_n_down1_in
        t1 = kept0[k] * kept3[k] - kept1[k] * t0
        t2 = kept5[k] * acceleration_n_down1_in - kept6[k] * acceleration_u_down1_in
        t3 = kept0[k] * kept4[k] - kept1[k] * t2
        out[1 + k] = kept2[k] * (t3 - 2.0 * (v[1 + k] * v[5 + k]))
        out[5 + k] = t1 + q[5 + k] * kept2[k] * (q[5 + k] * (v[1 + k] * v[1 + k]))
        acceleration_u_down1[0] = t0 + t1
        acceleration_n_down1[0] = t2 + t3
    # link4, root to tips
    acceleration_n_down1_in = acceleration_n_down1[0]
    acceleration_u_down1_in = acceleration_u_down1[0]
    t0 = kept7[0] * (c[5] * kept8[0] - c[6] * (kept9[0] * acceleration_n_down1_in - kept10[0] * acceleration_u_down1_in) - 2.0 * (v[3] * v[7]))
    out[3] = t0
    out[7] = u[7] * c[5] - c[6] * (kept9[0] * acceleration_u_down1_in + kept10[0] * acceleration_n_down1_in) + q[7] * kept7[0] * (q[7] * (v[3] * v[3]))
    return out


forward_dynamics = Function(
    "forward_dynamics",
    "forward_dynamics(q, v, u, p)\n\naccelerations a of M a + h = Q(u).",
    ((8,), (8,), (8,), (25,)),
    (8,),
    "(8),(8),(8),(25)->(8)",
    _forward_dynamics_constants,
    True,
    _forward_dynamics,
    4096,
    ('float64',),
)
forward_dynamics.__module__ = __name__


def _mass_matrix_constants(xp, number, p):
    c = [0.0] * 14
    hung_mass_up = [0.0] * 4
    # constants of link4, tips to root
    hung_mass_up[2] = p[20] + p[18] + p[19]
    t0 = p[18] * p[21]
    t1 = p[19] * p[22]
    t2 = p[20] * p[23]
    c[0] = t0 + t1 + t2
    c[1] = p[21] * t0 + p[22] * t1 + p[23] * t2
    # constants of link2 to link3, tips to root
    for k in range(2):
        t0 = p[12 - 6 * k] * p[15 - 6 * k]
        t1 = p[13 - 6 * k] * p[16 - 6 * k]
        t2 = p[14 - 6 * k] * p[17 - 6 * k]
        t3 = t0 + t1 + t2
        c[2 + k] = t3
        t4 = p[15 - 6 * k] * t0 + p[16 - 6 * k] * t1 + p[17 - 6 * k] * t2
        c[4 + k] = t4
        c[6 + k] = hung_mass_up[2 - k] + t3
        c[8 + k] = hung_mass_up[2 - k] + t4
        hung_mass_up[1 - k] = hung_mass_up[2 - k] + p[14 - 6 * k] + p[12 - 6 * k] + p[13 - 6 * k]
    # constants of link1, tips to root
    t0 = p[0] * p[3]
    t1 = p[1] * p[4]
    t2 = p[2] * p[5]
    t3 = t0 + t1 + t2
    c[10] = t3
    t4 = p[3] * t0 + p[4] * t1 + p[5] * t2
    c[11] = t4
    c[12] = hung_mass_up[0] + t3
    c[13] = hung_mass_up[0] + t4
    return (c, hung_mass_up,)


def _mass_matrix(xp, number, q, p, c):
    c, hung_mass_up, = c
    end_x = [0.0] * 10
    end_y = [0.0] * 10
    force_x = [0.0] * 10
    force_y = [0.0] * 10
    out = [0.0] * 64
    # sums start at zero
    for k in range(64):
        out[k] = 0.0
    # link4, tips to root
    out[27] = q[7] * (q[7] * c[1])
    s0 = xp.sin(q[3])
    c0 = xp.cos(q[3])
    end_y[7] = s0
    end_x[3] = -(q[7] * s0)
    end_x[7] = c0
    end_y[3] = q[7] * c0
    t1 = q[7] * c[0]
    force_x[3] = -(t1 * s0)
    force_y[3] = t1 * c0
    force_x[7] = c[0] * c0
    force_y[7] = c[0] * s0
    out[63] = c[1]
    # link2 to link3, tips to root
    for k in range(2):
        t0 = q[6 - k] * hung_mass_up[2 - k]
        out[18 - 9 * k] = q[6 - k] * (q[6 - k] * c[4 + k]) + q[6 - k] * t0
        s1 = xp.sin(q[2 - k])
        c1 = xp.cos(q[2 - k])
        end_y[6 - k] = s1
        end_x[2 - k] = -(q[6 - k] * s1)
        end_x[6 - k] = c1
        end_y[2 - k] = q[6 - k] * c1
        t2 = q[6 - k] * c[2 + k] + t0
        force_x[2 - k] = -(s1 * t2)
        force_y[2 - k] = c1 * t2
        force_x[6 - k] = c1 * c[6 + k]
        force_y[6 - k] = s1 * c[6 + k]
        out[54 - 9 * k] = c[8 + k]
    # link1, tips to root
    t0 = q[4] * hung_mass_up[0]
    out[0] = q[4] * (q[4] * c[11]) + q[4] * t0
    s1 = xp.sin(q[0])
    c1 = xp.cos(q[0])
    end_y[4] = s1
    end_x[0] = -(q[4] * s1)
    end_x[4] = c1
    end_y[0] = q[4] * c1
    t2 = q[4] * c[10] + t0
    force_x[0] = -(s1 * t2)
    force_y[0] = c1 * t2
    force_x[4] = c1 * c[12]
    force_y[4] = s1 * c[12]
    out[36] = c[13]
    # pairs of links
    at0 = (-1, 0, 1, 2, -1, 0, 1, 2)
    at1 = (4, 5, 6, 7, -1, 0, 1, 2)
    for k in range(8):
        i = at0[k]
        while i >= 0:
            t0 = end_x[0 + i] * force_x[k] + end_y[0 + i] * force_y[k]
            out[k + 8 * i] = t0
            out[8 * k + i] = t0
            i = at1[i]
    return out


mass_matrix = Function(
    "mass_matrix",
    "mass_matrix(q, p)\n\nmass matrix M.",
    ((8,), (25,)),
    (8, 8),
    "(8),(25)->(8,8)",
    _mass_matrix_constants,
    True,
    _mass_matrix,
    4096,
    ('float64',),
)
mass_matrix.__module__ = __name__


def _energy_constants(xp, number, p):
    c = [0.0] * 11
    # constants of link1, root to tips
    t0 = p[0] * p[3]
    t1 = p[1] * p[4]
    t2 = p[2] * p[5]
    c[0] = t0 + t1 + t2
    c[1] = p[3] * t0 + p[4] * t1 + p[5] * t2
    # constants of link2 to link3, root to tips
    for k in range(2):
        t0 = p[6 + 6 * k] * p[9 + 6 * k]
        t1 = p[7 + 6 * k] * p[10 + 6 * k]
        t2 = p[8 + 6 * k] * p[11 + 6 * k]
        c[2 + k] = t0 + t1 + t2
        c[4 + k] = p[9 + 6 * k] * t0 + p[10 + 6 * k] * t1 + p[11 + 6 * k] * t2
        c[6 + k] = p[8 + 6 * k] + p[6 + 6 * k] + p[7 + 6 * k]
    # constants of link4, root to tips
    t0 = p[18] * p[21]
    t1 = p[19] * p[22]
    t2 = p[20] * p[23]
    c[8] = t0 + t1 + t2
    c[9] = p[21] * t0 + p[22] * t1 + p[23] * t2
    c[10] = p[20] + p[18] + p[19]
    return (c,)


def _energy(xp, number, q, v, p, c):
    c, = c
    sum = [0.0] * 8
    height_down = [0.0] * 1
    velocity_x_down = [0.0] * 1
    velocity_y_down = [0.0] * 1
    out = [0.0] * 2
    # sums start at zero
    for k in range(2):
        sum[k] = 0.0
    # link1, root to tips
    s0 = xp.sin(q[0])
    c0 = xp.cos(q[0])
    height_down[0] = q[4] * s0
    t1 = v[0] * q[4]
    velocity_x_down[0] = v[4] * c0 - s0 * t1
    velocity_y_down[0] = v[4] * s0 + c0 * t1
    t2 = 0.5 * (v[0] * (v[0] * (q[4] * (q[4] * c[1]))) + v[4] * (v[4] * c[1]))
    sum[0] = sum[0] + t2
    sum[1] = sum[1] + p[24] * (s0 * (q[4] * c[0]))
    # link2 to link3, root to tips
    for k in range(2):
        height_down_in = height_down[0]
        velocity_x_down_in = velocity_x_down[0]
        velocity_y_down_in = velocity_y_down[0]
        s0 = xp.sin(q[1 + k])
        c0 = xp.cos(q[1 + k])
        t1 = v[1 + k] * q[5 + k]
        t2 = c[6 + k] * (velocity_x_down_in * velocity_x_down_in + velocity_y_down_in * velocity_y_down_in) + v[1 + k] * (v[1 + k] * (q[5 + k] * (q[5 + k] * c[4 + k]))) + v[5 + k] * (v[5 + k] * c[4 + k])
        t3 = q[5 + k] * c[2 + k]
        height_down[0] = height_down_in + q[5 + k] * s0
        velocity_x_down[0] = velocity_x_down_in + v[5 + k] * c0 - s0 * t1
        velocity_y_down[0] = velocity_y_down_in + v[5 + k] * s0 + c0 * t1
        sum[0] = sum[0] + 0.5 * t2 + (velocity_y_down_in * c0 - velocity_x_down_in * s0) * (v[1 + k] * t3) + (velocity_x_down_in * c0 + velocity_y_down_in * s0) * (v[5 + k] * c[2 + k])
        sum[1] = sum[1] + p[24] * (height_down_in * c[6 + k] + s0 * t3)
    # link4, root to tips
    height_down_in = height_down[0]
    velocity_x_down_in = velocity_x_down[0]
    velocity_y_down_in = velocity_y_down[0]
    t0 = c[10] * (velocity_x_down_in * velocity_x_down_in + velocity_y_down_in * velocity_y_down_in) + v[3] * (v[3] * (q[7] * (q[7] * c[9]))) + v[7] * (v[7] * c[9])
    s1 = xp.sin(q[3])
    c1 = xp.cos(q[3])
    t2 = q[7] * c[8]
    sum[0] = sum[0] + 0.5 * t0 + (velocity_y_down_in * c1 - velocity_x_down_in * s1) * (v[3] * t2) + (velocity_x_down_in * c1 + velocity_y_down_in * s1) * (v[7] * c[8])
    sum[1] = sum[1] + p[24] * (height_down_in * c[10] + s1 * t2)
    # sums
    out[0] = sum[0]
    out[1] = sum[1]
    return out


energy = Function(
    "energy",
    "energy(q, v, p)\n\nkinetic and potential energy, J.",
    ((8,), (8,), (25,)),
    (2,),
    "(8),(8),(25)->(2)",
    _energy_constants,
    True,
    _energy,
    4096,
    ('float64',),
)
energy.__module__ = __name__
