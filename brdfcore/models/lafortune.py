"""Lafortune's generalised cosine lobe.

    f(wi, wo) = ks (n+2) / (2 pi) max(cx xi xo + cy yi yo + zi zo, 0)^n                     [1/sr]

ks, specular reflectance [1]; cx, cy, the lobe's factors along x and y [1] (cx = cy = -1 reflects like a mirror, above 0
it reflects back; `cy=lafortune.cx` ties them for an isotropic lobe); n, exponent [1]. cz = 1 fixes the scale.
Box: ks in [0, 1]; cx, cy in [-2, 2]; n in [1, 1e6].
Reciprocal. The directional albedo is at most ks where |cx|, |cy| <= 1. Beyond, it has no bound: where cx^2 xo^2 +
cy^2 yo^2 + zo^2 exceeds 1, the peak grows as its power n/2 (24 ks at cx = cy = -1.05, n = 100, 75 degrees).
Source: Lafortune, Foo, Torrance and Greenberg 1997, "Non-linear approximation of reflectance functions". Sampled by
(n+1)/(2 pi) (r.wi)^n about r = (cx xo, cy yo, zo) normalised; what falls below the horizon is lost.
Departure: normalised by (n+2)/(2 pi), that of the lobe of a mirror at normal incidence, so that ks is its albedo there.
"""

import math

import torch
from torch import Tensor

from ..geometry import FLOOR, Geometry
from ..parameters import Parameter, Values
from ._scaled_lobe import ScaledLobe

_EXPONENT = Parameter("n", 50.0, 1.0, 1e6, "exponent [1]", search=(1.0, 2e4), scale="log")


class Lafortune(ScaledLobe):
    """A power of a scaled scalar product."""

    name = "lafortune"
    good_for = "Highlights beside the mirror direction or back to the light; several match odd data."
    lobe_needs = ("xi", "yi", "ci", "xo", "yo", "co")
    pdf_needs = frozenset(lobe_needs)
    shape = (
        Parameter("cx", -1.0, -2.0, 2.0, "factor along x, -1 for a mirror [1]", search=(-1.2, 1.2)),
        Parameter("cy", -1.0, -2.0, 2.0, "factor along y, -1 for a mirror [1]", search=(-1.2, 1.2)),
        _EXPONENT,
    )

    def product(self, values: Values, g: Geometry) -> tuple[Tensor, Tensor]:
        """Where cx xi xo + cy yi yo + zi zo is lit, and its value there [1] (1 elsewhere), both (..., 1).

        In double precision, since n multiplies its roundings. What is so small that its reciprocal, times n, overflows
        counts as dark.
        """
        xi, yi, ci, xo, yo, co = (x.double() for x in (g.xi, g.yi, g.ci, g.xo, g.yo, g.co))
        product = values["cx"] * (xi * xo) + values["cy"] * (yi * yo) + ci * co
        lit = ~(product <= 2.0**24 * torch.finfo(g.ci.dtype).tiny)  # a NaN is not dark: it goes on as NaN
        return lit, torch.where(lit, product, 1.0)

    def lobe(self, values: Values, g: Geometry) -> Tensor:
        """The lobe for ks = 1 [1/sr], (..., 1)."""
        lit, product = self.product(values, g)
        n = values["n"]
        norm = (n + 2) / (2 * math.pi)
        exponent = (n * torch.log(product)).to(norm.dtype)
        # Where |cx| or |cy| exceeds 1 the power overflows. Near that it has no gradient, since sums of overflowing
        # derivatives would be NaN, and it stops at the largest number.
        largest = torch.finfo(exponent.dtype).max
        limit = math.log(largest) - 20 * math.log(2) - torch.log(n * norm).detach()
        beyond = (norm.detach() * torch.exp(exponent.detach())).clamp(max=largest)
        power = torch.where(exponent < limit, norm * torch.exp(torch.minimum(exponent, limit)), beyond)
        return torch.where(lit, power, 0.0)

    def pdf(self, values: Values, g: Geometry) -> Tensor:
        """(n+1)/(2 pi) (r.wi)^n [1/sr], (..., 1)."""
        lit, product = self.product(values, g)
        x, y, z = values["cx"] * g.xo.double(), values["cy"] * g.yo.double(), g.co.double()
        along = x.square() + y.square() + z.square()
        n = values["n"]
        power = torch.exp((n * torch.log(product / torch.sqrt(along))).to(n.dtype))
        return torch.where(lit, (n + 1) / (2 * math.pi) * power, 0.0)

    def sample(self, values: Values, wo: Tensor, u: Tensor) -> Tensor:
        """Directions wi (..., 3) about r; one below the horizon is part of the density's lost share and weighs 0."""
        z = wo[..., 2:].clamp(min=FLOOR[wo.dtype])
        r = torch.cat([values["cx"] * wo[..., :1], values["cy"] * wo[..., 1:2], z], dim=-1)
        x, y, z = (r / r.norm(dim=-1, keepdim=True)).split(1, dim=-1)
        log_cosine = torch.log1p(-u[..., :1]) / (values["n"] + 1)
        sine2 = -torch.expm1(2 * log_cosine)
        sine = torch.sqrt(sine2.clamp(min=torch.finfo(u.dtype).tiny))  # the root of 0 has no derivative
        t = 2 * math.pi * u[..., 1:]
        a, b, c = sine * torch.cos(t), sine * torch.sin(t), torch.exp(log_cosine)
        over = 1 / (1 + z)  # an orthonormal frame about r, whose z is positive (Frisvad 2012)
        return torch.cat(
            [
                a * (1 - x * x * over) - b * x * y * over + c * x,
                b * (1 - y * y * over) - a * x * y * over + c * y,
                c * z - a * x - b * y,
            ],
            dim=-1,
        )
