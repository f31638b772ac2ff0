"""The build cache: what a key covers, races, killed builds, and what a build leaves alone."""

import errno
import importlib
import os
import shutil
import signal
import subprocess
import sys
import textwrap
import threading
import time
import types
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import eomgen
from eomgen import delivery, pipeline
from eomgen.backends import c, cache
from eomgen.catalog import chain
from eomgen.errors import BuildError
from eomgen.scene import Scene

build = importlib.import_module("eomgen.backends.c.build")  # the package has a function of this name
ROOT = Path(__file__).resolve().parent.parent
SMALL: dict[str, Any] = {"functions": ["energy"]}


@pytest.fixture
def fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache, but for the wrapper's objects, which are the same for every model."""
    wrapper = cache.folder() / "wrapper"
    build._wrapper(build.selected())
    place = tmp_path / "cache"
    place.mkdir()
    (place / "wrapper").symlink_to(wrapper)
    monkeypatch.setenv("EOMGEN_CACHE", str(place))
    for name in loaded():
        monkeypatch.delitem(sys.modules, name)  # from another cache; back again after the test
    yield place
    for name in loaded():
        del sys.modules[name]


def loaded() -> list[str]:
    return [name for name in sys.modules if name.startswith("eomgen.models.")]


def published(place: Path) -> list[str]:
    """The models that a cache offers; folders of builds in progress or failed start with a dot."""
    return sorted(path.name for path in (place / "models").iterdir() if not path.name.startswith("."))


# Keys


@pytest.fixture
def key(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """The name under which a scene would be built with some options; nothing is compiled."""
    names: list[str] = []

    def imported(name: str) -> types.ModuleType:
        names.append(name)
        module = types.ModuleType(name)
        module.info = {}  # type: ignore[attr-defined]
        return module

    monkeypatch.setattr(c, "build", lambda folder, model, portable: None)
    monkeypatch.setattr(delivery, "import_cached", imported)

    def get(scene: Scene | None = None, **options: Any) -> str:
        pipeline.compile(scene or chain(1), **{**SMALL, **options})
        return names[-1]

    return get


def compiler(folder: Path, name: str, version: str, script: str = 'exec cc "$@"') -> str:
    """A compiler of our own, which says that it is of some version."""
    path = folder / name
    path.write_text(f'#!/bin/sh\nif [ "$1" = --version ]; then echo "{version}"; exit 0; fi\n{script}\n')
    path.chmod(0o755)
    return str(path)


def test_same_again(key: Callable[..., str]) -> None:
    assert key() == key()
    assert key() == key(method="matrix", backend="c", fold=False, dtypes=["float64", "float64"])


OPTIONS: dict[str, tuple[Scene | None, dict[str, Any]]] = {
    "links": (chain(2), {}),
    "number": (chain(1, gravity=9.80665), {}),
    "scene's name": (Scene("other", chain(1).links), {}),
    "method": (None, {"method": "lagrange"}),
    "back end": (None, {"backend": "numpy"}),
    "fold": (None, {"fold": True}),
    "functions": (None, {"functions": ["energy", "joints"]}),
    "dtypes": (None, {"dtypes": ["float32", "float64"]}),
    "flags": (None, {"portable": True}),
}


@pytest.mark.parametrize("name", OPTIONS)
def test_options_change_the_key(key: Callable[..., str], name: str) -> None:
    scene, options = OPTIONS[name]
    assert key(scene, **options) != key()


def test_compiler_changes_the_key(key: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = [key()]
    for folder, version in (("one", "cc 1.0"), ("two", "cc 1.0"), ("one", "cc 2.0")):
        (tmp_path / folder).mkdir(exist_ok=True)
        monkeypatch.setenv("CC", compiler(tmp_path / folder, "mycc", version))
        build.toolchain.cache_clear()
        found.append(key())
    assert len(set(found)) == 4


@pytest.mark.parametrize("package", ["cython", "numpy"])
def test_versions_change_the_key(key: Callable[..., str], monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    before, versions = key(), build._version
    monkeypatch.setattr(build, "_version", lambda name: "99" if name == package else versions(name))
    assert key() != before


def test_eomgen_changes_the_key(key: Callable[..., str], monkeypatch: pytest.MonkeyPatch) -> None:
    before = key()
    monkeypatch.setattr(pipeline, "__version__", "99")
    assert key() != before


def test_runtime_changes_the_key(key: Callable[..., str], monkeypatch: pytest.MonkeyPatch) -> None:
    before, files = key(), build.runtime_files()
    files["eomgen_real.h"] += "/* changed */\n"
    monkeypatch.setattr(build, "runtime_files", lambda: files)
    assert key() != before


def test_digest_tells_parts_apart() -> None:
    assert cache.digest(["ab", "c"]) != cache.digest(["a", "bc"]) != cache.digest(["abc"])
    assert cache.digest(["ab", "c"]) == cache.digest(iter(["ab", "c"]))


# Warm


def test_warm_compile_builds_nothing(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = eomgen.compile(chain(1), **SMALL)
    names = published(fresh)

    def refuse(*arguments: object, **options: object) -> None:
        raise AssertionError(f"built again: {arguments}")

    monkeypatch.setattr(build, "_run", refuse)
    monkeypatch.setattr(c, "build", refuse)
    again = eomgen.compile(chain(1), **SMALL)
    assert again is first
    assert published(fresh) == names == [Path(str(first.__file__)).parent.name]


def test_the_cache_is_where_the_variable_says(fresh: Path, tmp_path: Path) -> None:
    module = eomgen.compile(chain(1), backend="numpy", **SMALL)
    assert Path(str(module.__file__)).parent.parent == fresh / "models"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cache"]


def test_where_the_cache_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    for name, value, expected in (
        ("EOMGEN_CACHE", "", tmp_path / ".cache" / "eomgen"),
        ("XDG_CACHE_HOME", str(tmp_path / "xdg"), tmp_path / "xdg" / "eomgen"),
        ("EOMGEN_CACHE", "here", tmp_path / "here"),
        ("EOMGEN_CACHE", "~/there", tmp_path / "there"),
    ):
        monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
        monkeypatch.delenv("EOMGEN_CACHE", raising=False)
        monkeypatch.setenv(name, value)
        assert cache.folder() == expected


def test_the_wrapper_is_built_once(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the two parts of the kernel are compiled, and linked, for another model."""
    commands: list[list[str]] = []
    run = build._run
    monkeypatch.setattr(build, "_run", lambda folder, command: (commands.append(command), run(folder, command))[1])
    eomgen.compile(chain(1), **SMALL)
    assert len(commands) == 3
    assert not any("cython" in command for command in commands)


# What a build leaves alone


@pytest.mark.parametrize("out", [False, True])
@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_nothing_around_changes(
    fresh: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, backend: str, out: bool
) -> None:
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    target = tmp_path / f"left_alone_{backend}"
    before = (os.getcwd(), list(sys.path), dict(os.environ), list(sys.meta_path), os.umask(0o22))
    os.umask(before[-1])
    eomgen.compile(chain(1), backend=backend, out=target if out else None, **SMALL)
    after = (os.getcwd(), list(sys.path), dict(os.environ), list(sys.meta_path), os.umask(0o22))
    os.umask(after[-1])
    assert after == before
    assert list(work.iterdir()) == []
    assert target.exists() == out


def test_a_package_has_no_leftovers(fresh: Path) -> None:
    """Of a build only what is needed to use, read and rebuild the module stays."""
    folder = Path(str(eomgen.compile(chain(1), **SMALL).__file__)).parent
    names = {path.name for path in folder.iterdir()} - {"__pycache__"}
    assert {name.split(".")[0] for name in names} == {"__init__", "_kernel", "csrc"}
    assert {"chain1.c", "chain1.h", "chain1_kernels.h", "eomgen_real.h"} <= {
        p.name for p in (folder / "csrc").iterdir()
    }


# Races and killed builds

SCRIPT = """
import sys
from pathlib import Path
import eomgen
module = eomgen.compile(eomgen.chain(2), backend=sys.argv[1], functions=["energy"])
print(Path(module.__file__).parent, module.energy(module.p[:4], module.p[:4], module.p))
"""


def started(place: Path, backend: str, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT, backend],
        cwd=ROOT,
        env={**os.environ, "EOMGEN_CACHE": str(place), **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def test_two_processes_build_one_model(fresh: Path) -> None:
    """Both work, one model is published and nothing is left over."""
    processes = [started(fresh, "c") for _ in range(2)]
    outputs = [process.communicate(timeout=100) for process in processes]
    assert [process.returncode for process in processes] == [0, 0], outputs
    assert outputs[0] == outputs[1]
    assert len(published(fresh)) == 1
    assert len(list((fresh / "models").iterdir())) == 1


def test_the_loser_of_a_race_uses_the_winners_folder(tmp_path: Path) -> None:
    target, barrier = tmp_path / "models" / "key", threading.Barrier(4, timeout=20)
    results: list[Path] = []

    def make(folder: Path) -> None:
        (folder / "who").write_text(folder.name)
        barrier.wait()

    threads = [threading.Thread(target=lambda: results.append(cache.publish(target, make))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results == [target] * 4
    assert [path.name for path in target.parent.iterdir()] == ["key"]
    assert (target / "who").read_text().startswith(".key-")


def test_what_is_there_is_not_built() -> None:
    assert cache.publish(ROOT, lambda folder: pytest.fail("built")) == ROOT


def test_a_folder_that_cannot_be_renamed_is_an_error(tmp_path: Path) -> None:
    """Only where another process was faster is there nothing to say."""
    with pytest.raises(OSError, match="key"):
        cache.publish(tmp_path / "key", lambda folder: folder.rmdir())


def test_a_full_disk_is_one_line(tmp_path: Path) -> None:
    def make(folder: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(BuildError, match=r"cannot write to the cache .*No space left on device.*set EOMGEN_CACHE"):
        cache.publish(tmp_path / "key", make)


def test_a_compiler_that_writes_nothing_is_one_line(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "true")
    with pytest.raises(BuildError, match=r"'true' ended well but wrote no \w+\.o; set CC to a C compiler"):
        eomgen.compile(chain(1), functions=["energy"])


def test_a_module_that_was_damaged_is_one_line(fresh: Path) -> None:
    """By a full disk, say, after it was published."""
    scene = Scene.from_dict({"name": "damaged", "links": [{"name": "rod", "model": "rigid", "mass": 1, "length": 1}]})
    module = eomgen.compile(scene, backend="numpy", functions=["energy"])
    for loaded in [key for key in sys.modules if key.startswith(module.__name__)]:
        del sys.modules[loaded]
    (Path(str(module.__file__)).parent / "_kernel.py").write_text("def half(")
    with pytest.raises(BuildError, match=r"damaged_\w+ cannot be imported \(.*\); delete it to build it anew"):
        eomgen.compile(scene, backend="numpy", functions=["energy"])


def test_a_killed_build_does_no_harm(fresh: Path, tmp_path: Path) -> None:
    """The process dies while the compiler runs; what it leaves is not taken for a model of the same key."""
    real, mark = shutil.which("cc"), tmp_path / "mark"
    if real is None or os.environ.get("CC"):
        pytest.skip("needs the default compiler")
    (tmp_path / "bin").mkdir()
    slow = tmp_path / "bin" / "cc"
    slow.write_text(f'#!/bin/sh\n[ "$1" = --version ] && exec {real} "$@"\ntouch {mark}; sleep 60\n')
    slow.chmod(0o755)
    process = started(fresh, "c", PATH=f"{slow.parent}:{os.environ['PATH']}")
    try:
        for _ in range(2000):
            if mark.exists() or process.poll() is not None:
                break
            time.sleep(0.02)
        assert mark.exists()
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
    assert published(fresh) == []
    (left,) = (fresh / "models").iterdir()
    after = started(fresh, "c")
    _, errors = after.communicate(timeout=100)
    assert after.returncode == 0, errors
    assert left.name.startswith(f".{published(fresh)[0]}-")


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_leftovers_of_builds_are_not_read(fresh: Path, backend: str) -> None:
    """Private folders beside the target, half filled, as a killed build leaves them."""
    module = eomgen.compile(chain(1), backend=backend, **SMALL)
    folder = Path(str(module.__file__)).parent
    left = folder.parent / f".{folder.name}-abc123"
    left.mkdir()
    (left / "__init__.py").write_text("raise SystemExit('half written')")
    shutil.rmtree(folder)
    sys.modules.pop(module.__name__)
    again = eomgen.compile(chain(1), backend=backend, **SMALL)
    assert Path(str(again.__file__)).parent == folder
    assert folder.is_dir()


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError, BuildError("no")])
def test_an_interrupted_build_publishes_nothing(tmp_path: Path, error: Any) -> None:
    target = tmp_path / "key"

    def make(folder: Path) -> None:
        (folder / "half").write_text("half")
        raise error

    with pytest.raises(type(error) if isinstance(error, BaseException) else error):
        cache.publish(target, make)
    assert not target.exists()
    assert cache.publish(target, lambda folder: (folder / "whole").touch()) == target
    assert [path.name for path in target.iterdir()] == ["whole"]


# Errors


def one_clear_line(text: str) -> None:
    assert text.isprintable()
    assert "set EOMGEN_CACHE to a folder that can be written" in text
    assert len(text) < 400


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_a_cache_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, backend: str) -> None:
    """A file stands where the cache should be."""
    place = tmp_path / "file"
    place.write_text("not a folder")
    monkeypatch.setenv("EOMGEN_CACHE", str(place / "cache"))
    with pytest.raises(BuildError, match=r"cannot write to the cache .*file/cache/models") as caught:
        eomgen.compile(chain(1), backend=backend, **SMALL)
    one_clear_line(str(caught.value))
    assert caught.value.exit_code == 3


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_cache_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tmp_path.chmod(0o555)
    monkeypatch.setenv("EOMGEN_CACHE", str(tmp_path / "cache"))
    try:
        with pytest.raises(BuildError, match="Permission denied") as caught:
            eomgen.compile(chain(1), backend="numpy", **SMALL)
    finally:
        tmp_path.chmod(0o755)
    one_clear_line(str(caught.value))


def test_the_cache_of_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    """A home folder that does not exist is refused like any other bad place."""
    monkeypatch.setenv("EOMGEN_CACHE", "~no_such_user_here/cache")
    with pytest.raises(eomgen.EomgenError):
        eomgen.compile(chain(1), backend="numpy", **SMALL)


def test_a_failed_build_keeps_its_log(fresh: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With what each of the steps side by side said, one after the other."""
    complaint = 'echo "x.c:1: error: out of patience" >&2; sleep 0.1; echo "x.c:9: note: none left"; exit 1'
    script = compiler(tmp_path, "badcc", "cc 1.0", complaint)
    monkeypatch.setenv("CC", script)
    with pytest.raises(BuildError, match=r"failed with exit code 1: x\.c:1: error: out of patience; log: ") as caught:
        eomgen.compile(chain(1), **SMALL)
    log = Path(str(caught.value).rpartition("log: ")[2])
    lines = log.read_text().splitlines()
    assert [line.startswith("$ ") for line in lines] == [True, False, False] * len(build.PARTS)
    assert set(lines[1::3]) == {"x.c:1: error: out of patience"}
    assert set(lines[2::3]) == {"x.c:9: note: none left"}
    assert published(fresh) == []
    monkeypatch.delenv("CC")
    assert eomgen.compile(chain(1), **SMALL).energy is not None


def test_a_module_of_the_cache_is_found_again(fresh: Path) -> None:
    """In another process under the same name, as pickles need it."""
    module = eomgen.compile(chain(1), backend="numpy", **SMALL)
    code = textwrap.dedent(
        f"""
        import importlib
        print(importlib.import_module({module.__name__!r}).q_names)
        """
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == str(module.q_names)
