"""Integrals of half-vector lobes over the disc of slopes, along rays from the lobe's centre.

    a(wo) = integral of f cos theta_i dwi,   dwi = 4 (h.wo) hz^3 r dr dphi                                  [1]

The half vectors whose wi lies above the horizon have the slopes (p, q) of a disc of centre (T, 0) and radius
sqrt(1 + T^2), T = tan theta_o, the first axis along wo's azimuth. On the ray of azimuth phi against wo's, with
s = T cos phi, everything lies in one plane and the disc ends at R = s + sqrt(1 + s^2):

    cos theta_i = co hz^2 (R - r) (r + 1/R),   h.wo = co hz (1 + (R - r)/R + r R) / 2,   hz = 1/sqrt(1 + r^2)

as products and sums of positive numbers, so nothing is lost towards the horizon. Every kink is a point of the ray:
cos theta_i = cos theta_o at r = s, Cook and Torrance's grooves at r = 1/s and at r = tan((atan s + pi/2)/3). Nodes on
the segments between are Gauss and Legendre's in u, r = sinh(u) / steepness, with the ends smoothed where a lobe needs
it (lobes.py). The rays' angles: grading.py. Departure from slope-disc quadrature in Cartesian slopes: that needs about
ten times as many nodes, and follows neither kinks nor narrow anisotropic lobes.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor

from ..geometry import FLOOR, Geometry
from ..models import Model
from ..parameters import Values
from .grading import Circle, Rays
from .lobes import PROFILES, anisotropic, slope_widths
from .refinement import Integral, Rows, Sums, take
from .rules import LADDER, Rule, Tail, gauss


class _Nodes(NamedTuple):
    """Nodes (S, n) on the S segments of rays that are not empty."""

    row: Tensor  # (S,) of the segment
    ray: Tensor  # (S,)
    piece: Tensor  # (S,)
    r: Tensor  # slope
    rest: Tensor  # R - r
    weight: Tensor  # dr dphi, and of the rules
    end: Tensor  # R, (S, 1)


class SlopeDisc(Integral):
    """The integrals over the disc for a lobe with a profile."""

    last = (LADDER.index(2048), LADDER.index(320))

    def __init__(self, model: Model, place: Values, rows: Rows, error: float) -> None:
        super().__init__(model, place, rows, error)
        self.profile = PROFILES[model.name]
        self.two = anisotropic(model)
        self.pieces = {"none": 1, "equal": 2, "grooves": 3}[self.profile.kink]  # into which kinks part a ray
        with torch.no_grad():
            self.circle = Circle(self.profile, rows, slope_widths(model, self.place), self.two, error)

    def guess(self, digits: float) -> tuple[Tensor, float]:
        """About the sizes that leave an error of 10^-digits."""
        profile, share = self.profile, digits / 7
        steepness = self.circle.steepness.squeeze(1)
        if profile.kink == "none":
            rays = (12 if self.two else 4) * share + 22 * share**1.3 * ((steepness - 0.7) / 2.3).clamp(0, 1)
        else:
            rays = share * (5 + self.circle.fine.squeeze(1) + 8 * ((steepness - 0.3) / 3).clamp(0, 1))
        inner = 3.0 if profile.fall == "algebraic" else 2.3 if profile.start else 1.8
        return rays, inner * digits

    def count(self, outer: int, inner: int) -> int:
        """The number of nodes that a row takes, about: with kinks, those on half of the rays' segments count twice."""
        if self.pieces == 1:
            return (2 * outer if self.two else outer + 1) * inner
        return (6 if self.two else 3) * outer * inner

    def sums(self, own: Values, chosen: Tensor, outer: int, inner: int) -> Sums:
        """The integrals of the chosen rows for values (R or 1, 1 or C), which may be differentiated."""
        rows, own = self.rows.take(chosen), take(own, chosen)
        with torch.no_grad():
            rays = self.circle.rays(chosen, outer)
            rule = gauss(inner).to(rows.co.device)
            nodes, whole = self._nodes(rays, rule)
            geometry, weight = _geometry(self.model, rows, rays, nodes)
            own_rows = nodes.row
        bases = self.model.basis({name: value[:, None] for name, value in take(own, own_rows).items()}, geometry)
        parts = torch.stack([basis * weight for basis in torch.broadcast_tensors(*bases)], dim=1)  # (S, K, n, C)
        count, rays_count = rays.s.shape
        at = nodes.row * rays_count + nodes.ray
        shape = (parts.shape[1], parts.shape[3])
        along = parts.new_zeros(count * rays_count, *shape).index_add(0, at, parts.sum(2))
        along = along.unflatten(0, (count, rays_count))  # (R, M, K, C)
        with torch.no_grad():
            detached = parts.detach()
            scale = detached.new_zeros(count, *shape).index_add(0, nodes.row, detached.abs().sum(2))
            across = detached.new_zeros(count * self.pieces, *detached.shape[1:])
            across.index_add_(0, nodes.row * self.pieces + nodes.piece, detached)
            across = across.unflatten(0, (count, self.pieces)).transpose(1, 2)  # (R, K, P, n, C)
            around = along.detach().permute(0, 2, 1, 3).unflatten(2, (rays.panels, -1))
            first, second = (_over_pieces(r.tail(p)) for r, p in ((rays.rule, around), (rule, across)))
        neglected = torch.where(whole, 0.0, 10 * self.error)[:, None, None]
        return Sums(along.sum(1), scale, first, second, neglected)

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

    def _kinks(self, s: Tensor, end: Tensor) -> list[Tensor]:
        """The slopes at which the lobe has a kink, ascending; one beyond the end counts as the end."""
        if self.profile.kink == "equal":
            return [s.clamp(min=0)]
        if self.profile.kink == "grooves":
            shallow = s < 1
            first = torch.where(shallow, torch.tan((torch.atan(s) + math.pi / 2) / 3), 1 / s.clamp(min=1))
            return [first, torch.where(shallow, end, s)]
        return []

    def _nodes(self, rays: Rays, rule: Rule) -> tuple[_Nodes, Tensor]:
        """The nodes, and whether those of each row fill the disc, (R,)."""
        s, profile = rays.s, self.profile
        hypotenuse = torch.sqrt(1 + s.square())
        end = torch.where(s > 0, s.clamp(min=0) + hypotenuse, 1 / (hypotenuse - s.clamp(max=0)))
        reach = self._reach(rays.width)
        top, cut = torch.minimum(end, reach), end < reach
        edges = torch.stack([torch.zeros_like(top), *(torch.minimum(k, top) for k in self._kinks(s, end)), top], -1)
        low, high = edges[..., :-1], edges[..., 1:]
        row, ray, piece = torch.nonzero(high > low, as_tuple=True)
        at = row, ray
        low, high, end_, s_, cut_ = (v[..., None] for v in (low[*at, piece], high[*at, piece], end[at], s[at], cut[at]))
        steepness = torch.ones_like(s_)
        if profile.fall == "algebraic":
            steepness = torch.sqrt(1 + rays.width[at][:, None].reciprocal().square())
        m, rest, slope = rule.nodes, rule.rest, rule.weights
        if profile.end > 1:
            cut_ = cut_ & (piece == self.pieces - 1)[:, None]
            m = torch.where(cut_, 1 - rest**profile.end, m)
            slope = torch.where(cut_, profile.end * rest ** (profile.end - 1), 1.0) * slope
            rest = torch.where(cut_, rest**profile.end, rest)
        low_u, high_u = torch.asinh(low * steepness), torch.asinh(high * steepness)
        span = high_u - low_u
        if profile.start:  # u is quadratic in m, from where the feature is below it
            e = torch.sqrt(steepness / (s_.clamp(min=1e-30) * span)).clamp(max=1e8)
            scale = 1 / (1 + 2 * e)
            slope = slope * (2 * scale * (e + m))
            m, rest = m * (2 * e + m) * scale, rest * (1 + 2 * e + m) * scale
        u, over = low_u + span * m, 1 / steepness
        left = (2 * over) * torch.cosh(0.5 * (high_u + u)) * torch.sinh((0.5 * span) * rest)
        weight = torch.cosh(u) * slope * (over * span * rays.weight[at][:, None])
        return _Nodes(row, ray, piece, torch.sinh(u) * over, (end_ - high) + left, weight, end_), cut.all(1)


def _over_pieces(tail: Tail) -> Tail:
    """The tail of a sum over pieces, (R, K, P, C) to (R, K, C)."""
    return tail._replace(early=tail.early.sum(2), late=tail.late.sum(2))


def _geometry(model: Model, rows: Rows, rays: Rays, nodes: _Nodes) -> tuple[Geometry, Tensor]:
    """What the model reads at the nodes, and cos theta_i dwi there, each (S, n, 1)."""
    at = nodes.row, nodes.ray
    x, y, co = (v[:, None, None] for v in (rays.x[at], rays.y[at], rows.co[nodes.row]))
    r, rest, weight, end = (v[..., None] for v in (nodes.r, nodes.rest, nodes.weight, nodes.end))
    e2 = r.square()
    hz2 = 1 / (1 + e2)
    hz = torch.sqrt(hz2)
    floor = FLOOR[torch.float64]
    over_end = 1 / end
    ci = (co * (rest * (r + over_end)) * hz2).clamp(min=floor)
    h_dot_wo = (co * (0.5 + rest * (0.5 * over_end) + r * (0.5 * end)) * hz).clamp(min=floor)

    def of_wo(turn: Tensor) -> Tensor:
        return (torch.sqrt((1 - rows.co) * (1 + rows.co)) * turn)[nodes.row, None, None]

    quantities = {
        "ci": lambda: ci,
        "co": lambda: co.expand_as(ci),
        "over_ci": lambda: ci.reciprocal(),
        "over_co": lambda: co.reciprocal().expand_as(ci),
        "over_hz": lambda: 0.5 / (h_dot_wo * hz),
        "p": lambda: r * x,
        "q": lambda: r * y,
        "e2": lambda: e2,
        "ux": lambda: (r * hz) * x,
        "uy": lambda: (r * hz) * y,
        "uz": lambda: hz,
        "h_dot_wo": lambda: h_dot_wo,
        "over_h_dot_wo": lambda: h_dot_wo.reciprocal(),
        "xi": lambda: (2 * h_dot_wo * r * hz) * x - of_wo(torch.cos(rows.azimuth)),
        "yi": lambda: (2 * h_dot_wo * r * hz) * y - of_wo(torch.sin(rows.azimuth)),
        "xo": lambda: of_wo(torch.cos(rows.azimuth)).expand_as(ci),
        "yo": lambda: of_wo(torch.sin(rows.azimuth)).expand_as(ci),
    }
    geometry = Geometry(
        above=torch.ones_like(ci, dtype=torch.bool), **{name: quantities[name]() for name in model.needs}
    )
    return geometry, h_dot_wo * ci * (hz2 * hz) * (r * weight * 4)
