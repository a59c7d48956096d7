"""The albedo of an isotropic `ward_neumann` in one dimension: its integral over an arc of one slope is elementary.

With r the half vector's slope, k = 1/(1 + r^2), T = tan theta_o and c the cosine of the azimuth against wo's, f cos
theta_i dwi is

    E co k^2 (1 + T r c) min(1, k (1 - r^2 + 2 T r c)) r dr dphi / (pi a^2)                                  [1]

which is 0 up to c = sinh(log r) / T, where wi is at the horizon, and from c = r / T on, where cos theta_i is
cos theta_o, its last factor is 1. With alpha = asin c, the product of the brackets has the integral

    K(alpha) = (1 - r^2) alpha - T r (3 - r^2) cos alpha + (T r)^2 (alpha - sin alpha cos alpha)

in which nothing cancels towards grazing, where all arcs of the second kind are short. What both ends of these arcs add
is integrated by itself, so each integrand has its own square roots only, and at ends of an interval: nodes are drawn
quadratically to both. They lie in asinh r, and in log r where the horizon cuts.
Source: our own.
"""

import math

import torch
from torch import Tensor

from ..models import Model
from ..parameters import Values
from .refinement import Integral, Rows, Sums, take
from .rules import LADDER, gauss

PIECES = 4  # both ends of the arcs, each on either side of the slope at which it changes its kind
TINY = 1e-300  # stands for a T of 0 where it divides: the arcs that would need it are empty


class Arcs(Integral):
    """The integral for an isotropic `ward_neumann`."""

    last = (len(LADDER) - 1, LADDER.index(1024))

    def __init__(self, model: Model, place: Values, rows: Rows, error: float) -> None:
        super().__init__(model, place, rows, error)
        self.reach = math.sqrt(-math.log(0.1 * error))  # of the lobe, in widths: the arcs grow with the slope

    def guess(self, digits: float) -> tuple[float, float]:
        """About the sizes that leave an error of 10^-digits."""
        return 1.0, 2.5 * digits

    def count(self, outer: int, inner: int) -> int:
        """The number of arcs that a row takes."""
        return PIECES * inner

    def sums(self, own: Values, chosen: Tensor, outer: int, inner: int) -> Sums:
        """The integral for the chosen rows and values (R or 1, 1), which may be differentiated."""
        co = self.rows.co[chosen, None]
        rule = gauss(inner).to(co.device)
        with torch.no_grad():
            tangent = torch.sqrt((1 - co) * (1 + co)) / co
            far = self.reach * take(self.place, chosen)["a"]
            horizon = torch.asinh(tangent)  # log r of the last slope, and the first that it cuts has the opposite one
            top = torch.minimum(torch.exp(horizon), far)
            u_top, first = torch.asinh(top), torch.minimum(torch.exp(-horizon), top)
            level = torch.minimum(torch.asinh(torch.minimum(tangent, top)), u_top)
            lowest = torch.log(first)
            place = rule.nodes * rule.nodes * (1 + 2 * rule.rest)
            step = 6 * rule.nodes * rule.rest * rule.weights

            def between(low: Tensor, high: Tensor) -> tuple[Tensor, Tensor]:
                return low + (high - low) * place, (high - low) * step

            zero = torch.zeros_like(u_top)
            below, d_below = between(zero, level)  # the upper end of an arc is where the cosines are equal
            beyond, d_beyond = between(level, u_top)  # it is towards wo
            whole, d_whole = between(zero, torch.asinh(first))  # the lower end is away from wo
            cut, d_cut = between(lowest, torch.log(top))  # it is at the horizon
            u = torch.cat([below, beyond, whole], 1)
            r = torch.cat([torch.sinh(u), torch.exp(cut)], 1)
            weight = torch.cat([d_below, d_beyond, d_whole], 1) * torch.cosh(u)
            weight = torch.cat([weight, d_cut * torch.exp(cut)], 1)
            count = len(rule.nodes)
            one = torch.ones_like(below)
            sine = (r[:, :count] / tangent.clamp(min=TINY)).clamp(max=1.0)
            at_horizon = (torch.sinh(cut) / tangent.clamp(min=TINY)).clamp(-1.0, 1.0)
            sines = torch.cat([sine, one, -one, at_horizon], 1)
            alpha, cosine = torch.asin(sines), torch.sqrt((1 - sines) * (1 + sines))
            k, along, r2 = 1 / (1 + r * r), tangent * r, r * r
            arc = k * ((1 - r2) * alpha - along * (3 - r2) * cosine + along.square() * (alpha - sines * cosine))
            arc[:, 2 * count :] *= -1
            arc[:, :count] += torch.acos(sine) + along[:, :count] * cosine[:, :count]
            arc = arc * (2 / math.pi * co * k.square() * r * weight)
        a2 = take(own, chosen)["a"].square()
        parts = arc * torch.exp(-r2 / a2) / a2
        total = parts.sum(1)[:, None, None]
        parts = parts.detach()
        tail = rule.tail(parts.reshape(len(parts), 1, PIECES, inner, 1))
        tail = tail._replace(early=tail.early.sum(2), late=tail.late.sum(2))
        neglected = torch.where(far < torch.exp(horizon), self.error, 0.0)
        return Sums(total, parts.abs().sum(1)[:, None, None], None, tail, neglected[..., None])
