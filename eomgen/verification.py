"""`eomgen verify`: all methods are one function, and every back end computes it to a measured error.

Identity is decided exactly, in a prime field (`eomgen.ir.interpret.PrimeField`). Tolerances are left for rounding
only: compiled results are compared with a 60-digit evaluation of the same graph from the same binary inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from eomgen import frontends, functions, hard, pipeline
from eomgen.errors import UnsupportedError
from eomgen.frontends.mechanism import Mechanism
from eomgen.ir.equations import Equations
from eomgen.ir.interpret import Digits, PrimeField, evaluate, fingerprint, run
from eomgen.ir.program import Program
from eomgen.scene import Scene

EPS = float(np.finfo(float).eps)
MOST_LINKS = 24
POINTS = 2  # random points of the prime field


@dataclass
class Measured:
    """The error of one function of one compiled module over some states.

    Attributes:
        error: the largest difference from 60 digits, scaled by the largest entry of the result, in eps.
        bound: the largest error that rounding explains, in eps: 8 n, and for forward dynamics 2 κ(M) more.
    """

    method: str
    backend: str
    function: str
    error: float
    bound: float

    @property
    def passed(self) -> bool:
        return self.error <= self.bound


@dataclass
class Verification:
    """What `verify` found.

    Attributes:
        scene: name of the scene.
        identical: quantity -> method -> whether it is the function that most methods give.
        programs: method -> whether the passes kept every function.
        measured: errors of the compiled modules.
    """

    scene: str
    identical: dict[str, dict[str, bool]] = field(default_factory=dict)
    programs: dict[str, bool] = field(default_factory=dict)
    measured: list[Measured] = field(default_factory=list)

    @property
    def outcomes(self) -> list[bool]:
        found = [same for row in self.identical.values() for same in row.values()]
        return [*found, *self.programs.values(), *(item.passed for item in self.measured)]

    @property
    def checks(self) -> int:
        return len(self.outcomes)

    @property
    def failures(self) -> int:
        return self.outcomes.count(False)

    @property
    def passed(self) -> bool:
        return not self.failures

    @property
    def summary(self) -> str:
        """The failed checks in one line."""
        wrong = [f"{q} of {m}" for q, row in self.identical.items() for m, same in row.items() if not same]
        wrong += [f"passes of {method}" for method, kept in self.programs.items() if not kept]
        wrong += [f"{m.function} of {m.method}/{m.backend}" for m in self.measured if not m.passed]
        return ", ".join(wrong[:6]) + (", ..." if len(wrong) > 6 else "")


def verify(
    scene: Scene,
    backends: Sequence[str] | None = None,
    states: int = 10,
    progress: Callable[[str], None] | None = None,
) -> Verification:
    """Checks every method and back end of a scene.

    Args:
        scene: the scene.
        backends: "c", "numpy" or both (default).
        states: random states per function for the measured errors.
        progress: told what is being done.

    Raises:
        UnsupportedError: the scene is too long to be written out by every method.
    """
    if len(scene.links) > MOST_LINKS:
        raise UnsupportedError(
            f"scene {scene.name!r} has {len(scene.links)} links; verify writes all methods out and compiles them, "
            f"allowed: up to {MOST_LINKS}"
        )
    tell = progress or (lambda text: None)
    result = Verification(scene.name)
    found: dict[str, dict[str, list[list[int]]]] = {}
    for method in frontends.METHODS:
        tell(f"identity of {method}")
        equations = frontends.derive(Mechanism(scene), method)
        solver = "articulated" if method == "articulated" else "dense"
        found[method] = _fingerprints(equations)
        built = pipeline.programs(equations, loops=False, solver=solver)
        if method == "articulated":
            built += pipeline.programs(equations, loops=True)
        result.programs[method] = all(_kept(program, found[method][program.name]) for program in built)
        for backend in dict.fromkeys(backends or ("c", "numpy")):
            tell(f"errors of {method}, {backend}")
            module = pipeline.compile(equations, backend=backend, loops=False, solver=solver)
            result.measured += _errors(equations, module, method, backend, states)
    for quantity in found["matrix"]:
        values = [found[method][quantity] for method in found]
        common = max(values, key=values.count)
        result.identical[quantity] = {method: found[method][quantity] == common for method in found}
    return result


def _fingerprints(equations: Equations) -> dict[str, list[list[int]]]:
    """Every function's exact values at the random points."""
    found = {}
    for name in functions.select(equations, None):
        outputs = list(functions.FUNCTIONS[name].build(equations))
        found[name] = [fingerprint(outputs, seed) for seed in range(POINTS)]
    return found


def _kept(program: Program, expected: list[list[int]]) -> bool:
    """Whether a program after the passes is still the function its expressions are."""
    for seed in range(POINTS):
        prime = PrimeField(seed)
        inputs = {array.name: [prime.random(name) for name in array.symbols] for array in program.inputs}
        if run(program, inputs, prime) != expected[seed]:
            return False
    return True


def _errors(equations: Equations, module: Any, method: str, backend: str, states: int) -> list[Measured]:
    """The errors of a module's functions, each over its own random states."""
    scene: Scene = equations.mechanism.scene  # type: ignore[attr-defined]
    digits, found = Digits(60), []
    n = len(equations.q)
    parameters = np.array([parameter.value for parameter in scene.parameters])
    for name in functions.select(equations, None):
        function = functions.FUNCTIONS[name]
        letters = [array.name for array in functions.inputs(equations.symbols, function)]
        nodes = list(function.build(equations))
        slots = equations.symbols.slots
        worst, bound = 0.0, 8.0 * n
        for seed in range(states):
            state = {**hard.random_state(scene, hard.SEED + seed), "p": parameters}
            values = {letter: state[letter] for letter in letters}
            given = {
                node: digits.number(values[slot.array].flat[slot.index])
                for node, slot in slots.items()
                if slot.array in values
            }
            exact = evaluate(nodes, given, digits)
            computed = getattr(module, name)(*values.values())
            worst = max(worst, scaled_error(computed, exact))
            if name == "forward_dynamics":
                mass = module.mass_matrix(*(values[letter] for letter in ("q", "w", "p") if letter in values))
                bound = max(bound, 8.0 * n + 2.0 * float(np.linalg.cond(mass)))
        found.append(Measured(method, backend, name, worst / EPS, bound))
    return found


def scaled_error(computed: Any, exact: Sequence[Any]) -> float:
    """The largest difference over the largest entry of the exact result; infinite if not a number."""
    flat = np.asarray(computed).reshape(-1)
    if not np.all(np.isfinite(flat)):
        return float("inf")
    scale = max(abs(value) for value in exact)
    difference = max(abs(value - float(got)) for value, got in zip(exact, flat, strict=True))
    return float(difference / scale) if scale else float(difference)
