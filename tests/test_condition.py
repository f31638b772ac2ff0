"""`condition` of a module: the certified number, in batches, for every type."""

from __future__ import annotations

import pickle
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import eomgen
from eomgen import hard
from eomgen.backends import package

BACKENDS = ["c", "numpy"]
EPS = np.finfo(float).eps


@pytest.fixture(scope="module", params=BACKENDS)
def point(request: pytest.FixtureRequest) -> ModuleType:
    """One link of free length with point masses: M is diagonal, so scaled it is the unit matrix."""
    return eomgen.compile(eomgen.chain(1), backend=request.param, dtypes=["float32", "float64", "longdouble"])


@pytest.mark.parametrize("backend", BACKENDS)
def test_it_is_the_certified_number(backend: str) -> None:
    """To κ eps, a few times: M is rounded, and so are its eigenvalues."""
    certify = pytest.importorskip("eomgen.certify")
    pytest.importorskip("flint", reason="certified condition numbers need python-flint")
    for scene in (hard.rods(), hard.lumped(), eomgen.walker()):
        cases = [case for case in hard.cases() if case.scene.name == scene.name]
        module = eomgen.compile(scene, backend=backend, functions=["mass_matrix"])
        exact = certify.Exact(scene)
        for case in cases:
            values = case.values
            if "subnormal" not in case.name:
                arguments = [values[letter] for letter in ("q", "w", "p") if letter != "w" or module.w_names]
                _, expected = exact.mass_conditions(values)
                assert module.condition(*arguments) == pytest.approx(expected, rel=100 * EPS * expected), case.name


def test_units_do_not_matter(point: ModuleType) -> None:
    """A short link is no ill-conditioned one: its angle is measured in large units, that is all."""
    for length in (1.0, 1e-3, 1e-12, 1e-100):
        assert point.condition([0.3, length], point.p) == pytest.approx(1, rel=8 * EPS)
    assert np.linalg.cond(point.mass_matrix([0.3, 1e-12], point.p)) > 1e23


@pytest.fixture(scope="module")
def pair() -> ModuleType:
    """Two massless rods with a mass at the end of each, dense elimination."""
    rods = [
        eomgen.JointMasses(name=name, parent=parent, length=1.0, masses=(0.0, 0.0, mass), fraction=0.5)
        for name, parent, mass in (("near", "ground", 0.5), ("far", "near", 1.0))
    ]
    scene = eomgen.Scene("pair", tuple(rods))
    return eomgen.compile(scene, backend="numpy", functions=["forward_dynamics", "mass_matrix"], solver="dense")


def test_a_known_matrix(pair: ModuleType) -> None:
    """In line, κ₂ of [[1, c], [c, 1]] is (1 + c)/(1 - c)."""
    module, c = pair, 1 / np.sqrt(1.5)
    assert module.condition([0.0, 0.0], module.p) == pytest.approx((1 + c) / (1 - c), rel=1e-14)


def test_batches_broadcast(point: ModuleType) -> None:
    q = np.array([[[0.3, 1.0]], [[0.2, 0.0]], [[0.1, np.nan]]])
    found = point.condition(q, np.tile(point.p, (4, 1)))
    assert found.shape == (3, 4)
    assert found[0] == pytest.approx(1, rel=8 * EPS)
    assert (found[1] == np.inf).all()
    assert np.isnan(found[2]).all()
    assert np.ndim(point.condition([0.3, 1.0], point.p)) == 0


@pytest.mark.parametrize("dtype", ["float32", "longdouble"])
def test_every_type(point: ModuleType, dtype: str) -> None:
    found = point.condition(np.array([0.3, 0.5], dtype), point.p.astype(dtype))
    assert found == pytest.approx(1, rel=4 * float(np.finfo("float32").eps))
    assert found.dtype == np.float64


def test_no_pivot_is_refused_below_the_limit(pair: ModuleType) -> None:
    """Each pivot of the dense elimination is at least 1/κ of its reference: finite below 1/(16 eps)."""
    p, state = pair.p.copy(), np.zeros(2)
    seen = set()
    for mass in np.geomspace(1.0, 1e-20, 41):
        p[pair.p_names.index("near.mass3")] = mass
        with np.errstate(invalid="ignore"):
            finite = bool(np.isfinite(pair.forward_dynamics(state, state, state, p)).all())
        safe = bool(pair.condition(state, p) < 1 / (20 * EPS))
        assert finite or not safe
        seen.add((finite, safe))
    assert {(True, True), (False, False)} <= seen


def test_it_belongs_to_the_mass_matrix(tmp_path: Path) -> None:
    without = eomgen.compile(eomgen.chain(1), backend="numpy", functions=["joints"])
    assert not hasattr(without, "condition")
    made = eomgen.compile(eomgen.chain(1), backend="numpy", out=tmp_path / "conditioned")
    assert "condition" in made.__all__
    assert (tmp_path / "conditioned" / "_condition.py").read_text() == package.CONDITION.read_text()
    assert "eomgen" not in package.CONDITION.read_text()


def test_it_pickles(point: ModuleType) -> None:
    assert pickle.loads(pickle.dumps(point.condition)) is point.condition
