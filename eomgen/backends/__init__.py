"""The back ends: a package each, by the name a user types. They take programs and know no mechanics."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from eomgen.backends import c
from eomgen.backends import numpy as numpy_
from eomgen.errors import OptionError, unknown
from eomgen.ir.program import Program
from eomgen.model import Model


class Backend(Protocol):
    """What a back end offers."""

    def emit(self, model: Model) -> dict[str, str]: ...
    def environment(self, portable: bool) -> Sequence[str]: ...
    def facts(self, portable: bool, programs: Sequence[Program]) -> dict[str, Any]: ...
    def build(self, folder: Path, model: Model, portable: bool) -> None: ...


BACKENDS: dict[str, Backend] = {"c": c, "numpy": numpy_}


def select(name: str) -> Backend:
    """The back end of this name.

    Raises:
        OptionError: there is no such back end.
    """
    if name not in BACKENDS:
        raise OptionError(unknown("back end", name, BACKENDS))
    return BACKENDS[name]
