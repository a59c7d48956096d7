"""Edwards's halfway-vector disk, in its energy-conserving form with a lump of finite extent.

    f(wi, wo) = ks L co^2 / (4 ci (h.wo) hz^3)                                              [1/sr]
    L = (n+1) / (pi rx ry) max(1 - (sx/rx)^2 - (sy/ry)^2, 0)^n,  (sx, sy) = co (p, q)

The half vector, scaled to the height of wo, ends at (sx, sy, co): for every wi above the horizon within the unit disk
around the end of wo. The lump L lies at that plane's centre, where h is the normal, and integrates to 1.

ks, specular reflectance [1]; rx, ry, the lump's radii along x and y on the disk [1] (`ry=edwards.rx` ties them for an
isotropic lobe); n, exponent of the lump's fall to its rim [1].
Box: ks in [0, 1]; rx, ry in [1e-4, 1]; n in [1, 1e6].
Not reciprocal: the disk is the viewer's. The directional albedo is at most ks: ks at normal incidence, where the disk
holds the whole lump, and for a narrow one ks/2 at grazing, where the horizon halves it. Every sample weighs ks.
Source: Edwards, Boulos, Johnson, Shirley, Ashikhmin, Stark and Wyman 2006, "The halfway vector disk for BRDF modeling",
ACM Transactions on Graphics 25(1). Departure: none; 4 (h.wo) hz^3 is 2 Hz / (1 + e2), so that nothing is lost at the
horizon.
"""

import math

import torch
from torch import Tensor

from ..geometry import FLOOR, Geometry, reflect
from ..parameters import Parameter, Values
from ._scaled_lobe import ScaledLobe


class Edwards(ScaledLobe):
    """A lump on the disk that the half vectors above the horizon project to."""

    name = "edwards"
    good_for = "Highlights that end at a clear rim; changes when light and viewer swap places."
    reciprocal = False
    lobe_needs = ("p", "q", "e2", "co", "over_ci", "over_hz")
    pdf_needs = frozenset(lobe_needs) - {"over_ci"}
    shape = (
        Parameter("rx", 0.5, 1e-4, 1.0, "radius of the lump along x [1]", search=(0.02, 1.0), scale="log"),
        Parameter("ry", 0.5, 1e-4, 1.0, "radius of the lump along y [1]", search=(0.02, 1.0), scale="log"),
        Parameter("n", 10.0, 1.0, 1e6, "exponent of the lump [1]", search=(1.0, 1e3), scale="log"),
    )

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks = 1 [1/sr], (..., 1)."""
        return self._lump_times(g.over_ci, values, g)

    def pdf(self, values: Values, g: Geometry) -> Tensor:
        """L co^2 / (4 (h.wo) hz^3) [1/sr], (..., 1)."""
        return self._lump_times(torch.ones_like(g.co), values, g)

    def _lump_times(self, over: Tensor, values: Values, g: Geometry) -> Tensor:
        """The product over L co^2 (1 + e2) / (2 Hz), (..., 1)."""
        rx, ry, n = values["rx"], values["ry"], values["n"]
        sx, sy = g.co * g.p, g.co * g.q
        outside = (sx / rx).square() + (sy / ry).square() >= 1
        sx, sy = torch.where(outside, 0.0, sx), torch.where(outside, 0.0, sy)
        fall = torch.exp(n * torch.log1p(-(sx / rx).square() - (sy / ry).square()))
        lump = (n + 1) / (2 * math.pi) / rx / ry * fall
        over = over * (g.co * g.over_hz) * (g.co * (1 + g.e2))
        # A narrow lump at grazing angles, or its derivatives, overflow in float32. Near that it has no gradient, since
        # sums of overflowing derivatives would be NaN, and it stops at the largest number.
        largest = torch.finfo(lump.dtype).max
        limit = 2.0**-20 * largest / (lump * n / torch.minimum(rx, ry)).detach()
        beyond = (lump.detach() * over.detach()).clamp(max=largest)
        return torch.where(outside, 0.0, torch.where(over < limit, lump * torch.minimum(over, limit), beyond))

    def sample(self, values: Values, wo: Tensor, u: Tensor) -> Tensor:
        """Directions wi (..., 3); one below the horizon is part of the density's lost share and weighs 0."""
        radius2 = -torch.expm1(torch.log1p(-u[..., :1]) / (values["n"] + 1))
        radius = torch.sqrt(radius2.clamp(min=torch.finfo(u.dtype).tiny))  # the root of 0 has no derivative
        t = 2 * math.pi * u[..., 1:]
        across = radius / wo[..., 2:].clamp(min=FLOOR[wo.dtype])
        return reflect(wo, values["rx"] * across * torch.cos(t), values["ry"] * across * torch.sin(t))
