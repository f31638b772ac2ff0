/* eomgen_model.h: what a compiled model offers to a caller that knows nothing of it.
 *
 * The model exports one table, `eom_functions`. eomgen_batch.c runs any of its functions over arrays of states with
 * strides; the Python wrapper registers the entries as generalised ufuncs.
 */
#ifndef EOMGEN_MODEL_H
#define EOMGEN_MODEL_H

#include <stdint.h>

/* Where the lanes of an operand's elements are: element i of a block of states at its address + i pitch, whether that
 * is in an array of the caller or in a copy. What is at next + i pitch will be wanted soon.
 */
typedef struct {
    intptr_t pitch; /* scalars */
    uintptr_t next; /* an address that may lie in no array */
} eom_place;

/* A function for one type. The pointers are cast by eomgen_batch.c to
 *
 *     void constants(const scalar *p, scalar *c);
 *     void one(const scalar *const *inputs, const eom_place *places, const scalar *p, const scalar *c, scalar *out,
 *              void *work);
 *
 * `constants` computes what depends on the parameters only. `lanes` is like `one`, for the states that fill its vectors;
 * `places` has an entry for every input and the result. `one` does not look at `places`. A null `one` means that the type
 * was not built, a null `lanes` that there are no vectors of it.
 */
typedef struct {
    void (*constants)(void);
    void (*one)(void);
    void (*lanes)(void);
} eom_kernels;

typedef struct {
    const char *name;
    const char *signature; /* of the generalised ufunc */
    const char *doc;
    const char *rollout; /* signature of the ufuncs that integrate it; null unless this is forward dynamics */
    int inputs;         /* arguments before p */
    int parameters;     /* 1 if p follows them */
    const int *rows;    /* first dimension of each operand: the inputs, p if there is one, the result */
    const int *columns; /* second dimension, 0 for a vector */
    int constants;      /* size of c */
    int work;           /* size of work */
    int streams;        /* vectors of each argument and result that the lanes kernel takes at once: 1, 2 or 4 */
    eom_kernels f64, f32, f80;
} eom_function;

extern const eom_function eom_functions[];
extern const int eom_function_count;

/* Loops of a generalised ufunc: args, dimensions and steps as NumPy hands them over, data an eom_function. */
void eom_loop_f64(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_loop_f32(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_loop_f80(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);

/* The same for rollouts; data is forward dynamics. The last argument is what the method needs: steps per interval, and for
 * dop853 tolerances and coefficients. */
void eom_rollout_rk4_f64(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_rollout_rk4_f32(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_rollout_rk4_f80(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_rollout_euler_f64(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_rollout_euler_f32(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_rollout_euler_f80(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_rollout_dop853_f64(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_rollout_dop853_f32(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);
void eom_rollout_dop853_f80(char **args, const intptr_t *dimensions, const intptr_t *steps, void *data);

#endif
