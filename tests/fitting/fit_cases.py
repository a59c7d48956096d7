"""Small data sets that the tests of fits share."""

import math

import torch

import brdfcore as bc
from brdfcore.geometry import from_angles

TRUE = "lambert(kd=[0.10, 0.20, 0.30]) + ward_bounded(isotropic, rs=[0.05, 0.10, 0.15], a=0.12)"


def directions(count: int, seed: int, steepest: float = 80.0) -> tuple[torch.Tensor, torch.Tensor]:
    """Pairs of directions, half of them near the mirror direction, azimuths all round."""
    generator = torch.Generator().manual_seed(seed)
    u = torch.rand(5, count, generator=generator, dtype=torch.float64)
    theta_i = math.radians(steepest) * u[0]
    phi_i = 2 * math.pi * u[1]
    near = torch.arange(count) % 2 == 0
    theta_o = torch.where(near, (theta_i + 0.2 * (u[2] - 0.5)).abs(), math.radians(steepest) * u[2])
    phi_o = torch.where(near, phi_i + math.pi + 0.3 * (u[3] - 0.5), 2 * math.pi * u[3])
    return from_angles(theta_i, phi_i), from_angles(theta_o.clamp(max=1.5), phi_o)


def measured_from(text: str, count: int = 300, noise: float = 0.0, seed: int = 1, sigma: bool = False) -> bc.Samples:
    """Samples of a material whose f cos_i has normal noise of this standard deviation."""
    wi, wo = directions(count, seed)
    with torch.no_grad():
        f = bc.material(text).f(wi, wo)
    deviation = torch.full_like(f, noise)
    # a stream of its own: that of the directions would tie the noise to where a sample lies
    stream = torch.Generator().manual_seed(2**31 + seed)
    y = f + deviation / wi[:, 2:] * torch.randn(f.shape, generator=stream, dtype=f.dtype)
    return bc.Samples(wi, wo, y, sigma=deviation / wi[:, 2:] if sigma else None)
