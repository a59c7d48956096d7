"""The table of the energy that isotropic microfacet lobes lose: `python -m brdfcore.energy.lost_energy` writes it.

    G(co) = integral of P(p, q) (1 + p tan theta_o) (1 / (1 + L(wo)) - [wi above the horizon] G2(wi, wo)) dp dq    [1]

P is the density of slopes, p along wo's azimuth; without masking the normals fill wo's projection, so that 1 - E needs
no difference of nearly equal numbers. The half vectors whose wi is above the horizon are the slopes in the disc of
centre (tan theta_o, 0) and radius 1/cos theta_o. There, with p = T - sec cos 2 psi, q = sec sin 2 psi sin eta, nothing
is singular at the rim; Gauss-Legendre panels shrink towards the lobe's centre, the rim next to it, and the slope that
mirrors wo to the normal. Outside of the disc an integral over rays is left. Accurate to 5e-6
(tests/models/test_compensation.py).
"""

import math
import pathlib
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor

from ..models import MODELS, _compensation
from ..models._smith import SmithLobe

COSINES, WIDTHS = 64, 60  # coefficients
MASKINGS = ("correlated", "separable")
NEGLIGIBLE = 1e-11  # of the fall towards the normal: beyond, the spline goes on as it is
LEAST = 1e-3  # of a coefficient


def _panels(edges: Tensor, nodes: int) -> tuple[Tensor, Tensor]:
    """Gauss-Legendre nodes and weights of the intervals between the edges on the last axis."""
    x, w = (torch.from_numpy(v) for v in np.polynomial.legendre.leggauss(nodes))
    low, half = edges[..., :-1, None], edges.diff()[..., None] / 2
    return (low + half * (1 + x)).flatten(-2), (half * w).flatten(-2)


def _masking(name: str, tangent: Tensor) -> Tensor:
    """L [1] of a tan theta."""
    if name == "ggx":
        return tangent.square() / (1 + torch.sqrt(1 + tangent.square())) / 2
    v = 1 / tangent.clamp(min=0.15)  # below, L < 1e-20
    hidden = torch.exp(-v.square()) / (2 * v * math.sqrt(math.pi)) - torch.erfc(v) / 2
    return torch.where(tangent > 0.15, hidden, 0.0)


def _beyond(name: str, r: Tensor, slant: Tensor) -> Tensor:
    """The integral of pi P (1 + slant t) t dt over t > r for unit widths, over pi times 2 (the ray's angle)."""
    if name == "ggx":
        near = 1 / (1 + r.square())
        far = r * near + torch.atan2(torch.ones_like(r), r)
    else:
        near = torch.exp(-r.square())
        far = r * near + math.sqrt(math.pi) / 2 * torch.erfc(r)
    return (near + slant * far) / (2 * math.pi)


def _outside(name: str, a: float, tangent: float, nodes: int) -> float:
    """The integral of P (1 + p tangent) over the visible slopes outside of the disc."""
    steps = (3.0 ** torch.arange(-3, 40, dtype=torch.float64) / max(tangent, 1e-9)).clamp(max=math.pi / 2).unique()
    angle, weight = _panels(math.pi / 2 + torch.cat([-steps.flip(0), steps.new_zeros(1), steps]), nodes)
    slant = tangent * torch.cos(angle)
    root = torch.sqrt(slant.square() + 1)
    rim = torch.where(slant > 0, slant + root, 1 / (root - slant.clamp(max=0)))
    last = 1 / (-slant).clamp(min=1e-150)  # where a facet is seen edge-on
    hidden = torch.where(slant < 0, _beyond(name, last / a, a * slant), 0.0)
    return float(2 * (weight * (_beyond(name, rim / a, a * slant) - hidden)).sum())


def lost(name: str, a: float, mu: float, nodes: int = 9, ratio: float = 3.0) -> tuple[float, float]:
    """G [1] of a width a and a cosine mu, for correlated and for separable masking."""
    sine = math.sqrt((1 - mu) * (1 + mu))
    tangent, secant = sine / mu, 1 / mu
    left, right, mirror = -1 / (tangent + secant), tangent + secant, sine / (1 + mu)
    reach = 1e6 * a
    edges = {left, right, 0.0, mirror}
    for centre, first in ((0.0, a / 3), (left, -left / 3), (mirror, 0.3 / a)):
        steps = [first * ratio**k for k in range(24) if first * ratio**k < max(reach, 10 * first)]
        edges |= {centre + sign * step for step in steps for sign in (-1, 1)}
    kept = [left]
    for edge in sorted(edge for edge in edges if left < edge <= right):
        if edge - kept[-1] > 1e-3 * min(a, 1 / a, -left):
            kept.append(edge)
    inside = torch.tensor(kept, dtype=torch.float64)
    turns = torch.asin(torch.sqrt(((inside - left) / (2 * secant)).clamp(0, 1)))
    turns[-1] = math.pi / 2
    psi, d_psi = _panels(turns, nodes)
    p, half = left + 2 * secant * torch.sin(psi).square(), secant * torch.sin(2 * psi)
    aside = [step for k in range(16) if (step := min(a, 0.3 / a) / 3 * ratio**k) < reach]
    eta, d_eta = _panels(torch.asin((torch.tensor([0, *aside, math.inf]) / half[:, None]).clamp(max=1).double()), nodes)
    psi, p, half, d_psi = (v[:, None] for v in (psi, p, half, d_psi))
    e2 = p.square() + (half * torch.sin(eta)).square()
    cos_i = ((torch.sin(2 * psi) * torch.cos(eta)).square() * secant / (1 + e2)).clamp(1e-150, 1)
    hidden_i = _masking(name, a * torch.sqrt((1 - cos_i) * (1 + cos_i)) / cos_i)
    hidden_o = _masking(name, torch.tensor(a * tangent, dtype=torch.float64))
    spread = e2 / a**2
    density = (torch.exp(-spread) if name == "beckmann" else (1 + spread).square().reciprocal()) / (math.pi * a * a)
    weight = 4 * density * (1 + p * tangent) * half.square() * torch.cos(eta) * d_psi * d_eta
    common = weight * hidden_i / (1 + hidden_o)
    outside = _outside(name, a, tangent, nodes) / float(1 + hidden_o)
    return outside + float((common / (1 + hidden_i + hidden_o)).sum()), outside + float((common / (1 + hidden_i)).sum())


def _sites(count: int) -> Tensor:
    """Where a spline of so many coefficients is interpolated, in [0, 1]: its knots, and a middle next to either end."""
    cells = count - 3
    return torch.cat([torch.arange(cells + 1.0), torch.tensor([0.5, cells - 0.5])]).sort().values.double() / cells


def _collocation(places: Tensor, count: int) -> Tensor:
    """The B-splines' values (places, count)."""
    t = places * (count - 3)
    first = t.floor().clamp(max=count - 4)
    columns = first.long()[:, None] + torch.arange(4)
    return torch.zeros(len(places), count, dtype=torch.float64).scatter(1, columns, _compensation.b_splines(t - first))


def width_at(y: float) -> float:
    """The width a [1] at a place of the table."""
    low, high = math.log(_compensation.LOW), math.log(_compensation.HIGH)
    for _ in range(60):
        middle = (low + high) / 2
        at = float(_compensation.along(torch.tensor(middle, dtype=torch.float64).exp()))
        low, high = (middle, high) if at < y else (low, middle)
    return math.exp((low + high) / 2)


def cosine_at(x: float, a: float) -> float:
    """The cosine mu [1] at a place of the table of a width."""
    low, high, width = math.log(1e-14), 0.0, torch.tensor(a, dtype=torch.float64)
    for _ in range(60):
        middle = (low + high) / 2
        at = float(_compensation.across(torch.tensor(middle, dtype=torch.float64).exp(), width))
        low, high = (middle, high) if at < x else (low, middle)
    return math.exp((low + high) / 2)


def tables(name: str) -> dict[str, Any]:
    """The coefficients of a model's two tables, float32 (widths, cosines), by the names that they are stored under."""
    lobes = [cast(SmithLobe, MODELS[name](("isotropic", word))) for word in MASKINGS]
    x, y = _sites(COSINES), _sites(WIDTHS)
    x[0] = 0.1 / COSINES  # at the horizon itself the quotient of two zeros would be tabulated
    found = torch.zeros(2, WIDTHS, COSINES, dtype=torch.float64)
    for i, a in enumerate(width_at(float(place)) for place in y):
        for j, mu in enumerate(cosine_at(float(place), a) for place in x):
            at = torch.tensor(mu, dtype=torch.float64), torch.tensor(a, dtype=torch.float64)
            energies = lost(name, a, mu)
            for k, lobe in enumerate(lobes):
                fades = float(lobe.fading(*at)) > NEGLIGIBLE
                found[k, i, j] = energies[k] / float(lobe.lost_factor(*at)) if fades else found[k, i, j - 1]
    inverse_x, inverse_y = (torch.linalg.inv(_collocation(v, len(v))) for v in (x, y))
    fitted = (inverse_y @ found @ inverse_x.T).clamp(min=LEAST)
    return {f"{name}_{word}": c.float().numpy() for word, c in zip(MASKINGS, fitted, strict=True)}


def main() -> None:
    """Write the file of the package; takes about two minutes."""
    stored = {key: table for name in ("ggx", "beckmann") for key, table in tables(name).items()}
    np.savez_compressed(pathlib.Path(__file__).parents[1] / "data" / _compensation.FILE, **stored)


if __name__ == "__main__":
    main()
