"""The arithmetic between arguments and results: what each accuracy means to the emitted C."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from eomgen.backends.c import template
from eomgen.backends.c.printer import CPrinter, FastPrinter, HighPrinter, Kind

STREAMS = {"1": 1, "EOM_WIDE": 2, "EOM_WIDER": 4}  # of lanes; a scalar is one


@dataclass(frozen=True)
class Arithmetic:
    """How a text computes.

    Attributes:
        printer: makes the rules for single operations from the kinds of the arrays.
        about: head of the text.
        header: its words.
        value: C type of a value between arguments and results.
        still: C type of what depends on the parameters only.
        size: scalars that one of them takes.
        streams: vectors in a pack, and in the packs of short forward dynamics: names of `STREAMS`.
        runtime: the header it needs.
    """

    printer: Callable[[dict[str, Kind], bool], CPrinter | HighPrinter]
    about: str
    header: str
    value: str
    still: str
    size: int
    streams: tuple[str, str]
    runtime: str


ARITHMETIC = {
    "fast": Arithmetic(
        lambda kinds, inline: FastPrinter(kinds),
        template.FAST_ABOUT,
        "eomgen_kernels_fast.h",
        "floats",
        "float",
        1,
        ("EOM_WIDE", "EOM_WIDER"),
        "eomgen_single.h",
    ),
    "standard": Arithmetic(
        CPrinter,
        template.STANDARD_ABOUT,
        "eomgen_kernels_standard.h",
        "pack",
        "scalar",
        1,
        ("1", "EOM_WIDE"),
        "eomgen_real.h",
    ),
    "high": Arithmetic(
        lambda kinds, inline: HighPrinter(kinds),
        template.HIGH_ABOUT,
        "eomgen_kernels_high.h",
        "twofold",
        "eom_twofold_f64",
        2,
        ("1", "1"),
        "eomgen_twofold.h",
    ),
}
