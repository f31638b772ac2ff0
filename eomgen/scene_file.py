"""Scene files: TOML text to a `Scene`."""

import os
import tomllib
from pathlib import Path
from typing import Any

from eomgen.errors import SceneError, one_line, shown
from eomgen.scene import Scene


def load_scene(path: str | os.PathLike[str]) -> Scene:
    """The scene a TOML file describes.

    Args:
        path: The file, UTF-8.

    Raises:
        SceneError: The file cannot be read, is not TOML or describes no valid scene; the message starts
            with the file's name.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise SceneError(f"{shown(path)} is no path; give the path of a scene file (TOML)")
    where = one_line(os.fspath(path), 80)
    return Scene.from_dict(_parse(_read(Path(path), where), where), where)


def _read(path: Path, where: str) -> str:
    try:
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise SceneError(f"{where}: no such file; give the path of a scene file (TOML)") from None
    except IsADirectoryError:
        raise SceneError(f"{where}: is a directory; give the path of a scene file (TOML)") from None
    except UnicodeDecodeError as error:
        raise SceneError(f"{where}: byte {error.start} is not UTF-8; save the file as UTF-8") from None
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"{where}: cannot be read ({one_line(str(reason))}); check the path") from None


def _parse(text: str, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"{where}: nested too deeply; a scene needs lists of numbers only") from None
    except ValueError as error:  # TOMLDecodeError, or an integer with more digits than Python reads
        raise SceneError(f"{where}: not TOML: {one_line(str(error), 200)}; correct the file there") from None
