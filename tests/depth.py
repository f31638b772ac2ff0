"""A stack too short for code that recurses on the depth of expressions."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def shallow_stack(frames: int) -> Iterator[None]:
    """Only so many calls deeper than the caller."""
    depth, frame = 0, sys._getframe()
    while frame is not None:
        depth, frame = depth + 1, frame.f_back
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(depth + frames)
    try:
        yield
    finally:
        sys.setrecursionlimit(limit)
