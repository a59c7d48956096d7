"""Fresnel reflectance: Schlick's approximation, and the exact unpolarised reflectance of dielectrics and conductors.

    F = f0 + (1 - f0) s,   s = (1 - c)^5,   c = h.wo                                       [1]
    F = (rs^2 + |rp|^2) / 2,   g^2 = n^2 - 1 + c^2,   n = eta, or eta + i k               [1]
    rs = (c - g) / (c + g) = -(n^2 - 1) / (c + g)^2
    rp / rs = (c g - (1 - c^2)) / (c g + (1 - c^2))

Schlick's is split so that it is linear in what a fit can solve for. The exact factors are evaluated in double precision
whatever the directions' is, in the second form of rs where much is transmitted, in the first towards grazing: nothing
cancels as n goes to 1, at c = 1 or at c = 0, in the factor or its derivatives (tests/models/test_microfacet.py).
Source: Schlick 1994, "An inexpensive BRDF model for physically-based rendering"; Born and Wolf, "Principles of Optics",
sections 1.5.2 and 14.2; rp / rs as in Cook and Torrance 1982.
"""

import torch
from torch import Tensor

MEAN_SCHLICK = 1 / 21  # cosine-weighted mean of s over the hemisphere: integral of 2 c (1 - c)^5 dc


def schlick(h_dot_wo: Tensor) -> Tensor:
    """Schlick's s = (1 - h.wo)^5 [1]; a cosine that rounding put above 1 counts as 1."""
    x = (1 - h_dot_wo).clamp(min=0)
    x2 = x.square()
    return x2.square() * x


def one_minus_fifth_power(x: Tensor) -> Tensor:
    """1 - (1 - x)^5 [1] for x in [0, 1], by its polynomial, so that nothing cancels as x goes to 0."""
    x = x.clamp(max=1)
    return x * (5 + x * (-10 + x * (10 + x * (-5 + x))))


def dielectric(h_dot_wo: Tensor, eta: Tensor) -> Tensor:
    """The reflectance F [1] of a dielectric, eta >= 1 times as dense as what surrounds it; (..., 1), or (..., C)."""
    c, n = h_dot_wo.double(), eta.double()
    n2_less_1 = (n - 1) * (n + 1)
    g = torch.sqrt(n2_less_1 + c.square())
    t = c / g  # near grazing the derivative by eta would cancel in the form below
    s = torch.where(t < 0.5, (1 - t) / (1 + t), n2_less_1 / (g + c) / (g + c))
    cg, sine2 = c * g, (1 - c) * (1 + c)
    p_over_s = (cg - sine2) / (cg + sine2)
    return (0.5 * s.square() * (1 + p_over_s.square())).to(h_dot_wo.dtype)


def conductor(h_dot_wo: Tensor, eta: Tensor, k: Tensor) -> Tensor:
    """The reflectance F [1] of a conductor of complex refractive index eta + i k; (..., 1), or (..., C)."""
    c, n, k = h_dot_wo.double(), eta.double(), k.double()
    real, imaginary = (n - 1) * (n + 1) - k.square(), 2 * n * k  # of n^2 - 1
    # g = a + i b, the root of x + i imaginary. The larger of a and b comes from the sum that does not cancel. At the
    # critical angle of eta < 1, k = 0 the root is 0 and has no derivative; below the floor it counts as a constant.
    x = real + c.square()
    modulus = torch.sqrt((x.square() + imaginary.square()).clamp(min=2.0**-1000))
    larger = torch.sqrt(0.5 * (modulus + torch.where(x < 0, -x, x)))
    smaller = 0.5 * imaginary / larger
    a, b = torch.where(x < 0, smaller, larger), torch.where(x < 0, larger, smaller)
    sum2 = (a + c).square() + b.square()  # |c + g|^2
    lost = 4 * c * a / sum2  # 1 - |rs|^2, of which |rs|^2 is made near grazing, where derivatives would cancel as above
    s2 = torch.where(lost < 0.5, 1 - lost, (real / sum2).square() + (imaginary / sum2).square())
    ca, cb2, sine2 = c * a, (c * b).square(), (1 - c) * (1 + c)
    p_over_s2 = ((ca - sine2).square() + cb2) / ((ca + sine2).square() + cb2)
    return (0.5 * s2 * (1 + p_over_s2)).to(h_dot_wo.dtype)
