/* eomgen_batch_type.h: the loop of eomgen_batch.c for one type; included once per type.
 *
 * Expects EOM_TYPE (the scalar's suffix), EOM_VECTOR (the vector's suffix) and EOM_WIDTH (its lanes).
 */
#define SCALAR EOM_PASTE(eom_, EOM_TYPE)
#define VECTOR EOM_PASTE(eom_, EOM_VECTOR)
#define FN(name) EOM_PASTE(EOM_PASTE(name, _), EOM_TYPE)

typedef void FN(eom_constants)(const SCALAR *p, SCALAR *c);
typedef void FN(eom_one)(const SCALAR *const *inputs, const SCALAR *p, const SCALAR *c, SCALAR *out, SCALAR *work);
typedef void FN(eom_lanes)(const VECTOR *const *inputs, const SCALAR *p, const SCALAR *c, VECTOR *out, VECTOR *work);

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
        ((FN(eom_one) *)k->one)(inputs, p, c, out, work);
        if (out == out_copy) FN(eom_scatter)(result, at, out, 1);
    }
}

#if EOM_WIDTH > 1
/* Blocks of EOM_WIDTH states; lanes past the end repeat the last state. */
static void FN(eom_run_lanes)(const eom_function *f, const eom_kernels *k, const eom_operand *operand, intptr_t states,
                              const SCALAR *p, const SCALAR *c, SCALAR *buffer)
{
    const VECTOR *inputs[EOM_MAX_INPUTS];
    SCALAR *copies[EOM_MAX_INPUTS], *out = buffer;
    const eom_operand *result = &operand[f->inputs + 1];
    for (int i = 0; i < f->inputs; i++) {
        copies[i] = out;
        inputs[i] = (const VECTOR *)out;
        out += operand[i].size * EOM_WIDTH;
    }
    VECTOR *work = (VECTOR *)(out + result->size * EOM_WIDTH);
    for (intptr_t first = 0; first < states; first += EOM_WIDTH) {
        int count = states - first < EOM_WIDTH ? (int)(states - first) : EOM_WIDTH;
        for (int i = 0; i < f->inputs; i++) {
            const eom_operand *o = &operand[i];
            for (int lane = 0; lane < EOM_WIDTH; lane++) {
                intptr_t state = first + (lane < count ? lane : count - 1);
                FN(eom_gather)(o, o->base + state * o->step, copies[i] + lane, EOM_WIDTH);
            }
        }
        ((FN(eom_lanes) *)k->lanes)(inputs, p, c, (VECTOR *)out, work);
        for (int lane = 0; lane < count; lane++)
            FN(eom_scatter)(result, result->base + (first + lane) * result->step, out + lane, EOM_WIDTH);
    }
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
    int lanes = EOM_WIDTH > 1 && k->lanes && !fresh && states > EOM_WIDTH / 2 ? EOM_WIDTH : 1;

    size_t block = (size_t)(total + f->work) * lanes, constants = (size_t)f->constants + parameters->size;
    size_t bytes = (block + constants) * sizeof(SCALAR);
    _Alignas(64) char stack[EOM_STACK_BYTES];
    SCALAR *buffer = (SCALAR *)stack;
    if (bytes > sizeof stack) {
        buffer = aligned_alloc(64, (bytes + 63) / 64 * 64);
        if (!buffer) abort();
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
        FN(eom_run_lanes)(f, k, operand, states, p, c, buffer);
    } else
#endif
        FN(eom_run_one)(f, k, operand, 0, states, p, c, fresh, buffer);
    if ((char *)buffer != stack) free(buffer);
}

#undef SCALAR
#undef VECTOR
#undef FN
#undef EOM_TYPE
#undef EOM_VECTOR
#undef EOM_WIDTH
