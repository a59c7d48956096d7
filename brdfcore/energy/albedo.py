"""The directional albedo of a material, to a stated accuracy.

    a(wo) = integral of f(wi, wo) cos theta_i dwi over the hemisphere                                        [1]

Each term is integrated by the cheapest rule that suits it: its exact form (closed_forms.py), one integral of one
dimension (chords.py, arcs.py, own_lobes.py), rays over the disc of slopes (slope_disc.py), and for a lobe of which
nothing is known adaptive cells in the coordinates of its samples (hemisphere.py). Nodes are added where the claimed
error is too large (refinement.py). Everything is computed in double precision, whatever the material's is.
"""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from ..errors import InvalidValueError
from ..models.form import Form
from ..models.material import Material
from ..tabulated import Tabulated
from .measured import of_table
from .plan import METHODS, plan

__all__ = ["METHODS", "Albedo", "albedo", "of_form"]


@dataclass(frozen=True, eq=False)
class Albedo:
    """Directional albedos, the error claimed for them, and what they cost."""

    values: Tensor  # (..., C) [1], float64, differentiable in the material's parameters
    error: Tensor  # (..., C) [1], claimed, without derivatives; inf where nothing can be claimed
    tolerance: float
    met: bool  # every claimed error <= tolerance * max(1, value)
    evaluations: int  # directions at which the lobes were evaluated
    method: str  # the methods that the terms were integrated by
    seconds: float


def albedo(
    material: Material | Tabulated,
    theta: float | Tensor,
    phi: float | Tensor = 0.0,
    tolerance: float = 1e-6,
    method: str = "auto",
) -> Albedo:
    """The directional albedo [1] of a material seen from theta, phi: `values` (..., C), (..., 1) when gray.

    theta in [0, pi/2) and phi, polar angle and azimuth of wo [rad], broadcast. The claimed `error` is at most
    tolerance * max(1, value) where `met` says so; 1e-12 is a reference. `METHODS` names the methods: "auto" takes the
    cheapest for each term, the others are there to be compared; a measured grid is sampled (measured.py). Raises
    InvalidValueError for angles outside of the range and a method that does not suit a term, UnknownNameError for a
    method that does not exist.
    """
    device = torch.device("cpu") if isinstance(material, Tabulated) else next(material.parameters()).device
    theta, phi = (torch.as_tensor(angle, dtype=torch.float64, device=device).detach() for angle in (theta, phi))
    wrong = ~((theta >= 0) & (theta < math.pi / 2))
    if bool(wrong.any()):
        raise InvalidValueError(
            f"Expected theta to be in [0, pi/2), got {float(theta[wrong].reshape(-1)[0]):.12g}. "
            "Give the polar angle in radians.",
            field="theta",
        )
    if isinstance(material, Tabulated):
        if method not in ("auto", "sobol"):
            raise InvalidValueError(
                f"Expected method to be auto or sobol for a measured grid, got {method!r}. Leave it out.",
                field="method",
            )
        values, error, evaluations, seconds = of_table(material, theta, phi, tolerance)
        met = bool((error <= tolerance * values.clamp(min=1)).all())
        return Albedo(values, error, tolerance, met, evaluations, "sobol", seconds)
    return of_form(material.form, material.values(), torch.cos(theta), phi, tolerance, method)


def of_form(
    form: Form,
    values: Mapping[str, Tensor],
    cos_o: Tensor,
    azimuth: Tensor,
    tolerance: float = 1e-6,
    method: str = "auto",
) -> Albedo:
    """The same for a form and its values, seen from cos theta_o in (0, 1], which may be as small as 1e-12.

    cos_o and azimuth [rad] are (...) and broadcast. A value is () or (C,), or has a leading shape of its own, (..., 1)
    or (..., C), that broadcasts with theirs: a table with a parameter as an axis is one call.
    """
    start = time.perf_counter()
    planned = plan(form, values, cos_o, azimuth, tolerance, method)
    found = planned.found
    if torch.is_grad_enabled() and any(value.requires_grad for value in values.values()):
        found = planned.evaluate(values)
    met = bool((planned.error <= tolerance * planned.found.clamp(min=1)).all())
    return Albedo(
        found, planned.error, tolerance, met, planned.evaluations, planned.method, time.perf_counter() - start
    )
