/* eomgen_real.h: the arithmetic under the equations of motion that eomgen emits.
 *
 * The emitted C is one text, compiled once for each `real` type it is wanted for.  This header gives every type the
 * same operations.  It needs GCC or Clang (vector extensions) and nothing of Python, NumPy or eomgen.
 *
 *   suffix   type                                                          lanes
 *   f64      eom_f64  = double                                             1
 *   f64v     eom_f64v = vector of double (the widest of the target)        EOM_LANES_F64
 *   f32      eom_f32  = float                                              1
 *   f32v     eom_f32v = vector of float                                    EOM_LANES_F32
 *   f80      eom_f80  = long double (80 bits on x86; whatever it is elsewhere)  1
 *
 *   eom_set_T(double a)              a in every lane
 *   eom_fma_T(a, b, c)               a b + c: rounded once where the target has an instruction for it, else twice
 *   eom_fnma_T(a, b, c)              c - a b: the same
 *   eom_sincos_T(x, y, limit, &s, &c)  sine and cosine of x - y, section 5; of x if y is 0
 *   eom_sincos2_T(x, y, limit, z, w, limit2, &s, &c, &s2, &c2)  those of x - y and z - w: the same, doubles side by side
 *   eom_pivot_inverse_T(d, ref)      1/d if d > 16 EPS ref + MIN; else NaN and the `invalid` flag
 *   eom_sqrt_T, eom_exp_T, eom_log_T
 *
 * Text that serves all types says `#define EOM_REAL f64v` (or another suffix) and then uses the names without suffix:
 * eom_real, eom_fma, eom_sincos, ..., EOM_LANES, and EOM_NAME(f) for a name of its own, here f_f64v.  They follow
 * EOM_REAL wherever it is redefined; the header needs to be included only once.
 *
 * One state and a batch give the same bits: a lane of a vector type undergoes exactly the operations that the scalar
 * type does.  This and the error bounds need -ffp-contract=off, no -ffast-math and rounding to nearest.
 *
 * Sections: 1 target, 2 types, 3 broadcast, 4 fused multiply-add, 5 sine and cosine, 6 pivot, 7 functions, 8 names.
 */
#ifndef EOMGEN_REAL_H
#define EOMGEN_REAL_H

#include <math.h>
#include <stdint.h>


/* ---- 1. Target --------------------------------------------------------------------------------------------------- */

#ifndef __GNUC__
#error "eomgen_real.h needs GCC or Clang: it uses their vector types"
#endif
#if !defined(__cplusplus) && (!defined(__STDC_VERSION__) || __STDC_VERSION__ < 201112L)
#error "eomgen_real.h needs C11: without it aligned_alloc is not declared; leave -std out, or use -std=gnu11 or later"
#endif
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__)
#error "eomgen_real.h: -ffast-math reassociates the argument reduction of sine and cosine and destroys it"
#endif
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ == 2
#error "eomgen_real.h: doubles are computed in extended precision here (x87); compile with -msse2 -mfpmath=sse"
#endif

#if defined(__has_builtin) && !defined(EOM_WITHOUT_BUILTINS) /* the latter: to test the portable ways */
#define EOM_HAS(name) __has_builtin(name)
#else
#define EOM_HAS(name) 0
#endif

#define EOM_INLINE static inline __attribute__((always_inline, unused))
#define EOM_CALL static __attribute__((noinline, unused))
/* Functions that nothing is concluded about from their text. GCC 12 writes addresses in loops such that one has no base,
 * takes that for an access to a null pointer, the function for one without effects, and leaves out the call. */
#if defined(__has_attribute) && __has_attribute(noipa)
#define EOM_APART __attribute__((noipa))
#else
#define EOM_APART __attribute__((noinline))
#endif
#define EOM_COLD static __attribute__((noinline, cold, unused))
#define EOM_UNLIKELY(condition) __builtin_expect(!!(condition), 0)

/* Width of the vector types in bytes.  A smaller one than the target's may be defined before inclusion. */
#ifndef EOM_VECTOR_BYTES
#if defined(__AVX512F__)
#define EOM_VECTOR_BYTES 64
#elif defined(__AVX__)
#define EOM_VECTOR_BYTES 32
#else
#define EOM_VECTOR_BYTES 16
#endif
#endif
#define EOM_LANES_F64 (EOM_VECTOR_BYTES / 8)
#define EOM_LANES_F32 (EOM_VECTOR_BYTES / 4)

/* Whether a fused multiply-add is one instruction: decided once, for scalars and vectors alike. */
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA) || (defined(__FP_FAST_FMA) && !defined(__x86_64__))
#define EOM_FUSED 1
#else
#define EOM_FUSED 0
#endif

/* Hides from the optimiser how a vector came about.  Clang would otherwise turn a masked division into a selection of
 * quotients known beforehand, and the flag that the division raises would be lost. */
#if defined(__x86_64__) && defined(__AVX512F__)
#define EOM_OPAQUE(v) __asm__("" : "+v"(v))
#elif defined(__x86_64__)
#define EOM_OPAQUE(v) __asm__("" : "+x"(v))
#elif defined(__aarch64__)
#define EOM_OPAQUE(v) __asm__("" : "+w"(v))
#else
#define EOM_OPAQUE(v) __asm__("" : "+m"(v))
#endif


/* ---- 2. Types ---------------------------------------------------------------------------------------------------- */

typedef double eom_f64;
typedef float eom_f32;
typedef long double eom_f80;
typedef double eom_f64v __attribute__((vector_size(EOM_VECTOR_BYTES)));
typedef float eom_f32v __attribute__((vector_size(EOM_VECTOR_BYTES)));

/* The same anywhere in an array of scalars. */
typedef eom_f64 eom_loose_f64;
typedef eom_f32 eom_loose_f32;
typedef eom_f80 eom_loose_f80;
typedef double eom_loose_f64v __attribute__((vector_size(EOM_VECTOR_BYTES), aligned(8), may_alias));
typedef float eom_loose_f32v __attribute__((vector_size(EOM_VECTOR_BYTES), aligned(4), may_alias));

/* Internal: integers of the same shapes (what comparisons give), and the pair of doubles in which scalar sines and
 * cosines are computed, so that one text serves them and the vectors. */
typedef long long eom_i64v __attribute__((vector_size(EOM_VECTOR_BYTES)));
typedef int eom_i32v __attribute__((vector_size(EOM_VECTOR_BYTES)));
typedef float eom_f32h __attribute__((vector_size(EOM_VECTOR_BYTES / 2))); /* half as many floats: as many as doubles */
typedef double eom_f64x2 __attribute__((vector_size(16)));
typedef long long eom_i64x2 __attribute__((vector_size(16)));


/* ---- 3. Broadcast ------------------------------------------------------------------------------------------------ */

#if EOM_VECTOR_BYTES == 64
#define EOM_EACH_F64(a) {(a), (a), (a), (a), (a), (a), (a), (a)}
#define EOM_EACH_F32(a) {(a), (a), (a), (a), (a), (a), (a), (a), (a), (a), (a), (a), (a), (a), (a), (a)}
#elif EOM_VECTOR_BYTES == 32
#define EOM_EACH_F64(a) {(a), (a), (a), (a)}
#define EOM_EACH_F32(a) {(a), (a), (a), (a), (a), (a), (a), (a)}
#elif EOM_VECTOR_BYTES == 16
#define EOM_EACH_F64(a) {(a), (a)}
#define EOM_EACH_F32(a) {(a), (a), (a), (a)}
#else
#error "EOM_VECTOR_BYTES must be 16, 32 or 64"
#endif

EOM_INLINE eom_f64 eom_set_f64(double a) { return a; }
EOM_INLINE eom_f32 eom_set_f32(double a) { return (float)a; }
EOM_INLINE eom_f80 eom_set_f80(double a) { return a; }
EOM_INLINE eom_f64v eom_set_f64v(double a) { return (eom_f64v)EOM_EACH_F64(a); }
EOM_INLINE eom_f32v eom_set_f32v(double a) { return (eom_f32v)EOM_EACH_F32((float)a); }
EOM_INLINE eom_f64x2 eom_set_f64x2(double a) { return (eom_f64x2){a, a}; }


/* ---- 4. Fused multiply-add --------------------------------------------------------------------------------------- */

EOM_INLINE eom_f64 eom_fma_f64(eom_f64 a, eom_f64 b, eom_f64 c)
{
    return EOM_FUSED ? __builtin_fma(a, b, c) : a * b + c;
}

EOM_INLINE eom_f32 eom_fma_f32(eom_f32 a, eom_f32 b, eom_f32 c)
{
    return EOM_FUSED ? __builtin_fmaf(a, b, c) : a * b + c;
}

EOM_INLINE eom_f80 eom_fma_f80(eom_f80 a, eom_f80 b, eom_f80 c) { return a * b + c; }

/* Vectors: the compiler's own builtin, which needs no 60 ms of <immintrin.h>; lane by lane where none is known. */
#if !EOM_FUSED
#define EOM_FMA_F64X2(a, b, c) ((a) * (b) + (c))
#define EOM_FMA_F64V(a, b, c) ((a) * (b) + (c))
#define EOM_FMA_F32V(a, b, c) ((a) * (b) + (c))
#elif EOM_HAS(__builtin_elementwise_fma)
#define EOM_FMA_F64X2(a, b, c) __builtin_elementwise_fma(a, b, c)
#define EOM_FMA_F64V(a, b, c) __builtin_elementwise_fma(a, b, c)
#define EOM_FMA_F32V(a, b, c) __builtin_elementwise_fma(a, b, c)
#elif EOM_HAS(__builtin_ia32_vfmaddpd)
#define EOM_FMA_F64X2(a, b, c) __builtin_ia32_vfmaddpd(a, b, c)
#if EOM_VECTOR_BYTES == 64 && EOM_HAS(__builtin_ia32_vfmaddpd512_mask)
#define EOM_FMA_F64V(a, b, c) __builtin_ia32_vfmaddpd512_mask(a, b, c, -1, 4) /* all lanes, current rounding */
#define EOM_FMA_F32V(a, b, c) __builtin_ia32_vfmaddps512_mask(a, b, c, -1, 4)
#elif EOM_VECTOR_BYTES == 32
#define EOM_FMA_F64V(a, b, c) __builtin_ia32_vfmaddpd256(a, b, c)
#define EOM_FMA_F32V(a, b, c) __builtin_ia32_vfmaddps256(a, b, c)
#elif EOM_VECTOR_BYTES == 16
#define EOM_FMA_F64V(a, b, c) __builtin_ia32_vfmaddpd(a, b, c)
#define EOM_FMA_F32V(a, b, c) __builtin_ia32_vfmaddps(a, b, c)
#endif
#elif EOM_HAS(__builtin_aarch64_fmav2df)
#define EOM_FMA_F64X2(a, b, c) __builtin_aarch64_fmav2df(a, b, c)
#define EOM_FMA_F64V(a, b, c) __builtin_aarch64_fmav2df(a, b, c)
#define EOM_FMA_F32V(a, b, c) __builtin_aarch64_fmav4sf(a, b, c)
#endif

EOM_INLINE eom_f64x2 eom_fma_f64x2(eom_f64x2 a, eom_f64x2 b, eom_f64x2 c)
{
#ifdef EOM_FMA_F64X2
    return EOM_FMA_F64X2(a, b, c);
#else
    return (eom_f64x2){__builtin_fma(a[0], b[0], c[0]), __builtin_fma(a[1], b[1], c[1])};
#endif
}

EOM_INLINE eom_f64v eom_fma_f64v(eom_f64v a, eom_f64v b, eom_f64v c)
{
#ifdef EOM_FMA_F64V
    return EOM_FMA_F64V(a, b, c);
#else
    for (int i = 0; i < EOM_LANES_F64; i++) c[i] = __builtin_fma(a[i], b[i], c[i]);
    return c;
#endif
}

EOM_INLINE eom_f32v eom_fma_f32v(eom_f32v a, eom_f32v b, eom_f32v c)
{
#ifdef EOM_FMA_F32V
    return EOM_FMA_F32V(a, b, c);
#else
    for (int i = 0; i < EOM_LANES_F32; i++) c[i] = __builtin_fmaf(a[i], b[i], c[i]);
    return c;
#endif
}

/* c - a b, rounded as often. One instruction, where GCC would negate a by one of its own if -a is used twice. */
EOM_INLINE eom_f64 eom_fnma_f64(eom_f64 a, eom_f64 b, eom_f64 c) { return eom_fma_f64(-a, b, c); }
EOM_INLINE eom_f32 eom_fnma_f32(eom_f32 a, eom_f32 b, eom_f32 c) { return eom_fma_f32(-a, b, c); }
EOM_INLINE eom_f80 eom_fnma_f80(eom_f80 a, eom_f80 b, eom_f80 c) { return c - a * b; }
#if EOM_FUSED && EOM_VECTOR_BYTES == 64 && EOM_HAS(__builtin_ia32_vfnmaddpd512_mask)
EOM_INLINE eom_f64v eom_fnma_f64v(eom_f64v a, eom_f64v b, eom_f64v c)
{
    return __builtin_ia32_vfnmaddpd512_mask(a, b, c, -1, 4);
}
EOM_INLINE eom_f32v eom_fnma_f32v(eom_f32v a, eom_f32v b, eom_f32v c)
{
    return __builtin_ia32_vfnmaddps512_mask(a, b, c, -1, 4);
}
#else
EOM_INLINE eom_f64v eom_fnma_f64v(eom_f64v a, eom_f64v b, eom_f64v c) { return eom_fma_f64v(-a, b, c); }
EOM_INLINE eom_f32v eom_fnma_f32v(eom_f32v a, eom_f32v b, eom_f32v c) { return eom_fma_f32v(-a, b, c); }
#endif


/* ---- 5. Sine and cosine ------------------------------------------------------------------------------------------
 *
 * eom_sincos_T(x, 0, EOM_ANGLE, &s, &c).  Largest error, in units in the last place of the exact value:
 *
 *   f64, f64v   |x| <= 2^20: 0.94 ulp (0.9 where no operations are fused) by analysis of the rounding of every step;
 *               0.89 (0.79) the worst of 10^6 arguments measured with ball arithmetic (tests/test_sincos.py)
 *   f32, f32v   |x| <= 2^20: 0.6 ulp; computed in double, rounded to float once
 *   f80, and all types beyond 2^20: that of libm's sin and cos
 *
 * eom_sincos_T(x, y, EOM_DIFFERENCE, &s, &c).  Largest error, absolute, in eps of the type (EPS of section 6):
 *
 *   |x - y| < 8   0.5 and half a unit in the last place of x - y, which is rounded: 2 at most, nothing if x and y are
 *                 within a factor of two of each other, and as much as the target for results concedes (8 n eps and
 *                 what 2 eps of 1 rad in every angle make of them, docs/accuracy.md)
 *   beyond        2: nothing of x - y is lost, however much x and y differ in size
 *   f32, f32v     0.5 everywhere: floats are subtracted as doubles
 *
 * sin(-0.0) is -0.0, infinities give NaN and raise `invalid` as in libm, and no finite argument raises `invalid`,
 * `overflow` or `divide by zero` (but for `overflow` where x - y does).
 *
 * Method.  With k the integer nearest to 2x/pi and r = x - k pi/2, |r| <= pi/4, sine and cosine of x are those of r
 * up to exchange and signs, which k mod 4 decides.
 *
 * k.  Adding 1.5 2^52 to 2x/pi pushes the fraction out of the significand: the sum's low bits are k (two's complement),
 * and subtracting 1.5 2^52 again gives k as a double.  No conversion to an integer, hence no flag and no branch.
 *
 * r (EOM_REDUCE).  It is computed as hi - tail, hi being r rounded and tail the small rest.  Doubles up to 2^20 come as
 * close as 2^-60.5 to a multiple of pi/2 (29 pi/2 = 45.55...), so the reduction must be right to about 2^-115: pi/2 is
 * cut into parts P1 + P2 + ..., each short enough that the operations marked "exact" are.
 *
 * Polynomials (EOM_COMPOSE).  y = -r^2/2 (negative, so that every coefficient of sine has one sign, every one of
 * cosine another), r being hi - tail or, where the difference is below the error, hi.
 *     sin(hi - tail) = hi - (hi y S(y) + tail cos(hi))
 *     cos(hi - tail) = 1 + (y + hi tail) (1 + y C(y)), y of hi
 * S and C are minimax polynomials of degree 5 on |r| <= pi/4 (Remez exchange in 50 digits; then coefficient after
 * coefficient rounded to double and the rest fitted again): relative errors 2^-57.9 of the sine, 2^-63.9 of the cosine.
 * Where operations are fused, y + hi tail is rounded once, and tail stands for tail cos(hi), an error of 0.15 ulp.
 * Where they are not, the roundings of y and of the products would make more than 1 ulp: the sum w = 1 + y is rounded,
 * e = (1 - w) + y is its error, and cosine is w + (y^2 C(y) + (hi tail + e)); w also is cos(hi) of the sine.
 * For x = -0, tail is +0 and hi - (0 + 0) = -0.
 *
 * Differences beyond the limit.  Up to 2^20 the rounding error e of x - y (Knuth's TwoSum: exact) is below 2^-33, so that
 * sine and cosine change by e cos and -e sin.  Beyond, or where an angle is not finite, they are put together from those
 * of x and y; for f80 they always are.
 *
 * Exchange and signs.  Bits 0 and 1 of k, shifted to the place of the sign, are `odd` and `half`: odd k exchanges sine
 * and cosine, `half` flips the signs of both, `odd` that of the cosine.
 */

#define EOM_SINCOS_LIMIT 0x1p20
#define EOM_ANGLE EOM_SINCOS_LIMIT /* limits that eom_sincos_T takes */
#define EOM_DIFFERENCE 0x1.fffffffffffffp+2 /* the largest double below 8 */
#define EOM_SIGN_BIT_F64 (-0x7fffffffffffffffLL - 1)
#define EOM_ROUNDER 0x1.8p52                     /* 1.5 2^52 */
#define EOM_TWO_OVER_PI 0x1.45f306dc9c883p-1     /* 2/pi rounded to double */

#if EOM_FUSED
/* pi/2 = P1 + P2 + P3 with an error of 2^-141.8; 53, 33 and 53 bits.  |k| < 2^20, so k P2 has at most 53 bits. */
#define EOM_P1 0x1.921fb54442d18p+0
#define EOM_P2 0x1.1a626331p-54
#define EOM_P3 0x1.1701b839a2520p-88
#define EOM_REDUCE(V, W, FMA, SET, x, k, hi, tail)                                                                    \
    V r1[W], hi[W], tail[W];                                                                                          \
    EOM_BESIDE(W) r1[h] = FMA(k[h], SET(-EOM_P1), x[h]);          /* exact: a multiple of 2^-53 below 1 */            \
    EOM_BESIDE(W) hi[h] = FMA(k[h], SET(-EOM_P2), r1[h]);         /* r1 - k P2, rounded */                            \
    EOM_BESIDE(W) tail[h] = FMA(k[h], SET(EOM_P2), hi[h] - r1[h]); /* what that rounding lost: exact (Fast2Sum) */    \
    EOM_BESIDE(W) tail[h] = FMA(k[h], SET(EOM_P3), tail[h])       /* |k P3| < 2^-67 */
#define EOM_COMPOSE(V, W, FMA, SET, r, tail, half, y, s, c)                                                           \
    EOM_BESIDE(W) s[h] = r[h] - FMA(y[h] * r[h], s[h], tail[h]);                                                      \
    EOM_BESIDE(W)                                                                                                     \
        c[h] = FMA(FMA(half[h], r[h], r[h] * tail[h]), FMA(y[h], c[h], SET(1.0)), SET(1.0))
#else
/* pi/2 = P1 + P2 + P3 + P4 with an error of 2^-159.9; 33, 33, 33 and 53 bits, so that k P1, k P2, k P3 are exact. */
#define EOM_P1 0x1.921fb544p+0
#define EOM_P2 0x1.0b4611a6p-34
#define EOM_P3 0x1.3198a2e0p-69
#define EOM_P4 0x1.b839a252049c1p-104
#define EOM_REDUCE(V, W, FMA, SET, x, k, hi, tail)                                                                    \
    V hi[W], tail[W];                                                                                                 \
    EOM_BESIDE(W) {                                                                                                   \
        V r1 = x[h] - k[h] * SET(EOM_P1);      /* exact */                                                            \
        V w2 = k[h] * SET(EOM_P2);             /* exact */                                                            \
        V r2 = r1 - w2;                                                                                               \
        V t2 = (r2 - r1) + w2;                 /* exact: what r2 lost (Fast2Sum) */                                   \
        V t3 = k[h] * SET(EOM_P3) + t2;                                                                               \
        hi[h] = r2 - t3;                       /* anew, for where r2 cancels down to the size of k P3 */              \
        tail[h] = k[h] * SET(EOM_P4) + ((hi[h] - r2) + t3);                                                           \
    }
#define EOM_COMPOSE(V, W, FMA, SET, r, tail, half, y, s, c)                                                           \
    EOM_BESIDE(W) {                                                                                                   \
        V w = SET(1.0) + y[h], e = (SET(1.0) - w) + y[h];                                                             \
        s[h] = r[h] - FMA(y[h] * r[h], s[h], tail[h] * w);                                                            \
        c[h] = w + FMA(y[h] * y[h], c[h], FMA(r[h], tail[h], e));                                                     \
    }
#endif

/* Sine and cosine of the sign-free sums s and c for the quadrant in the low bits of n. */
#define EOM_QUADRANT(V, I, n, s, c, sine, cosine)                                                                     \
    I odd = (n) << 63, half_turn = (n) << 62;                                                                         \
    I flip = (((I)(s) ^ (I)(c)) & (odd >> 63)) ^ (half_turn & EOM_SIGN_BIT_F64);                                      \
    sine = (V)((I)(s) ^ flip);                                                                                        \
    cosine = (V)((I)(c) ^ flip ^ odd)

/* eom_sincos_near_T: |x| <= 2^20 in every lane.  eom_sincosf_near_T: the same to the precision of float; there r needs
 * only two parts of pi/2 (error 2^-87.9), and 3 and 4 coefficients suffice (minimax: 2^-28.0, 2^-33.9).  Both take W
 * angles and compute them side by side: each waits for its own results, and the coefficients are loaded once. */
#define EOM_BESIDE(W) _Pragma("GCC unroll 2") for (int h = 0; h < (W); h++)
#define EOM_DEFINE_SINCOS_NEAR(T, V, I, W, FMA, SET)                                                                  \
    EOM_INLINE void eom_sincos_near_##T(const V *x, V *sine, V *cosine)                                               \
    {                                                                                                                 \
        V n[W], k[W], half[W], y[W], s[W], c[W];                                                                      \
        EOM_BESIDE(W) n[h] = FMA(x[h], SET(EOM_TWO_OVER_PI), SET(EOM_ROUNDER));                                       \
        EOM_BESIDE(W) k[h] = n[h] - SET(EOM_ROUNDER);                                                                 \
        EOM_REDUCE(V, W, FMA, SET, x, k, r, tail);                                                                    \
        EOM_BESIDE(W) half[h] = r[h] * SET(-0.5);                                                                     \
        EOM_BESIDE(W) y[h] = half[h] * r[h];                                                                          \
        EOM_BESIDE(W) s[h] = FMA(y[h], SET(-0x1.5d8b55939ed3bp-27), SET(-0x1.ae5e4b83e192cp-21));                     \
        EOM_BESIDE(W) c[h] = FMA(y[h], SET(0x1.8fa6847e44155p-30), SET(0x1.1ee9dbcef2c89p-23));                       \
        EOM_BESIDE(W) s[h] = FMA(y[h], s[h], SET(-0x1.71de35552b51ap-15));                                            \
        EOM_BESIDE(W) c[h] = FMA(y[h], c[h], SET(0x1.27e4f7f191443p-17));                                             \
        EOM_BESIDE(W) s[h] = FMA(y[h], s[h], SET(-0x1.a01a019be9217p-10));                                            \
        EOM_BESIDE(W) c[h] = FMA(y[h], c[h], SET(0x1.a01a019c8f254p-12));                                             \
        EOM_BESIDE(W) s[h] = FMA(y[h], s[h], SET(-0x1.111111110f730p-5));                                             \
        EOM_BESIDE(W) c[h] = FMA(y[h], c[h], SET(0x1.6c16c16c15015p-7));                                              \
        EOM_BESIDE(W) s[h] = FMA(y[h], s[h], SET(-0x1.5555555555548p-2)); /* S(0) = -1/3 */                           \
        EOM_BESIDE(W) c[h] = FMA(y[h], c[h], SET(0x1.555555555554bp-3));  /* C(0) = 1/6 */                            \
        EOM_COMPOSE(V, W, FMA, SET, r, tail, half, y, s, c);                                                          \
        EOM_BESIDE(W) { EOM_QUADRANT(V, I, (I)n[h], s[h], c[h], sine[h], cosine[h]); }                                \
    }

#define EOM_DEFINE_SINCOSF_NEAR(T, V, I, FMA, SET)                                                                    \
    EOM_INLINE void eom_sincosf_near_##T(V x, V *sine, V *cosine)                                                     \
    {                                                                                                                 \
        V n = FMA(x, SET(EOM_TWO_OVER_PI), SET(EOM_ROUNDER)), k = n - SET(EOM_ROUNDER);                               \
        V r = FMA(k, SET(-0x1.0b4611a626331p-34), FMA(k, SET(-0x1.921fb544p+0), x)), z = r * r;                       \
        V s = FMA(z, SET(-0x1.9943e020b39eep-13), SET(0x1.11073afa9b5fap-7));                                         \
        s = FMA(z, s, SET(-0x1.5555452683e90p-3));                                                                    \
        s = FMA(z, s, SET(1.0)) * r;                                                                                  \
        V c = FMA(z, SET(0x1.99169ec5d61bdp-16), SET(-0x1.6c07f1650ef90p-10));                                        \
        c = FMA(z, c, SET(0x1.55553c788f1cdp-5));                                                                     \
        c = FMA(z, c, SET(-0x1.ffffffcb82ce4p-2));                                                                    \
        c = FMA(z, c, SET(1.0));                                                                                      \
        EOM_QUADRANT(V, I, (I)n, s, c, *sine, *cosine);                                                               \
    }

EOM_DEFINE_SINCOS_NEAR(f64x2, eom_f64x2, eom_i64x2, 1, eom_fma_f64x2, eom_set_f64x2)
EOM_DEFINE_SINCOS_NEAR(f64v, eom_f64v, eom_i64v, 1, eom_fma_f64v, eom_set_f64v)
EOM_DEFINE_SINCOS_NEAR(two_f64v, eom_f64v, eom_i64v, 2, eom_fma_f64v, eom_set_f64v)
EOM_DEFINE_SINCOSF_NEAR(f64x2, eom_f64x2, eom_i64x2, eom_fma_f64x2, eom_set_f64x2)
EOM_DEFINE_SINCOSF_NEAR(f64v, eom_f64v, eom_i64v, eom_fma_f64v, eom_set_f64v)

/* Scalars: lane 0 of a pair; an addition of two lanes costs what one of one lane does, so that a second angle is free. */

typedef struct {
    double s, c;
} eom_sincos_pair;

/* Of x - y from those of x and y. */
EOM_COLD eom_sincos_pair eom_sincos_far_f64(double x, double y)
{
    double sx = sin(x), cx = cos(x), sy = sin(y), cy = cos(y);
    return (eom_sincos_pair){sx * cy - cx * sy, cx * cy + sx * sy};
}

/* eom_sincos_rest_T: corrects sine and cosine of d, x - y rounded, by what the rounding took, in lanes beyond
 * EOM_DIFFERENCE.  eom_sincos_within_T: those of x - y where d is at most 2^20; beyond: whether to correct them. */
#define EOM_DEFINE_SINCOS_WITHIN(T, V, I, FMA, SET)                                                                   \
    EOM_INLINE void eom_sincos_rest_##T(V x, V y, V d, V *sine, V *cosine)                                            \
    {                                                                                                                 \
        V s = *sine, c = *cosine, rest = x - d, e = (x - (d + rest)) + (rest - y);                                    \
        I small = ((I)d & ~EOM_SIGN_BIT_F64) <= (I)SET(EOM_DIFFERENCE);                                               \
        *sine = (V)(((I)s & small) | ((I)FMA(e, c, s) & ~small));                                                     \
        *cosine = (V)(((I)c & small) | ((I)FMA(-e, s, c) & ~small));                                                  \
    }                                                                                                                 \
    EOM_INLINE void eom_sincos_within_##T(V x, V y, V d, int beyond, V *sine, V *cosine)                              \
    {                                                                                                                 \
        eom_sincos_near_##T(&d, sine, cosine);                                                                        \
        if (EOM_UNLIKELY(beyond)) eom_sincos_rest_##T(x, y, d, sine, cosine);                                         \
    }

EOM_DEFINE_SINCOS_WITHIN(f64x2, eom_f64x2, eom_i64x2, eom_fma_f64x2, eom_set_f64x2)
EOM_DEFINE_SINCOS_WITHIN(f64v, eom_f64v, eom_i64v, eom_fma_f64v, eom_set_f64v)

EOM_INLINE int eom_far_f64(double x, double limit)
{
    return EOM_UNLIKELY(!__builtin_islessequal(__builtin_fabs(x), limit));
}

EOM_INLINE void eom_sincos_f64(eom_f64 x, eom_f64 y, double limit, eom_f64 *sine, eom_f64 *cosine)
{
    eom_f64 d = x - y;
    int beyond = eom_far_f64(d, limit);
    if (EOM_UNLIKELY(beyond && eom_far_f64(d, EOM_SINCOS_LIMIT))) {
        eom_sincos_pair far = eom_sincos_far_f64(x, y);
        *sine = far.s;
        *cosine = far.c;
    } else {
        eom_f64x2 s, c;
        eom_sincos_within_f64x2((eom_f64x2){x, 0.0}, (eom_f64x2){y, 0.0}, (eom_f64x2){d, 0.0}, beyond, &s, &c);
        *sine = s[0];
        *cosine = c[0];
    }
}

/* The same as a call, for code in which compile time counts more. */
#define EOM_DEFINE_SINCOS_CALL(T)                                                                                     \
    EOM_CALL void eom_sincos_call_##T(eom_##T x, eom_##T y, double limit, eom_##T *sine, eom_##T *cosine)             \
    {                                                                                                                 \
        eom_sincos_##T(x, y, limit, sine, cosine);                                                                    \
    }

EOM_DEFINE_SINCOS_CALL(f64)

EOM_INLINE void eom_sincos2_f64(eom_f64 x, eom_f64 y, double limit, eom_f64 z, eom_f64 w, double limit2, eom_f64 *sine,
                                eom_f64 *cosine, eom_f64 *sine2, eom_f64 *cosine2)
{
    eom_f64 d = x - y, d2 = z - w;
    int beyond = eom_far_f64(d, limit) || eom_far_f64(d2, limit2);
    if (EOM_UNLIKELY(beyond && (eom_far_f64(d, EOM_SINCOS_LIMIT) || eom_far_f64(d2, EOM_SINCOS_LIMIT)))) {
        eom_sincos_call_f64(x, y, limit, sine, cosine);
        eom_sincos_call_f64(z, w, limit2, sine2, cosine2);
    } else {
        /* Adjacent angles must not be loaded as one vector: it would wait for the two stores of an integrator. */
        EOM_OPAQUE(d2);
        eom_f64x2 s, c;
        eom_sincos_within_f64x2((eom_f64x2){x, z}, (eom_f64x2){y, w}, (eom_f64x2){d, d2}, beyond, &s, &c);
        *sine = s[0];
        *cosine = c[0];
        *sine2 = s[1];
        *cosine2 = c[1];
    }
}

EOM_INLINE void eom_sincos_f32(eom_f32 x, eom_f32 y, double limit, eom_f32 *sine, eom_f32 *cosine)
{
    (void)limit;
    if (EOM_UNLIKELY(!__builtin_islessequal(__builtin_fabsf(x - y), (float)EOM_SINCOS_LIMIT))) {
        eom_sincos_pair far = eom_sincos_far_f64(x, y);
        *sine = (float)far.s;
        *cosine = (float)far.c;
    } else {
        eom_f64x2 s, c;
        eom_sincosf_near_f64x2((eom_f64x2){(double)x - y, 0.0}, &s, &c);
        *sine = (float)s[0];
        *cosine = (float)c[0];
    }
}

EOM_INLINE void eom_sincos_f80(eom_f80 x, eom_f80 y, double limit, eom_f80 *sine, eom_f80 *cosine)
{
    if (__builtin_islessequal(__builtin_fabsl(x - y), (eom_f80)limit)) {
        *sine = sinl(x - y);
        *cosine = cosl(x - y);
    } else {
        eom_f80 sx = sinl(x), cx = cosl(x), sy = sinl(y), cy = cosl(y);
        *sine = sx * cy - cx * sy;
        *cosine = cx * cy + sx * sy;
    }
}

/* Vectors: not 0 if any lane is beyond a limit, infinite or NaN.  The bits of |x| are compared as integers, which
 * raises no flag; without mask registers the difference's signs are gathered. */

EOM_INLINE int eom_any_far_f64v(eom_f64v x, double limit)
{
    eom_i64v bits = (eom_i64v)x & ~EOM_SIGN_BIT_F64, most = (eom_i64v)eom_set_f64v(limit);
#if EOM_VECTOR_BYTES == 64 && EOM_HAS(__builtin_ia32_cmpq512_mask)
    return __builtin_ia32_cmpq512_mask(bits, most, 6, -1); /* 6: > */
#else
    bits = most - bits;
#if EOM_VECTOR_BYTES == 32 && EOM_HAS(__builtin_ia32_movmskpd256)
    return __builtin_ia32_movmskpd256((eom_f64v)bits);
#elif EOM_VECTOR_BYTES == 16 && EOM_HAS(__builtin_ia32_movmskpd)
    return __builtin_ia32_movmskpd((eom_f64v)bits);
#else
    long long any = 0;
    for (int i = 0; i < EOM_LANES_F64; i++) any |= bits[i];
    return any < 0;
#endif
#endif
}

EOM_INLINE int eom_any_far_f32v(eom_f32v x, double limit)
{
    eom_i32v bits = (eom_i32v)x & 0x7fffffff, most = (eom_i32v)eom_set_f32v(limit);
#if EOM_VECTOR_BYTES == 64 && EOM_HAS(__builtin_ia32_cmpd512_mask)
    return __builtin_ia32_cmpd512_mask(bits, most, 6, -1);
#else
    bits = most - bits;
#if EOM_VECTOR_BYTES == 32 && EOM_HAS(__builtin_ia32_movmskps256)
    return __builtin_ia32_movmskps256((eom_f32v)bits);
#elif EOM_VECTOR_BYTES == 16 && EOM_HAS(__builtin_ia32_movmskps)
    return __builtin_ia32_movmskps((eom_f32v)bits);
#else
    int any = 0;
    for (int i = 0; i < EOM_LANES_F32; i++) any |= bits[i];
    return any < 0;
#endif
#endif
}

/* The same for any lane of two vectors, which may be left to be told apart. */
EOM_INLINE int eom_any_far_two_f64v(eom_f64v x, double limit, eom_f64v y, double limit2)
{
#if EOM_VECTOR_BYTES == 64 && EOM_HAS(__builtin_ia32_rangepd512_mask)
    if (limit == limit2) /* 11: the larger absolute value, or that which is not NaN, of which sine and cosine are NaN */
        return eom_any_far_f64v(__builtin_ia32_rangepd512_mask(x, y, 11, x, -1, 4), limit);
#endif
    return eom_any_far_f64v(x, limit) | eom_any_far_f64v(y, limit2);
}

/* A vector of floats as two vectors of doubles and back. */

#if EOM_HAS(__builtin_shufflevector)
#if EOM_VECTOR_BYTES == 64
#define EOM_LOW_HALF 0, 1, 2, 3, 4, 5, 6, 7
#define EOM_HIGH_HALF 8, 9, 10, 11, 12, 13, 14, 15
#elif EOM_VECTOR_BYTES == 32
#define EOM_LOW_HALF 0, 1, 2, 3
#define EOM_HIGH_HALF 4, 5, 6, 7
#else
#define EOM_LOW_HALF 0, 1
#define EOM_HIGH_HALF 2, 3
#endif

EOM_INLINE void eom_widen_f32v(eom_f32v x, eom_f64v *low, eom_f64v *high)
{
    *low = __builtin_convertvector(__builtin_shufflevector(x, x, EOM_LOW_HALF), eom_f64v);
    *high = __builtin_convertvector(__builtin_shufflevector(x, x, EOM_HIGH_HALF), eom_f64v);
}

EOM_INLINE eom_f32v eom_narrow_f32v(eom_f64v low, eom_f64v high)
{
    return __builtin_shufflevector(__builtin_convertvector(low, eom_f32h), __builtin_convertvector(high, eom_f32h),
                                   EOM_LOW_HALF, EOM_HIGH_HALF);
}
#else
EOM_INLINE void eom_widen_f32v(eom_f32v x, eom_f64v *low, eom_f64v *high)
{
    eom_f64v l = {0}, h = {0};
    for (int i = 0; i < EOM_LANES_F64; i++) {
        l[i] = x[i];
        h[i] = x[i + EOM_LANES_F64];
    }
    *low = l;
    *high = h;
}

EOM_INLINE eom_f32v eom_narrow_f32v(eom_f64v low, eom_f64v high)
{
    eom_f32v x = {0};
    for (int i = 0; i < EOM_LANES_F32; i++) x[i] = (float)(i < EOM_LANES_F64 ? low[i] : high[i - EOM_LANES_F64]);
    return x;
}
#endif

EOM_INLINE void eom_sincos_within_f32v(eom_f32v x, eom_f32v y, eom_f32v *sine, eom_f32v *cosine)
{
    eom_f64v low, high, y_low, y_high, s_low, c_low, s_high, c_high;
    eom_widen_f32v(x, &low, &high);
    eom_widen_f32v(y, &y_low, &y_high);
    eom_sincosf_near_f64v(low - y_low, &s_low, &c_low);
    eom_sincosf_near_f64v(high - y_high, &s_high, &c_high);
    *sine = eom_narrow_f32v(s_low, s_high);
    *cosine = eom_narrow_f32v(c_low, c_high);
}

/* The whole vector when some lane is far: libm for the far lanes, zeros in their place while the others are computed,
 * which thus get the bits they always get. */

EOM_COLD void eom_sincos_far_f64v(const eom_f64v *x, const eom_f64v *y, eom_f64v *sine, eom_f64v *cosine)
{
    eom_i64v far = ((eom_i64v)(*x - *y) & ~EOM_SIGN_BIT_F64) > (eom_i64v)eom_set_f64v(EOM_SINCOS_LIMIT);
    eom_f64v u = (eom_f64v)((eom_i64v)*x & ~far), v = (eom_f64v)((eom_i64v)*y & ~far);
    eom_sincos_within_f64v(u, v, u - v, 1, sine, cosine);
    for (int i = 0; i < EOM_LANES_F64; i++)
        if (far[i]) {
            eom_sincos_pair pair = eom_sincos_far_f64((*x)[i], (*y)[i]);
            (*sine)[i] = pair.s;
            (*cosine)[i] = pair.c;
        }
}

EOM_COLD void eom_sincos_far_f32v(const eom_f32v *x, const eom_f32v *y, eom_f32v *sine, eom_f32v *cosine)
{
    eom_i32v far = ((eom_i32v)(*x - *y) & 0x7fffffff) > (eom_i32v)eom_set_f32v(EOM_SINCOS_LIMIT);
    eom_sincos_within_f32v((eom_f32v)((eom_i32v)*x & ~far), (eom_f32v)((eom_i32v)*y & ~far), sine, cosine);
    for (int i = 0; i < EOM_LANES_F32; i++)
        if (far[i]) {
            eom_sincos_pair pair = eom_sincos_far_f64((*x)[i], (*y)[i]);
            (*sine)[i] = (float)pair.s;
            (*cosine)[i] = (float)pair.c;
        }
}

/* Only copies made on the rare path have their address taken: x, y, s and c stay in registers. */

EOM_INLINE void eom_sincos_f64v(eom_f64v x, eom_f64v y, double limit, eom_f64v *sine, eom_f64v *cosine)
{
    eom_f64v d = x - y;
    int beyond = eom_any_far_f64v(d, limit);
    if (EOM_UNLIKELY(beyond && eom_any_far_f64v(d, EOM_SINCOS_LIMIT))) {
        eom_f64v x_far = x, y_far = y, s_far, c_far;
        eom_sincos_far_f64v(&x_far, &y_far, &s_far, &c_far);
        *sine = s_far;
        *cosine = c_far;
    } else {
        eom_f64v s, c;
        eom_sincos_within_f64v(x, y, d, beyond, &s, &c);
        *sine = s;
        *cosine = c;
    }
}

EOM_INLINE void eom_sincos_f32v(eom_f32v x, eom_f32v y, double limit, eom_f32v *sine, eom_f32v *cosine)
{
    (void)limit;
    if (EOM_UNLIKELY(eom_any_far_f32v(x - y, EOM_SINCOS_LIMIT))) {
        eom_f32v x_far = x, y_far = y, s_far, c_far;
        eom_sincos_far_f32v(&x_far, &y_far, &s_far, &c_far);
        *sine = s_far;
        *cosine = c_far;
    } else {
        eom_f32v s, c;
        eom_sincos_within_f32v(x, y, &s, &c);
        *sine = s;
        *cosine = c;
    }
}

EOM_DEFINE_SINCOS_CALL(f32)
EOM_DEFINE_SINCOS_CALL(f80)
EOM_DEFINE_SINCOS_CALL(f64v)
EOM_DEFINE_SINCOS_CALL(f32v)

#define EOM_DEFINE_SINCOS2(T)                                                                                         \
    EOM_INLINE void eom_sincos2_##T(eom_##T x, eom_##T y, double limit, eom_##T z, eom_##T w, double limit2,          \
                                    eom_##T *sine, eom_##T *cosine, eom_##T *sine2, eom_##T *cosine2)                 \
    {                                                                                                                 \
        eom_sincos_##T(x, y, limit, sine, cosine);                                                                    \
        eom_sincos_##T(z, w, limit2, sine2, cosine2);                                                                 \
    }

EOM_DEFINE_SINCOS2(f32)
EOM_DEFINE_SINCOS2(f80)
EOM_DEFINE_SINCOS2(f32v)

EOM_INLINE void eom_sincos2_f64v(eom_f64v x, eom_f64v y, double limit, eom_f64v z, eom_f64v w, double limit2,
                                 eom_f64v *sine, eom_f64v *cosine, eom_f64v *sine2, eom_f64v *cosine2)
{
    eom_f64v d[] = {x - y, z - w}, s[2], c[2];
    int beyond = eom_any_far_two_f64v(d[0], limit, d[1], limit2);
    if (EOM_UNLIKELY(beyond && eom_any_far_two_f64v(d[0], EOM_SINCOS_LIMIT, d[1], EOM_SINCOS_LIMIT))) {
        eom_f64v far[4];
        eom_sincos_call_f64v(x, y, limit, &far[0], &far[1]);
        eom_sincos_call_f64v(z, w, limit2, &far[2], &far[3]);
        s[0] = far[0], c[0] = far[1], s[1] = far[2], c[1] = far[3];
    } else {
        eom_sincos_near_two_f64v(d, s, c);
        if (EOM_UNLIKELY(beyond)) {
            eom_sincos_rest_f64v(x, y, d[0], &s[0], &c[0]);
            eom_sincos_rest_f64v(z, w, d[1], &s[1], &c[1]);
        }
    }
    *sine = s[0], *cosine = c[0], *sine2 = s[1], *cosine2 = c[1];
}


/* ---- 6. Pivot ----------------------------------------------------------------------------------------------------
 *
 * eom_pivot_inverse_T(d, ref): 1/d where d > 16 EPS ref + MIN (EPS: of the type, 2^-52 for double; MIN: its least normal
 * number, below which digits are lost), ref being the size of the terms that d was computed from; elsewhere, and where d
 * or ref is NaN, NaN with the flag `invalid`. The test is d - 16 EPS ref > MIN, which one fma and a comparison decide: the
 * factor is a power of two, and below 1, so that no size of d or ref overflows.
 */

#define EOM_SAFELY_POSITIVE(FMA, SET, d, ref, EPS, MIN) (FMA(ref, SET(-16 * EPS), d) > SET(MIN))

/* volatile: no compiler may know the quotient beforehand. */
#define EOM_DEFINE_PIVOT_SCALAR(T, EPS, MIN)                                                                          \
    EOM_INLINE eom_##T eom_pivot_inverse_##T(eom_##T d, eom_##T ref)                                                  \
    {                                                                                                                 \
        if (__builtin_expect(EOM_SAFELY_POSITIVE(eom_fma_##T, (eom_##T), d, ref, EPS, MIN), 1)) return 1 / d;         \
        volatile eom_##T zero = 0;                                                                                    \
        return zero / zero;                                                                                           \
    }

/* In the other lanes a signalling NaN stands for d: what is divided by it is NaN and raises the flag. */
#define EOM_DEFINE_PIVOT_VECTOR(T, I, EACH, NAN, EPS, MIN)                                                            \
    EOM_INLINE eom_##T eom_pivot_inverse_##T(eom_##T d, eom_##T ref)                                                  \
    {                                                                                                                 \
        I good = (I)EOM_SAFELY_POSITIVE(eom_fma_##T, eom_set_##T, d, ref, EPS, MIN);                                  \
        eom_##T divisor = (eom_##T)(((I)d & good) | ((I)EACH(NAN) & ~good));                                          \
        EOM_OPAQUE(divisor);                                                                                          \
        return eom_set_##T(1) / divisor;                                                                              \
    }

EOM_DEFINE_PIVOT_SCALAR(f64, __DBL_EPSILON__, __DBL_MIN__)
EOM_DEFINE_PIVOT_SCALAR(f32, __FLT_EPSILON__, __FLT_MIN__)
EOM_DEFINE_PIVOT_SCALAR(f80, __LDBL_EPSILON__, __LDBL_MIN__)
EOM_DEFINE_PIVOT_VECTOR(f64v, eom_i64v, EOM_EACH_F64, 0x7ff4000000000000LL, __DBL_EPSILON__, __DBL_MIN__)
EOM_DEFINE_PIVOT_VECTOR(f32v, eom_i32v, EOM_EACH_F32, 0x7fa00000, __FLT_EPSILON__, __FLT_MIN__)


/* ---- 7. Functions ------------------------------------------------------------------------------------------------
 *
 * For expressions of users; nothing of a mechanism needs them.  Scalars by libm, vectors lane by lane (with
 * -fno-math-errno the compilers turn the loop of square roots into vector instructions).
 */

#define EOM_DEFINE_FUNCTION(name, f, ff, fl)                                                                          \
    EOM_INLINE eom_f64 eom_##name##_f64(eom_f64 x) { return f(x); }                                                   \
    EOM_INLINE eom_f32 eom_##name##_f32(eom_f32 x) { return ff(x); }                                                  \
    EOM_INLINE eom_f80 eom_##name##_f80(eom_f80 x) { return fl(x); }                                                  \
    EOM_INLINE eom_f64v eom_##name##_f64v(eom_f64v x)                                                                 \
    {                                                                                                                 \
        for (int i = 0; i < EOM_LANES_F64; i++) x[i] = f(x[i]);                                                       \
        return x;                                                                                                     \
    }                                                                                                                 \
    EOM_INLINE eom_f32v eom_##name##_f32v(eom_f32v x)                                                                 \
    {                                                                                                                 \
        for (int i = 0; i < EOM_LANES_F32; i++) x[i] = ff(x[i]);                                                      \
        return x;                                                                                                     \
    }

EOM_DEFINE_FUNCTION(sqrt, sqrt, sqrtf, sqrtl)
EOM_DEFINE_FUNCTION(exp, exp, expf, expl)
EOM_DEFINE_FUNCTION(log, log, logf, logl)


/* ---- 8. Names of the current real type ---------------------------------------------------------------------------
 *
 * They follow EOM_REAL as it stands where they are used.
 */

#define EOM_JOIN_(a, b) a##b
#define EOM_JOIN(a, b) EOM_JOIN_(a, b)
#define EOM_NAME(name) EOM_JOIN(name##_, EOM_REAL)

#define eom_real EOM_JOIN(eom_, EOM_REAL)
#define eom_loose EOM_NAME(eom_loose)
#define eom_set EOM_JOIN(eom_set_, EOM_REAL)
#define eom_fma EOM_JOIN(eom_fma_, EOM_REAL)
#define eom_fnma EOM_JOIN(eom_fnma_, EOM_REAL)
#define eom_sincos EOM_JOIN(eom_sincos_, EOM_REAL)
#define eom_sincos2 EOM_JOIN(eom_sincos2_, EOM_REAL)
#define eom_sincos_call EOM_JOIN(eom_sincos_call_, EOM_REAL)
#define eom_pivot_inverse EOM_JOIN(eom_pivot_inverse_, EOM_REAL)
#define eom_sqrt EOM_JOIN(eom_sqrt_, EOM_REAL)
#define eom_exp EOM_JOIN(eom_exp_, EOM_REAL)
#define eom_log EOM_JOIN(eom_log_, EOM_REAL)

/* How many vectors a wide kernel carries side by side for each of its variables: a recursion along a chain waits for
 * its own results most of the time, and a second, independent stream of states fills the waits. */
#define EOM_WIDE EOM_JOIN(EOM_WIDE_, EOM_REAL)
#define EOM_WIDE_f64 1
#define EOM_WIDE_f32 1
#define EOM_WIDE_f80 1
#define EOM_WIDE_f64v 2
#define EOM_WIDE_f32v 2

/* The same where a value is a vector of floats and its arguments are vectors of doubles. */
#define EOM_WIDER EOM_JOIN(EOM_WIDER_, EOM_REAL)
#define EOM_WIDER_f64 1
#define EOM_WIDER_f64v 4

#define EOM_LANES EOM_JOIN(EOM_LANES_, EOM_REAL) /* 1 for scalars; may be used in #if */
#define EOM_LANES_f64 1
#define EOM_LANES_f32 1
#define EOM_LANES_f80 1
#define EOM_LANES_f64v EOM_LANES_F64
#define EOM_LANES_f32v EOM_LANES_F32

/* In a kernel (see eomgen_model.h): element i of an operand, as an array of STREAMS reals, and the request for where that
 * of a later block of states lies. Elements of one state are adjacent. */
#define EOM_AT(a, i) ((eom_loose *)(a + (i) * a##_pitch))
#define EOM_PLACE(a, position)                                                                                        \
    const intptr_t a##_pitch = EOM_LANES > 1 ? places[position].pitch : 1;                                            \
    const uintptr_t a##_next = EOM_LANES > 1 ? places[position].next : 0
#define EOM_FETCH(a, i)                                                                                               \
    _Pragma("GCC unroll 2") for (int h = 0; h < STREAMS; h++)                                                         \
        if (EOM_LANES > 1 && h * sizeof(real) % 64 == 0)                                                              \
            __builtin_prefetch((const void *)(a##_next + ((i) * a##_pitch + h * EOM_LANES) * sizeof(scalar)))

#endif
