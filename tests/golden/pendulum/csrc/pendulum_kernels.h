/* pendulum: equations of motion by the matrix method (eomgen VERSION)
 *
 * The equations, as one text for every type: pendulum.c includes it once for each. `real` is a scalar or a vector of
 * lanes (a lane is a state), `scalar` its element. EOM_AT(q, i) is STREAMS reals: element i of an argument or result.
 * Every value between is a `pack` of as many, and EACH statement computes its reals side by side.
 *
 * q[0]  rod.angle (rad)
 * v[0]  rod.angle_rate (rad/s)
 * a[0]  rod.angle_acceleration (rad/s^2)
 * u[0]  rod.torque (N m)
 * p[0]  rod.mass (kg)
 * p[1]  rod.length (m)
 * p[2]  rod.joint_stiffness (N m/rad)
 * p[3]  rod.joint_rest_angle (rad)
 * p[4]  gravity (m/s^2)
 */
#include "eomgen_kernels_standard.h"

/* ---- forward_dynamics ----
 * accelerations a of M a + h = Q(u)
 * (1),(1),(1),(5)->(1)
 */
#undef STREAMS
#define STREAMS EOM_WIDE
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(forward_dynamics_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = K(0.5) * p[1];
    pack t1; EACH t1[h] = p[0] * t0[h];
    EACH c[0] = t1[h];
    pack t2; EACH t2[h] = FMA(t0[h], t1[h], p[1] * (p[0] * p[1]) / K(12.0));
    pack t3; EACH t3[h] = PIVOT_INVERSE(t2[h], t2[h]);
    EACH c[1] = t3[h];
}

#endif

EOM_LINKAGE void EOM_NAME(forward_dynamics)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const u = in[2]; EOM_PLACE(u, 2);
    EOM_PLACE(out, 3);
    EOM_FETCH(q, 0);
    pack c0_sin, c0; SINCOS(ANGLE(EOM_AT(q, 0)[h]), c0_sin, c0);
    EOM_FETCH(out, 0);
    EOM_FETCH(u, 0);
    EACH EOM_AT(out, 0)[h] = (EOM_AT(u, 0)[h] - FMA(p[4], (c[0] * c0[h]), p[2] * (EOM_AT(q, 0)[h] - p[3]))) * c[1];
}

/* ---- inverse_dynamics ----
 * inputs u that give the accelerations a
 * (1),(1),(1),(5)->(1)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(inverse_dynamics_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = K(0.5) * p[1];
    pack t1; EACH t1[h] = p[0] * t0[h];
    EACH c[0] = t1[h];
    EACH c[1] = FMA(t0[h], t1[h], p[1] * (p[0] * p[1]) / K(12.0));
}

#endif

EOM_LINKAGE void EOM_NAME(inverse_dynamics)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const a = in[2]; EOM_PLACE(a, 2);
    EOM_PLACE(out, 3);
    EOM_FETCH(q, 0);
    pack c0_sin, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), c0_sin, c0);
    EOM_FETCH(out, 0);
    EOM_FETCH(a, 0);
    EACH EOM_AT(out, 0)[h] = FMA(EOM_AT(a, 0)[h], c[1], FMA(p[4], (c[0] * c0[h]), p[2] * (EOM_AT(q, 0)[h] - p[3])));
}

/* ---- mass_matrix ----
 * mass matrix M of M a + h = Q(u)
 * (1),(5)->(1,1)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(mass_matrix_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = K(0.5) * p[1];
    EACH c[0] = FMA(t0[h], (p[0] * t0[h]), p[1] * (p[0] * p[1]) / K(12.0));
}

#endif

EOM_LINKAGE void EOM_NAME(mass_matrix)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    EOM_PLACE(out, 1);
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = R(c[0]);
}

/* ---- bias ----
 * bias h: M a + h = Q(u)
 * (1),(1),(5)->(1)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(bias_constants)(const scalar *p, scalar *restrict c)
{
    EACH c[0] = p[0] * (K(0.5) * p[1]);
}

#endif

EOM_LINKAGE void EOM_NAME(bias)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    EOM_PLACE(out, 2);
    EOM_FETCH(q, 0);
    pack c0_sin, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), c0_sin, c0);
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = FMA(p[4], (c[0] * c0[h]), p[2] * (EOM_AT(q, 0)[h] - p[3]));
}

/* ---- energy ----
 * kinetic and potential energy, J
 * (1),(1),(5)->(2)
 */
#undef STREAMS
#define STREAMS 1
#if EOM_SCALAR_TEXT

EOM_LINKAGE void EOM_NAME(energy_constants)(const scalar *p, scalar *restrict c)
{
    pack t0; EACH t0[h] = K(0.5) * p[1];
    pack t1; EACH t1[h] = p[0] * t0[h];
    EACH c[0] = t1[h];
    EACH c[1] = FMA(t0[h], t1[h], p[1] * (p[0] * p[1]) / K(12.0));
    EACH c[2] = K(0.5) * p[2];
}

#endif

EOM_LINKAGE void EOM_NAME(energy)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    const scalar *const v = in[1]; EOM_PLACE(v, 1);
    EOM_PLACE(out, 2);
    EOM_FETCH(out, 0);
    EOM_FETCH(v, 0);
    EACH EOM_AT(out, 0)[h] = K(0.5) * (EOM_AT(v, 0)[h] * (EOM_AT(v, 0)[h] * c[1]));
    EOM_FETCH(q, 0);
    pack s0, s0_cos; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s0, s0_cos);
    pack t1; EACH t1[h] = EOM_AT(q, 0)[h] - p[3];
    EOM_FETCH(out, 1);
    EACH EOM_AT(out, 1)[h] = FMA(p[4], (c[0] * s0[h]), c[2] * (t1[h] * t1[h]));
}

/* ---- joints ----
 * far-end position of every link, m
 * (1),(5)->(1,2)
 */
#undef STREAMS
#define STREAMS 1
EOM_LINKAGE void EOM_NAME(joints)(const scalar *const *in, const eom_place *places, const scalar *p, const scalar *c, scalar *restrict out, pack *restrict work)
{
    const scalar *const q = in[0]; EOM_PLACE(q, 0);
    EOM_PLACE(out, 1);
    EOM_FETCH(q, 0);
    pack s0, c0; SINCOS_CALL(ANGLE(EOM_AT(q, 0)[h]), s0, c0);
    EOM_FETCH(out, 0);
    EACH EOM_AT(out, 0)[h] = p[1] * c0[h];
    EOM_FETCH(out, 1);
    EACH EOM_AT(out, 1)[h] = p[1] * s0[h];
}
