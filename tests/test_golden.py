"""Emitted text beside stored text, as reviewed: `pytest tests/test_golden.py --update-golden` rewrites it.

What is stored must also compile without a warning and give the module's numbers, called from plain C.
"""

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import eomgen
from eomgen import backends, functions, pipeline
from eomgen.ir.text import dump
from eomgen.scene import PointMasses, Rigid, Scene

HERE = Path(__file__).resolve().parent
GOLDEN = HERE / "golden"
RUNTIME = HERE.parent / "eomgen" / "backends" / "c" / "runtime"
FLAGS = ("-Wall", "-Wextra", "-Werror", "-std=gnu11", "-O1", "-ffp-contract=off")
FUNCTIONS = (
    "forward_dynamics",
    "inverse_dynamics",
    "mass_matrix",
    "bias",
    "energy",
    "prescribed_forces",
    "joints",
)

PENDULUM = Scene("pendulum", (Rigid(name="rod", mass=1.5, length=0.8, joint_stiffness=12.0, joint_rest_angle=0.25),))
LEG = Scene(
    "leg",
    (
        PointMasses(name="shank", length="free", masses=(0.7, 1.5, 0.7), fractions=(0.0, 0.595, 1.0), damping=3.0),
        PointMasses(name="thigh", parent="shank", length="prescribed", masses=(2.0, 1.0), fractions=(0.5, 1.0)),
    ),
)
CHAIN = eomgen.chain(4)

# Folder: scene, method, loops, functions.
CASES: dict[str, tuple[Scene, str, bool | None, tuple[str, ...]]] = {
    "pendulum": (PENDULUM, "matrix", None, tuple(name for name in FUNCTIONS if name != "prescribed_forces")),
    "leg": (LEG, "matrix", None, FUNCTIONS),
    "loops": (CHAIN, "articulated", True, ("forward_dynamics", "mass_matrix", "energy")),
}


def emitted(case: str) -> dict[str, str]:
    """The texts of a case by file name; the version stands as VERSION."""
    scene, method, loops, names = CASES[case]
    equations = pipeline.derive(scene, method)
    built = pipeline.programs(equations, names, loops=loops)
    model = pipeline.describe(equations, built, ("float64",), {})
    c, numpy_ = (backends.select(name).emit(model) for name in ("c", "numpy"))
    files = {name: text for name, text in c.items() if name.startswith("csrc/")}
    files["_kernel.py"] = numpy_["_kernel.py"]
    files["ir.txt"] = "\n\n".join(map(dump, built)) + "\n"
    return {name: text.replace(f"eomgen {eomgen.__version__}", "eomgen VERSION") for name, text in files.items()}


@pytest.mark.parametrize("case", CASES)
def test_emitted_text_is_as_reviewed(case: str, request: pytest.FixtureRequest) -> None:
    folder, files = GOLDEN / case, emitted(case)
    if request.config.getoption("--update-golden"):
        shutil.rmtree(folder, ignore_errors=True)
        for name, text in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
    stored = {
        str(path.relative_to(folder)): path.read_text(encoding="utf-8")
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert sorted(stored) == sorted(files), "see --update-golden"
    for name, text in files.items():
        assert text == stored[name], f"{case}/{name} has changed; review the difference, then --update-golden"


def compiler() -> list[str]:
    return shlex.split(os.environ.get("CC") or "cc")


def c_array(name: str, values: np.ndarray) -> str:
    return f"static const double {name}[] = {{{', '.join(float(x).hex() for x in values.flat)}}};"


# The plain C interface as a user meets it: the header, no Python. A function of one state, then of three.
MAIN = """\
#include <stdio.h>
#include "{name}.h"

{arrays}

int main(void)
{{
    double out[{size}], batch[3 * {size}];
    {calls}
    return 0;
}}
"""
CALL = """\
{name}_{function}({one}, {name}_p, out);
    {name}_{function}_batch(3, {all}, {name}_p, batch);
    printf("{function}");
    for (int i = 0; i < {count}; i++) printf(" %a", out[i]);
    for (int i = 0; i < 3 * {count}; i++) printf(" %a", batch[i]);
    printf("\\n");
"""


@pytest.mark.parametrize("case", CASES)
def test_stored_c_compiles_and_is_the_modules_function(case: str, tmp_path: Path) -> None:
    scene, method, loops, names = CASES[case]
    module = eomgen.compile(scene, method, functions=names, loops=loops)
    rng, n, k = np.random.default_rng(5), len(scene.q_names), len(scene.prescribed)
    inputs = {letter: rng.uniform(0.3, 1.2, (3, n)) for letter in "qvau"}
    inputs["w"] = rng.uniform(0.3, 1.2, (3, k, 3))
    expected: dict[str, np.ndarray] = {}
    calls = []
    for function in names:
        program_inputs = [letter for letter in functions.FUNCTIONS[function].arguments if letter != "w" or k]
        result = getattr(module, function)(*(inputs[letter] for letter in program_inputs), module.p)
        expected[function] = result.reshape(3, -1)
        call = {
            "one": ", ".join(program_inputs),
            "all": ", ".join(program_inputs),
            "count": expected[function].shape[1],
        }
        calls.append(CALL.format(name=scene.name, function=function, **call))
    used = {letter for function in names for letter in functions.FUNCTIONS[function].arguments}
    arrays = "\n".join(c_array(letter, x) for letter, x in inputs.items() if letter in used and x.size)
    size = max(values.shape[1] for values in expected.values())
    main = MAIN.format(name=scene.name, arrays=arrays, size=size, calls="    ".join(calls))
    for path in (GOLDEN / case / "csrc").iterdir():
        shutil.copy(path, tmp_path)
    for path in RUNTIME.glob("*.[ch]"):
        shutil.copy(path, tmp_path)
    (tmp_path / "main.c").write_text(main)
    sources = [f"{scene.name}.c", "eomgen_batch.c", "main.c"]
    built = subprocess.run(
        [*compiler(), *FLAGS, *sources, "-lm", "-o", "main"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert not built.stderr
    assert built.returncode == 0
    done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True)
    lines = [line.split() for line in done.stdout.splitlines()]
    assert [line[0] for line in lines] == list(names)
    for function, *texts in lines:
        values = np.array([float.fromhex(text) for text in texts]).reshape(4, -1)
        assert values[0].tolist() == values[1].tolist(), f"{function}: one state and a batch differ"
        scale = np.abs(expected[function]).max()
        np.testing.assert_allclose(values[1:], expected[function], rtol=0, atol=1e-13 * scale, err_msg=function)


@pytest.mark.parametrize("case", CASES)
def test_headers_are_for_cpp_too(case: str, tmp_path: Path) -> None:
    """The plain C header is also C++, and can be included twice."""
    cpp = shutil.which("c++")
    if cpp is None:
        pytest.skip("no C++ compiler")
    name = f"{CASES[case][0].name}.h"
    shutil.copy(GOLDEN / case / "csrc" / name, tmp_path)
    (tmp_path / "main.cpp").write_text(f'#include "{name}"\n#include "{name}"\nint main() {{ return 0; }}\n')
    command = [cpp, "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only", "main.cpp"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("case", CASES)
def test_every_section_says_what_it_computes(case: str) -> None:
    """The C is for readers: each function's head names its shapes, the file's head every input with its unit."""
    scene, _, _, names = CASES[case]
    text = (GOLDEN / case / "csrc" / f"{scene.name}_kernels.h").read_text(encoding="utf-8")
    assert re.findall(r"^/\* ---- (\w+) ----$", text, re.MULTILINE) == list(names)
    for i, name in enumerate(scene.q_names):
        assert f" * q[{i}]  {name} ({scene.q_units[i]})" in text
    for i, parameter in enumerate(scene.parameters):
        assert f" * p[{i}]  {parameter.name} ({parameter.unit})" in text
    assert max(map(len, text.splitlines())) < 2000
