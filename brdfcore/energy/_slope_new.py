"""Integrals of half-vector lobes over the disc of slopes, along rays from the lobe's centre.

    a(wo) = integral of f cos theta_i dwi,   dwi = 4 (h.wo) hz^3 r dr dphi                                  [1]

The half vectors whose wi lies above the horizon have the slopes (p, q) of a disc of centre (T, 0) and radius
sqrt(1 + T^2), T = tan theta_o, the first axis along wo's azimuth. On the ray of azimuth phi against wo's, with
s = T cos phi, everything lies in one plane and the disc ends at R = s + sqrt(1 + s^2):

    cos theta_i = co hz^2 (R - r) (r + 1/R),   h.wo = co hz (1 + (R - r)/R + r R) / 2,   hz = 1/sqrt(1 + r^2)

as products and sums of positive numbers, so nothing is lost towards the horizon. Every kink is a point of the ray:
cos theta_i = cos theta_o at r = s, Cook and Torrance's grooves at r = 1/s and at r = tan((atan s + pi/2)/3). Nodes on
the ray are Gauss and Legendre's in u, r = sinh(u) / steepness, with the ends smoothed where a lobe needs it (lobes.py).
The rays' angles: grading.py. Departure from the usual slope-disc quadrature in Cartesian slopes: it needs about ten
times as many nodes, and cannot follow kinks and narrow anisotropic lobes.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor

from ..geometry import FLOOR, Geometry
from ..models import Model
from ..parameters import Values
from .grading import Rays, rays
from .lobes import PROFILES, Profile, anisotropic, slope_widths
from .refinement import Integral, Rows, Sums, take
from .rules import LADDER, Rule, Tail, gauss


class _Nodes(NamedTuple):
    """Nodes (R, M, P n): slope r, rest R - r of the ray, and d r d phi."""

    r: Tensor
    rest: Tensor
    weight: Tensor


class SlopeDisc(Integral):
    """The integrals over the disc for a lobe with a profile."""

    last = (LADDER.index(2048), LADDER.index(320))

    def __init__(self, model: Model, place: Values, rows: Rows, error: float) -> None:
        super().__init__(model, place, rows, error)
        self.profile = PROFILES[model.name]
        self.two = anisotropic(model)
        self.pieces = {"none": 1, "equal": 2, "grooves": 3}[self.profile.kink]  # into which kinks part a ray
        self.pilot = LADDER.index(8 if self.pieces == 1 else 6), LADDER.index(8)

    def count(self, outer: int, inner: int) -> int:
        """The number of nodes that a row takes."""
        if self.pieces == 1:
            return (2 * outer if self.two else outer + 1) * inner
        return (4 if self.two else 2) * self.pieces * outer * inner

    def sums(self, own: Values, chosen: Tensor, outer: int, inner: int) -> Sums:
        """The integrals of the chosen rows for values (R or 1, 1 or C), which may be differentiated."""
        rows = self.rows.take(chosen)
        with torch.no_grad():
            widths = slope_widths(self.model, take(self.place, chosen))
            found = rays(self.profile, *rows, widths, self.two, outer, self.error)
            rule = gauss(inner).to(rows.co.device)
            nodes, radius, whole = self._nodes(found, rule)
            geometry, weight = _geometry(self.model, rows, found, nodes, radius)
        bases = self.model.basis({name: value[:, None, None] for name, value in take(own, chosen).items()}, geometry)
        parts = torch.stack([basis * weight for basis in torch.broadcast_tensors(*bases)], dim=1)
        along = parts.sum(3)
        detached = parts.detach()
        outer_tail = found.rule.tail(along.detach().unflatten(2, (found.panels, -1)))
        inner_tail = rule.tail(detached.sum(2).unflatten(2, (self.pieces, inner)))
        return Sums(
            along.sum(2),
            detached.abs().sum((2, 3)),
            _over_pieces(outer_tail),
            _over_pieces(inner_tail),
            torch.where(whole, 0.0, 10 * self.error)[:, None, None],
        )

    def _reach(self, width: Tensor) -> Tensor:
        """The slope beyond which the lobe is negligible."""
        fall, log = self.profile.fall, -math.log(self.error)
        if fall == "gaussian":
            return math.sqrt(log) * width
        if fall == "power":  # at least like r^-1 where the power itself hardly falls
            return torch.sqrt(torch.expm1((log / (1 / width.square() + 0.5)).clamp(max=60.0)))
        if fall == "algebraic":  # towards grazing, f cos theta_i dwi falls only like 1/r
            return width / self.error
        return torch.full_like(width, self.error**-0.5)

    def _nodes(self, found: Rays, rule: Rule) -> tuple[_Nodes, Tensor, Tensor]:
        """The nodes of each ray, the ray's end R, and whether all rays of a row have nodes to their end."""
        s, profile = found.s, self.profile
        hypotenuse = torch.sqrt(1 + s.square())
        radius = torch.where(s > 0, s.clamp(min=0) + hypotenuse, 1 / (hypotenuse - s.clamp(max=0)))
        reach = self._reach(found.width)
        top, cut = torch.minimum(radius, reach), (radius < reach)[..., None]
        edges = [torch.zeros_like(top), *(torch.minimum(kink, top) for kink in self._kinks(s, radius)), top]
        steepness = torch.ones_like(s)
        if profile.fall == "algebraic":
            steepness = torch.sqrt(1 + found.width.reciprocal().square())
        parts = []
        for index, (low, high) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
            m, rest, slope = rule.nodes, rule.rest, torch.ones_like(rule.nodes)
            if profile.end > 1 and index == len(edges) - 2:
                m = torch.where(cut, 1 - rest**profile.end, m)
                slope = torch.where(cut, profile.end * rest ** (profile.end - 1), slope)
                rest = torch.where(cut, rest**profile.end, rest)
            low_u, high_u = (torch.asinh(edge * steepness)[..., None] for edge in (low, high))
            span = high_u - low_u
            if profile.start:  # u is quadratic in m, from where the feature is below it
                e = torch.sqrt((steepness / s.clamp(min=1e-30))[..., None] / span.clamp(min=1e-30)).clamp(max=1e8)
                slope = slope * 2 * (e + m) / (1 + 2 * e)
                m, rest = m * (2 * e + m) / (1 + 2 * e), rest * (1 + 2 * e + m) / (1 + 2 * e)
            u, over = low_u + span * m, 1 / steepness[..., None]
            left = 2 * torch.cosh(0.5 * (high_u + u)) * torch.sinh(0.5 * span * rest)
            parts.append(
                (torch.sinh(u) * over, (radius - high)[..., None] + left * over, torch.cosh(u) * over * span * slope)
            )
        r, rest, slope = (torch.cat(v, -1) for v in zip(*parts, strict=True))
        return _Nodes(r, rest, slope * found.weight[..., None] * torch.cat([rule.weights] * self.pieces)), radius, cut.all(1).squeeze(-1)

    def _kinks(self, s: Tensor, radius: Tensor) -> list[Tensor]:
        """The slopes at which the lobe has a kink, ascending; one beyond the end counts as the end."""
        if self.profile.kink == "equal":
            return [s.clamp(min=0)]
        if self.profile.kink == "grooves":
            shallow = s < 1
            first = torch.where(shallow, torch.tan((torch.atan(s) + math.pi / 2) / 3), 1 / s.clamp(min=1))
            return [first, torch.where(shallow, radius, s)]
        return []


def _geometry(model: Model, rows: Rows, found: Rays, nodes: _Nodes, radius: Tensor) -> tuple[Geometry, Tensor]:
    """What the model reads at the nodes, and cos theta_i dwi there, each (R, M, P n, 1)."""
    co = rows.co[:, None, None, None]
    sine = torch.sqrt((1 - co) * (1 + co))
    xo, yo = (sine * v[:, None, None, None] for v in (torch.cos(rows.azimuth), torch.sin(rows.azimuth)))
    x, y, radius = found.x[..., None, None], found.y[..., None, None], radius[..., None, None]
    r, rest, weight = (v[..., None] for v in nodes)
    e2 = r.square()
    hz = torch.rsqrt(1 + e2)
    floor = FLOOR[torch.float64]
    ci = (co * hz.square() * rest * (r + 1 / radius)).clamp(min=floor)
    h_dot_wo = (0.5 * co * hz * (1 + rest / radius + r * radius)).clamp(min=floor)
    quantities = {
        "ci": lambda: ci,
        "co": lambda: co.expand_as(ci),
        "over_ci": lambda: ci.reciprocal(),
        "over_co": lambda: co.reciprocal().expand_as(ci),
        "over_hz": lambda: 0.5 / (h_dot_wo * hz),
        "p": lambda: r * x,
        "q": lambda: r * y,
        "e2": lambda: e2,
        "ux": lambda: r * hz * x,
        "uy": lambda: r * hz * y,
        "uz": lambda: hz,
        "h_dot_wo": lambda: h_dot_wo,
        "over_h_dot_wo": lambda: h_dot_wo.reciprocal(),
        "xi": lambda: 2 * h_dot_wo * (r * hz * x) - xo,
        "yi": lambda: 2 * h_dot_wo * (r * hz * y) - yo,
        "xo": lambda: xo.expand_as(ci),
        "yo": lambda: yo.expand_as(ci),
    }
    geometry = Geometry(above=torch.ones_like(ci, dtype=torch.bool), **{name: quantities[name]() for name in model.needs})
    return geometry, 4 * h_dot_wo * (hz.square() * hz) * r * ci * weight


def _over_pieces(tail: Tail) -> Tail:
    """The tail of a sum over pieces, (R, K, P, C) to (R, K, C)."""
    return tail._replace(early=tail.early.sum(2), late=tail.late.sum(2))
