/* eomgen_twofold.h: numbers of twice the precision of double, for the kernels of accuracy "high".
 *
 * A twofold is an unevaluated sum hi + lo of two doubles, hi being the sum rounded to double: about 106 bits.  For T =
 * f64 (scalar) and f64v (vector of lanes) there are
 *
 *   eom_twofold_T                     the type
 *   eom_add11_T(a, b), add21, add22   sums; the digits tell which operands are twofolds (2) and which are doubles (1)
 *   eom_mul11_T, mul21, mul22         products
 *   eom_div22_T(a, b)                 quotient
 *   eom_scale_T(a, k)                 a k for a power of two k
 *   eom_minus_T(a)                    -a
 *   eom_twofold_sincos_T(x, &s, &c)   sine and cosine
 *   eom_twofold_pivot_inverse_T(d, ref)   1/d if d > 16 EPS^2 ref + MIN; else NaN and the `invalid` flag, as in section 6
 *                                     of eomgen_real.h
 *
 * With u = 2^-53 the largest relative errors are: sum of doubles and product of doubles 0; add21 2 u^2; add22 3 u^2 (also
 * where the operands cancel); mul21 2 u^2; mul22 4 u^2; div22 10 u^2 (Joldes, Muller, Popescu 2017; inverse pivots alike).
 * Sine and cosine: 2^-97.  Where no operation is fused, products are split (Dekker 1971), which overflows beyond 2^996.
 */
#ifndef EOMGEN_TWOFOLD_H
#define EOMGEN_TWOFOLD_H

#include "eomgen_real.h"

#include <stdint.h>

/* pi/2 = Q1 + Q2 + Q3 + Q4 with an error of 2^-217 */
#define EOM_Q1 0x1.921fb54442d18p+0
#define EOM_Q2 0x1.1a62633145c07p-54
#define EOM_Q3 -0x1.f1976b7ed8fbcp-110
#define EOM_Q4 0x1.4cf98e804177dp-164

#if EOM_FUSED
#define EOM_PRODUCT_ERROR(V, FMA, SET, a, b, p) FMA(a, b, -(p))
#else
#define EOM_PRODUCT_ERROR(V, FMA, SET, a, b, p)                                                                       \
    ({                                                                                                                \
        V a1 = (a) * SET(0x1p27 + 1), b1 = (b) * SET(0x1p27 + 1);                                                     \
        a1 = a1 - (a1 - (a)), b1 = b1 - (b1 - (b));                                                                   \
        V a2 = (a) - a1, b2 = (b) - b1;                                                                               \
        ((a1 * b1 - (p)) + a1 * b2 + a2 * b1) + a2 * b2;                                                              \
    })
#endif

/* eom_fast_T: the sum of two doubles, |a| >= |b| or a = 0.  eom_lead_T: (hi + lo) + b where |hi| is well above |b|. */
#define EOM_DEFINE_TWOFOLD(T, V, FMA, SET)                                                                            \
    typedef struct {                                                                                                  \
        V hi, lo;                                                                                                     \
    } eom_twofold_##T;                                                                                                \
    EOM_INLINE eom_twofold_##T eom_fast_##T(V a, V b)                                                                 \
    {                                                                                                                 \
        V s = a + b;                                                                                                  \
        return (eom_twofold_##T){s, b - (s - a)};                                                                     \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_add11_##T(V a, V b)                                                                \
    {                                                                                                                 \
        V s = a + b, c = s - a;                                                                                       \
        return (eom_twofold_##T){s, (a - (s - c)) + (b - c)};                                                         \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_add21_##T(eom_twofold_##T a, V b)                                                  \
    {                                                                                                                 \
        eom_twofold_##T s = eom_add11_##T(a.hi, b);                                                                   \
        return eom_fast_##T(s.hi, a.lo + s.lo);                                                                       \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_add22_##T(eom_twofold_##T a, eom_twofold_##T b)                                    \
    {                                                                                                                 \
        eom_twofold_##T s = eom_add11_##T(a.hi, b.hi), t = eom_add11_##T(a.lo, b.lo);                                 \
        s = eom_fast_##T(s.hi, s.lo + t.hi);                                                                          \
        return eom_fast_##T(s.hi, t.lo + s.lo);                                                                       \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_lead_##T(V hi, V lo, eom_twofold_##T b)                                            \
    {                                                                                                                 \
        eom_twofold_##T s = eom_fast_##T(hi, b.hi);                                                                   \
        return eom_fast_##T(s.hi, s.lo + (lo + b.lo));                                                                \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_minus_##T(eom_twofold_##T a) { return (eom_twofold_##T){-a.hi, -a.lo}; }           \
    EOM_INLINE eom_twofold_##T eom_scale_##T(eom_twofold_##T a, V k)                                                  \
    {                                                                                                                 \
        return (eom_twofold_##T){a.hi * k, a.lo * k};                                                                 \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_mul11_##T(V a, V b)                                                                \
    {                                                                                                                 \
        V p = a * b;                                                                                                  \
        return (eom_twofold_##T){p, EOM_PRODUCT_ERROR(V, FMA, SET, a, b, p)};                                         \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_mul21_##T(eom_twofold_##T a, V b)                                                  \
    {                                                                                                                 \
        eom_twofold_##T p = eom_mul11_##T(a.hi, b);                                                                   \
        return eom_fast_##T(p.hi, FMA(a.lo, b, p.lo));                                                                \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_mul22_##T(eom_twofold_##T a, eom_twofold_##T b)                                    \
    {                                                                                                                 \
        eom_twofold_##T p = eom_mul11_##T(a.hi, b.hi);                                                                \
        V cross = FMA(a.lo, b.hi, FMA(a.hi, b.lo, a.lo * b.lo));                                                      \
        return eom_fast_##T(p.hi, p.lo + cross);                                                                      \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_div22_##T(eom_twofold_##T a, eom_twofold_##T b)                                    \
    {                                                                                                                 \
        V q = a.hi / b.hi;                                                                                            \
        eom_twofold_##T rest = eom_add22_##T(a, eom_minus_##T(eom_mul21_##T(b, q)));                                  \
        return eom_fast_##T(q, rest.hi / b.hi);                                                                       \
    }                                                                                                                 \
    /* x - k pi/2 to the precision of a twofold, however much cancels. */                                             \
    EOM_INLINE eom_twofold_##T eom_less_quarters_##T(eom_twofold_##T x, V k)                                          \
    {                                                                                                                 \
        eom_twofold_##T a = eom_mul11_##T(k, SET(-EOM_Q1)), b = eom_mul11_##T(k, SET(-EOM_Q2));                       \
        eom_twofold_##T c = eom_mul11_##T(k, SET(-EOM_Q3)), r = eom_add11_##T(x.hi + a.hi, a.lo); /* exact */         \
        r = eom_add22_##T(eom_add21_##T(r, x.lo), b);                                                                 \
        r = eom_add21_##T(r, c.hi);                                                                                   \
        return eom_fast_##T(r.hi, r.lo + FMA(k, SET(-EOM_Q4), c.lo));                                                 \
    }                                                                                                                 \
    /* Taylor's series for |r| <= pi/4; terms below 2^-45 of the sum need only the precision of double. */            \
    EOM_INLINE void eom_series_##T(eom_twofold_##T r, eom_twofold_##T *sine, eom_twofold_##T *cosine)                 \
    {                                                                                                                 \
        eom_twofold_##T z = eom_mul22_##T(r, r), t;                                                                   \
        V q = FMA(z.hi, SET(-0x1.d1ab1c2dccea3p-94), SET(0x1.3f3ccdd165fa9p-84));                                     \
        q = FMA(z.hi, q, SET(-0x1.761b41316381ap-75));                                                                \
        q = FMA(z.hi, q, SET(0x1.71b8ef6dcf572p-66));                                                                 \
        q = FMA(z.hi, q, SET(-0x1.2f49b46814157p-57));                                                                \
        q = FMA(z.hi, q, SET(0x1.952c77030ad4ap-49));                                                                 \
        t = eom_fast_##T(SET(-0x1.ae7f3e733b81fp-41), FMA(z.hi, q, SET(-0x1.1d8656b0ee8cbp-97)));                     \
        t = eom_lead_##T(SET(0x1.6124613a86d09p-33), SET(0x1.f28e0cc748ebep-87), eom_mul22_##T(z, t));                \
        t = eom_lead_##T(SET(-0x1.ae64567f544e4p-26), SET(0x1.c062e06d1f209p-80), eom_mul22_##T(z, t));               \
        t = eom_lead_##T(SET(0x1.71de3a556c734p-19), SET(-0x1.c154f8ddc6c00p-73), eom_mul22_##T(z, t));               \
        t = eom_lead_##T(SET(-0x1.a01a01a01a01ap-13), SET(-0x1.a01a01a01a01ap-73), eom_mul22_##T(z, t));              \
        t = eom_lead_##T(SET(0x1.1111111111111p-7), SET(0x1.1111111111111p-63), eom_mul22_##T(z, t));                 \
        t = eom_lead_##T(SET(-0x1.5555555555555p-3), SET(-0x1.5555555555555p-57), eom_mul22_##T(z, t));               \
        *sine = eom_lead_##T(r.hi, r.lo, eom_mul22_##T(eom_mul22_##T(r, z), t));                                      \
        q = FMA(z.hi, SET(-0x1.88e85fc6a4e5ap-89), SET(0x1.f2cf01972f578p-80));                                       \
        q = FMA(z.hi, q, SET(-0x1.0ce396db7f853p-70));                                                                \
        q = FMA(z.hi, q, SET(0x1.e542ba4020225p-62));                                                                 \
        q = FMA(z.hi, q, SET(-0x1.6827863b97d97p-53));                                                                \
        q = FMA(z.hi, q, SET(0x1.ae7f3e733b81fp-45));                                                                 \
        t = eom_fast_##T(SET(-0x1.93974a8c07c9dp-37), FMA(z.hi, q, SET(-0x1.05d6f8a2efd1fp-92)));                     \
        t = eom_lead_##T(SET(0x1.1eed8eff8d898p-29), SET(-0x1.2aec959e14c06p-83), eom_mul22_##T(z, t));               \
        t = eom_lead_##T(SET(-0x1.27e4fb7789f5cp-22), SET(-0x1.cbbc05b4fa99ap-76), eom_mul22_##T(z, t));              \
        t = eom_lead_##T(SET(0x1.a01a01a01a01ap-16), SET(0x1.a01a01a01a01ap-76), eom_mul22_##T(z, t));                \
        t = eom_lead_##T(SET(-0x1.6c16c16c16c17p-10), SET(0x1.f49f49f49f49fp-65), eom_mul22_##T(z, t));               \
        t = eom_lead_##T(SET(0x1.5555555555555p-5), SET(0x1.5555555555555p-59), eom_mul22_##T(z, t));                 \
        t = eom_lead_##T(SET(-0.5), SET(0.0), eom_mul22_##T(z, t));                                                   \
        *cosine = eom_lead_##T(SET(1.0), SET(0.0), eom_mul22_##T(z, t));                                              \
    }                                                                                                                 \
    EOM_INLINE eom_twofold_##T eom_twofold_pivot_inverse_##T(eom_twofold_##T d, eom_twofold_##T ref)                  \
    {                                                                                                                 \
        V q = eom_pivot_inverse_##T(d.hi, ref.hi * SET(__DBL_EPSILON__));                                             \
        eom_twofold_##T p = eom_mul11_##T(q, d.hi);                                                                   \
        V rest = FMA(-q, d.lo, (SET(1.0) - p.hi) - p.lo);                                                             \
        return eom_fast_##T(q, q * rest);                                                                             \
    }

EOM_DEFINE_TWOFOLD(f64, eom_f64, eom_fma_f64, eom_set_f64)
EOM_DEFINE_TWOFOLD(f64v, eom_f64v, eom_fma_f64v, eom_set_f64v)

/* Beyond |x| = 2^20: |a| = M 2^e with an integer M, and of M 2^e 2/pi only the part below 4 counts.  So multiples of 4 are
 * left out of 2/pi, M is multiplied by the 256 bits that follow, and the product is cut to two bits of quadrant and 254
 * of fraction (Payne, Hanek 1983). */
static const uint64_t eom_two_over_pi[] = {
    0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561, 0xb7246e3a424dd2e0,
    0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484, 0xe99c7026b45f7e41, 0x3991d639835339f4,
    0x9c845f8bbdf9283b, 0x1ff897ffde05980f, 0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7, 0x4f463f669e5fea2d,
    0x7527bac7ebe5f17b, 0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab, 0xf0cfbc209af4361d,
    0xa9e391615ee61b08};

/* a less the multiple of pi/2 nearest to it, which is *n modulo 4; |a| > 2^20. */
EOM_COLD eom_twofold_f64 eom_reduce_far(double a, int *n)
{
    int exponent;
    uint64_t integer = (uint64_t)ldexp(frexp(fabs(a), &exponent), 53), product[5];
    exponent -= 53;
    int skip = exponent > 2 ? exponent - 2 : 0, word = skip / 64, bit = skip % 64, shift = 2 - (exponent - skip);
    unsigned __int128 carry = 0;
    for (int i = 3; i >= 0; i--) {
        uint64_t bits = eom_two_over_pi[word + i] << bit;
        if (bit) bits |= eom_two_over_pi[word + i + 1] >> (64 - bit);
        carry += (unsigned __int128)integer * bits;
        product[i + 1] = (uint64_t)carry;
        carry >>= 64;
    }
    product[0] = (uint64_t)carry;
    for (int i = 4; i > 0 && shift; i--) product[i] = product[i] >> shift | product[i - 1] << (64 - shift);

    uint64_t nearest = (product[1] + (UINT64_C(1) << 61)) >> 62;
    int64_t top = (int64_t)(product[1] - (nearest << 62));
    eom_twofold_f64 r = {ldexp((double)(top >> 32), -30), ldexp((double)(top & 0xffffffff), -62)};
    r = eom_add11_f64(r.hi, r.lo);
    for (int i = 2; i < 5; i++) {
        r = eom_add21_f64(r, ldexp((double)(product[i] >> 32), -30 - 64 * (i - 1)));
        r = eom_add21_f64(r, ldexp((double)(product[i] & 0xffffffff), -62 - 64 * (i - 1)));
    }
    r = eom_mul22_f64(r, (eom_twofold_f64){EOM_Q1, EOM_Q2});
    *n = a < 0 ? -(int)nearest : (int)nearest;
    return a < 0 ? eom_minus_f64(r) : r;
}

EOM_INLINE eom_twofold_f64 eom_reduce_near(eom_twofold_f64 x, int *n)
{
    double k = (eom_fma_f64(x.hi, EOM_TWO_OVER_PI, EOM_ROUNDER)) - EOM_ROUNDER;
    *n = (int)k;
    return eom_less_quarters_f64(x, k);
}

EOM_INLINE void eom_sincos_reduced(eom_twofold_f64 r, int n, eom_twofold_f64 *sine, eom_twofold_f64 *cosine)
{
    eom_twofold_f64 s, c;
    eom_series_f64(r, &s, &c);
    *sine = n & 1 ? c : s;
    *cosine = n & 1 ? s : c;
    if (n & 2) *sine = eom_minus_f64(*sine);
    if ((n + 1) & 2) *cosine = eom_minus_f64(*cosine);
}

/* The two parts of x are reduced apart from each other: the smaller one can be large too. */
EOM_COLD void eom_twofold_sincos_far(eom_twofold_f64 x, eom_twofold_f64 *sine, eom_twofold_f64 *cosine)
{
    if (!__builtin_isfinite(x.hi)) {
        double nan = x.hi - x.hi; /* raises `invalid` for infinities */
        *sine = *cosine = (eom_twofold_f64){nan, nan};
        return;
    }
    int n, less, again;
    eom_twofold_f64 r = eom_reduce_far(x.hi, &n), rest = {x.lo, 0.0};
    rest = fabs(x.lo) > EOM_SINCOS_LIMIT ? eom_reduce_far(x.lo, &less) : eom_reduce_near(rest, &less);
    r = eom_reduce_near(eom_add22_f64(r, rest), &again);
    eom_sincos_reduced(r, n + less + again, sine, cosine);
}

EOM_CALL void eom_twofold_sincos_f64(eom_twofold_f64 x, eom_twofold_f64 *sine, eom_twofold_f64 *cosine)
{
    if (EOM_UNLIKELY(!__builtin_islessequal(__builtin_fabs(x.hi), EOM_SINCOS_LIMIT))) {
        eom_twofold_sincos_far(x, sine, cosine);
    } else {
        int n;
        eom_twofold_f64 r = eom_reduce_near(x, &n);
        eom_sincos_reduced(r, n, sine, cosine);
    }
}

EOM_CALL void eom_twofold_sincos_f64v(eom_twofold_f64v x, eom_twofold_f64v *sine, eom_twofold_f64v *cosine)
{
    eom_i64v far = ((eom_i64v)x.hi & ~EOM_SIGN_BIT_F64) > (eom_i64v)eom_set_f64v(EOM_SINCOS_LIMIT);
    eom_twofold_f64v near = {(eom_f64v)((eom_i64v)x.hi & ~far), (eom_f64v)((eom_i64v)x.lo & ~far)}, s, c;
    eom_f64v n = eom_fma_f64v(near.hi, eom_set_f64v(EOM_TWO_OVER_PI), eom_set_f64v(EOM_ROUNDER));
    eom_series_f64v(eom_less_quarters_f64v(near, n - eom_set_f64v(EOM_ROUNDER)), &s, &c);
    eom_i64v odd = (eom_i64v)n << 63, half = (eom_i64v)n << 62 & EOM_SIGN_BIT_F64, exchanged = odd >> 63;
    eom_i64v hi = ((eom_i64v)s.hi ^ (eom_i64v)c.hi) & exchanged, lo = ((eom_i64v)s.lo ^ (eom_i64v)c.lo) & exchanged;
    sine->hi = (eom_f64v)((eom_i64v)s.hi ^ hi ^ half), sine->lo = (eom_f64v)((eom_i64v)s.lo ^ lo ^ half);
    cosine->hi = (eom_f64v)((eom_i64v)c.hi ^ hi ^ half ^ odd), cosine->lo = (eom_f64v)((eom_i64v)c.lo ^ lo ^ half ^ odd);
    if (EOM_UNLIKELY(eom_any_far_f64v(x.hi, EOM_SINCOS_LIMIT)))
        for (int i = 0; i < EOM_LANES_F64; i++)
            if (far[i]) {
                eom_twofold_f64 s_far, c_far;
                eom_twofold_sincos_far((eom_twofold_f64){x.hi[i], x.lo[i]}, &s_far, &c_far);
                sine->hi[i] = s_far.hi, sine->lo[i] = s_far.lo;
                cosine->hi[i] = c_far.hi, cosine->lo[i] = c_far.lo;
            }
}

#endif
