"""The textbook rule: Gauss-Legendre nodes in cos theta_i, equal steps in phi_i, whatever the lobe.

    a = integral of f cos theta_i d(cos theta_i) dphi_i                                                       [1]

For comparison. It converges fast for smooth diffuse terms; a lobe narrower than its steps it may miss altogether, and
then the differences of its sizes tell nothing. So what it finds is compared with the mean weight of a few of the lobe's
own samples: where these disagree by more than chance, the disagreement counts as error, and more nodes are tried.
"""

import torch
from torch import Tensor

from ..geometry import from_angles, geometry
from ..models import Model
from ..parameters import Values
from .refinement import Integral, Rows, Sums, take
from .rules import LADDER, gauss, ring

DRAWN, SEED = 256, 20100629  # samples, and what seeds them
SURE = 4.0  # standard errors that chance hardly exceeds


class Product(Integral):
    """The integrals over the hemisphere in spherical coordinates."""

    last = (LADDER.index(256), LADDER.index(256))

    def __init__(self, model: Model, place: Values, rows: Rows, error: float) -> None:
        super().__init__(model, place, rows, error)
        points = torch.rand(DRAWN, 2, dtype=torch.float64, generator=torch.Generator().manual_seed(SEED))
        with torch.no_grad():
            wo = _towards(rows)[:, None].expand(-1, DRAWN, -1)
            placed = {name: value[:, None] for name, value in self.place.items()}
            wi = model.sample(placed, wo, points.to(wo.device).expand(len(wo), -1, -1))
            g = geometry(wi, wo, model.needs | model.pdf_needs)
            density = model.pdf(placed, g)
            used = g.above & (density > 0)
            factor = torch.where(used, wi[..., 2:] / torch.where(used, density, 1.0), 0.0)
            bases = torch.broadcast_tensors(*model.basis(placed, g), factor)[:-1]
            weights = torch.stack([basis * factor for basis in bases], dim=1)
        self.mean, self.chance = weights.mean(2), SURE * weights.std(2) / DRAWN**0.5  # (R, K, 1 or C)

    def missed(self, chosen: Tensor, bases: Tensor) -> Tensor:
        """What the bases (r, K, 1 or C) of the chosen rows may lack beyond what the differences of sizes tell."""
        apart, chance = (bases - self.mean[chosen]).abs(), self.chance[chosen]
        return torch.where(apart > chance, apart + chance, 0.0)

    def guess(self, digits: float) -> tuple[float, float]:
        """About the sizes that leave an error of 10^-digits for a diffuse term."""
        return 2 * digits, 2 * digits

    def count(self, outer: int, inner: int) -> int:
        """The number of directions that a row takes."""
        return 2 * outer * inner

    def sums(self, own: Values, chosen: Tensor, outer: int, inner: int) -> Sums:
        """The integrals of the chosen rows for values (R or 1, 1 or C), which may be differentiated."""
        rows = self.rows.take(chosen)
        co, wo = rows.co, _towards(rows)
        heights, turns = gauss(inner).to(co.device), ring(2 * outer, mirrored=False).to(co.device)
        z = heights.nodes[:, None]
        wi = from_angles(torch.acos(z), turns.nodes)
        wi = torch.cat([wi[..., :2], z.expand(-1, 2 * outer)[..., None]], -1)
        weight = ((heights.weights * heights.nodes)[:, None] * turns.weights)[..., None]
        g = geometry(wi, wo[:, None, None], self.model.needs)
        bases = self.model.basis({name: value[:, None, None] for name, value in take(own, chosen).items()}, g)
        shape = (len(chosen), inner, 2 * outer, 1)
        parts = torch.stack([b * weight for b in torch.broadcast_tensors(*bases, co.new_zeros(shape))[:-1]], dim=1)
        detached = parts.detach()
        return Sums(
            parts.sum((2, 3)),
            detached.abs().sum((2, 3)),
            turns.tail(detached.sum(2)),
            heights.tail(detached.sum(3)),
            co.new_zeros(len(chosen), 1, 1),
        )


def _towards(rows: Rows) -> Tensor:
    """The directions wo, (R, 3)."""
    sine = torch.sqrt((1 - rows.co) * (1 + rows.co))
    return torch.stack([sine * torch.cos(rows.azimuth), sine * torch.sin(rows.azimuth), rows.co], -1)
