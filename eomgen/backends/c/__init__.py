"""C back end: plain C compiled through a thin Cython wrapper into generalised ufuncs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from eomgen.backends.c import build as _build
from eomgen.backends.c import emit as _emit
from eomgen.ir.program import Program
from eomgen.model import Model


def emit(model: Model) -> dict[str, str]:
    """The files of the package that depend on the model."""
    return _emit.emit(model)


def environment(portable: bool) -> Sequence[str]:
    """What the compiled module depends on beside its sources."""
    tools = _build.selected(portable)
    return [*_build.environment(tools), *_build.runtime_files().values()]


def facts(portable: bool, programs: Sequence[Program]) -> dict[str, Any]:
    """How the module is built, for `mod.info`."""
    tools = _build.selected(portable)
    return {
        "compiler": tools.version,
        "flags": " ".join([_build.optimisation(programs), *tools.flags]),
        "cython": _build._version("cython"),
        "numpy": _build._version("numpy"),
    }


def build(folder: Path, model: Model, portable: bool) -> None:
    """Compiles the emitted files in `folder`.

    Raises:
        BuildError: no compiler, or a step failed.
    """
    for name, text in _build.runtime_files().items():
        (folder / "csrc" / name).write_text(text, encoding="utf-8")
    _build.build(folder, model.name, _build.optimisation(model.programs), _build.selected(portable))
