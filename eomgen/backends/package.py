"""The Python side of an emitted package, the same for every back end: names, parameters, facts."""

from __future__ import annotations

import pprint

from eomgen.model import Model

INIT = '''\
"""{title}

{legend}
"""

import importlib
import sys
import types

import numpy

from .{kernel} import {functions}

__all__ = [{all}]

q_names = {q_names}
v_names = {v_names}
u_names = {u_names}
w_names = {w_names}
p_names = {p_names}
p = numpy.array({p}, dtype=float)
p.flags.writeable = False

backend = {backend!r}
{facts}

class _Model(types.ModuleType):
    """A module that pickles by reference."""

    def __reduce__(self):
        return importlib.import_module, (self.__name__,)


sys.modules[__name__].__class__ = _Model
'''


def init_source(model: Model, backend: str, kernel: str) -> str:
    """`__init__.py` of the package; it needs NumPy only."""
    functions = [program.name for program in model.programs]
    facts = "".join(
        f"{name} = {pprint.pformat(value, width=110, sort_dicts=False)}\n" for name, value in model.facts.items()
    )
    return INIT.format(
        title=model.title,
        legend=legend(model, ""),
        kernel=kernel,
        functions=", ".join(functions),
        all=", ".join(repr(name) for name in (*functions, "p", *model.names)),
        p=[float(value) for value in model.p],
        backend=backend,
        facts=facts,
        **{name: pprint.pformat(value, width=110) for name, value in model.names.items()},
    )


def legend(model: Model, prefix: str) -> str:
    """What each element of each argument is, a line each."""
    seen: dict[str, list[str]] = {}
    for program in model.programs:
        for array in program.inputs:
            seen.setdefault(array.name, array.labels)
    lines: list[str] = []
    for name, labels in sorted(seen.items(), key=lambda item: "qvauwp".index(item[0])):
        lines += [f"{name}[{i}]  {symbol}" for i, symbol in enumerate(labels)]
    return "\n".join(f"{prefix}{line}".rstrip() for line in lines)
