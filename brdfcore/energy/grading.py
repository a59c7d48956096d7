"""Rays from the lobe's centre over the disc of slopes, dense where the integrals along them change quickly.

In slopes divided by the lobe's widths, p = wx rho cos t, q = wy rho sin t, a ray has the angle t. Towards grazing the
integral along it changes where T d.u passes through 0, d = (wx cos t, wy sin t) and u towards wo's azimuth: there the
horizon begins to cut the lobe. T d.u = tau cos(t - t1), so that the angles of nodes are taken from

    cos(t - t1) = sinh(Y cos w) / sinh Y,   Y = asinh(tau / kappa)

with w equally spaced: T d.u = kappa sinh(Y cos w) goes through every order of magnitude from kappa to tau. The map is
analytic and periodic, and the identity for Y = 0. A long and narrow lobe has a second such place, its narrow axis: then
two maps follow each other.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor

from .lobes import Profile
from .rules import Rule, gauss, ring

HORIZON = 0.1  # T d.u at which the horizon is still beyond exp(-25) of a Gaussian lobe, and at 0.3 beyond exp(-2.8)
ALGEBRAIC_HORIZON = 0.01
IDENTITY = 1e-9  # a Y for which the map is the identity to rounding


class Rays(NamedTuple):
    """The rays of each row (R, M): where they point, and what they weigh."""

    x: Tensor  # the direction of the slopes
    y: Tensor
    s: Tensor  # T cos phi, phi the azimuth against wo's
    width: Tensor  # of the lobe along the ray [1]
    weight: Tensor  # d phi
    rule: Rule
    panels: int  # the rule is applied to so many pieces of the circle


def graded(w: Tensor, y: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Cosine and sine of the angle D with cos D = sinh(y cos w) / sinh y, and dD/dw; nothing cancels."""
    inner = y * torch.cos(w)
    root = torch.sqrt(
        _sinh_ratio(2 * y * torch.sin(w / 2).square()) * _sinh_ratio(2 * y * torch.cos(w / 2).square())
    )
    return torch.sinh(inner) / torch.sinh(y), torch.sin(w) / _sinh_ratio(y) * root, torch.cosh(inner) / root


def _sinh_ratio(x: Tensor) -> Tensor:
    """sinh(x) / x for x >= 0."""
    small = x < 1e-8
    return torch.where(small, 1.0, torch.sinh(x) / torch.where(small, 1.0, x))


class Circle:
    """The maps from w to t for each row (R, 1)."""

    def __init__(self, profile: Profile, tangent: Tensor, toward: Tensor, widths: tuple[Tensor, Tensor], two: bool):
        wx, wy = widths
        self.wx, self.wy = wx, wy
        cosine, sine = torch.cos(toward), torch.sin(toward)
        reach = torch.sqrt((wx * cosine).square() + (wy * sine).square())  # of the lobe towards wo
        self.tau = tangent * reach
        self.across = wx * wy / reach  # the lobe's width where T d.u is 0
        self.cos1, self.sin1 = wx * cosine / reach, wy * sine / reach
        self.two = two
        self.stretch = torch.ones_like(self.tau)
        if two:
            self._narrow_axis(profile)

    def _narrow_axis(self, profile: Profile) -> None:
        """Set the first map, which is dense at the narrow axis, and where T d.u = 0 lies in it."""
        narrow, wide = torch.minimum(self.wx, self.wy), torch.maximum(self.wx, self.wy)
        ratio, beyond = narrow / wide, 1 / wide.clamp(min=1.0)
        if profile.fall == "algebraic":
            scale = ratio * beyond
        elif profile.kink != "none":
            scale = ratio
        else:
            scale = torch.where(beyond < 1, ratio * beyond, 1.0) if profile.smith else torch.maximum(ratio, beyond)
        self.y1 = torch.where(scale < 1, torch.asinh(1 / scale), IDENTITY).expand_as(self.tau)
        self.swap = self.wx > self.wy  # the first map's own axis is y where the narrow one is x
        # u is the angle before the first map; T d.u = 0 at the angle t1 + pi/2
        cosine, sine = torch.where(self.swap, -self.sin1, self.cos1), torch.where(self.swap, self.cos1, self.sin1)
        level = torch.acos((torch.asinh(cosine * torch.sinh(self.y1)) / self.y1).clamp(-1, 1))
        level = torch.where(sine < 0, -level, level)
        self.stretch = graded(level, self.y1)[2]
        self.u1 = level - math.pi / 2

    def steepness(self, kappa: Tensor) -> Tensor:
        """Y of the map whose smallest scale in T d.u is kappa."""
        return torch.asinh(self.tau * self.stretch / kappa).clamp(min=IDENTITY)

    def at(self, w: Tensor, steepness: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """cos t, sin t, cos(t - t1) and dt/dw."""
        cosine, sine, slope = graded(w, steepness)
        if not self.two:
            return cosine * self.cos1 - sine * self.sin1, cosine * self.sin1 + sine * self.cos1, cosine, slope
        u = self.u1 + torch.atan2(sine, cosine)
        cosine, sine, first = graded(u, self.y1)
        cosine, sine = torch.where(self.swap, cosine, -sine), torch.where(self.swap, sine, cosine)
        return cosine, sine, cosine * self.cos1 + sine * self.sin1, slope * first


def rays(
    profile: Profile, co: Tensor, toward: Tensor, widths: tuple[Tensor, Tensor], two: bool, size: int, error: float
) -> Rays:
    """The rays for wo of cosine co and azimuth `toward`, (R,); `error` is what the lobe's kinks may be neglected for.

    Isotropic, `two` widths being the same, rays stand for their mirror images. A smooth lobe has 2 `size` rays round
    the circle, one with kinks `size` rays on each piece of it.
    """
    tangent = (torch.sqrt((1 - co) * (1 + co)) / co)[:, None]
    circle = Circle(profile, tangent, toward[:, None], widths, two)
    kappa = circle.across.clamp(min=ALGEBRAIC_HORIZON if profile.fall == "algebraic" else HORIZON)
    y = circle.steepness(kappa)
    if profile.kink == "none":
        rule = ring(2 * size, mirrored=not two).to(co.device)
        panels, (cos_t, sin_t, cos_from_wo, slope) = 1, circle.at(rule.nodes, y)
        weight = slope * rule.weights
    else:
        rule = gauss(size).to(co.device)
        pieces = []
        for low, high, steepness in _pieces(profile, circle, tangent, y, kappa, error):
            *at, slope = circle.at(low + (high - low) * rule.nodes, steepness)
            pieces.append((*at, slope * (high - low) * rule.weights * (1 if two else 2)))
        panels, (cos_t, sin_t, cos_from_wo, weight) = len(pieces), (torch.cat(v, 1) for v in zip(*pieces, strict=True))
    wx, wy = widths
    x, y = wx * cos_t, wy * sin_t
    norm2 = x.square() + y.square()
    norm = torch.sqrt(norm2)
    x, y = x / norm, y / norm
    width = torch.rsqrt((x / wx).square() + (y / wy).square())
    return Rays(x, y, circle.tau * cos_from_wo / norm, width, weight * wx * wy / norm2, rule, panels)


def _pieces(
    profile: Profile, circle: Circle, tangent: Tensor, y: Tensor, kappa: Tensor, error: float
) -> list[tuple[Tensor, Tensor, Tensor]]:
    """The pieces of the circle on which a lobe with kinks is smooth: both ends (R, 1) and the map's Y."""
    start, quarter = torch.zeros_like(y), torch.full_like(y, math.pi / 2)
    if profile.kink == "grooves":  # the kinks change places where T cos phi = 1
        split = torch.acos((torch.asinh(torch.sinh(y) / tangent.clamp(min=1.0)) / y).clamp(max=1.0))
        return [(start, split, y), (split, 2 * quarter, y)]
    # The kink is within the lobe where T d.u is below the square of its width: a strip of the width's fourth power
    layer = circle.across.square()
    needed = layer.square() > 0.01 * error * circle.tau.clamp(min=IDENTITY)
    fine = circle.steepness(torch.where(needed, torch.minimum(kappa, layer), kappa))
    pieces = [(start, quarter, fine), (quarter, 2 * quarter, y)]
    if circle.two:
        pieces += [(2 * quarter, 3 * quarter, y), (3 * quarter, 4 * quarter, fine)]
    return pieces
