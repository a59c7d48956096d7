"""How far an exported material is from the one that was given.

    difference = sqrt( integral of |f' - f|^2 cos^2 theta_i / integral of |f|^2 cos^2 theta_i )          [1]

over all pairs of directions within 85 degrees of the normal, uniform in solid angle, all channels together: a relative
root mean square. Beyond 85 degrees some lobes diverge, and few renderers look. Integrated by 2^15 Sobol points that
follow the material's own samples, half of them cosine-distributed; within 2 % of the true integral
(tests/exports/test_exports.py). One channel beside three counts as three equal ones.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from ..geometry import from_angles
from ..models.material import Material

STEEPEST = math.cos(math.radians(85.0))
POINTS = 2**15
EXACT = 1e-6  # the largest difference that rounding alone makes, in single precision

Evaluate = Callable[[Tensor, Tensor], Tensor]


@dataclass(frozen=True)
class Nodes:
    """Pairs of directions (N, 3), the weight of |f|^2 cos^2 theta_i at each, (N,), and f there, (N, C)."""

    wi: Tensor
    wo: Tensor
    weight: Tensor
    f: Tensor

    def difference(self, other: Tensor) -> float:
        """The relative root mean square of other - f, for `other` (N, C) or, where one of them is gray, (N, 1)."""
        f, other = torch.broadcast_tensors(self.f, other)
        squares = [(self.weight * x.square().sum(-1)).sum() for x in (other - f, f)]
        if float(squares[1]) == 0:
            return 0.0 if float(squares[0]) == 0 else math.inf
        return math.sqrt(float(squares[0] / squares[1]))


def nodes(material: Material, points: int = POINTS, seed: int = 0) -> Nodes:
    """The nodes by which differences from a material are integrated."""
    u = torch.quasirandom.SobolEngine(6, scramble=True, seed=seed).draw(points, dtype=torch.float64)
    cosine = STEEPEST + (1 - STEEPEST) * u[:, 0]
    wo = from_angles(torch.acos(cosine.clamp(max=1)), 2 * math.pi * u[:, 1])
    drawn = u[:, 2] < 0.5
    own = torch.stack([(2 * u[:, 2]).clamp(max=1 - 2**-53), u[:, 3], u[:, 4]], -1)
    with torch.no_grad():
        r, t = torch.sqrt(u[:, 3]), 2 * math.pi * u[:, 4]
        diffuse = torch.stack([r * torch.cos(t), r * torch.sin(t), torch.sqrt(1 - u[:, 3])], -1)
        wi = torch.where(drawn[:, None], material.sample(wo, own), diffuse)
        inside = wi[:, 2] >= STEEPEST
        wi, wo = wi[inside], wo[inside]
        density = 0.5 * material.pdf(wi, wo) + 0.5 * wi[:, 2] / math.pi
        weight = wi[:, 2].square() / density / points
        return Nodes(wi, wo, weight, material.f(wi, wo))


def difference(material: Material, other: Evaluate, points: int = POINTS, seed: int = 0) -> float:
    """The difference [1] of what `other` gives for (wi, wo), in 1/sr, from a material's f."""
    at = nodes(material, points, seed)
    with torch.no_grad():
        return at.difference(other(at.wi, at.wo))
