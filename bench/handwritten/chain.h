/* Forward dynamics of a planar serial chain of N uniform rigid rods, written by hand.
 *
 * Angles phi_i are absolute (from the x axis), gravity acts along -y, and the torque tau_i acts on
 * link i and reacts on its parent, so that link i feels Q_i = tau_i - tau_{i+1}.  N is a compile-time
 * constant (-DN=5).  Everything that depends on parameters only is computed once, by chain_setup.
 */
#ifndef CHAIN_H
#define CHAIN_H

#ifndef N
#define N 5
#endif

typedef struct {
    /* Recursion.  Lambda is carried doubled where that saves an operation, hence the halves. */
    double l[N];      /* length L */
    double m[N];      /* mass */
    double T[N];      /* second moment about the joint */
    double S[N];      /* first moment */
    double hl[N];     /* L / 2 */
    double hl2[N];    /* L^2 / 2 */
    double mj[N];     /* m T - S^2 */
    double htb[N];    /* second moment about the far end, halved */
    double tls[N];    /* 2 (T/L - S) */
    double inv_T;     /* last link: 1 / T, and its Lambda in its own frame: nn, uu + nn, uu - nn */
    double arm;       /* S / T */
    double sum, diff;
    double gravity;
    /* Dense elimination, deepest link first: M_ij = k_ij cos(phi_i - phi_j). */
    double k[N][N];   /* L_i P_j for i < j, the diagonal of M for i = j */
    double P[N];      /* S_i + L_i (mass below) */
    double inv_last;  /* 1 / M_{N-1,N-1}, a constant */
} chain;

static void chain_precompute(chain *p, const double *mass, const double *length, double gravity)
{
    double below = 0;
    for (int i = N - 1; i >= 0; i--) {
        double m = mass[i], L = length[i], S = m * L / 2, T = m * L * L / 3;
        p->m[i] = m;
        p->l[i] = L;
        p->S[i] = S;
        p->T[i] = T;
        p->hl[i] = L / 2;
        p->hl2[i] = L * L / 2;
        p->mj[i] = m * m * L * L / 12;
        p->htb[i] = T / 2;                  /* a uniform rod is symmetric */
        p->tls[i] = 2 * (T / L - S);
        p->P[i] = S + L * below;
        p->k[i][i] = T + L * L * below;
        for (int j = 0; j < N; j++)
            if (j > i)
                p->k[i][j] = L * p->P[j];
            else if (j < i)
                p->k[i][j] = 0;
        below += m;
    }
    int e = N - 1;
    p->inv_T = p->inv_last = 1 / p->T[e];
    p->arm = p->S[e] / p->T[e];
    p->sum = p->m[e] + p->mj[e] / p->T[e];
    p->diff = p->m[e] - p->mj[e] / p->T[e];
    p->gravity = gravity;
}
#endif
