/* eomgen_batch.c: runs a compiled function over arrays of states, in vector lanes where the type has them.
 *
 * The same text serves every model, so it is compiled once. A block of states is computed where it is if the lanes of
 * each element are adjacent there, otherwise it is copied into lanes (structure of arrays) and out; strides are
 * arbitrary. What depends on the parameters only is computed once if p does not change from state to state.
 */
#include "eomgen_model.h"
#include "eomgen_real.h"

#include <fenv.h>
#include <stdlib.h>
#if EOM_LANES_F64 == 8
#include <immintrin.h>
#endif

#ifndef EOM_PART
#define EOM_PART 0 /* everything; 1: double, 2: the other types, to be linked with 1 */
#endif

enum { EOM_AHEAD = 64 }; /* states from those being used to those asked for, where lanes are adjacent */
enum { EOM_LINE = 64 };  /* bytes that memory is asked for at once */
enum { EOM_MANY_ROWS = 16, EOM_LARGE = 1 << 22 }; /* of results past the cache: elements of one; bytes of all operands */
enum { EOM_MAX_INPUTS = 8, EOM_MAX_STREAMS = 4, EOM_STACK_BYTES = 16384 };
enum { EOM_DOP853_ROWS = 13 }; /* twelve stages, and the end of a step */

typedef enum { EOM_RK4, EOM_EULER, EOM_DOP853 } eom_method;

/* An operand: element (i, j) of state k is at base + k step + i row + j column. */
typedef struct {
    char *base;
    intptr_t step;        /* from state to state, bytes */
    intptr_t row, column; /* from element to element, bytes */
    int rows, columns;    /* columns >= 1 */
    int size;             /* rows x columns */
    int dense;            /* elements are adjacent */
    intptr_t pitch;       /* from element to element, scalars, where lanes are adjacent; 0 where they have to be copied */
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
        o->pitch = 0;
        total += o->size;
    }
    if (!f->parameters) { /* an empty p, so that all functions look alike; the result stays last */
        operand[f->inputs + 1] = operand[f->inputs];
        operand[f->inputs] = (eom_operand){.dense = 1, .columns = 1};
    }
    return total;
}

/* Arrays of a trajectory, per state: q, v, q and v of a stage, what a method keeps of its stages (times n), u, w, w of a
 * stage, work. Returns the sum of their sizes. */
enum { EOM_TRAJECTORY_ARRAYS = 9 };
static size_t eom_trajectory_sizes(const eom_function *f, int kept, int *sizes)
{
    int n = f->rows[0], prescribed = f->inputs > 3 ? 3 * f->rows[3] : 0;
    const int all[EOM_TRAJECTORY_ARRAYS] = {n, n, n, n, kept * n, f->rows[2], prescribed, prescribed, f->work};
    size_t sum = 0;
    for (int i = 0; i < EOM_TRAJECTORY_ARRAYS; i++) sum += sizes[i] = all[i];
    return sum;
}

#define EOM_PASTE_(a, b) a##b
#define EOM_PASTE(a, b) EOM_PASTE_(a, b)

/* In the line where what is ahead ends: that in which it begins is the last one of what was asked for before. It may lie
 * outside the array, where a prefetch is harmless and a pointer is not. */
EOM_INLINE uintptr_t eom_ahead(const char *at, intptr_t bytes) { return (uintptr_t)at + (uintptr_t)bytes + EOM_LINE - 1; }

#if EOM_LANES_F64 == 8 /* a vector, which is a line, past the cache; what says that all of them have been stored */
#define EOM_STORE_NONTEMPORAL(to, from) _mm512_stream_si512((void *)(to), (__m512i)(from))
#define EOM_FENCE() _mm_sfence()
#else
#define EOM_FENCE() ((void)0)
#endif

#define EOM_UNROLLED _Pragma("GCC unroll 8")

/* Four columns of rows of doubles, to vectors over the rows and back: EOM_LANES_F64 rows, `step` doubles apart. A half
 * vector has four elements of a row; each half is a square that is transposed within it. */
#if EOM_PART != 2 && EOM_HAS(__builtin_shufflevector) && EOM_LANES_F64 >= 4
#define EOM_ROWS 1
typedef double eom_four_f64 __attribute__((vector_size(32), aligned(8), may_alias));

#if EOM_LANES_F64 == 8
#define EOM_EVEN 0, 8, 2, 10, 4, 12, 6, 14
#define EOM_ODD 1, 9, 3, 11, 5, 13, 7, 15
#define EOM_LOW 0, 1, 8, 9, 4, 5, 12, 13
#define EOM_HIGH 2, 3, 10, 11, 6, 7, 14, 15
#else
#define EOM_EVEN 0, 4, 2, 6
#define EOM_ODD 1, 5, 3, 7
#define EOM_LOW 0, 1, 4, 5
#define EOM_HIGH 2, 3, 6, 7
#endif

EOM_INLINE void eom_transpose_f64(eom_f64v t[4])
{
    eom_f64v a = __builtin_shufflevector(t[0], t[1], EOM_EVEN), b = __builtin_shufflevector(t[0], t[1], EOM_ODD);
    eom_f64v c = __builtin_shufflevector(t[2], t[3], EOM_EVEN), d = __builtin_shufflevector(t[2], t[3], EOM_ODD);
    t[0] = __builtin_shufflevector(a, c, EOM_LOW);
    t[1] = __builtin_shufflevector(b, d, EOM_LOW);
    t[2] = __builtin_shufflevector(a, c, EOM_HIGH);
    t[3] = __builtin_shufflevector(b, d, EOM_HIGH);
}

EOM_INLINE void eom_load_four_f64(const double *row, intptr_t step, eom_f64v *to, int streams)
{
    eom_f64v t[4];
    EOM_UNROLLED for (int i = 0; i < 4; i++)
#if EOM_LANES_F64 == 8
        t[i] = _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(row + i * step)),
                                  _mm256_loadu_pd(row + (i + 4) * step), 1);
#else
        t[i] = *(const eom_four_f64 *)(row + i * step);
#endif
    eom_transpose_f64(t);
    EOM_UNROLLED for (int i = 0; i < 4; i++) to[i * streams] = t[i];
}

/* One column. Lanes are put in place as they are loaded: the unit that moves values between lanes is the busiest. */
EOM_INLINE eom_f64v eom_load_column_f64(const double *row, intptr_t step)
{
    eom_f64v t[4];
    EOM_UNROLLED for (int i = 0; i < 4; i++) {
#if EOM_LANES_F64 == 8
        t[i] = _mm512_castpd128_pd512(_mm_load_sd(row + i * step));
        t[i] = _mm512_mask_broadcastsd_pd(t[i], 0x10, _mm_load_sd(row + (i + 4) * step));
#else
        t[i] = (eom_f64v){row[i * step]};
#endif
    }
    eom_transpose_f64(t);
    return t[0];
}

#if EOM_LANES_F64 == 8 && defined(__AVX512DQ__)
#define EOM_PAIRS 1
/* Two columns: a quarter of a vector is a pair, the rows of even numbers in one vector, the others in another. */
EOM_INLINE eom_f64v eom_load_pairs_f64(const double *row, intptr_t step)
{
    eom_f64v t = _mm512_castpd128_pd512(_mm_loadu_pd(row));
    t = _mm512_mask_broadcast_f64x2(t, 0x0c, _mm_loadu_pd(row + 2 * step));
    t = _mm512_mask_broadcast_f64x2(t, 0x30, _mm_loadu_pd(row + 4 * step));
    return _mm512_mask_broadcast_f64x2(t, 0xc0, _mm_loadu_pd(row + 6 * step));
}

EOM_INLINE void eom_load_two_f64(const double *row, intptr_t step, eom_f64v *to, int streams)
{
    eom_f64v even = eom_load_pairs_f64(row, step), odd = eom_load_pairs_f64(row + step, step);
    to[0] = __builtin_shufflevector(even, odd, EOM_EVEN);
    to[streams] = __builtin_shufflevector(even, odd, EOM_ODD);
}

EOM_INLINE void eom_store_pairs_f64(double *row, intptr_t step, eom_f64v t)
{
    _mm_storeu_pd(row, _mm512_castpd512_pd128(t));
    _mm_storeu_pd(row + 2 * step, _mm512_extractf64x2_pd(t, 1));
    _mm_storeu_pd(row + 4 * step, _mm512_extractf64x2_pd(t, 2));
    _mm_storeu_pd(row + 6 * step, _mm512_extractf64x2_pd(t, 3));
}

EOM_INLINE void eom_store_two_f64(double *row, intptr_t step, const eom_f64v *from, int streams)
{
    eom_store_pairs_f64(row, step, __builtin_shufflevector(from[0], from[streams], EOM_EVEN));
    eom_store_pairs_f64(row + step, step, __builtin_shufflevector(from[0], from[streams], EOM_ODD));
}
#endif

EOM_INLINE void eom_store_four_f64(double *row, intptr_t step, const eom_f64v *from, int streams)
{
    eom_f64v t[4];
    EOM_UNROLLED for (int i = 0; i < 4; i++) t[i] = from[i * streams];
    eom_transpose_f64(t);
    EOM_UNROLLED for (int i = 0; i < 4; i++) {
#if EOM_LANES_F64 == 8
        _mm256_storeu_pd(row + i * step, _mm512_castpd512_pd256(t[i]));
        _mm256_storeu_pd(row + (i + 4) * step, _mm512_extractf64x4_pd(t[i], 1));
#else
        *(eom_four_f64 *)(row + i * step) = t[i];
#endif
    }
}
#endif

#if EOM_PART != 2
#define EOM_TYPE f64
#define EOM_VECTOR f64v
#define EOM_WIDTH EOM_LANES_F64
#include "eomgen_batch_type.h"
#endif

#if EOM_PART != 1
#define EOM_TYPE f32
#define EOM_VECTOR f32v
#define EOM_WIDTH EOM_LANES_F32
#include "eomgen_batch_type.h"

#define EOM_TYPE f80
#define EOM_VECTOR f80
#define EOM_WIDTH 1
#include "eomgen_batch_type.h"
#endif
