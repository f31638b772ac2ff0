"""Whether the mass matrix of a scene can be inverted at all."""

from __future__ import annotations

from fractions import Fraction

from eomgen.errors import SingularError
from eomgen.frontends.articulated import ArticulatedEquations
from eomgen.frontends.mechanism import Mechanism, MechanismEquations
from eomgen.ir.equations import Equations
from eomgen.ir.interpret import fingerprint


def check(equations: Equations) -> None:
    """Refuses a scene whose mass matrix is singular in every state.

    The pivots of the articulated recursion are computed exactly in a prime field, with the scene's own numbers
    and a random state: a pivot that vanishes there vanishes for every state (with a probability of error of the
    order of 1e-15).

    Raises:
        SingularError: it is singular; the message names the coordinate.
    """
    if not isinstance(equations, MechanismEquations):
        return
    scene = equations.mechanism.scene
    values = {parameter.name: Fraction(parameter.value) for parameter in scene.parameters}
    pivots = ArticulatedEquations(Mechanism(scene)).pivots
    for (name, _), value in zip(pivots, fingerprint([node for _, node in pivots], given=values), strict=True):
        if value == 0:
            raise SingularError(
                f"scene {scene.name!r}: {name} has no inertia, so the mass matrix is singular in every state; "
                "give mass to what it moves, or prescribe or fix it"
            )
