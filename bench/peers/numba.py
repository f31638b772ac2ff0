"""Numba: the articulated recursion as a user writes it, with loops and arrays, one state after another."""

import sys
from pathlib import Path

if __name__ == "__main__":  # not this folder: its files are named like packages
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import numpy as np

from bench.peers import harness, mechanism


def load():
    import numba

    return numba


def make(numba, case):
    @numba.njit(error_model="numpy")
    def one(q, v, u, m, length, work, out):
        end = q.shape[0] - 1
        uu = nn = un = bu = bn = 0.0
        for i in range(end, -1, -1):
            L, r = length[i], length[i] / 2
            S, T = m[i] * r, m[i] * L * L / 3
            torque = u[i] - u[i + 1] if i < end else u[i]
            w2 = v[i] * v[i]
            if i < end:
                c, s = np.cos(q[i + 1] - q[i]), np.sin(q[i + 1] - q[i])
                work[i + 1, 0], work[i + 1, 1] = c, s
                s2, c2 = 2 * s * c, 1 - 2 * s * s
                half, dev = 0.5 * (uu + nn), 0.5 * (uu - nn)
                turned = c2 * dev - s2 * un
                uu, nn, un = half + turned, half - turned, s2 * dev + c2 * un
                bu, bn = c * bu - s * bn, s * bu + c * bn
            inv = 1 / (T + L * L * nn)
            kn, ku = (S + L * nn) * inv, L * un * inv
            x = L * w2 * un - bn
            y = torque + L * x
            work[i, 2], work[i, 3], work[i, 4] = y * inv, kn, ku
            bu += ku * y - (S + L * uu) * w2
            bn = kn * y - x
            uu += m[i] - L * un * ku
            un = ku * (T / L - S)
            nn = (m[i] * T - S * S + nn * (T + m[i] * L * L - 2 * S * L)) * inv
        au, an = mechanism.GRAVITY * np.sin(q[0]), mechanism.GRAVITY * np.cos(q[0])
        for i in range(end + 1):
            if i:
                c, s = work[i, 0], work[i, 1]
                au, an = c * au + s * an, c * an - s * au
            a = work[i, 2] - work[i, 3] * an - work[i, 4] * au
            au -= length[i] * v[i] * v[i]
            an += length[i] * a
            out[i] = a

    @numba.njit(error_model="numpy")
    def many(q, v, u, m, length, work, out):
        for k in range(q.shape[0]):
            one(q[k], v[k], u[k], m, length, work, out[k])

    m, length, work = np.ones(case.links), np.ones(case.links), np.empty((case.links, 5))
    out = np.empty_like(case.q)
    many(case.q[:1], case.v[:1], case.u[:1], m, length, work, out[:1])
    state = [a[0].copy() for a in (case.q, case.v, case.u)]
    answer = np.empty(case.links)
    return harness.Peer(
        batch=lambda: many(case.q, case.v, case.u, m, length, work, out),
        result=lambda: out,
        single=lambda: one(*state, m, length, work, answer),
        note="hand-written recursion; arrays row-major; parameters at run time",
    )


if __name__ == "__main__":
    harness.main("numba", load, make)
