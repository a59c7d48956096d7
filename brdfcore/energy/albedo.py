"""The directional albedo of a material, to a stated accuracy.

    a(wo) = integral of f(wi, wo) cos theta_i dwi over the hemisphere                                        [1]
"""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from ..errors import InvalidValueError, unknown_name
from ..geometry import geometry
from ..models import _compensation
from ..models.form import Form
from ..models.material import Material
from . import closed_forms, slope_disc

METHODS = ("auto", "closed_form", "slope_disc", "hemisphere", "gauss_legendre", "monte_carlo", "sobol")
LEVELS = (8, 16, 32, 64, 128)


@dataclass(frozen=True, eq=False)
class Albedo:
    """Directional albedos, the error claimed for them, and what they cost."""

    values: Tensor  # (..., C) [1], float64, differentiable in the material's parameters
    error: Tensor  # (..., C) [1], claimed, detached
    tolerance: float
    met: bool  # every claimed error <= tolerance * max(1, value)
    evaluations: int  # directions at which the lobes were evaluated
    method: str
    seconds: float


def albedo(
    material: Material,
    theta: float | Tensor,
    phi: float | Tensor = 0.0,
    tolerance: float = 1e-6,
    method: str = "auto",
) -> Albedo:
    """The directional albedo [1] of a material seen from polar angles theta and azimuths phi [rad], which broadcast."""
    theta = torch.as_tensor(theta, dtype=torch.float64)
    phi = torch.as_tensor(phi, dtype=torch.float64)
    wrong = ~((theta >= 0) & (theta < math.pi / 2))
    if bool(wrong.any()):
        raise InvalidValueError(
            f"Expected theta to be in [0, pi/2), got {float(theta[wrong].reshape(-1)[0]):.12g}. Angles are in radians.",
            field="theta",
        )
    values = {key: value.double() for key, value in material.values().items()}
    return of_form(material.form, values, torch.cos(theta), phi, tolerance, method)


def of_form(
    form: Form,
    values: Mapping[str, Tensor],
    cos_o: Tensor,
    azimuth: Tensor,
    tolerance: float = 1e-6,
    method: str = "auto",
) -> Albedo:
    """The same for a form and its values, in terms of cos theta_o in (0, 1] and the azimuth [rad].

    cos_o, azimuth: (...), broadcast. A value is () or (C,), or it has a leading shape of its own, (..., 1) or (..., C),
    that broadcasts with theirs: so a table with a parameter as an axis is one call.
    """
    start = time.perf_counter()
    if method not in METHODS:
        raise unknown_name("the method", method, METHODS, field="method")
    lead = torch.broadcast_shapes(cos_o.shape, azimuth.shape, *(v.shape[:-1] for v in values.values() if v.ndim > 1))
    co, phi = cos_o.double().expand(lead).reshape(-1), azimuth.double().expand(lead).reshape(-1)

    def flat(value: Tensor) -> Tensor:
        if value.ndim < 2:
            return value.double().reshape(1, -1)
        return value.double().expand(*lead, value.shape[-1]).reshape(len(co), -1)

    rows = slope_disc.Rows(co, phi)
    flattened = {key: flat(value) for key, value in values.items()}
    total, error, evaluations = co.new_zeros(len(co), 1), co.new_zeros(len(co), 1), 0
    for term in form.terms:
        own = form.of_term(term, flattened)
        part, claimed, count = _term(term.model, own, rows, tolerance / len(form.terms))
        total, error, evaluations = total + part, error + claimed, evaluations + count
    met = bool((error <= tolerance * total.detach().clamp(min=1)).all())
    return Albedo(
        total.reshape(*lead, -1),
        error.expand_as(total).reshape(*lead, -1),
        tolerance,
        met,
        evaluations,
        "auto",
        time.perf_counter() - start,
    )


def _term(model, own, rows, tolerance):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    if getattr(model, "compensated", False):  # what is returned has a closed form
        part, claimed, used = _term(model.single, own, rows, tolerance)
        returned = own["ks"] * model.returned_albedo(own, rows.co[:, None])
        return part + returned, claimed + _compensation.MEAN_ERROR * returned.detach(), used
    coefficients = model.coefficients(own)
    if model.name in closed_forms.EXACT:
        exact = closed_forms.EXACT[model.name](model, own, rows.co[:, None])
        part = sum(e * c for e, c in zip(exact, coefficients, strict=True))
        return part, 4e-16 * part.detach().abs(), 0
    count = len(rows.co)
    channels = max(c.shape[-1] for c in own.values())
    total, error = rows.co.new_zeros(count, channels), rows.co.new_full((count, channels), math.inf)
    level = torch.zeros(count, dtype=torch.long)
    previous = None
    active = torch.arange(count)
    evaluations = 0
    rule = _hemisphere if model.name == "lafortune" else slope_disc.integrals
    for index, n in enumerate(LEVELS):
        with torch.no_grad():
            now, used = _sum(rule, model, own, coefficients, rows, active, n)
        evaluations += used
        if previous is not None:
            claimed = (now - previous).abs() + 4e-15 * now.abs()
            total[active], error[active], level[active] = now, claimed, index
            done = (claimed <= tolerance * now.abs().clamp(min=1)).all(-1)
            active, now = active[~done], now[~done]
        previous = now
        if not len(active):
            break
    if torch.is_grad_enabled() and any(v.requires_grad for v in own.values()):
        for index, n in enumerate(LEVELS):
            chosen = torch.nonzero(level == index)[:, 0]
            if len(chosen):
                now, used = _sum(rule, model, own, coefficients, rows, chosen, n)
                total = total.index_put((chosen,), now)
                evaluations += used
    return total, error, evaluations


def _sum(rule, model, own, coefficients, rows, active, n):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """The sums over the bases, (A, C), in chunks, and how many nodes were used."""
    nodes = 16 * n * n
    step = max(1, 2**17 // nodes)
    parts = []
    for chunk in active.split(step):
        mine = {k: v if len(v) == 1 else v[chunk] for k, v in own.items()}
        factors = [c if len(c) == 1 else c[chunk] for c in coefficients]
        bases = rule(model, mine, slope_disc.Rows(rows.co[chunk], rows.azimuth[chunk]), n, n)
        parts.append(sum(bases[:, k] * c for k, c in enumerate(factors)))
    channels = max(c.shape[-1] for c in own.values())
    return torch.cat(parts).expand(-1, channels), nodes * len(active)


def _hemisphere(model, own, rows, outer, inner):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    x, w = slope_disc._gauss_legendre(4 * outer)
    z, phi = x[:, None], 2 * math.pi * torch.arange(4 * outer, dtype=torch.float64) / (4 * outer)
    r = torch.sqrt(1 - z * z)
    wi = torch.stack(torch.broadcast_tensors(r * torch.cos(phi), r * torch.sin(phi), z), -1)
    weight = (w[:, None] * z * (2 * math.pi / (4 * outer)))[..., None]
    si = torch.sqrt((1 - rows.co) * (1 + rows.co))
    wo = torch.stack([si * torch.cos(rows.azimuth), si * torch.sin(rows.azimuth), rows.co], -1)
    g = geometry(wi, wo[:, None, None], model.needs)
    bases = model.basis({k: v[:, None, None] for k, v in own.items()}, g)
    return torch.stack([(b * weight).sum((1, 2)) for b in torch.broadcast_tensors(*bases)], dim=1)
