"""The textbook rule: Gauss-Legendre nodes in cos theta_i, equal steps in phi_i, whatever the lobe.

    a = integral of f cos theta_i d(cos theta_i) dphi_i                                                       [1]

For comparison. It converges fast for smooth diffuse terms; a lobe narrower than its steps it may miss altogether, and
then the error that its differences claim is worth nothing.
"""

import torch
from torch import Tensor

from ..geometry import from_angles, geometry
from ..parameters import Values
from .refinement import Integral, Sums, take
from .rules import LADDER, gauss, ring


class Product(Integral):
    """The integrals over the hemisphere in spherical coordinates."""

    last = (LADDER.index(512), LADDER.index(512))

    def guess(self, digits: float) -> tuple[float, float]:
        """About the sizes that leave an error of 10^-digits for a diffuse term."""
        return 2 * digits, 2 * digits

    def count(self, outer: int, inner: int) -> int:
        """The number of directions that a row takes."""
        return 2 * outer * inner

    def sums(self, own: Values, chosen: Tensor, outer: int, inner: int) -> Sums:
        """The integrals of the chosen rows for values (R or 1, 1 or C), which may be differentiated."""
        co, toward = self.rows.take(chosen)
        heights, turns = gauss(inner).to(co.device), ring(2 * outer, mirrored=False).to(co.device)
        z = heights.nodes[:, None]
        wi = from_angles(torch.acos(z), turns.nodes)
        wi = torch.cat([wi[..., :2], z.expand(-1, 2 * outer)[..., None]], -1)
        wo = torch.stack([*(torch.sqrt((1 - co) * (1 + co)) * f(toward) for f in (torch.cos, torch.sin)), co], -1)
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
