"""The catalogue of hard cases: valid, complete, the same in every process."""

from __future__ import annotations

import re

import numpy as np
import pytest

import eomgen
from eomgen import hard

CASES = {case.name: case for case in hard.cases()}


def test_names_are_unique() -> None:
    assert len(CASES) == len(hard.cases())
    assert all(name.startswith(f"{case.scene.name}: ") and case.why for name, case in CASES.items())


def test_scenes_of_one_name_differ_in_numbers_only() -> None:
    """So that one module serves them: same links, same names of parameters, other values."""
    first: dict[str, hard.Case] = {}
    for case in CASES.values():
        other = first.setdefault(case.scene.name, case)
        assert [parameter.name for parameter in case.scene.parameters] == [p.name for p in other.scene.parameters]
        assert [(link.model, link.parent, link.mode) for link in case.scene.links] == [
            (link.model, link.parent, link.mode) for link in other.scene.links
        ]


@pytest.mark.parametrize("name", CASES)
def test_a_case_has_the_arguments_of_its_scene(name: str) -> None:
    scene, values = CASES[name].scene, CASES[name].values
    n, k = len(scene.links) + len(scene.free), len(scene.prescribed)
    shapes = {"q": (n,), "v": (n,), "u": (n,), "a": (n,), "w": (k, 3), "p": (len(scene.parameters),)}
    assert {letter: value.shape for letter, value in values.items()} == shapes
    assert all(np.isfinite(value).all() for value in values.values())


@pytest.mark.parametrize(
    "pattern",
    [
        "aligned|folded",
        "1c of 1e-12 m",
        "1d of 1e-12 m",
        "least inertia",
        r"masses to 1e\+06",
        "masses to 1e-12",
        "lengths to 0.0001",
        "tip",
        "chain1000",
        "fast",
        "angles of 1e15",
        "stiff",
        "300 masses",
        "subnormal",
        "huge",
        "walker",
    ],
)
def test_the_catalogue_has_every_kind(pattern: str) -> None:
    assert any(re.search(pattern, name) for name in CASES)


def test_states_are_the_same_every_time() -> None:
    again = {case.name: case.values for case in hard.cases()}
    for name, case in CASES.items():
        assert all(np.array_equal(value, again[name][letter]) for letter, value in case.values.items())


def test_reasons_are_given_for_every_state() -> None:
    assert set(hard.hard_states(eomgen.walker())) == set(hard.REASONS)
    extra = set(hard.hard_states(eomgen.chain(1))) - set(hard.REASONS)
    assert all(name.startswith("a length of ") for name in extra) and extra
