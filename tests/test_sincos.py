"""Certifies the arithmetic of eomgen_real.h: inlined sine and cosine first of all.

Errors are measured against arb (ball arithmetic), which encloses the exact values, in units in the last place
of the exact value.  `python tests/test_sincos.py [arguments]` measures a million arguments and the speed, and
prints a table.
"""

import math
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from eomgen import certify
from eomgen.backends.numpy.runtime import _gufunc

try:
    import flint
except ImportError:
    flint = None

HERE = Path(__file__).resolve().parent
RUNTIME = HERE.parent / "eomgen" / "backends" / "c" / "runtime"
LIMIT = 2.0**20
FLAGS = ("-O2", "-std=c11", "-ffp-contract=off", "-Wall", "-Wextra")
TYPES = ("f64", "f64v", "f32", "f32v")
CLAIMED = {"f64": 0.94, "f64v": 0.94, "f32": 0.6, "f32v": 0.6, "f80": 1.0}  # ulp, as the header states
CLAIMED_UNFUSED = {"f64": 0.9, "f64v": 0.9}  # where the target has no fused multiply-add

needs_arb = pytest.mark.skipif(flint is None, reason="python-flint is not installed: nothing to certify errors with")


# ---- builds ------------------------------------------------------------------------------------------------


def compilers():
    """The C compilers of this system, under their different names once each."""
    found = {}
    for name in ("cc", "gcc", "clang"):
        path = shutil.which(name)
        if path:
            found.setdefault(Path(path).resolve(), name)
    return list(found.values())


def variants():
    """What the driver is built for: name and flags."""
    yield "portable", ["-DEOM_WITHOUT_BUILTINS"]  # also the target's baseline: no fused operations on x86-64
    if platform.machine().lower() not in ("x86_64", "amd64"):
        yield "baseline", []
        return
    yield "native", ["-march=native"]
    yield "baseline", []
    info = Path("/proc/cpuinfo")
    flags = info.read_text().split() if info.exists() else []
    if "avx2" in flags and "fma" in flags:
        yield "avx2", ["-mavx2", "-mfma"]
        yield "portable-fused", ["-mavx2", "-mfma", "-DEOM_WITHOUT_BUILTINS"]


class Build:
    def __init__(self, name, compiler, flags, folder):
        self.name = name
        self.program = folder / f"sincos_check-{name}"
        command = [compiler, *FLAGS, *flags, f"-I{RUNTIME}"]
        command += [str(HERE / "c" / "sincos_check.c"), "-o", str(self.program), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        self.log = done.stderr
        self.fused, self.bytes = map(int, self.text("target").split()) if done.returncode == 0 else (0, 0)

    def text(self, *command, x=()):
        data = np.ascontiguousarray(x, dtype=float).tobytes()
        return subprocess.run([self.program, *command], input=data, capture_output=True, check=True).stdout

    def __call__(self, command, kind, x, columns=1):
        out = np.frombuffer(self.text(command, kind, x=x))
        return out.reshape(-1, columns).T if columns > 1 else out

    def sincos(self, kind, x):
        return self("sincos", kind, x, columns=2)


def make_builds(folder):
    found = compilers()
    wanted = [(f"{found[0]}-{name}", found[0], flags) for name, flags in variants()] if found else []
    wanted += [(f"{other}-native", other, dict(variants()).get("native", [])) for other in found[1:]]
    with ThreadPoolExecutor() as pool:
        return list(pool.map(lambda w: Build(*w, folder), wanted))


@pytest.fixture(scope="module")
def builds(tmp_path_factory):
    made = make_builds(tmp_path_factory.mktemp("sincos"))
    if not made:
        pytest.skip("no C compiler on this system")
    for build in made:
        assert build.bytes, f"{build.name}:\n{build.log}"
    return made


@pytest.mark.parametrize(("flags", "why"), [(("-std=c99",), "C11"), (("-std=c11", "-ffast-math"), "-ffast-math")])
def test_flags_that_would_break_it_are_refused(flags, why):
    for compiler in compilers():
        command = [compiler, *flags, "-fsyntax-only", str(RUNTIME / "eomgen_batch.c")]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode != 0, compiler
        assert re.search(f"error: .*{why}", done.stderr), done.stderr[:400]


# ---- arguments ---------------------------------------------------------------------------------------------


def convergents(a):
    """Convergents and the two last semiconvergents before each, of the positive rational a, as pairs."""
    p0, q0, p1, q1 = 0, 1, 1, 0
    n, d = a.numerator, a.denominator
    while d:
        whole, rest = divmod(n, d)
        for m in range(max(1, whole - 2), whole + 1):
            yield p0 + m * p1, q0 + m * q1
        p0, q0, p1, q1 = p1, q1, p0 + whole * p1, q0 + whole * q1
        n, d = d, rest


def half_pi():
    """pi/2 as a fraction with 400 correct bits (Machin's formula)."""
    one = 1 << 440

    def arctan_inverse(n):
        total, term, k = 0, one // n, 0
        while term:
            total += (-1) ** k * (term // (2 * k + 1))
            term //= n * n
            k += 1
        return total

    return Fraction(8 * arctan_inverse(5) - 2 * arctan_inverse(239), one)


def hardest(bits, largest=20):
    """Numbers of `bits` significant bits below 2^largest nearest to multiples of pi/2, binade by binade."""
    found = set()
    for exponent in range(largest):
        unit = Fraction(2) ** (exponent - bits + 1)  # x = m unit, 2^(bits-1) <= m < 2^bits
        for m, j in convergents(half_pi() / unit):
            if m and j:
                low, high = -(-(1 << (bits - 1)) // m), ((1 << bits) - 1) // m
                for times in {low, low + 1, high} if low <= high else ():
                    if low <= times <= high:
                        found.add(float(times * m * unit))
    return np.array(sorted(found))


def arguments(count, single=False, seed=1):
    """About `count` arguments of every kind, then the special ones; all of them floats if `single`."""
    rng = np.random.default_rng(seed)
    kind = np.float32 if single else np.float64
    part = count // 8
    largest = int(LIMIT / (np.pi / 4))
    quarter = rng.integers(1, largest, part) * (np.pi / 4)  # near multiples of pi/4, within ulps
    near = quarter.astype(kind)
    bits = np.int32 if single else np.int64
    near = (near.view(bits) + rng.integers(-3, 4, part).astype(bits)).view(kind)
    tiny = -149.0 if single else -1074.0
    hard = hardest(24 if single else 53)
    x = [
        rng.uniform(-np.pi, np.pi, part),
        rng.uniform(-1, 1, part),
        rng.uniform(-100, 100, part),
        rng.uniform(-LIMIT, LIMIT, part),
        np.exp2(rng.uniform(-60, 20, part)),
        -np.exp2(rng.uniform(-8, 5, part)),
        np.exp2(rng.uniform(tiny, 0, part)),
        near,
        hard,
        np.nextafter(kind(LIMIT), kind([0, np.inf])),
        [LIMIT, 1e15, -1e22, 1e30],
        [0.0, -0.0, 2.0**tiny, -(2.0**tiny), 2.0**-126, 2.0**-1022 if not single else 2.0**-127],
        [] if single else [1e300, -1.7976931348623157e308],
        -hard,
    ]
    x = np.concatenate([np.asarray(v, dtype=kind) for v in x]).astype(float)
    return np.clip(x, -3e38, 3e38).astype(kind).astype(float) if single else x


# ---- errors ------------------------------------------------------------------------------------------------


def reference(x):
    """Sine and cosine of x, each as hi + lo with an error far below what matters (asserted)."""
    old, flint.ctx.prec = flint.ctx.prec, 220
    try:
        out = np.empty((4, len(x)))
        for i, value in enumerate(x.tolist()):
            sine, cosine = flint.arb(value).sin_cos()
            assert value == 0 or min(sine.rel_accuracy_bits(), cosine.rel_accuracy_bits()) > 110, value
            s, c = float(sine.mid()), float(cosine.mid())
            out[:, i] = s, float((sine - s).mid()), c, float((cosine - c).mid())
        return out.reshape(2, 2, len(x))
    finally:
        flint.ctx.prec = old


def ulps(got, exact, single=False):
    """Error in units in the last place of the exact value hi + lo."""
    hi, lo = exact
    mantissa, exponent = np.frexp(hi)
    exponent = exponent - ((np.abs(mantissa) == 0.5) & (hi * lo < 0))
    ulp = np.ldexp(1.0, np.maximum(exponent - 24, -149) if single else np.maximum(exponent - 53, -1074))
    return np.abs(((got - hi) - lo) / ulp)


@pytest.fixture(scope="module")
def certified():
    """Arguments with their exact values, for doubles and for floats."""
    if flint is None:
        return None
    x, y = arguments(20000), arguments(8000, single=True)
    return {False: (x, reference(x)), True: (y, reference(y))}


@needs_arb
def test_errors_are_below_what_is_claimed(builds, certified):
    for build in builds:
        claimed = CLAIMED if build.fused else CLAIMED | CLAIMED_UNFUSED
        for kind in (*TYPES, "f80"):
            single = kind.startswith("f32")
            x, exact = certified[single]
            for got, name, true in zip(build.sincos(kind, x), ("sin", "cos"), exact, strict=True):
                error = np.where(np.abs(x) <= LIMIT, ulps(got, true, single), 0)
                worst = int(np.argmax(error))
                where = f"{build.name} {kind}: {name}({float(x[worst]).hex()}) errs by {error[worst]} ulp"
                assert error[worst] <= claimed[kind], where


def pairs(count, single=False, seed=5):
    """About `count` pairs of angles of every kind, as rows: near, winding, far apart, of mixed size, near multiples."""
    kind = np.float32 if single else np.float64
    rng = np.random.default_rng(seed)
    part = count // 8
    hard = hardest(24 if single else 53)[-part:]
    turns = 10.0 ** rng.uniform(-8, 15, (2, part)) * rng.choice([-1, 1], (2, part))
    columns = [
        rng.uniform(-np.pi, np.pi, (2, part)),
        rng.uniform(-4, 4, (1, part)) + [[0], [1]] * rng.normal(size=part) * 1e-8,
        rng.uniform(-30, 30, (2, part)),
        rng.uniform(-LIMIT, LIMIT, (2, part)) / 2,
        turns,
        [turns[0], rng.uniform(-np.pi, np.pi, part)],
        [turns[1] + 8 * rng.integers(-1, 2, part), turns[1]],  # on both sides of the limit of small differences
        [hard, -hard / 1024],
        [rng.integers(1, 1 << 19, part) * np.pi, np.full(part, 3e-9)],
        [[1e15, 0.7, -1e6, 1e30, 3e38, -3e38, 8, -8, 0, -0.0], [0.7, -1e6, 0.7, 0.7, -3e38, -3e38, 0, 1e-9, 0, 0]],
    ]
    return np.concatenate([np.transpose(column) for column in columns]).astype(kind).astype(float)


@needs_arb
def test_sines_of_differences(builds):
    """Certified: nothing of x - y is lost but, where it is below 8, half a unit in its last place.

    Floats are subtracted as doubles, and results of long double are seen rounded to double.
    """
    for single in (False, True):
        rows = pairs(6000, single)
        x, y = rows.T
        with flint.ctx.workprec(400):
            turns = [flint.arb(a) - flint.arb(b) for a, b in rows.tolist()]
            exact = [[(float(z.mid()), float((z - float(z.mid())).mid())) for z in turn.sin_cos()] for turn in turns]
        exact = np.transpose(exact, (1, 2, 0))
        eps, turn = 2.0**-23 if single else 2.0**-52, np.abs(x - y)
        rounded = np.where(turn < 8, np.spacing(turn) / 2 + eps / 2, 2 * eps)
        for build in builds:
            for kind in ("f32", "f32v") if single else ("f64", "f64v", "f80"):
                most = rounded if kind.startswith("f64") else np.full(len(rows), eps / 2)
                for values, (hi, lo) in zip(build("difference", kind, rows, columns=2), exact, strict=True):
                    error = np.abs((values - hi) - lo)
                    worst = int(np.argmax(error - most))
                    where = f"{build.name} {kind}: {rows[worst].tolist()} errs by {error[worst] / eps} eps"
                    assert error[worst] <= most[worst], where


def test_a_small_difference_is_rounded_and_no_more(builds):
    """Where |x - y| < 8 the values are those of the rounded difference, to the bit."""
    rows = pairs(2000)
    turn = rows[:, 0] - rows[:, 1]
    small = np.abs(turn) < 8
    assert small.sum() > 500 and (~small).sum() > 500
    for build in builds:
        for kind in ("f64", "f64v"):
            found, expected = build("difference", kind, rows, columns=2), build.sincos(kind, turn)
            assert (found[:, small] == expected[:, small]).all()


def test_lanes_of_differences_agree_with_scalars_to_the_bit(builds):
    special = [(np.inf, 1.0), (1.0, np.nan), (1e15, 0.7), (3e38, -3e38), (-0.0, 0.0), (np.inf, np.inf)]
    for build in builds:
        for kind in TYPES:
            rows = pairs(1600, single=kind.startswith("f32"), seed=6)
            often = np.concatenate([np.tile(special, (20, 1)), rows[::8]])
            for values in (rows[np.abs(rows[:, 0] - rows[:, 1]) < 8], rows, often):
                assert int(build.text("difference_lanes", kind, x=values)) == 0, f"{build.name} {kind}"


def test_beyond_the_limit_libm_answers(builds):
    """Not certified: glibc 2.36 itself errs by 8 ulp at the last, nearest of all to a multiple of pi/2."""
    nearest = 6381956970095103.0 * 2.0**797
    x = np.array([np.nextafter(LIMIT, np.inf), -1e7, 1e15, -1e22, 1e300, -1.79e308, nearest])
    for build in builds:
        for kind, number in (("f64", float), ("f64v", float), ("f32", np.float32), ("f32v", np.float32)):
            args = x if number is float else x[np.abs(x) < 3e38].astype(number).astype(float)
            for got, function in zip(build.sincos(kind, args), (math.sin, math.cos), strict=True):
                expected = np.array([function(v) for v in args], number)
                assert (np.abs(got - expected) <= np.spacing(np.abs(expected))).all(), f"{build.name} {kind}"


def test_the_hardest_reductions_are_among_the_arguments():
    x = arguments(8)
    assert 45.553093477052 in x and -45.553093477052 in x  # within 2^-60.4 of 29 pi/2
    assert abs(Fraction(45.553093477052) - 29 * half_pi()) < Fraction(1, 2**60)


def test_parts_of_half_pi():
    """The parts in the header sum up to pi/2, and are as short as exact products need them."""
    parts = []
    for line in (RUNTIME / "eomgen_real.h").read_text().splitlines():
        if line.startswith("#define EOM_P") and line.split()[1][5:].strip("P").isdigit():
            if line.split()[1] == "EOM_P1":
                parts.append([])
            parts[-1].append(Fraction(float.fromhex(line.split()[2])))
    widths = [[f.numerator.bit_length() for f in group] for group in parts]
    assert len(parts) == 2 and max(widths[0]) <= 53 and widths[0][1] <= 33 and max(widths[1][:3]) <= 33
    for group, bits in zip(parts, (141, 159), strict=True):
        assert abs(sum(group) - half_pi()) < Fraction(1, 2**bits)


def test_lanes_agree_with_scalars_to_the_bit(builds):
    """In every lane position, beside every sort of neighbour: huge, infinite, NaN; also two angles at once."""
    special = [np.inf, -np.inf, np.nan, 1e30, -1e15, 3e38, 0.0, -0.0, 1e-45, LIMIT, -LIMIT]
    for build in builds:
        for kind in TYPES:
            x = arguments(2000, single=kind.startswith("f32"), seed=2)
            rare = np.concatenate([x, special])
            often = np.concatenate([np.tile(special, 20), x[::16]])
            for values in (x[np.abs(x) <= LIMIT], rare, often):
                assert int(build.text("lanes", kind, x=values)) == 0, f"{build.name} {kind}"


def test_special_values(builds):
    for build in builds:
        for kind in TYPES:
            tiny = 2.0**-149 if kind.startswith("f32") else 5e-324
            x = np.array([0.0, -0.0, tiny, -tiny, np.inf, -np.inf, np.nan])
            s, c = build.sincos(kind, x)
            assert s[:4].tobytes() == x[:4].tobytes() and (c[:4] == 1).all()
            assert np.isnan(s[4:]).all() and np.isnan(c[4:]).all()


def test_flags(builds):
    """Infinity raises `invalid`, as in libm; finite arguments and NaN neither that nor overflow or divide."""
    for build in builds:
        for kind in TYPES:
            x = arguments(4000, single=kind.startswith("f32"), seed=3)
            raised = build("flags", kind, np.concatenate([x, [np.nan] * 16, [np.inf, -np.inf] * 16]))
            assert not raised[:-32].any(), f"{build.name} {kind}: {x[np.nonzero(raised[: len(x)])[0][:3]]}"
            assert (raised[-32:] == 1).all()


@pytest.mark.parametrize("kind", [*TYPES, "f80"])
def test_pivot_inverse(builds, kind):
    if kind == "f80":
        epsilon = float(np.finfo(np.longdouble).eps)
    else:
        epsilon = 2.0**-23 if kind.startswith("f32") else 2.0**-52
    large = 1e36 if kind.startswith("f32") else 1e300  # times 1 / epsilon it would overflow
    good = [(1, 1), (2, 0), (0.25, 1), (17 * epsilon, 1), (1e-30, 0), (np.inf, 1), (3, 1e3), (large, 1), (large, large)]
    bad = [(0, 0), (0, 1), (-0.0, 1), (16 * epsilon, 1), (-1, 1), (-np.inf, 1), (1, np.inf)]
    bad += [(np.nan, 1), (1, np.nan), (np.nan, np.nan)]
    for build in builds:
        inverse, flags = build("pivot", kind, np.array(good, float), columns=2)
        number = np.float32 if kind.startswith("f32") else np.float64
        expected = 1 / np.array(good, number)[:, 0]
        if kind != "f80":
            assert (inverse == expected).all()
        assert np.allclose(inverse, expected, rtol=1e-15) and not flags.any()
        inverse, flags = build("pivot", kind, np.array(bad, float), columns=2)
        assert np.isnan(inverse).all() and (flags == 1).all()


def test_other_operations(builds):
    for build in builds:
        for kind in (*TYPES, "f80"):
            half = 2.0**-12 if kind.startswith("f32") else 2.0**-27
            rows = [(1 + half, 1 + half, -(1 + 2 * half)), (2.0, 7.0, -1.0), (9.0, -1.5, 0.25)]
            fma, root, exp, log, same = build("other", kind, np.array(rows), columns=5)
            a = np.array(rows)[:, 0]
            assert fma[0] == (half * half if build.fused or kind == "f80" else 0.0)
            assert list(fma[1:]) == [13.0, -13.25]
            tolerance = 2e-7 if kind.startswith("f32") else 3e-16
            assert np.allclose(root, np.sqrt(a), rtol=tolerance, atol=0)
            assert np.allclose(exp, np.exp(a), rtol=tolerance, atol=0)
            assert np.allclose(log, np.log1p(a - 1), rtol=tolerance, atol=0)
            assert (same == a).all()
            if kind.endswith("v"):
                assert build.text("other", kind, x=rows) == build.text("other", kind[:-1], x=rows)


def test_compiles_without_warnings(builds):
    for build in builds:  # what the compiler says of its own flags does not count
        assert "eomgen_real.h" not in build.log and "sincos_check.c" not in build.log, build.log


def test_far_is_the_same_everywhere():
    """From where differences are corrected in C and NumPy, and what the certified bound takes for granted."""
    header = (RUNTIME / "eomgen_real.h").read_text(encoding="utf-8")
    limit = re.search(r"#define EOM_DIFFERENCE (\S+)", header).group(1)
    assert math.nextafter(float.fromhex(limit), math.inf) == _gufunc.FAR == certify.FAR


# ---- by hand -----------------------------------------------------------------------------------------------


def main(count=1_000_000):
    """Measures `count` arguments (doubles; an eighth as many floats) and the speed, for all builds."""
    with tempfile.TemporaryDirectory() as folder:
        builds = make_builds(Path(folder))
        sets = {False: arguments(count, seed=4), True: arguments(count // 8, single=True, seed=4)}
        exact = {single: reference(x) for single, x in sets.items()}
        for build in builds:
            print(f"{build.name}: fused {build.fused}, {build.bytes} bytes")
            speeds = dict(line.split() for line in build.text("speed").decode().splitlines())
            for kind in (*TYPES, "f80"):
                single = kind.startswith("f32")
                x, near = sets[single], np.abs(sets[single]) <= LIMIT
                line = f"  {kind:5} {speeds[kind]:>8} ns"
                for got, name, true in zip(build.sincos(kind, x), ("sin", "cos"), exact[single], strict=True):
                    error = np.where(near, ulps(got, true, single), 0)
                    worst = int(np.argmax(error))
                    line += f"   {name} {error[worst]:.4f} ulp at {float(x[worst]).hex()}"
                print(line)
            print(f"  libm  {speeds['libm']:>8} ns (double)")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
