/* Sine and cosine of eight angles, inlined: within 1.6 ulp for |x| < 1e4, no branch, no fast-math.  The
 * reduction needs fused multiply-adds, which GCC makes of a * b + c unless it is told not to. */
#ifndef SINCOS_H
#define SINCOS_H

#include <stdint.h>

typedef double v8 __attribute__((vector_size(64)));
typedef double v8u __attribute__((vector_size(64), aligned(8)));
typedef int64_t i8 __attribute__((vector_size(64)));

#define INLINE static inline __attribute__((always_inline))

/* A table of sines of multiples of pi/8 in registers saves 5 of 28 operations, 3 % of the whole at most, but
 * errs by up to 1.9 ulp. */
INLINE void sincos8(v8 x, v8 *sn, v8 *cs)
{
    const i8 sign = {INT64_MIN, INT64_MIN, INT64_MIN, INT64_MIN,
                     INT64_MIN, INT64_MIN, INT64_MIN, INT64_MIN};
    v8 t = x * 0x1.45f306dc9c883p-1 + 0x1.8p52; /* 2/pi */
    v8 k = t - 0x1.8p52;
    v8 r = x - k * 0x1.921fb54442d18p0;
    r = r - k * 0x1.1a62633145c07p-54;
    v8 z = r * r;
    v8 p = ((((z * 0x1.5e0af186af739p-33 - 0x1.ae600a926c89ap-26) * z + 0x1.71de37961e4c6p-19) * z
             - 0x1.a01a019e8357dp-13) * z + 0x1.1111111110bb1p-7) * z - 0x1.5555555555555p-3;
    v8 q = ((((0x1.1eeb68b109173p-29 - z * 0x1.907d7aebd5e3dp-37) * z - 0x1.27e4fa17a41b4p-22) * z
             + 0x1.a01a019f4e867p-16) * z - 0x1.6c16c16c16966p-10) * z + 0x1.5555555555555p-5;
    v8 s = p * (z * r) + r, c = q * (z * z) + (1 - 0.5 * z);
    i8 at = (i8)t, odd = (at << 63) >> 63, swap = ((i8)s ^ (i8)c) & odd;
    *sn = (v8)(((i8)s ^ swap) ^ ((at << 62) & sign));
    *cs = (v8)(((i8)c ^ swap) ^ (((at + 1) << 62) & sign));
}

#endif
