/* chain4: equations of motion by the articulated method (eomgen VERSION)
 *
 * The kernels of every type, the table through which eomgen_batch.c finds them, and the functions of chain4.h.
 */
#include "chain4.h"

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
#include "chain4_kernels.h"
#undef scalar
#undef STREAMS
#undef EOM_SCALAR_TEXT
#undef EOM_REAL
#endif

#if EOM_PART != 1
#define EOM_REAL f64v
#define scalar eom_f64
#define EOM_SCALAR_TEXT 0
#include "chain4_kernels.h"
#undef scalar
#undef STREAMS
#undef EOM_SCALAR_TEXT
#undef EOM_REAL
#endif

#if EOM_PART == 1
void forward_dynamics_f64v(void);
void mass_matrix_f64v(void);
void energy_f64v(void);
#endif
#if EOM_PART != 2
static const int forward_dynamics_rows[] = {8, 8, 8, 25, 8};
static const int forward_dynamics_columns[] = {0, 0, 0, 0, 0};
static const int mass_matrix_rows[] = {8, 25, 8};
static const int mass_matrix_columns[] = {0, 0, 8};
static const int energy_rows[] = {8, 8, 25, 2};
static const int energy_columns[] = {0, 0, 0, 0};

#define EOM_CAST(kernel) ((void (*)(void))(kernel))

const eom_function eom_functions[] = {
    {"forward_dynamics", "(8),(8),(8),(25)->(8)",
     "forward_dynamics(q, v, u, p)\n\n"
     "Accelerations a of M a + h = Q(u).\n\n"
     "q (..., 8), v (..., 8), u (..., 8), p (..., 25) -> (..., 8); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     "(8),(8),(t,8),(25),(),(o)->(t,8),(t,8)",
     3, 1, forward_dynamics_rows, forward_dynamics_columns, 15, 19, 2,
     {EOM_CAST(forward_dynamics_constants_f64), EOM_CAST(forward_dynamics_f64), EOM_CAST(forward_dynamics_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"mass_matrix", "(8),(25)->(8,8)",
     "mass_matrix(q, p)\n\n"
     "Mass matrix M of M a + h = Q(u).\n\n"
     "q (..., 8), p (..., 25) -> (..., 8, 8); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     1, 1, mass_matrix_rows, mass_matrix_columns, 18, 32, 1,
     {EOM_CAST(mass_matrix_constants_f64), EOM_CAST(mass_matrix_f64), EOM_CAST(mass_matrix_f64v)}, {0, 0, 0}, {0, 0, 0}},
    {"energy", "(8),(8),(25)->(2)",
     "energy(q, v, p)\n\n"
     "Kinetic and potential energy, J.\n\n"
     "q (..., 8), v (..., 8), p (..., 25) -> (..., 2); SI units and rad.\n\n"
     "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
     0,
     2, 1, energy_rows, energy_columns, 11, 5, 1,
     {EOM_CAST(energy_constants_f64), EOM_CAST(energy_f64), EOM_CAST(energy_f64v)}, {0, 0, 0}, {0, 0, 0}},
};
const int eom_function_count = sizeof eom_functions / sizeof eom_functions[0];

const double chain4_p[25] = {
    0.25, 0.5, 0.25, 0.0, 0.5, 1.0, 0.25, 0.5, 0.25, 0.0, 0.5, 1.0, 0.25, 0.5, 0.25, 0.0, 0.5, 1.0, 0.25, 0.5,
    0.25, 0.0, 0.5, 1.0, 981000000000000049737992e-23
};

void chain4_forward_dynamics(const double *q, const double *v, const double *u, const double *p, double *out)
{
    const double *in[] = {q, v, u};
    double c[15], work[19];
    forward_dynamics_constants_f64(p, (void *)c);
    forward_dynamics_f64(in, 0, p, (void *)c, out, (void *)work);
}

void chain4_forward_dynamics_batch(size_t states, const double *q, const double *v, const double *u, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)u, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {64, 64, 64, 0, 64, 8, 8, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[0]);
}

void chain4_mass_matrix(const double *q, const double *p, double *out)
{
    const double *in[] = {q};
    double c[18], work[32];
    mass_matrix_constants_f64(p, (void *)c);
    mass_matrix_f64(in, 0, p, (void *)c, out, (void *)work);
}

void chain4_mass_matrix_batch(size_t states, const double *q, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {64, 0, 512, 8, 8, 64, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[1]);
}

void chain4_energy(const double *q, const double *v, const double *p, double *out)
{
    const double *in[] = {q, v};
    double c[11], work[5];
    energy_constants_f64(p, (void *)c);
    energy_f64(in, 0, p, (void *)c, out, (void *)work);
}

void chain4_energy_batch(size_t states, const double *q, const double *v, const double *p, double *out)
{
    char *args[] = {(char *)q, (char *)v, (char *)p, (char *)out};
    const intptr_t dimensions[] = {(intptr_t)states}, steps[] = {64, 64, 0, 16, 8, 8, 8, 8};
    eom_loop_f64(args, dimensions, steps, (void *)&eom_functions[2]);
}

#endif
