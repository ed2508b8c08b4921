"""What the functions of a law compute, as text: the same in another process, another after an edit."""

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
