/* pendulum: equations of motion by the matrix method (eomgen VERSION)
 *
 * The kernels of every type, the table through which eomgen_batch.c finds them, and the functions of pendulum.h.
 */
#include "pendulum.h"

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
#include "pendulum_kernels.h"
#undef scalar
#undef STREAMS
#undef EOM_SCALAR_TEXT
#undef EOM_REAL
#endif

#if EOM_PART != 1
#define EOM_REAL f64v
#define scalar eom_f64
#define EOM_SCALAR_TEXT 0
#include "pendulum_kernels.h"
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
void joints_f64v(void);
#endif
#if EOM_PART != 2
static const int forward_dynamics_rows[] = {1, 1, 1, 5, 1};
static const int forward_dynamics_columns[] = {0, 0, 0, 0, 0};
static const int inverse_dynamics_rows[] = {1, 1, 1, 5, 1};
static const int inverse_dynamics_columns[] = {0, 0, 0, 0, 0};
static const int mass_matrix_rows[] = {1, 5, 1};
static const int mass_matrix_columns[] = {0, 0, 1};
static const int bias_rows[] = {1, 1, 5, 1};
static const int bias_columns[] = {0, 0, 0, 0};
static const int energy_rows[] = {1, 1, 5, 2};
static const int energy_columns[] = {0, 0, 0, 0};
static const int joints_rows[] = {1, 5, 1};
static const int joints_columns[] = {0, 0, 2};

#define EOM_CAST(kernel) ((void (*)(void))(kernel))

const eom_function eom_functions[] = {
    {"forward_dynamics", "(1),(1),(1),(5)->(1)",
     "forward_dynamics(q, v, u, p)\n\n"
     "Accelerations a of M a + h = Q(u).\n\n"
     "q (..., 1), v (..., 1), u (..., 1), p (..., 5) -> (..., 1); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     "(1),(1),(t,1),(5),(),(o)->(t,1),(t,1)",
     3, 1, forward_dynamics_rows, forward_dynamics_columns, 2, 0, 2,
     {EOM_CAST(forward_dynamics_constants_f64), EOM_CAST(forward_dynamics_f64), EOM_CAST(forward_dynamics_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"inverse_dynamics", "(1),(1),(1),(5)->(1)",
     "inverse_dynamics(q, v, a, p)\n\n"
     "Inputs u that give the accelerations a.\n\n"
     "q (..., 1), v (..., 1), a (..., 1), p (..., 5) -> (..., 1); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     3, 1, inverse_dynamics_rows, inverse_dynamics_columns, 2, 0, 1,
     {EOM_CAST(inverse_dynamics_constants_f64), EOM_CAST(inverse_dynamics_f64), EOM_CAST(inverse_dynamics_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"mass_matrix", "(1),(5)->(1,1)",
     "mass_matrix(q, p)\n\n"
     "Mass matrix M of M a + h = Q(u).\n\n"
     "q (..., 1), p (..., 5) -> (..., 1, 1); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     1, 1, mass_matrix_rows, mass_matrix_columns, 1, 0, 1,
     {EOM_CAST(mass_matrix_constants_f64), EOM_CAST(mass_matrix_f64), EOM_CAST(mass_matrix_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"bias", "(1),(1),(5)->(1)",
     "bias(q, v, p)\n\n"
     "Bias h: M a + h = Q(u).\n\n"
     "q (..., 1), v (..., 1), p (..., 5) -> (..., 1); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     2, 1, bias_rows, bias_columns, 1, 0, 1,
     {EOM_CAST(bias_constants_f64), EOM_CAST(bias_f64), EOM_CAST(bias_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"energy", "(1),(1),(5)->(2)",
     "energy(q, v, p)\n\n"
     "Kinetic and potential energy, J.\n\n"
     "q (..., 1), v (..., 1), p (..., 5) -> (..., 2); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     2, 1, energy_rows, energy_columns, 3, 0, 1,
     {EOM_CAST(energy_constants_f64), EOM_CAST(energy_f64), EOM_CAST(energy_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"joints", "(1),(5)->(1,2)",
     "joints(q, p)\n\n"
     "Far-end position of every link, m.\n\n"
     "q (..., 1), p (..., 5) -> (..., 1, 2); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     1, 1, joints_rows, joints_columns, 0, 0, 1,
     {0, EOM_CAST(joints_f64), EOM_CAST(joints_f64v)}, {0, 0, 0}, {0, 0, 0}},
};
const int eom_function_count = sizeof eom_functions / sizeof eom_functions[0];

const double pendulum_p[5] = {
    1.5, 800000000000000044408921e-24, 12.0, 0.25, 981000000000000049737992e-23
};

void pendulum_forward_dynamics(const double *q, const double *v, const double *u, const double *p, double *out)
{
    const double *in[] = {q, v, u};
    double c[2], work[1];
    forward_dynamics_constants_f64(p, (void *)c);
    forward_dynamics_f64(in, 0, p, (void *)c, out, (void *)work);
}

void pendulum_forward_dynamics_batch(size_t states, const double *q, const double *v, const double *u, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)u, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {8, 8, 8, 0, 8, 8, 8, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[0]);
}

void pendulum_inverse_dynamics(const double *q, const double *v, const double *a, const double *p, double *out)
{
    const double *in[] = {q, v, a};
    double c[2], work[1];
    inverse_dynamics_constants_f64(p, (void *)c);
    inverse_dynamics_f64(in, 0, p, (void *)c, out, (void *)work);
}

void pendulum_inverse_dynamics_batch(size_t states, const double *q, const double *v, const double *a, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)a, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {8, 8, 8, 0, 8, 8, 8, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[1]);
}

void pendulum_mass_matrix(const double *q, const double *p, double *out)
{
    const double *in[] = {q};
    double c[1], work[1];
    mass_matrix_constants_f64(p, (void *)c);
    mass_matrix_f64(in, 0, p, (void *)c, out, (void *)work);
}

void pendulum_mass_matrix_batch(size_t states, const double *q, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {8, 0, 8, 8, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[2]);
}

void pendulum_bias(const double *q, const double *v, const double *p, double *out)
{
    const double *in[] = {q, v};
    double c[1], work[1];
    bias_constants_f64(p, (void *)c);
    bias_f64(in, 0, p, (void *)c, out, (void *)work);
}

void pendulum_bias_batch(size_t states, const double *q, const double *v, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {8, 8, 0, 8, 8, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[3]);
}

void pendulum_energy(const double *q, const double *v, const double *p, double *out)
{
    const double *in[] = {q, v};
    double c[3], work[1];
    energy_constants_f64(p, (void *)c);
    energy_f64(in, 0, p, (void *)c, out, (void *)work);
}

void pendulum_energy_batch(size_t states, const double *q, const double *v, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {8, 8, 0, 16, 8, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[4]);
}

void pendulum_joints(const double *q, const double *p, double *out)
{
    const double *in[] = {q};
    double c[1] = {0}, work[1];

    joints_f64(in, 0, p, (void *)c, out, (void *)work);
}

void pendulum_joints_batch(size_t states, const double *q, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {8, 0, 16, 8, 8, 16, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[5]);
}

#endif
