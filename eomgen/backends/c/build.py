"""Compiles the emitted C and the wrapper into an extension module.

The wrapper's text is the same for every model, so its object files are made once per machine and set of versions
and linked to each new kernel. Nothing here changes the working directory or `sys.path`.
"""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from eomgen.backends import cache
from eomgen.errors import BuildError, one_line, shown
from eomgen.ir.program import Program, Rounds, Turns

RUNTIME = Path(__file__).parent / "runtime"
COMMON = ("-std=gnu11", "-fPIC", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden")
MANY_TURNS = 100  # loops that take turns
LOG = "build.log"
PARTS = ("-DEOM_PART=1", "-DEOM_PART=2")  # <name>.c: scalars with all else, vectors; eomgen_batch.c: double, the rest
BATCH = ("batch1.o", "batch2.o")
BATCH_LEVEL = ("-O1", "-fcaller-saves")  # as fast as -O2, in two thirds of its time


@dataclass(frozen=True)
class Toolchain:
    """A C compiler and how it is called.

    Attributes:
        command: the compiler's command line so far.
        version: the first line of its `--version`.
        target: flags that choose the processor.
        processor: what `native` stands for here, "" in a portable build.
    """

    command: tuple[str, ...]
    version: str
    target: tuple[str, ...]
    processor: str

    @property
    def flags(self) -> tuple[str, ...]:
        return (*COMMON, *self.target)


@functools.cache
def toolchain(command: str, portable: bool) -> Toolchain:
    """The compiler of this command line.

    Raises:
        BuildError: it does not exist or does not run.
    """
    try:
        words = tuple(shlex.split(command))
    except ValueError:
        words = ()
    advice = "install gcc or clang, set CC to one, or use the NumPy back end (--backend numpy)"
    if not words or shutil.which(words[0]) is None:
        raise BuildError(f"no C compiler: {shown(command, 200)} is not on the path; {advice}")
    try:
        done = subprocess.run([*words, "--version"], capture_output=True, text=True, timeout=60, check=True)
    except (OSError, subprocess.SubprocessError) as error:
        raise BuildError(
            f"the C compiler {shown(command, 200)} does not run ({one_line(str(error), 200)}); {advice}"
        ) from None
    native = "-mcpu=native" if platform.machine() in ("aarch64", "arm64") else "-march=native"
    lines = done.stdout.splitlines()
    return Toolchain(
        command=words,
        version=lines[0] if lines else "",
        target=() if portable else (native,),
        processor="" if portable else _processor(),
    )


def selected(portable: bool = False) -> Toolchain:
    """The compiler that $CC names, otherwise `cc`."""
    return toolchain(os.environ.get("CC") or "cc", portable)


def _processor() -> str:
    """The features of this machine's processor, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    kept = {line for line in lines if line.startswith(("model name", "flags", "Features", "CPU part"))}
    return hashlib.blake2b("\n".join(sorted(kept)).encode(), digest_size=8).hexdigest()


def runtime_files() -> dict[str, str]:
    """The files that are the same for every model."""
    return {path.name: path.read_text(encoding="utf-8") for path in sorted(RUNTIME.iterdir()) if path.is_file()}


def environment(tools: Toolchain) -> list[str]:
    """Everything beside the sources that the compiled module depends on."""
    return [
        *tools.command,
        tools.version,
        *tools.flags,
        tools.processor,
        sys.version,
        str(sysconfig.get_config_var("EXT_SUFFIX")),
        _version("cython"),
        _version("numpy"),
    ]


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "absent"


def optimisation(programs: Sequence[Program]) -> str:
    """How much to optimise. Many short loops that take turns gain nothing by -O2 and take a third longer to compile."""
    steps = (step for program in programs for step in program.blocks)
    single = (part for step in steps for part in (step.steps if isinstance(step, Rounds) else (step,)))
    return "-O1" if sum(len(step.parts) for step in single if isinstance(step, Turns)) > MANY_TURNS else "-O2"


def build(folder: Path, name: str, level: str, tools: Toolchain) -> None:
    """Compiles csrc/<name>.c in `folder`, in two parts side by side, and links them with the wrapper into _kernel.

    Raises:
        BuildError: a step failed; the message names the log, which is kept.
    """

    kernels = ("kernel1.o", "kernel2.o")
    with ThreadPoolExecutor(3) as pool:
        wrapper = pool.submit(_wrapper, tools)
        for part in _parts(pool, folder, tools, f"csrc/{name}.c", kernels, (level,)):
            part.result()
        objects = wrapper.result()
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    shared = ["-bundle", "-undefined", "dynamic_lookup"] if sys.platform == "darwin" else ["-shared"]
    linked = [*kernels, *(str(objects / made) for made in ("_kernel.o", *BATCH))]
    _run(folder, [*tools.command, *shared, *linked, "-lm", "-o", f"_kernel{suffix}"])
    for made in kernels:
        (folder / made).unlink()
    (folder / LOG).unlink()


def _wrapper(tools: Toolchain) -> Path:
    """The folder with the wrapper's object files, made if need be."""
    import numpy

    files = runtime_files()
    key = cache.digest([*environment(tools), *files, *files.values()])
    include = [f"-I{sysconfig.get_path('include')}", f"-I{numpy.get_include()}"]

    def make(folder: Path) -> None:
        cache.write(folder, files)
        with ThreadPoolExecutor(2) as pool:
            compiling = _parts(pool, folder, tools, "eomgen_batch.c", BATCH, BATCH_LEVEL)
            _run(folder, [sys.executable, "-m", "cython", "-3", "_kernel.pyx", "-o", "_kernel.c"])
            _compile(folder, tools, "_kernel.c", "_kernel.o", "-O1", *include)
            for part in compiling:
                part.result()

    return cache.publish(cache.folder() / "wrapper" / key, make)


def _parts(
    pool: Executor, folder: Path, tools: Toolchain, source: str, made: Sequence[str], level: Sequence[str]
) -> list[Future[None]]:
    """Compiles the parts of a C file side by side."""
    each = zip(made, PARTS, strict=True)
    return [pool.submit(_compile, folder, tools, source, name, part, *level) for name, part in each]


def _compile(folder: Path, tools: Toolchain, source: str, made: str, *options: str) -> None:
    """Compiles a C file of a folder to an object file there.

    Raises:
        BuildError: it failed.
    """
    _run(folder, [*tools.command, *tools.flags, *options, "-c", source, "-o", made])
    if not (folder / made).is_file():
        raise BuildError(f"the C compiler {tools.command[0]!r} ended well but wrote no {made}; set CC to a C compiler")


def _run(folder: Path, command: list[str]) -> None:
    """Runs one step in a folder, then appends what it printed to the log, which steps side by side share.

    Raises:
        BuildError: it failed.
    """
    log = folder / LOG
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            check=False,
        )
    except OSError as error:
        raise BuildError(f"cannot run {command[0]!r} ({error.strerror})") from None
    with log.open("a", encoding="utf-8", errors="backslashreplace") as stream:
        stream.write(f"$ {shlex.join(command)}\n{done.stdout}")
    if done.returncode:
        step = "Cython" if "cython" in command else f"the C compiler {command[0]!r}"
        said = next((line for line in done.stdout.splitlines() if "error" in line.lower()), "")
        raise BuildError(
            f"{step} failed with exit code {done.returncode}{': ' + one_line(said.strip(), 300) if said else ''}; "
            f"log: {log}"
        )
