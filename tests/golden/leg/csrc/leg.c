/* leg: equations of motion by the matrix method (eomgen VERSION)
 *
 * The kernels of every type, the table through which eomgen_batch.c finds them, and the functions of leg.h.
 */
#include "leg.h"

#include "eomgen_model.h"
#include "eomgen_real.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wpsabi"

#ifndef EOM_PART
#define EOM_PART 0 /* everything; 1: the scalars, the table and the functions, 2: the vectors, to be linked with 1 */
#endif
#if EOM_PART == 2
#define EOM_LINKAGE EOM_APART
#else
#define EOM_LINKAGE static EOM_APART
#endif

#if EOM_PART != 2
#define EOM_REAL f64
#define scalar eom_f64
#define EOM_SCALAR_TEXT 1
#include "leg_kernels.h"
#undef scalar
#undef STREAMS
#undef EOM_SCALAR_TEXT
#undef EOM_REAL
#endif

#if EOM_PART != 1
#define EOM_REAL f64v
#define scalar eom_f64
#define EOM_SCALAR_TEXT 0
#include "leg_kernels.h"
#undef scalar
#undef STREAMS
#undef EOM_SCALAR_TEXT
#undef EOM_REAL
#endif

#if EOM_PART == 1
void forward_dynamics_f64v(void);
void inverse_dynamics_f64v(void);
void mass_matrix_f64v(void);
void bias_f64v(void);
void energy_f64v(void);
void prescribed_forces_f64v(void);
void joints_f64v(void);
#endif
#if EOM_PART != 2
static const int forward_dynamics_rows[] = {3, 3, 3, 1, 12, 3};
static const int forward_dynamics_columns[] = {0, 0, 0, 3, 0, 0};
static const int inverse_dynamics_rows[] = {3, 3, 3, 1, 12, 3};
static const int inverse_dynamics_columns[] = {0, 0, 0, 3, 0, 0};
static const int mass_matrix_rows[] = {3, 1, 12, 3};
static const int mass_matrix_columns[] = {0, 3, 0, 3};
static const int bias_rows[] = {3, 3, 1, 12, 3};
static const int bias_columns[] = {0, 0, 3, 0, 0};
static const int energy_rows[] = {3, 3, 1, 12, 2};
static const int energy_columns[] = {0, 0, 3, 0, 0};
static const int prescribed_forces_rows[] = {3, 3, 3, 1, 12, 1};
static const int prescribed_forces_columns[] = {0, 0, 0, 3, 0, 0};
static const int joints_rows[] = {3, 1, 12, 2};
static const int joints_columns[] = {0, 3, 0, 2};

#define EOM_CAST(kernel) ((void (*)(void))(kernel))

const eom_function eom_functions[] = {
    {"forward_dynamics", "(3),(3),(3),(1,3),(12)->(3)",
     "forward_dynamics(q, v, u, w, p)\n\n"
     "Accelerations a of M a + h = Q(u).\n\n"
     "q (..., 3), v (..., 3), u (..., 3), w (..., 1, 3), p (..., 12) -> (..., 3); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     "(3),(3),(t,3),(t,1,3),(12),(),(o)->(t,3),(t,3)",
     4, 1, forward_dynamics_rows, forward_dynamics_columns, 7, 0, 2,
     {EOM_CAST(forward_dynamics_constants_f64), EOM_CAST(forward_dynamics_f64), EOM_CAST(forward_dynamics_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"inverse_dynamics", "(3),(3),(3),(1,3),(12)->(3)",
     "inverse_dynamics(q, v, a, w, p)\n\n"
     "Inputs u that give the accelerations a.\n\n"
     "q (..., 3), v (..., 3), a (..., 3), w (..., 1, 3), p (..., 12) -> (..., 3); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     4, 1, inverse_dynamics_rows, inverse_dynamics_columns, 7, 0, 1,
     {EOM_CAST(inverse_dynamics_constants_f64), EOM_CAST(inverse_dynamics_f64), EOM_CAST(inverse_dynamics_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"mass_matrix", "(3),(1,3),(12)->(3,3)",
     "mass_matrix(q, w, p)\n\n"
     "Mass matrix M of M a + h = Q(u).\n\n"
     "q (..., 3), w (..., 1, 3), p (..., 12) -> (..., 3, 3); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     2, 1, mass_matrix_rows, mass_matrix_columns, 5, 0, 1,
     {EOM_CAST(mass_matrix_constants_f64), EOM_CAST(mass_matrix_f64), EOM_CAST(mass_matrix_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"bias", "(3),(3),(1,3),(12)->(3)",
     "bias(q, v, w, p)\n\n"
     "Bias h: M a + h = Q(u).\n\n"
     "q (..., 3), v (..., 3), w (..., 1, 3), p (..., 12) -> (..., 3); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     3, 1, bias_rows, bias_columns, 6, 0, 1,
     {EOM_CAST(bias_constants_f64), EOM_CAST(bias_f64), EOM_CAST(bias_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"energy", "(3),(3),(1,3),(12)->(2)",
     "energy(q, v, w, p)\n\n"
     "Kinetic and potential energy, J.\n\n"
     "q (..., 3), v (..., 3), w (..., 1, 3), p (..., 12) -> (..., 2); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     3, 1, energy_rows, energy_columns, 6, 0, 1,
     {EOM_CAST(energy_constants_f64), EOM_CAST(energy_f64), EOM_CAST(energy_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"prescribed_forces", "(3),(3),(3),(1,3),(12)->(1)",
     "prescribed_forces(q, v, a, w, p)\n\n"
     "Forces along the prescribed lengths, N.\n\n"
     "q (..., 3), v (..., 3), a (..., 3), w (..., 1, 3), p (..., 12) -> (..., 1); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     4, 1, prescribed_forces_rows, prescribed_forces_columns, 2, 0, 1,
     {EOM_CAST(prescribed_forces_constants_f64), EOM_CAST(prescribed_forces_f64), EOM_CAST(prescribed_forces_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"joints", "(3),(1,3),(12)->(2,2)",
     "joints(q, w, p)\n\n"
     "Far-end position of every link, m.\n\n"
     "q (..., 3), w (..., 1, 3), p (..., 12) -> (..., 2, 2); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     2, 1, joints_rows, joints_columns, 0, 0, 1,
     {0, EOM_CAST(joints_f64), EOM_CAST(joints_f64v)}, {0, 0, 0}, {0, 0, 0}},
};
const int eom_function_count = sizeof eom_functions / sizeof eom_functions[0];

const double leg_p[12] = {
    699999999999999955591079e-24, 1.5, 699999999999999955591079e-24, 0.0, 594999999999999973354647e-24, 1.0,
    3.0, 2.0, 1.0, 0.5, 1.0, 981000000000000049737992e-23
};

void leg_forward_dynamics(const double *q, const double *v, const double *u, const double *w, const double *p, double *out)
{
    const double *in[] = {q, v, u, w};
    double c[7], work[1];
    forward_dynamics_constants_f64(p, (void *)c);
    forward_dynamics_f64(in, 0, p, (void *)c, out, (void *)work);
}

void leg_forward_dynamics_batch(size_t states, const double *q, const double *v, const double *u, const double *w, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)u, (char *)w, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {24, 24, 24, 24, 0, 24, 8, 8, 8, 24, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[0]);
}

void leg_inverse_dynamics(const double *q, const double *v, const double *a, const double *w, const double *p, double *out)
{
    const double *in[] = {q, v, a, w};
    double c[7], work[1];
    inverse_dynamics_constants_f64(p, (void *)c);
    inverse_dynamics_f64(in, 0, p, (void *)c, out, (void *)work);
}

void leg_inverse_dynamics_batch(size_t states, const double *q, const double *v, const double *a, const double *w, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)a, (char *)w, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {24, 24, 24, 24, 0, 24, 8, 8, 8, 24, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[1]);
}

void leg_mass_matrix(const double *q, const double *w, const double *p, double *out)
{
    const double *in[] = {q, w};
    double c[5], work[1];
    mass_matrix_constants_f64(p, (void *)c);
    mass_matrix_f64(in, 0, p, (void *)c, out, (void *)work);
}

void leg_mass_matrix_batch(size_t states, const double *q, const double *w, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)w, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {24, 24, 0, 72, 8, 24, 8, 8, 24, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[2]);
}

void leg_bias(const double *q, const double *v, const double *w, const double *p, double *out)
{
    const double *in[] = {q, v, w};
    double c[6], work[1];
    bias_constants_f64(p, (void *)c);
    bias_f64(in, 0, p, (void *)c, out, (void *)work);
}

void leg_bias_batch(size_t states, const double *q, const double *v, const double *w, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)w, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {24, 24, 24, 0, 24, 8, 8, 24, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[3]);
}

void leg_energy(const double *q, const double *v, const double *w, const double *p, double *out)
{
    const double *in[] = {q, v, w};
    double c[6], work[1];
    energy_constants_f64(p, (void *)c);
    energy_f64(in, 0, p, (void *)c, out, (void *)work);
}

void leg_energy_batch(size_t states, const double *q, const double *v, const double *w, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)w, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {24, 24, 24, 0, 16, 8, 8, 24, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[4]);
}

void leg_prescribed_forces(const double *q, const double *v, const double *a, const double *w, const double *p, double *out)
{
    const double *in[] = {q, v, a, w};
    double c[2], work[1];
    prescribed_forces_constants_f64(p, (void *)c);
    prescribed_forces_f64(in, 0, p, (void *)c, out, (void *)work);
}

void leg_prescribed_forces_batch(size_t states, const double *q, const double *v, const double *a, const double *w, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)a, (char *)w, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {24, 24, 24, 24, 0, 8, 8, 8, 8, 24, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[5]);
}

void leg_joints(const double *q, const double *w, const double *p, double *out)
{
    const double *in[] = {q, w};
    double c[1] = {0}, work[1];

    joints_f64(in, 0, p, (void *)c, out, (void *)work);
}

void leg_joints_batch(size_t states, const double *q, const double *w, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)w, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {24, 24, 0, 32, 8, 24, 8, 8, 16, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[6]);
}

#endif
