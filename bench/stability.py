"""Stability in time: what integrators take, against the error of the motion they find.

`eomgen bench stability` integrates six motions with what users would take, at several tolerances or steps, and compares
the state at the end with a reference of 30 digits. It writes `stability.json`; `stability.md` and `stability.png` are
made from that file alone. The reference stands in `bench/stability_reference.json`, which `eomgen bench stability
--reference` writes, but for the one motion that has a closed form.
"""

from __future__ import annotations

import argparse
import math
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import eomgen
from bench import report
from bench.extrapolation import motion
from bench.peers import harness
from eomgen.certify import import_flint
from eomgen.errors import CheckError, OptionError, UnsupportedError, one_line
from eomgen.ir.expr import Node
from eomgen.ir.interpret import Label, Operators, evaluate
from eomgen.scene import ElasticRod, PointMasses, Scene

Array = NDArray[np.float64]
Record = dict[str, Any]

PACKAGES = ("numpy", "scipy", "heyoka", "python-flint", "cython")
REFERENCE = Path(__file__).with_name("stability_reference.json")
DIGITS = (30, 34)  # of the reference, and of the run that has to agree with it
AGREED = 1e-22  # scaled difference of the two at which a reference is refused
EPS = float(np.finfo(float).eps)
REPEATS = 9
ENOUGH = 1.5  # seconds of repeats after which no further one is made
PATIENCE = 8.0  # seconds of one run after which an integrator gets no tighter setting
RATIO = 3.0  # the target: DOP853 on the double pendulum against heyoka


# Problems


class Problem(NamedTuple):
    """A motion without inputs.

    Attributes:
        name: its title.
        scene: the mechanism.
        q, v: the state at time 0.
        end: the time, s.
        steps: numbers of steps of the compiled rollout by RK4.
        method: the derivation.
        conserved: whether its energy is.
        radau: the tolerances of Radau, which takes many small steps where a problem is not stiff.
    """

    name: str
    scene: Scene
    q: tuple[float, ...]
    v: tuple[float, ...]
    end: float
    steps: tuple[int, ...]
    method: str = "matrix"
    conserved: bool = True
    radau: tuple[float, ...] = (1e-3, 1e-5, 1e-7, 1e-9)


def springs(damping: float) -> Scene:
    """Two rods on springs of 1e6 N/m, which alone would swing at some 1000 rad/s."""
    links = [
        ElasticRod(
            name=name, parent=parent, length="free", mass=1.0, rod_length=0.5,
            stiffness=1e6, rest_length=0.5, damping=damping,
        )
        for parent, name in (("ground", "upper"), ("upper", "lower"))
    ]  # fmt: skip
    return Scene("springs", tuple(links))


def flight() -> Problem:
    """A mass on a link without mass of its own: it flies on a parabola, 0.6 mm past the joint at half time."""
    x, y, vx, vy = -1.0, 1e-3, 2.0, 9.81 / 4
    length = math.hypot(x, y)
    turning, along = (x * vy - y * vx) / length**2, (x * vx + y * vy) / length
    scene = Scene("flight", (PointMasses(name="link", length="free", masses=(1.0,), fractions=(1.0,)),))
    state = (math.atan2(y, x), length), (turning, along)
    return Problem("near miss of the joint, 1 s", scene, *state, 1.0, _powers(3, 6.5, 0.5))


def _powers(low: float, high: float, by: float) -> tuple[int, ...]:
    """Round numbers of steps from 10^low to 10^high."""
    count = round((high - low) / by) + 1
    return tuple(round(float(f"{10 ** (low + by * k):.1e}")) for k in range(count))


def problems() -> list[Problem]:
    """The motions of the suite."""
    five = tuple(0.1 * k for k in range(5))
    hundred = tuple(0.01 * k for k in range(100))
    stiff = (0.3, -0.5, 0.5, 0.5)
    rest = (0.0,) * 4
    return [
        Problem("double pendulum, 10 s", eomgen.chain(2, "rigid"), (1.2, 2.0), (0.0, 0.0), 10.0, _powers(3, 6, 0.5)),
        Problem("5 links from rest, 3 s", eomgen.chain(5, "rigid"), five, (0.0,) * 5, 3.0, _powers(2.5, 5.5, 0.5)),
        flight(),
        Problem("springs of 1e6 N/m, 1 s", springs(0.0), stiff, rest, 1.0, _powers(3, 6, 0.5)),
        Problem(
            "springs of 1e6 N/m, damped, 0.25 s", springs(1e4), stiff, rest, 0.25, _powers(2.5, 5.5, 0.5),
            conserved=False, radau=(1e-3, 1e-5, 1e-7, 1e-9, 1e-11),
        ),
        Problem(
            "100 links from rest, 0.2 s", eomgen.chain(100, "rigid"), hundred, (0.0,) * 100, 0.2, _powers(1.5, 4, 0.5),
            method="articulated",
        ),
    ]  # fmt: skip


def quick_problems() -> list[Problem]:
    """One of each kind."""
    found = problems()
    return [found[0], found[2], found[4]]


# References


def on_a_parabola(problem: Problem) -> list[Any]:
    """The state of a single mass at the end, in closed form, as `arb` numbers: angle, length and their rates.

    The angle is that between -π and π, so the motion must not cross the negative x axis.
    """
    flint = import_flint()
    with flint.ctx.workprec(200):
        (angle, length), (turning, along), t = map(flint.arb, problem.q), map(flint.arb, problem.v), problem.end
        g, c, s = flint.arb(problem.scene.gravity), angle.cos(), angle.sin()
        vx, vy = along * c - length * turning * s, along * s + length * turning * c
        x, y = length * c + vx * t, length * s + vy * t - g * t * t / 2
        vy = vy - g * t
        r2 = x * x + y * y
        return [flint.arb.atan2(y, x), r2.sqrt(), (x * vy - y * vx) / r2, (x * vx + y * vy) / r2.sqrt()]


def solve(problem: Problem, digits: int, off: float = 0.0) -> tuple[list[str], int, float]:
    """The state at the end in decimal digits, the steps taken and the seconds.

    Args:
        problem: the motion.
        digits: of the reference.
        off: every number of the initial state is larger by this part of it.
    """
    flint = import_flint()
    with flint.ctx.workprec(200):
        factor = 1 + flint.arb(off)
        q, v = ([flint.arb(x) * factor for x in part] for part in (problem.q, problem.v))
    start = time.perf_counter()
    equations = eomgen.derive(problem.scene, problem.method)
    found = motion(equations, q, v, problem.end, digits)
    return _decimal([*found.q, *found.v]), found.steps, time.perf_counter() - start


def _decimal(state: Sequence[Any]) -> list[str]:
    return [x.mid().str(40, radius=False) for x in state]


def scaled(found: Sequence[Any], reference: Sequence[str]) -> float:
    """The larger of two errors: of the coordinates over the largest of them, of the rates alike.

    Args:
        found: the coordinates and the rates, as numbers or as decimal digits.
        reference: the same, as decimal digits.
    """
    flint = import_flint()
    errors = []
    with flint.ctx.workprec(200):
        n = len(reference) // 2
        for part in (slice(0, n), slice(n, None)):
            exact = [flint.arb(text) for text in reference[part]]
            values = [flint.arb(x if isinstance(x, str) else float(x)) for x in found[part]]
            apart = max(abs(float(x - y)) for x, y in zip(values, exact, strict=True))
            errors.append(apart / max(abs(float(x)) for x in exact))
    return max(errors)


def reference(problem: Problem, stored: Mapping[str, Record]) -> Record:
    """What the motion is at the end: in closed form, or as it is stored.

    Raises:
        CheckError: the stored one belongs to another motion.
    """
    if problem.scene.name == "flight":
        state = on_a_parabola(problem)
        flint = import_flint()
        with flint.ctx.workprec(200):
            off = 1 + flint.arb(EPS)
            moved = on_a_parabola(problem._replace(q=[x * off for x in problem.q], v=[x * off for x in problem.v]))
        text = _decimal(state)
        facts = {"source": "closed form", "difference": 0.0, "amplification": scaled(_decimal(moved), text) / EPS}
        return {**_head(problem), **facts, "state": text}
    found = stored.get(problem.name)
    if found is None or {name: found[name] for name in _head(problem)} != _head(problem):
        raise CheckError(
            f"{REFERENCE.name} has no motion {problem.name!r} with this start; run eomgen bench stability --reference"
        )
    return dict(found)


def _head(problem: Problem) -> Record:
    """What identifies a motion."""
    start = [*problem.q, *problem.v]
    return {"problem": problem.name, "who": "reference", "scene": problem.scene.to_dict(), "start": start}


def write_reference() -> None:
    """Computes the reference of every motion that has no closed form, on all cores, and stores it.

    Raises:
        CheckError: two runs of different digits do not agree.
    """
    runs = [(p, *run) for p in problems() for run in ((DIGITS[1], 0.0), (DIGITS[0], 0.0), (DIGITS[0], EPS))]
    runs = [run for run in runs if run[0].scene.name != "flight"]
    records = []
    with ProcessPoolExecutor() as pool:
        jobs = [pool.submit(solve, *run) for run in reversed(runs)]  # the longest first
        results = [job.result() for job in jobs][::-1]
    for k in range(0, len(runs), 3):
        (state, steps, seconds), (other, _, _), (moved, _, _) = results[k : k + 3]
        record = {
            **_head(runs[k][0]),
            "source": f"extrapolation, {DIGITS[1]} digits",
            "steps": steps,
            "seconds": round(seconds, 1),
            "difference": scaled(other, state),
            "amplification": scaled(moved, state) / EPS,
            "state": state,
        }
        records.append(record)
        report.progress(f"{record['problem']}: difference {record['difference']:.0e}, {seconds:.0f} s")
        if not record["difference"] < AGREED:
            raise CheckError(f"{record['problem']}: two references differ by {record['difference']:.0e}")
    report.write(REFERENCE, report.dumped({"suite": "stability reference", "digits": DIGITS, "records": records}))


# Integrators. Each makes, from a problem, a model and a setting, a function that integrates and returns the state.

Run = Callable[[], Array]


def _field(model: Any, n: int) -> Callable[[float, Array], Array]:
    u, p = np.zeros(n), model.p

    def field(_: float, x: Array) -> Array:
        rate = np.empty(2 * n)
        rate[:n] = x[n:]
        model.forward_dynamics(x[:n], x[n:], u, p, out=rate[n:])
        return rate

    return field


def _slope(model: Any, n: int) -> Callable[[float, Array], Array]:
    u, p = np.zeros(n), model.p
    matrix = np.zeros((2 * n, 2 * n))
    matrix[:n, n:] = np.eye(n)

    def slope(_: float, x: Array) -> Array:
        full = matrix.copy()
        full[n:] = model.jacobian(x[:n], x[n:], u, p)[:, : 2 * n]
        return full

    return slope


def by_scipy(method: str, problem: Problem, model: Any, tolerance: float) -> Run:
    """`solve_ivp`; implicit methods get the compiled Jacobian."""
    from scipy.integrate import solve_ivp

    n, start = len(problem.q), np.array([*problem.q, *problem.v])
    field = _field(model, n)
    options = {} if method == "DOP853" else {"jac": _slope(model, n)}

    def run() -> Array:
        found = solve_ivp(field, (0.0, problem.end), start, method=method, rtol=tolerance, atol=tolerance, **options)
        if not found.success:
            raise ArithmeticError(found.message)
        return np.asarray(found.y[:, -1])

    return run


def by_hairer(problem: Problem, model: Any, tolerance: float) -> Run:
    """`scipy.integrate.ode("dop853")`: the same method with its steps in compiled code."""
    from scipy.integrate import ode

    n, start = len(problem.q), np.array([*problem.q, *problem.v])
    field = _field(model, n)

    def run() -> Array:
        solver = ode(field).set_integrator("dop853", rtol=tolerance, atol=tolerance, nsteps=10**7)
        solver.set_initial_value(start, 0.0)
        found = solver.integrate(problem.end)
        if not solver.successful():
            raise ArithmeticError("dop853 gave up")
        return np.asarray(found)

    return run


def by_rk4(problem: Problem, model: Any, steps: float) -> Run:
    """The compiled rollout with fixed steps, one trajectory."""
    return _by_rollout(problem, model, problem.end / steps, steps=int(steps))


def by_dop853(problem: Problem, model: Any, tolerance: float) -> Run:
    """The compiled rollout with error control, one trajectory."""
    return _by_rollout(problem, model, problem.end, method="dop853", rtol=tolerance, atol=tolerance)


def _by_rollout(problem: Problem, model: Any, dt: float, **options: Any) -> Run:
    n = len(problem.q)
    q, v, u = np.array(problem.q), np.array(problem.v), np.zeros((1, n))

    def run() -> Array:
        return np.concatenate(model.rollout(q, v, u, model.p, dt, **options), axis=-1)[0]

    return run


class Expressions(Operators):
    """heyoka's expressions."""

    def __init__(self) -> None:
        import heyoka

        self.heyoka = heyoka

    def constant(self, value: Any) -> Any:
        return self.heyoka.expression(float(value))

    def turn(self, angle: Node, values: Mapping[Node, Any], label: Label) -> tuple[Any, Any]:
        return self.heyoka.cos(values[angle]), self.heyoka.sin(values[angle])


def by_heyoka(problem: Problem, model: Any, tolerance: float) -> Run:
    """heyoka's adaptive Taylor method on our expressions; it is built before, not timed.

    Raises:
        UnsupportedError: it is not installed.
    """
    if find_spec("heyoka") is None:
        raise UnsupportedError("not installed")
    import heyoka

    equations = eomgen.derive(problem.scene, problem.method)
    n, start = len(problem.q), [*problem.q, *problem.v]
    state = heyoka.make_vars(*(f"x{k}" for k in range(2 * n)))
    given = dict(zip((*equations.q, *equations.v), state, strict=True))
    given |= {symbol: heyoka.expression(0.0) for symbol in equations.u}
    given |= {p: heyoka.expression(float(x)) for p, x in zip(equations.p, equations.symbols.p_values, strict=True)}
    rates = [*state[n:], *evaluate(list(equations.forward_dynamics), given, Expressions())]
    system = [*zip(state, rates, strict=True)]
    made = heyoka.taylor_adaptive(system, start, tol=tolerance, compact_mode=n > 20)

    def run() -> Array:
        made.time, made.state[:] = 0.0, start
        outcome = made.propagate_until(problem.end)[0]
        if outcome != heyoka.taylor_outcome.time_limit:
            raise ArithmeticError(f"heyoka: {outcome}")
        return np.array(made.state)

    return run


class Integrator(NamedTuple):
    """An integrator: its label, how it is set up, its settings for a problem (loose to tight), colour and marker."""

    label: str
    make: Callable[[Problem, Any, float], Run]
    settings: Callable[[Problem], Sequence[float]]
    color: str
    marker: str


def _tolerances(*exponents: int) -> Callable[[Problem], Sequence[float]]:
    return lambda problem: [10.0**-k for k in exponents]


DOP853 = _tolerances(3, 5, 7, 9, 11, 13)
INTEGRATORS = {
    "dop853": Integrator("SciPy DOP853", partial(by_scipy, "DOP853"), DOP853, "#009e73", "o"),
    "hairer": Integrator("SciPy ode(dop853)", by_hairer, DOP853, "#009e73", "D"),
    "lsoda": Integrator("SciPy LSODA", partial(by_scipy, "LSODA"), _tolerances(3, 5, 7, 9, 11, 12), "#cc79a7", "s"),
    "radau": Integrator("SciPy Radau", partial(by_scipy, "Radau"), lambda p: p.radau, "#e69f00", "v"),
    "rk4": Integrator("eomgen rollout, RK4", by_rk4, lambda p: p.steps, "#56b4e9", "o"),
    "compiled": Integrator("eomgen rollout, DOP853", by_dop853, DOP853, "#0072b2", "D"),
    "heyoka": Integrator("heyoka", by_heyoka, _tolerances(6, 9, 12, 14, 16), "#d55e00", "^"),
}


# Measuring


def measure(quick: bool) -> dict[str, Any]:
    """Everything that goes into `stability.json`."""
    begin = time.monotonic()
    facts = report.machine(PACKAGES)
    stored = {record["problem"]: record for record in report.load(str(REFERENCE), "stability reference")["records"]}
    harness.one_core()
    records: list[Record] = []
    for problem in quick_problems() if quick else problems():
        exact = reference(problem, stored)
        records.append(exact)
        model = eomgen.compile(problem.scene, problem.method, functions=["forward_dynamics", "energy", "jacobian"])
        for who, integrator in INTEGRATORS.items():
            settings = integrator.settings(problem)
            for record in sweep(problem, model, who, settings[::-2][::-1] if quick else settings, exact["state"]):
                records.append(record)
                _show(record)
    return {
        "suite": "stability",
        "arguments": {"quick": quick},
        "machine": facts,
        "minutes": round((time.monotonic() - begin) / 60, 1),
        "records": records,
    }


def sweep(problem: Problem, model: Any, who: str, settings: Sequence[float], exact: Sequence[str]) -> Iterator[Record]:
    """A record for each setting of an integrator, until one takes too long."""
    for setting in settings:
        record: Record = {"problem": problem.name, "who": who, "setting": setting, "problem_met": ""}
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("error", UserWarning)
                run = INTEGRATORS[who].make(problem, model, setting)
                times, found = [], np.array([])
                while not times or (sum(times) < ENOUGH and len(times) < REPEATS):
                    start = time.process_time()
                    found = run()
                    times.append(time.process_time() - start)
        except (ArithmeticError, UnsupportedError, UserWarning) as error:
            yield {**record, "problem_met": one_line(str(error), 120)}
            if isinstance(error, UnsupportedError):
                return
            continue
        if not np.isfinite(found).all():
            yield {**record, "problem_met": "unstable"}
            continue
        record |= {"seconds": min(times), "repeats": len(times), "error": scaled(found, exact)}
        if problem.conserved:
            record["drift"] = drift(problem, model, found)
        yield record
        if times[-1] > PATIENCE:
            return


def drift(problem: Problem, model: Any, state: Array) -> float:
    """The change of the energy beside the larger of its parts, potential and kinetic, over the motion's ends."""
    n = len(problem.q)
    before = model.energy(np.array(problem.q), np.array(problem.v), model.p)
    after = model.energy(state[:n], state[n:], model.p)
    return float(abs(after.sum() - before.sum()) / np.abs([before, after]).max())


def _show(record: Record) -> None:
    head = f"{record['problem']:<36}{INTEGRATORS[record['who']].label:<28}{record['setting']:>9.3g}  "
    what = record["problem_met"] or f"{report.seconds(record['seconds'])}, error {record['error']:.1e}"
    report.progress(head + what)


# Rendering, from the JSON alone.


class Data:
    """The contents of `stability.json`."""

    def __init__(self, found: Mapping[str, Any]) -> None:
        self.found = found
        self.records: list[Record] = found["records"]
        self.references = {r["problem"]: r for r in self.records if r["who"] == "reference"}

    def of(self, problem: str, who: str) -> list[Record]:
        """The runs of an integrator."""
        return [r for r in self.records if (r["problem"], r["who"]) == (problem, who)]

    def measured(self, problem: str, who: str) -> list[Record]:
        """Those that came to the end."""
        return [r for r in self.of(problem, who) if not r["problem_met"]]


def target(data: Data) -> list[str]:
    """What the double pendulum says about DOP853 at its tightest, heyoka and RK4."""
    name = next(iter(data.references))
    found = [r for r in data.measured(name, "compiled") if r["setting"] == 1e-13]
    if not found or "double pendulum" not in name:
        return ["Not measured: DOP853 at rtol 1e-13 was not run."]
    (tight,) = found
    floor = EPS * data.references[name]["amplification"]
    rows = []

    def row(label: str, record: Record) -> None:
        rows.append([label, *_figures(record), report.digits(record["seconds"] / tight["seconds"])])

    for who in ("compiled", "hairer", "dop853", "heyoka"):
        for record in data.measured(name, who)[-1:]:
            row(f"{INTEGRATORS[who].label}, {record['setting']:.0e}", record)
    good = [r for r in data.measured(name, "rk4") if r["error"] <= tight["error"]]
    if good:
        first = min(good, key=lambda r: r["seconds"])
        row(f"{INTEGRATORS['rk4'].label}, {first['setting']:.3g} steps: the fastest no less accurate", first)
    peers = data.measured(name, "heyoka")
    if peers:
        ratio = tight["seconds"] / peers[-1]["seconds"]
        verdict = f"{report.digits(ratio)} × heyoka's time: {'met' if ratio <= RATIO else '**missed**'}."
    else:
        verdict = f"Open: heyoka {(data.of(name, 'heyoka') or [{'problem_met': 'was not run'}])[0]['problem_met']}."
    return [
        f"Double pendulum, 10 s, DOP853 at rtol 1e-13 with the compiled right-hand side: at most {RATIO:g} × the time "
        f"of heyoka. {verdict} One eps of the initial state has grown to {floor:.0e} at the end, beside DOP853's error "
        f"of {tight['error']:.0e}.",
        report.markdown(["integrator", "time", "error", "energy drift", "of the first's time"], rows),
    ]


def _figures(record: Record) -> list[str]:
    drift_ = f"{record['drift']:.0e}" if "drift" in record else "–"
    return [report.seconds(record["seconds"]), f"{record['error']:.1e}", drift_]


def render(data: Data) -> str:
    """`stability.md`."""
    parts = [
        "# Stability in time",
        f"Written by `eomgen bench stability` from `stability.json` ({data.found['minutes']} minutes).",
        report.describe_machine(data.found["machine"]),
        "Time is that of the processor on one core, the least of up to nine runs: the wall time on a machine that does "
        "nothing else. Building and compiling is not timed. The error is that of the state at the end: the largest one "
        "of a coordinate over the largest coordinate, or the same of the rates if that is larger. Energy drift is the "
        "change of the energy over the largest of its kinetic and potential parts at the start and the end. A "
        "tolerance is relative and absolute alike; implicit methods get the compiled Jacobian.",
        "## Target",
        *target(data),
        "## References",
        "The difference is that of two solutions with different digits, orders and steps. Growth: where every number "
        "of the initial state is larger by one eps of itself, the state at the end is off by eps × growth, in the "
        "measure of the error. A smaller error than that is smaller than what rounding the initial state does.",
        _references(data),
    ]
    for name in data.references:
        rows = []
        for who, integrator in INTEGRATORS.items():
            for r in data.of(name, who):
                figures = [r["problem_met"], "–", "–"] if r["problem_met"] else _figures(r)
                setting = f"{report.whole(r['setting'])} steps" if who == "rk4" else f"{r['setting']:.0e}"
                rows.append([integrator.label, setting, *figures])
        parts += [f"## {name[0].upper()}{name[1:]}", report.markdown(
            ["integrator", "tolerance or steps", "time", "error", "energy drift"], rows)]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def _references(data: Data) -> str:
    rows = [
        [
            name,
            r["source"],
            f"{r['difference']:.0e}" if r["difference"] else "–",
            f"{r['amplification']:.1e}",
            f"{EPS * r['amplification']:.0e}",
        ]
        for name, r in data.references.items()
    ]
    return report.markdown(["motion", "reference", "difference", "growth", "eps × growth"], rows)


def plot(data: Data, path: Path) -> None:
    """`stability.png`: a work-precision diagram for each motion."""
    names = list(data.references)
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    figure, axes = report.pyplot().subplots(rows, columns, figsize=(5.6 * columns, 4.5 * rows + 0.8), squeeze=False)
    entries: dict[str, Any] = {}
    for axis, name in zip(axes.flat, names, strict=False):
        for who, integrator in INTEGRATORS.items():
            points = [(max(r["error"], 1e-17), r["seconds"]) for r in data.measured(name, who) if r["error"] < 3]
            if points:
                heavy = who in ("rk4", "compiled")
                (drawn,) = axis.plot(
                    *zip(*points, strict=True), color=integrator.color, marker=integrator.marker,
                    linestyle=":" if who == "hairer" else "-", linewidth=2.2 if heavy else 1.2,
                    markersize=6, markerfacecolor=integrator.color if heavy else "white", zorder=3 if heavy else 2,
                )  # fmt: skip
                entries.setdefault(integrator.label, drawn)
        floor = EPS * data.references[name]["amplification"]
        entries.setdefault(
            "eps of the start, grown to the end", axis.axvline(floor, color="0.4", linewidth=1, linestyle=(0, (6, 4)))
        )
        axis.set(xscale="log", yscale="log", title=name, xlabel="error of the state at the end")
        axis.grid(True, which="major", color="0.85", linewidth=0.6)
        report.number(axis.yaxis, lambda value: report.seconds(value).replace(".00", "").replace(".0 ", " "))
    for axis in axes.flat[len(names) :]:
        axis.set_axis_off()
    for row in axes:
        row[0].set_ylabel("time, one core")
    figure.suptitle("Work and precision: time of an integration against its error (lower left is better)", fontsize=14)
    figure.legend(entries.values(), entries.keys(), loc="lower center", ncols=4, fontsize=10, frameon=False)
    figure.tight_layout(rect=(0, 0.1 if rows == 1 else 0.06, 1, 1))
    report.save(figure, path, dpi=100)


# The command line.


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The options."""
    parser = report.Parser(
        prog="eomgen bench stability",
        description="Measures the time of integrators against their error; writes stability.json, stability.md and "
        "stability.png. Run it on a quiet machine, with a Python that has heyoka.",
    )
    parser.add_argument(
        "--quick", action="store_true", help="three motions, every other setting, the tightest among them"
    )
    report.add_output(parser)
    parser.add_argument(
        "--reference", action="store_true", help=f"compute bench/{REFERENCE.name} again and stop (some minutes)"
    )
    options = parser.parse_args(arguments)
    if options.reference and (options.quick or options.from_json):
        raise OptionError("--reference stands alone")
    return options


def main() -> int:
    """Runs the suite."""
    options = parse()
    report.require("flint", "the reference of stability", "bench")
    if options.reference:
        write_reference()
        print(f"wrote {REFERENCE}")
        return 0
    report.require("matplotlib", "the plot of stability", "bench")
    report.require("scipy", "stability", "bench")
    report.produce(
        "stability",
        options,
        lambda: measure(options.quick),
        lambda found: render(Data(found)),
        lambda found, path: plot(Data(found), path),
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(report.command(main))
