"""Whether what a fit is given is of a size that a double's squares hold, asked before any work.

Losses are sums of squares, the variances of values those of their products: fourth powers of residuals. So values, what
they are over sigma, and weights must be within 1e-110 to 1e110: their squares are within 1e-220 to 1e220, which leaves
room for the rest. A robust form's scale below 1e-10 of the data is lost in the rounding of residuals.
"""

import torch
from torch import Tensor

from ..errors import ParameterError, SamplesError
from ..formats.samples import Samples
from .data import root_weights
from .losses import LOSSES, Scales

_LEAST, _MOST = 1e-110, 1e110
_ROUNDING = 1e-10


def check_magnitudes(samples: Samples, loss: str, robust_scale: float | None) -> None:
    """Raise where squares of the samples' values, deviations or weights, or of the robust scale, leave the type."""
    values, sigma, weight = samples.values.abs(), samples.sigma, samples.weight
    _check("values", values, "values", "Choose another unit.")
    if sigma is not None:
        advice = "Give sigma in the unit of the values, or leave it out."
        _check("sigma", sigma, "sigma", advice)
        _check("sigma", 1 / sigma, "1/sigma", advice)
        _check("sigma", values / sigma, "values over sigma", advice)
    if weight is not None:
        _check("weight", weight, "weight", "Divide all weights by the largest.")
    if robust_scale is None:
        return
    kind, c = LOSSES[loss], samples.wi[:, 2:]
    nothing = torch.zeros_like(samples.values)
    differences = kind.difference(nothing, samples.values, c, Scales.of(samples.values, c))
    size = float((root_weights(samples, kind) * differences).abs().max()) or 1.0
    if not _ROUNDING <= robust_scale / size <= _MOST:
        raise ParameterError(
            f"Expected robust_scale to be from {_ROUNDING:g} to {_MOST:g} times what the largest value counts under "
            f"the {loss} loss, {size:.3g}, got {robust_scale:g}. Choose about what good residuals are, or leave it to "
            "the data.",
            field="robust_scale",
        )


def _check(field: str, sizes: Tensor, what: str, advice: str) -> None:
    """Raise where the largest of the sizes is neither 0 nor within what squares can hold."""
    largest = float(sizes.max())
    if largest != 0 and not _LEAST <= largest <= _MOST:
        raise SamplesError(
            f"Expected {field} to be of a size whose squares a double holds, the largest of {what} from "
            f"{_LEAST:g} to {_MOST:g}, got {largest:.3g}. {advice}",
            field=field,
        )
