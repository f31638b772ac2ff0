"""Passes: each maps a program to an equal one. They run in the order of `DEFAULT`."""

from collections.abc import Callable

from eomgen.ir.program import Program
from eomgen.ir.verify import verify
from eomgen.passes import carry, chunk, hoist

DEFAULT: tuple[tuple[str, Callable[[Program], Program]], ...] = (
    ("hoist", hoist.run),
    ("carry", carry.run),
    ("chunk", chunk.run),
)


def run(program: Program) -> Program:
    """The program after all passes, verified before them and after each that changes it."""
    verify(program)
    for name, apply in DEFAULT:
        before, program = program, apply(program)
        if program != before:
            verify(program, after=name)
    return program
