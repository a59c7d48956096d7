"""Integrals of half-vector lobes over the disc of slopes, along rays from the lobe's centre.

Provisional: fixed Gauss-Legendre levels.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from ..geometry import FLOOR, Geometry
from ..models import Model
from ..parameters import Values

GAUSS, POWER, ALGEBRAIC, WIDE = "gauss", "power", "algebraic", "wide"


class Rows(NamedTuple):
    """The angles of one integral each, (R,)."""

    co: Tensor
    azimuth: Tensor


def shape_of(model: Model, own: Values, co: Tensor) -> tuple[Tensor, Tensor, str]:
    """The widths of the lobe in slopes, (R, 1) or (1, 1), and the kind of its tail."""
    one = torch.ones_like(co)[:, None]
    if model.name == "edwards":
        n = torch.sqrt(own["n"] + 1)
        return own["rx"] / co[:, None] / n, own["ry"] / co[:, None] / n, GAUSS
    names = getattr(model, "width_names", None)
    if names is None:
        return one, one, WIDE
    wx, wy = own[names[0]], own[names[-1]]
    if model.widths_along[0] == "n":  # type: ignore[attr-defined]
        return torch.sqrt(2 / wx), torch.sqrt(2 / wy), POWER
    return wx, wy, ALGEBRAIC if model.name == "ggx" else GAUSS


@functools.cache
def _gauss_legendre(n: int) -> tuple[Tensor, Tensor]:
    x, w = np.polynomial.legendre.leggauss(n)
    return torch.tensor((x + 1) / 2), torch.tensor(w / 2)


def _sinh_ratio(x: Tensor) -> Tensor:
    small = x < 1e-8
    return torch.where(small, 1.0, torch.sinh(x) / torch.where(small, 1.0, x))


def integrals(model: Model, own: Values, rows: Rows, outer: int, inner: int) -> Tensor:
    """The albedo of each basis, (R, K, 1 or C), with `outer` rays a panel and `inner` nodes a piece of a ray."""
    with torch.no_grad():
        geometry, weight = _nodes(model, {k: v.detach() for k, v in own.items()}, rows, outer, inner)
    bases = model.basis({k: v[:, None, None] for k, v in own.items()}, geometry)
    return torch.stack([(b * weight).sum((1, 2)) for b in torch.broadcast_tensors(*bases)], dim=1)


def _nodes(model: Model, own: Values, rows: Rows, outer: int, inner: int) -> tuple[Geometry, Tensor]:
    co, azimuth = rows.co[:, None], rows.azimuth[:, None]
    si = torch.sqrt((1 - co) * (1 + co))
    tangent = si / co
    wx, wy, tail = shape_of(model, own, rows.co)
    cx, cy = wx.clamp(max=1.0), wy.clamp(max=1.0)
    c0, s0 = torch.cos(azimuth), torch.sin(azimuth)
    reach = torch.sqrt((cx * c0).square() + (cy * s0).square())
    x, w = _gauss_legendre(outer)
    w_nodes = torch.cat([(x + k) * (math.pi / 2) for k in range(4)])
    w_weights = torch.cat([w * (math.pi / 2)] * 4)
    big = torch.asinh(tangent * reach).clamp(min=1e-9)
    y = big * torch.cos(w_nodes)
    s2, c2 = torch.sin(w_nodes / 2).square(), torch.cos(w_nodes / 2).square()
    root = torch.sqrt(_sinh_ratio(2 * big * s2) * _sinh_ratio(2 * big * c2))
    cosine = torch.sinh(y) / torch.sinh(big)
    sine = torch.sin(w_nodes) / _sinh_ratio(big) * root
    ct, st = (cx * c0 * cosine - cy * s0 * sine) / reach, (cy * s0 * cosine + cx * c0 * sine) / reach
    dx, dy = cx * ct, cy * st
    norm = torch.sqrt(dx.square() + dy.square())
    s = tangent * reach * cosine / norm
    turn = torch.cosh(y) / root * cx * cy / norm.square() * w_weights
    dx, dy = dx / norm, dy / norm
    d = 1 / torch.sqrt((dx / wx).square() + (dy / wy).square())
    mu = torch.atan2(torch.ones_like(s), s)
    horizon = (math.pi - mu) / 2
    if tail == GAUSS:
        reached = torch.atan(6.2 * d)
    elif tail == POWER:
        reached = torch.acos(torch.exp(-0.5 * (6.2 * d).square()))
    else:
        reached = torch.full_like(d, 2.0)
    top = torch.minimum(horizon, reached)
    cut = (horizon < reached)[..., None]
    x, w = _gauss_legendre(inner)
    lows, highs = [torch.zeros_like(top)], []
    for at in ((math.pi / 2 - mu), (math.pi - mu) / 3, mu):
        highs.append(torch.minimum(torch.maximum(at, lows[-1]), top))
        lows.append(highs[-1])
    highs.append(top)
    thetas, etas, jacobians = [], [], []
    for index, (low, high) in enumerate(zip(lows, highs, strict=True)):
        last = index == len(lows) - 1
        m, mc, dm = x.expand(*top.shape, -1), (1 - x).expand(*top.shape, -1), torch.ones_like(x)
        if last:
            m, mc, dm = (
                torch.where(cut, 1 - (1 - x) ** 4, m),
                torch.where(cut, (1 - x) ** 4, mc),
                torch.where(cut, 4 * (1 - x) ** 3, dm),
            )
        start = 2 * s.clamp(min=0)
        if tail == ALGEBRAIC:
            start = torch.sqrt(start.square() + (2 / d).square())
        grade = torch.asinh((high - low) * start).clamp(min=1e-6)[..., None]
        dm = dm * grade * torch.cosh(grade * m) / torch.sinh(grade)
        mc = 2 * torch.cosh(grade * (1 + m) / 2) * torch.sinh(grade * mc / 2) / torch.sinh(grade)
        m = torch.sinh(grade * m) / torch.sinh(grade)
        length = (high - low)[..., None]
        thetas.append(low[..., None] + length * m)
        etas.append((horizon - high)[..., None] + length * mc)
        jacobians.append(length * dm * w)
    theta, eta, jacobian = torch.cat(thetas, -1), torch.cat(etas, -1), torch.cat(jacobians, -1)
    s, mu, horizon, dx, dy = (v[..., None] for v in (s, mu, horizon, dx, dy))
    plane = co[..., None] * torch.sqrt(1 + s.square())
    floor = FLOOR[torch.float64]
    h_dot_wo = plane * torch.sin(torch.minimum(horizon + eta, theta + mu)).clamp(min=floor)
    ci = (plane * torch.sin(torch.minimum(2 * eta, 2 * theta + mu))).clamp(min=floor)
    ux, uy, uz, r = torch.sin(theta) * dx, torch.sin(theta) * dy, torch.cos(theta), torch.tan(theta)
    xo, yo = ((si * v)[..., None].expand_as(ci) for v in (c0, s0))
    quantities = {
        "ci": ci,
        "co": co[..., None].expand_as(ci),
        "over_ci": 1 / ci,
        "over_co": 1 / co[..., None].expand_as(ci),
        "over_hz": 0.5 / (h_dot_wo * uz),
        "p": r * dx,
        "q": r * dy,
        "e2": r.square(),
        "ux": ux,
        "uy": uy,
        "uz": uz,
        "h_dot_wo": h_dot_wo,
        "over_h_dot_wo": 1 / h_dot_wo,
        "xo": xo,
        "yo": yo,
        "xi": 2 * h_dot_wo * ux - xo,
        "yi": 2 * h_dot_wo * uy - yo,
    }
    geometry = Geometry(above=ci[..., None] > 0, **{k: v[..., None] for k, v in quantities.items() if k in model.needs})
    weight = 4 * h_dot_wo * torch.sin(theta) * ci * jacobian * turn[..., None]
    return geometry, weight[..., None]
