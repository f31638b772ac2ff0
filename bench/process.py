"""A process with a time limit, and what it leaves behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from threading import Timer
from typing import Any, NamedTuple

from bench import report
from eomgen.errors import UnsupportedError, one_line

MEGABYTE = 1e6


class Finished(NamedTuple):
    """A process that has ended.

    Attributes:
        code: its exit code; None if it was stopped at the limit.
        lines: its standard output.
        problem: why there is no answer, if it gave none: the limit, or the last line of its standard error.
        seconds: its wall time.
        peak: the most memory that it, or a process it started, had resident, in MB. Linux counts the memory of the
            process that started it, too: there is no smaller peak than that.
    """

    code: int | None
    lines: list[str]
    problem: str
    seconds: float
    peak: float

    def answers(self) -> list[dict[str, Any]]:
        """The lines of JSON it printed; none if it was stopped."""
        return [json.loads(line) for line in self.lines if line.startswith("{") and self.code is not None]


def run(command: Sequence[str], limit: float, environment: Mapping[str, str] | None = None) -> Finished:
    """Runs a command at the root of the checkout; at the limit it ends with all it has started."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        start = time.perf_counter()
        process = subprocess.Popen(
            command, cwd=report.ROOT, env=environment, stdout=out, stderr=err, start_new_session=True
        )
        late: list[bool] = []

        def stop() -> None:
            late.append(True)
            os.killpg(process.pid, signal.SIGKILL)

        timer = Timer(limit, stop)
        timer.start()
        try:
            _, status, usage = os.wait4(process.pid, 0)
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            raise
        finally:
            timer.cancel()
        seconds = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for stream in (out, err):
            stream.seek(0)
            texts.append(stream.read().strip().splitlines())
    lines, errors = texts
    if late:
        return Finished(None, lines, f"> {limit:g} s", seconds, resident(usage))
    problem = one_line(f"error: {errors[-1] if errors else f'exit code {process.returncode}'}", 160)
    return Finished(process.returncode, lines, problem, seconds, resident(usage))


def resident(usage: Any) -> float:
    """The most memory that a process has had resident, in MB, by its `resource.struct_rusage`."""
    return float(usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024) / MEGABYTE)


def require_posix(suite: str) -> None:
    """Checks that processes can be stopped at a limit.

    Raises:
        UnsupportedError: they cannot.
    """
    if not hasattr(os, "fork"):
        raise UnsupportedError(f"bench {suite} needs a POSIX system for its time limits")
