"""The errors a user can cause, and the one-line texts they carry.

Every message is one line that says what is wrong (with the value and its place), what is allowed and what to
do. Values come from users, so they are escaped and shortened before they are quoted.
"""

import difflib
from collections.abc import Iterable

_VALUE_LIMIT = 50
_LIST_LIMIT = 220
_CANDIDATES = 1000  # names compared for "did you mean"


class EomgenError(Exception):
    """What went wrong, in one line; `exit_code` is what the command line ends with."""

    exit_code = 2


class SceneError(EomgenError):
    """A scene, or the file it came from, is not valid."""


class OptionError(EomgenError):
    """An option has a value that does not exist: an unknown method, model, back end..."""


class SingularError(EomgenError):
    """The mass matrix of the scene is singular for every state."""


class UnsupportedError(EomgenError):
    """A valid scene and valid options that cannot be combined."""


class CheckError(EomgenError):
    """A check was made and failed."""

    exit_code = 1


class BuildError(EomgenError):
    """The compiler is missing or refused the emitted source."""

    exit_code = 3


def one_line(text: str, limit: int = _VALUE_LIMIT) -> str:
    """`text` with control characters escaped, and its middle left out where it is longer than `limit`."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)
    tail = limit // 3
    return f"{text[: limit - tail]}...{text[-tail:]}" if len(text) > limit else text


def shown(value: object, limit: int = _VALUE_LIMIT) -> str:
    """`repr(value)`, escaped and cut to about `limit` characters."""
    if isinstance(value, str):
        text = one_line(repr(value[:limit]), limit + 2)
        return text if len(value) <= limit else f"{text}... ({len(value)} characters)"
    try:
        return one_line(repr(value), limit)
    except Exception:  # repr() is the user's: an int of 5000 digits, for one, refuses to be printed
        return f"<{one_line(type(value).__name__)}>"


def unknown(what: str, value: object, allowed: Iterable[str]) -> str:
    """The text for a name that is none of `allowed`: `unknown method 'matrx'; allowed: lagrange, ...`."""
    names = list(allowed)
    text = f"unknown {what} {shown(value)}; allowed: {listed(names)}"
    if not isinstance(value, str):
        return text
    near = difflib.get_close_matches(value[:100], names[:_CANDIDATES], n=1)
    return f"{text} (did you mean {shown(near[0])}?)" if near else text


def listed(names: Iterable[str]) -> str:
    """The names with commas between, cut at a name where the list gets long."""
    kept: list[str] = []
    size = 0
    for name in names:
        size += len(name) + 2
        if size > _LIST_LIMIT:
            return ", ".join([*kept, "..."])
        kept.append(name)
    return ", ".join(kept)
