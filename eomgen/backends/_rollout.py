"""Rollouts: forward dynamics integrated with a fixed step under inputs that are constant over intervals."""

import numpy


class Rollout:
    """rollout(q, v, u, [w,] p, dt, steps=None, method="rk4") -> (q, v)

    Integrates forward dynamics from (q, v) and returns the state at the end of every interval. The leading axes of all
    arguments broadcast; with the C back end trajectories run side by side in vector lanes.

    Args:
        q, v: initial coordinates and rates, (..., n).
        u: inputs, (..., t, nu): a row for each of t intervals of equal duration.
        w: prescribed lengths at the start of each interval, (..., t, k, 3); within it the third entry, the
            acceleration, is constant. Only for models that have prescribed lengths.
        p: parameters, (..., np).
        dt: the step, s, (...); positive.
        steps: number of steps in all, a multiple of t; by default one per interval.
        method: "rk4" (classical Runge-Kutta, fourth order) or "euler" (semi-implicit, first order).

    Returns:
        q and v, each (..., t, n).

    Raises:
        ValueError: a step that is not positive, a number of steps that does not fit, an unknown method, a wrong shape.
    """

    def __init__(self, kernel):
        self._kernel = kernel
        self.__name__ = self.__qualname__ = "rollout"
        self.__doc__ = type(self).__doc__

    def __reduce__(self):
        return getattr, (_Module(self.__module__), "rollout")

    def __call__(self, *arguments, **named):
        prescribed = self._kernel.forward_dynamics.nin == 5
        names = ("q", "v", "u", *(("w",) if prescribed else ()), "p", "dt", "steps", "method")
        given = dict(zip(names, arguments, strict=False))
        if len(arguments) > len(names) or given.keys() & named.keys() or not named.keys() <= set(names):
            raise TypeError(f"rollout() takes {', '.join(names)}, each once")
        given |= named
        missing = [name for name in names[:-2] if name not in given]
        if missing:
            raise TypeError(f"rollout() is missing {', '.join(missing)}; it takes {', '.join(names)}")
        q, v, u, p, dt = (given[name] for name in ("q", "v", "u", "p", "dt"))
        steps, method = given.get("steps"), given.get("method", "rk4")
        if method not in ("rk4", "euler"):
            raise ValueError(f"unknown method {method!r}; allowed: 'rk4', 'euler'")
        step = numpy.asarray(dt)
        if not (numpy.all(numpy.isfinite(step)) and numpy.all(step > 0)):
            raise ValueError(f"dt = {dt!r} is not positive; give the step in seconds")
        u = numpy.asarray(u)
        if u.ndim < 2:
            raise ValueError(f"u has {u.ndim} axes; give (..., t, nu), a row for each interval")
        intervals = u.shape[-2]
        count = intervals if steps is None else steps
        if not (numpy.isfinite(count) and count >= 1 and intervals >= 1) or count % 1 or count % intervals:
            raise ValueError(f"steps = {count!r} is no positive multiple of the {intervals} intervals of u")
        w = (numpy.asarray(given["w"]),) if prescribed else ()
        if prescribed and (w[0].ndim < 3 or w[0].shape[-3] != intervals):
            raise ValueError(
                f"w has shape {w[0].shape}; give (..., t, k, 3) with a row for each of {intervals} intervals"
            )
        substeps = int(count) // intervals
        # The step takes the type of the arrays, as a Python number would.
        arrays = [numpy.asarray(x) for x in (q, v, u, *w, p)]
        dtype = numpy.result_type(*(x.dtype for x in arrays), numpy.float32)
        if not numpy.can_cast(dtype, numpy.longdouble):
            raise TypeError(f"rollout() takes real numbers, not {dtype}")
        step = step.astype(dtype)
        compiled = getattr(self._kernel, f"rollout_{method}", None)
        if compiled:
            return compiled(q, v, u, *w, p, step, dtype.type(substeps))
        return self._integrate(q, v, u, w, p, step, substeps, method)

    def _integrate(self, q, v, u, w, p, dt, substeps, method):
        """The same with array operations, for the back end without compiled rollouts."""
        forward = self._kernel.forward_dynamics
        dt = numpy.asarray(dt)[..., numpy.newaxis]
        q, v = numpy.asarray(q, dt.dtype), numpy.asarray(v, dt.dtype)
        found = []
        for j in range(u.shape[-2]):
            for k in range(substeps):
                t = dt.dtype.type(k) * dt

                def accelerate(q, v, t, j=j):
                    now = [_at(x[..., j, :, :], t) for x in w]
                    return forward(q, v, u[..., j, :], *now, p)

                q, v = _euler(accelerate, q, v, dt, t) if method == "euler" else _rk4(accelerate, q, v, dt, t)
            found.append((q, v))
        shape = numpy.broadcast_shapes(*(item.shape for pair in found for item in pair))
        return tuple(numpy.stack([numpy.broadcast_to(pair[i], shape) for pair in found], axis=-2) for i in (0, 1))


def _at(w, t):
    """Prescribed lengths t after the start of an interval of constant acceleration."""
    s, rate, acceleration = w[..., 0], w[..., 1], w[..., 2]
    later = s + t * (rate + t * acceleration / 2), rate + t * acceleration
    return numpy.stack(numpy.broadcast_arrays(*later, acceleration), axis=-1)


def _rk4(f, q, v, dt, t):
    a = f(q, v, t)
    b = f(q + dt / 2 * v, v + dt / 2 * a, t + dt / 2)
    c = f(q + dt / 2 * (v + dt / 2 * a), v + dt / 2 * b, t + dt / 2)
    d = f(q + dt * (v + dt / 2 * b), v + dt * c, t + dt)
    return q + dt * (v + dt / 6 * (a + b + c)), v + dt / 6 * (a + b + c + b + c + d)


def _euler(f, q, v, dt, t):
    v = v + dt * f(q, v, t)
    return q + dt * v, v


class _Module:
    """Stands for a module in a pickle."""

    def __init__(self, name):
        self._name = name

    def __reduce__(self):
        import importlib

        return importlib.import_module, (self._name,)
