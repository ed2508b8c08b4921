"""What the functions of a law compute, as text: the same in another process, another after an edit; and their derivatives."""

import inspect
import types


def code(functions):
    """Byte code, constants, closures and the functions and values of their modules that `functions` use."""
    seen = set()
    return "\n".join(_described(function, seen) for function in functions)


def _described(value, seen):
    value = inspect.unwrap(value) if callable(value) else value
    if isinstance(value, types.MethodType):
        value = value.__func__
    if isinstance(value, types.FunctionType):
        if value in seen:
            return value.__name__
        seen.add(value)
        cells = [cell.cell_contents for cell in value.__closure__ or ()]
        used = [value.__globals__.get(name) for name in sorted(_names(value.__code__))]
        kept = [*cells, *(value.__defaults__ or ()), *(value.__kwdefaults__ or {}).items(), *used]
        return f"{_code(value.__code__)}({', '.join(_described(one, seen) for one in kept)})"
    if isinstance(value, (types.ModuleType, type, types.BuiltinFunctionType)):
        return getattr(value, "__name__", "")
    if hasattr(value, "tobytes"):
        return f"{getattr(value, 'dtype', '')}{getattr(value, 'shape', '')}{value.tobytes().hex()}"
    if isinstance(value, dict):
        value = list(value.items())
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_described(one, seen) for one in value)}]"
    if isinstance(value, (set, frozenset)):
        return f"{{{', '.join(sorted(_described(one, seen) for one in value))}}}"
    if value is None or isinstance(value, (bool, int, float, complex, str, bytes)):
        return repr(value)
    # Of any other object, how it is called and what it has; its address is not the same twice.
    if id(value) in seen:
        return type(value).__name__
    seen.add(id(value))
    call = getattr(type(value), "__call__", None)
    return f"{type(value).__name__}{_described([call, vars(value) if hasattr(value, '__dict__') else None], seen)}"


def _names(code):
    """Names that byte code and the functions inside of it look up."""
    inner = [constant for constant in code.co_consts if isinstance(constant, types.CodeType)]
    return set(code.co_names).union(*(_names(one) for one in inner))


def _code(code):
    constants = [
        _code(constant) if isinstance(constant, types.CodeType) else _described(constant, set())
        for constant in code.co_consts
    ]
    return f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {constants}"


class _Columns(dict):
    """Columns by name, as a batch has them."""

    __getattr__ = dict.__getitem__


def differentiated(how, rates, inputs):
    """`rates` in double precision, and its derivatives by the columns named `inputs`, by automatic differentiation.

    `rates` is written with jax.numpy and computes every point by itself: a tangent of ones along one column gives the derivatives
    by that column at all points.
    """
    if how != "jax":
        raise ValueError(f'rate_partials is {how!r}, expected a function or "jax"')
    try:
        import jax
    except ImportError as error:
        raise ImportError('rate_partials="jax" needs JAX: pip install jax') from error
    from jax import numpy

    def columns(at):
        return _Columns({name: at[name] for name in at.keys()})

    def in_double(at):
        with _double(jax):
            return rates(columns(at))

    def partials(at):
        with _double(jax):
            known = columns(at)
            given = {name: numpy.asarray(known[name]) for name in inputs}

            def of(changed):
                try:
                    all_rates = rates(_Columns({**known, **changed}))
                except jax.errors.TracerArrayConversionError as error:
                    raise TypeError('rate_partials="jax" needs rates that are written with jax.numpy, not with numpy') from error
                shape = given[inputs[0]].shape
                return {species: numpy.broadcast_to(rate, shape) for species, rate in all_rates.items()}

            found = {}
            for name in inputs:
                tangent = {other: numpy.full_like(column, other == name) for other, column in given.items()}
                _, derivatives = jax.jvp(of, (given,), (tangent,))
                found.update({(species, name): column for species, column in derivatives.items()})
            return found

    return in_double, partials


def _double(jax):
    """Double precision for what is computed inside."""
    try:
        return jax.enable_x64(True)
    except AttributeError:
        from jax.experimental import enable_x64

        return enable_x64()
