/* eomgen_dop853_type.h: error-controlled integration of one trajectory; included once per scalar type.
 *
 * The method of Dormand and Prince of order 8 with error estimates of orders 5 and 3 (Hairer, Nørsett, Wanner: Solving
 * Ordinary Differential Equations I, 2nd edition, 1993, sections II.4, II.5 and II.10). A row of x->a is a stage: rates,
 * then accelerations. The stages used are the first and an unbroken range of later ones, as are the coefficients.
 * `_dop853` of _rollout.py does the same with arrays, to the last bit.
 */

/* The options of the ufunc; their last part is the table of _rollout.py. */
typedef struct {
    SCALAR steps, rtol, atol, finest, least, most; /* a step is at least finest x time + least; so many are tried */
    SCALAR nodes[11], stages[50], solution[8], fifth[8], third[8];
} FN(eom_dop853);

#define ROOT EOM_PASTE(eom_sqrt_, EOM_TYPE)

static SCALAR FN(eom_larger)(SCALAR a, SCALAR b) { return a > b ? a : b; }
static SCALAR FN(eom_size)(SCALAR a) { return a < 0 ? -a : a; }

/* Element i of a weighted sum of stages: the first and those from `from` to before `to`. */
EOM_INLINE SCALAR FN(eom_sum)(const SCALAR *weights, const SCALAR *row, int size, int from, int to)
{
    SCALAR sum = weights[0] * row[0];
    for (int j = from; j < to; j++) sum += weights[1 + j - from] * row[j * size];
    return sum;
}

/* The state after a step h by a weighted sum: the coordinates to stage_q, the rates to the first half of a row. */
static __attribute__((noinline)) void FN(eom_move)(RN(eom_trajectory) * x, const SCALAR *restrict weights, SCALAR h,
                                                   SCALAR *restrict to, int from, int before)
{
    int n = x->n;
    for (int i = 0; i < n; i++) {
        x->stage_q[i] = x->q[i] + h * FN(eom_sum)(weights, x->a + i, 2 * n, from, before);
        to[i] = x->v[i] + h * FN(eom_sum)(weights, x->a + n + i, 2 * n, from, before);
    }
}

/* The first stage, at the state itself. */
static void FN(eom_begin)(RN(eom_trajectory) * x, SCALAR t)
{
    for (int i = 0; i < x->n; i++) x->a[i] = x->v[i];
    RN(eom_stage)(x, x->q, x->v, &t, x->a + x->n);
}

/* A step to try, when only the first stage of the motion is known (section II.4). */
static SCALAR FN(eom_first_step)(RN(eom_trajectory) * x, const FN(eom_dop853) * o, SCALAR span)
{
    int n = x->n, size = 2 * n;
    const SCALAR one = 1;
    SCALAR state = 0, slope = 0, bend = 0, *next = x->a + size;
    for (int i = 0; i < size; i++) {
        SCALAR scale = 1 / (o->atol + FN(eom_size)(x->q[i]) * o->rtol), y = x->q[i] * scale, f = x->a[i] * scale;
        state += y * y;
        slope += f * f;
    }
    state = ROOT(state / size);
    slope = ROOT(slope / size);
    SCALAR h = state < (SCALAR)1e-5 || slope < (SCALAR)1e-5 ? (SCALAR)1e-6 : (SCALAR)0.01 * state / slope;
    h = span < h ? span : h;
    FN(eom_move)(x, &one, h, next, 1, 1);
    RN(eom_stage)(x, x->stage_q, next, &h, next + n);
    for (int i = 0; i < size; i++) {
        SCALAR scale = 1 / (o->atol + FN(eom_size)(x->q[i]) * o->rtol), f = (next[i] - x->a[i]) * scale;
        bend += f * f;
    }
    bend = ROOT(bend / size) / h;
    SCALAR largest = FN(eom_larger)(bend, slope); /* the slope if the trial step met a singular state */
    SCALAR found = largest <= (SCALAR)1e-15
                       ? FN(eom_larger)((SCALAR)1e-6, h * (SCALAR)1e-3)
                       : ROOT(ROOT(ROOT((SCALAR)0.01 / largest)));
    if (100 * h < found) found = 100 * h;
    return span < found ? span : found;
}

/* The stages of a step from t by h, and its end in stage_q and the last row; the square of the scaled error. */
static SCALAR FN(eom_try)(RN(eom_trajectory) * x, const FN(eom_dop853) * o, SCALAR t, SCALAR h)
{
    static const int from[] = {1, 1, 2, 2, 3, 3, 3, 3, 3, 3, 3};
    int n = x->n, size = 2 * n;
    const SCALAR *weights = o->stages;
    for (int stage = 1; stage <= 11; stage++) {
        SCALAR *row = x->a + stage * size, now = t + o->nodes[stage - 1] * h;
        FN(eom_move)(x, weights, h, row, from[stage - 1], stage);
        RN(eom_stage)(x, x->stage_q, row, &now, row + n);
        weights += 1 + stage - from[stage - 1];
    }
    SCALAR *end = x->a + (EOM_DOP853_ROWS - 1) * size, fifth = 0, third = 0;
    FN(eom_move)(x, o->solution, h, end, 5, 12);
    for (int i = 0; i < size; i++) {
        SCALAR after = i < n ? x->stage_q[i] : end[i - n];
        SCALAR larger = FN(eom_larger)(FN(eom_size)(x->q[i]), FN(eom_size)(after));
        SCALAR scale = h / (o->atol + larger * o->rtol);
        SCALAR a = scale * FN(eom_sum)(o->fifth, x->a + i, size, 5, 12);
        SCALAR b = scale * FN(eom_sum)(o->third, x->a + i, size, 5, 12);
        fifth += a * a;
        third += b * b;
    }
    return fifth == 0 ? 0 : fifth * (fifth / ((fifth + (SCALAR)0.01 * third) * size));
}

/* Integrates over `span`; *h is the step to begin with, 0 if it is to be chosen, and that to go on with.
 *
 * False where the motion ends: its state is not finite, no step that time can resolve is short enough, or they are too
 * many.
 */
static int FN(eom_span_dop853)(RN(eom_trajectory) * x, const FN(eom_dop853) * o, SCALAR span, SCALAR *h)
{
    int n = x->n, size = 2 * n, rejected = 0;
    SCALAR t = 0, tries = 0, *end = x->a + (EOM_DOP853_ROWS - 1) * size;
    FN(eom_begin)(x, t);
    if (*h == 0) *h = FN(eom_first_step)(x, o, span);
    while (t < span) {
        if (!(*h > o->finest * t + o->least && tries < o->most)) return 0;
        tries += 1;
        int last = span - t <= *h;
        SCALAR step = last ? span - t : *h, error = FN(eom_try)(x, o, t, step), most = rejected ? 1 : 10;
        /* 0.9 error^(-1/8), between 0.2 and `most`; 0.2 if it is not a number */
        SCALAR factor = (SCALAR)0.9 / ROOT(ROOT(ROOT(ROOT(error))));
        factor = FN(eom_larger)(factor, (SCALAR)0.2);
        factor = most < factor ? most : factor;
        rejected = !(error < 1);
        if (rejected) {
            *h = step * factor;
            continue;
        }
        t = last ? span : t + step;
        *h = last ? FN(eom_larger)(*h, step * factor) : step * factor; /* a step cut short says nothing against its like */
        for (int i = 0; i < n; i++) {
            x->q[i] = x->stage_q[i];
            x->v[i] = end[i];
        }
        if (!last) FN(eom_begin)(x, t);
    }
    for (int i = 0; i < size; i++)
        if (!(x->q[i] - x->q[i] == 0)) return 0;
    return 1;
}

#undef ROOT
