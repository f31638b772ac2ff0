"""JAX on the CPU: the recursion as two scans over links on blocks of states, in double precision."""

import sys
from pathlib import Path

if __name__ == "__main__":  # not this folder: its files are named like packages
    sys.path[0] = str(Path(__file__).resolve().parents[2])

import os

import numpy as np

from bench.peers import equations, harness, mechanism

os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"


def load():
    import jax

    jax.config.update("jax_enable_x64", True)
    return jax


def make(jax, case):
    jnp, links = jax.numpy, case.links
    (((m, r, _, inertia),), (L, _)) = mechanism.LINKS["rigid"]
    S, T = m * r, m * r * r + inertia

    def scans(q, v, u):  # of shape (links, states)
        turn = jnp.diff(q, axis=0, prepend=0.0)
        torque = -jnp.diff(u, axis=0, append=0.0)
        c, s = jnp.cos(turn), jnp.sin(turn)
        zero = jnp.zeros_like(q[0])

        def inward(carry, link):
            uu, nn, un, bu, bn = carry
            c, s, w, t = link
            w2, inv = w * w, 1 / (T + L * L * nn)
            kn, ku = (S + L * nn) * inv, L * un * inv
            x = L * w2 * un - bn
            y = t + L * x
            bu, bn = bu + ku * y - (S + L * uu) * w2, kn * y - x
            uu, un = uu + m - L * un * ku, ku * (T / L - S)
            nn = (m * T - S * S + nn * (T + m * L * L - 2 * S * L)) * inv
            s2, c2, half, dev = 2 * s * c, 1 - 2 * s * s, 0.5 * (uu + nn), 0.5 * (uu - nn)
            turned = c2 * dev - s2 * un
            un = s2 * dev + c2 * un
            return (half + turned, half - turned, un, c * bu - s * bn, s * bu + c * bn), (y * inv, kn, ku)

        def outward(carry, link):
            au, an = carry
            c, s, w, free, kn, ku = link
            au, an = c * au + s * an, c * an - s * au
            a = free - kn * an - ku * au
            return (au - L * w * w, an + L * a), a

        kept = jax.lax.scan(inward, (zero,) * 5, (c, s, v, torque), reverse=True)[1]
        return jax.lax.scan(outward, (zero, zero + mechanism.GRAVITY), (c, s, v, *kept))[1]

    def solve(q, v, u):
        M, f, _ = equations.dense(links, "rigid", q, v, u, jnp.sin, jnp.cos)
        full = [[M[max(i, j)][min(i, j)] + 0 * q[0] for j in range(links)] for i in range(links)]
        full = jnp.moveaxis(jnp.stack([jnp.stack(row) for row in full]), 2, 0)
        return jnp.linalg.solve(full, jnp.stack(f, 1)[:, :, None])[:, :, 0].T

    one = solve if case.options.algorithm == "solve" else scans
    forward, blocks = jax.jit(one), jax.jit(lambda *a: jax.lax.map(lambda b: one(*b), a))
    count, size = len(case.q), min(len(case.q), case.options.block)
    assert count % size == 0, "the batch must be a multiple of the block"
    rows = [a.reshape(-1, size, links).swapaxes(1, 2) for a in (case.q, case.v, case.u)]
    args = [jnp.asarray(np.ascontiguousarray(a)) for a in rows]
    single = [a[0].reshape(links, 1).copy() for a in (case.q, case.v, case.u)]
    kept = [blocks(*args).block_until_ready()]
    forward(*single).block_until_ready()

    def batch():
        kept[0] = blocks(*args).block_until_ready()

    return harness.Peer(
        batch=batch,
        result=lambda: np.asarray(kept[0]).swapaxes(1, 2).reshape(count, links),
        single=lambda: forward(*single).block_until_ready(),
        note=f"{case.options.algorithm}; blocks of {size} states, contiguous inside",
    )


if __name__ == "__main__":
    harness.main(
        "jax",
        load,
        make,
        options=[
            ("--algorithm", {"choices": ("scan", "solve"), "default": "scan"}),
            ("--block", {"type": int, "default": 500, "help": "states per block"}),
        ],
    )
