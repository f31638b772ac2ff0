/* eomgen_batch_type.h: the loop of eomgen_batch.c for one type; included once per type.
 *
 * Expects EOM_TYPE (the scalar's suffix), EOM_VECTOR (the vector's suffix) and EOM_WIDTH (its lanes); EOM_ROWS, if it
 * is defined, says that rows are transposed four columns at a time. A block has `streams` vectors per element,
 * side by side.
 */
#define SCALAR EOM_PASTE(eom_, EOM_TYPE)
#define VECTOR EOM_PASTE(eom_, EOM_VECTOR)
#define FN(name) EOM_PASTE(EOM_PASTE(name, _), EOM_TYPE)

typedef void FN(eom_constants)(const SCALAR *p, SCALAR *c);
typedef void FN(eom_kernel)(const SCALAR *const *inputs, const eom_place *places, const SCALAR *p, const SCALAR *c,
                            SCALAR *out, void *work);

static void FN(eom_gather)(const eom_operand *o, const char *state, SCALAR *to, int spacing)
{
    for (int i = 0; i < o->rows; i++)
        for (int j = 0; j < o->columns; j++)
            to[(i * o->columns + j) * spacing] = *(const SCALAR *)(state + i * o->row + j * o->column);
}

static void FN(eom_scatter)(const eom_operand *o, char *state, const SCALAR *from, int spacing)
{
    for (int i = 0; i < o->rows; i++)
        for (int j = 0; j < o->columns; j++)
            *(SCALAR *)(state + i * o->row + j * o->column) = from[(i * o->columns + j) * spacing];
}

/* NaN, and the flag `invalid` is raised. */
static SCALAR FN(eom_nan)(void)
{
    volatile SCALAR zero = 0;
    return zero / zero;
}

/* No memory: every result is NaN, and the flag `invalid` is raised. */
static void FN(eom_fail)(const eom_operand *o, intptr_t states)
{
    SCALAR nan = FN(eom_nan)();
    for (intptr_t state = 0; state < states; state++)
        for (int i = 0; i < o->rows; i++)
            for (int j = 0; j < o->columns; j++)
                *(SCALAR *)(o->base + state * o->step + i * o->row + j * o->column) = nan;
}

/* One state at a time; elements that are adjacent are used where they are. */
static void FN(eom_run_one)(const eom_function *f, const eom_kernels *k, const eom_operand *operand, intptr_t first,
                            intptr_t last, const SCALAR *p, SCALAR *c, int fresh, SCALAR *buffer)
{
    const SCALAR *inputs[EOM_MAX_INPUTS];
    const eom_operand *parameters = &operand[f->inputs], *result = parameters + 1;
    SCALAR *next = buffer, *p_copy = NULL, *copies[EOM_MAX_INPUTS];
    for (int i = 0; i < f->inputs; i++) {
        copies[i] = next;
        next += operand[i].size;
    }
    if (fresh) {
        p_copy = next;
        next += parameters->size;
    }
    SCALAR *out_copy = next, *work = next + result->size;
    for (intptr_t state = first; state < last; state++) {
        for (int i = 0; i < f->inputs; i++) {
            const char *at = operand[i].base + state * operand[i].step;
            inputs[i] = (const SCALAR *)at;
            if (!operand[i].dense) {
                FN(eom_gather)(&operand[i], at, copies[i], 1);
                inputs[i] = copies[i];
            }
        }
        if (fresh) {
            FN(eom_gather)(parameters, parameters->base + state * parameters->step, p_copy, 1);
            p = p_copy;
            if (k->constants) ((FN(eom_constants) *)k->constants)(p, c);
        }
        char *at = result->base + state * result->step;
        SCALAR *out = result->dense ? (SCALAR *)at : out_copy;
        ((FN(eom_kernel) *)k->one)(inputs, NULL, p, c, out, work);
        if (out == out_copy) FN(eom_scatter)(result, at, out, 1);
    }
}

#if EOM_WIDTH > 1
#define LOOSE EOM_PASTE(eom_loose_, EOM_VECTOR)

/* Strided elements of EOM_WIDTH states into lanes, one element after the other. */
static void FN(eom_load_strided)(const eom_operand *o, const char *first, int count, VECTOR *to, int streams)
{
    const char *state[EOM_WIDTH];
    for (int lane = 0; lane < EOM_WIDTH; lane++) state[lane] = first + (lane < count ? lane : count - 1) * o->step;
    for (int i = 0; i < o->rows; i++)
        for (int j = 0; j < o->columns; j++, to += streams) {
            intptr_t offset = i * o->row + j * o->column;
            SCALAR *lanes = (SCALAR *)to;
            for (int lane = 0; lane < EOM_WIDTH; lane++) lanes[lane] = *(const SCALAR *)(state[lane] + offset);
        }
}

static void FN(eom_store_strided)(const eom_operand *o, char *first, int count, const VECTOR *from, int streams)
{
    for (int lane = 0; lane < count; lane++)
        FN(eom_scatter)(o, first + lane * o->step, (const SCALAR *)from + lane, streams * EOM_WIDTH);
}

/* Every element is adjacent from state to state ("Fortran order"): a vector is a vector. Many rows are more streams
 * than the hardware follows, so the place of a later block is asked for. */
EOM_INLINE void FN(eom_load_vectors)(const eom_operand *o, const char *first, VECTOR *to, int streams, int blocks)
{
    const int rows = o->rows, columns = o->columns;
    const intptr_t row = o->row, column = o->column;
    for (int i = 0; i < rows; i++, first += row) {
        const char *at = first;
        for (int j = 0; j < columns; j++, at += column, to += streams)
            EOM_UNROLLED for (int h = 0; h < blocks; h++) {
                if (h * sizeof(VECTOR) % EOM_LINE == 0)
                    __builtin_prefetch((void *)eom_ahead(at, EOM_AHEAD * sizeof(SCALAR) + h * sizeof(VECTOR)));
                to[h] = ((const LOOSE *)at)[h];
            }
    }
}

EOM_INLINE void FN(eom_store_vectors)(const eom_operand *o, char *first, const VECTOR *from, int streams, int blocks)
{
    const int rows = o->rows, columns = o->columns;
    const intptr_t row = o->row, column = o->column;
    for (int i = 0; i < rows; i++, first += row) {
        char *at = first;
        for (int j = 0; j < columns; j++, at += column, from += streams)
            EOM_UNROLLED for (int h = 0; h < blocks; h++) {
                if (h * sizeof(VECTOR) % EOM_LINE == 0)
                    __builtin_prefetch((void *)eom_ahead(at, EOM_AHEAD * sizeof(SCALAR) + h * sizeof(VECTOR)), 1);
                ((LOOSE *)at)[h] = from[h];
            }
    }
}

/* Whether nothing is between a state and the next. */
static int FN(eom_is_packed)(const eom_operand *o)
{
    return o->dense && o->step == o->size * (intptr_t)sizeof(SCALAR);
}

#ifdef EOM_ROWS
/* Rows of n adjacent elements, `step` scalars apart, to vectors over the rows. */
EOM_INLINE void FN(eom_load_rows)(const SCALAR *first, int n, intptr_t step, VECTOR *to, int streams, int blocks)
{
    for (int h = 0; h < blocks; h++, first += EOM_WIDTH * step, to++) {
        int e = 0;
        EOM_UNROLLED for (; e + 4 <= n; e += 4) eom_load_four_f64(first + e, step, to + e * streams, streams);
#ifdef EOM_PAIRS
        if (e + 2 <= n) {
            eom_load_two_f64(first + e, step, to + e * streams, streams);
            e += 2;
        }
#endif
        EOM_UNROLLED for (; e < n; e++) to[e * streams] = eom_load_column_f64(first + e, step);
    }
}

EOM_INLINE void FN(eom_store_rows)(SCALAR *first, int n, intptr_t step, const VECTOR *from, int streams, int blocks)
{
    for (int h = 0; h < blocks; h++, first += EOM_WIDTH * step, from++) {
        int e = 0;
        EOM_UNROLLED for (; e + 4 <= n; e += 4) eom_store_four_f64(first + e, step, from + e * streams, streams);
#ifdef EOM_PAIRS
        if (e + 2 <= n) {
            eom_store_two_f64(first + e, step, from + e * streams, streams);
            e += 2;
        }
#endif
        EOM_UNROLLED for (; e < n; e++) {
            const SCALAR *column = (const SCALAR *)(from + e * streams);
            EOM_UNROLLED for (int lane = 0; lane < EOM_WIDTH; lane++) first[lane * step + e] = column[lane];
        }
    }
}

static int FN(eom_has_rows)(const eom_operand *o)
{
    return o->dense && o->step % (intptr_t)sizeof(SCALAR) == 0;
}
#endif

/* `blocks` whole vectors of states; constants where they are inlined. */
EOM_INLINE void FN(eom_load_blocks)(const eom_operand *o, const char *first, VECTOR *to, int streams, int blocks)
{
    if (o->step == sizeof(SCALAR)) {
        FN(eom_load_vectors)(o, first, to, streams, blocks);
        return;
    }
#ifdef EOM_ROWS
    if (FN(eom_has_rows)(o)) {
        const intptr_t step = o->step / (intptr_t)sizeof(SCALAR);
        FN(eom_load_rows)((const SCALAR *)first, o->size, step, to, streams, blocks);
        return;
    }
#endif
    for (int h = 0; h < blocks; h++) FN(eom_load_strided)(o, first + h * EOM_WIDTH * o->step, EOM_WIDTH, to + h, streams);
}

EOM_INLINE void FN(eom_store_blocks)(const eom_operand *o, char *first, const VECTOR *from, int streams, int blocks)
{
    if (o->step == sizeof(SCALAR)) {
        FN(eom_store_vectors)(o, first, from, streams, blocks);
        return;
    }
#ifdef EOM_ROWS
    if (FN(eom_has_rows)(o)) {
        const intptr_t step = o->step / (intptr_t)sizeof(SCALAR);
        FN(eom_store_rows)((SCALAR *)first, o->size, step, from, streams, blocks);
        return;
    }
#endif
    for (int h = 0; h < blocks; h++) FN(eom_store_strided)(o, first + h * EOM_WIDTH * o->step, EOM_WIDTH, from + h, streams);
}

static void FN(eom_load_whole)(const eom_operand *o, intptr_t state, VECTOR *to, int streams)
{
    const char *first = o->base + state * o->step;
    if (streams == 4)
        FN(eom_load_blocks)(o, first, to, 4, 4);
    else if (streams == 2)
        FN(eom_load_blocks)(o, first, to, 2, 2);
    else
        FN(eom_load_blocks)(o, first, to, 1, 1);
}

static void FN(eom_store_whole)(const eom_operand *o, intptr_t state, const VECTOR *from, int streams)
{
    char *first = o->base + state * o->step;
    if (streams == 4)
        FN(eom_store_blocks)(o, first, from, 4, 4);
    else if (streams == 2)
        FN(eom_store_blocks)(o, first, from, 2, 2);
    else
        FN(eom_store_blocks)(o, first, from, 1, 1);
}

static void FN(eom_load)(const eom_operand *o, intptr_t state, int count, VECTOR *to, int streams)
{
    if (count == EOM_WIDTH)
        FN(eom_load_blocks)(o, o->base + state * o->step, to, streams, 1);
    else
        FN(eom_load_strided)(o, o->base + state * o->step, count, to, streams);
}

static void FN(eom_store)(const eom_operand *o, intptr_t state, int count, const VECTOR *from, int streams)
{
    if (count == EOM_WIDTH)
        FN(eom_store_blocks)(o, o->base + state * o->step, from, streams, 1);
    else
        FN(eom_store_strided)(o, o->base + state * o->step, count, from, streams);
}

/* From element to element, scalars, where lanes are adjacent and the distance is always the same; otherwise 0. */
static intptr_t FN(eom_pitch)(const eom_operand *o)
{
    intptr_t pitch = o->columns > 1 ? o->column : o->row;
    if (o->step != sizeof(SCALAR) || pitch % (intptr_t)sizeof(SCALAR) != 0) return 0;
    if (o->columns > 1 && o->rows > 1 && o->row != pitch * o->columns) return 0;
    return pitch / (intptr_t)sizeof(SCALAR);
}

/* Where results are wanted past the cache: the number of states before the first whose results begin a line; otherwise -1.
 * Many rows of a large batch are more than the processor has requests for, and lines written whole need not be read. */
static intptr_t FN(eom_before_line)(const eom_operand *result, intptr_t states, int total)
{
#ifdef EOM_STORE_NONTEMPORAL
    const intptr_t size = sizeof(SCALAR), past = (intptr_t)((uintptr_t)result->base % EOM_LINE);
    int large = result->size >= EOM_MANY_ROWS && states >= EOM_LARGE / (total * size);
    if (large && result->pitch && result->pitch * size % EOM_LINE == 0 && past % size == 0)
        return (EOM_LINE - past) % EOM_LINE / size;
#endif
    (void)result, (void)states, (void)total;
    return -1;
}

static void FN(eom_store_past)(const eom_operand *o, intptr_t state, const VECTOR *from, int streams)
{
#ifdef EOM_STORE_NONTEMPORAL
    char *to = o->base + state * o->step;
    const intptr_t next = o->columns > 1 ? o->column : o->row;
    for (int i = 0; i < o->size; i++, to += next, from += streams)
        for (int h = 0; h < streams; h++) EOM_STORE_NONTEMPORAL(to + h * sizeof(VECTOR), from[h]);
#else
    (void)o, (void)state, (void)from, (void)streams;
#endif
}

/* A batch on its way through a kernel, block by block. By operand, of which the result is the last: */
typedef struct {
    const eom_operand *operand[EOM_MAX_INPUTS + 1];
    VECTOR *copy[EOM_MAX_INPUTS + 1];  /* a block of it in lanes */
    SCALAR *at[EOM_MAX_INPUTS + 1];    /* where the kernel finds it */
    intptr_t move[EOM_MAX_INPUTS + 1]; /* what is added to that from block to block, scalars */
    eom_place places[EOM_MAX_INPUTS + 1];
    intptr_t advance[EOM_MAX_INPUTS + 1]; /* what is added to the next place, bytes */
    int inputs, streams;
    int copied, copies[EOM_MAX_INPUTS]; /* how many inputs have to be copied for each block, and which */
    FN(eom_kernel) *kernel;
    const SCALAR *p, *c;
    VECTOR *work;
} FN(eom_batch);

/* Lays out the copies in a buffer. */
static void FN(eom_prepare)(FN(eom_batch) *x, SCALAR *buffer)
{
    const intptr_t whole = x->streams * EOM_WIDTH;
    VECTOR *next = (VECTOR *)buffer;
    for (int i = 0; i <= x->inputs; i++) {
        const eom_operand *o = x->operand[i];
        const int packed = FN(eom_is_packed)(o); /* as many lines as its copy */
        x->copy[i] = next;
        next += o->size * x->streams;
        x->at[i] = o->pitch ? (SCALAR *)o->base : (SCALAR *)x->copy[i];
        x->move[i] = o->pitch ? whole : 0;
        x->places[i].pitch = o->pitch ? o->pitch : whole;
        x->places[i].next = (uintptr_t)x->copy[i];
        x->advance[i] = 0;
        if (o->pitch || packed) {
            x->places[i].next = eom_ahead(o->base, (o->pitch ? EOM_AHEAD : whole) * o->step);
            x->advance[i] = whole * o->step;
        }
        if (i == x->inputs || o->pitch) continue;
        if (o->step != 0) x->copies[x->copied++] = i;
        for (int h = 0; h < x->streams && o->step == 0; h++)
            FN(eom_load_strided)(o, o->base, EOM_WIDTH, x->copy[i] + h, x->streams);
    }
    x->work = next;
}

EOM_INLINE void FN(eom_compute)(FN(eom_batch) *x)
{
    x->kernel((const SCALAR *const *)x->at, x->places, x->p, x->c, x->at[x->inputs], x->work);
    for (int i = 0; i <= x->inputs; i++) {
        x->at[i] += x->move[i];
        x->places[i].next += x->advance[i];
    }
}

#ifdef EOM_ROWS
/* Two streams of rows of n elements, in code for this number, as it is the loops and addresses that take time with few.
 *
 * rows: how many of the copied inputs, the first ones, are such rows, as the result is; packed: nothing is between rows.
 * Returns the number of states that are done.
 */
EOM_INLINE intptr_t FN(eom_run_rows)(FN(eom_batch) *x, intptr_t states, int n, int rows, int packed)
{
    const intptr_t whole = 2 * EOM_WIDTH, size = sizeof(SCALAR);
    const eom_operand *result = x->operand[x->inputs];
    intptr_t block = 0;
    for (; block + whole <= states; block += whole) {
        for (int j = 0; j < rows; j++) {
            const eom_operand *o = x->operand[x->copies[j]];
            const intptr_t step = packed ? n : o->step / size;
            FN(eom_load_rows)((const SCALAR *)o->base + block * step, n, step, x->copy[x->copies[j]], 2, 2);
        }
        for (int j = rows; j < x->copied; j++)
            FN(eom_load_whole)(x->operand[x->copies[j]], block, x->copy[x->copies[j]], 2);
        FN(eom_compute)(x);
        const intptr_t step = packed ? n : result->step / size;
        FN(eom_store_rows)((SCALAR *)result->base + block * step, n, step, x->copy[x->inputs], 2, 2);
    }
    return block;
}

/* The blocks of forward dynamics of few coordinates; returns the number of states that are done, 0 if it is not that. */
static intptr_t FN(eom_run_few)(FN(eom_batch) *x, intptr_t states)
{
    const eom_operand *result = x->operand[x->inputs];
    const int n = result->size;
    int packed = FN(eom_is_packed)(result), rows = 0;
    if (x->streams != 2 || result->pitch || !FN(eom_has_rows)(result)) return 0;
    for (int j = 0; j < x->copied; j++) {
        const int i = x->copies[j];
        if (x->operand[i]->size != n || !FN(eom_has_rows)(x->operand[i])) continue;
        x->copies[j] = x->copies[rows];
        x->copies[rows++] = i;
        packed &= FN(eom_is_packed)(x->operand[i]);
    }
    switch (n) {
#define EOM_RUN(n)                                                                                                     \
    case n: return packed ? FN(eom_run_rows)(x, states, n, rows, 1) : FN(eom_run_rows)(x, states, n, rows, 0);
        EOM_RUN(2) EOM_RUN(3) EOM_RUN(4) EOM_RUN(5) EOM_RUN(6) EOM_RUN(7) EOM_RUN(8) EOM_RUN(9) EOM_RUN(10)
#undef EOM_RUN
    }
    return 0;
}
#endif

/* Blocks of `streams` vectors of states; lanes past the end repeat the last state. past: store results past the cache. */
static void FN(eom_run_lanes)(const eom_function *f, const eom_kernels *k, const eom_operand *operand, intptr_t states,
                              const SCALAR *p, const SCALAR *c, int streams, int past, SCALAR *buffer)
{
    const intptr_t whole = streams * EOM_WIDTH;
    const int inputs = f->inputs;
    const eom_operand *result = &operand[inputs + 1];
    FN(eom_batch) x = {.inputs = inputs, .streams = streams, .kernel = (FN(eom_kernel) *)k->lanes, .p = p, .c = c};
    for (int i = 0; i <= inputs; i++) x.operand[i] = i < inputs ? &operand[i] : result;
    FN(eom_prepare)(&x, buffer);
    intptr_t block = 0;
#ifdef EOM_ROWS
    block = FN(eom_run_few)(&x, states);
#endif
    for (; block + whole <= states; block += whole) {
        for (int j = 0; j < x.copied; j++)
            FN(eom_load_whole)(x.operand[x.copies[j]], block, x.copy[x.copies[j]], streams);
        FN(eom_compute)(&x);
        if (past)
            FN(eom_store_past)(result, block, x.copy[inputs], streams);
        else if (!result->pitch)
            FN(eom_store_whole)(result, block, x.copy[inputs], streams);
    }
    if (past) EOM_FENCE();
    if (block == states) return;
    int count[EOM_MAX_STREAMS];
    intptr_t first[EOM_MAX_STREAMS];
    for (int h = 0; h < streams; h++) {
        intptr_t left = states - block - h * EOM_WIDTH;
        count[h] = left >= EOM_WIDTH ? EOM_WIDTH : left > 0 ? (int)left : 0;
        first[h] = count[h] ? block + h * EOM_WIDTH : states - 1;
        for (int i = 0; i < inputs; i++)
            if (operand[i].step != 0) FN(eom_load)(&operand[i], first[h], count[h] ? count[h] : 1, x.copy[i] + h, streams);
    }
    for (int i = 0; i <= inputs; i++) {
        x.at[i] = (SCALAR *)x.copy[i];
        x.places[i] = (eom_place){whole, (uintptr_t)x.copy[i]};
    }
    FN(eom_compute)(&x);
    for (int h = 0; h < streams; h++) FN(eom_store)(result, first[h], count[h], x.copy[inputs] + h, streams);
}
#endif

void FN(eom_loop)(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data)
{
    const eom_function *f = data;
    const eom_kernels *k = &f->EOM_TYPE;
    intptr_t states = dimensions[0];
    if (states <= 0) return;

    eom_operand operand[EOM_MAX_INPUTS + 2];
    int total = eom_operands(f, args, steps, sizeof(SCALAR), operand);
    const eom_operand *parameters = &operand[f->inputs];
    int fresh = parameters->step != 0 && states > 1;
    int streams = EOM_WIDTH > 1 ? f->streams : 1;
    int lanes = EOM_WIDTH > 1 && k->lanes && !fresh && states > EOM_WIDTH / 2 ? streams * EOM_WIDTH : 1;

    size_t block = (size_t)(total + f->work) * lanes, constants = (size_t)f->constants + parameters->size;
    size_t bytes = (block + constants) * sizeof(SCALAR);
    _Alignas(64) char stack[EOM_STACK_BYTES];
    SCALAR *buffer = (SCALAR *)stack;
    if (bytes > sizeof stack) {
        buffer = aligned_alloc(64, (bytes + 63) / 64 * 64);
        if (!buffer) {
            FN(eom_fail)(&operand[f->inputs + 1], states);
            return;
        }
    }
    SCALAR *c = buffer + block, *p_copy = c + f->constants;
    const SCALAR *p = (const SCALAR *)parameters->base;
    if (!fresh) {
        if (!parameters->dense) {
            FN(eom_gather)(parameters, parameters->base, p_copy, 1);
            p = p_copy;
        }
        if (k->constants) ((FN(eom_constants) *)k->constants)(p, c);
    }
#if EOM_WIDTH > 1
    if (lanes > 1) {
        for (int i = 0; i < f->inputs + 2; i++) operand[i].pitch = FN(eom_pitch)(&operand[i]);
        intptr_t before = FN(eom_before_line)(&operand[f->inputs + 1], states, total);
        if (before >= 0) {
            FN(eom_run_one)(f, k, operand, 0, before, p, c, 0, buffer);
            for (int i = 0; i < f->inputs + 2; i++) operand[i].base += before * operand[i].step;
            operand[f->inputs + 1].pitch = 0;
            states -= before;
        }
        FN(eom_run_lanes)(f, k, operand, states, p, c, streams, before >= 0, buffer);
    } else
#endif
        FN(eom_run_one)(f, k, operand, 0, states, p, c, fresh, buffer);
    if ((char *)buffer != stack) free(buffer);
}

/* ---- Rollouts: forward dynamics integrated over intervals of constant u ---- */

static void FN(eom_load_one)(const eom_operand *o, intptr_t state, int count, SCALAR *to, int streams)
{
    (void)count, (void)streams;
    FN(eom_gather)(o, o->base + state * o->step, to, 1);
}

static void FN(eom_store_one)(const eom_operand *o, intptr_t state, int count, const SCALAR *from, int streams)
{
    (void)count, (void)streams;
    FN(eom_scatter)(o, o->base + state * o->step, from, 1);
}

#define REAL SCALAR
#define RN(name) EOM_PASTE(FN(name), _one)
#define WIDTH 1
#define LOAD FN(eom_load_one)
#define STORE FN(eom_store_one)
#include "eomgen_rollout_type.h"
#undef REAL
#undef RN
#undef WIDTH
#undef LOAD
#undef STORE
#if EOM_WIDTH > 1
#define REAL VECTOR
#define RN(name) EOM_PASTE(FN(name), _lanes)
#define WIDTH EOM_WIDTH
#define LOAD FN(eom_load)
#define STORE FN(eom_store)
#include "eomgen_rollout_type.h"
#undef REAL
#undef RN
#undef WIDTH
#undef LOAD
#undef STORE
#endif

/* Arguments: q, v, u (t, nu), w (t, k, 3) if there is one, p, dt, options; results q, v (t, n). */
static void FN(eom_rollout)(char **args, const intptr_t *dimensions, const intptr_t *steps, const eom_function *f,
                            eom_method method)
{
    const eom_kernels *kernels = &f->EOM_TYPE;
    intptr_t states = dimensions[0], intervals = dimensions[2];
    if (states <= 0 || intervals <= 0) return;
    int inputs = f->inputs, n = f->rows[0], operands = inputs + 5;
    const intptr_t *inner = steps + operands;
    intptr_t next[EOM_MAX_INPUTS + 2] = {0};
    eom_operand operand[EOM_MAX_INPUTS] = {{0}}, dt, result[2], *p_operand = &operand[inputs];
    for (int i = 0; i <= inputs; i++) {
        if (i == 2 || (i == 3 && i < inputs)) next[i] = *inner++; /* u and w, not p */
        operand[i] = (eom_operand){args[i], steps[i], *inner++, sizeof(SCALAR), f->rows[i], 1, f->rows[i], 0, 0};
        if (i == 3 && inputs > 3) {
            operand[i].column = *inner++;
            operand[i].columns = 3;
            operand[i].size *= 3;
        }
        operand[i].dense = eom_is_dense(&operand[i], sizeof(SCALAR));
    }
    dt = (eom_operand){args[inputs + 1], steps[inputs + 1], 0, 0, 1, 1, 1, 0, 0};
    const SCALAR *options = (const SCALAR *)args[inputs + 2];
    inner++; /* which are adjacent */
    for (int i = 0; i < 2; i++) {
        next[EOM_MAX_INPUTS + i] = *inner++;
        result[i] = (eom_operand){args[inputs + 3 + i], steps[inputs + 3 + i], *inner++, sizeof(SCALAR), n, 1, n, 0, 0};
        result[i].dense = eom_is_dense(&result[i], sizeof(SCALAR));
    }
    int fresh = p_operand->step != 0 && states > 1, streams = EOM_WIDTH > 1 ? f->streams : 1;
    int side_by_side = EOM_WIDTH > 1 && kernels->lanes && !fresh && states > EOM_WIDTH / 2 && method != EOM_DOP853;
    int lanes = side_by_side ? streams * EOM_WIDTH : 1, kept = method == EOM_DOP853 ? 2 * EOM_DOP853_ROWS : 4;
    int raised = fetestexcept(FE_ALL_EXCEPT), lost = 0;
    int sizes[EOM_TRAJECTORY_ARRAYS];
    size_t each = eom_trajectory_sizes(f, kept, sizes);
    size_t bytes = (each * lanes + f->constants + p_operand->size + 64) * sizeof(SCALAR);
    SCALAR *buffer = aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (!buffer) {
        for (int i = 0; i < 2; i++)
            for (intptr_t j = 0; j < intervals; j++) {
                FN(eom_fail)(&result[i], states);
                result[i].base += next[EOM_MAX_INPUTS + i];
            }
        return;
    }
    SCALAR *c = buffer + each * lanes, *p_copy = c + f->constants;
    EOM_PASTE(FN(eom_trajectory), _one) one = EOM_PASTE(FN(eom_lay_out), _one)(f, kernels->one, p_copy, c, 1, sizes, buffer);
#if EOM_WIDTH > 1
    EOM_PASTE(FN(eom_trajectory), _lanes) side =
        EOM_PASTE(FN(eom_lay_out), _lanes)(f, kernels->lanes, p_copy, c, streams, sizes, (VECTOR *)buffer);
#endif
    for (intptr_t state = 0; state < states; state += lanes) {
        if (state == 0 || fresh) {
            FN(eom_gather)(p_operand, p_operand->base + state * p_operand->step, p_copy, 1);
            if (kernels->constants) ((FN(eom_constants) *)kernels->constants)(p_copy, c);
        }
        int count = states - state < lanes ? (int)(states - state) : lanes;
#if EOM_WIDTH > 1
        if (lanes > 1) {
            EOM_PASTE(FN(eom_integrate), _lanes)(&side, operand, &dt, result, state, count, intervals, next, method, options);
            continue;
        }
#endif
        lost |= EOM_PASTE(FN(eom_integrate), _one)(&one, operand, &dt, result, state, count, intervals, next, method, options);
    }
    free(buffer);
    if (method == EOM_DOP853) { /* steps that were tried and given up have raised what is true of no result */
        feclearexcept(FE_ALL_EXCEPT);
        feraiseexcept(raised | (lost ? FE_INVALID : 0));
    }
}

void FN(eom_rollout_rk4)(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data)
{
    FN(eom_rollout)(args, dimensions, steps, data, EOM_RK4);
}

void FN(eom_rollout_euler)(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data)
{
    FN(eom_rollout)(args, dimensions, steps, data, EOM_EULER);
}

void FN(eom_rollout_dop853)(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data)
{
    FN(eom_rollout)(args, dimensions, steps, data, EOM_DOP853);
}

#undef SCALAR
#undef VECTOR
#undef LOOSE
#undef FN
#undef EOM_TYPE
#undef EOM_VECTOR
#undef EOM_WIDTH
#undef EOM_ROWS
