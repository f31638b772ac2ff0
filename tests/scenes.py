"""Hypothesis strategies for scenes."""

from typing import Any

from hypothesis import strategies as st

from bench.cases import ALONG, JOINT, link
from eomgen.scene import LINK_TYPES, AnyLink, Scene

GRAVITIES = (9.81, 9.81, 0.0, -1.62)
LENGTHS = ("free", "free", "prescribed", 0.6)


@st.composite
def scenes(draw: st.DrawFn, most: int = 6) -> Scene:
    """Trees of up to `most` links of all models, hanging or not, of all kinds of lengths, with springs and dampers."""
    count = draw(st.integers(1, most))
    parents = [draw(st.integers(-1, i - 1)) for i in range(count)]
    made = [draw(_links(i, parent, tip=i not in parents)) for i, parent in enumerate(parents)]
    return Scene("random", tuple(made), draw(st.sampled_from(GRAVITIES)))


@st.composite
def _links(draw: st.DrawFn, index: int, parent: int, tip: bool) -> AnyLink:
    model = draw(st.sampled_from(sorted(LINK_TYPES)))
    hangs = draw(st.booleans())
    length = None if model == "rigid" else draw(st.sampled_from(LENGTHS))
    if model == "elastic-rod" and hangs and tip and length == "free":
        length = "prescribed"  # it moves no mass: with a free length the scene is singular in every state
    changes: dict[str, Any] = {}
    if isinstance(length, str):
        changes |= draw(_some_of(ALONG))
    changes |= draw(_some_of(JOINT))
    return link(index, parent, model, length, hangs=hangs, **changes)


def _some_of(numbers: dict[str, float]) -> st.SearchStrategy[dict[str, float]]:
    """None of the springs and dampers mostly, any of them sometimes."""
    some = st.sets(st.sampled_from(sorted(numbers))).map(lambda keys: {key: numbers[key] for key in sorted(keys)})
    return st.one_of(st.just({}), some)
