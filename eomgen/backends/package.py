"""The Python side of an emitted package, the same for every back end: names, parameters, facts."""

from __future__ import annotations

import pprint
from pathlib import Path

from eomgen.ir.program import Program, dimensions
from eomgen.model import Model

ON_REQUEST = ("jacobian", "parameter_jacobian", "regressor")
# Names that come with a function: name -> function.
BELONGS_TO = {"rollout": "forward_dynamics", "condition": "mass_matrix", "b": "regressor", "b_names": "regressor"}
ROLLOUT = Path(__file__).parent / "_rollout.py"
CONDITION = Path(__file__).parent / "_condition.py"

CONDITION_FUNCTION = '''\
from ._condition import unit_condition


def condition({arguments}):
    """condition({arguments})

    κ₂ of the mass matrix scaled to a diagonal of ones, which does not depend on units: about as many eps may be lost in
    accelerations. Infinite where the mass matrix is singular to rounding. Leading axes broadcast.
    """
    return unit_condition(mass_matrix({arguments}))

'''

INIT = '''\
"""{title}

{legend}
"""

import importlib
import sys
import types

import numpy

from . import {kernel}
from .{kernel} import {functions}
{more}
__all__ = [{all}]

q_names = {q_names}
v_names = {v_names}
u_names = {u_names}
w_names = {w_names}
p_names = {p_names}
p = numpy.array({p}, dtype={dtype!r})
p.flags.writeable = False

backend = {backend!r}
{facts}

def __getattr__(name):
    """What was not built: built now if it is made on request, which needs eomgen, or refused."""
    function = {belongs_to!r}.get(name, name)
    if function not in {absent!r}:
        raise AttributeError(f"module {{__name__!r}} has no attribute {{name!r}}")
    reason = ""
    if function in {on_request!r}:
        try:
            from eomgen.pipeline import on_request
        except ImportError:
            reason = " and eomgen is not installed to build it"
        else:
            globals()[name] = value = on_request(sys.modules[__name__], name)
            return value
    raise AttributeError(
        f"{{name}} was not built into {{__name__!r}}{{reason}}; compile with functions=[..., {{function!r}}]"
    )


class _Model(types.ModuleType):
    """A module that pickles by reference."""

    def __reduce__(self):
        return importlib.import_module, (self.__name__,)


sys.modules[__name__].__class__ = _Model
'''


def init_source(model: Model, backend: str, kernel: str) -> str:
    """`__init__.py` of the package; it needs NumPy only."""
    functions = [program.name for program in model.programs]
    exported = [*functions]
    more = ""
    if "forward_dynamics" in functions:
        exported.append("rollout")
        more += f"from ._rollout import Rollout\n\nrollout = Rollout({kernel})\nrollout.__module__ = __name__\n"
    if "mass_matrix" in functions:
        exported.append("condition")
        inputs = model.programs[functions.index("mass_matrix")].inputs
        more += CONDITION_FUNCTION.format(arguments=", ".join(array.name for array in inputs))
    facts = "".join(
        f"{name} = {pprint.pformat(value, width=110, sort_dicts=False)}\n" for name, value in model.facts.items()
    )
    absent = tuple(name for name in model.available if name not in functions)
    # Only a scene can be compiled again.
    on_request = tuple(name for name in absent if name in ON_REQUEST) if model.facts["scene"] else ()
    return INIT.format(
        belongs_to=BELONGS_TO,
        absent=absent,
        on_request=on_request,
        title=model.title,
        legend=legend(model, ""),
        kernel=kernel,
        functions=", ".join(functions),
        more=more,
        all=", ".join(repr(name) for name in (*exported, "p", *model.names)),
        p=[float(value) for value in model.p],
        backend=backend,
        dtype="float64" if "float64" in model.dtypes else model.dtypes[0],
        facts=facts,
        **{name: pprint.pformat(value, width=110) for name, value in model.names.items()},
    )


def help_text(program: Program) -> list[str]:
    """What Python's `help` says of a function, by paragraph."""
    shapes = [f"(..., {', '.join(map(str, array.shape))})" for array in (*program.inputs, program.output)]
    arguments = [array.name for array in program.inputs]
    given = ", ".join(f"{name} {shape}" for name, shape in zip(arguments, shapes, strict=False))
    return [
        f"{program.name}({', '.join(arguments)})",
        f"{program.doc[0].upper()}{program.doc[1:]}.",
        f"{given} -> {shapes[-1]}; SI units and rad.",
        "The elements are named in q_names, v_names, u_names, w_names and p_names of the module.",
    ]


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


def package_files(model: Model) -> dict[str, str]:
    """The Python files of a package that do not depend on the model."""
    needed = {"forward_dynamics": ROLLOUT, "mass_matrix": CONDITION}
    paths = [needed[program.name] for program in model.programs if program.name in needed]
    return {path.name: path.read_text(encoding="utf-8") for path in paths}


def rollout_signature(forward: Program) -> str:
    """The signature of the ufuncs that integrate forward dynamics: u and w gain the axis of the intervals.

    After the arguments come the step and a vector of options of the method.
    """
    arguments = []
    for array in forward.inputs:
        shape = dimensions(array)
        arguments.append(f"(t,{shape[1:]}" if array.name in "uw" else shape)
    n = dimensions(forward.output)
    return f"{','.join(arguments)},(),(o)->(t,{n[1:]},(t,{n[1:]}"
