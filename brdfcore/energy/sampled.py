"""The albedo as the mean weight of a material's own samples, by random or by scrambled Sobol points.

    a = mean of f cos theta_i / pdf over wi = sample(wo, u)                                                   [1]

For comparison, and as a check that shares nothing with the quadrature. `monte_carlo` claims `SURE_RANDOM` standard
errors of the mean, `sobol` `SURE_SCRAMBLED` standard errors of the means of `SCRAMBLES` independent scrambles: each so
many that one in 1,000 is larger, where weights are bounded. To that, both add what no point has met: of all directions
that samples take, a share of `UNMET` by the number of points is missed by all of them once in 1,000 times, and may
weigh as much as the largest weight that was found. Points come from `SEED`, so results are repeatable.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from ..geometry import geometry
from ..models.form import Form
from .refinement import Rows

SEED = 20100629
FIRST, MOST = 2**10, 2**20  # points
SCRAMBLES = 16
SURE_RANDOM, SURE_SCRAMBLED = 3.29, 4.07  # of a normal and of Student's distribution with 15 degrees of freedom
UNMET = math.log(1000)
BLOCK = 2**16  # directions at a time


def _points(method: str, count: int, device: torch.device) -> Tensor:
    """Points (groups, n, 3) of the unit cube, independent groups of which each is spread evenly."""
    if method == "monte_carlo":
        points = torch.rand(count, 3, dtype=torch.float64, generator=torch.Generator().manual_seed(SEED))[:, None]
    else:
        engines = (torch.quasirandom.SobolEngine(3, scramble=True, seed=SEED + k) for k in range(SCRAMBLES))
        points = torch.stack([engine.draw(count // SCRAMBLES, dtype=torch.float64) for engine in engines])
    return points.clamp(max=1 - 2.0**-53).to(device)


@dataclass(frozen=True, eq=False)
class Drawn:
    """The mean weights for some directions and numbers of points."""

    rows: Rows
    method: str
    counts: Tensor  # (R,)

    def value(self, form: Form, flat: Mapping[str, Tensor]) -> Tensor:
        """The means for values (R or 1, 1 or C), (R, C); samples and their density are not differentiated."""
        parts, order = [], []
        for count in self.counts.unique().tolist():
            chosen = torch.nonzero(self.counts == count)[:, 0]
            parts.append(_means(form, flat, self.rows, chosen, self.method, count)[0])
            order.append(chosen)
        return torch.cat(parts)[torch.argsort(torch.cat(order))]


def drawn(
    form: Form, flat: Mapping[str, Tensor], rows: Rows, tolerance: float, method: str
) -> tuple[Drawn, Tensor, Tensor, int]:
    """The rule, the means (R, C), the errors claimed and the number of directions, doubled up to `MOST` points."""
    count, evaluations = FIRST, 0
    chosen = torch.arange(len(rows.co), device=rows.co.device)
    counts = torch.full_like(chosen, FIRST)
    found = error = rows.co.new_zeros(0)
    while len(chosen):
        mean, claimed = _means(form, flat, rows, chosen, method, count)
        evaluations += count * len(chosen)
        if count == FIRST:
            found, error = mean, claimed
        else:
            found[chosen], error[chosen], counts[chosen] = mean, claimed, count
        met = (claimed <= tolerance * mean.abs().clamp(min=1)).all(1)
        chosen = chosen[~met] if count < MOST else chosen[:0]
        count *= 2
    return Drawn(rows, method, counts), found, error, evaluations


def _means(
    form: Form, flat: Mapping[str, Tensor], rows: Rows, chosen: Tensor, method: str, count: int
) -> tuple[Tensor, Tensor]:
    """The means (r, C) of `count` weights for the chosen rows, and the errors claimed for them."""
    points = _points(method, count, rows.co.device)
    one_by_one = any(len(value) > 1 for value in flat.values())
    means, errors = [], []
    for part in chosen.split(1 if one_by_one else max(1, BLOCK // count)):
        values = {name: value[part[0] if len(value) > 1 else 0] for name, value in flat.items()}
        mean, error = _of_rows(form, values, rows.take(part), points)
        means.append(mean)
        errors.append(error)
    return torch.cat(means), torch.cat(errors)


def _of_rows(form: Form, values: Mapping[str, Tensor], rows: Rows, points: Tensor) -> tuple[Tensor, Tensor]:
    """The means over all points for rows that share their values."""
    sine = torch.sqrt((1 - rows.co) * (1 + rows.co))
    wo = torch.stack([sine * torch.cos(rows.azimuth), sine * torch.sin(rows.azimuth), rows.co], -1)[:, None, None]
    placed = {name: value.detach() for name, value in values.items()}
    sums, squares, largest = [], [], []
    for block in points.split(max(1, BLOCK // (len(rows.co) * points.shape[1])), dim=0):
        with torch.no_grad():
            u = block.expand(len(rows.co), *block.shape)
            wi = form.sample(placed, wo.expand_as(u), u)
            density = form.pdf(placed, geometry(wi, wo, form.pdf_needs))[..., None]
            factor = torch.where(density > 0, wi[..., 2:] / torch.where(density > 0, density, 1.0), 0.0)
        factor = factor.clamp(min=0)
        weights = torch.where(factor > 0, form.f(values, geometry(wi, wo, form.needs)), 0.0) * factor
        group = weights.mean(2)
        sums.append(group.sum(1))
        squares.append(group.detach().square().sum(1))
        largest.append(weights.detach().amax((1, 2)))
    groups = points.shape[0]
    mean = torch.stack(sums).sum(0) / groups
    variance = (torch.stack(squares).sum(0) / groups - mean.detach().square()).clamp(min=0) / (groups - 1)
    sure = SURE_SCRAMBLED if groups == SCRAMBLES else SURE_RANDOM
    unmet = UNMET / (groups * points.shape[1]) * torch.stack(largest).amax(0)
    return mean, (sure * torch.sqrt(variance) + unmet).nan_to_num(nan=math.inf, posinf=math.inf)
