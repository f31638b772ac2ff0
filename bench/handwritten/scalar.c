/* One state at a time, row-major: phi[N], omega[N], tau[N] -> acc[N].  See chain.h. */
#define _GNU_SOURCE
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "chain.h"

#ifndef DENSE /* by measurement */
#define DENSE (N <= 7)
#endif

#define INLINE static inline __attribute__((always_inline))
#define UNROLLED _Pragma("GCC unroll 32")

#ifdef INLINE_SINCOS
/* Not libm: about 1.5 ulp for |x| < 1e4, and no branch. */
INLINE void sine_cosine(double x, double *sn, double *cs)
{
    double t = x * 0x1.45f306dc9c883p-1 + 0x1.8p52; /* 2/pi */
    double k = t - 0x1.8p52;
    double r = x - k * 0x1.921fb54442d18p0;
    r = r - k * 0x1.1a62633145c07p-54;
    double z = r * r;
    double p = ((((z * 0x1.5e0af186af739p-33 - 0x1.ae600a926c89ap-26) * z + 0x1.71de37961e4c6p-19) * z
                 - 0x1.a01a019e8357dp-13) * z + 0x1.1111111110bb1p-7) * z - 0x1.5555555555555p-3;
    double q = ((((0x1.1eeb68b109173p-29 - z * 0x1.907d7aebd5e3dp-37) * z - 0x1.27e4fa17a41b4p-22) * z
                 + 0x1.a01a019f4e867p-16) * z - 0x1.6c16c16c16966p-10) * z + 0x1.5555555555555p-5;
    double s = p * (z * r) + r, c = q * (z * z) + (1 - 0.5 * z);
    uint64_t at, us, uc;
    memcpy(&at, &t, 8);
    memcpy(&us, &s, 8);
    memcpy(&uc, &c, 8);
    uint64_t swap = (us ^ uc) & -(at & 1);
    us ^= swap ^ ((at & 2) << 62);
    uc ^= swap ^ (((at + 1) & 2) << 62);
    memcpy(sn, &us, 8);
    memcpy(cs, &uc, 8);
}
#else
#define sine_cosine sincos
#endif

#if DENSE
/* M and the right-hand side, then L D L^T that eliminates the deepest link first. */
INLINE void one(const double *phi, const double *omega, const double *tau, const chain *p, double *acc)
{
    double c[N], s[N], b[N], w2[N], M[N][N], x = 0, y = -p->gravity;
    UNROLLED
    for (int i = 0; i < N; i++)
        sine_cosine(phi[i], &s[i], &c[i]);
    UNROLLED
    for (int i = 0; i < N; i++) { /* (x, y): what the links above contribute, gravity included */
        w2[i] = omega[i] * omega[i];
        b[i] = (i < N - 1 ? tau[i] - tau[i + 1] : tau[i]) + p->P[i] * (c[i] * y - s[i] * x);
        x += p->l[i] * w2[i] * c[i];
        y += p->l[i] * w2[i] * s[i];
    }
    x = y = 0;
    UNROLLED
    for (int i = N - 1; i >= 0; i--) { /* and the links below */
        b[i] += p->l[i] * (c[i] * y - s[i] * x);
        x += p->P[i] * w2[i] * c[i];
        y += p->P[i] * w2[i] * s[i];
        UNROLLED
        for (int j = i + 1; j < N; j++)
            M[i][j] = p->k[i][j] * (c[i] * c[j] + s[i] * s[j]);
        M[i][i] = p->k[i][i];
    }
    UNROLLED
    for (int k = N - 1; k > 0; k--) {
        double inv = k == N - 1 ? p->inv_T : 1 / M[k][k];
        UNROLLED
        for (int i = k - 1; i >= 0; i--) {
            double f = M[i][k] * inv;
            UNROLLED
            for (int j = i; j >= 0; j--)
                M[j][i] -= f * M[j][k];
            b[i] -= f * b[k];
            M[i][k] = f;
        }
        b[k] *= inv;
    }
    acc[0] = b[0] = b[0] / M[0][0];
    UNROLLED
    for (int k = 1; k < N; k++) {
        UNROLLED
        for (int i = 0; i < k; i++)
            b[k] -= M[i][k] * b[i];
        acc[k] = b[k];
    }
}
#else
/* The planar articulated recursion in link frames. */
INLINE void one(const double *phi, const double *omega, const double *tau, const chain *p, double *acc)
{
    enum { E = N - 1 };
    double c[N], s[N], free_a[N], kn[N], ku[N], lw2[N], uu = 0, nn = 0, un = 0;
    double torque = tau[E], bn = torque * p->arm, bu = -p->S[E] * (omega[E] * omega[E]), au, an, a;
    free_a[E] = torque * p->inv_T;
    UNROLLED
    for (int i = N - 2; i >= 0; i--) {
        double w2 = omega[i] * omega[i], below = torque, co, si, u2, n2;
        sine_cosine(phi[i + 1] - phi[i], &si, &co);
        c[i + 1] = co;
        s[i + 1] = si;
        torque = tau[i];
        lw2[i] = p->l[i] * w2;
        /* Into this link's frame: Lambda's deviator turns twice as fast as a vector. */
        double ts = si + si, s2 = ts * co, c2 = 1 - ts * si;
        if (i == N - 2) {
            double d = c2 * p->diff;
            u2 = p->sum + d;
            n2 = p->sum - d;
            un = s2 * p->diff;
        } else {
            double h = uu + nn, e = uu - nn, d = c2 * e - s2 * un;
            u2 = h + d;
            n2 = h - d;
            un = s2 * e + c2 * un;
        }
        double fu = co * bu - si * bn, fn = si * bu + co * bn;
        /* The subtree's Lambda at this link's far end is [u2, un; un, n2] / 2, its bias (fu, fn). */
        double inv = 1 / (p->T[i] + p->hl2[i] * n2);
        double sg = p->S[i] + p->hl[i] * n2, lu = p->hl[i] * un;
        double x = lu * w2 - fn, y = (torque - below) + p->l[i] * x;
        if (i > 0) {
            kn[i] = sg * inv;
            ku[i] = lu * inv;
            free_a[i] = y * inv;
            uu = (p->m[i] + 0.5 * u2) - lu * ku[i];
            nn = (p->mj[i] + p->htb[i] * n2) * inv;
            un = ku[i] * p->tls[i];
            bn = kn[i] * y - x;
            bu = (fu - (p->S[i] + p->hl[i] * u2) * w2) + ku[i] * y;
        } else {
            sine_cosine(phi[0], &si, &co);
            au = p->gravity * si;
            an = p->gravity * co;
            acc[0] = a = (y - sg * an - lu * au) * inv;
        }
    }
    UNROLLED
    for (int i = 1; i < N; i++) {
        double tu = au - lw2[i - 1], tn = an + p->l[i - 1] * a;
        au = c[i] * tu + s[i] * tn;
        an = c[i] * tn - s[i] * tu;
        a = i < E ? (free_a[i] - kn[i] * an) - ku[i] * au : free_a[i] - p->arm * an;
        acc[i] = a;
    }
}
#endif

void scalar_forward(const double *phi, const double *omega, const double *tau, const chain *p, double *acc)
{
    one(phi, omega, tau, p, acc);
}

/* States in rows: phi[k * N + i]. */
void scalar_batch(long batch, const double *phi, const double *omega, const double *tau, const chain *p,
                  double *acc)
{
    for (long k = 0; k < batch; k++)
        scalar_forward(phi + k * N, omega + k * N, tau + k * N, p, acc + k * N);
}

void chain_setup(chain *p, const double *mass, const double *length, double gravity)
{
    chain_precompute(p, mass, length, gravity);
}

long chain_size(void) { return sizeof(chain); }
