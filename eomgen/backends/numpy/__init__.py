"""NumPy back end: vectorised Python source; no compiler needed."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from eomgen.backends.numpy import emit as _emit
from eomgen.ir.program import Program
from eomgen.model import Model


def emit(model: Model) -> dict[str, str]:
    """All files of the package."""
    return _emit.emit(model)


def environment(portable: bool) -> Sequence[str]:
    """What the module depends on beside its sources: nothing."""
    return []


def facts(portable: bool, programs: Sequence[Program]) -> dict[str, Any]:
    """How the module is built, for `mod.info`."""
    return {"numpy": version("numpy")}


def build(folder: Path, model: Model, portable: bool) -> None:
    """Nothing to do: the source is the module."""
