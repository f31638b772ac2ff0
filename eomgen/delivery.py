"""Where a compiled package goes, and how it is imported from there."""

from __future__ import annotations

import importlib
import importlib.util
import keyword
import os
import shutil
import sys
import tempfile
from pathlib import Path
from types import ModuleType

from eomgen.backends import cache
from eomgen.errors import BuildError, OptionError, UnsupportedError, one_line

LONGEST_NAME = 100
_LOADED: dict[Path, int] = {}  # packages outside the cache, and how often they were loaded again


def check_out(out: str | os.PathLike[str] | None, force: bool) -> Path | None:
    """The absolute output folder, checked before any work is done."""
    if out is None:
        return None
    try:
        path = Path(out).expanduser().absolute()
    except RuntimeError:
        raise OptionError(f"output folder {one_line(str(out), 200)}: there is no such user") from None
    shown = one_line(str(path), 200)
    if len(path.name) > LONGEST_NAME:
        raise OptionError(f"output folder {shown}: a name has at most {LONGEST_NAME} characters")
    if not path.name.isidentifier() or keyword.iskeyword(path.name) or not path.name.isascii():
        raise OptionError(
            f"output folder {shown}: {one_line(path.name)!r} is no module name; use letters, digits and underscores"
        )
    _check_free(path)
    if path.exists():
        if not force:
            raise OptionError(f"output folder {shown} exists; use --force (force=True) to replace it")
        if not _is_package_of_ours(path):
            raise OptionError(f"output folder {shown} is no package written by eomgen; it is not replaced")
    elif not path.parent.is_dir():
        raise OptionError(f"output folder {shown}: the folder {one_line(str(path.parent), 200)} does not exist")
    if not os.access(path.parent, os.W_OK):
        raise OptionError(f"output folder {shown}: {one_line(str(path.parent), 200)} cannot be written")
    return path


def _check_free(place: Path) -> None:
    """Refuses a folder whose module would take the name of another library's; one of ours makes way."""
    name = place.name
    advice = "write to a folder of another name"
    if name in sys.stdlib_module_names:
        raise UnsupportedError(f"a module named {name!r} is part of Python; {advice}")
    if name in {loaded.name for loaded in _LOADED}:
        return
    if name in sys.modules:
        raise UnsupportedError(f"a module named {name!r} is already imported; {advice}")
    spec = importlib.util.find_spec(name)
    if spec is None or not spec.has_location or spec.origin is None:  # None: a folder that is no package
        return
    found, here = Path(spec.origin).resolve(), place.parent.resolve()
    if found.parent not in (here, here / name) and not _is_package_of_ours(found.parent):
        raise UnsupportedError(f"a module named {name!r} exists already ({one_line(str(found), 200)}); {advice}")


def _is_package_of_ours(path: Path) -> bool:
    init = path / "__init__.py"
    return path.is_dir() and init.is_file() and "(eomgen " in init.read_text(encoding="utf-8", errors="replace")[:2000]


def deliver(source: Path, place: Path, force: bool) -> None:
    """Copies a finished package to its place in one step; nobody sees half of it."""
    try:
        private = Path(tempfile.mkdtemp(prefix=f".{place.name}-", dir=place.parent))
    except OSError as error:
        raise OptionError(f"output folder {one_line(str(place), 200)} cannot be written ({error.strerror})") from None
    try:
        shutil.copytree(source, private / "new", ignore=shutil.ignore_patterns("__pycache__"))
        replaced = force and place.exists()
        if replaced:
            place.rename(private / "old")
        try:
            (private / "new").rename(place)
        except OSError:
            if replaced:
                (private / "old").rename(place)
            raise
    except OSError as error:
        raise OptionError(f"output folder {one_line(str(place), 200)} cannot be written ({error.strerror})") from None
    finally:
        shutil.rmtree(private, ignore_errors=True)


def import_cached(name: str) -> ModuleType:
    from eomgen import models

    folder = cache.folder() / "models"
    models.__path__ = [str(folder)]
    importlib.invalidate_caches()
    try:
        return importlib.import_module(f"eomgen.models.{name}")
    except (ImportError, SyntaxError) as error:
        where = one_line(str(folder / name), 200)
        raise BuildError(
            f"{where} cannot be imported ({one_line(str(error), 200)}); delete it to build it anew"
        ) from None


def import_from(place: Path) -> ModuleType:
    """Imports the package at a path under its folder's name, leaving `sys.path` as it is."""
    name = place.name
    # The dynamic loader knows a library by its path; another spelling makes it read a replaced one.
    again = _LOADED[place] = _LOADED.get(place, -1) + 1
    folder = str(place) + "/." * again
    for loaded in [key for key in sys.modules if key == name or key.startswith(f"{name}.")]:
        del sys.modules[loaded]
    importlib.invalidate_caches()
    spec = importlib.util.spec_from_file_location(name, place / "__init__.py", submodule_search_locations=[folder])
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
