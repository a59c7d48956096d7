"""Fresnel reflectance: Schlick's approximation, split so that it is linear in what a fit can solve for.

    F = f0 + (1 - f0) s,   s = (1 - h.wo)^5              [1]

Source: Schlick 1994, "An inexpensive BRDF model for physically-based rendering".
"""

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
