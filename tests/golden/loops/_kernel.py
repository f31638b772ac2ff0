"""chain4: equations of motion by the articulated method (eomgen VERSION)

The functions take an array namespace xp (numpy, jax.numpy, ...), a type for the numbers that no float64 holds
exactly, and sequences of arrays over states (q[0], q[1], ...), and return a list of such arrays. The `Function`
objects give them the shapes and the broadcasting of generalised ufuncs.
"""

from ._gufunc import Function, all_small, pivot_inverse, sincos_difference



def _forward_dynamics_constants(xp, number, p):
    c = [0.0] * 7
    inertia_p_up = [0.0] * 4
    kept0 = [0.0] * 2
    kept1 = [0.0] * 2
    # constants of link4, tips to root
    t0 = p[18] * p[21]
    t1 = p[21] * t0
    t2 = p[19] * p[22]
    t3 = p[22] * t2
    t1 += t3
    t3 = p[20] * p[23]
    t4 = p[23] * t3
    t1 += t4
    t4 = t1 * t1
    t4 = pivot_inverse(xp, t4, t4)
    t4 = t1 * t4
    t1 = p[18] * p[19]
    t5 = p[22] - p[21]
    t5 = t5 * t5
    t1 *= t5
    t5 = p[18] * p[20]
    t6 = p[23] - p[21]
    t6 = t6 * t6
    t5 *= t6
    t1 += t5
    t5 = p[19] * p[20]
    t6 = p[23] - p[22]
    t6 = t6 * t6
    t5 *= t6
    t1 += t5
    t1 *= 2.0
    t1 *= t4
    t2 = t0 + t2
    t2 += t3
    t2 *= t4
    inertia_p_up[2] = t1
    c[0] = t2
    # constants of link2 to link3, tips to root
    for k in range(2):
        t0 = p[12 - 6 * k] * p[15 - 6 * k]
        t1 = p[15 - 6 * k] * t0
        t2 = p[13 - 6 * k] * p[16 - 6 * k]
        t3 = p[16 - 6 * k] * t2
        t1 += t3
        t3 = p[14 - 6 * k] * p[17 - 6 * k]
        t4 = p[17 - 6 * k] * t3
        t1 += t4
        t4 = 0.5 * inertia_p_up[2 - k]
        t1 = t1 + t4
        t5 = t1 * t1
        t5 = pivot_inverse(xp, t5, t5)
        t5 = t1 * t5
        t1 = p[12 - 6 * k] * p[13 - 6 * k]
        t6 = p[16 - 6 * k] - p[15 - 6 * k]
        t6 = t6 * t6
        t1 *= t6
        t6 = p[12 - 6 * k] * p[14 - 6 * k]
        t7 = p[17 - 6 * k] - p[15 - 6 * k]
        t7 = t7 * t7
        t6 *= t7
        t1 += t6
        t6 = p[13 - 6 * k] * p[14 - 6 * k]
        t7 = p[17 - 6 * k] - p[16 - 6 * k]
        t7 = t7 * t7
        t6 *= t7
        t1 += t6
        t1 *= 2.0
        t6 = p[15 - 6 * k] - 1.0
        t6 = t6 * t6
        t6 *= p[12 - 6 * k]
        t7 = p[16 - 6 * k] - 1.0
        t7 = t7 * t7
        t7 *= p[13 - 6 * k]
        t6 += t7
        t7 = p[17 - 6 * k] - 1.0
        t7 = t7 * t7
        t7 *= p[14 - 6 * k]
        t6 += t7
        t6 = inertia_p_up[2 - k] * t6
        t6 = t1 + t6
        t6 = t5 * t6
        t2 = t0 + t2
        t2 += t3
        t4 = t2 + t4
        t4 = t5 * t4
        inertia_p_up[1 - k] = t6
        kept0[1 - k] = t5
        kept1[1 - k] = t4
        c[1 + k] = t4
    # constants of link1, root to tips
    t0 = p[0] * p[3]
    t1 = p[3] * t0
    t2 = p[1] * p[4]
    t3 = p[4] * t2
    t1 += t3
    t3 = p[2] * p[5]
    t4 = p[5] * t3
    t1 += t4
    t4 = 0.5 * inertia_p_up[0]
    t1 = t1 + t4
    t5 = t1 * t1
    t5 = pivot_inverse(xp, t5, t5)
    t5 = t1 * t5
    t2 = t0 + t2
    t2 += t3
    t4 = t2 + t4
    t4 = t5 * t4
    c[3] = t5
    c[4] = t4
    # constants of link4, root to tips
    t0 = p[18] * p[21]
    t1 = p[21] * t0
    t2 = p[19] * p[22]
    t3 = p[22] * t2
    t1 += t3
    t3 = p[20] * p[23]
    t4 = p[23] * t3
    t1 += t4
    t4 = t1 * t1
    t4 = pivot_inverse(xp, t4, t4)
    t4 = t1 * t4
    t2 = t0 + t2
    t2 += t3
    t2 *= t4
    c[5] = t4
    c[6] = t2
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
    small = all_small(xp, q)
    # link4, tips to root
    t0 = u[7] * c[0]
    t1, t2 = sincos_difference(xp, q[3], q[2], small)
    t3 = t0 * t2
    t4 = q[7] * q[7]
    t4 = pivot_inverse(xp, t4, t4)
    t4 = q[7] * t4
    t5 = u[3] * t4
    t6 = c[0] * t5
    t7 = t6 * t1
    t3 -= t7
    t0 = t0 * t1
    t6 = t6 * t2
    t0 += t6
    force_u_up[0] = t3
    force_n_up[0] = t0
    torque_up[0] = u[3]
    kept7[0] = t4
    kept8[0] = t5
    kept9[0] = t2
    kept10[0] = t1
    # link2 to link3, tips to root
    for k in range(2):
        force_n_up_in = force_n_up[0]
        force_u_up_in = force_u_up[0]
        torque_up_in = torque_up[0]
        t0, t1 = sincos_difference(xp, q[2 - k], q[1 - k], small)
        t2 = u[6 - k] - force_u_up_in
        t3 = c[1 + k] * t2
        t3 = force_u_up_in + t3
        t4 = t1 * t3
        t5 = q[6 - k] * q[6 - k]
        t5 = pivot_inverse(xp, t5, t5)
        t5 = q[6 - k] * t5
        t6 = u[2 - k] - torque_up_in
        t6 = t5 * t6
        t6 = t6 - force_n_up_in
        t7 = c[1 + k] * t6
        t7 = force_n_up_in + t7
        t8 = t0 * t7
        t8 = t4 - t8
        t3 = t0 * t3
        t7 = t1 * t7
        t7 = t3 + t7
        force_u_up[0] = t8
        force_n_up[0] = t7
        torque_up[0] = u[2 - k]
        kept2[1 - k] = t5
        kept3[1 - k] = t2
        kept4[1 - k] = t6
        kept5[1 - k] = t1
        kept6[1 - k] = t0
    # link1, root to tips
    force_n_up_in = force_n_up[0]
    force_u_up_in = force_u_up[0]
    torque_up_in = torque_up[0]
    t0 = xp.sin(q[0])
    t0 = p[24] * t0
    t1 = u[4] - force_u_up_in
    t1 = c[3] * t1
    t2 = c[4] * t0
    t2 = t1 - t2
    t0 = t0 + t2
    t1 = xp.cos(q[0])
    t1 = p[24] * t1
    t3 = q[4] * q[4]
    t3 = pivot_inverse(xp, t3, t3)
    t3 = q[4] * t3
    t4 = u[0] - torque_up_in
    t4 = t3 * t4
    t4 = t4 - force_n_up_in
    t4 = c[3] * t4
    t5 = c[4] * t1
    t5 = t4 - t5
    t1 = t1 + t5
    t4 = v[0] * v[4]
    t4 *= 2.0
    t4 = t5 - t4
    t4 = t3 * t4
    t3 = q[4] * t3
    t5 = v[0] * v[0]
    t5 = q[4] * t5
    t5 *= t3
    t5 = t2 + t5
    acceleration_u_down1[0] = t0
    acceleration_n_down1[0] = t1
    out[0] = t4
    out[4] = t5
    # link2 to link3, root to tips
    for k in range(2):
        acceleration_n_down1_in = acceleration_n_down1[0]
        acceleration_u_down1_in = acceleration_u_down1[0]
        t0 = kept5[k] * acceleration_u_down1_in
        t1 = kept6[k] * acceleration_n_down1_in
        t1 = t0 + t1
        t0 = kept0[k] * kept3[k]
        t2 = kept1[k] * t1
        t2 = t0 - t2
        t1 = t1 + t2
        t0 = kept5[k] * acceleration_n_down1_in
        t3 = kept6[k] * acceleration_u_down1_in
        t3 = t0 - t3
        t0 = kept0[k] * kept4[k]
        t4 = kept1[k] * t3
        t4 = t0 - t4
        t3 = t3 + t4
        t0 = v[1 + k] * v[5 + k]
        t0 *= 2.0
        t0 = t4 - t0
        t0 = kept2[k] * t0
        t4 = q[5 + k] * kept2[k]
        t5 = v[1 + k] * v[1 + k]
        t5 = q[5 + k] * t5
        t5 = t4 * t5
        t5 = t2 + t5
        acceleration_u_down1[0] = t1
        acceleration_n_down1[0] = t3
        out[1 + k] = t0
        out[5 + k] = t5
    # link4, root to tips
    acceleration_n_down1_in = acceleration_n_down1[0]
    acceleration_u_down1_in = acceleration_u_down1[0]
    t0 = c[5] * kept8[0]
    t1 = kept9[0] * acceleration_n_down1_in
    t2 = kept10[0] * acceleration_u_down1_in
    t2 = t1 - t2
    t2 = c[6] * t2
    t2 = t0 - t2
    t0 = v[3] * v[7]
    t0 *= 2.0
    t0 = t2 - t0
    t0 = kept7[0] * t0
    t2 = u[7] * c[5]
    t1 = kept9[0] * acceleration_u_down1_in
    t3 = kept10[0] * acceleration_n_down1_in
    t3 = t1 + t3
    t3 = c[6] * t3
    t3 = t2 - t3
    t2 = q[7] * kept7[0]
    t1 = v[3] * v[3]
    t1 = q[7] * t1
    t1 = t2 * t1
    t1 = t3 + t1
    out[3] = t0
    out[7] = t1
    return out


forward_dynamics = Function(
    "forward_dynamics",
    "forward_dynamics(q, v, u, p)\n\nAccelerations a of M a + h = Q(u).\n\nq (..., 8), v (..., 8), u (..., 8), p (..., 25) -> (..., 8); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
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
    t0 = p[18] + p[19]
    t0 += p[20]
    t1 = p[18] * p[21]
    t2 = p[19] * p[22]
    t3 = t1 + t2
    t4 = p[20] * p[23]
    t3 += t4
    t1 = p[21] * t1
    t2 = p[22] * t2
    t1 += t2
    t4 = p[23] * t4
    t1 += t4
    hung_mass_up[2] = t0
    c[0] = t3
    c[1] = t1
    # constants of link2 to link3, tips to root
    for k in range(2):
        t0 = p[12 - 6 * k] + p[13 - 6 * k]
        t0 += p[14 - 6 * k]
        t0 = hung_mass_up[2 - k] + t0
        t1 = p[12 - 6 * k] * p[15 - 6 * k]
        t2 = p[13 - 6 * k] * p[16 - 6 * k]
        t3 = t1 + t2
        t4 = p[14 - 6 * k] * p[17 - 6 * k]
        t3 += t4
        t1 = p[15 - 6 * k] * t1
        t2 = p[16 - 6 * k] * t2
        t1 += t2
        t4 = p[17 - 6 * k] * t4
        t1 += t4
        t4 = hung_mass_up[2 - k] + t3
        t2 = hung_mass_up[2 - k] + t1
        hung_mass_up[1 - k] = t0
        c[2 + k] = t3
        c[4 + k] = t1
        c[6 + k] = t4
        c[8 + k] = t2
    # constants of link1, tips to root
    t0 = p[0] * p[3]
    t1 = p[1] * p[4]
    t2 = t0 + t1
    t3 = p[2] * p[5]
    t2 += t3
    t0 = p[3] * t0
    t1 = p[4] * t1
    t0 += t1
    t3 = p[5] * t3
    t0 += t3
    t3 = hung_mass_up[0] + t2
    t1 = hung_mass_up[0] + t0
    c[10] = t2
    c[11] = t0
    c[12] = t3
    c[13] = t1
    return (c, hung_mass_up,)


def _mass_matrix(xp, number, q, p, c):
    c, hung_mass_up, = c
    end_x = [0.0] * 8
    end_y = [0.0] * 8
    force_x = [0.0] * 8
    force_y = [0.0] * 8
    out = [0.0] * 64
    # sums start at zero
    for k in range(64):
        out[k] = 0.0
    # link4, tips to root
    t0 = q[7] * c[1]
    t0 *= q[7]
    t1 = xp.sin(q[3])
    t2 = q[7] * t1
    t2 = -t2
    t3 = xp.cos(q[3])
    t4 = q[7] * t3
    t5 = q[7] * c[0]
    t6 = t5 * t1
    t6 = -t6
    t5 = t5 * t3
    t7 = c[0] * t3
    t8 = c[0] * t1
    out[27] = t0
    end_x[3] = t2
    end_y[3] = t4
    force_x[3] = t6
    force_y[3] = t5
    out[63] = c[1]
    end_x[7] = t3
    end_y[7] = t1
    force_x[7] = t7
    force_y[7] = t8
    # link2 to link3, tips to root
    for k in range(2):
        t0 = q[6 - k] * c[4 + k]
        t0 *= q[6 - k]
        t1 = q[6 - k] * hung_mass_up[2 - k]
        t2 = q[6 - k] * t1
        t2 = t0 + t2
        t0 = xp.sin(q[2 - k])
        t3 = q[6 - k] * t0
        t3 = -t3
        t4 = xp.cos(q[2 - k])
        t5 = q[6 - k] * t4
        t6 = q[6 - k] * c[2 + k]
        t1 = t6 + t1
        t6 = t0 * t1
        t6 = -t6
        t1 = t4 * t1
        t7 = t4 * c[6 + k]
        t8 = t0 * c[6 + k]
        out[18 - 9 * k] = t2
        end_x[2 - k] = t3
        end_y[2 - k] = t5
        force_x[2 - k] = t6
        force_y[2 - k] = t1
        out[54 - 9 * k] = c[8 + k]
        end_x[6 - k] = t4
        end_y[6 - k] = t0
        force_x[6 - k] = t7
        force_y[6 - k] = t8
    # link1, tips to root
    t0 = q[4] * c[11]
    t0 *= q[4]
    t1 = q[4] * hung_mass_up[0]
    t2 = q[4] * t1
    t2 = t0 + t2
    t0 = xp.sin(q[0])
    t3 = q[4] * t0
    t3 = -t3
    t4 = xp.cos(q[0])
    t5 = q[4] * t4
    t6 = q[4] * c[10]
    t1 = t6 + t1
    t6 = t0 * t1
    t6 = -t6
    t1 = t4 * t1
    t7 = t4 * c[12]
    t8 = t0 * c[12]
    out[0] = t2
    end_x[0] = t3
    end_y[0] = t5
    force_x[0] = t6
    force_y[0] = t1
    out[36] = c[13]
    end_x[4] = t4
    end_y[4] = t0
    force_x[4] = t7
    force_y[4] = t8
    # pairs of links
    at0 = (-1, 0, 1, 2, -1, 0, 1, 2)
    at1 = (4, 5, 6, 7, -1, 0, 1, 2)
    for k in range(8):
        i = at0[k]
        while i >= 0:
            t0 = end_x[0 + i] * force_x[k]
            t1 = end_y[0 + i] * force_y[k]
            t1 = t0 + t1
            out[k + 8 * i] = t1
            out[8 * k + i] = t1
            i = at1[i]
    return out


mass_matrix = Function(
    "mass_matrix",
    "mass_matrix(q, p)\n\nMass matrix M of M a + h = Q(u).\n\nq (..., 8), p (..., 25) -> (..., 8, 8); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
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
    t2 = t0 + t1
    t3 = p[2] * p[5]
    t2 += t3
    t0 = p[3] * t0
    t1 = p[4] * t1
    t0 += t1
    t3 = p[5] * t3
    t0 += t3
    c[0] = t2
    c[1] = t0
    # constants of link2 to link3, root to tips
    for k in range(2):
        t0 = p[6 + 6 * k] * p[9 + 6 * k]
        t1 = p[7 + 6 * k] * p[10 + 6 * k]
        t2 = t0 + t1
        t3 = p[8 + 6 * k] * p[11 + 6 * k]
        t2 += t3
        t0 = p[9 + 6 * k] * t0
        t1 = p[10 + 6 * k] * t1
        t0 += t1
        t3 = p[11 + 6 * k] * t3
        t0 += t3
        t3 = p[6 + 6 * k] + p[7 + 6 * k]
        t3 += p[8 + 6 * k]
        c[2 + k] = t2
        c[4 + k] = t0
        c[6 + k] = t3
    # constants of link4, root to tips
    t0 = p[18] * p[21]
    t1 = p[19] * p[22]
    t2 = t0 + t1
    t3 = p[20] * p[23]
    t2 += t3
    t0 = p[21] * t0
    t1 = p[22] * t1
    t0 += t1
    t3 = p[23] * t3
    t0 += t3
    t3 = p[18] + p[19]
    t3 += p[20]
    c[8] = t2
    c[9] = t0
    c[10] = t3
    return (c,)


def _energy(xp, number, q, v, p, c):
    c, = c
    sum = [0.0] * 2
    height_down = [0.0] * 1
    velocity_x_down = [0.0] * 1
    velocity_y_down = [0.0] * 1
    out = [0.0] * 2
    # sums start at zero
    for k in range(2):
        sum[k] = 0.0
    # link1, root to tips
    t0 = xp.sin(q[0])
    t1 = q[4] * t0
    t2 = xp.cos(q[0])
    t3 = v[4] * t2
    t4 = v[0] * q[4]
    t5 = t0 * t4
    t3 -= t5
    t5 = v[4] * t0
    t4 = t2 * t4
    t5 += t4
    t4 = q[4] * c[1]
    t4 *= q[4]
    t4 = v[0] * t4
    t4 *= v[0]
    t2 = v[4] * c[1]
    t2 *= v[4]
    t4 += t2
    t4 *= 0.5
    t2 = q[4] * c[0]
    t2 *= t0
    t2 *= p[24]
    height_down[0] = t1
    velocity_x_down[0] = t3
    velocity_y_down[0] = t5
    sum[0] = sum[0] + t4
    sum[1] = sum[1] + t2
    # link2 to link3, root to tips
    for k in range(2):
        height_down_in = height_down[0]
        velocity_x_down_in = velocity_x_down[0]
        velocity_y_down_in = velocity_y_down[0]
        t0 = xp.sin(q[1 + k])
        t1 = q[5 + k] * t0
        t1 = height_down_in + t1
        t2 = xp.cos(q[1 + k])
        t3 = v[5 + k] * t2
        t3 = velocity_x_down_in + t3
        t4 = v[1 + k] * q[5 + k]
        t5 = t0 * t4
        t5 = t3 - t5
        t3 = v[5 + k] * t0
        t3 = velocity_y_down_in + t3
        t4 = t2 * t4
        t4 = t3 + t4
        t3 = velocity_x_down_in * velocity_x_down_in
        t6 = velocity_y_down_in * velocity_y_down_in
        t6 = t3 + t6
        t6 = c[6 + k] * t6
        t3 = q[5 + k] * c[4 + k]
        t3 *= q[5 + k]
        t3 = v[1 + k] * t3
        t3 *= v[1 + k]
        t3 = t6 + t3
        t6 = v[5 + k] * c[4 + k]
        t6 *= v[5 + k]
        t6 = t3 + t6
        t6 = 0.5 * t6
        t3 = velocity_y_down_in * t2
        t7 = velocity_x_down_in * t0
        t7 = t3 - t7
        t3 = q[5 + k] * c[2 + k]
        t8 = v[1 + k] * t3
        t8 = t7 * t8
        t8 = t6 + t8
        t2 = velocity_x_down_in * t2
        t6 = velocity_y_down_in * t0
        t6 = t2 + t6
        t2 = v[5 + k] * c[2 + k]
        t2 = t6 * t2
        t2 = t8 + t2
        t8 = height_down_in * c[6 + k]
        t3 = t0 * t3
        t3 = t8 + t3
        t3 = p[24] * t3
        height_down[0] = t1
        velocity_x_down[0] = t5
        velocity_y_down[0] = t4
        sum[0] = sum[0] + t2
        sum[1] = sum[1] + t3
    # link4, root to tips
    height_down_in = height_down[0]
    velocity_x_down_in = velocity_x_down[0]
    velocity_y_down_in = velocity_y_down[0]
    t0 = velocity_x_down_in * velocity_x_down_in
    t1 = velocity_y_down_in * velocity_y_down_in
    t1 = t0 + t1
    t1 = c[10] * t1
    t0 = q[7] * c[9]
    t0 *= q[7]
    t0 = v[3] * t0
    t0 *= v[3]
    t0 = t1 + t0
    t1 = v[7] * c[9]
    t1 *= v[7]
    t1 = t0 + t1
    t1 = 0.5 * t1
    t0 = xp.cos(q[3])
    t2 = velocity_y_down_in * t0
    t3 = xp.sin(q[3])
    t4 = velocity_x_down_in * t3
    t4 = t2 - t4
    t2 = q[7] * c[8]
    t5 = v[3] * t2
    t5 = t4 * t5
    t5 = t1 + t5
    t0 = velocity_x_down_in * t0
    t1 = velocity_y_down_in * t3
    t1 = t0 + t1
    t0 = v[7] * c[8]
    t0 = t1 * t0
    t0 = t5 + t0
    t5 = height_down_in * c[10]
    t2 = t3 * t2
    t2 = t5 + t2
    t2 = p[24] * t2
    sum[0] = sum[0] + t0
    sum[1] = sum[1] + t2
    # sums
    out[0] = sum[0]
    out[1] = sum[1]
    return out


energy = Function(
    "energy",
    "energy(q, v, p)\n\nKinetic and potential energy, J.\n\nq (..., 8), v (..., 8), p (..., 25) -> (..., 2); SI units and rad.\n\nThe elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
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
