"""Generalised ufuncs in Python: broadcasting, shape errors and blocks for vectorised functions.

A call checks the core shapes as NumPy does (and in its words), broadcasts the leading axes, and evaluates the
function block by block of states, so no temporary is larger than a block.

The functions are written against an array namespace, so arrays of another library (JAX, PyTorch, CuPy, or any with
the Python array API) are computed by that library, in one piece and without NumPy.
"""

import math

import numpy

LINE_BYTES = 64  # of a cache
FAR = 8  # rad: differences of angles from here on are corrected for their rounding


class Function:
    """A function of arrays, called like a NumPy generalised ufunc.

    Args:
        name: its name.
        doc: its docstring.
        shapes: core shapes of the arguments.
        result: core shape of the result.
        signature: the generalised ufunc's signature.
        constants: maps p (a sequence of numbers or arrays) to what depends on p only; None if nothing does.
        parameters: whether the last argument is p.
        kernel: maps the arguments' elements, p and the constants to the elements of the result.
        block: states per evaluation.
        dtypes: names of the types it is offered for.
    """

    def __init__(self, name, doc, shapes, result, signature, constants, parameters, kernel, block, dtypes):
        self.__name__ = self.__qualname__ = name
        self.__doc__ = doc
        self.signature = signature
        self.nin, self.nout, self.nargs = len(shapes), 1, len(shapes) + 1
        self._shapes, self._result = shapes, result
        self._constants, self._kernel, self._block = constants, kernel, block
        self._parameters = parameters
        self._dtypes = [numpy.dtype(dtype) for dtype in dtypes]
        self.types = [f"{dtype.char * self.nin}->{dtype.char}" for dtype in self._dtypes]

    def __repr__(self):
        return f"<function {self.__name__!r} {self.signature}>"

    def __reduce__(self):
        # By reference, as NumPy's own ufuncs; __module__ is set by the package.
        return self.__name__

    def __call__(self, *arguments, out=None):
        other = _namespace(arguments)
        if other is not None:
            return self._call_elsewhere(other, arguments, out)
        if len(arguments) == self.nargs and out is None:
            *arguments, out = arguments
        if len(arguments) != self.nin:
            count = f"from {self.nin} to {self.nargs} positional arguments but {len(arguments)} were given"
            raise TypeError(f"{self.__name__}() takes {count}")
        if isinstance(out, tuple):
            (out,) = out
        arrays = [numpy.asarray(argument) for argument in arguments]
        dtype = self._dtype(arrays)
        arrays = [array.astype(dtype, copy=False) for array in arrays]
        batch = self._batch(arrays)
        result = self._output(out, batch, dtype, arrays)
        self._evaluate(arrays, batch, result, dtype)
        if out is None:
            return result if batch or self._result else result[()]
        if result is not out:
            out[...] = result
        return out

    def _call_elsewhere(self, xp, arguments, out):
        """The same on arrays of another library; a new array is returned."""
        if len(arguments) != self.nin:
            raise TypeError(f"{self.__name__}() takes {self.nin} positional arguments but {len(arguments)} were given")
        if out is not None:
            raise TypeError("out= is for NumPy arrays")
        foreign = [x for x in arguments if _namespace([x]) is not None]
        floats = [x.dtype for x in foreign if "float" in str(x.dtype)]
        dtype = min(floats, key=lambda kind: float(xp.finfo(kind).eps)) if floats else xp.float64
        first = foreign[0]
        arrays = [_like(xp, x, first, dtype) for x in arguments]
        batch = self._batch(arrays)
        values = [_unstack(xp, array, core) for array, core in zip(arrays, self._shapes, strict=True)]
        constants = self._constants(xp, float, values[-1]) if self._constants else ()
        elements = [_like(xp, x, first, dtype) for x in self._kernel(xp, float, *values, constants)]
        last = {"dim" if xp.__name__ == "torch" else "axis": -1}
        stacked = xp.stack([xp.broadcast_to(x, batch) for x in elements], **last)
        return xp.reshape(stacked, (*batch, *self._result))

    def _dtype(self, arrays):
        """The first offered type that holds all arguments."""
        for dtype in self._dtypes:
            if all(numpy.can_cast(array.dtype, dtype) for array in arrays):
                return dtype
        raise TypeError(
            f"ufunc {self.__name__!r} not supported for the input types, and the inputs could not be safely "
            f"coerced to any supported types according to the casting rule ''safe''"
        )

    def _batch(self, arrays):
        """The broadcast leading shape; core shapes must be exactly the function's."""
        leading = []
        for position, (array, core) in enumerate(zip(arrays, self._shapes, strict=True)):
            if array.ndim < len(core):
                raise ValueError(
                    f"{self.__name__}: Input operand {position} does not have enough dimensions (has {array.ndim}, "
                    f"gufunc core with signature {self.signature} requires {len(core)})"
                )
            split = array.ndim - len(core)
            for axis, (size, wanted) in enumerate(zip(array.shape[split:], core, strict=True)):
                if size != wanted and wanted:
                    raise ValueError(
                        f"{self.__name__}: Input operand {position} has a mismatch in its core dimension {axis}, with "
                        f"gufunc signature {self.signature} (size {size} is different from {wanted})"
                    )
            leading.append(tuple(array.shape[:split]))
        return self._broadcast(leading, [tuple(array.shape) for array in arrays], None)

    def _broadcast(self, leading, shapes, out):
        """The common leading shape, which a result that is given may widen but not narrow."""
        try:
            batch = numpy.broadcast_shapes(*leading)
            if out is not None and numpy.broadcast_shapes(batch, out) != out:
                raise ValueError
            return batch if out is None else out
        except ValueError:
            core = ",".join(map(str, self._result))
            pairs = []
            for shape, lead in zip(shapes, leading if out is None else [*leading, out], strict=True):
                axes = [
                    *map(str, lead),
                    *(["newaxis"] * len(self._result) if len(pairs) < self.nin else core.split(",")),
                ]
                text = str(shape).replace(" ", "")
                pairs.append(f"{text}->({','.join(axes) if lead else ''})")
            raise ValueError(
                "operands could not be broadcast together with remapped shapes [original->remapped]: "
                f"{' '.join(pairs)}  and requested shape ({core})"
            ) from None

    def _output(self, out, batch, dtype, arrays):
        shape = (*batch, *self._result)
        if out is None:
            return numpy.empty(shape, dtype)
        if not isinstance(out, numpy.ndarray):
            raise TypeError("return arrays must be of ArrayType")
        if out.ndim < len(self._result):
            raise ValueError(
                f"{self.__name__}: Output operand 0 does not have enough dimensions (has {out.ndim}, gufunc core "
                f"with signature {self.signature} requires {len(self._result)})"
            )
        split = out.ndim - len(self._result)
        for axis, (size, wanted) in enumerate(zip(out.shape[split:], self._result, strict=True)):
            if size != wanted:
                raise ValueError(
                    f"{self.__name__}: Output operand 0 has a mismatch in its core dimension {axis}, with gufunc "
                    f"signature {self.signature} (size {size} is different from {wanted})"
                )
        leading = [array.shape[: array.ndim - len(core)] for array, core in zip(arrays, self._shapes, strict=True)]
        self._broadcast(leading, [*(tuple(array.shape) for array in arrays), out.shape], out.shape[:split])
        if not numpy.can_cast(dtype, out.dtype, "same_kind"):
            raise TypeError(
                f"Cannot cast ufunc {self.__name__!r} output from {dtype!r} to {out.dtype!r} "
                "with casting rule 'same_kind'"
            )
        if not out.flags.writeable:
            raise ValueError("output array is read-only")
        # Written at once where that is safe; otherwise through an array of its own.
        return out if out.dtype == dtype and out.shape == shape else numpy.empty(shape, dtype)

    def _evaluate(self, arrays, batch, result, dtype):
        """Fills `result` block by block."""
        if not batch:
            batch, result = (1,), result[numpy.newaxis]
        flat = []
        for array, core in zip(arrays, self._shapes, strict=True):
            leading = array.shape[: array.ndim - len(core)]
            own = array.copy() if numpy.may_share_memory(array, result) else array
            # One set of values for all states stays one; anything else is seen as if it had the full shape.
            if all(size == 1 for size in leading):
                flat.append((None, own.reshape(-1)))
            else:
                flat.append((numpy.broadcast_to(own, (*batch, *own.shape[len(leading) :])), None))
        states = int(numpy.prod(batch, dtype=numpy.intp))
        size = int(numpy.prod(self._result, dtype=numpy.intp))
        shared = flat[-1][1] if self._parameters else ()
        constants = self._constants(numpy, dtype.type, shared) if self._constants and shared is not None else ()
        for first in range(0, states, self._block):
            last = min(first + self._block, states)
            where = numpy.unravel_index(numpy.arange(first, last), batch) if len(batch) != 1 else slice(first, last)
            values = [_elements(array[where]) if one is None else one for array, one in flat]
            known = self._constants(numpy, dtype.type, values[-1]) if self._constants and shared is None else constants
            elements = self._kernel(numpy, dtype.type, *values, known)
            block = numpy.empty((last - first, size), dtype)
            for position, element in enumerate(elements):
                block[:, position] = element
            result[where] = block.reshape((last - first, *self._result))


def _elements(block):
    """Arrays over the states of a block, one per element of the core.

    Short rows are read where they lie, mostly once or twice; of rows longer than a line of the cache, every reading of
    a column would fetch all lines.
    """
    columns = block.reshape(len(block), -1).T
    far = columns.strides[1] != columns.itemsize and len(columns) * columns.itemsize > LINE_BYTES
    return numpy.ascontiguousarray(columns) if far else columns


def _namespace(arrays):
    """The library of the arrays if it is not NumPy: by the array API, or PyTorch."""
    for array in arrays:
        if isinstance(array, (numpy.ndarray, numpy.generic)):
            continue
        if type(array).__module__.partition(".")[0] == "torch":
            import torch

            return torch
        if hasattr(array, "__array_namespace__"):
            return array.__array_namespace__()
    return None


def _like(xp, value, example, dtype):
    """A number or array as an array of the example's library and device."""
    if _namespace([value]) is not None:
        if value.dtype == dtype:
            return value
        return value.to(dtype) if xp.__name__ == "torch" else xp.asarray(value, dtype=dtype)
    known = {"device": example.device} if xp.__name__ == "torch" else {}
    return xp.asarray(
        numpy.array(value, dtype=float) if isinstance(value, numpy.ndarray) else value, dtype=dtype, **known
    )


def _unstack(xp, array, core):
    """The elements of the core axes, the last running fastest."""
    size = math.prod(core)
    shape = tuple(array.shape)
    flat = xp.reshape(array, (*shape[: len(shape) - len(core)], size))
    return [flat[..., i] for i in range(size)]


def pivot_inverse(xp, pivot, reference):
    """1/pivot where it is safely positive beside the reference (above 16 eps) and normal, else NaN and `invalid`."""
    if isinstance(pivot, (int, float)):
        xp = numpy
    if xp is numpy:
        pivot = numpy.asarray(pivot)
    kind = xp.finfo(pivot.dtype)
    safe = pivot > 16 * float(kind.eps) * reference + kind.smallest_normal
    if xp is numpy and safe.all():  # a third of the passes over the array
        inverse = 1 / pivot
    else:
        one = xp.ones_like(pivot)
        inverse = xp.where(safe, one, 0 * one) / xp.where(safe, pivot, 0 * one)
    return float(inverse) if xp is numpy and not inverse.ndim and inverse.dtype == float else inverse


def all_small(xp, q):
    """Whether no difference of two coordinates can be far; false where that is not known (not NumPy)."""
    return xp is numpy and bool(numpy.abs(q).max(initial=0) < FAR / 2)


def sincos_difference(xp, x, y, small):
    """Sine and cosine of x - y: of x - y rounded where that is not far, beyond corrected for the rounding.

    Args:
        xp: the array namespace.
        x, y: the angles.
        small: whether it is known that no |x - y| is far.
    """
    turn = x - y
    sine, cosine = xp.sin(turn), xp.cos(turn)
    if small:
        return sine, cosine
    size = xp.abs(turn)
    below = size < FAR
    if xp is numpy and below.all():
        return sine, cosine
    rest = x - turn
    lost = (x - (turn + rest)) + (rest - y)  # exactly (Knuth's TwoSum)
    right_sine, right_cosine = sine + lost * cosine, cosine - lost * sine
    near = size <= float(xp.finfo(turn.dtype).eps) ** -0.5  # there the square of what is lost is below the error
    if not (xp is numpy and near.all()):
        sx, cx, sy, cy = xp.sin(x), xp.cos(x), xp.sin(y), xp.cos(y)
        right_sine = xp.where(near, right_sine, sx * cy - cx * sy)
        right_cosine = xp.where(near, right_cosine, cx * cy + sx * sy)
    return xp.where(below, sine, right_sine), xp.where(below, cosine, right_cosine)
