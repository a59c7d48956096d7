"""Rays from the lobe's centre over the disc of slopes, dense where the integrals along them change quickly.

In slopes divided by the lobe's widths, p = wx rho cos t, q = wy rho sin t, a ray has the angle t. Towards grazing the
integral along it changes where T d.u passes through 0, d = (wx cos t, wy sin t) and u towards wo's azimuth: there the
horizon begins to cut the lobe. T d.u = tau cos(t - t1), so that the angles of nodes are taken from

    cos(t - t1) = sinh(Y cos w) / sinh Y,   Y = asinh(tau / kappa)

with w equally spaced: T d.u = kappa sinh(Y cos w) goes through every order of magnitude from kappa to tau. The map is
analytic and periodic, and the identity for Y = 0. A long and narrow lobe has a second such place, its narrow axis: then
two maps follow each other. The masking of a long and narrow lobe with a tail has two more, which a third map meets by
a sum of densities (Dense). A lobe with kinks is integrated over pieces of the circle on which it is smooth.
"""

import math
from typing import NamedTuple

import torch
from torch import Tensor

from .lobes import Profile
from .refinement import Rows
from .rules import Rule, gauss, ring

HORIZON = 0.1  # T d.u at which the horizon is still beyond exp(-25) of a Gaussian lobe; at 0.3 beyond exp(-2.8)
ALGEBRAIC_HORIZON = 0.01  # the same for a lobe whose tail is longer
NEGLIGIBLE_LAYER = 100  # times the error that may be neglected
IDENTITY = 1e-9  # a Y for which the map is the identity to rounding
SHARE, SCALES, FACTOR = 0.08, 5, 3.5  # of each kernel of a dense map, how many there are, and how their widths grow
FINEST, WIDEST = 1e-3, 1.0  # widths of kernels
POINTS, STEPS = 129, 3  # about each place, between which a map is inverted, and steps of Newton's method from there
LOPSIDED = 0.3  # a ratio of widths below which a Smith lobe's masking has features at the horizon
SLIGHT = 1e5  # times the error that may be neglected: what a tail is worth whose features need not be met
# an error that may be neglected from which on fewer rays pay for a map, where masking is correlated and where not: at
# 2e-9 and 1e-5 of tolerance
PRECISE, PRECISE_SEPARABLE = 2e-13, 1e-9


class Rays(NamedTuple):
    """The rays of each row (R, M): where they point, and what they weigh."""

    x: Tensor  # the direction of the slopes
    y: Tensor
    s: Tensor  # T cos phi, phi the azimuth against wo's
    width: Tensor  # of the lobe along the ray [1]
    weight: Tensor  # d phi, and of the rule
    rule: Rule
    panels: int  # the rule is applied to so many pieces of the circle


def graded(w: Tensor, y: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Cosine and sine of the angle D with cos D = sinh(y cos w) / sinh y, and dD/dw; nothing cancels."""
    inner = y * torch.cos(w)
    root = torch.sqrt(_sinh_ratio(2 * y * torch.sin(w / 2).square()) * _sinh_ratio(2 * y * torch.cos(w / 2).square()))
    return torch.sinh(inner) / torch.sinh(y), torch.sin(w) * (root / _sinh_ratio(y)), torch.cosh(inner) / root


class Dense(NamedTuple):
    """A map v -> w of the circle onto itself that is dense at some angles.

    v is proportional to w + share sum over places a and widths d of 2 atan(coth(d/2) tan((w - a)/2)), the integral of
    Poisson's kernel sinh d / (cosh d - cos(w - a)): of widths in proportion the sum falls like 1/|w - a|.
    """

    share: Tensor  # of each kernel beside the identity, (R, 1); 0 for rows that need none
    place: Tensor  # (R, K)
    width: Tensor  # (R, K)

    def before(self, w: Tensor) -> tuple[Tensor, Tensor]:
        """The v of w (R, M) and dv/dw."""
        ahead, slope = torch.zeros_like(w), torch.zeros_like(w)  # of the identity
        for place, level in zip(self.place.split(1, 1), torch.tanh(0.5 * self.width).split(1, 1), strict=True):
            sine = torch.sin(0.5 * (w - place))
            sine2, double = sine.square(), sine * torch.cos(0.5 * (w - place))
            ahead = ahead + 2 * torch.atan((1 - level) * double / (level + (1 - level) * sine2))
            slope = slope + level / (level.square() + (1 - level) * (1 + level) * sine2)
        whole = 1 + self.share * self.place.shape[1]
        return w + self.share / whole * ahead, (1 + self.share * slope) / whole

    def at(self, v: Tensor) -> tuple[Tensor, Tensor]:
        """The w of v (1, M), up to turns, and dw/dv."""
        finest = self.width[:, ::SCALES, None]
        spread = torch.linspace(-1, 1, POINTS, dtype=v.dtype, device=v.device) * torch.asinh(math.pi / finest)
        points = (self.place[:, ::SCALES, None] + finest * torch.sinh(spread)).flatten(1)
        points = torch.remainder(points, 2 * math.pi).sort(1).values
        points = torch.cat([points, points[:, :1] + 2 * math.pi], 1)
        known = self.before(points)[0]
        v = known[:, :1] + torch.remainder(v - known[:, :1], 2 * math.pi)
        at = torch.searchsorted(known, v.contiguous(), right=True).clamp(1, known.shape[1] - 1)
        (low, high), (start, end) = ((x.gather(1, at - 1), x.gather(1, at)) for x in (known, points))
        w = start + (end - start) * ((v - low) / (high - low).clamp(min=1e-30)).clamp(0, 1)
        for _ in range(STEPS):
            found, slope = self.before(w)
            w = w + (v - found) / slope
        return w, 1 / self.before(w)[1]


def _sinh_ratio(x: Tensor) -> Tensor:
    """sinh(x) / x for x >= 0."""
    small = x < 1e-8
    return torch.where(small, 1.0, torch.sinh(x) / torch.where(small, 1.0, x))


class Circle:
    """The circle of rays for each row, for a lobe of the given widths (R, 1) or (1, 1); `two`, if they differ.

    Kinks count where they matter more than `error` of the whole; `separable`: so is the lobe's masking of wi and wo.
    """

    def __init__(
        self,
        profile: Profile,
        rows: Rows,
        widths: tuple[Tensor, Tensor],
        two: bool,
        error: float,
        *,
        separable: bool = False,
    ) -> None:
        self.profile, self.two = profile, two
        co, toward = rows.co[:, None], rows.azimuth[:, None]
        self.tangent = torch.sqrt((1 - co) * (1 + co)) / co
        self.wx, self.wy = (width.expand_as(co) for width in widths)
        cosine, sine = torch.cos(toward), torch.sin(toward)
        reach = torch.sqrt((self.wx * cosine).square() + (self.wy * sine).square())  # of the lobe towards wo
        self.tau = self.tangent * reach
        self.cos1, self.sin1 = self.wx * cosine / reach, self.wy * sine / reach
        stretch = torch.ones_like(self.tau)
        if two:
            stretch = self._set_narrow_axis()
        across = self.wx * self.wy / reach  # the lobe's width where T d.u is 0
        kappa = across.clamp(min=ALGEBRAIC_HORIZON if profile.fall == "algebraic" else HORIZON)
        self.steepness = self.fine = torch.asinh(self.tau * stretch / kappa).clamp(min=IDENTITY)
        if profile.kink == "equal":
            # The kink is within the lobe where T d.u is below the square of its width, a strip as narrow as that; there
            # the lobe differs by that square from what it would be without.
            layer = across.square()
            kept = layer.square() > NEGLIGIBLE_LAYER * error * self.tau
            finest = torch.where(kept, torch.minimum(kappa, layer), kappa)
            self.fine = torch.asinh(self.tau * stretch / finest).clamp(min=IDENTITY)
        pays = error <= (PRECISE_SEPARABLE if separable else PRECISE)
        self.dense = (
            self._dense(rows, error) if pays and two and profile.smith and profile.fall == "algebraic" else None
        )

    def _dense(self, rows: Rows, error: float) -> Dense | None:
        """The map that is dense where wi, at the horizon, lies along the narrow axis; None where no row needs it.

        There a Smith lobe's masking of wi, like the square root of (narrow x)^2 + (wide y)^2 + z^2 with y along the
        wide axis, has a kink at y = 0, rounded by narrow / wide. Its half vector's ray is the sum of wi and wo.
        """
        narrow, wide = torch.minimum(self.wx, self.wy), torch.maximum(self.wx, self.wy)
        needed = (narrow < LOPSIDED * wide) & (narrow.pow(3) / wide > SLIGHT * error)
        if not bool(needed.any()):
            return None
        everyone = torch.arange(len(needed), device=needed.device)
        sine = torch.sqrt((1 - rows.co) * (1 + rows.co))[:, None]
        xo, yo = sine * torch.cos(rows.azimuth)[:, None], sine * torch.sin(rows.azimuth)[:, None]
        place, width = [], []
        for side in (1.0, -1.0):
            x, y = torch.where(self.swapped, xo, xo + side), torch.where(self.swapped, yo + side, yo)
            w = self._before(x / self.wx, y / self.wy)
            *at, slope = self.at(everyone, w, self.steepness)
            turn = slope * self.wx * self.wy / ((self.wx * at[0]).square() + (self.wy * at[1]).square())
            along = side * torch.where(self.swapped, yo, xo)
            both = 1 + 2 * along + sine.square()  # of the sum of wi and wo, squared; 0 where they are opposite
            by_wi = torch.where(both > 0, (1 + along) / both, math.inf)  # d phi of h by that of wi
            finest = (by_wi * narrow / wide / turn).clamp(FINEST, WIDEST)
            for k in range(SCALES):
                place.append(w)
                width.append((finest * FACTOR**k).clamp(max=WIDEST))
        return Dense(SHARE * needed.double(), torch.cat(place, 1), torch.cat(width, 1))

    def _before(self, x: Tensor, y: Tensor) -> Tensor:
        """The angle w, before both maps, of the ray with cos t, sin t in proportion to x and y, (R, 1)."""

        def ungraded(cosine: Tensor, sine: Tensor, steepness: Tensor) -> Tensor:
            level = torch.asinh(cosine * torch.sinh(steepness)) / steepness
            return torch.acos(level.clamp(-1, 1)) * torch.where(sine < 0, -1.0, 1.0)

        norm = torch.hypot(x, y)
        x, norm = torch.where(norm > 0, x, 1.0), torch.where(norm > 0, norm, 1.0)  # any ray: that map is even there
        cosine, sine = torch.where(self.swapped, x, y) / norm, torch.where(self.swapped, y, -x) / norm
        inner = ungraded(cosine, sine, self.first) - self.start
        return ungraded(torch.cos(inner), torch.sin(inner), self.steepness)

    def _set_narrow_axis(self) -> Tensor:
        """Set the first map, which is dense at the narrow axis, and return its slope where T d.u = 0."""
        narrow, wide = torch.minimum(self.wx, self.wy), torch.maximum(self.wx, self.wy)
        # In the angle t the lobe's own fall is even. What is not changes within a strip about the narrow axis, whose
        # width is the map's scale. Azimuths, by which tails and kinks act, turn within narrow / wide. Smith's masking
        # follows azimuths more finely, by 1 / wide, where slopes exceed 1; without a tail it is as good as even where
        # they do not. What other lobes have left are powers of 1 + r^2, which change within 1 / wide, or within
        # narrow / wide where every slope exceeds 1.
        ratio, beyond = narrow / wide, 1 / wide.clamp(min=1.0)
        if self.profile.fall == "algebraic":
            scale = ratio * beyond
        elif self.profile.kink != "none":
            scale = ratio
        elif self.profile.smith:
            scale = torch.where(beyond < 1, ratio * beyond, 1.0)
        else:
            scale = torch.maximum(ratio, beyond)
        self.first = torch.where(scale < 1, torch.asinh(1 / scale), IDENTITY)
        self.swapped = self.wx > self.wy
        # the angle u before the first map at which T d.u = 0, that is t = t1 + pi/2
        cosine = torch.where(self.swapped, -self.sin1, self.cos1)
        level = torch.acos((torch.asinh(cosine * torch.sinh(self.first)) / self.first).clamp(-1, 1))
        level = torch.where(torch.where(self.swapped, self.cos1, self.sin1) < 0, -level, level)
        self.start = level - math.pi / 2
        return graded(level, self.first)[2]

    def at(self, chosen: Tensor, w: Tensor, steepness: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Cos t, sin t, cos(t - t1) and dt/dw of the chosen rows."""
        cosine, sine, slope = graded(w, steepness)
        cos1, sin1 = self.cos1[chosen], self.sin1[chosen]
        if not self.two:
            return cosine * cos1 - sine * sin1, cosine * sin1 + sine * cos1, cosine, slope
        cosine, sine, further = graded(self.start[chosen] + torch.atan2(sine, cosine), self.first[chosen])
        swapped = self.swapped[chosen]
        cosine, sine = torch.where(swapped, cosine, -sine), torch.where(swapped, sine, cosine)
        return cosine, sine, cosine * cos1 + sine * sin1, slope * further

    def rays(self, chosen: Tensor, size: int) -> Rays:
        """The rays of the chosen rows.

        A smooth lobe has 2 `size` rays round the circle, of which those of an isotropic one stand for their mirror
        images; one with kinks has `size` rays on each piece of it.
        """
        if self.profile.kink == "none":
            rule, panels = ring(2 * size, mirrored=not self.two).to(self.tau.device), 1
            w, weight = rule.nodes, rule.weights
            if self.dense is not None:
                w, denser = Dense(*(part[chosen] for part in self.dense)).at(w[None])
                weight = weight * denser
            cos_t, sin_t, from_wo, slope = self.at(chosen, w, self.steepness[chosen])
            weight = slope * weight
        else:
            rule = gauss(size).to(self.tau.device)
            pieces = self._pieces(chosen)
            panels = len(pieces)
            low, high, steepness = (torch.cat(v, 1).repeat_interleave(size, 1) for v in zip(*pieces, strict=True))
            w = low + (high - low) * rule.nodes.repeat(panels)
            cos_t, sin_t, from_wo, slope = self.at(chosen, w, steepness)
            weight = slope * (high - low) * rule.weights.repeat(panels) * (1 if self.two else 2)
        wx, wy = self.wx[chosen], self.wy[chosen]
        x, y = wx * cos_t, wy * sin_t
        norm2 = x.square() + y.square()
        over = torch.rsqrt(norm2)
        x, y = x * over, y * over
        width = torch.rsqrt((x / wx).square() + (y / wy).square()) if self.two else wx.expand_as(x)
        return Rays(x, y, self.tau[chosen] * from_wo * over, width, weight * (wx * wy) / norm2, rule, panels)

    def _pieces(self, chosen: Tensor) -> list[tuple[Tensor, Tensor, Tensor]]:
        """The pieces of the circle on which a lobe with kinks is smooth: both ends and the map's Y, (R, 1) each."""
        y, fine = self.steepness[chosen], self.fine[chosen]
        quarters = [torch.full_like(y, k * math.pi / 2) for k in range(5)]
        if self.profile.kink == "grooves":  # the kinks change places where T cos phi = 1
            level = torch.asinh(torch.sinh(y) / self.tangent[chosen].clamp(min=1.0)) / y
            split = torch.acos(level.clamp(max=1.0))
            return [(quarters[0], split, y), (split, quarters[2], y)]
        pieces = list(zip(quarters[:-1], quarters[1:], (fine, y, y, fine), strict=True))
        return pieces if self.two else pieces[:2]
