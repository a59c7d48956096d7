"""The albedos of `lafortune` and `edwards` in one dimension, in coordinates of the lobe itself.

Lafortune: with r = (cx xo, cy yo, zo), c = zo / |r| the cosine of the lobe's axis, the power of a cosine about r is
integrated over its azimuth and then by parts:

    a = ks |r|^n (c + (1 - c^2)^(n/2+1) / pi integral of y^2/(y^2 + c^2) (1 + y^2)^(-n/2-1) dy over [0, inf))    [1]

c is what the lobe would reflect if nothing of it lay below the horizon; the rest is what does not. Nodes: y = c sinh u.

Edwards: f cos theta_i dwi is the lump's own measure on the viewer's disk, so the albedo is the part of the lump in the
unit circle about (sin theta_o, 0). In the lump's polar coordinates the integral over the radius is

    a = ks / (2 pi) integral of 1 - max(1 - rho^2, 0)^(n+1) dt over the circle                                   [1]

with rho(t) where the ray of angle t leaves that circle. The rays are graded as in grading.py.
"""

import math

import torch
from torch import Tensor

from ..models import Model
from ..parameters import Values
from .grading import Circle
from .lobes import Profile
from .refinement import NODES, Integral, Rows, Sums, take
from .rules import LADDER, gauss

ARCS = 2  # an ellipse and a circle meet at most four times
SCAN = 256  # angles at which the circle is looked for in the lump
SECTIONS, ROUNDS = 16, 12  # into so many parts, so often, an interval with a root is divided
LARGEST = 690.0  # of log |r|^n: beyond it the lobe's own numbers overflow, and no accuracy is claimed


class PowerCosine(Integral):
    """The integral for a `lafortune`."""

    last = (len(LADDER) - 1, LADDER.index(512))

    def guess(self, digits: float) -> tuple[float, float]:
        """About the sizes that leave an error of 10^-digits."""
        return 1.0, 2 * digits

    def count(self, outer: int, inner: int) -> int:
        """The number of nodes that a row takes."""
        return inner

    def sums(self, own: Values, chosen: Tensor, outer: int, inner: int) -> Sums:
        """The integral for the chosen rows and values (R or 1, 1), which may be differentiated."""
        co, toward = (v[:, None] for v in self.rows.take(chosen))
        own, place, rule = take(own, chosen), take(self.place, chosen), gauss(inner).to(co.device)
        x2, y2 = ((torch.sqrt((1 - co) * (1 + co)) * turn(toward)).square() for turn in (torch.cos, torch.sin))
        with torch.no_grad():
            c = co / torch.sqrt(co.square() + place["cx"].square() * x2 + place["cy"].square() * y2)
            end = torch.sqrt(torch.expm1((-math.log(self.error) / (0.5 * place["n"] + 0.5)).clamp(max=60.0)))
            span = torch.asinh(end / c)
            u = span * rule.nodes
            y2s, weight = (c * torch.sinh(u)).square(), c * torch.cosh(u) * span * rule.weights
        cx, cy, n = own["cx"], own["cy"], own["n"]
        along2 = cx.square() * x2 + cy.square() * y2  # |r|^2 - co^2
        longer = (cx - 1) * (cx + 1) * x2 + (cy - 1) * (cy + 1) * y2  # |r|^2 - 1
        near = longer > -0.5
        length2 = torch.where(near, 1 + longer, along2 + co.square())
        log_length2 = torch.where(near, torch.log1p(torch.where(near, longer, 0.0)), torch.log(length2))
        c2 = co.square() / length2
        log_power = 0.5 * n * log_length2
        beyond = log_power > LARGEST
        power = torch.exp(torch.where(beyond, LARGEST, log_power))
        below = along2 / length2  # 1 - c^2; its power is left out where it is 0, at normal incidence
        tilted = below > 0
        sine = torch.where(tilted, torch.exp((0.5 * n + 1) * torch.log(torch.where(tilted, below, 1.0))), 0.0)
        parts = torch.exp(-(0.5 * n + 1) * torch.log1p(y2s)) * (y2s / (y2s + c2)) * weight
        total = power * (torch.sqrt(c2) + sine / math.pi * parts.sum(1, keepdim=True))
        share = (power * sine / math.pi).detach()
        bases = total[..., None]
        scale = torch.where(beyond, torch.inf, total.detach())[..., None]
        whole, axis = total.detach(), (power * torch.sqrt(c2)).detach()
        lit = whole > 0  # a power may underflow
        neglected = self.error * torch.where(lit, 1 - axis / torch.where(lit, whole, 1.0), 1.0)[..., None]
        return Sums(bases, scale, None, rule.tail((share * parts.detach())[:, None, :, None]), neglected)


class Lump(Integral):
    """The integral for an `edwards`."""

    last = (len(LADDER) - 1, LADDER.index(1024))

    def __init__(self, model: Model, place: Values, rows: Rows, error: float) -> None:
        super().__init__(model, place, rows, error)
        everything = torch.arange(len(rows.co), device=rows.co.device).split(NODES // SCAN)
        with torch.no_grad():
            ends = [_Rim(take(self.place, part), rows.take(part)).arcs() for part in everything]
        self.start, self.end = (torch.cat(v) for v in zip(*ends, strict=True))

    def guess(self, digits: float) -> tuple[float, float]:
        """About the sizes that leave an error of 10^-digits."""
        return 1.0, 2.5 * digits

    def count(self, outer: int, inner: int) -> int:
        """The number of rays that a row takes."""
        return ARCS * inner

    def sums(self, own: Values, chosen: Tensor, outer: int, inner: int) -> Sums:
        """The integral for the chosen rows and values (R or 1, 1), which may be differentiated."""
        rule, own = gauss(inner).to(self.start.device), take(own, chosen)
        with torch.no_grad():
            rim = _Rim(take(self.place, chosen), self.rows.take(chosen))
            start, length = self.start[chosen, :, None], (self.end - self.start)[chosen, :, None]
            m = rule.nodes
            w = (start + length * (m * m * (3 - 2 * m))).flatten(1)  # the power that ends an arc need not be whole
            x, y, radius, slope = rim.at(w)
            weight = (length * (6 * m * rule.rest * rule.weights)).flatten(1) * slope / (2 * math.pi)
            weight = weight * rim.rx * rim.ry * ((x / rim.rx).square() + (y / rim.ry).square())
        inside = (radius * x / own["rx"]).square() + (radius * y / own["ry"]).square()
        outside = inside >= 1
        cut = torch.where(outside, 0.0, torch.exp((own["n"] + 1) * torch.log1p(-torch.where(outside, 0.0, inside))))
        # dt by the angle of a ray that stays where it is
        parts = cut * weight / (own["rx"] * own["ry"] * ((x / own["rx"]).square() + (y / own["ry"]).square()))
        total = (1 - parts.sum(1))[:, None, None]
        tail = rule.tail(parts.detach().reshape(len(parts), 1, ARCS, inner, 1))
        tail = tail._replace(early=tail.early.sum(2), late=tail.late.sum(2))
        return Sums(total, torch.ones_like(total), None, tail, torch.zeros_like(total))


class _Rim:
    """The circle about (sin theta_o, 0) on the viewer's disk, seen from the lump's centre at grading.py's angles w."""

    def __init__(self, own: Values, rows: Rows) -> None:
        self.co, self.rx, self.ry = rows.co[:, None], own["rx"], own["ry"]
        width = self.co * torch.sqrt(own["n"])
        self.circle = Circle(Profile("gaussian"), rows, (self.rx / width, self.ry / width), True, 0.0)
        self.everyone = torch.arange(len(rows.co), device=rows.co.device)

    def at(self, w: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """The ray's direction on the disk, its length to the rim, and dt/dw."""
        cosine, sine, from_wo, slope = self.circle.at(self.everyone, w, self.circle.steepness)
        x, y = self.circle.wx * cosine, self.circle.wy * sine
        norm = torch.hypot(x, y)
        s = self.circle.tau * from_wo / norm
        hypotenuse = torch.sqrt(1 + s.square())
        radius = torch.where(s > 0, s.clamp(min=0) + hypotenuse, 1 / (hypotenuse - s.clamp(max=0)))
        return x / norm, y / norm, self.co * radius, slope

    def excess(self, w: Tensor) -> Tensor:
        """How far the lump's rim is beyond the circle, positive where the circle cuts the lump."""
        x, y, radius, _ = self.at(w)
        return 1 - (radius * x / self.rx).square() - (radius * y / self.ry).square()

    def arcs(self) -> tuple[Tensor, Tensor]:
        """The ends w of the arcs on which the circle cuts the lump, (R, ARCS), empty ones of no length."""
        step = 2 * math.pi / SCAN
        index = torch.arange(SCAN, device=self.co.device)
        excess = self.excess(index.to(torch.float64) * step)
        least = excess.argmin(1, keepdim=True)  # towards wo no circle cuts the lump, so it is met from there
        index = least + torch.arange(SCAN + 1, device=self.co.device)
        w, cut = index.to(torch.float64) * step, excess.gather(1, index % SCAN) > 0
        changes, order = torch.sort((cut[:, 1:] != cut[:, :-1]).to(torch.int8), dim=1, descending=True, stable=True)
        first, exists = order[:, : 2 * ARCS], changes[:, : 2 * ARCS] > 0
        low, high = w.gather(1, first), w.gather(1, first + 1)
        rising = cut.gather(1, first + 1)[..., None]
        parts = torch.arange(1, SECTIONS, dtype=torch.float64, device=w.device) / SECTIONS
        for _ in range(ROUNDS):
            inside = low[..., None] + (high - low)[..., None] * parts
            before = ((self.excess(inside.flatten(1)) > 0).view_as(inside) != rising).sum(-1)
            low, high = low + (high - low) * before / SECTIONS, low + (high - low) * (before + 1) / SECTIONS
        root = torch.where(exists, 0.5 * (low + high), w[:, -1:])
        start, end = root[:, 0::2], root[:, 1::2]
        everywhere = cut[:, :1] & (torch.arange(ARCS, device=w.device) == 0)
        return torch.where(everywhere, w[:, :1], start), torch.where(everywhere, w[:, -1:], end)
