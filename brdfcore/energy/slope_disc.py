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
from ..models._smith import SmithLobe
from ..parameters import Values
from .grading import Circle, Rays
from .lobes import PROFILES, anisotropic, slope_widths
from .refinement import NODES, Integral, Rows, Sums, take
from .rules import LADDER, Rule, Tail, gauss

NARROW = 0.05  # a width below which nodes are drawn to a layer at the horizon
NEGLIGIBLE_LAYER = 10.0  # times the error that may be neglected


class _Segments(NamedTuple):
    """Segments of rays on which a lobe is smooth, and which are not empty."""

    row: Tensor  # (S,)
    ray: Tensor  # (S,)
    piece: Tensor  # (S,) which of the ray's pieces it is
    low: Tensor  # (S, 1) the slopes between which it lies
    high: Tensor  # (S, 1)
    end: Tensor  # (S, 1) R
    cut: Tensor  # (S, 1) whether it goes to the horizon
    s: Tensor  # (S, 1) T cos phi
    width: Tensor  # (S, 1) of the lobe
    weight: Tensor  # (S, 1) of the ray

    def part(self, some: slice) -> "_Segments":
        """Some of them."""
        return _Segments(*(v[some] for v in self))


class _Nodes(NamedTuple):
    """Nodes (S, n) on segments."""

    r: Tensor  # slope
    rest: Tensor  # R - r
    weight: Tensor  # dr dphi, and of the rules


class SlopeDisc(Integral):
    """The integrals over the disc for a lobe with a profile."""

    def __init__(self, model: Model, place: Values, rows: Rows, error: float) -> None:
        super().__init__(model, place, rows, error)
        self.profile = PROFILES[model.name]
        self.two = anisotropic(model)
        # Beckmann's masking is smooth, but not analytic, at wi = n: where a lobe is narrow and wide at once, to claim
        # 1e-12 takes 900 nodes on a ray, and more rays do not make up for fewer
        self.last = LADDER.index(2048), LADDER.index(1024)
        self.pieces = {"none": 1, "equal": 2, "grooves": 3}[self.profile.kink]  # into which kinks part a ray
        with torch.no_grad():
            separable = isinstance(model, SmithLobe) and not model.correlated
            widths = slope_widths(model, self.place)
            self.circle = Circle(self.profile, rows, widths, self.two, error, separable=separable)

    def guess(self, digits: float) -> tuple[Tensor, float]:
        """About the sizes that leave an error of 10^-digits."""
        profile, share = self.profile, digits / 7
        steepness = self.circle.steepness.squeeze(1)
        if profile.kink == "none":
            rays = (12 if self.two else 4) * share + 22 * share**1.3 * ((steepness - 0.7) / 2.3).clamp(0, 1)
        else:
            rays = share * (5.5 + 1.1 * self.circle.fine.squeeze(1) + 9 * ((steepness - 0.3) / 3).clamp(0, 1))
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
            segments, whole = self._segments(rays)
        count, around = rays.s.shape
        along, across, scale = [], rows.co.new_zeros(0), rows.co.new_zeros(0)
        for start in range(0, len(segments.row), NODES // inner):
            some = segments.part(slice(start, start + NODES // inner))
            with torch.no_grad():
                geometry, weight = _geometry(self.model, rows, rays, some, self._nodes(some, rule))
            bases = self.model.basis({k: v[:, None] for k, v in take(own, some.row).items()}, geometry)
            parts = torch.stack([basis * weight for basis in torch.broadcast_tensors(*bases)], dim=1)  # (S, K, n, C)
            along.append(parts.sum(2))
            parts = parts.detach()
            if start == 0:
                across = parts.new_zeros(count * self.pieces, *parts.shape[1:])
                scale = parts.new_zeros(count, *along[0].shape[1:])
            across.index_add_(0, some.row * self.pieces + some.piece, parts)
            scale.index_add_(0, some.row, parts.abs().sum(2))
        of_ray = scale.new_zeros(count * around, *scale.shape[1:])
        of_ray = of_ray.index_add(0, segments.row * around + segments.ray, torch.cat(along))
        of_ray = of_ray.unflatten(0, (count, around))  # (R, M, K, C)
        outer_tail = rays.rule.tail(of_ray.detach().permute(0, 2, 1, 3).unflatten(2, (rays.panels, -1)))
        inner_tail = rule.tail(across.unflatten(0, (count, self.pieces)).transpose(1, 2))
        neglected = torch.where(whole, 0.0, 10 * self.error)[:, None, None]
        return Sums(of_ray.sum(1), scale, _over_pieces(outer_tail), _over_pieces(inner_tail), neglected)

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

    def _segments(self, rays: Rays) -> tuple[_Segments, Tensor]:
        """The segments of the rays, and whether those of each row fill the disc, (R,)."""
        s = rays.s
        hypotenuse = torch.sqrt(1 + s.square())
        end = torch.where(s > 0, s.clamp(min=0) + hypotenuse, 1 / (hypotenuse - s.clamp(max=0)))
        reach = self._reach(rays.width)
        top, cut = torch.minimum(end, reach), end < reach
        edges = torch.stack([torch.zeros_like(top), *(torch.minimum(k, top) for k in self._kinks(s, end)), top], -1)
        low, high = edges[..., :-1], edges[..., 1:]
        row, ray, piece = torch.nonzero(high > low, as_tuple=True)
        at = row, ray
        last = piece == self.pieces - 1
        numbers = (low[*at, piece], high[*at, piece], end[at], cut[at] & last, s[at], rays.width[at], rays.weight[at])
        return _Segments(row, ray, piece, *(v[:, None] for v in numbers)), cut.all(1)

    def _nodes(self, segments: _Segments, rule: Rule) -> _Nodes:
        """The nodes on segments."""
        m, rest, slope = rule.nodes, rule.rest, rule.weights
        power, cut = self.profile.end, segments.cut
        if self.profile.layer:  # where it is narrow and matters
            cut = cut & (segments.width < NARROW) & (segments.width**3 > NEGLIGIBLE_LAYER * self.error)
        if power > 1:
            m = torch.where(cut, 1 - rest**power, m)
            slope = torch.where(cut, power * rest ** (power - 1), 1.0) * slope
            rest = torch.where(cut, rest**power, rest)
        steepness = torch.ones_like(segments.s)
        if self.profile.fall == "algebraic":
            steepness = torch.sqrt(1 + segments.width.reciprocal().square())
        low, high = torch.asinh(segments.low * steepness), torch.asinh(segments.high * steepness)
        span, over = high - low, 1 / steepness
        if self.profile.start:  # u is quadratic in m, from where the feature is below it
            e = torch.sqrt(steepness / (segments.s.clamp(min=1e-30) * span)).clamp(max=1e8)
            scale = 1 / (1 + 2 * e)
            slope = slope * (2 * scale * (e + m))
            m, rest = m * (2 * e + m) * scale, rest * (1 + 2 * e + m) * scale
        u = low + span * m
        left = (2 * over) * torch.cosh(0.5 * (high + u)) * torch.sinh((0.5 * span) * rest)
        weight = torch.cosh(u) * slope * (over * span * segments.weight)
        return _Nodes(torch.sinh(u) * over, (segments.end - segments.high) + left, weight)


def _over_pieces(tail: Tail) -> Tail:
    """The tail of a sum over pieces, (R, K, P, C) to (R, K, C)."""
    return tail._replace(early=tail.early.sum(2), late=tail.late.sum(2))


def _geometry(model: Model, rows: Rows, rays: Rays, segments: _Segments, nodes: _Nodes) -> tuple[Geometry, Tensor]:
    """What the model reads at the nodes, and cos theta_i dwi there, each (S, n, 1)."""
    at = segments.row, segments.ray
    x, y, co = (v[:, None, None] for v in (rays.x[at], rays.y[at], rows.co[segments.row]))
    r, rest, weight, end = (v[..., None] for v in (*nodes, segments.end))
    e2 = r.square()
    hz2 = 1 / (1 + e2)
    hz = torch.sqrt(hz2)
    floor = FLOOR[torch.float64]
    over_end = 1 / end
    ci = (co * (rest * (r + over_end)) * hz2).clamp(min=floor)
    h_dot_wo = (co * (0.5 + rest * (0.5 * over_end) + r * (0.5 * end)) * hz).clamp(min=floor)

    def of_wo(turn: Tensor) -> Tensor:
        return (torch.sqrt((1 - rows.co) * (1 + rows.co)) * turn)[segments.row, None, None]

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
