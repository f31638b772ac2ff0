"""The methods of derivation: a module each, by the name a user types."""

from collections.abc import Callable

from eomgen.errors import OptionError, unknown
from eomgen.frontends import articulated, lagrange, matrix, recursive
from eomgen.frontends.mechanism import Mechanism, MechanismEquations

METHODS: dict[str, Callable[[Mechanism], MechanismEquations]] = {
    "lagrange": lagrange.derive,
    "recursive": recursive.derive,
    "matrix": matrix.derive,
    "articulated": articulated.derive,
}


def check_method(method: str) -> None:
    """Refuses a name that is no method's.

    Raises:
        OptionError: there is no such method.
    """
    if not isinstance(method, str) or method not in METHODS:
        raise OptionError(unknown("method", method, METHODS))


def derive(mechanism: Mechanism, method: str) -> MechanismEquations:
    """The equations of a scene by the method of this name.

    Raises:
        OptionError: there is no such method.
    """
    check_method(method)
    return METHODS[method](mechanism)
