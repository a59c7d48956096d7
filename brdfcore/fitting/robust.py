"""Robust forms of a loss: sum w rho(r) for sum w r^2, so that a few bad samples do not decide.

    soft_l1    rho = 2 s^2 (sqrt(1 + r^2/s^2) - 1)            grows like |r| beyond the scale s
    cauchy     rho = s^2 ln(1 + r^2/s^2)                      grows like ln |r|

Near 0 both are r^2. A weight stands before rho: a sample of weight 2 is one that is there twice. Where the samples'
sigma weighs the loss, r is counted in sigma instead. Where no scale is given it is a multiple of the residuals'
spread, 1.4826 times their median absolute value: the multiple at which normal noise costs 5 % of the plain loss's
precision. Spread and fit are repeated until the scale stands (search.py), for outliers inflate the first ones.
A Gauss-Newton method sees them as residuals r rho'/sqrt(h) and derivatives sqrt(h) dr with h = rho' + 2 rho'' r^2, the
primes by r^2, kept above 0 (Triggs et al. 2000, "Bundle adjustment: a modern synthesis", section 4.3).
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

SPREAD = 1.4826  # standard deviation over median absolute value of normal noise
_LEAST = 0.01  # of rho': keeps the normal equations positive where rho is concave


@dataclass(frozen=True)
class Robust:
    """A robust form: rho/s^2 and its first two derivatives as functions of z = r^2/s^2."""

    name: str
    functions: Callable[[Tensor], tuple[Tensor, Tensor, Tensor]]
    multiple: float  # of the spread, for 95 % efficiency under normal noise


def _soft_l1(z: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    root = torch.sqrt(1 + z)
    return 2 * z / (root + 1), 1 / root, -0.5 / root**3


def _cauchy(z: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    return torch.log1p(z), 1 / (1 + z), -1 / (1 + z).square()


ROBUST: dict[str, Robust] = {
    form.name: form for form in (Robust("soft_l1", _soft_l1, 1.2871), Robust("cauchy", _cauchy, 2.3849))
}


def softened(form: Robust, scale: Tensor, r: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """rho, and what Gauss-Newton takes for the residual and multiplies onto its derivatives; shaped as r."""
    rho, first, second = form.functions((r / scale).square())
    h = torch.maximum(first + 2 * second * (r / scale).square(), _LEAST * first)
    return scale.square() * rho, r * first / h.sqrt(), h.sqrt()
