/* eomgen_single.h: float arithmetic between arguments and results in double, for the kernels of accuracy "fast".
 *
 * For T = f64 the values between are floats, for f64v vectors of floats; x and y point to as many doubles: one, or two
 * vectors of them.
 *
 *   eom_single_T                                  the type
 *   eom_narrow_T(x), eom_widen_T(x, a)            doubles to floats and back
 *   eom_narrow_difference_T(x, y)                 x - y, rounded once to double and once to float
 *   eom_sincos_angle_T(x, &s, &c)                 sine and cosine of x
 *   eom_sincos_difference_T(x, y, &s, &c)         of x - y
 *   eom_single_fma_T, eom_single_sincos_T, eom_single_pivot_inverse_T, ...   those of eomgen_real.h for floats
 *
 * Sine and cosine: at most 2 2^-24 where |x| (or |x - y|) <= 2^20, of libm beyond.  The angle less its multiple of pi/2
 * is found in double; the series is evaluated in float (coefficients: Taylor's, the error of leaving out the rest is
 * 2^-25).
 */
#ifndef EOMGEN_SINGLE_H
#define EOMGEN_SINGLE_H

#include "eomgen_real.h"

typedef eom_f32 eom_single_f64;
typedef eom_f32v eom_single_f64v;
typedef int eom_i32x4 __attribute__((vector_size(16)));
typedef float eom_f32x4 __attribute__((vector_size(16)));

EOM_INLINE eom_f32 eom_narrow_f64(const eom_f64 *x) { return (eom_f32)x[0]; }
EOM_INLINE eom_f32v eom_narrow_f64v(const eom_loose_f64v *x) { return eom_narrow_f32v(x[0], x[1]); }
EOM_INLINE void eom_widen_f64(eom_f64 *x, eom_f32 a) { x[0] = a; }
EOM_INLINE void eom_widen_f64v(eom_loose_f64v *x, eom_f32v a)
{
    eom_f64v low, high;
    eom_widen_f32v(a, &low, &high);
    x[0] = low;
    x[1] = high;
}

EOM_INLINE eom_f32 eom_narrow_difference_f64(const eom_f64 *x, const eom_f64 *y) { return (eom_f32)(x[0] - y[0]); }
EOM_INLINE eom_f32v eom_narrow_difference_f64v(const eom_loose_f64v *x, const eom_loose_f64v *y)
{
    return eom_narrow_f32v(x[0] - y[0], x[1] - y[1]);
}

/* Sine and cosine for |r| <= pi/4 and the quadrant that the low bits of n, a float pushed by 1.5 2^23, count. */
#define EOM_DEFINE_SINGLE_SERIES(T, V, I, FMA, SET)                                                                   \
    EOM_INLINE void eom_single_series_##T(V r, V n, V *sine, V *cosine)                                               \
    {                                                                                                                 \
        V z = r * r;                                                                                                  \
        V s = FMA(z, SET(0x1.71de3ap-19), SET(-0x1.a01a02p-13));                                                      \
        s = FMA(z, s, SET(0x1.111112p-7));                                                                            \
        s = FMA(z, s, SET(-0x1.555556p-3));                                                                           \
        s = FMA(r * z, s, r);                                                                                         \
        V c = FMA(z, SET(-0x1.27e4fcp-22), SET(0x1.a01a02p-16));                                                      \
        c = FMA(z, c, SET(-0x1.6c16c2p-10));                                                                          \
        c = FMA(z, c, SET(0x1.555556p-5));                                                                            \
        c = FMA(z, c, SET(-0.5));                                                                                     \
        c = FMA(z, c, SET(1.0));                                                                                      \
        I odd = (I)n << 31, half = (I)n << 30 & EOM_SIGN_BIT_F32;                                                     \
        I flip = (((I)s ^ (I)c) & (odd >> 31)) ^ half;                                                                \
        *sine = (V)((I)s ^ flip);                                                                                     \
        *cosine = (V)((I)c ^ flip ^ odd);                                                                             \
    }

#define EOM_SIGN_BIT_F32 (-0x7fffffff - 1)
#define EOM_ROUNDER_F32 0x1.8p23
EOM_INLINE eom_f32x4 eom_fma_f32x4(eom_f32x4 a, eom_f32x4 b, eom_f32x4 c)
{
    return (eom_f32x4){eom_fma_f32(a[0], b[0], c[0])};
}
EOM_INLINE eom_f32x4 eom_set_f32x4(double a) { return (eom_f32x4){(float)a}; }
EOM_DEFINE_SINGLE_SERIES(f32x4, eom_f32x4, eom_i32x4, eom_fma_f32x4, eom_set_f32x4)
EOM_DEFINE_SINGLE_SERIES(f32v, eom_f32v, eom_i32v, eom_fma_f32v, eom_set_f32v)

/* x - k pi/2 in double, k in the low bits of *n, for |x| <= 2^20. */
#define EOM_DEFINE_SINGLE_REDUCE(T, V, FMA, SET)                                                                      \
    EOM_INLINE V eom_single_reduce_##T(V x, V *k)                                                                     \
    {                                                                                                                 \
        *k = FMA(x, SET(EOM_TWO_OVER_PI), SET(EOM_ROUNDER)) - SET(EOM_ROUNDER);                                       \
        return FMA(*k, SET(-0x1.0b4611a626331p-34), FMA(*k, SET(-0x1.921fb544p+0), x));                               \
    }

EOM_DEFINE_SINGLE_REDUCE(f64, eom_f64, eom_fma_f64, eom_set_f64)
EOM_DEFINE_SINGLE_REDUCE(f64v, eom_f64v, eom_fma_f64v, eom_set_f64v)

EOM_INLINE void eom_single_turn_f64(eom_f64 x, eom_f64 y, eom_f32 *sine, eom_f32 *cosine)
{
    if (eom_far_f64(x - y, EOM_SINCOS_LIMIT)) {
        eom_sincos_pair far = eom_sincos_far_f64(x, y);
        *sine = (float)far.s;
        *cosine = (float)far.c;
    } else {
        eom_f64 k, r = eom_single_reduce_f64(x - y, &k);
        eom_f32x4 s, c, n = {(float)k + (float)EOM_ROUNDER_F32};
        eom_single_series_f32x4((eom_f32x4){(float)r}, n, &s, &c);
        *sine = s[0];
        *cosine = c[0];
    }
}

EOM_INLINE void eom_single_near_f64v(eom_f64v low, eom_f64v high, eom_f32v *sine, eom_f32v *cosine)
{
    eom_f64v k_low, k_high, r_low = eom_single_reduce_f64v(low, &k_low), r_high = eom_single_reduce_f64v(high, &k_high);
    eom_f32v n = eom_narrow_f32v(k_low, k_high) + eom_set_f32v(EOM_ROUNDER_F32);
    eom_single_series_f32v(eom_narrow_f32v(r_low, r_high), n, sine, cosine);
}

EOM_COLD void eom_single_far_f64v(const eom_f64v *x, const eom_f64v *y, eom_f32v *sine, eom_f32v *cosine)
{
    for (int i = 0; i < EOM_LANES_F32; i++) {
        float s, c;
        eom_single_turn_f64(x[i / EOM_LANES_F64][i % EOM_LANES_F64], y[i / EOM_LANES_F64][i % EOM_LANES_F64], &s, &c);
        (*sine)[i] = s;
        (*cosine)[i] = c;
    }
}

EOM_INLINE void eom_single_turn_f64v(eom_f64v x_low, eom_f64v x_high, eom_f64v y_low, eom_f64v y_high, eom_f32v *sine,
                                     eom_f32v *cosine)
{
    eom_f64v low = x_low - y_low, high = x_high - y_high;
    if (EOM_UNLIKELY(eom_any_far_f64v(low, EOM_SINCOS_LIMIT) || eom_any_far_f64v(high, EOM_SINCOS_LIMIT))) {
        eom_f64v x[] = {x_low, x_high}, y[] = {y_low, y_high};
        eom_f32v s = {0}, c = {0};
        eom_single_far_f64v(x, y, &s, &c);
        *sine = s;
        *cosine = c;
    } else {
        eom_single_near_f64v(low, high, sine, cosine);
    }
}

EOM_INLINE void eom_sincos_angle_f64(const eom_f64 *x, eom_f32 *s, eom_f32 *c) { eom_single_turn_f64(x[0], 0, s, c); }
EOM_INLINE void eom_sincos_difference_f64(const eom_f64 *x, const eom_f64 *y, eom_f32 *s, eom_f32 *c)
{
    eom_single_turn_f64(x[0], y[0], s, c);
}
EOM_INLINE void eom_sincos_angle_f64v(const eom_loose_f64v *x, eom_f32v *s, eom_f32v *c)
{
    eom_single_turn_f64v(x[0], x[1], (eom_f64v){0}, (eom_f64v){0}, s, c);
}
EOM_INLINE void eom_sincos_difference_f64v(const eom_loose_f64v *x, const eom_loose_f64v *y, eom_f32v *s,
                                           eom_f32v *c)
{
    eom_single_turn_f64v(x[0], x[1], y[0], y[1], s, c);
}

EOM_INLINE void eom_single_sincos_f64(eom_f32 x, eom_f32 *s, eom_f32 *c) { eom_sincos_f32(x, 0, EOM_ANGLE, s, c); }
EOM_INLINE void eom_single_sincos_f64v(eom_f32v x, eom_f32v *s, eom_f32v *c)
{
    eom_sincos_f32v(x, (eom_f32v){0}, EOM_ANGLE, s, c);
}

#define eom_single_fma_f64 eom_fma_f32
#define eom_single_fma_f64v eom_fma_f32v
#define eom_single_fnma_f64 eom_fnma_f32
#define eom_single_fnma_f64v eom_fnma_f32v
#define eom_single_pivot_inverse_f64 eom_pivot_inverse_f32
#define eom_single_pivot_inverse_f64v eom_pivot_inverse_f32v
#define eom_single_sqrt_f64 eom_sqrt_f32
#define eom_single_sqrt_f64v eom_sqrt_f32v
#define eom_single_exp_f64 eom_exp_f32
#define eom_single_exp_f64v eom_exp_f32v
#define eom_single_log_f64 eom_log_f32
#define eom_single_log_f64v eom_log_f32v

#endif
