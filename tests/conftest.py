"""Fixtures of all tests: a cache of their own, states from a seed, modules built once."""

import os
from collections.abc import Callable, Iterator
from types import ModuleType

import pytest

import eomgen
from bench import cases

RandomState = Callable[..., cases.State]
Compiled = Callable[..., ModuleType]


@pytest.fixture(scope="session", autouse=True)
def _cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What the tests build stays out of the user's cache, unless EOMGEN_CACHE names a folder to keep it in."""
    with pytest.MonkeyPatch.context() as patch:
        if "EOMGEN_CACHE" not in os.environ:
            patch.setenv("EOMGEN_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def random_state() -> RandomState:
    """`bench.cases.random_state`: random states of a scene or module from a seed, lengths away from 0."""
    return cases.random_state


@pytest.fixture(scope="session")
def compiled() -> Compiled:
    """`eomgen.compile` of a case by name; a module that was asked for before is not built again."""
    built: dict[object, ModuleType] = {}

    def get(case: str, method: str = "matrix", backend: str = "numpy", **options: object) -> ModuleType:
        key = (case, method, backend, *sorted(options.items()))
        if key not in built:
            built[key] = eomgen.compile(cases.CASES[case], method, backend, **options)
        return built[key]

    return get


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="rewrite tests/golden/ with what is emitted now")
