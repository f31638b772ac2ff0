"""Other ways to generate the equations of motion of one mechanism, each timed against eomgen."""

CONTENDERS: tuple[str, ...] = (
    "sympy_lagrange",
    "sympy_kane",
    "sympy_matrix",
    "casadi_lagrange",
    "casadi_matrix",
    "symengine_lagrange",
    "symengine_matrix",
)
"""Module names in this package; each module has ``derive``, ``evaluate`` and ``VERSION``."""
