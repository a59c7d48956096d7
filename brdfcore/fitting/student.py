"""Student's t: the factor by which an estimated standard error becomes a 95 % interval."""

import math

import numpy as np
import torch
from torch import Tensor

NORMAL_QUANTILE = 1.959963984540054  # leaves 2.5 % above it
_MANY = 100  # degrees of freedom from which the expansion is right to 4e-11
_STEPS = 8  # of Newton's at most
_SMALL = 1e-6  # of the angle: a step whose square is rounding


def t_quantile(freedom: Tensor) -> Tensor:
    """Student's t that leaves 2.5 % above it, for degrees of freedom from 1 up (any shape); relative error below 1e-9.

    From 100 degrees on by its expansion about the normal quantile (Abramowitz and Stegun 26.7.5). Below, that is too
    small by 11 % at most, and a start for Newton's method on the distribution function of theta =
    atan(t / sqrt(freedom)), whose integrand is smooth and falls, so that the steps rise to the quantile.
    """
    z = NORMAL_QUANTILE
    expansion = (
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
        (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / 92160,
    )
    found = z + sum((term / freedom**k for k, term in enumerate(expansion, start=1)), torch.zeros_like(freedom))
    is_few = freedom < _MANY
    few = freedom[is_few]
    if not few.numel():
        return found
    gauss = np.polynomial.legendre.leggauss(20)
    nodes, rule = torch.from_numpy(0.5 * (gauss[0] + 1)), torch.from_numpy(0.5 * gauss[1])
    log_norm = torch.lgamma((few + 1) / 2) - torch.lgamma(few / 2) - 0.5 * math.log(math.pi)
    theta = torch.atan(found[is_few] / few.sqrt())
    for _ in range(_STEPS):
        cosines = torch.cos(theta.unsqueeze(-1) * nodes)
        below = torch.exp(log_norm.unsqueeze(-1) + (few.unsqueeze(-1) - 1) * torch.log(cosines)) @ rule * theta
        step = (0.475 - below) / torch.exp(log_norm + (few - 1) * torch.log(torch.cos(theta)))
        theta = theta + step
        if bool((step <= _SMALL * theta).all()):
            break
    found[is_few] = few.sqrt() * torch.tan(theta)
    return found
