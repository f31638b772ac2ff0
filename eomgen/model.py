"""What a back end is given: the programs of a model and the facts that describe it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from eomgen.ir.program import Program


@dataclass(frozen=True)
class Model:
    """Everything a back end writes down.

    Attributes:
        name: an identifier; prefix of the C functions and default name of the package.
        title: one line for the head of the files.
        programs: the functions, after the passes.
        names: q_names, v_names, u_names, w_names, p_names.
        p: the parameters' values.
        facts: scene (as a dict), method, info (operation counts, versions): plain data, the same for the
            same scene and options.
        dtypes: the types to build, among float64, float32 and longdouble.
        accuracy: the arithmetic between arguments and results: fast, standard or high.
        available: names of the functions that the equations have, built or not.
    """

    name: str
    title: str
    programs: tuple[Program, ...]
    names: Mapping[str, tuple[str, ...]]
    p: tuple[float, ...]
    facts: Mapping[str, Any]
    dtypes: tuple[str, ...] = ("float64",)
    accuracy: str = "standard"
    available: tuple[str, ...] = ()
