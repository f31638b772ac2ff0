/* Batches of states, eight to a vector.  Arrays are batch-contiguous: phi[i * batch + k].
 *
 * The planar articulated recursion in link frames.  Sines and cosines are those of the angles between
 * neighbours, so nothing is rotated into the ground's frame and back.  Two things make it fast beyond that:
 * several blocks of eight go through the recursion side by side, because one alone waits for its divisions,
 * with the next blocks' sines in the gaps; and memory: 3 N rows are more streams than the hardware follows,
 * so they are prefetched, and results that would not stay in the cache are written past it.  See chain.h.
 */
#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include "chain.h"
#include "sincos.h"

#if N < 2
#error "a chain of at least two links"
#endif

#ifndef WIDE /* blocks side by side */
#define WIDE (N <= 10 ? 2 : 3)
#endif
#ifndef AHEAD /* states to prefetch ahead */
#define AHEAD 64
#endif
#ifndef STREAM /* bytes of arguments and results from which on the results bypass the cache */
#define STREAM (N > 10 ? 1L << 22 : 1L << 62)
#endif
#ifndef UNROLL /* links per turn of the loops */
#define UNROLL (N <= 6 ? 6 : 1)
#endif

#define STR_(x) #x
#define STR(x) STR_(x)
#define UNROLLED _Pragma(STR(GCC unroll UNROLL))
#define EACH _Pragma("GCC unroll 8") for (int h = 0; h < W; h++)

INLINE v8 load(const double *a) { return *(const v8u *)a; }
INLINE void store(double *a, v8 x) { *(v8u *)a = x; }
INLINE void stream(double *a, v8 x)
{
#ifdef __AVX512F__
    _mm512_stream_pd(a, (__m512d)x);
#else
    store(a, x);
#endif
}
/* Near the end of a row it may lie outside the array, where a prefetch is harmless and a pointer is not. */
INLINE void *ahead(const double *a, long k) { return (void *)((uintptr_t)a + 8 * (uintptr_t)k); }

/* Row i of an array is at [i * stride]. */
typedef struct {
    const double *phi, *omega, *tau;
    double *acc;
    long stride;
    int stream; /* results past the cache; their rows are aligned then */
} rows;

typedef struct {
    v8 s[N][WIDE], c[N][WIDE];
} sines;

/* Sines and cosines of the angle between link i and its parent (the first: from the x axis). */
INLINE void trig(rows r, long k, int i, sines *t, const int W)
{
    long at = i * r.stride + k;
    EACH {
        long soon = at + 8 * h + AHEAD;
        __builtin_prefetch(ahead(r.phi, soon));
        __builtin_prefetch(ahead(r.omega, soon));
        __builtin_prefetch(ahead(r.tau, soon));
        if (!r.stream)
            __builtin_prefetch(ahead(r.acc, soon), 1);
        v8 x = load(r.phi + at + 8 * h);
        sincos8(i ? x - load(r.phi + at + 8 * h - r.stride) : x, &t->s[i][h], &t->c[i][h]);
    }
}

INLINE void keep(rows r, int i, long k, v8 a)
{
    (r.stream ? stream : store)(r.acc + i * r.stride + k, a);
}

/* States k to k + 8 W.  On entry t holds their sines, on return those of the states from next on. */
INLINE void blocks(rows r, long k, long next, sines *t, const chain *p, const int W)
{
    enum { E = N - 1 };
    v8 free_a[N][WIDE], kn[N][WIDE], ku[N][WIDE], lw2[N][WIDE];
    v8 uu[WIDE], nn[WIDE], un[WIDE], bu[WIDE], bn[WIDE], au[WIDE], an[WIDE], a[WIDE], torque[WIDE];

    /* The last link: its Lambda is constant in its own frame. */
    EACH {
        v8 w = load(r.omega + E * r.stride + k + 8 * h);
        torque[h] = load(r.tau + E * r.stride + k + 8 * h);
        free_a[E][h] = torque[h] * p->inv_T;
        bn[h] = torque[h] * p->arm;
        bu[h] = -p->S[E] * (w * w);
        nn[h] = uu[h] = un[h] = au[h] = an[h] = a[h] = w; /* only so that the compiler sees them set */
    }
    UNROLLED
    for (int i = N - 2; i >= 0; i--) {
        const v8 *s = t->s[i + 1], *c = t->c[i + 1];
        v8 ts[WIDE], c2[WIDE], s2[WIDE], sum[WIDE], dif[WIDE], d[WIDE], u2[WIDE], n2[WIDE];
        v8 w2[WIDE], fu[WIDE], fn[WIDE], inv[WIDE], sg[WIDE], lu[WIDE], x[WIDE], y[WIDE];
        /* Into this link's frame: Lambda's deviator turns twice as fast as a vector. */
        EACH ts[h] = s[h] + s[h];
        EACH s2[h] = ts[h] * c[h];
        EACH c2[h] = 1 - ts[h] * s[h];
        if (i == N - 2) {
            EACH d[h] = c2[h] * p->diff;
            EACH n2[h] = p->sum - d[h];
            EACH u2[h] = p->sum + d[h];
            EACH un[h] = s2[h] * p->diff;
        } else {
            EACH dif[h] = uu[h] - nn[h];
            EACH sum[h] = uu[h] + nn[h];
            EACH d[h] = c2[h] * dif[h] - s2[h] * un[h];
            EACH un[h] = s2[h] * dif[h] + c2[h] * un[h];
            EACH n2[h] = sum[h] - d[h];
            EACH u2[h] = sum[h] + d[h];
        }
        /* The subtree's Lambda at this link's far end is [u2, un; un, n2] / 2, its bias force (fu, fn). */
        EACH inv[h] = 1 / (p->T[i] + p->hl2[i] * n2[h]);
        EACH w2[h] = load(r.omega + i * r.stride + k + 8 * h);
        EACH w2[h] = w2[h] * w2[h];
        EACH lw2[i][h] = p->l[i] * w2[h];
        EACH fn[h] = s[h] * bu[h] + c[h] * bn[h];
        EACH fu[h] = c[h] * bu[h] - s[h] * bn[h];
        EACH lu[h] = p->hl[i] * un[h];
        EACH x[h] = lu[h] * w2[h] - fn[h];
        EACH {
            v8 own = load(r.tau + i * r.stride + k + 8 * h);
            y[h] = own - torque[h];
            torque[h] = own;
        }
        EACH y[h] = y[h] + p->l[i] * x[h];
        EACH sg[h] = p->S[i] + p->hl[i] * n2[h];
        if (i > 0) {
            EACH nn[h] = p->mj[i] + p->htb[i] * n2[h];
            EACH fu[h] = fu[h] - (p->S[i] + p->hl[i] * u2[h]) * w2[h];
            EACH uu[h] = p->m[i] + 0.5 * u2[h];
            EACH ku[i][h] = lu[h] * inv[h];
            EACH nn[h] = nn[h] * inv[h];
            EACH kn[i][h] = sg[h] * inv[h];
            EACH uu[h] = uu[h] - lu[h] * ku[i][h];
            EACH un[h] = ku[i][h] * p->tls[i];
            EACH free_a[i][h] = y[h] * inv[h];
            EACH bu[h] = fu[h] + ku[i][h] * y[h];
            EACH bn[h] = kn[i][h] * y[h] - x[h];
        } else {
            /* The ground's acceleration is (0, gravity). */
            EACH au[h] = p->gravity * t->s[0][h];
            EACH an[h] = p->gravity * t->c[0][h];
            EACH y[h] = y[h] - lu[h] * au[h];
            EACH y[h] = y[h] - sg[h] * an[h];
            EACH a[h] = y[h] * inv[h];
            EACH keep(r, 0, k + 8 * h, a[h]);
            trig(r, next, 0, t, W);
        }
    }
    UNROLLED
    for (int i = 1; i < N; i++) {
        const v8 *s = t->s[i], *c = t->c[i];
        v8 tu[WIDE], tn[WIDE];
        EACH tn[h] = an[h] + p->l[i - 1] * a[h];
        EACH tu[h] = au[h] - lw2[i - 1][h];
        EACH an[h] = c[h] * tn[h] - s[h] * tu[h];
        EACH au[h] = c[h] * tu[h] + s[h] * tn[h];
        if (i < E)
            EACH a[h] = (free_a[i][h] - ku[i][h] * au[h]) - kn[i][h] * an[h];
        else
            EACH a[h] = free_a[i][h] - p->arm * an[h];
        EACH keep(r, i, k + 8 * h, a[h]);
        trig(r, next, i, t, W);
    }
}

INLINE void first_trig(rows r, long k, sines *t, const int W)
{
    for (int i = 0; i < N; i++)
        trig(r, k, i, t, W);
}

/* As many states as fill blocks of W: how many. */
INLINE long wide(rows r, long k, long batch, const chain *p, const int W)
{
    const long step = 8 * W;
    sines t;
    if (k + step <= batch)
        first_trig(r, k, &t, W);
    for (; k + step <= batch; k += step)
        blocks(r, k, k + 2 * step <= batch ? k + step : k, &t, p, W);
    return k;
}

void simd_forward(long batch, const double *phi, const double *omega, const double *tau, const chain *p,
                  double *acc)
{
    rows cached = {phi, omega, tau, acc, batch, 0}, past = {phi, omega, tau, acc, batch, 1};
    int large = 4 * N * sizeof(double) * batch >= STREAM;
    long k;
    if (large && batch % 8 == 0 && (uintptr_t)acc % 64 == 0) {
        k = wide(past, 0, batch, p, WIDE);
#ifdef __AVX512F__
        _mm_sfence();
#endif
    } else
        k = wide(cached, 0, batch, p, WIDE);
    k = wide(cached, k, batch, p, 1);
    if (k < batch) {
        double in[3][N * 8] = {{0}}, out[N * 8];
        for (int i = 0; i < N; i++)
            for (long j = k; j < batch; j++) {
                in[0][i * 8 + j - k] = phi[i * batch + j];
                in[1][i * 8 + j - k] = omega[i * batch + j];
                in[2][i * 8 + j - k] = tau[i * batch + j];
            }
        rows last = {in[0], in[1], in[2], out, 8, 0};
        wide(last, 0, 8, p, 1);
        for (int i = 0; i < N; i++)
            for (long j = k; j < batch; j++)
                acc[i * batch + j] = out[i * 8 + j - k];
    }
}

void sincos_array(long n, const double *x, double *sn, double *cs)
{
    for (long k = 0; k + 8 <= n; k += 8) {
        v8 s, c;
        sincos8(load(x + k), &s, &c);
        store(sn + k, s);
        store(cs + k, c);
    }
}

void chain_setup(chain *p, const double *mass, const double *length, double gravity)
{
    chain_precompute(p, mass, length, gravity);
}

long chain_size(void) { return sizeof(chain); }
