"""The build cache: digest -> package folder. Built apart, published by rename.

Two processes that build one model both finish, and the loser of the race uses the winner's folder. A build that
is killed leaves a private folder behind that nobody reads.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from eomgen.errors import BuildError, one_line


def folder() -> Path:
    """The cache's folder: $EOMGEN_CACHE, or eomgen in the user's cache folder.

    Raises:
        BuildError: it is in the home folder of a user who has none.
    """
    chosen, base = os.environ.get("EOMGEN_CACHE"), os.environ.get("XDG_CACHE_HOME")
    try:
        if chosen:
            return Path(chosen).expanduser().absolute()
        return (Path(base) if base else Path.home() / ".cache").absolute() / "eomgen"
    except RuntimeError:
        raise BuildError(
            f"the cache {one_line(chosen or '~/.cache', 200)} has no home folder; "
            "set EOMGEN_CACHE to a folder that can be written"
        ) from None


def digest(parts: Iterable[str]) -> str:
    """A name for everything that a result depends on."""
    state = hashlib.blake2b(digest_size=10)
    for part in parts:
        text = part.encode()
        state.update(len(text).to_bytes(8, "big"))
        state.update(text)
    return state.hexdigest()


def publish(target: Path, build: Callable[[Path], None]) -> Path:
    """The folder `target`, built by `build` in a private folder beside it if it does not exist.

    Raises:
        BuildError: the cache cannot be written; or what `build` raises, which keeps the private folder.
    """
    if target.is_dir():
        return target
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        private = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
        build(private)
    except OSError as error:
        raise BuildError(
            f"cannot write to the cache {one_line(str(target.parent), 200)} ({error.strerror}); "
            "set EOMGEN_CACHE to a folder that can be written"
        ) from None
    try:
        private.chmod(0o755)
        private.rename(target)
    except OSError:
        if not target.is_dir():
            raise
        shutil.rmtree(private, ignore_errors=True)
    return target


def write(folder: Path, files: Mapping[str, str]) -> None:
    """Writes text files, making the folders they stand in."""
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")
