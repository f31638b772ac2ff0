/* chain4: equations of motion by the articulated method (eomgen VERSION)
 *
 * The equations, as one text for every type: chain4.c includes it once for each. `real` is a scalar or a vector of
 * lanes (a lane is a state), `scalar` its element. EOM_AT(q, i) is STREAMS reals: element i of an argument or result.
 * Every value between is a `pack` of as many, and EACH statement computes its reals side by side.
 *
 * q[0]  link1.angle (rad)
 * q[1]  link2.angle (rad)
 * q[2]  link3.angle (rad)
 * q[3]  link4.angle (rad)
 * q[4]  link1.length (m)
 * q[5]  link2.length (m)
 * q[6]  link3.length (m)
 * q[7]  link4.length (m)
 * v[0]  link1.angle_rate (rad/s)
 * v[1]  link2.angle_rate (rad/s)
 * v[2]  link3.angle_rate (rad/s)
 * v[3]  link4.angle_rate (rad/s)
 * v[4]  link1.length_rate (m/s)
 * v[5]  link2.length_rate (m/s)
 * v[6]  link3.length_rate (m/s)
 * v[7]  link4.length_rate (m/s)
 * u[0]  link1.torque (N m)
 * u[1]  link2.torque (N m)
 * u[2]  link3.torque (N m)
 * u[3]  link4.torque (N m)
 * u[4]  link1.force (N)
 * u[5]  link2.force (N)
 * u[6]  link3.force (N)
 * u[7]  link4.force (N)
 * p[0]  link1.mass1 (kg)
 * p[1]  link1.mass2 (kg)
 * p[2]  link1.mass3 (kg)
 * p[3]  link1.fraction1 (1)
 * p[4]  link1.fraction2 (1)
 * p[5]  link1.fraction3 (1)
 * p[6]  link2.mass1 (kg)
 * p[7]  link2.mass2 (kg)
 * p[8]  link2.mass3 (kg)
 * p[9]  link2.fraction1 (1)
 * p[10]  link2.fraction2 (1)
 * p[11]  link2.fraction3 (1)
 * p[12]  link3.mass1 (kg)
 * p[13]  link3.mass2 (kg)
 * p[14]  link3.mass3 (kg)
 * p[15]  link3.fraction1 (1)
 * p[16]  link3.fraction2 (1)
 * p[17]  link3.fraction3 (1)
 * p[18]  link4.mass1 (kg)
 * p[19]  link4.mass2 (kg)
 * p[20]  link4.mass3 (kg)
 * p[21]  link4.fraction1 (1)
 * p[22]  link4.fraction2 (1)
 * p[23]  link4.fraction3 (1)
 * p[24]  gravity (m/s^2)
 */
#include "eomgen_kernels_standard.h"

/* ---- forward_dynamics ----
 * accelerations a of M a + h = Q(u)
 * (8),(8),(8),(25)->(8)
 */
#undef STREAMS
#define STREAMS EOM_WIDE
#if EOM_SCALAR_TEXT

EOM_INLINE void EOM_NAME(forward_dynamics_constants_1)(const scalar *p, scalar *restrict c)
{
    /* constants of link4, tips to root */
    scalar *const inertia_p_up = c + 7;
    pack t0; EACH t0[h] = p[18] * p[21];
    pack t1; EACH t1[h] = p[19] * p[22];
    pack t2; EACH t2[h] = p[20] * p[23];
    pack t3; EACH t3[h] = FMA(p[23], t2[h], FMA(p[21], t0[h], p[22] * t1[h]));
    pack t4; EACH t4[h] = t3[h] * t3[h];
    pack t5; EACH t5[h] = PIVOT_INVERSE(t4[h], t4[h]);
    pack t6; EACH t6[h] = t3[h] * t5[h];
    pack t7; EACH t7[h] = p[22] - p[21];
    pack t8; EACH t8[h] = p[23] - p[21];
    pack t9; EACH t9[h] = p[23] - p[22];
    pack t10; EACH t10[h] = t6[h] * (K(2.0) * FMA(p[19] * p[20], (t9[h] * t9[h]), FMA(p[18] * p[19], (t7[h] * t7[h]), p[18] * p[20] * (t8[h] * t8[h]))));
    EACH inertia_p_up[2] = t10[h];
    EACH c[0] = (t0[h] + t1[h] + t2[h]) * t6[h];
}

EOM_INLINE void EOM_NAME(forward_dynamics_constants_2)(const scalar *p, scalar *restrict c)
{
    /* constants of link2 to link3, tips to root */
    scalar *const inertia_p_up = c + 7;
    scalar *const kept0 = c + 11;
    scalar *const kept1 = c + 13;
    for (int k = 0; k < 2; k++) {
        pack t0; EACH t0[h] = p[12 - 6 * k] * p[15 - 6 * k];
        pack t1; EACH t1[h] = p[13 - 6 * k] * p[16 - 6 * k];
        pack t2; EACH t2[h] = p[14 - 6 * k] * p[17 - 6 * k];
        pack t3; EACH t3[h] = K(0.5) * inertia_p_up[2 - k];
        pack t4; EACH t4[h] = FMA(p[17 - 6 * k], t2[h], FMA(p[15 - 6 * k], t0[h], p[16 - 6 * k] * t1[h])) + t3[h];
        pack t5; EACH t5[h] = t4[h] * t4[h];
        pack t6; EACH t6[h] = PIVOT_INVERSE(t5[h], t5[h]);
        pack t7; EACH t7[h] = t4[h] * t6[h];
        EACH kept0[1 - k] = t7[h];
        pack t8; EACH t8[h] = p[16 - 6 * k] - p[15 - 6 * k];
        pack t9; EACH t9[h] = p[17 - 6 * k] - p[15 - 6 * k];
        pack t10; EACH t10[h] = p[17 - 6 * k] - p[16 - 6 * k];
        pack t11; EACH t11[h] = p[15 - 6 * k] - K(1.0);
        pack t12; EACH t12[h] = p[16 - 6 * k] - K(1.0);
        pack t13; EACH t13[h] = p[17 - 6 * k] - K(1.0);
        pack t14; EACH t14[h] = FMA(K(2.0), FMA(p[13 - 6 * k] * p[14 - 6 * k], (t10[h] * t10[h]), FMA(p[12 - 6 * k] * p[13 - 6 * k], (t8[h] * t8[h]), p[12 - 6 * k] * p[14 - 6 * k] * (t9[h] * t9[h]))), inertia_p_up[2 - k] * FMA(p[14 - 6 * k], (t13[h] * t13[h]), FMA(p[12 - 6 * k], (t11[h] * t11[h]), p[13 - 6 * k] * (t12[h] * t12[h]))));
        pack t15; EACH t15[h] = t7[h] * (t0[h] + t1[h] + t2[h] + t3[h]);
        EACH kept1[1 - k] = t15[h];
        EACH c[1 + k] = t15[h];
        EACH inertia_p_up[1 - k] = t7[h] * t14[h];
    }
}

EOM_INLINE void EOM_NAME(forward_dynamics_constants_3)(const scalar *p, scalar *restrict c)
{
    /* constants of link1, root to tips */
    scalar *const inertia_p_up = c + 7;
    pack t0; EACH t0[h] = p[0] * p[3];
    pack t1; EACH t1[h] = p[1] * p[4];
    pack t2; EACH t2[h] = p[2] * p[5];
    pack t3; EACH t3[h] = K(0.5) * inertia_p_up[0];
    pack t4; EACH t4[h] = FMA(p[5], t2[h], FMA(p[3], t0[h], p[4] * t1[h])) + t3[h];
    pack t5; EACH t5[h] = t4[h] * t4[h];
    pack t6; EACH t6[h] = PIVOT_INVERSE(t5[h], t5[h]);
    pack t7; EACH t7[h] = t4[h] * t6[h];
    EACH c[3] = t7[h];
    EACH c[4] = t7[h] * (t0[h] + t1[h] + t2[h] + t3[h]);
}

EOM_INLINE void EOM_NAME(forward_dynamics_constants_4)(const scalar *p, scalar *restrict c)
{
    /* constants of link4, root to tips */
    pack t0; EACH t0[h] = p[18] * p[21];
    pack t1; EACH t1[h] = p[19] * p[22];
    pack t2; EACH t2[h] = p[20] * p[23];
    pack t3; EACH t3[h] = FMA(p[23], t2[h], FMA(p[21], t0[h], p[22] * t1[h]));
    pack t4; EACH t4[h] = t3[h] * t3[h];
    pack t5; EACH t5[h] = PIVOT_INVERSE(t4[h], t4[h]);
    pack t6; EACH t6[h] = t3[h] * t5[h];
    EACH c[5] = t6[h];
    EACH c[6] = (t0[h] + t1[h] + t2[h]) * t6[h];
}

EOM_LINKAGE void EOM_NAME(forward_dynamics_constants)(const scalar *p, scalar *restrict c)
{
    EOM_NAME(forward_dynamics_constants_1)(p, c);
    EOM_NAME(forward_dynamics_constants_2)(p, c);
    EOM_NAME(forward_dynamics_constants_3)(p, c);
    EOM_NAME(forward_dynamics_constants_4)(p, c);
}

#endif

EOM_INLINE void EOM_NAME(forward_dynamics_1)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link4, tips to root */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const u = in[2]; EOM_PLACE(u, 2);
    pack *const force_u_up = work + 0;
    pack *const force_n_up = work + 1;
    pack *const torque_up = work + 2;
    pack *const kept7 = work + 15;
    pack *const kept8 = work + 16;
    pack *const kept9 = work + 17;
    pack *const kept10 = work + 18;
    EOM_FETCH(u, 7);
    pack t0; EACH t0[h] = EOM_AT(u, 7)[h] * c[0];
    EOM_FETCH(q, 3);
    EOM_FETCH(q, 2);
    pack s1, c1; SINCOS(DIFFERENCE(EOM_AT(q, 3)[h], EOM_AT(q, 2)[h]), s1, c1);
    EACH kept9[0][h] = c1[h];
    EOM_FETCH(q, 7);
    pack t2; EACH t2[h] = EOM_AT(q, 7)[h] * EOM_AT(q, 7)[h];
    pack t3; EACH t3[h] = PIVOT_INVERSE(t2[h], t2[h]);
    pack t4; EACH t4[h] = EOM_AT(q, 7)[h] * t3[h];
    EACH kept7[0][h] = t4[h];
    EOM_FETCH(u, 3);
    pack t5; EACH t5[h] = EOM_AT(u, 3)[h] * t4[h];
    EACH kept8[0][h] = t5[h];
    pack t6; EACH t6[h] = c[0] * t5[h];
    EACH kept10[0][h] = s1[h];
    EACH force_u_up[0][h] = FMA(t0[h], c1[h], -(t6[h] * s1[h]));
    EACH force_n_up[0][h] = FMA(t0[h], s1[h], t6[h] * c1[h]);
    EACH torque_up[0][h] = EOM_AT(u, 3)[h];
}

EOM_INLINE void EOM_NAME(forward_dynamics_2)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link2 to link3, tips to root */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const u = in[2]; EOM_PLACE(u, 2);
    pack *const force_u_up = work + 0;
    pack *const force_n_up = work + 1;
    pack *const torque_up = work + 2;
    pack *const kept2 = work + 5;
    pack *const kept3 = work + 7;
    pack *const kept4 = work + 9;
    pack *const kept5 = work + 11;
    pack *const kept6 = work + 13;
    pack force_u_up_in; EACH force_u_up_in[h] = force_u_up[0][h];
    pack force_n_up_in; EACH force_n_up_in[h] = force_n_up[0][h];
    pack torque_up_in; EACH torque_up_in[h] = torque_up[0][h];
    for (int k = 0; k < 2; k++) {
        EOM_FETCH(q, 2 - k);
        EOM_FETCH(q, 1 - k);
        pack s0, c0; SINCOS(DIFFERENCE(EOM_AT(q, 2 - k)[h], EOM_AT(q, 1 - k)[h]), s0, c0);
        EACH kept5[1 - k][h] = c0[h];
        EOM_FETCH(u, 6 - k);
        pack t1; EACH t1[h] = EOM_AT(u, 6 - k)[h] - force_u_up_in[h];
        EACH kept3[1 - k][h] = t1[h];
        pack t2; EACH t2[h] = FMA(c[1 + k], t1[h], force_u_up_in[h]);
        EACH kept6[1 - k][h] = s0[h];
        EOM_FETCH(q, 6 - k);
        pack t3; EACH t3[h] = EOM_AT(q, 6 - k)[h] * EOM_AT(q, 6 - k)[h];
        pack t4; EACH t4[h] = PIVOT_INVERSE(t3[h], t3[h]);
        pack t5; EACH t5[h] = EOM_AT(q, 6 - k)[h] * t4[h];
        EACH kept2[1 - k][h] = t5[h];
        EOM_FETCH(u, 2 - k);
        pack t6; EACH t6[h] = FMA(t5[h], (EOM_AT(u, 2 - k)[h] - torque_up_in[h]), -force_n_up_in[h]);
        EACH kept4[1 - k][h] = t6[h];
        pack t7; EACH t7[h] = FMA(c[1 + k], t6[h], force_n_up_in[h]);
        pack force_u_up_out; EACH force_u_up_out[h] = FMA(c0[h], t2[h], -(s0[h] * t7[h]));
        pack force_n_up_out; EACH force_n_up_out[h] = FMA(s0[h], t2[h], c0[h] * t7[h]);
        pack torque_up_out; EACH torque_up_out[h] = EOM_AT(u, 2 - k)[h];
        EACH force_u_up_in[h] = force_u_up_out[h];
        EACH force_n_up_in[h] = force_n_up_out[h];
        EACH torque_up_in[h] = torque_up_out[h];
    }
    EACH force_u_up[0][h] = force_u_up_in[h];
    EACH force_n_up[0][h] = force_n_up_in[h];
    EACH torque_up[0][h] = torque_up_in[h];
}

EOM_INLINE void EOM_NAME(forward_dynamics_3)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link1, root to tips */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    const scalar *const u = in[2]; EOM_PLACE(u, 2);
    EOM_PLACE(out, 3);
    pack *const force_u_up = work + 0;
    pack *const force_n_up = work + 1;
    pack *const torque_up = work + 2;
    pack *const acceleration_u_down1 = work + 3;
    pack *const acceleration_n_down1 = work + 4;
    pack force_u_up_in; EACH force_u_up_in[h] = force_u_up[0][h];
    pack force_n_up_in; EACH force_n_up_in[h] = force_n_up[0][h];
    pack torque_up_in; EACH torque_up_in[h] = torque_up[0][h];
    EOM_FETCH(q, 0);
    pack s0, c0; SINCOS(ANGLE(EOM_AT(q, 0)[h]), s0, c0);
    pack t1; EACH t1[h] = p[24] * s0[h];
    EOM_FETCH(u, 4);
    pack t2; EACH t2[h] = FNMA(c[4], t1[h], c[3] * (EOM_AT(u, 4)[h] - force_u_up_in[h]));
    EACH acceleration_u_down1[0][h] = t1[h] + t2[h];
    pack t3; EACH t3[h] = p[24] * c0[h];
    EOM_FETCH(q, 4);
    pack t4; EACH t4[h] = EOM_AT(q, 4)[h] * EOM_AT(q, 4)[h];
    pack t5; EACH t5[h] = PIVOT_INVERSE(t4[h], t4[h]);
    pack t6; EACH t6[h] = EOM_AT(q, 4)[h] * t5[h];
    EOM_FETCH(u, 0);
    pack t7; EACH t7[h] = FNMA(c[4], t3[h], c[3] * FMA(t6[h], (EOM_AT(u, 0)[h] - torque_up_in[h]), -force_n_up_in[h]));
    EACH acceleration_n_down1[0][h] = t3[h] + t7[h];
    EOM_FETCH(out, 0);
    EOM_FETCH(v, 0);
    EOM_FETCH(v, 4);
    EACH EOM_AT(out, 0)[h] = t6[h] * FNMA(K(2.0), (EOM_AT(v, 0)[h] * EOM_AT(v, 4)[h]), t7[h]);
    EOM_FETCH(out, 4);
    EACH EOM_AT(out, 4)[h] = FMA(EOM_AT(q, 4)[h] * t6[h], (EOM_AT(q, 4)[h] * (EOM_AT(v, 0)[h] * EOM_AT(v, 0)[h])), t2[h]);
}

EOM_INLINE void EOM_NAME(forward_dynamics_4)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link2 to link3, root to tips */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    EOM_PLACE(out, 3);
    pack *const acceleration_u_down1 = work + 3;
    pack *const acceleration_n_down1 = work + 4;
    const scalar *const kept0 = c + 11;
    const scalar *const kept1 = c + 13;
    pack *const kept2 = work + 5;
    pack *const kept3 = work + 7;
    pack *const kept4 = work + 9;
    pack *const kept5 = work + 11;
    pack *const kept6 = work + 13;
    pack acceleration_u_down1_in; EACH acceleration_u_down1_in[h] = acceleration_u_down1[0][h];
    pack acceleration_n_down1_in; EACH acceleration_n_down1_in[h] = acceleration_n_down1[0][h];
    for (int k = 0; k < 2; k++) {
        pack t0; EACH t0[h] = FMA(kept5[k][h], acceleration_u_down1_in[h], kept6[k][h] * acceleration_n_down1_in[h]);
        pack t1; EACH t1[h] = FNMA(kept1[k], t0[h], kept0[k] * kept3[k][h]);
        pack t2; EACH t2[h] = FMA(kept5[k][h], acceleration_n_down1_in[h], -(kept6[k][h] * acceleration_u_down1_in[h]));
        pack t3; EACH t3[h] = FNMA(kept1[k], t2[h], kept0[k] * kept4[k][h]);
        EOM_FETCH(out, 1 + k);
        EOM_FETCH(v, 1 + k);
        EOM_FETCH(v, 5 + k);
        EACH EOM_AT(out, 1 + k)[h] = kept2[k][h] * FNMA(K(2.0), (EOM_AT(v, 1 + k)[h] * EOM_AT(v, 5 + k)[h]), t3[h]);
        EOM_FETCH(out, 5 + k);
        EOM_FETCH(q, 5 + k);
        EACH EOM_AT(out, 5 + k)[h] = FMA(EOM_AT(q, 5 + k)[h] * kept2[k][h], (EOM_AT(q, 5 + k)[h] * (EOM_AT(v, 1 + k)[h] * EOM_AT(v, 1 + k)[h])), t1[h]);
        pack acceleration_u_down1_out; EACH acceleration_u_down1_out[h] = t0[h] + t1[h];
        pack acceleration_n_down1_out; EACH acceleration_n_down1_out[h] = t2[h] + t3[h];
        EACH acceleration_u_down1_in[h] = acceleration_u_down1_out[h];
        EACH acceleration_n_down1_in[h] = acceleration_n_down1_out[h];
    }
    EACH acceleration_u_down1[0][h] = acceleration_u_down1_in[h];
    EACH acceleration_n_down1[0][h] = acceleration_n_down1_in[h];
}

EOM_INLINE void EOM_NAME(forward_dynamics_5)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link4, root to tips */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    const scalar *const u = in[2]; EOM_PLACE(u, 2);
    EOM_PLACE(out, 3);
    pack *const acceleration_u_down1 = work + 3;
    pack *const acceleration_n_down1 = work + 4;
    pack *const kept7 = work + 15;
    pack *const kept8 = work + 16;
    pack *const kept9 = work + 17;
    pack *const kept10 = work + 18;
    pack acceleration_u_down1_in; EACH acceleration_u_down1_in[h] = acceleration_u_down1[0][h];
    pack acceleration_n_down1_in; EACH acceleration_n_down1_in[h] = acceleration_n_down1[0][h];
    EOM_FETCH(v, 3);
    EOM_FETCH(v, 7);
    pack t0; EACH t0[h] = kept7[0][h] * FNMA(K(2.0), (EOM_AT(v, 3)[h] * EOM_AT(v, 7)[h]), FNMA(c[6], FMA(kept9[0][h], acceleration_n_down1_in[h], -(kept10[0][h] * acceleration_u_down1_in[h])), c[5] * kept8[0][h]));
    EOM_FETCH(out, 3);
    EACH EOM_AT(out, 3)[h] = t0[h];
    EOM_FETCH(out, 7);
    EOM_FETCH(q, 7);
    EOM_FETCH(u, 7);
    EACH EOM_AT(out, 7)[h] = FMA(EOM_AT(q, 7)[h] * kept7[0][h], (EOM_AT(q, 7)[h] * (EOM_AT(v, 3)[h] * EOM_AT(v, 3)[h])), FNMA(c[6], FMA(kept9[0][h], acceleration_u_down1_in[h], kept10[0][h] * acceleration_n_down1_in[h]), EOM_AT(u, 7)[h] * c[5]));
}

EOM_LINKAGE void EOM_NAME(forward_dynamics)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    EOM_NAME(forward_dynamics_1)(in, places, p, c, out, work);
    EOM_NAME(forward_dynamics_2)(in, places, p, c, out, work);
    EOM_NAME(forward_dynamics_3)(in, places, p, c, out, work);
    EOM_NAME(forward_dynamics_4)(in, places, p, c, out, work);
    EOM_NAME(forward_dynamics_5)(in, places, p, c, out, work);
}

/* ---- mass_matrix ----
 * mass matrix M of M a + h = Q(u)
 * (8),(25)->(8,8)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

static EOM_APART void EOM_NAME(mass_matrix_constants_1)(const scalar *p, scalar *restrict c)
{
    /* constants of link4, tips to root */
    scalar *const hung_mass_up = c + 14;
    EACH hung_mass_up[2] = p[20] + p[18] + p[19];
    pack t0; EACH t0[h] = p[18] * p[21];
    pack t1; EACH t1[h] = p[19] * p[22];
    pack t2; EACH t2[h] = p[20] * p[23];
    EACH c[0] = t0[h] + t1[h] + t2[h];
    EACH c[1] = FMA(p[23], t2[h], FMA(p[21], t0[h], p[22] * t1[h]));
}

static EOM_APART void EOM_NAME(mass_matrix_constants_2)(const scalar *p, scalar *restrict c)
{
    /* constants of link2 to link3, tips to root */
    scalar *const hung_mass_up = c + 14;
    for (int k = 0; k < 2; k++) {
        pack t0; EACH t0[h] = p[12 - 6 * k] * p[15 - 6 * k];
        pack t1; EACH t1[h] = p[13 - 6 * k] * p[16 - 6 * k];
        pack t2; EACH t2[h] = p[14 - 6 * k] * p[17 - 6 * k];
        pack t3; EACH t3[h] = t0[h] + t1[h] + t2[h];
        EACH c[2 + k] = t3[h];
        pack t4; EACH t4[h] = FMA(p[17 - 6 * k], t2[h], FMA(p[15 - 6 * k], t0[h], p[16 - 6 * k] * t1[h]));
        EACH c[4 + k] = t4[h];
        EACH c[6 + k] = hung_mass_up[2 - k] + t3[h];
        EACH c[8 + k] = hung_mass_up[2 - k] + t4[h];
        EACH hung_mass_up[1 - k] = hung_mass_up[2 - k] + p[14 - 6 * k] + p[12 - 6 * k] + p[13 - 6 * k];
    }
}

static EOM_APART void EOM_NAME(mass_matrix_constants_3)(const scalar *p, scalar *restrict c)
{
    /* constants of link1, tips to root */
    scalar *const hung_mass_up = c + 14;
    pack t0; EACH t0[h] = p[0] * p[3];
    pack t1; EACH t1[h] = p[1] * p[4];
    pack t2; EACH t2[h] = p[2] * p[5];
    pack t3; EACH t3[h] = t0[h] + t1[h] + t2[h];
    EACH c[10] = t3[h];
    pack t4; EACH t4[h] = FMA(p[5], t2[h], FMA(p[3], t0[h], p[4] * t1[h]));
    EACH c[11] = t4[h];
    EACH c[12] = hung_mass_up[0] + t3[h];
    EACH c[13] = hung_mass_up[0] + t4[h];
}

EOM_LINKAGE void EOM_NAME(mass_matrix_constants)(const scalar *p, scalar *restrict c)
{
    EOM_NAME(mass_matrix_constants_1)(p, c);
    EOM_NAME(mass_matrix_constants_2)(p, c);
    EOM_NAME(mass_matrix_constants_3)(p, c);
}

#endif

static EOM_APART void EOM_NAME(mass_matrix_1)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* sums start at zero */
    EOM_PLACE(out, 1);
    for (int k = 0; k < 64; k++) {
        EOM_FETCH(out, k);
        EACH EOM_AT(out, k)[h] = R(K(0.0));
    }
}

static EOM_APART void EOM_NAME(mass_matrix_2)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link4, tips to root */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    EOM_PLACE(out, 1);
    pack *const end_x = work + 0;
    pack *const end_y = work + 8;
    pack *const force_x = work + 16;
    pack *const force_y = work + 24;
    EOM_FETCH(out, 27);
    EOM_FETCH(q, 7);
    EACH EOM_AT(out, 27)[h] = EOM_AT(q, 7)[h] * (EOM_AT(q, 7)[h] * c[1]);
    EOM_FETCH(q, 3);
    pack s0, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 3)[h]), s0, c0);
    EACH end_y[7][h] = s0[h];
    EACH end_x[3][h] = -(EOM_AT(q, 7)[h] * s0[h]);
    EACH end_x[7][h] = c0[h];
    EACH end_y[3][h] = EOM_AT(q, 7)[h] * c0[h];
    pack t1; EACH t1[h] = EOM_AT(q, 7)[h] * c[0];
    EACH force_x[3][h] = -(t1[h] * s0[h]);
    EACH force_y[3][h] = t1[h] * c0[h];
    EACH force_x[7][h] = c[0] * c0[h];
    EACH force_y[7][h] = c[0] * s0[h];
    EOM_FETCH(out, 63);
    EACH EOM_AT(out, 63)[h] = R(c[1]);
}

static EOM_APART void EOM_NAME(mass_matrix_3)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link2 to link3, tips to root */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    EOM_PLACE(out, 1);
    pack *const end_x = work + 0;
    pack *const end_y = work + 8;
    pack *const force_x = work + 16;
    pack *const force_y = work + 24;
    const scalar *const hung_mass_up = c + 14;
    for (int k = 0; k < 2; k++) {
        EOM_FETCH(q, 6 - k);
        pack t0; EACH t0[h] = EOM_AT(q, 6 - k)[h] * hung_mass_up[2 - k];
        EOM_FETCH(out, 18 - 9 * k);
        EACH EOM_AT(out, 18 - 9 * k)[h] = FMA(EOM_AT(q, 6 - k)[h], (EOM_AT(q, 6 - k)[h] * c[4 + k]), EOM_AT(q, 6 - k)[h] * t0[h]);
        EOM_FETCH(q, 2 - k);
        pack s1, c1; SINCOS_CALL(ANGLE(EOM_AT(q, 2 - k)[h]), s1, c1);
        EACH end_y[6 - k][h] = s1[h];
        EACH end_x[2 - k][h] = -(EOM_AT(q, 6 - k)[h] * s1[h]);
        EACH end_x[6 - k][h] = c1[h];
        EACH end_y[2 - k][h] = EOM_AT(q, 6 - k)[h] * c1[h];
        pack t2; EACH t2[h] = FMA(EOM_AT(q, 6 - k)[h], c[2 + k], t0[h]);
        EACH force_x[2 - k][h] = -(s1[h] * t2[h]);
        EACH force_y[2 - k][h] = c1[h] * t2[h];
        EACH force_x[6 - k][h] = c1[h] * c[6 + k];
        EACH force_y[6 - k][h] = s1[h] * c[6 + k];
        EOM_FETCH(out, 54 - 9 * k);
        EACH EOM_AT(out, 54 - 9 * k)[h] = R(c[8 + k]);
    }
}

static EOM_APART void EOM_NAME(mass_matrix_4)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link1, tips to root */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    EOM_PLACE(out, 1);
    pack *const end_x = work + 0;
    pack *const end_y = work + 8;
    pack *const force_x = work + 16;
    pack *const force_y = work + 24;
    const scalar *const hung_mass_up = c + 14;
    EOM_FETCH(q, 4);
    pack t0; EACH t0[h] = EOM_AT(q, 4)[h] * hung_mass_up[0];
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = FMA(EOM_AT(q, 4)[h], (EOM_AT(q, 4)[h] * c[11]), EOM_AT(q, 4)[h] * t0[h]);
    EOM_FETCH(q, 0);
    pack s1, c1; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s1, c1);
    EACH end_y[4][h] = s1[h];
    EACH end_x[0][h] = -(EOM_AT(q, 4)[h] * s1[h]);
    EACH end_x[4][h] = c1[h];
    EACH end_y[0][h] = EOM_AT(q, 4)[h] * c1[h];
    pack t2; EACH t2[h] = FMA(EOM_AT(q, 4)[h], c[10], t0[h]);
    EACH force_x[0][h] = -(s1[h] * t2[h]);
    EACH force_y[0][h] = c1[h] * t2[h];
    EACH force_x[4][h] = c1[h] * c[12];
    EACH force_y[4][h] = s1[h] * c[12];
    EOM_FETCH(out, 36);
    EACH EOM_AT(out, 36)[h] = R(c[13]);
}

static EOM_APART void EOM_NAME(mass_matrix_5)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* pairs of links */
    EOM_PLACE(out, 1);
    pack *const end_x = work + 0;
    pack *const end_y = work + 8;
    pack *const force_x = work + 16;
    pack *const force_y = work + 24;
    static const int at0[] = {-1, 0, 1, 2, -1, 0, 1, 2};
    static const int at1[] = {4, 5, 6, 7, -1, 0, 1, 2};
    for (int k = 0; k < 8; k++) {
        for (int i = at0[k]; i >= 0; i = at1[i]) {
            pack t0; EACH t0[h] = FMA(end_x[0 + i][h], force_x[k][h], end_y[0 + i][h] * force_y[k][h]);
            EOM_FETCH(out, k + 8 * i);
            EACH EOM_AT(out, k + 8 * i)[h] = t0[h];
            EOM_FETCH(out, 8 * k + i);
            EACH EOM_AT(out, 8 * k + i)[h] = t0[h];
        }
    }
}

EOM_LINKAGE void EOM_NAME(mass_matrix)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    EOM_NAME(mass_matrix_1)(in, places, p, c, out, work);
    EOM_NAME(mass_matrix_2)(in, places, p, c, out, work);
    EOM_NAME(mass_matrix_3)(in, places, p, c, out, work);
    EOM_NAME(mass_matrix_4)(in, places, p, c, out, work);
    EOM_NAME(mass_matrix_5)(in, places, p, c, out, work);
}

/* ---- energy ----
 * kinetic and potential energy, J
 * (8),(8),(25)->(2)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

static EOM_APART void EOM_NAME(energy_constants_1)(const scalar *p, scalar *restrict c)
{
    /* constants of link1, root to tips */
    pack t0; EACH t0[h] = p[0] * p[3];
    pack t1; EACH t1[h] = p[1] * p[4];
    pack t2; EACH t2[h] = p[2] * p[5];
    EACH c[0] = t0[h] + t1[h] + t2[h];
    EACH c[1] = FMA(p[5], t2[h], FMA(p[3], t0[h], p[4] * t1[h]));
}

static EOM_APART void EOM_NAME(energy_constants_2)(const scalar *p, scalar *restrict c)
{
    /* constants of link2 to link3, root to tips */
    for (int k = 0; k < 2; k++) {
        pack t0; EACH t0[h] = p[6 + 6 * k] * p[9 + 6 * k];
        pack t1; EACH t1[h] = p[7 + 6 * k] * p[10 + 6 * k];
        pack t2; EACH t2[h] = p[8 + 6 * k] * p[11 + 6 * k];
        EACH c[2 + k] = t0[h] + t1[h] + t2[h];
        EACH c[4 + k] = FMA(p[11 + 6 * k], t2[h], FMA(p[9 + 6 * k], t0[h], p[10 + 6 * k] * t1[h]));
        EACH c[6 + k] = p[8 + 6 * k] + p[6 + 6 * k] + p[7 + 6 * k];
    }
}

static EOM_APART void EOM_NAME(energy_constants_3)(const scalar *p, scalar *restrict c)
{
    /* constants of link4, root to tips */
    pack t0; EACH t0[h] = p[18] * p[21];
    pack t1; EACH t1[h] = p[19] * p[22];
    pack t2; EACH t2[h] = p[20] * p[23];
    EACH c[8] = t0[h] + t1[h] + t2[h];
    EACH c[9] = FMA(p[23], t2[h], FMA(p[21], t0[h], p[22] * t1[h]));
    EACH c[10] = p[20] + p[18] + p[19];
}

EOM_LINKAGE void EOM_NAME(energy_constants)(const scalar *p, scalar *restrict c)
{
    EOM_NAME(energy_constants_1)(p, c);
    EOM_NAME(energy_constants_2)(p, c);
    EOM_NAME(energy_constants_3)(p, c);
}

#endif

static EOM_APART void EOM_NAME(energy_1)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* sums start at zero */
    pack *const sum = work + 0;
    for (int k = 0; k < 2; k++) {
        EACH sum[k][h] = R(K(0.0));
    }
}

static EOM_APART void EOM_NAME(energy_2)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link1, root to tips */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    pack *const sum = work + 0;
    pack *const height_down = work + 2;
    pack *const velocity_x_down = work + 3;
    pack *const velocity_y_down = work + 4;
    EOM_FETCH(q, 0);
    pack s0, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s0, c0);
    EOM_FETCH(q, 4);
    EACH height_down[0][h] = EOM_AT(q, 4)[h] * s0[h];
    EOM_FETCH(v, 0);
    pack t1; EACH t1[h] = EOM_AT(v, 0)[h] * EOM_AT(q, 4)[h];
    EOM_FETCH(v, 4);
    EACH velocity_x_down[0][h] = FMA(EOM_AT(v, 4)[h], c0[h], -(s0[h] * t1[h]));
    EACH velocity_y_down[0][h] = FMA(EOM_AT(v, 4)[h], s0[h], c0[h] * t1[h]);
    pack t2; EACH t2[h] = K(0.5) * FMA(EOM_AT(v, 0)[h], (EOM_AT(v, 0)[h] * (EOM_AT(q, 4)[h] * (EOM_AT(q, 4)[h] * c[1]))), EOM_AT(v, 4)[h] * (EOM_AT(v, 4)[h] * c[1]));
    EACH sum[0][h] += t2[h];
    EACH sum[1][h] += p[24] * (s0[h] * (EOM_AT(q, 4)[h] * c[0]));
}

static EOM_APART void EOM_NAME(energy_3)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link2 to link3, root to tips */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    pack *const sum = work + 0;
    pack *const height_down = work + 2;
    pack *const velocity_x_down = work + 3;
    pack *const velocity_y_down = work + 4;
    pack height_down_in; EACH height_down_in[h] = height_down[0][h];
    pack velocity_x_down_in; EACH velocity_x_down_in[h] = velocity_x_down[0][h];
    pack velocity_y_down_in; EACH velocity_y_down_in[h] = velocity_y_down[0][h];
    for (int k = 0; k < 2; k++) {
        EOM_FETCH(q, 1 + k);
        pack s0, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 1 + k)[h]), s0, c0);
        EOM_FETCH(v, 1 + k);
        EOM_FETCH(q, 5 + k);
        pack t1; EACH t1[h] = EOM_AT(v, 1 + k)[h] * EOM_AT(q, 5 + k)[h];
        EOM_FETCH(v, 5 + k);
        pack t2; EACH t2[h] = FMA(EOM_AT(v, 5 + k)[h], (EOM_AT(v, 5 + k)[h] * c[4 + k]), FMA(EOM_AT(v, 1 + k)[h], (EOM_AT(v, 1 + k)[h] * (EOM_AT(q, 5 + k)[h] * (EOM_AT(q, 5 + k)[h] * c[4 + k]))), c[6 + k] * FMA(velocity_x_down_in[h], velocity_x_down_in[h], velocity_y_down_in[h] * velocity_y_down_in[h])));
        pack t3; EACH t3[h] = EOM_AT(q, 5 + k)[h] * c[2 + k];
        pack height_down_out; EACH height_down_out[h] = FMA(EOM_AT(q, 5 + k)[h], s0[h], height_down_in[h]);
        pack velocity_x_down_out; EACH velocity_x_down_out[h] = FNMA(s0[h], t1[h], FMA(EOM_AT(v, 5 + k)[h], c0[h], velocity_x_down_in[h]));
        pack velocity_y_down_out; EACH velocity_y_down_out[h] = FMA(c0[h], t1[h], FMA(EOM_AT(v, 5 + k)[h], s0[h], velocity_y_down_in[h]));
        EACH sum[0][h] += FMA(FMA(velocity_x_down_in[h], c0[h], velocity_y_down_in[h] * s0[h]), (EOM_AT(v, 5 + k)[h] * c[2 + k]), FMA(FMA(velocity_y_down_in[h], c0[h], -(velocity_x_down_in[h] * s0[h])), (EOM_AT(v, 1 + k)[h] * t3[h]), K(0.5) * t2[h]));
        EACH sum[1][h] += p[24] * FMA(s0[h], t3[h], height_down_in[h] * c[6 + k]);
        EACH height_down_in[h] = height_down_out[h];
        EACH velocity_x_down_in[h] = velocity_x_down_out[h];
        EACH velocity_y_down_in[h] = velocity_y_down_out[h];
    }
    EACH height_down[0][h] = height_down_in[h];
    EACH velocity_x_down[0][h] = velocity_x_down_in[h];
    EACH velocity_y_down[0][h] = velocity_y_down_in[h];
}

static EOM_APART void EOM_NAME(energy_4)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* link4, root to tips */
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    pack *const sum = work + 0;
    pack *const height_down = work + 2;
    pack *const velocity_x_down = work + 3;
    pack *const velocity_y_down = work + 4;
    pack height_down_in; EACH height_down_in[h] = height_down[0][h];
    pack velocity_x_down_in; EACH velocity_x_down_in[h] = velocity_x_down[0][h];
    pack velocity_y_down_in; EACH velocity_y_down_in[h] = velocity_y_down[0][h];
    EOM_FETCH(v, 7);
    EOM_FETCH(v, 3);
    EOM_FETCH(q, 7);
    pack t0; EACH t0[h] = FMA(EOM_AT(v, 7)[h], (EOM_AT(v, 7)[h] * c[9]), FMA(EOM_AT(v, 3)[h], (EOM_AT(v, 3)[h] * (EOM_AT(q, 7)[h] * (EOM_AT(q, 7)[h] * c[9]))), c[10] * FMA(velocity_x_down_in[h], velocity_x_down_in[h], velocity_y_down_in[h] * velocity_y_down_in[h])));
    EOM_FETCH(q, 3);
    pack s1, c1; SINCOS_CALL(ANGLE(EOM_AT(q, 3)[h]), s1, c1);
    pack t2; EACH t2[h] = EOM_AT(q, 7)[h] * c[8];
    EACH sum[0][h] += FMA(FMA(velocity_x_down_in[h], c1[h], velocity_y_down_in[h] * s1[h]), (EOM_AT(v, 7)[h] * c[8]), FMA(FMA(velocity_y_down_in[h], c1[h], -(velocity_x_down_in[h] * s1[h])), (EOM_AT(v, 3)[h] * t2[h]), K(0.5) * t0[h]));
    EACH sum[1][h] += p[24] * FMA(s1[h], t2[h], height_down_in[h] * c[10]);
}

static EOM_APART void EOM_NAME(energy_5)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    /* sums */
    EOM_PLACE(out, 2);
    pack *const sum = work + 0;
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = sum[0][h];
    EOM_FETCH(out, 1);
    EACH EOM_AT(out, 1)[h] = sum[1][h];
}

EOM_LINKAGE void EOM_NAME(energy)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    EOM_NAME(energy_1)(in, places, p, c, out, work);
    EOM_NAME(energy_2)(in, places, p, c, out, work);
    EOM_NAME(energy_3)(in, places, p, c, out, work);
    EOM_NAME(energy_4)(in, places, p, c, out, work);
    EOM_NAME(energy_5)(in, places, p, c, out, work);
}
