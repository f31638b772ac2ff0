"""The condition number of mass matrices."""

import numpy


def unit_condition(mass):
    """κ₂ of D^-1/2 M D^-1/2 with D the diagonal of M, for mass matrices M of shape (..., n, n).

    It does not depend on the units of the coordinates, and no scaling of them has a much smaller one (van der Sluis
    1969). Infinite where M is singular to rounding, NaN where it is not finite.
    """
    mass = numpy.asarray(mass, numpy.float64)
    finite = numpy.isfinite(mass).all((-2, -1))
    diagonal = numpy.diagonal(mass, axis1=-2, axis2=-1)
    regular = finite & (diagonal > 0).all(-1)
    roots = numpy.sqrt(numpy.where(regular[..., None], diagonal, 1.0))
    unit = numpy.where(regular[..., None, None], mass / roots[..., :, None] / roots[..., None, :], 0.0)
    values = numpy.linalg.eigvalsh(unit)
    positive = values[..., 0] > 0
    ratio = values[..., -1] / numpy.where(positive, values[..., 0], 1.0)
    return numpy.where(finite, numpy.where(positive, ratio, numpy.inf), numpy.nan)[()]
