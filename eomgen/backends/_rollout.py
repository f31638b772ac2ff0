"""Rollouts: forward dynamics integrated under inputs that are constant over intervals."""

import functools

import numpy

METHODS = ("rk4", "euler", "dop853")
MOST_TRIES = 1e6  # steps of "dop853" in an interval, those it rejects included


class Rollout:
    """rollout(q, v, u, [w,] p, dt, steps=None, method="rk4", rtol=None, atol=None) -> (q, v)

    Integrates forward dynamics from (q, v) and returns the state at the end of every interval. The leading axes of all
    arguments broadcast; with the C back end trajectories run side by side in vector lanes, those of "dop853" one after
    the other, each with steps of its own.

    Args:
        q, v: initial coordinates and rates, (..., n).
        u: inputs, (..., t, nu): a row for each of t intervals of equal duration.
        w: prescribed lengths at the start of each interval, (..., t, k, 3); within it the third entry, the
            acceleration, is constant. Only for models that have prescribed lengths.
        p: parameters, (..., np).
        dt: the step, s, (...); positive.
        steps: number of steps in all, a multiple of t; by default one per interval. Together they last dt x steps.
        method: "rk4" (classical Runge-Kutta, fourth order) or "euler" (semi-implicit, first order), of steps dt, or
            "dop853" (Dormand and Prince, eighth order), which chooses its steps within each interval by their errors.
        rtol, atol: for "dop853": a step is accepted if its error in coordinates and rates is below atol + rtol x their
            size, in the quadratic mean; numbers, positive, rtol at least 100 eps. By default the square root of eps,
            1.5e-8 in float64.

    Returns:
        q and v, each (..., t, n). Those of "dop853" are NaN, and NumPy's flag `invalid` is raised, from the interval on
        in which the state ceases to be finite, or which needs a step shorter than 10 eps of the time in it or more than
        a million steps.

    Raises:
        ValueError: a step or tolerance that is not positive, a number of steps that does not fit, an unknown method, a
            tolerance for a method of fixed steps, a wrong shape.
    """

    def __init__(self, kernel):
        self._kernel = kernel
        self.__name__ = self.__qualname__ = "rollout"
        self.__doc__ = type(self).__doc__

    def __reduce__(self):
        return self.__name__

    def __call__(self, *arguments, **named):
        forward = self._kernel.forward_dynamics
        prescribed = forward.nin == 5
        needed = ("q", "v", "u", *(("w",) if prescribed else ()), "p", "dt")
        names = (*needed, "steps", "method", "rtol", "atol")
        given = dict(zip(names, arguments, strict=False))
        if len(arguments) > len(names) or given.keys() & named.keys() or not named.keys() <= set(names):
            raise TypeError(f"rollout() takes {', '.join(names)}, each once")
        given |= named
        missing = [name for name in needed if name not in given]
        if missing:
            raise TypeError(f"rollout() is missing {', '.join(missing)}; it takes {', '.join(names)}")
        q, v, u, p, dt = (given[name] for name in ("q", "v", "u", "p", "dt"))
        steps, method = given.get("steps"), given.get("method", "rk4")
        if method not in METHODS:
            raise ValueError(f"unknown method {method!r}; allowed: {', '.join(map(repr, METHODS))}")
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
        # The step and the options take the type in which the arrays are computed, as a Python number would.
        arrays = [numpy.asarray(x) for x in (q, v, u, *w, p)]
        dtype = numpy.result_type(*(x.dtype for x in arrays), numpy.float32)
        if not numpy.can_cast(dtype, numpy.longdouble):
            raise TypeError(f"rollout() takes real numbers, not {dtype}")
        offered = (numpy.dtype(loop[0]) for loop in forward.types)
        dtype = next((x for x in offered if numpy.can_cast(dtype, x)), dtype)
        step = step.astype(dtype)
        options = _options(dtype, substeps, method, given.get("rtol"), given.get("atol"))
        compiled = getattr(self._kernel, f"rollout_{method}", None)
        if compiled:
            return compiled(q, v, u, *w, p, step, options)
        if method == "dop853":
            return self._control(arrays, step * options[0], options[1:])
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

    def _control(self, arrays, span, options):
        """The same for "dop853": trajectories as rows, of which those that go on take a step together."""
        forward = self._kernel.forward_dynamics
        q, v, u, *w, p = arrays
        forward(q, v, u[..., 0, :], *(x[..., 0, :, :] for x in w), p)  # refuses wrong shapes
        arrays = [*arrays, span]
        axes = (1, 1, 2, *(3 for _ in w), 1, 0)
        cores = [x.shape[x.ndim - core :] for x, core in zip(arrays, axes, strict=True)]
        batch = numpy.broadcast_shapes(*(x.shape[: x.ndim - len(core)] for x, core in zip(arrays, cores, strict=True)))
        wide = (numpy.broadcast_to(x, (*batch, *core)) for x, core in zip(arrays, cores, strict=True))
        count = int(numpy.prod(batch))
        q, v, u, *w, p, span = (x.reshape(count, *core) for x, core in zip(wide, cores, strict=True))
        n = q.shape[-1]

        def field(j, rows, t, y):
            """d(q, v)/dt of some trajectories, t after the start of interval j."""
            now = [_at(x[rows, j], t[:, numpy.newaxis]) for x in w]
            return numpy.concatenate([y[:, n:], forward(y[:, :n], y[:, n:], u[rows, j], *now, p[rows])], axis=-1)

        start = numpy.concatenate([q, v], axis=-1).astype(span.dtype)
        with numpy.errstate(all="ignore"):
            found = _dop853(field, start, span, u.shape[-2], options)
        if numpy.isnan(found).any():
            numpy.multiply(numpy.inf, 0.0)  # raises the flag
        found = found.reshape(*batch, *found.shape[1:])
        return found[..., :n], found[..., n:]


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


# The coefficients of Dormand and Prince's method of order 8 with error estimates of orders 5 and 3: E. Hairer, S. P.
# Nørsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, 1993, sections II.5 and II.10, with the
# digits of their program dop853.f. Nodes and weights of the stages 1 to 11 (stage 0 has none), then the weights of the
# solution and of both error estimates. A sum takes stage 0 and those of a range, whose first is in FIRST.
FIRST = (1, 1, 2, 2, 3, 3, 3, 3, 3, 3, 3, 5, 5, 5)
LAST = (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 12, 12)  # one beyond
COEFFICIENTS = """
0.0526001519587677318785587544488 0.0789002279381515978178381316732 0.11835034190722739672675719751
0.28164965809277260327324280249 0.333333333333333333333333333333 0.25 0.307692307692307692307692307692
0.651282051282051282051282051282 0.6 0.857142857142857142857142857142 1

0.0526001519587677318785587544488
0.0197250569845378994544595329183 0.0591751709536136983633785987549
0.0295875854768068491816892993775 0.0887627564304205475450678981324
0.241365134159266685502369798665 -0.884549479328286085344864962717 0.924834003261792003115737966543
0.037037037037037037037037037037 0.170828608729473871279604482173 0.125467687566822425016691814123
0.037109375 0.170252211019544039314978060272 0.0602165389804559606850219397283 -0.017578125
0.0370920001185047927108779319836 0.170383925712239993810214054705 0.107262030446373284651809199168
-0.0153194377486244017527936158236 0.00827378916381402288758473766002
0.624110958716075717114429577812 -3.36089262944694129406857109825 -0.868219346841726006818189891453
27.5920996994467083049415600797 20.1540675504778934086186788979 -43.4898841810699588477366255144
0.477662536438264365890433908527 -2.48811461997166764192642586468 -0.590290826836842996371446475743
21.2300514481811942347288949897 15.2792336328824235832596922938 -33.2882109689848629194453265587
-0.0203312017085086261358222928593
-0.93714243008598732571704021658 5.18637242884406370830023853209 1.09143734899672957818500254654
-8.14978701074692612513997267357 -18.5200656599969598641566180701 22.7394870993505042818970056734
2.49360555267965238987089396762 -3.0467644718982195003823669022
2.27331014751653820792359768449 -10.5344954667372501984066689879 -2.00087205822486249909675718444
-17.9589318631187989172765950534 27.9488845294199600508499808837 -2.85899827713502369474065508674
-8.87285693353062954433549289258 12.3605671757943030647266201528 0.643392746015763530355970484046

0.0542937341165687622380535766363 4.45031289275240888144113950566 1.89151789931450038304281599044
-5.8012039600105847814672114227 0.31116436695781989440891606237 -0.152160949662516078556178806805
0.201365400804030348374776537501 0.0447106157277725905176885569043
0.01312004499419488073250102996 -1.225156446376204440720569753 -0.4957589496572501915214079952
1.664377182454986536961530415 -0.350328848749973681688648729 0.3341791187130174790297318841
0.08192320648511571246570742613 -0.02235530786388629525884427845
-0.1898007540724076157147023288757 4.45031289275240888144113950566 1.89151789931450038304281599044
-5.8012039600105847814672114227 -0.422682321323791962932445679177 -0.152160949662516078556178806805
0.201365400804030348374776537501 0.0226517921983608258118062039631
"""


def _options(dtype, substeps, method, rtol, atol):
    """The last argument of a compiled rollout: steps per interval; for "dop853" then tolerances and constants."""
    if method != "dop853":
        for name, value in (("rtol", rtol), ("atol", atol)):
            if value is not None:
                raise ValueError(f"{name} = {value!r} is for the method 'dop853'; the steps of {method!r} are dt")
        return numpy.array([substeps], dtype)
    kind = numpy.finfo(dtype)
    rtol, atol = (_tolerance(name, value, kind) for name, value in (("rtol", rtol), ("atol", atol)))
    if rtol < 100 * kind.eps:
        raise ValueError(f"rtol = {rtol:.3g} is below 100 eps of the number type; give at least {100 * kind.eps:.3g}")
    return numpy.concatenate([numpy.array([substeps, rtol, atol], dtype), _constants(dtype)])


def _tolerance(name, value, kind):
    if value is None:
        return numpy.sqrt(kind.eps)
    with numpy.errstate(over="ignore"):
        number = kind.dtype.type(value if isinstance(value, (int, float, numpy.integer, numpy.floating)) else "nan")
    if not (numpy.isfinite(number) and number > 0):
        raise ValueError(f"{name} = {value!r} is not positive; give a tolerance, a number")
    return number


@functools.cache
def _constants(dtype):
    """10 eps, the least positive number, the most steps to try, the coefficients."""
    kind = numpy.finfo(dtype)
    head = numpy.array([10 * kind.eps, kind.smallest_normal, MOST_TRIES], dtype)
    return numpy.concatenate([head, numpy.array(COEFFICIENTS.split()).astype(dtype)])


def _dop853(field, y, span, intervals, options):
    """The states at the ends of the intervals, (trajectories, intervals, 2 n); those after a motion's end are NaN.

    `eomgen_dop853_type.h` does the same for one trajectory, to the last bit.

    Args:
        field: d(q, v)/dt as a function of the interval, rows, their times since its start and their states.
        y: the states at the start, a row for each trajectory.
        span: the duration of an interval.
        intervals: their number.
        options: rtol, atol, 10 eps, the least positive number, the most steps to try, the coefficients.
    """
    rtol, atol, finest, least, most = options[:5]
    nodes, weights, place = options[5:16], [], 16
    for first, last in zip(FIRST, LAST, strict=True):
        weights.append(options[place : place + 1 + last - first])
        place += 1 + last - first
    count, size = y.shape

    def combined(which, stages):
        """A weighted sum of stages."""
        total = weights[which][0] * stages[0]
        for weight, stage in zip(weights[which][1:], stages[FIRST[which] : LAST[which]], strict=True):
            total = total + weight * stage
        return total

    y, found = y.copy(), numpy.empty((count, intervals, size), y.dtype)
    h, finite = numpy.zeros_like(span), numpy.ones(count, bool)
    for j in range(intervals):
        t, rejected, tries = numpy.zeros_like(span), numpy.zeros(count, bool), 0
        begin = field(j, numpy.arange(count), t, y)
        if j == 0:
            h = _first_step(lambda t, y: field(0, numpy.arange(count), t, y), y, begin, span, rtol, atol)
        while (rows := numpy.flatnonzero(finite & (t < span))).size:
            finite[rows] = (h[rows] > finest * t[rows] + least) & (tries < most)
            tries += 1
            rows = rows[finite[rows]]
            left = span[rows] - t[rows]
            last = left <= h[rows]
            step = numpy.where(last, left, h[rows])
            stages = [begin[rows]]
            for s in range(11):
                moved = y[rows] + step[:, numpy.newaxis] * combined(s, stages)
                stages.append(field(j, rows, t[rows] + nodes[s] * step, moved))
            end = y[rows] + step[:, numpy.newaxis] * combined(11, stages)
            scale = step[:, numpy.newaxis] / (atol + numpy.maximum(abs(y[rows]), abs(end)) * rtol)
            fifth, third = (_squares(scale * combined(which, stages)) for which in (12, 13))
            error = numpy.where(fifth == 0, 0, fifth * (fifth / ((fifth + y.dtype.type(0.01) * third) * size)))
            # 0.9 error^(-1/8), between 0.2 and 10; 0.2 if it is not a number
            factor = y.dtype.type(0.9) / numpy.sqrt(numpy.sqrt(numpy.sqrt(numpy.sqrt(error))))
            factor = numpy.where(factor > 0.2, factor, y.dtype.type(0.2))
            factor = numpy.minimum(factor, numpy.where(rejected[rows], 1, 10).astype(y.dtype))
            good = error < 1
            rejected[rows] = ~good
            # A step cut short by the end of the interval says nothing against its like.
            h[rows] = numpy.where(good & last, numpy.maximum(h[rows], step * factor), step * factor)
            t[rows] = numpy.where(good, numpy.where(last, span[rows], t[rows] + step), t[rows])
            rows, end = rows[good], end[good]
            y[rows] = end
            begin[rows] = field(j, rows, t[rows], end)
        finite &= numpy.isfinite(y).all(axis=-1)
        y[~finite] = numpy.nan
        found[:, j] = y
    return found


def _first_step(field, y, begin, span, rtol, atol):
    """A step to try, when only the first stage of the motion is known (Hairer, Nørsett, Wanner, section II.4)."""
    kind, scale = y.dtype.type, 1 / (atol + abs(y) * rtol)

    def norm(x):
        return numpy.sqrt(_squares(x * scale) / y.shape[1])

    state, slope = norm(y), norm(begin)
    h = numpy.where((state < 1e-5) | (slope < 1e-5), kind(1e-6), kind(0.01) * state / slope)
    h = numpy.where(span < h, span, h)
    bend = norm(field(h, y + h[:, numpy.newaxis] * begin) - begin) / h
    largest = numpy.where(bend > slope, bend, slope)  # the slope if the trial step met a singular state
    found = numpy.sqrt(numpy.sqrt(numpy.sqrt(kind(0.01) / largest)))
    found = numpy.where(largest <= 1e-15, numpy.maximum(kind(1e-6), h * kind(1e-3)), found)
    found = numpy.where(100 * h < found, 100 * h, found)
    return numpy.where(span < found, span, found)


def _squares(x):
    """The sum of the squares in each row, term by term."""
    return numpy.cumsum(x * x, axis=-1)[:, -1]
