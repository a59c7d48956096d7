"""The energy that single scattering of an isotropic microfacet lobe loses, and what returns it.

    f_back = F_back G(ci) G(co) / (pi Gbar)   [1/sr],   G(mu) = 1 - E(mu),   Gbar = 2 integral of G mu dmu     [1]
    F_back = Fbar^2 (1 - Gbar) / (1 - Fbar Gbar),   Fbar = 2 integral of F mu dmu                              [1]

E is the lobe's directional albedo for F = 1, mu the direction's cosine. Light that is not lost at the first facet was
reflected there once (Fbar); of what is lost, the share Fbar (1 - Gbar) is reflected again and leaves, the share
Fbar Gbar is reflected again and is lost once more, and so on: a geometric series. Where nothing is absorbed, Fbar = 1,
all that is lost returns; f_back cos theta_i integrates to F_back G(co).

G depends on mu and the width a: a factor that has its rise at the horizon and its fall towards the normal, times a
bicubic spline of mu and a whose coefficients are positive, so that G is. Gbar is a quadrature of that same
spline, so that the two lobes sum to 1 wherever the spline is right.
Source: Kulla and Conty 2017, "Revisiting physically based shading at Imageworks". The table: energy/lost_energy.py.
"""

import functools
import math
from importlib import resources

import numpy as np
import torch
from torch import Tensor

from ..parameters import Values
from .fresnel import conductor, dielectric

FILE = "lost_energy.npz"
LOW, HIGH = 1e-4, 10.0  # of the widths in the table
PANELS, ORDER = 32, 6  # of the quadrature that gives Gbar
MEAN_ERROR = 1e-7  # of Gbar, as a share of it
NODES = 24  # of the quadrature that gives Fbar


def rise(a: Tensor) -> Tensor:
    """About the cosine [1] up to which G grows, for a width a."""
    return 0.3 * a / (1 + a * a)


def across(mu: Tensor, a: Tensor) -> Tensor:
    """The place of a cosine in the table of a width [1], 0 at the horizon, 1 at the normal: mostly its logarithm."""

    def raw(mu: Tensor) -> Tensor:
        return torch.log1p(mu / (0.003 * rise(a))) + 8 * a / (a + 0.1) * (mu * mu)

    return raw(mu) / raw(torch.ones_like(a))


def along(a: Tensor) -> Tensor:
    """The place of a width in the table [1], from 0 to 1: its logarithm, with three times the room above 0.2."""

    def raw(a: Tensor) -> Tensor:
        return torch.log(a / LOW) + 2 * (torch.log1p(5 * a) - math.log1p(5 * LOW))

    return raw(a) / raw(torch.full_like(a, HIGH))


@functools.cache
def coefficients(name: str) -> Tensor:
    """The spline's coefficients [1], (widths, cosines), of "ggx_correlated" and so on."""
    with resources.files("brdfcore.data").joinpath(FILE).open("rb") as file, np.load(file) as stored:
        return torch.from_numpy(stored[name].astype(np.float64))


@torch.compiler.assume_constant_result  # type: ignore[untyped-decorator]
def pieces(name: str) -> Tensor:
    """The same as cubic polynomials along the cosines, (widths, cells, 4); a constant to a compiler."""
    return _pieces(name)


@functools.cache
def _pieces(name: str) -> Tensor:
    """The polynomials' coefficients.

    They are made of the coefficients' differences, so that derivatives lose nothing where the spline is all but level.
    """
    a, b, c, d = coefficients(name).unfold(1, 4, 1).unbind(-1)
    return torch.stack([(a + 4 * b + c) / 6, (c - a) / 2, (a - b + (c - b)) / 2, (d - a - 3 * (c - b)) / 6], dim=-1)


def _cell(x: Tensor, count: int) -> tuple[Tensor, Tensor]:
    """The cell of x in [0, 1] among so many, and where in it x lies; beyond 1 the last cell goes on."""
    t = x * count
    first = t.detach().floor().clamp(0, count - 1)
    return first.long(), t - first


def b_splines(t: Tensor) -> Tensor:
    """The values (..., 4) of the uniform cubic B-splines that are not 0 in a cell, at t in [0, 1] of it."""
    back = 1 - t
    parts = (back * back * back, 4 - 3 * t * t * (1 + back), 4 - 3 * back * back * (1 + t), t * t * t)
    return torch.stack(parts, dim=-1) / 6


def spline(name: str, x: Tensor, y: Tensor) -> Tensor:
    """A table's spline [1] at the places x of cosines and y of widths, which broadcast."""
    table: Tensor = pieces(name).to(x.device)
    first, t = _cell(y, len(table) - 3)
    rows = table[first.unsqueeze(-1) + torch.arange(4, device=x.device)]
    row = (rows * b_splines(t)[..., None, None]).sum(-3)  # (..., cells, 4), once a width
    first, t = _cell(x, table.shape[1])
    begin = table.shape[1] * torch.arange(y.numel(), device=y.device).reshape(y.shape)
    a, b, c, d = row.reshape(-1, 4)[begin + first].unbind(-1)
    return a + t * (b + t * (c + t * d))


def _mean_rule() -> tuple[list[float], list[float]]:
    """Nodes and weights of Gauss-Legendre panels over [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(ORDER)
    nodes = (np.arange(PANELS)[:, None] + (1 + x) / 2) / PANELS
    return nodes.ravel().tolist(), np.tile(w / 2 / PANELS, PANELS).tolist()


def cosines(a: Tensor) -> tuple[Tensor, Tensor]:
    """Cosines, even in their logarithm, and weights, both (..., N): their sum is 2 integral of mu dmu over [0, 1]."""
    x, w = (torch.tensor(numbers, dtype=a.dtype, device=a.device) for numbers in MEAN_RULE)
    scale = rise(a).unsqueeze(-1)
    length = torch.log1p(1 / scale)
    mu = scale * torch.expm1(x * length)
    return mu, 2 * w * length * mu * (mu + scale)


def _fresnel_rule() -> tuple[list[float], list[float]]:
    """Cosines c = t^2 and weights: their sum is 2 integral of c dc over [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    t = (1 + x) / 2
    return (t * t).tolist(), (2 * w * t**3).tolist()


MEAN_RULE, FRESNEL_RULE = _mean_rule(), _fresnel_rule()


def mean_fresnel(values: Values) -> Tensor:
    """Fbar [1] of an exact Fresnel factor, () or (C,)."""
    c, w = (torch.tensor(n, dtype=torch.float64, device=values["eta"].device) for n in FRESNEL_RULE)
    eta = values["eta"].double().unsqueeze(-1)
    if "k" in values:
        return (w * conductor(c, eta, values["k"].double().unsqueeze(-1))).sum(-1)
    return (w * dielectric(c, eta)).sum(-1)


def returned_share(mean_factor: Tensor, mean_lost: Tensor) -> Tensor:
    """F_back [1] of Fbar and Gbar."""
    return mean_factor.square() * (1 - mean_lost) / (1 - mean_factor * mean_lost)


def broad_direction(a: Tensor, u: Tensor, v: Tensor) -> Tensor:
    """Directions (..., 3) of density cos theta / (pi (cos^2 theta + a^2) log(1 + 1/a^2)) [1/sr], for u, v in (0, 1)."""
    a2 = a.square()
    length = torch.log1p(1 / a2)
    below, above = a2 * torch.expm1(u * length), -(1 + a2) * torch.expm1((u - 1) * length)  # cos^2 and sin^2, which sum
    low = below < 0.5  # to 1 but for roundings
    z, r = (torch.sqrt(torch.where(low == (x is below), x, 1 - y)) for x, y in ((below, above), (above, below)))
    angle = 2 * math.pi * v
    return torch.cat(torch.broadcast_tensors(r * torch.cos(angle), r * torch.sin(angle), z), dim=-1)
