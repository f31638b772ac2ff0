"""eomgen: a compiler for equations of motion of planar trees of rigid and variable-length links."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from eomgen.version import __version__

if TYPE_CHECKING:
    from eomgen.catalog import chain, walker
    from eomgen.errors import EomgenError
    from eomgen.frontends.recursive import extend
    from eomgen.pipeline import compile, derive
    from eomgen.scene import ElasticRod, JointMasses, PointMasses, Rigid, Scene, Telescopic
    from eomgen.scene_file import load_scene
    from eomgen.symbolic import lagrangian

_HOME = {
    "chain": "catalog",
    "walker": "catalog",
    "EomgenError": "errors",
    "extend": "frontends.recursive",
    "compile": "pipeline",
    "derive": "pipeline",
    "ElasticRod": "scene",
    "JointMasses": "scene",
    "PointMasses": "scene",
    "Rigid": "scene",
    "Scene": "scene",
    "Telescopic": "scene",
    "load_scene": "scene_file",
    "lagrangian": "symbolic",
}

__all__ = [
    "ElasticRod",
    "EomgenError",
    "JointMasses",
    "PointMasses",
    "Rigid",
    "Scene",
    "Telescopic",
    "__version__",
    "chain",
    "compile",
    "derive",
    "extend",
    "lagrangian",
    "load_scene",
    "walker",
]


def __getattr__(name: str) -> Any:
    """Public names, imported when first used so that the command line starts at once."""
    if name not in _HOME:
        raise AttributeError(f"module 'eomgen' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"eomgen.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
