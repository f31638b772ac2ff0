/* leg: equations of motion by the matrix method (eomgen VERSION)
 *
 * The equations, as one text for every type: leg.c includes it once for each. `real` is a scalar or a vector of
 * lanes (a lane is a state), `scalar` its element. EOM_AT(q, i) is STREAMS reals: element i of an argument or result.
 * Every value between is a `pack` of as many, and EACH statement computes its reals side by side.
 *
 * q[0]  shank.angle (rad)
 * q[1]  thigh.angle (rad)
 * q[2]  shank.length (m)
 * v[0]  shank.angle_rate (rad/s)
 * v[1]  thigh.angle_rate (rad/s)
 * v[2]  shank.length_rate (m/s)
 * a[0]  shank.angle_acceleration (rad/s^2)
 * a[1]  thigh.angle_acceleration (rad/s^2)
 * a[2]  shank.length_acceleration (m/s^2)
 * u[0]  shank.torque (N m)
 * u[1]  thigh.torque (N m)
 * u[2]  shank.force (N)
 * w[0]  thigh.length (m)
 * w[1]  thigh.length_rate (m/s)
 * w[2]  thigh.length_acceleration (m/s^2)
 * p[0]  shank.mass1 (kg)
 * p[1]  shank.mass2 (kg)
 * p[2]  shank.mass3 (kg)
 * p[3]  shank.fraction1 (1)
 * p[4]  shank.fraction2 (1)
 * p[5]  shank.fraction3 (1)
 * p[6]  shank.damping (N s/m)
 * p[7]  thigh.mass1 (kg)
 * p[8]  thigh.mass2 (kg)
 * p[9]  thigh.fraction1 (1)
 * p[10]  thigh.fraction2 (1)
 * p[11]  gravity (m/s^2)
 */
#include "eomgen_kernels_standard.h"

/* ---- forward_dynamics ----
 * accelerations a of M a + h = Q(u)
 * (3),(3),(3),(1,3),(12)->(3)
 */
#undef STREAMS
#define STREAMS EOM_WIDE
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(forward_dynamics_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = p[7] * p[9];
    pack t1; EACH t1[h] = p[8] * p[10];
    EACH c[0] = t0[h] + t1[h];
    EACH c[1] = FMA(p[9], t0[h], p[10] * t1[h]);
    pack t2; EACH t2[h] = p[7] + p[8];
    EACH c[2] = t2[h];
    pack t3; EACH t3[h] = p[0] * p[3];
    pack t4; EACH t4[h] = p[1] * p[4];
    pack t5; EACH t5[h] = p[2] * p[5];
    pack t6; EACH t6[h] = t3[h] + t4[h] + t5[h];
    EACH c[3] = t6[h];
    pack t7; EACH t7[h] = FMA(p[5], t5[h], FMA(p[3], t3[h], p[4] * t4[h]));
    EACH c[4] = t7[h];
    EACH c[5] = t2[h] + t6[h];
    EACH c[6] = t2[h] + t7[h];
}

#endif

EOM_LINKAGE void EOM_NAME(forward_dynamics)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    const scalar *const u = in[2]; EOM_PLACE(u, 2);
    const scalar *const w = in[3]; EOM_PLACE(w, 3);
    EOM_PLACE(out, 4);
    EOM_FETCH(q, 2);
    pack t0; EACH t0[h] = EOM_AT(q, 2)[h] * c[4];
    pack t1; EACH t1[h] = FMA(EOM_AT(q, 2)[h], t0[h], c[2] * (EOM_AT(q, 2)[h] * EOM_AT(q, 2)[h]));
    EOM_FETCH(q, 0);
    EOM_FETCH(q, 1);
    pack s2, c2, s3, c3; SINCOS2(ANGLE(EOM_AT(q, 0)[h]), ANGLE(EOM_AT(q, 1)[h]), s2, c2, s3, c3);
    pack t4; EACH t4[h] = FMA(c2[h], c3[h], s2[h] * s3[h]);
    EOM_FETCH(w, 0);
    pack t5; EACH t5[h] = EOM_AT(w, 0)[h] * c[0];
    pack t6; EACH t6[h] = EOM_AT(q, 2)[h] * t5[h];
    pack t7; EACH t7[h] = t4[h] * t6[h];
    pack t8; EACH t8[h] = EOM_AT(w, 0)[h] * c[1];
    pack t9; EACH t9[h] = EOM_AT(w, 0)[h] * t8[h];
    pack t10; EACH t10[h] = PIVOT_INVERSE(t9[h], t9[h]);
    pack t11; EACH t11[h] = t7[h] * t10[h];
    pack t12; EACH t12[h] = FMA(c3[h], s2[h], -(c2[h] * s3[h]));
    pack t13; EACH t13[h] = t12[h] * t5[h];
    pack t14; EACH t14[h] = t13[h] * t10[h];
    pack t15; EACH t15[h] = t7[h] * t14[h];
    pack t16; EACH t16[h] = PIVOT_INVERSE(FNMA(t13[h], t14[h], c[6]), c[6]);
    pack t17; EACH t17[h] = t15[h] * t16[h];
    pack t18; EACH t18[h] = PIVOT_INVERSE(FNMA(t15[h], t17[h], FNMA(t7[h], t11[h], t1[h])), t1[h]);
    EOM_FETCH(v, 1);
    pack t19; EACH t19[h] = EOM_AT(v, 1)[h] * EOM_AT(v, 1)[h];
    pack t20; EACH t20[h] = t12[h] * t6[h];
    EOM_FETCH(v, 0);
    EOM_FETCH(v, 2);
    pack t21; EACH t21[h] = K(2.0) * (EOM_AT(v, 0)[h] * EOM_AT(v, 2)[h]);
    pack t22; EACH t22[h] = EOM_AT(q, 2)[h] * c[2];
    pack t23; EACH t23[h] = t0[h] + t22[h];
    EOM_FETCH(w, 1);
    pack t24; EACH t24[h] = K(2.0) * (EOM_AT(v, 1)[h] * EOM_AT(w, 1)[h]);
    pack t25; EACH t25[h] = EOM_AT(q, 2)[h] * c[0];
    EOM_FETCH(w, 2);
    pack t26; EACH t26[h] = FMA(p[11], (c2[h] * FMA(EOM_AT(q, 2)[h], c[3], t22[h])), FNMA(EOM_AT(w, 2)[h], (t12[h] * t25[h]), FMA(t19[h], t20[h], FMA(t24[h], (t4[h] * t25[h]), t21[h] * t23[h]))));
    pack t27; EACH t27[h] = t4[h] * t5[h];
    pack t28; EACH t28[h] = EOM_AT(v, 0)[h] * EOM_AT(v, 0)[h];
    EOM_FETCH(u, 1);
    pack t29; EACH t29[h] = EOM_AT(u, 1)[h] - FMA(p[11], (c3[h] * t5[h]), FNMA(t28[h], t20[h], FMA(t21[h], t27[h], t24[h] * t8[h])));
    pack t30; EACH t30[h] = FMA(p[6], EOM_AT(v, 2)[h], FMA(p[11], (s2[h] * c[5]), FMA(EOM_AT(w, 2)[h], (t4[h] * c[0]), FMA(t24[h], (t12[h] * c[0]), FNMA(t19[h], t27[h], -(t28[h] * t23[h]))))));
    EOM_FETCH(u, 2);
    pack t31; EACH t31[h] = FNMA(t29[h], t14[h], EOM_AT(u, 2)[h] - t30[h]);
    EOM_FETCH(u, 0);
    pack t32; EACH t32[h] = t18[h] * FMA(t17[h], t31[h], FNMA(t29[h], t11[h], EOM_AT(u, 0)[h] - EOM_AT(u, 1)[h] - t26[h]));
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = t32[h];
    pack t33; EACH t33[h] = FMA(t17[h], t32[h], t16[h] * t31[h]);
    EOM_FETCH(out, 2);
    EACH EOM_AT(out, 2)[h] = t33[h];
    EOM_FETCH(out, 1);
    EACH EOM_AT(out, 1)[h] = FMA(t29[h], t10[h], FNMA(t14[h], t33[h], -(t11[h] * t32[h])));
}

/* ---- inverse_dynamics ----
 * inputs u that give the accelerations a
 * (3),(3),(3),(1,3),(12)->(3)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(inverse_dynamics_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = p[7] * p[9];
    pack t1; EACH t1[h] = p[8] * p[10];
    EACH c[0] = t0[h] + t1[h];
    EACH c[1] = FMA(p[9], t0[h], p[10] * t1[h]);
    pack t2; EACH t2[h] = p[7] + p[8];
    EACH c[2] = t2[h];
    pack t3; EACH t3[h] = p[0] * p[3];
    pack t4; EACH t4[h] = p[1] * p[4];
    pack t5; EACH t5[h] = p[2] * p[5];
    pack t6; EACH t6[h] = t3[h] + t4[h] + t5[h];
    EACH c[3] = t6[h];
    pack t7; EACH t7[h] = FMA(p[5], t5[h], FMA(p[3], t3[h], p[4] * t4[h]));
    EACH c[4] = t7[h];
    EACH c[5] = t2[h] + t6[h];
    EACH c[6] = t2[h] + t7[h];
}

#endif

EOM_LINKAGE void EOM_NAME(inverse_dynamics)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    const scalar *const a = in[2]; EOM_PLACE(a, 2);
    const scalar *const w = in[3]; EOM_PLACE(w, 3);
    EOM_PLACE(out, 4);
    EOM_FETCH(v, 1);
    pack t0; EACH t0[h] = EOM_AT(v, 1)[h] * EOM_AT(v, 1)[h];
    EOM_FETCH(q, 1);
    pack s1, c1; SINCOS_CALL(ANGLE(EOM_AT(q, 1)[h]), s1, c1);
    EOM_FETCH(q, 0);
    pack s2, c2; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s2, c2);
    pack t3; EACH t3[h] = FMA(c1[h], s2[h], -(c2[h] * s1[h]));
    EOM_FETCH(w, 0);
    pack t4; EACH t4[h] = EOM_AT(w, 0)[h] * c[0];
    EOM_FETCH(q, 2);
    pack t5; EACH t5[h] = EOM_AT(q, 2)[h] * t4[h];
    pack t6; EACH t6[h] = t3[h] * t5[h];
    EOM_FETCH(v, 0);
    EOM_FETCH(v, 2);
    pack t7; EACH t7[h] = K(2.0) * (EOM_AT(v, 0)[h] * EOM_AT(v, 2)[h]);
    pack t8; EACH t8[h] = EOM_AT(q, 2)[h] * c[4];
    pack t9; EACH t9[h] = EOM_AT(q, 2)[h] * c[2];
    pack t10; EACH t10[h] = t8[h] + t9[h];
    EOM_FETCH(w, 1);
    pack t11; EACH t11[h] = K(2.0) * (EOM_AT(v, 1)[h] * EOM_AT(w, 1)[h]);
    pack t12; EACH t12[h] = FMA(c2[h], c1[h], s2[h] * s1[h]);
    pack t13; EACH t13[h] = EOM_AT(q, 2)[h] * c[0];
    EOM_FETCH(w, 2);
    pack t14; EACH t14[h] = FMA(p[11], (c2[h] * FMA(EOM_AT(q, 2)[h], c[3], t9[h])), FNMA(EOM_AT(w, 2)[h], (t3[h] * t13[h]), FMA(t0[h], t6[h], FMA(t11[h], (t12[h] * t13[h]), t7[h] * t10[h]))));
    pack t15; EACH t15[h] = t12[h] * t5[h];
    EOM_FETCH(a, 1);
    EOM_FETCH(a, 0);
    pack t16; EACH t16[h] = t14[h] + FMA(EOM_AT(a, 1)[h], t15[h], EOM_AT(a, 0)[h] * FMA(EOM_AT(q, 2)[h], t8[h], c[2] * (EOM_AT(q, 2)[h] * EOM_AT(q, 2)[h])));
    pack t17; EACH t17[h] = t12[h] * t4[h];
    pack t18; EACH t18[h] = EOM_AT(w, 0)[h] * c[1];
    pack t19; EACH t19[h] = EOM_AT(v, 0)[h] * EOM_AT(v, 0)[h];
    pack t20; EACH t20[h] = t3[h] * t4[h];
    EOM_FETCH(a, 2);
    pack t21; EACH t21[h] = FMA(p[11], (c1[h] * t4[h]), FNMA(t19[h], t6[h], FMA(t7[h], t17[h], t11[h] * t18[h]))) + FMA(EOM_AT(a, 2)[h], t20[h], FMA(EOM_AT(a, 0)[h], t15[h], EOM_AT(a, 1)[h] * (EOM_AT(w, 0)[h] * t18[h])));
    EOM_FETCH(out, 1);
    EACH EOM_AT(out, 1)[h] = t21[h];
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = t16[h] + t21[h];
    pack t22; EACH t22[h] = FMA(p[6], EOM_AT(v, 2)[h], FMA(p[11], (s2[h] * c[5]), FMA(EOM_AT(w, 2)[h], (t12[h] * c[0]), FMA(t11[h], (t3[h] * c[0]), FNMA(t0[h], t17[h], -(t19[h] * t10[h]))))));
    EOM_FETCH(out, 2);
    EACH EOM_AT(out, 2)[h] = t22[h] + FMA(EOM_AT(a, 1)[h], t20[h], EOM_AT(a, 2)[h] * c[6]);
}

/* ---- mass_matrix ----
 * mass matrix M of M a + h = Q(u)
 * (3),(1,3),(12)->(3,3)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(mass_matrix_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = p[7] * p[9];
    pack t1; EACH t1[h] = p[8] * p[10];
    EACH c[0] = t0[h] + t1[h];
    EACH c[1] = FMA(p[9], t0[h], p[10] * t1[h]);
    pack t2; EACH t2[h] = p[7] + p[8];
    EACH c[2] = t2[h];
    pack t3; EACH t3[h] = FMA(p[5], (p[2] * p[5]), FMA(p[3], (p[0] * p[3]), p[4] * (p[1] * p[4])));
    EACH c[3] = t3[h];
    EACH c[4] = t2[h] + t3[h];
}

#endif

EOM_LINKAGE void EOM_NAME(mass_matrix)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const w = in[1]; EOM_PLACE(w, 1);
    EOM_PLACE(out, 2);
    EOM_FETCH(out, 0);
    EOM_FETCH(q, 2);
    EACH EOM_AT(out, 0)[h] = FMA(EOM_AT(q, 2)[h], (EOM_AT(q, 2)[h] * c[3]), c[2] * (EOM_AT(q, 2)[h] * EOM_AT(q, 2)[h]));
    EOM_FETCH(q, 0);
    pack s0, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s0, c0);
    EOM_FETCH(q, 1);
    pack s1, c1; SINCOS_CALL(ANGLE(EOM_AT(q, 1)[h]), s1, c1);
    EOM_FETCH(w, 0);
    pack t2; EACH t2[h] = EOM_AT(w, 0)[h] * c[0];
    pack t3; EACH t3[h] = FMA(c0[h], c1[h], s0[h] * s1[h]) * (EOM_AT(q, 2)[h] * t2[h]);
    EOM_FETCH(out, 1);
    EACH EOM_AT(out, 1)[h] = t3[h];
    EOM_FETCH(out, 3);
    EACH EOM_AT(out, 3)[h] = t3[h];
    EOM_FETCH(out, 4);
    EACH EOM_AT(out, 4)[h] = EOM_AT(w, 0)[h] * (EOM_AT(w, 0)[h] * c[1]);
    pack t4; EACH t4[h] = FMA(c1[h], s0[h], -(c0[h] * s1[h])) * t2[h];
    EOM_FETCH(out, 5);
    EACH EOM_AT(out, 5)[h] = t4[h];
    EOM_FETCH(out, 7);
    EACH EOM_AT(out, 7)[h] = t4[h];
    EOM_FETCH(out, 2);
    EACH EOM_AT(out, 2)[h] = R(K(0.0));
    EOM_FETCH(out, 6);
    EACH EOM_AT(out, 6)[h] = R(K(0.0));
    EOM_FETCH(out, 8);
    EACH EOM_AT(out, 8)[h] = R(c[4]);
}

/* ---- bias ----
 * bias h: M a + h = Q(u)
 * (3),(3),(1,3),(12)->(3)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(bias_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = p[7] * p[9];
    pack t1; EACH t1[h] = p[8] * p[10];
    EACH c[0] = t0[h] + t1[h];
    EACH c[1] = FMA(p[9], t0[h], p[10] * t1[h]);
    pack t2; EACH t2[h] = p[7] + p[8];
    EACH c[2] = t2[h];
    pack t3; EACH t3[h] = p[0] * p[3];
    pack t4; EACH t4[h] = p[1] * p[4];
    pack t5; EACH t5[h] = p[2] * p[5];
    pack t6; EACH t6[h] = t3[h] + t4[h] + t5[h];
    EACH c[3] = t6[h];
    EACH c[4] = FMA(p[5], t5[h], FMA(p[3], t3[h], p[4] * t4[h]));
    EACH c[5] = t2[h] + t6[h];
}

#endif

EOM_LINKAGE void EOM_NAME(bias)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    const scalar *const w = in[2]; EOM_PLACE(w, 2);
    EOM_PLACE(out, 3);
    EOM_FETCH(v, 1);
    pack t0; EACH t0[h] = EOM_AT(v, 1)[h] * EOM_AT(v, 1)[h];
    EOM_FETCH(q, 1);
    pack s1, c1; SINCOS_CALL(ANGLE(EOM_AT(q, 1)[h]), s1, c1);
    EOM_FETCH(q, 0);
    pack s2, c2; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s2, c2);
    pack t3; EACH t3[h] = FMA(c1[h], s2[h], -(c2[h] * s1[h]));
    EOM_FETCH(w, 0);
    pack t4; EACH t4[h] = EOM_AT(w, 0)[h] * c[0];
    EOM_FETCH(q, 2);
    pack t5; EACH t5[h] = t3[h] * (EOM_AT(q, 2)[h] * t4[h]);
    EOM_FETCH(v, 0);
    EOM_FETCH(v, 2);
    pack t6; EACH t6[h] = K(2.0) * (EOM_AT(v, 0)[h] * EOM_AT(v, 2)[h]);
    pack t7; EACH t7[h] = EOM_AT(q, 2)[h] * c[2];
    pack t8; EACH t8[h] = FMA(EOM_AT(q, 2)[h], c[4], t7[h]);
    EOM_FETCH(w, 1);
    pack t9; EACH t9[h] = K(2.0) * (EOM_AT(v, 1)[h] * EOM_AT(w, 1)[h]);
    pack t10; EACH t10[h] = FMA(c2[h], c1[h], s2[h] * s1[h]);
    pack t11; EACH t11[h] = EOM_AT(q, 2)[h] * c[0];
    EOM_FETCH(w, 2);
    pack t12; EACH t12[h] = FMA(p[11], (c2[h] * FMA(EOM_AT(q, 2)[h], c[3], t7[h])), FNMA(EOM_AT(w, 2)[h], (t3[h] * t11[h]), FMA(t0[h], t5[h], FMA(t9[h], (t10[h] * t11[h]), t6[h] * t8[h]))));
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = t12[h];
    pack t13; EACH t13[h] = t10[h] * t4[h];
    pack t14; EACH t14[h] = EOM_AT(v, 0)[h] * EOM_AT(v, 0)[h];
    EOM_FETCH(out, 1);
    EACH EOM_AT(out, 1)[h] = FMA(p[11], (c1[h] * t4[h]), FNMA(t14[h], t5[h], FMA(t6[h], t13[h], t9[h] * (EOM_AT(w, 0)[h] * c[1]))));
    pack t15; EACH t15[h] = FMA(p[6], EOM_AT(v, 2)[h], FMA(p[11], (s2[h] * c[5]), FMA(EOM_AT(w, 2)[h], (t10[h] * c[0]), FMA(t9[h], (t3[h] * c[0]), FNMA(t0[h], t13[h], -(t14[h] * t8[h]))))));
    EOM_FETCH(out, 2);
    EACH EOM_AT(out, 2)[h] = t15[h];
}

/* ---- energy ----
 * kinetic and potential energy, J
 * (3),(3),(1,3),(12)->(2)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(energy_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = p[7] * p[9];
    pack t1; EACH t1[h] = p[8] * p[10];
    EACH c[0] = t0[h] + t1[h];
    EACH c[1] = FMA(p[9], t0[h], p[10] * t1[h]);
    pack t2; EACH t2[h] = p[7] + p[8];
    EACH c[2] = t2[h];
    pack t3; EACH t3[h] = p[0] * p[3];
    pack t4; EACH t4[h] = p[1] * p[4];
    pack t5; EACH t5[h] = p[2] * p[5];
    EACH c[3] = t3[h] + t4[h] + t5[h];
    pack t6; EACH t6[h] = FMA(p[5], t5[h], FMA(p[3], t3[h], p[4] * t4[h]));
    EACH c[4] = t6[h];
    EACH c[5] = t2[h] + t6[h];
}

#endif

EOM_LINKAGE void EOM_NAME(energy)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    const scalar *const w = in[2]; EOM_PLACE(w, 2);
    EOM_PLACE(out, 3);
    EOM_FETCH(q, 0);
    pack s0, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s0, c0);
    EOM_FETCH(q, 1);
    pack s1, c1; SINCOS_CALL(ANGLE(EOM_AT(q, 1)[h]), s1, c1);
    pack t2; EACH t2[h] = FMA(c0[h], c1[h], s0[h] * s1[h]);
    EOM_FETCH(w, 0);
    pack t3; EACH t3[h] = EOM_AT(w, 0)[h] * c[0];
    EOM_FETCH(q, 2);
    pack t4; EACH t4[h] = t2[h] * (EOM_AT(q, 2)[h] * t3[h]);
    pack t5; EACH t5[h] = FMA(c1[h], s0[h], -(c0[h] * s1[h]));
    EOM_FETCH(w, 1);
    EOM_FETCH(v, 1);
    EOM_FETCH(v, 0);
    pack t6; EACH t6[h] = FNMA(K(2.0), (EOM_AT(w, 1)[h] * (t5[h] * (EOM_AT(q, 2)[h] * c[0]))), FMA(EOM_AT(v, 1)[h], t4[h], EOM_AT(v, 0)[h] * FMA(EOM_AT(q, 2)[h], (EOM_AT(q, 2)[h] * c[4]), c[2] * (EOM_AT(q, 2)[h] * EOM_AT(q, 2)[h]))));
    pack t7; EACH t7[h] = t2[h] * c[0];
    EOM_FETCH(v, 2);
    pack t8; EACH t8[h] = EOM_AT(v, 1)[h] * FMA(K(2.0), (EOM_AT(v, 2)[h] * (t5[h] * t3[h])), FMA(EOM_AT(v, 0)[h], t4[h], EOM_AT(v, 1)[h] * (EOM_AT(w, 0)[h] * (EOM_AT(w, 0)[h] * c[1]))));
    pack t9; EACH t9[h] = FMA(EOM_AT(w, 1)[h], FMA(EOM_AT(v, 2)[h], t7[h], EOM_AT(w, 1)[h] * c[1]), FMA(EOM_AT(v, 0)[h], t6[h], EOM_AT(v, 2)[h] * FMA(EOM_AT(w, 1)[h], t7[h], EOM_AT(v, 2)[h] * c[5])) + t8[h]);
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = K(0.5) * t9[h];
    EOM_FETCH(out, 1);
    EACH EOM_AT(out, 1)[h] = p[11] * FMA(s0[h], FMA(EOM_AT(q, 2)[h], c[3], EOM_AT(q, 2)[h] * c[2]), s1[h] * t3[h]);
}

/* ---- prescribed_forces ----
 * forces along the prescribed lengths, N
 * (3),(3),(3),(1,3),(12)->(1)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(prescribed_forces_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = p[7] * p[9];
    pack t1; EACH t1[h] = p[8] * p[10];
    EACH c[0] = t0[h] + t1[h];
    EACH c[1] = FMA(p[9], t0[h], p[10] * t1[h]);
}

#endif

EOM_LINKAGE void EOM_NAME(prescribed_forces)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    const scalar *const a = in[2]; EOM_PLACE(a, 2);
    const scalar *const w = in[3]; EOM_PLACE(w, 3);
    EOM_PLACE(out, 4);
    EOM_FETCH(q, 0);
    pack s0, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s0, c0);
    EOM_FETCH(q, 1);
    pack s1, c1; SINCOS_CALL(ANGLE(EOM_AT(q, 1)[h]), s1, c1);
    pack t2; EACH t2[h] = FMA(c0[h], c1[h], s0[h] * s1[h]);
    pack t3; EACH t3[h] = FMA(c1[h], s0[h], -(c0[h] * s1[h]));
    EOM_FETCH(q, 2);
    pack t4; EACH t4[h] = EOM_AT(q, 2)[h] * c[0];
    EOM_FETCH(a, 2);
    EOM_FETCH(a, 0);
    EOM_FETCH(w, 2);
    EOM_FETCH(v, 0);
    EOM_FETCH(v, 2);
    EOM_FETCH(v, 1);
    EOM_FETCH(w, 0);
    pack t5; EACH t5[h] = FMA(EOM_AT(a, 2)[h], (t2[h] * c[0]), -(EOM_AT(a, 0)[h] * (t3[h] * t4[h]))) + FMA(EOM_AT(w, 2)[h], c[1], FNMA(K(2.0) * (EOM_AT(v, 0)[h] * EOM_AT(v, 2)[h]), (t3[h] * c[0]), FNMA(EOM_AT(v, 0)[h] * EOM_AT(v, 0)[h], (t2[h] * t4[h]), -(EOM_AT(v, 1)[h] * EOM_AT(v, 1)[h] * (EOM_AT(w, 0)[h] * c[1])))));
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = FMA(p[11], (s1[h] * c[0]), t5[h]);
}

/* ---- joints ----
 * far-end position of every link, m
 * (3),(1,3),(12)->(2,2)
 */
#undef STREAMS
#define STREAMS 1
EOM_LINKAGE void EOM_NAME(joints)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const w = in[1]; EOM_PLACE(w, 1);
    EOM_PLACE(out, 2);
    EOM_FETCH(q, 0);
    pack s0, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s0, c0);
    EOM_FETCH(q, 2);
    pack t1; EACH t1[h] = EOM_AT(q, 2)[h] * c0[h];
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = t1[h];
    pack t2; EACH t2[h] = EOM_AT(q, 2)[h] * s0[h];
    EOM_FETCH(out, 1);
    EACH EOM_AT(out, 1)[h] = t2[h];
    EOM_FETCH(q, 1);
    pack s3, c3; SINCOS_CALL(ANGLE(EOM_AT(q, 1)[h]), s3, c3);
    EOM_FETCH(out, 2);
    EOM_FETCH(w, 0);
    EACH EOM_AT(out, 2)[h] = FMA(EOM_AT(w, 0)[h], c3[h], t1[h]);
    EOM_FETCH(out, 3);
    EACH EOM_AT(out, 3)[h] = FMA(EOM_AT(w, 0)[h], s3[h], t2[h]);
}
