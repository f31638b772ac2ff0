"""The mechanism every peer computes, its random states, and the answer to check against.

A serial chain of `links` links, absolute angles from the x axis, gravity along -y, and a torque in every
joint that acts on its link and reacts on the parent.

* ``rigid``: uniform rods, 1 kg and 1 m.  q = angles.
* ``point-masses``: the paper's case, links of free length with masses of 0.25, 0.5 and 0.25 kg at 0, 1/2
  and 1 of it.  q = angles, then lengths; u = torques, then forces along the links.
"""

import functools

import numpy as np

GRAVITY = 9.81
# Per link: bodies (mass, alpha, beta, central inertia) at alpha + beta s, and the joint's (alpha, beta).
LINKS = {
    "rigid": (((1.0, 0.5, 0.0, 1.0 / 12.0),), (1.0, 0.0)),
    "point-masses": (((0.25, 0.0, 0.0, 0.0), (0.5, 0.0, 0.5, 0.0), (0.25, 0.0, 1.0, 0.0)), (0.0, 1.0)),
}


def states(links, batch, seed=0, mechanism="rigid"):
    """Random q, v, u of shape (batch, n): angles in [-pi, pi], lengths in [0.5, 1.5], the rest normal."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-np.pi, np.pi, (batch, links))
    if mechanism == "point-masses":
        q = np.hstack([q, rng.uniform(0.5, 1.5, (batch, links))])
    return q, rng.standard_normal(q.shape), rng.standard_normal(q.shape)


def reference(q, v, u, mechanism="rigid", mass=None, length=None):
    """Accelerations of every state from the bodies' Jacobians and numpy's solve.

    `mass` and `length` (one per link) replace those of the rods.  Complex arguments are fine.
    """
    free = mechanism != "rigid"
    links = q.shape[1] // (2 if free else 1)
    out = np.empty(q.shape, np.result_type(q, v, u))
    models = [LINKS[mechanism]] * links
    if mass is not None:
        rods = zip(mass, length, strict=True)
        models = [(((m, far / 2, 0.0, m * far * far / 12),), (far, 0.0)) for m, far in rods]
    for k in range(0, len(q), 1000):
        part = slice(k, k + 1000)
        out[part] = _solve(q[part], v[part], u[part], models, free)
    return out


def exact(q, v, u, mechanism="rigid", digits=60):
    """`reference` of a few states in so many decimal digits, as an array of mpmath's numbers."""
    context, number = _decimal(digits)
    free = mechanism != "rigid"
    bodies, joint = LINKS[mechanism]
    twelfth = context.mpf(1) / 12  # what a double only comes close to
    bodies = [(*numbers, twelfth if inertia else inertia) for *numbers, inertia in bodies]
    models = [(bodies, joint)] * (q.shape[1] // (2 if free else 1))
    arguments = (number(a) for a in (q, v, u))
    functions = (np.frompyfunc(f, 1, 1) for f in (context.cos, context.sin))
    return _solve(*arguments, models, free, *functions, _eliminate)


@functools.cache
def _decimal(digits):
    """mpmath with so many digits, and what makes an array of doubles one of its numbers."""
    import mpmath

    context = mpmath.MPContext()
    context.dps = digits
    return context, np.frompyfunc(lambda x: x if isinstance(x, context.mpf) else context.mpf(float(x)), 1, 1)


def _eliminate(M, f):
    """What numpy's solve does, for arrays of any numbers; M is positive definite."""
    n = f.shape[1]
    M, f = M.copy(), f[:, :, 0]
    for k in range(n):
        factor = M[:, k + 1 :, k] / M[:, k, k, None]
        M[:, k + 1 :] = M[:, k + 1 :] - factor[:, :, None] * M[:, k, None]
        f[:, k + 1 :] = f[:, k + 1 :] - factor * f[:, k, None]
    for k in reversed(range(n)):
        f[:, k] = (f[:, k] - (M[:, k, k + 1 :] * f[:, k + 1 :]).sum(1)) / M[:, k, k]
    return f[:, :, None]


def _solve(q, v, u, models, free, cosine=np.cos, sine=np.sin, solve=np.linalg.solve):
    batch, n = q.shape
    links = len(models)
    cos, sin = cosine(q[:, :links]), sine(q[:, :links])
    along, across = np.stack([cos, sin], 1), np.stack([-sin, cos], 1)  # (batch, 2, links)
    omega, zero = v[:, :links], np.zeros(batch, q.dtype)
    force = u.astype(np.result_type(q, v, u))
    force[:, : links - 1] -= u[:, 1:links]
    M = np.zeros((batch, n, n), q.dtype)
    path = np.zeros((batch, 2, n), q.dtype)  # the Jacobian of the joint that carries the link
    bias = np.zeros((batch, 2), force.dtype)  # its acceleration at zero q'', less that of free fall
    bias[:, 1] = GRAVITY
    rows, biases, masses = [], [], []
    for i, (bodies, joint) in enumerate(models):
        s, rate = (q[:, links + i], v[:, links + i]) if free else (zero, zero)
        for m, alpha, beta, inertia in (*bodies, (None, *joint, 0.0)):
            r = alpha + beta * s
            jac = path.copy()
            jac[:, :, i] = r[:, None] * across[:, :, i]
            if free:
                jac[:, :, links + i] = beta * along[:, :, i]
            acc = bias + (2 * beta * rate * omega[:, i])[:, None] * across[:, :, i]
            acc = acc - (r * omega[:, i] ** 2)[:, None] * along[:, :, i]
            if m is None:
                path, bias = jac, acc
            else:
                rows.append(jac)
                biases.append(acc)
                masses.append(m)
                M[:, i, i] += inertia
    jac = np.stack(rows, 1).reshape(batch, -1, n)
    weighted = (jac * np.repeat(masses, 2)[:, None]).swapaxes(1, 2)
    M += weighted @ jac
    force -= (weighted @ np.stack(biases, 1).reshape(batch, -1, 1))[:, :, 0]
    return solve(M, force[:, :, None])[:, :, 0]


def reference_jacobian(q, v, u, mechanism="rigid"):
    """d acceleration / d (q, v, u) of shape (batch, n, 3 n), by complex steps."""
    n = q.shape[1]
    columns = []
    for j in range(3 * n):
        args = [a.astype(complex) for a in (q, v, u)]
        args[j // n][:, j % n] += 1e-30j
        columns.append(reference(*args, mechanism).imag / 1e-30)
    return np.stack(columns, 2)


def exact_jacobian(q, v, u, mechanism="rigid"):
    """`reference_jacobian` of a few states to 60 digits, by differences of numbers with 90."""
    context, number = _decimal(90)
    n, step = q.shape[1], context.mpf(10) ** -30
    columns = []
    for j in range(3 * n):
        ends = []
        for change in (step, -step):
            args = [number(a) for a in (q, v, u)]
            args[j // n][:, j % n] += change
            ends.append(exact(*args, mechanism, 90))
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.stack(columns, 2)


def rollout(accelerate, q, v, u, dt, steps):
    """q and v side by side after some steps of the classical Runge-Kutta method; `accelerate(q, v, u)` moves them."""
    for _ in range(steps):
        slopes, x, y = [], q, v
        for h in (dt / 2, dt / 2, dt, 0 * dt):
            slopes.append((y, accelerate(x, y, u)))
            x, y = q + h * slopes[-1][0], v + h * slopes[-1][1]
        q, v = (
            a + dt / 6 * (slopes[0][k] + 2 * slopes[1][k] + 2 * slopes[2][k] + slopes[3][k])
            for k, a in enumerate((q, v))
        )
    return np.hstack([q, v])


def exact_rollout(q, v, u, dt, steps, mechanism="rigid"):
    """`rollout` of a few states in 60 digits."""
    context, number = _decimal(60)
    arguments = [number(a) for a in (q, v, u)]
    return rollout(lambda *a: exact(*a, mechanism), *arguments, context.mpf(dt), steps)


def scaled_error(got, want):
    """The largest difference of a state's numbers over the largest of them, worst state first."""
    got, want = (np.asarray(a).reshape(len(want), -1) for a in (got, want))
    return float((np.abs(got - want).max(1) / np.abs(want).max(1)).max())


def relative(q, v):
    """Joint angles and rates of absolute ones."""
    return np.diff(q, axis=1, prepend=0.0), np.diff(v, axis=1, prepend=0.0)
