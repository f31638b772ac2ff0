"""The same scene and options give the same bytes in any process, whatever its hash seed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
CASES = ("telescopic_4_mixed", "point_masses_3_hanging", "springs")
LOOPED = ("springs",)  # also as loops over links

# Run in the subprocesses; they print everything that depends on the scene as text.
SCRIPT = """
import json, sys
import eomgen
from bench.cases import CASES
from eomgen import backends, pipeline
from eomgen.frontends import METHODS
from eomgen.frontends.recursive import extend
from eomgen.ir.text import dump
from eomgen.report import shown_equations

cases, looped = json.loads(sys.argv[1])
texts = {}

def note(name, equations, **options):
    built = pipeline.programs(equations, **options)
    for program in built:
        texts[f"{name}, {program.name}"] = dump(program)
    model = pipeline.describe(equations, built, ("float32", "float64"), {})
    for kind, backend in backends.BACKENDS.items():
        for file, text in backend.emit(model).items():
            texts[f"{name}, {kind}, {file}"] = text

for case in cases:
    for method in METHODS:
        note(f"{case}, {method}", pipeline.derive(CASES[case], method))
    note(f"{case}, folded", pipeline.derive(CASES[case], fold=True))
for case in looped:
    note(f"{case}, looped", pipeline.derive(CASES[case], "articulated"), loops=True)
shorter = pipeline.derive(eomgen.chain(2), "recursive")
note("extended", extend(shorter, eomgen.chain(3).links[2]))
texts["shown"] = shown_equations(eomgen.chain(2), "matrix", None, "text")
json.dump(texts, sys.stdout)
"""

SYMPY = """
import json, sys
import sympy
import eomgen
from eomgen import backends, pipeline
from eomgen.report import shown_equations

x, y, xd, yd, m, k, g = sympy.symbols("x y xd yd m k g")
T = m * (xd**2 + yd**2 + (x * yd + xd * y) ** 2) / 2
V = k * x**2 * y / 2 + m * g * sympy.sin(x - 2 * y) + sympy.sqrt(x * x + y * y + 1)
equations = eomgen.lagrangian(T, V, [x, y], {m: 1.0, k: 2.0, g: 3.0}, v=[xd, yd])
model = pipeline.describe(equations, pipeline.programs(equations), ("float64",), {})
texts = {}
for kind, backend in backends.BACKENDS.items():
    texts.update({f"{kind}, {file}": text for file, text in backend.emit(model).items()})
texts["latex"] = shown_equations(eomgen.chain(1), "matrix", None, "latex")
json.dump(texts, sys.stdout)
"""


def outputs(script: str, *arguments: str) -> list[dict[str, str]]:
    """What the script prints under different hash seeds, the processes running side by side."""
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", script, *arguments],
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for seed in ("1", "2")
    ]
    found = [process.communicate(timeout=120) for process in processes]
    assert [process.returncode for process in processes] == [0, 0], found[0][1] + found[1][1]
    return [json.loads(text) for text, _ in found]


def same(one: dict[str, str], two: dict[str, str]) -> None:
    assert list(one) == list(two)
    different = [name for name in one if one[name] != two[name]]
    assert not different


def test_emitted_files() -> None:
    """Every scene, method and back end: dumps, C, headers, NumPy source and the packages' `__init__`."""
    one, two = outputs(SCRIPT, json.dumps([CASES, LOOPED]))
    assert len(one) > 50 * len(CASES)
    same(one, two)


def test_energies_of_a_users_own() -> None:
    """SymPy orders its sums by hash in places; what is emitted does not depend on it."""
    pytest.importorskip("sympy")
    same(*outputs(SYMPY))


def test_the_module_name_is_the_same() -> None:
    """The digest, by which another process finds a model in the cache."""
    script = (
        "import json, sys, eomgen; "
        "module = eomgen.compile(eomgen.chain(2), backend='numpy'); "
        "json.dump({'name': module.__name__}, sys.stdout)"
    )
    same(*outputs(script))
