"""Student's t: the factor by which an estimated standard error becomes a 95 % interval."""

import math

import numpy as np
import torch
from torch import Tensor

NORMAL_QUANTILE = 1.959963984540054  # leaves 2.5 % above it


def t_quantile(freedom: Tensor) -> Tensor:
    """Student's t that leaves 2.5 % above it, for degrees of freedom from 1 up (any shape); relative error below 1e-9.

    From 1000 degrees on by its expansion about the normal quantile (Abramowitz and Stegun 26.7.5). Below, by Newton's
    method on the distribution function of theta = atan(t / sqrt(freedom)), whose integrand is smooth and falls, so
    that the steps rise to the quantile from any smaller start.
    """
    z = NORMAL_QUANTILE
    expansion = (
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
    )
    many = z + sum((term / freedom**k for k, term in enumerate(expansion, start=1)), torch.zeros_like(freedom))
    few = freedom.clamp(max=1000)
    gauss = np.polynomial.legendre.leggauss(24)
    nodes, rule = torch.from_numpy(0.5 * (gauss[0] + 1)), torch.from_numpy(0.5 * gauss[1])
    log_norm = torch.lgamma((few + 1) / 2) - torch.lgamma(few / 2) - 0.5 * math.log(math.pi)
    theta = torch.atan(1.9 / few.sqrt())  # below that of infinitely many degrees
    for _ in range(8):
        cosines = torch.cos(theta.unsqueeze(-1) * nodes)
        below = torch.exp(log_norm.unsqueeze(-1) + (few.unsqueeze(-1) - 1) * torch.log(cosines)) @ rule * theta
        theta = theta + (0.475 - below) / torch.exp(log_norm + (few - 1) * torch.log(torch.cos(theta)))
    return torch.where(freedom < 1000, few.sqrt() * torch.tan(theta), many)
