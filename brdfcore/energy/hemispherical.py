"""The hemispherical albedo: what a material reflects of even light, in all directions together.

    A = (1/pi) integral of a(wo) cos theta_o dwo = 2 integral of mean_phi a(theta, phi) cos theta sin theta dtheta  [1]

Clenshaw-Curtis in theta and the trapezoid rule in the azimuth, both nested and in the coordinates of the tables
(_axes.py), in which the directional albedo is smooth; the height at which it may diverge weighs nothing.
"""

import math
import time

import torch
from torch import Tensor

from ..errors import InvalidValueError
from ..models.form import Form
from ..models.material import Material
from ..parameters import Values
from . import _axes, _chebyshev
from .albedo import Albedo, of_form
from .probe import symmetry

COARSEST, FINEST = 3, 7  # powers of two: intervals of the polar angle; the azimuth has half as many
_THETA = _axes.Axis("theta", 0.0, math.pi / 2, "theta")


def hemispherical_albedo(material: Material, tolerance: float = 1e-6) -> Albedo:
    """The hemispherical albedo [1], (C,), with the error claimed for it, as bc.albedo gives a directional one.

    It is the mean over wo of the directional albedo, weighted by the cosine; by reciprocity, also what is reflected of
    light that comes evenly from everywhere. The error is the difference to half as many nodes, and what the directional
    albedos claim. Differentiable in the material's parameters. Raises InvalidValueError for a tolerance not above 0.
    """
    if not tolerance > 0:
        raise InvalidValueError(
            f"Expected tolerance to be above 0, got {tolerance:g}. It is the largest error of an albedo.",
            field="tolerance",
        )
    start = time.perf_counter()
    form = material.form
    values = {key: value.double() for key, value in material.values().items()}
    fixed = {key: value.detach() for key, value in values.items()}
    turns = not symmetry(form, fixed).isotropic
    evaluations, before = 0, None
    for level in range(COARSEST, FINEST + 1):
        found = _mean(form, fixed, level, turns, tolerance)
        evaluations += found.evaluations
        difference = torch.full_like(found.error, math.inf) if before is None else (found.values - before).abs()
        error, before = difference + found.error, found.values
        met = bool((error <= tolerance * found.values.clamp(min=1)).all())
        if met or bool((found.error > tolerance).any()):  # finer steps do not help where the quadrature is at its end
            break
    if torch.is_grad_enabled() and any(value.requires_grad for value in values.values()):
        found = _mean(form, values, level, turns, tolerance)
        evaluations += found.evaluations
    seconds = time.perf_counter() - start
    return Albedo(found.values, error.detach(), tolerance, met, evaluations, "clenshaw_curtis", seconds)


def _mean(form: Form, values: Values, level: int, turns: bool, tolerance: float) -> Albedo:
    """The mean over 2^level intervals, and over half as many of the azimuth's quadrant."""
    n = 2**level
    theta = _THETA.nodes(n + 1)[:-1]  # the horizon weighs nothing
    t = _THETA.t(theta)
    length = _THETA.ends[0] - _THETA.ends[1]
    weight = 3 * math.pi * length * t.square() * torch.sin(theta) * torch.cos(theta) * _weights(n)[:-1]
    azimuth, share = t.new_zeros(1), t.new_ones(1)
    if turns:
        phi = math.pi / n * torch.arange(n // 2 + 1, dtype=torch.float64)
        factor = _axes.stretch(_axes.ratios(form), form, values).detach()
        azimuth = torch.atan2(torch.sin(phi) * factor, torch.cos(phi))
        share = factor / (torch.cos(phi).square() + (factor * torch.sin(phi)).square()) * (2 / n)
        share[[0, -1]] /= 2
    both = (weight[:, None] * share)[..., None]
    found = of_form(form, values, torch.cos(theta)[:, None], azimuth, tolerance / 2)
    total, error = ((both * part).sum((0, 1)) for part in (found.values, found.error))
    return Albedo(total, error, tolerance, found.met, found.evaluations, found.method, found.seconds)


def _weights(n: int) -> Tensor:
    """The weights of n + 1 Chebyshev nodes for an integral over t in [0, 1], (n + 1,)."""
    k = torch.arange(n + 1)
    # the integral of T_k over [-1, 1] is 2 / (1 - k^2) for even k, and 0 for odd ones
    moments = torch.where(k % 2 == 0, 2 / (1 - k.double().square()), 0.0)
    identity = torch.eye(n + 1, dtype=torch.float64)
    return moments @ _chebyshev.coefficients(identity, 1) / 2
