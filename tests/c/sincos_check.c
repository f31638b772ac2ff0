/* Drives eomgen_real.h for tests/test_sincos.py: doubles in on stdin, results out on stdout, binary.
 *
 *   sincos_check sincos T    x ...       -> sin, cos, ...            T: f64 f64v f32 f32v f80
 *   sincos_check difference T  x, y ...  -> sin, cos of x - y, ...
 *   sincos_check pivot T     d, ref ...  -> inverse, flags, ...
 *   sincos_check other T     a, b, c ... -> fma(a, b, c), sqrt(a), exp(a), log(a), set(a) ...
 *   sincos_check flags T     x ...       -> flags, ...               1 invalid, 2 overflow, 4 divide by zero
 *   sincos_check lanes T     x ...       -> (text) number of lanes whose bits differ from the scalar type's; each x is
 *                                           tried in every lane position beside ever different others
 *   sincos_check difference_lanes T  x, y ...  -> (text) the same for differences
 *   sincos_check speed                   -> (text) nanoseconds per pair for every type
 *   sincos_check target                  -> (text) fused or not, vector width
 *
 * The first half of this file is compiled once per type, as the text of a model is.
 */
#ifdef EOM_REAL

/* From and to arrays of doubles, EOM_LANES at a time.  Not inlined, so that the flags they raise are raised there. */

static __attribute__((noinline)) void EOM_NAME(sincos)(const double *x, const double *y, double *s, double *c)
{
    EOM_NAME(element) in[2][EOM_LANES] = {0}, out[2][EOM_LANES];
    eom_real v[2], vs, vc;
    for (int i = 0; i < EOM_LANES; i++) {
        in[0][i] = (EOM_NAME(element))x[i];
        if (y) in[1][i] = (EOM_NAME(element))y[i];
    }
    memcpy(v, in, sizeof v);
    if (y) eom_sincos(v[0], v[1], EOM_DIFFERENCE, &vs, &vc);
    else eom_sincos(v[0], eom_set(0), EOM_ANGLE, &vs, &vc);
    memcpy(out[0], &vs, sizeof vs);
    memcpy(out[1], &vc, sizeof vc);
    for (int i = 0; i < EOM_LANES; i++) s[i] = (double)out[0][i], c[i] = (double)out[1][i];
}

static __attribute__((noinline)) void EOM_NAME(pair)(const double *x, const double *y, double *s, double *c)
{
    EOM_NAME(element) in[4][EOM_LANES] = {0}, out[4][EOM_LANES];
    eom_real v[4], r[4];
    for (int i = 0; i < 2 * EOM_LANES; i++) {
        in[i / EOM_LANES][i % EOM_LANES] = (EOM_NAME(element))x[i];
        if (y) in[2 + i / EOM_LANES][i % EOM_LANES] = (EOM_NAME(element))y[i];
    }
    memcpy(v, in, sizeof v);
    if (y) eom_sincos2(v[0], v[2], EOM_DIFFERENCE, v[1], v[3], EOM_DIFFERENCE, &r[0], &r[2], &r[1], &r[3]);
    else eom_sincos2(v[0], eom_set(0), EOM_ANGLE, v[1], eom_set(0), EOM_ANGLE, &r[0], &r[2], &r[1], &r[3]);
    memcpy(out, r, sizeof r);
    for (int i = 0; i < 2 * EOM_LANES; i++) {
        s[i] = (double)out[i / EOM_LANES][i % EOM_LANES];
        c[i] = (double)out[2 + i / EOM_LANES][i % EOM_LANES];
    }
}

static __attribute__((noinline)) void EOM_NAME(pivot)(const double *d, const double *ref, double *inverse)
{
    EOM_NAME(element) in[2][EOM_LANES], out[EOM_LANES];
    eom_real vd, vref;
    for (int i = 0; i < EOM_LANES; i++) in[0][i] = (EOM_NAME(element))d[i], in[1][i] = (EOM_NAME(element))ref[i];
    memcpy(&vd, in[0], sizeof vd);
    memcpy(&vref, in[1], sizeof vd);
    vd = eom_pivot_inverse(vd, vref);
    memcpy(out, &vd, sizeof vd);
    for (int i = 0; i < EOM_LANES; i++) inverse[i] = (double)out[i];
}

static __attribute__((noinline)) void EOM_NAME(other)(const double *a, const double *b, const double *c,
                                                      double *results)
{
    EOM_NAME(element) in[3][EOM_LANES], out[5][EOM_LANES];
    eom_real v[3], r[5];
    for (int i = 0; i < EOM_LANES; i++) {
        in[0][i] = (EOM_NAME(element))a[i];
        in[1][i] = (EOM_NAME(element))b[i];
        in[2][i] = (EOM_NAME(element))c[i];
    }
    memcpy(v, in, sizeof v);
    r[0] = eom_fma(v[0], v[1], v[2]);
    r[1] = eom_sqrt(v[0]);
    r[2] = eom_exp(v[0]);
    r[3] = eom_log(v[0]);
    r[4] = eom_set(a[0]);
    memcpy(out, r, sizeof r);
    for (int i = 0; i < EOM_LANES; i++)
        for (int j = 0; j < 5; j++) results[5 * i + j] = (double)out[j][i];
}

static __attribute__((noinline)) void EOM_NAME(many)(const void *x, void *s, void *c, int n)
{
    for (int i = 0; i < n; i += EOM_LANES) {
        eom_real v, vs, vc;
        memcpy(&v, (const EOM_NAME(element) *)x + i, sizeof v);
        eom_sincos(v, eom_set(0), EOM_ANGLE, &vs, &vc);
        memcpy((EOM_NAME(element) *)s + i, &vs, sizeof v);
        memcpy((EOM_NAME(element) *)c + i, &vc, sizeof v);
    }
}

#else

#define _GNU_SOURCE
#include "eomgen_real.h"

#include <fenv.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef double element_f64, element_f64v;
typedef float element_f32, element_f32v;
typedef long double element_f80;

#define EOM_REAL f64
#include "sincos_check.c"
#undef EOM_REAL
#define EOM_REAL f64v
#include "sincos_check.c"
#undef EOM_REAL
#define EOM_REAL f32
#include "sincos_check.c"
#undef EOM_REAL
#define EOM_REAL f32v
#include "sincos_check.c"
#undef EOM_REAL
#define EOM_REAL f80
#include "sincos_check.c"
#undef EOM_REAL

#define MOST 16 /* lanes */
#define BENCH 512

typedef struct {
    const char *name;
    int lanes, size;
    void (*sincos)(const double *, const double *, double *, double *); /* of x, or of x - y where y is not null */
    void (*pair)(const double *, const double *, double *, double *);   /* of 2 x lanes */
    void (*pivot)(const double *, const double *, double *);
    void (*other)(const double *, const double *, const double *, double *);
    void (*many)(const void *, void *, void *, int);
} type;

#define TYPE(T) {#T, EOM_LANES_##T, sizeof(element_##T), sincos_##T, pair_##T, pivot_##T, other_##T, many_##T}
static const type types[] = {TYPE(f64), TYPE(f64v), TYPE(f32), TYPE(f32v), TYPE(f80)};

static double *input;
static size_t count; /* doubles read; at least MOST zeros follow them */

static void read_input(void)
{
    size_t room = 1 << 16, got;
    input = malloc(room * sizeof *input);
    while (input && (got = fread(input + count, sizeof *input, room - count - 3 * MOST, stdin)) > 0) {
        count += got;
        if (count == room - 3 * MOST) input = realloc(input, (room *= 2) * sizeof *input);
    }
    if (!input) exit(3);
    memset(input + count, 0, 3 * MOST * sizeof *input);
}

static void put(const double *x, size_t n) { fwrite(x, sizeof *x, n, stdout); }

static double flags(void)
{
    return !!fetestexcept(FE_INVALID) + 2 * !!fetestexcept(FE_OVERFLOW) + 4 * !!fetestexcept(FE_DIVBYZERO);
}

static void do_sincos(const type *t)
{
    double s[MOST], c[MOST];
    for (size_t i = 0; i < count; i += (size_t)t->lanes) {
        t->sincos(input + i, NULL, s, c);
        for (size_t j = 0; j < (size_t)t->lanes && i + j < count; j++) put((double[]){s[j], c[j]}, 2);
    }
}

static void do_difference(const type *t)
{
    double x[MOST], y[MOST], s[MOST], c[MOST];
    for (size_t i = 0; i < count / 2; i += (size_t)t->lanes) {
        for (size_t j = 0; j < (size_t)t->lanes; j++) x[j] = input[2 * (i + j)], y[j] = input[2 * (i + j) + 1];
        t->sincos(x, y, s, c);
        for (size_t j = 0; j < (size_t)t->lanes && i + j < count / 2; j++) put((double[]){s[j], c[j]}, 2);
    }
}

static void do_pivot(const type *t)
{
    for (size_t i = 0; i + 1 < count; i += 2) { /* the pair in the last lane, harmless ones in the others */
        double d[MOST], ref[MOST], inverse[MOST];
        for (int j = 0; j < MOST; j++) d[j] = 4, ref[j] = 1;
        d[t->lanes - 1] = input[i];
        ref[t->lanes - 1] = input[i + 1];
        feclearexcept(FE_ALL_EXCEPT);
        t->pivot(d, ref, inverse);
        double raised = flags();
        for (int j = 0; j < t->lanes - 1; j++)
            if (inverse[j] != 0.25) raised = -1;
        put((double[]){inverse[t->lanes - 1], raised}, 2);
    }
}

static void do_other(const type *t)
{
    for (size_t i = 0; i + 2 < count; i += 3) {
        double a[MOST], b[MOST], c[MOST], results[5 * MOST];
        for (int j = 0; j < MOST; j++) a[j] = input[i], b[j] = 3, c[j] = 5;
        b[t->lanes - 1] = input[i + 1];
        c[t->lanes - 1] = input[i + 2];
        t->other(a, b, c, results);
        put(results + 5 * (t->lanes - 1), 5);
    }
}

static void do_flags(const type *t)
{
    for (size_t i = 0; i < count; i++) {
        double x[MOST], s[MOST], c[MOST];
        for (int j = 0; j < MOST; j++) x[j] = j + 0.5;
        x[i % (size_t)t->lanes] = input[i];
        feclearexcept(FE_ALL_EXCEPT);
        t->sincos(x, NULL, s, c);
        put((double[]){flags()}, 1);
    }
}

static void lanes(const type *t, int columns)
{
    const type *scalar = t->size == sizeof(double) ? types : types + 2;
    size_t rows = count / (size_t)columns, differ = 0, place[2 * MOST], step = 0;
    double *s = malloc(rows * sizeof *s), *c = malloc(rows * sizeof *c);
    if (!s || !c) exit(3);
    for (size_t i = 0; i < rows; i++)
        scalar->sincos(input + (size_t)columns * i, columns == 2 ? input + 2 * i + 1 : NULL, s + i, c + i);
    for (size_t i = 0; i < rows; i++)
        for (int at = 0; at < t->lanes; at++) {
            double x[2 * MOST], second[2 * MOST], *y = columns == 2 ? second : NULL, vs[2 * MOST], vc[2 * MOST];
            for (int j = 0; j < 2 * t->lanes; j++) {
                step = step * 6364136223846793005u + 1442695040888963407u;
                place[j] = j == at ? i : (step >> 33) % rows;
                x[j] = input[(size_t)columns * place[j]];
                if (y) y[j] = input[2 * place[j] + 1];
            }
            t->sincos(x, y, vs, vc);
            for (int j = 0; j < t->lanes; j++)
                differ += memcmp(vs + j, s + place[j], sizeof *s) || memcmp(vc + j, c + place[j], sizeof *c);
            t->pair(x, y, vs, vc);
            for (int j = 0; j < 2 * t->lanes; j++)
                differ += memcmp(vs + j, s + place[j], sizeof *s) || memcmp(vc + j, c + place[j], sizeof *c);
        }
    printf("%zu\n", differ);
}

static void do_lanes(const type *t) { lanes(t, 1); }

static void do_difference_lanes(const type *t) { lanes(t, 2); }

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static _Alignas(64) long double arrays[3][BENCH];

static void libm_many(const void *x, void *s, void *c, int n)
{
    for (int i = 0; i < n; i++) {
        ((double *)s)[i] = sin(((const double *)x)[i]);
        ((double *)c)[i] = cos(((const double *)x)[i]);
    }
}

static double speed(void (*many)(const void *, void *, void *, int))
{
    double best = 1e300;
    for (int repeat = 0; repeat < 200; repeat++) {
        double begin = now();
        for (int i = 0; i < 20; i++) many(arrays[0], arrays[1], arrays[2], BENCH);
        double each = (now() - begin) / 20 / BENCH;
        if (each < best) best = each;
    }
    return best;
}

static void do_speed(void)
{
    for (size_t k = 0; k <= sizeof types / sizeof *types; k++) {
        int libm = k == sizeof types / sizeof *types;
        for (int i = 0; i < BENCH; i++) {
            double x = fmod(i * 0.61803398875, 1.0) * 12 - 6; /* angles of either sign, in no order */
            if (libm || types[k].size == sizeof(double)) ((double *)arrays[0])[i] = x;
            else if (types[k].size == sizeof(float)) ((float *)arrays[0])[i] = (float)x;
            else arrays[0][i] = x;
        }
        printf("%s %.3f\n", libm ? "libm" : types[k].name, speed(libm ? libm_many : types[k].many));
    }
}

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        void (*run)(const type *);
    } commands[] = {{"sincos", do_sincos}, {"pivot", do_pivot}, {"other", do_other}, {"flags", do_flags},
                  {"lanes", do_lanes}, {"difference", do_difference}, {"difference_lanes", do_difference_lanes}};
    if (argc == 2 && !strcmp(argv[1], "target")) return printf("%d %d\n", EOM_FUSED, EOM_VECTOR_BYTES) < 0;
    if (argc == 2 && !strcmp(argv[1], "speed")) return do_speed(), 0;
    for (size_t i = 0; argc == 3 && i < sizeof commands / sizeof *commands; i++)
        for (size_t j = 0; j < sizeof types / sizeof *types; j++)
            if (!strcmp(argv[1], commands[i].name) && !strcmp(argv[2], types[j].name)) {
                read_input();
                commands[i].run(types + j);
                return 0;
            }
    return 2;
}

#endif
