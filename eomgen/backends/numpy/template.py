"""Frames of the emitted Python; they hold only what never varies."""

HEAD = '''\
"""{title}

The functions take an array namespace xp (numpy, jax.numpy, ...), a type for the numbers that no float64 holds
exactly, and sequences of arrays over states (q[0], q[1], ...), and return a list of such arrays. The `Function`
objects give them the shapes and the broadcasting of generalised ufuncs.
"""

from ._gufunc import Function, all_small, pivot_inverse, sincos_difference

'''

ROUTINE = """
def {name}(xp, number, {arguments}):
{body}
"""

FUNCTION = """
{name} = Function(
    "{name}",
    "{doc}",
    {shapes},
    {result},
    "{signature}",
    {constants},
    {parameters},
    _{name},
    {block},
    {dtypes},
)
{name}.__module__ = __name__
"""
