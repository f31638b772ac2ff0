/* pendulum: equations of motion by the matrix method (eomgen VERSION)
 *
 * Plain C interface, for C11 or later; link pendulum.c and eomgen_batch.c (compile with -O2 -ffp-contract=off, no
 * -ffast-math). Arrays are row-major and must not overlap the result. The _batch functions run over `states` rows of
 * every argument but p, in vector lanes.
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
#ifndef PENDULUM_EQUATIONS_H
#define PENDULUM_EQUATIONS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The scene's own parameters. */
extern const double pendulum_p[5];

/* accelerations a of M a + h = Q(u); q 1, v 1, u 1, p 5, out 1 */
void pendulum_forward_dynamics(const double *q, const double *v, const double *u, const double *p, double *out);
void pendulum_forward_dynamics_batch(size_t states, const double *q, const double *v, const double *u, const double *p, double *out);
/* inputs u that give the accelerations a; q 1, v 1, a 1, p 5, out 1 */
void pendulum_inverse_dynamics(const double *q, const double *v, const double *a, const double *p, double *out);
void pendulum_inverse_dynamics_batch(size_t states, const double *q, const double *v, const double *a, const double *p, double *out);
/* mass matrix M of M a + h = Q(u); q 1, p 5, out 1x1 */
void pendulum_mass_matrix(const double *q, const double *p, double *out);
void pendulum_mass_matrix_batch(size_t states, const double *q, const double *p, double *out);
/* bias h: M a + h = Q(u); q 1, v 1, p 5, out 1 */
void pendulum_bias(const double *q, const double *v, const double *p, double *out);
void pendulum_bias_batch(size_t states, const double *q, const double *v, const double *p, double *out);
/* kinetic and potential energy, J; q 1, v 1, p 5, out 2 */
void pendulum_energy(const double *q, const double *v, const double *p, double *out);
void pendulum_energy_batch(size_t states, const double *q, const double *v, const double *p, double *out);
/* far-end position of every link, m; q 1, p 5, out 1x2 */
void pendulum_joints(const double *q, const double *p, double *out);
void pendulum_joints_batch(size_t states, const double *q, const double *p, double *out);

#ifdef __cplusplus
}
#endif

#endif
