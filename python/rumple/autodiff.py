"""An `Objective` as a function that JAX or PyTorch differentiates.

    loss = rumple.autodiff.to_jax(objective)
    jax.grad(lambda w: loss(network(w)))(w)

The gradient is that of the adjoint; second derivatives are not there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ._rumple import Error, Objective

__all__ = ["to_jax", "to_torch"]


def to_jax(objective: Objective) -> Callable[[Any], Any]:
    """J of an array of parameters, in the order of `objective.names`, for `jax.grad` and `jax.jit`.

    It is computed in double precision and returned in that of the argument: `jax.config.update("jax_enable_x64", True)` keeps all digits.
    """
    import numpy

    try:
        import jax
    except ImportError as error:
        raise Error("to_jax needs JAX: pip install jax") from error

    def value(x: Any) -> Any:
        return numpy.asarray(objective.value(numpy.asarray(x, numpy.float64)), x.dtype)

    def both(x: Any) -> tuple[Any, Any]:
        j, slope = objective(numpy.asarray(x, numpy.float64))
        return numpy.asarray(j, x.dtype), slope.astype(x.dtype)

    def scalar(x: Any) -> Any:
        return jax.ShapeDtypeStruct((), x.dtype)

    @jax.custom_vjp
    def function(x: Any) -> Any:
        return jax.pure_callback(value, scalar(x), x, vmap_method="sequential")

    def forward(x: Any) -> tuple[Any, Any]:
        return jax.pure_callback(both, (scalar(x), jax.ShapeDtypeStruct(x.shape, x.dtype)), x, vmap_method="sequential")

    function.defvjp(forward, lambda slope, change: (change * slope,))
    return function


def to_torch(objective: Objective) -> Callable[[Any], Any]:
    """J of a tensor of parameters, in the order of `objective.names`, for `backward`; computed on the processor, in double precision."""
    try:
        import torch
    except ImportError as error:
        raise Error("to_torch needs PyTorch: pip install torch") from error

    class Function(torch.autograd.Function):
        @staticmethod
        def forward(context: Any, x: Any) -> Any:
            given = x.detach().cpu().double().numpy()
            if context.needs_input_grad[0]:
                j, slope = objective(given)
                context.save_for_backward(torch.as_tensor(slope).to(x))
            else:
                j = objective.value(given)
            return x.new_tensor(j)

        @staticmethod
        @torch.autograd.function.once_differentiable
        def backward(context: Any, change: Any) -> Any:
            (slope,) = context.saved_tensors
            return change * slope

    return Function.apply
