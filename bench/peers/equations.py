"""The equations as a user would type them into a tool that builds expressions: only +, -, * and /.

Each sine and cosine is taken once and the linear system is solved symbolically, deepest link first, which
is the best that such a user can do with dense equations; `recursion` is the O(n) elimination by hand.
"""

from bench.peers.mechanism import GRAVITY, LINKS


def accelerations(links, mechanism, q, v, u, sin, cos, algorithm="dense"):
    """A list of expressions; q, v, u are sequences of the tool's symbols."""
    if algorithm == "recursion":
        return recursion(links, q, v, u, sin, cos)
    return eliminate(*dense(links, mechanism, q, v, u, sin, cos))


def dense(links, mechanism, q, v, u, sin, cos):
    """Mass matrix (its lower part) and right-hand side, in the order angle, length of link 1, 2, ..."""
    bodies, (far, slide) = LINKS[mechanism]
    free = slide != 0
    c, s = [cos(q[i]) for i in range(links)], [sin(q[i]) for i in range(links)]
    size = 2 if free else 1
    M = [[0.0] * (size * links) for _ in range(size * links)]
    f = [0.0] * (size * links)
    mass = sum(b[0] for b in bodies)
    L, S, T, P, dP = [], [], [], [], []
    for i in range(links):
        x, below = (q[links + i] if free else 0.0), mass * (links - 1 - i)
        L.append(far + slide * x)
        S.append(sum(b[0] * b[1] for b in bodies) + sum(b[0] * b[2] for b in bodies) * x)
        T.append(sum(b[0] * b[1] ** 2 + b[3] for b in bodies) + sum(b[0] * b[2] ** 2 for b in bodies) * x * x)
        P.append(S[i] + L[i] * below)
        dP.append(sum(b[0] * b[2] for b in bodies) + slide * below)
        M[size * i][size * i] = T[i] + L[i] * L[i] * below
        if free:
            M[2 * i + 1][2 * i + 1] = sum(b[0] * b[2] ** 2 for b in bodies) + slide * slide * below
    # Accelerations (x, y) at zero q'' that the links above give a joint, and forces that the links below do.
    along = [L[i] * v[i] * v[i] for i in range(links)]
    ax, ay = 0.0, GRAVITY
    for i in range(links):
        Q = u[i] - u[i + 1] if i + 1 < links else u[i]
        f[size * i] = Q - P[i] * (c[i] * ay - s[i] * ax)
        if free:
            f[2 * i + 1] = u[links + i] - dP[i] * (c[i] * ax + s[i] * ay)
            cor = 2 * v[i] * v[links + i]
            ax, ay = ax - along[i] * c[i] - cor * s[i], ay - along[i] * s[i] + cor * c[i]
            f[2 * i] = f[2 * i] - M[2 * i + 1][2 * i + 1] * L[i] * cor
            f[2 * i + 1] = f[2 * i + 1] + M[2 * i + 1][2 * i + 1] * along[i]
        else:
            ax, ay = ax - along[i] * c[i], ay - along[i] * s[i]
    fx, fy = 0.0, 0.0
    for i in reversed(range(links)):
        f[size * i] = f[size * i] - L[i] * (c[i] * fy - s[i] * fx)
        if free:
            f[2 * i + 1] = f[2 * i + 1] - slide * (c[i] * fx + s[i] * fy)
        w = P[i] * v[i] * v[i]
        fx, fy = fx - w * c[i], fy - w * s[i]
        if free:
            cor = 2 * dP[i] * v[i] * v[links + i]
            fx, fy = fx - cor * s[i], fy + cor * c[i]
    for i in range(links):
        for j in range(i + 1, links):
            cij = c[i] * c[j] + s[i] * s[j]
            M[size * j][size * i] = L[i] * P[j] * cij
            if free:
                sij = s[i] * c[j] - c[i] * s[j]
                M[2 * j + 1][2 * i] = -(L[i] * dP[j] * sij)
                M[2 * j][2 * i + 1] = slide * P[j] * sij
                M[2 * j + 1][2 * i + 1] = slide * dP[j] * cij
    return M, f, size


def eliminate(M, f, size=1):
    """Solve M a = f from the lower part of M by L D L^T from the last row to the first."""
    n = len(f)
    M, f = [list(row) for row in M], list(f)
    for k in reversed(range(n)):
        inv = 1.0 / M[k][k]
        for i in reversed(range(k)):
            if isinstance(M[k][i], float) and M[k][i] == 0.0:
                continue
            factor = M[k][i] * inv
            for j in range(i + 1):
                M[i][j] = M[i][j] - factor * M[k][j]
            f[i] = f[i] - factor * f[k]
        f[k] = f[k] * inv
        for i in range(k):
            M[k][i] = M[k][i] * inv
    for k in range(n):
        for i in range(k):
            f[k] = f[k] - M[k][i] * f[i]
    return [f[size * i + part] for part in range(size) for i in range(n // size)]


def recursion(links, q, v, u, sin, cos):
    """Accelerations of the rigid chain by the planar articulated recursion, in link frames."""
    (((m, r, _, inertia),), (L, _)) = LINKS["rigid"]
    S, T = m * r, m * r * r + inertia
    end = links - 1
    turn = [q[i] - q[i - 1] if i else q[0] for i in range(links)]
    c, s = [cos(x) for x in turn], [sin(x) for x in turn]
    kept = [None] * links
    uu, nn, un = m, m - S * S / T, 0.0
    bu, bn = -S * (v[end] * v[end]), u[end] * (S / T)
    kept[end] = (u[end] * (1.0 / T), S / T, 0.0, 0.0)
    for i in reversed(range(end)):
        co, si = c[i + 1], s[i + 1]
        s2, c2 = 2.0 * si * co, 1.0 - 2.0 * si * si
        half, dev = 0.5 * (uu + nn), 0.5 * (uu - nn)
        turned = c2 * dev - s2 * un
        luu, lnn, lun = half + turned, half - turned, s2 * dev + c2 * un
        fu, fn = co * bu - si * bn, si * bu + co * bn
        inv = 1.0 / (T + L * L * lnn)
        w2 = v[i] * v[i]
        kn, ku = (S + L * lnn) * inv, L * lun * inv
        x = L * w2 * lun - fn
        y = u[i] - u[i + 1] + L * x
        kept[i] = (y * inv, kn, ku, L * w2)
        uu, nn, un = (
            m + luu - L * lun * ku,
            (m * T - S * S + lnn * (T + m * L * L - 2 * S * L)) * inv,
            (ku * (T / L - S)),
        )
        bu, bn = fu - (S + L * luu) * w2 + ku * y, kn * y - x
    au, an, acc = 0.0, GRAVITY, []
    for i in range(links):
        free, kn, ku, lw2 = kept[i]
        au, an = c[i] * au + s[i] * an, c[i] * an - s[i] * au
        acc.append(free - kn * an - ku * au if i < end else free - kn * an)
        au, an = au - lw2, an + L * acc[i]
    return acc
