/* leg: equations of motion by the matrix method (eomgen VERSION)
 *
 * Plain C interface, for C11 or later; link leg.c and eomgen_batch.c (compile with -O2 -ffp-contract=off, no
 * -ffast-math). Arrays are row-major and must not overlap the result. The _batch functions run over `states` rows of
 * every argument but p, in vector lanes.
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
#ifndef LEG_EQUATIONS_H
#define LEG_EQUATIONS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The scene's own parameters. */
extern const double leg_p[12];

/* accelerations a of M a + h = Q(u); q 3, v 3, u 3, w 1x3, p 12, out 3 */
void leg_forward_dynamics(const double *q, const double *v, const double *u, const double *w, const double *p, double *out);
void leg_forward_dynamics_batch(size_t states, const double *q, const double *v, const double *u, const double *w, const double *p, double *out);
/* inputs u that give the accelerations a; q 3, v 3, a 3, w 1x3, p 12, out 3 */
void leg_inverse_dynamics(const double *q, const double *v, const double *a, const double *w, const double *p, double *out);
void leg_inverse_dynamics_batch(size_t states, const double *q, const double *v, const double *a, const double *w, const double *p, double *out);
/* mass matrix M of M a + h = Q(u); q 3, w 1x3, p 12, out 3x3 */
void leg_mass_matrix(const double *q, const double *w, const double *p, double *out);
void leg_mass_matrix_batch(size_t states, const double *q, const double *w, const double *p, double *out);
/* bias h: M a + h = Q(u); q 3, v 3, w 1x3, p 12, out 3 */
void leg_bias(const double *q, const double *v, const double *w, const double *p, double *out);
void leg_bias_batch(size_t states, const double *q, const double *v, const double *w, const double *p, double *out);
/* kinetic and potential energy, J; q 3, v 3, w 1x3, p 12, out 2 */
void leg_energy(const double *q, const double *v, const double *w, const double *p, double *out);
void leg_energy_batch(size_t states, const double *q, const double *v, const double *w, const double *p, double *out);
/* forces along the prescribed lengths, N; q 3, v 3, a 3, w 1x3, p 12, out 1 */
void leg_prescribed_forces(const double *q, const double *v, const double *a, const double *w, const double *p, double *out);
void leg_prescribed_forces_batch(size_t states, const double *q, const double *v, const double *a, const double *w, const double *p, double *out);
/* far-end position of every link, m; q 3, w 1x3, p 12, out 2x2 */
void leg_joints(const double *q, const double *w, const double *p, double *out);
void leg_joints_batch(size_t states, const double *q, const double *w, const double *p, double *out);

#ifdef __cplusplus
}
#endif

#endif
