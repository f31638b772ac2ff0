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

enum { EOM_MAX_INPUTS = 8, EOM_STACK_BYTES = 16384 };

/* An operand: `size` elements at the address of its state plus `offset` of each. */
typedef struct {
    char *base;
    intptr_t step;      /* from state to state, bytes */
    intptr_t row, column; /* from element to element, bytes */
    int rows, columns;  /* columns >= 1 */
    int size;
    int dense;          /* elements are adjacent */
} eom_operand;

static int eom_operands(const eom_function *f, char **args, const intptr_t *steps, size_t scalar, eom_operand *operand)
{
    int count = f->inputs + 2, total = 0;
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
        o->dense = (o->columns == 1 || o->column == (intptr_t)scalar) &&
                   (o->rows <= 1 || o->row == (intptr_t)scalar * o->columns);
        total += o->size;
    }
    return total;
}

#define EOM_PASTE_(a, b) a##b
#define EOM_PASTE(a, b) EOM_PASTE_(a, b)

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
