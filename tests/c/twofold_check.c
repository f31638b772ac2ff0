/* Applies eomgen_twofold.h to pairs of doubles from standard input: one state at a time, then in lanes.
 *
 *   twofold_check sincos   x        -> sine, cosine
 *   twofold_check invert   x        -> 1/x
 *   twofold_check add|mul|div  x, y -> x + y, x y, x / y
 */
#include "eomgen_twofold.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = EOM_LANES_F64 };
typedef eom_twofold_f64 one;
typedef eom_twofold_f64v many;

static void scalar(const char *what, const one *x, one *out)
{
    one unit = {1, 0};
    if (!strcmp(what, "sincos")) eom_twofold_sincos_f64(x[0], &out[0], &out[1]);
    if (!strcmp(what, "invert")) out[0] = eom_twofold_pivot_inverse_f64(x[0], unit);
    if (!strcmp(what, "add")) out[0] = eom_add22_f64(x[0], x[1]);
    if (!strcmp(what, "mul")) out[0] = eom_mul22_f64(x[0], x[1]);
    if (!strcmp(what, "div")) out[0] = eom_div22_f64(x[0], x[1]);
}

static void vector(const char *what, const many *x, many *out)
{
    many unit = {eom_set_f64v(1), eom_set_f64v(0)};
    if (!strcmp(what, "sincos")) eom_twofold_sincos_f64v(x[0], &out[0], &out[1]);
    if (!strcmp(what, "invert")) out[0] = eom_twofold_pivot_inverse_f64v(x[0], unit);
    if (!strcmp(what, "add")) out[0] = eom_add22_f64v(x[0], x[1]);
    if (!strcmp(what, "mul")) out[0] = eom_mul22_f64v(x[0], x[1]);
    if (!strcmp(what, "div")) out[0] = eom_div22_f64v(x[0], x[1]);
}

int main(int argc, char **argv)
{
    if (argc < 2) return 2;
    int inputs = strcmp(argv[1], "sincos") && strcmp(argv[1], "invert") ? 2 : 1, outputs = strcmp(argv[1], "sincos") ? 1 : 2;
    one x[LANES][2], found[LANES][2];
    for (;;) {
        int count = 0;
        while (count < LANES && fread(x[count], sizeof(one), inputs, stdin) == (size_t)inputs) count++;
        if (!count) return 0;
        many lanes[2] = {{{0}, {0}}, {{0}, {0}}}, results[2] = {{{0}, {0}}, {{0}, {0}}};
        for (int i = 0; i < count; i++) {
            scalar(argv[1], x[i], found[i]);
            for (int j = 0; j < inputs; j++) lanes[j].hi[i] = x[i][j].hi, lanes[j].lo[i] = x[i][j].lo;
        }
        vector(argv[1], lanes, results);
        for (int i = 0; i < count; i++)
            for (int j = 0; j < outputs; j++) {
                one lane = {results[j].hi[i], results[j].lo[i]};
                fwrite(&found[i][j], sizeof(one), 1, stdout);
                fwrite(&lane, sizeof(one), 1, stdout);
            }
    }
}
