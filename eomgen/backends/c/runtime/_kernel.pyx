# cython: language_level=3, binding=False, auto_pickle=False, embedsignature=False
"""Registers the functions of a compiled model as NumPy generalised ufuncs.

This text is the same for every model: names, signatures and loops come from the model's own table.
"""

import sys

from libc.stdint cimport uint32_t
from libc.stdlib cimport malloc

cdef extern from *:
    """
    #define NPY_NO_DEPRECATED_API NPY_1_22_API_VERSION
    #include <numpy/arrayobject.h>
    #include <numpy/ufuncobject.h>
    """
    enum: NPY_FLOAT
    enum: NPY_DOUBLE
    enum: NPY_LONGDOUBLE
    enum: NPY_ITER_WRITEONLY
    enum: NPY_ITER_UPDATEIFCOPY
    enum: NPY_ITER_ALIGNED
    enum: NPY_ITER_ALLOCATE
    enum: NPY_ITER_NO_BROADCAST
    enum: NPY_ITER_NO_SUBTYPE
    ctypedef struct PyUFuncObject:
        uint32_t *op_flags
    ctypedef void (*PyUFuncGenericFunction)(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    int _import_array() except -1
    int _import_umath() except -1
    object PyUFunc_FromFuncAndDataAndSignature(
        PyUFuncGenericFunction *loops, void **data, const char *types, int ntypes, int nin, int nout,
        int identity, const char *name, const char *doc, int unused, const char *signature)

cdef extern from "eomgen_model.h":
    ctypedef struct eom_kernels:
        void *one
    ctypedef struct eom_function:
        const char *name
        const char *signature
        const char *doc
        const char *rollout
        int inputs
        int parameters
        eom_kernels f64, f32, f80
    const eom_function eom_functions[]
    const int eom_function_count
    void eom_loop_f64(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_loop_f32(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_loop_f80(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_rollout_rk4_f64(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_rollout_rk4_f32(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_rollout_rk4_f80(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_rollout_euler_f64(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_rollout_euler_f32(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_rollout_euler_f80(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_rollout_dop853_f64(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_rollout_dop853_f32(char **, const Py_ssize_t *, const Py_ssize_t *, void *)
    void eom_rollout_dop853_f80(char **, const Py_ssize_t *, const Py_ssize_t *, void *)


cdef object register(const eom_function *f, const char *name, const char *doc, const char *signature, int nin, int nout,
                     PyUFuncGenericFunction f32, PyUFuncGenericFunction f64, PyUFuncGenericFunction f80):
    # NumPy keeps these arrays for the life of the ufunc, which is that of the process.
    cdef int operands = nin + nout, count = 0, i, k
    cdef PyUFuncGenericFunction *loops = <PyUFuncGenericFunction *>malloc(3 * sizeof(PyUFuncGenericFunction))
    cdef void **data = <void **>malloc(3 * sizeof(void *))
    cdef char *types = <char *>malloc(3 * operands)
    cdef char kind[3]
    if loops == NULL or data == NULL or types == NULL:
        raise MemoryError
    if f.f32.one != NULL:
        loops[count] = f32
        kind[count] = NPY_FLOAT
        count += 1
    if f.f64.one != NULL:
        loops[count] = f64
        kind[count] = NPY_DOUBLE
        count += 1
    if f.f80.one != NULL:
        loops[count] = f80
        kind[count] = NPY_LONGDOUBLE
        count += 1
    for k in range(count):
        data[k] = <void *>f
        for i in range(operands):
            types[k * operands + i] = kind[k]
    made = PyUFunc_FromFuncAndDataAndSignature(loops, data, types, count, nin, nout, -1, name, doc, 0, signature)
    # The flags that NumPy gives to results but for NPY_ITER_OVERLAP_ASSUME_ELEMENTWISE: a result that is an argument is
    # written beside it first, as some of a state is written before all of it is read.
    for i in range(nin, operands):
        (<PyUFuncObject *>made).op_flags[i] = (NPY_ITER_WRITEONLY | NPY_ITER_UPDATEIFCOPY | NPY_ITER_ALIGNED |
                                               NPY_ITER_ALLOCATE | NPY_ITER_NO_BROADCAST | NPY_ITER_NO_SUBTYPE)
    try:
        made.__module__ = __name__  # where pickle finds it; before NumPy 2.2 it has to look through all modules
    except AttributeError:
        pass
    return made


_import_array()
_import_umath()

cdef dict functions = {}
cdef const eom_function *f
for index in range(eom_function_count):
    f = &eom_functions[index]
    nin = f.inputs + f.parameters
    functions[f.name.decode()] = register(
        f, f.name, f.doc, f.signature, nin, 1, eom_loop_f32, eom_loop_f64, eom_loop_f80)
    if f.rollout != NULL:
        functions["rollout_rk4"] = register(
            f, "rollout_rk4", "", f.rollout, nin + 2, 2, eom_rollout_rk4_f32, eom_rollout_rk4_f64, eom_rollout_rk4_f80)
        functions["rollout_euler"] = register(
            f, "rollout_euler", "", f.rollout, nin + 2, 2,
            eom_rollout_euler_f32, eom_rollout_euler_f64, eom_rollout_euler_f80)
        functions["rollout_dop853"] = register(
            f, "rollout_dop853", "", f.rollout, nin + 2, 2,
            eom_rollout_dop853_f32, eom_rollout_dop853_f64, eom_rollout_dop853_f80)
globals().update(functions)

# Cython enters the module under the name it was translated by, too, where pickle would find a function first.
if __name__ != "_kernel" and sys.modules.get("_kernel") is sys.modules.get(__name__):
    sys.modules.pop("_kernel", None)
