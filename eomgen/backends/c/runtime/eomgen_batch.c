/* eomgen_batch.c: runs a compiled function over arrays of states, in vector lanes where the type has them.
 *
 * The same text serves every model, so it is compiled once. States are copied into blocks of lanes (structure of
 * arrays), computed, and copied out; strides are arbitrary. What depends on the parameters only is computed once if
 * p does not change from state to state.
 */
#include "eomgen_model.h"
#include "eomgen_real.h"

#include <stdlib.h>
#include <string.h>

enum { EOM_AHEAD = 512 }; /* bytes: 64 states of doubles */
enum { EOM_MAX_INPUTS = 8, EOM_MAX_STREAMS = 2, EOM_STACK_BYTES = 16384 };

/* An operand: `size` elements at the address of its state plus `offset` of each. */
typedef struct {
    char *base;
    intptr_t step;      /* from state to state, bytes */
    intptr_t row, column; /* from element to element, bytes */
    int rows, columns;  /* columns >= 1 */
    int size;
    int dense;          /* elements are adjacent */
} eom_operand;

static int eom_is_dense(const eom_operand *o, size_t scalar)
{
    return (o->columns == 1 || o->column == (intptr_t)scalar) &&
           (o->rows <= 1 || o->row == (intptr_t)scalar * o->columns);
}

static int eom_operands(const eom_function *f, char **args, const intptr_t *steps, size_t scalar, eom_operand *operand)
{
    int count = f->inputs + f->parameters + 1, total = 0;
    const intptr_t *inner = steps + count;
    for (int i = 0; i < count; i++) {
        eom_operand *o = &operand[i];
        o->base = args[i];
        o->step = steps[i];
        o->rows = f->rows[i];
        o->columns = f->columns[i] ? f->columns[i] : 1;
        o->size = o->rows * o->columns;
        o->row = *inner++;
        o->column = f->columns[i] ? *inner++ : (intptr_t)scalar;
        o->dense = eom_is_dense(o, scalar);
        total += o->size;
    }
    if (!f->parameters) { /* an empty p, so that all functions look alike; the result stays last */
        operand[f->inputs + 1] = operand[f->inputs];
        operand[f->inputs] = (eom_operand){.dense = 1, .columns = 1};
    }
    return total;
}

#define EOM_PASTE_(a, b) a##b
#define EOM_PASTE(a, b) EOM_PASTE_(a, b)

#define EOM_UNROLLED _Pragma("GCC unroll 8")

/* Square transposes of doubles by exchanging halves, quarters, ... of pairs of vectors. */
#if EOM_HAS(__builtin_shufflevector) && EOM_LANES_F64 == 8
#define EOM_SWAP(a, b, l0, l1, l2, l3, l4, l5, l6, l7, h0, h1, h2, h3, h4, h5, h6, h7)                                  \
    do {                                                                                                               \
        eom_f64v low = __builtin_shufflevector(a, b, l0, l1, l2, l3, l4, l5, l6, l7);                                  \
        b = __builtin_shufflevector(a, b, h0, h1, h2, h3, h4, h5, h6, h7);                                             \
        a = low;                                                                                                       \
    } while (0)
#define EOM_SWAP4(a, b) EOM_SWAP(a, b, 0, 1, 2, 3, 8, 9, 10, 11, 4, 5, 6, 7, 12, 13, 14, 15)
#define EOM_SWAP2(a, b) EOM_SWAP(a, b, 0, 1, 8, 9, 4, 5, 12, 13, 2, 3, 10, 11, 6, 7, 14, 15)
#define EOM_SWAP1(a, b) EOM_SWAP(a, b, 0, 8, 2, 10, 4, 12, 6, 14, 1, 9, 3, 11, 5, 13, 7, 15)
EOM_INLINE void eom_transpose_f64(eom_f64v t[8])
{
    EOM_UNROLLED for (int i = 0; i < 4; i++) EOM_SWAP4(t[i], t[i + 4]);
    EOM_UNROLLED for (int i = 0; i < 8; i += 4)
        EOM_UNROLLED for (int j = i; j < i + 2; j++) EOM_SWAP2(t[j], t[j + 2]);
    EOM_UNROLLED for (int i = 0; i < 8; i += 2) EOM_SWAP1(t[i], t[i + 1]);
}
#define EOM_TRANSPOSE eom_transpose_f64
#elif EOM_HAS(__builtin_shufflevector) && EOM_LANES_F64 == 4
EOM_INLINE void eom_transpose_f64(eom_f64v t[4])
{
    eom_f64v a = __builtin_shufflevector(t[0], t[2], 0, 1, 4, 5), b = __builtin_shufflevector(t[1], t[3], 0, 1, 4, 5);
    eom_f64v c = __builtin_shufflevector(t[0], t[2], 2, 3, 6, 7), d = __builtin_shufflevector(t[1], t[3], 2, 3, 6, 7);
    t[0] = __builtin_shufflevector(a, b, 0, 4, 2, 6);
    t[1] = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    t[2] = __builtin_shufflevector(c, d, 0, 4, 2, 6);
    t[3] = __builtin_shufflevector(c, d, 1, 5, 3, 7);
}
#define EOM_TRANSPOSE eom_transpose_f64
#endif

#define EOM_TYPE f64
#define EOM_VECTOR f64v
#define EOM_WIDTH EOM_LANES_F64
#include "eomgen_batch_type.h"

#define EOM_TYPE f32
#define EOM_VECTOR f32v
#define EOM_WIDTH EOM_LANES_F32
#include "eomgen_batch_type.h"

#define EOM_TYPE f80
#define EOM_VECTOR f80
#define EOM_WIDTH 1
#include "eomgen_batch_type.h"
