/* chain4: equations of motion by the articulated method (eomgen VERSION)
 *
 * Plain C interface, for C11 or later; link chain4.c and eomgen_batch.c (compile with -O2 -ffp-contract=off, no
 * -ffast-math). Arrays are row-major and must not overlap the result. The _batch functions run over `states` rows of
 * every argument but p, in vector lanes.
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
#ifndef CHAIN4_EQUATIONS_H
#define CHAIN4_EQUATIONS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The scene's own parameters. */
extern const double chain4_p[25];

/* accelerations a of M a + h = Q(u); q 8, v 8, u 8, p 25, out 8 */
void chain4_forward_dynamics(const double *q, const double *v, const double *u, const double *p, double *out);
void chain4_forward_dynamics_batch(size_t states, const double *q, const double *v, const double *u, const double *p, double *out);
/* mass matrix M of M a + h = Q(u); q 8, p 25, out 8x8 */
void chain4_mass_matrix(const double *q, const double *p, double *out);
void chain4_mass_matrix_batch(size_t states, const double *q, const double *p, double *out);
/* kinetic and potential energy, J; q 8, v 8, p 25, out 2 */
void chain4_energy(const double *q, const double *v, const double *p, double *out);
void chain4_energy_batch(size_t states, const double *q, const double *v, const double *p, double *out);

#ifdef __cplusplus
}
#endif

#endif
