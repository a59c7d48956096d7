"""Quadrature rules on an interval and round a circle, which also know how far the integrand's spectrum has fallen.

`gauss(n)`: Gauss and Legendre's n nodes on [0, 1]; its error is the part of the integrand in polynomials of degree 2 n
and more. `ring(n)`: n equal steps round the circle; its error is the part in harmonics n, 2 n, ... Both converge
geometrically for analytic integrands. A rule of n nodes sees the spectrum up to n, or n / 2; how it falls there says
how many nodes a wanted error will take. It does not say what the error is: a small feature that no node has met is not
in the spectrum, so errors are claimed from the differences of several rules (refinement.py).
"""

import functools
import math
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

_FIRST = (4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28)
LADDER = (*_FIRST, *(size * 2**doubling for doubling in range(3, 10) for size in _FIRST[:4]))  # 4 .. 3584


class Rule(NamedTuple):
    """Nodes, weights, and what turns values at the nodes into the amplitudes of their modes."""

    nodes: Tensor  # (n,)
    rest: Tensor  # 1 - nodes, without cancellation; of a ring, unused
    weights: Tensor
    modes: Tensor  # (n, m): weighted values @ modes are the amplitudes
    alias: int  # the first mode that the rule gets wrong
    paired: bool = False  # the modes are cosines, then sines

    def to(self, device: torch.device) -> "Rule":
        """The rule on a device."""
        nodes, rest, weights, modes = (v.to(device) for v in (self.nodes, self.rest, self.weights, self.modes))
        return Rule(nodes, rest, weights, modes, self.alias, self.paired)

    def tail(self, parts: Tensor) -> "Tail":
        """What is left at the end of the spectrum of weighted values (..., n, C), (..., C)."""
        amplitudes = torch.einsum("...nc,nm->...cm", parts, self.modes)
        if self.paired:
            amplitudes = torch.hypot(*amplitudes.unflatten(-1, (2, -1)).unbind(-2))
        amplitudes = amplitudes.abs()
        last = amplitudes.shape[-1] - 1
        late = max(1, math.ceil(0.75 * last))
        early = min(last // 2, late - 1)
        return Tail(
            amplitudes[..., early:late].amax(-1),
            amplitudes[..., late:].amax(-1),
            (early + late - 1) / 2,
            (late + last) / 2,
            self.alias,
        )


class Tail(NamedTuple):
    """The largest amplitudes in the third and in the last quarter of a spectrum, and where these lie."""

    early: Tensor
    late: Tensor
    early_at: float
    late_at: float
    alias: int  # the first mode that the rule gets wrong


@functools.cache
def gauss(n: int) -> Rule:
    """The rule of n nodes on [0, 1], correct to the last digit: Newton's method in extended precision."""
    x = np.polynomial.legendre.leggauss(n)[0].astype(np.longdouble)
    for _ in range(2):
        p = _legendre(x, n)
        x = x - p[n] * (x * x - 1) / (n * (x * p[n] - p[n - 1]))
    p = _legendre(x, n)
    weights = (1 - x * x) / (n * p[n - 1]) ** 2
    modes = np.stack(p[:n], axis=1) * (2 * np.arange(n) + 1)
    nodes, rest, shares, spectrum = (torch.tensor(v.astype(float)) for v in ((1 + x) / 2, (1 - x) / 2, weights, modes))
    return Rule(nodes, rest, shares, spectrum, alias=2 * n)


def _legendre(x: np.ndarray, n: int) -> list[np.ndarray]:
    """Legendre's polynomials of degree 0 to n at x."""
    p = [np.ones_like(x), x]
    for k in range(2, n + 1):
        p.append(((2 * k - 1) * x * p[-1] - (k - 1) * p[-2]) / k)
    return p


@functools.cache
def ring(n: int, *, mirrored: bool) -> Rule:
    """The rule of n angles in [0, 2 pi), n even; `mirrored`, those in [0, pi] count for their mirror images too."""
    angles = torch.arange(n // 2 + 1 if mirrored else n, dtype=torch.float64) * (2 * math.pi / n)
    weights = torch.full_like(angles, 2 * math.pi / n)
    if mirrored:
        weights[1:-1] *= 2
    phases = angles[:, None] * torch.arange(n // 2 + 1, dtype=torch.float64)
    modes = [torch.cos(phases)] if mirrored else [torch.cos(phases), torch.sin(phases)]
    return Rule(angles, angles, weights, 2 * torch.cat(modes, 1), n, not mirrored)
