"""Integrals over the hemisphere to near full precision: the accurate quadrature that the tests trust.

With T = tan theta_o and sec = 1/cos theta_o, and slopes turned to wo's azimuth, the half vectors whose wi lies above
the horizon are exactly the disc of centre (T, 0) and radius sec. With x = T - sec cos 2 psi, y = sec sin 2 psi sin eta
nothing is singular at its rim: cos theta_i = sin^2 2 psi cos^2 eta / (cos theta_o (1 + e2)) without cancellation, and
dwi = 4 (h.wo) cos^3 theta_h dx dy. Panels of Gauss-Legendre cover the part of the disc that a lobe reaches.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
import torch

Array = np.ndarray


def panels(edges: Sequence[float] | Array, nodes: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights of each interval between the edges (last axis of edges)."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    edges = np.asarray(edges)
    low, half = edges[..., :-1, None], np.diff(edges)[..., None] / 2
    shape = (*edges.shape[:-1], -1)
    return (low + half * (1 + x)).reshape(shape), (half * w).reshape(shape)


def disc(theta_o: float, phi_o: float, reach: float, count: int) -> tuple[Array, Array, Array]:
    """wo (3,), wi (n, 3) and solid-angle weights (n,) that cover the half vectors of slope below `reach`."""
    tangent, sec = math.tan(theta_o), 1 / math.cos(theta_o)
    left = -1 / (tangent + sec)  # T - sec, the disc's edge towards the normal

    def psi_at(x: float) -> float:
        return math.asin(math.sqrt(min(max((x - left) / (2 * sec), 0.0), 1.0)))

    # Graded towards the lobe's centre, where x is of the lobe's width and psi of its square root.
    steps = np.linspace(-1, 1, 9)
    xs = [x for x in reach * np.sign(steps) * np.abs(steps) ** 1.5 if left < x < tangent + sec]
    edges = sorted({psi_at(x) for x in (left, -reach, *xs, reach)})
    psi, dpsi = panels(edges, count)
    x, half = left + 2 * sec * np.sin(psi) ** 2, sec * np.sin(2 * psi)
    top = np.arcsin(np.minimum(reach / np.maximum(half, 1e-300), 1.0))
    eta, deta = panels(top[:, None] * np.linspace(-1, 1, 9), count)
    psi, x, half, dpsi = (v[:, None] for v in (psi, x, half, dpsi))
    y = half * np.sin(eta)
    e2 = x * x + y * y
    h_dot_wo = math.cos(theta_o) * (1 + tangent * x) / np.sqrt(1 + e2)
    cos_i = np.sin(2 * psi) ** 2 * np.cos(eta) ** 2 * sec / (1 + e2)
    # |d(x, y)/d(psi, eta)| = (2 sec sin 2 psi) (half cos eta)
    weight = 4 * h_dot_wo * (1 + e2) ** -1.5 * 2 * half * half * np.cos(eta) * dpsi * deta
    # wi = 2 (h.wo) h - wo, its height replaced by the form that does not cancel
    scale = 2 * h_dot_wo / np.sqrt(1 + e2)
    across = scale * y
    along = scale * x - math.sin(theta_o)
    c, s = math.cos(phi_o), math.sin(phi_o)
    wi = np.stack([c * along - s * across, s * along + c * across, cos_i], -1)
    wo = np.array([math.sin(theta_o) * c, math.sin(theta_o) * s, math.cos(theta_o)])
    return wo, wi.reshape(-1, 3), weight.ravel()


def slope_integral(
    integrand: Callable[[torch.Tensor, torch.Tensor], torch.Tensor],
    theta_o: float,
    reach: float,
    phi_o: float = 0.0,
    count: int = 16,
) -> float:
    """The integral of integrand(wi, wo) dwi over the half vectors of slope up to `reach` and wi above the horizon."""
    wo, wi, weight = disc(theta_o, phi_o, reach, count)
    with torch.no_grad():
        values = integrand(torch.tensor(wi), torch.tensor(wo))
    return float((values.reshape(-1) * torch.tensor(weight)).sum())


def albedo(material, theta_o: float, reach: float, phi_o: float = 0.0, count: int = 16) -> float:
    """The directional albedo [1] of a half-vector material (one channel)."""
    return slope_integral(lambda wi, wo: material.f(wi, wo)[:, 0] * wi[:, 2], theta_o, reach, phi_o, count)


def hemisphere_nodes(mu: int, phi: int, breaks: Sequence[float] = (0.0, 1.0)) -> tuple[torch.Tensor, torch.Tensor]:
    """wi (n, 3) and solid-angle weights (n,): Gauss-Legendre in cos theta, equal steps in phi; smooth integrands."""
    z, dz = panels(breaks, mu)
    angle = (np.arange(phi) + 0.5) * 2 * np.pi / phi
    z, angle = np.meshgrid(z, angle, indexing="ij")
    r = np.sqrt(1 - z * z)
    weight = np.repeat(dz, phi) * 2 * np.pi / phi
    wi = np.stack([r * np.cos(angle), r * np.sin(angle), z], -1).reshape(-1, 3)
    return torch.tensor(wi), torch.tensor(weight)
