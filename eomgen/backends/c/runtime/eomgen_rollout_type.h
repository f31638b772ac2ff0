/* eomgen_rollout_type.h: integration of forward dynamics; included once per real type.
 *
 * Expects REAL (a scalar or a vector), RN(name) (a name of its own per type), WIDTH (its lanes) and the names of
 * eomgen_batch_type.h.
 */

/* What stays the same along a trajectory. The state, the stages and the inputs are arrays of elements x streams; v follows
 * q, and stage_v follows stage_q. `a` is what a method keeps of its stages. */
typedef struct {
    void (*kernel)(void);
    const SCALAR *p, *c;
    eom_place places[EOM_MAX_INPUTS + 1];
    int n, k, streams; /* coordinates, prescribed lengths */
    REAL *q, *v, *u, *w, *stage_q, *stage_v, *stage_w, *a, *work;
} RN(eom_trajectory);

/* A trajectory of as many states as `streams` reals hold, its arrays one after the other in a buffer; `sizes` are theirs
 * per state. */
static RN(eom_trajectory) RN(eom_lay_out)(const eom_function *f, void (*kernel)(void), const SCALAR *p, const SCALAR *c,
                                          int streams, const int *sizes, REAL *buffer)
{
    int n = f->rows[0], k = f->inputs > 3 ? f->rows[3] : 0;
    RN(eom_trajectory) x = {.kernel = kernel, .p = p, .c = c, .n = n, .k = k, .streams = streams};
    REAL **arrays[EOM_TRAJECTORY_ARRAYS] = {&x.q, &x.v, &x.stage_q, &x.stage_v, &x.a, &x.u, &x.w, &x.stage_w, &x.work};
    for (int i = 0; i <= f->inputs; i++) x.places[i] = (eom_place){WIDTH * streams, (uintptr_t)buffer};
    for (int i = 0; i < EOM_TRAJECTORY_ARRAYS; i++) {
        *arrays[i] = buffer;
        buffer += sizes[i] * streams;
    }
    return x;
}

/* Accelerations at (q, v), time t after the start of the interval: the prescribed s̈ is constant there. */
static void RN(eom_stage)(RN(eom_trajectory) * x, const REAL *q, const REAL *v, const REAL *t, REAL *a)
{
    const SCALAR *inputs[EOM_MAX_INPUTS] = {(const SCALAR *)q, (const SCALAR *)v, (const SCALAR *)x->u,
                                            (const SCALAR *)x->stage_w};
    int m = x->streams;
    for (int i = 0; i < x->k; i++)
        for (int h = 0; h < m; h++) {
            const REAL *w = x->w + 3 * i * m + h;
            REAL *now = x->stage_w + 3 * i * m + h;
            now[0] = w[0] + t[h] * (w[m] + t[h] * w[2 * m] / 2);
            now[m] = w[m] + t[h] * w[2 * m];
            now[2 * m] = w[2 * m];
        }
    ((FN(eom_kernel) *)x->kernel)(inputs, x->places, x->p, x->c, (SCALAR *)a, x->work);
}

/* Classical Runge-Kutta of fourth order for q'' = a(q, q'). */
static void RN(eom_step_rk4)(RN(eom_trajectory) * x, const REAL *dt, const REAL *t)
{
    int size = x->n * x->streams, m = x->streams;
    REAL *a[] = {x->a, x->a + size, x->a + 2 * size, x->a + 3 * size};
    REAL half[EOM_MAX_STREAMS], end[EOM_MAX_STREAMS];
    for (int h = 0; h < m; h++) {
        half[h] = t[h] + dt[h] / 2;
        end[h] = t[h] + dt[h];
    }
    RN(eom_stage)(x, x->q, x->v, t, a[0]);
    for (int i = 0; i < size; i++) {
        x->stage_q[i] = x->q[i] + dt[i % m] / 2 * x->v[i];
        x->stage_v[i] = x->v[i] + dt[i % m] / 2 * a[0][i];
    }
    RN(eom_stage)(x, x->stage_q, x->stage_v, half, a[1]);
    for (int i = 0; i < size; i++) {
        x->stage_q[i] = x->q[i] + dt[i % m] / 2 * (x->v[i] + dt[i % m] / 2 * a[0][i]);
        x->stage_v[i] = x->v[i] + dt[i % m] / 2 * a[1][i];
    }
    RN(eom_stage)(x, x->stage_q, x->stage_v, half, a[2]);
    for (int i = 0; i < size; i++) {
        x->stage_q[i] = x->q[i] + dt[i % m] * (x->v[i] + dt[i % m] / 2 * a[1][i]);
        x->stage_v[i] = x->v[i] + dt[i % m] * a[2][i];
    }
    RN(eom_stage)(x, x->stage_q, x->stage_v, end, a[3]);
    for (int i = 0; i < size; i++) {
        REAL inner = a[0][i] + a[1][i] + a[2][i];
        x->q[i] = x->q[i] + dt[i % m] * (x->v[i] + dt[i % m] / 6 * inner);
        x->v[i] = x->v[i] + dt[i % m] / 6 * (inner + a[1][i] + a[2][i] + a[3][i]);
    }
}

/* Semi-implicit Euler: the new rates move the coordinates. */
static void RN(eom_step_euler)(RN(eom_trajectory) * x, const REAL *dt, const REAL *t)
{
    int size = x->n * x->streams, m = x->streams;
    RN(eom_stage)(x, x->q, x->v, t, x->a);
    for (int i = 0; i < size; i++) {
        x->v[i] = x->v[i] + dt[i % m] * x->a[i];
        x->q[i] = x->q[i] + dt[i % m] * x->v[i];
    }
}

#if WIDTH == 1
#include "eomgen_dop853_type.h"
#endif

/* Integrates `count` trajectories, at most WIDTH x streams. The operands are those of forward dynamics with u and w at the
 * first interval; `next` leads to the next one. Returns whether an error-controlled motion ended before its intervals. */
static int RN(eom_integrate)(RN(eom_trajectory) * x, const eom_operand *operand, const eom_operand *dt_operand,
                              const eom_operand *result, intptr_t state, int count, intptr_t intervals,
                              const intptr_t *next, eom_method method, const SCALAR *options)
{
    REAL dt[EOM_MAX_STREAMS] = {0}, t[EOM_MAX_STREAMS];
    REAL *to[] = {x->q, x->v, x->u, x->w};
    int used = x->k ? 4 : 3, width = WIDTH, lost = 0;
    intptr_t substeps = (intptr_t)options[0];
#if WIDTH == 1
    SCALAR step = 0;
#endif
    for (int h = 0; h < x->streams; h++) {
        intptr_t first = state + h * width < state + count ? state + h * width : state + count - 1;
        int left = (int)(state + count - first), lanes = left < width ? left : width;
        LOAD(&operand[0], first, lanes, to[0] + h, x->streams);
        LOAD(&operand[1], first, lanes, to[1] + h, x->streams);
        LOAD(dt_operand, first, lanes, dt + h, 1);
    }
    for (intptr_t j = 0; j < intervals; j++) {
        for (int h = 0; h < x->streams; h++) {
            intptr_t first = state + h * width < state + count ? state + h * width : state + count - 1;
            int left = (int)(state + count - first), lanes = left < width ? left : width;
            for (int i = 2; i < used; i++) {
                eom_operand now = operand[i];
                now.base += j * next[i];
                LOAD(&now, first, lanes, to[i] + h, x->streams);
            }
        }
#if WIDTH == 1
        if (method == EOM_DOP853) {
            lost = lost || !FN(eom_span_dop853)(x, (const FN(eom_dop853) *)options, dt[0] * options[0], &step);
            for (int i = 0; lost && i < 2 * x->n; i++) x->q[i] = FN(eom_nan)();
            substeps = 0;
        }
#endif
        for (intptr_t s = 0; s < substeps; s++) {
            for (int h = 0; h < x->streams; h++) t[h] = (SCALAR)s * dt[h];
            if (method == EOM_EULER)
                RN(eom_step_euler)(x, dt, t);
            else
                RN(eom_step_rk4)(x, dt, t);
        }
        for (int h = 0; h < x->streams && h * width < count; h++)
            for (int i = 0; i < 2; i++) {
                eom_operand now = result[i];
                now.base += j * next[EOM_MAX_INPUTS + i];
                STORE(&now, state + h * width, count - h * width < width ? count - h * width : width, (i ? x->v : x->q) + h,
                      x->streams);
            }
    }
    return lost;
}
