"""What the data can show at all: read from the directions before a fit, in sentences that say what to measure.

A lobe's width shows where half vectors lie near the normal; Schlick's rise (1 - h.wo)^5 where they graze the
directions; anisotropy where the sample was turned. What is said after the fit (identifiability.py) is what they showed.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

from ..formats.samples import Samples
from ..models.form import Term
from .losses import LOSSES
from .plan import Plan
from .problem import Problem

_NEAR_MIRROR = math.radians(10)  # of theta_h: glossy lobes are within it
_FRESNEL = 0.01  # of Schlick's rise: a quarter of f0 = 0.04, seen from theta_d = 53 deg on
_SPREAD = math.radians(1)  # within which angles are one angle
_BRIGHT = 3.0  # times the fitted values, by which values in percent or counts are beyond any reflectance
_DECADES = 4  # of the largest value over the median beyond which the large ones decide a linear loss alone


@dataclass(frozen=True)
class Support:
    """What directions can show; angles in radians. `limits` says by effect, in a sentence, what they cannot.

    The effects are "directions" (any), "incidence" and "width" (a lobe's), "fresnel" (beside ks) and "anisotropy".
    """

    samples: int
    channels: int
    same_directions: bool  # all samples
    incidences: int  # angles of incidence, counted to a degree
    theta_h: tuple[float, float]  # smallest and largest angle of the half vector from the normal
    largest_theta_d: float  # largest angle between the half vector and the directions
    azimuth_observed: bool
    limits: dict[str, str]

    @property
    def sentences(self) -> tuple[str, ...]:
        """All that the directions cannot show."""
        return tuple(self.limits.values())


def supports(samples: Samples) -> Support:
    """What the samples' directions can show, whatever is fitted to them."""
    wi, wo = samples.wi, samples.wo
    half = wi + wo
    theta_h = torch.atan2(torch.hypot(half[:, 0], half[:, 1]), half[:, 2])
    cosine = (0.5 * half.norm(dim=-1)).clamp(max=1)
    theta_i = torch.atan2(torch.hypot(wi[:, 0], wi[:, 1]), wi[:, 2])
    smallest, largest = float(theta_h.min()), float(theta_h.max())
    theta_d = math.acos(float(cosine.min()))
    limits: dict[str, str] = {}
    same = len(samples) > 1 and bool(((wi == wi[0]) & (wo == wo[0])).all())
    if same:
        limits["directions"] = (
            f"All {len(samples)} samples share one pair of directions, so they determine one number a channel. "
            "Measure at others."
        )
    if float(theta_i.max() - theta_i.min()) < _SPREAD:
        limits["incidence"] = (
            f"All samples have one angle of incidence, {math.degrees(float(theta_i[0])):.3g} degrees, so nothing tests "
            "how the lobe changes with it. Measure at others."
        )
    if smallest > _NEAR_MIRROR:
        limits["width"] = (
            f"No half vector is nearer to the normal than {math.degrees(smallest):.3g} degrees, so the width of a "
            "narrower lobe cannot be seen. Measure near the mirror direction."
        )
    elif largest - smallest < _SPREAD:
        limits["width"] = (
            f"All half vectors are {math.degrees(largest):.3g} degrees from the normal, so a lobe's width and its "
            "reflectance cannot be told apart. Measure around the mirror direction."
        )
    if (rise := (1 - math.cos(theta_d)) ** 5) < _FRESNEL:
        limits["fresnel"] = (
            f"Half vectors and directions are at most {math.degrees(theta_d):.3g} degrees apart, where Schlick's "
            f"factor has risen by {rise:.1g} of its range, so ks and what makes the Fresnel factor (f0, eta, k) can "
            "hardly be told apart. Measure nearer to grazing, or fix one."
        )
    if not samples.azimuth_observed:
        limits["anisotropy"] = (
            "The sample's azimuth was not observed, so the two widths of an anisotropic lobe cannot be told apart. "
            "Turn the sample, or choose isotropic."
        )
    count = int((torch.bincount(torch.rad2deg(theta_i).round().long()) > 0).sum())
    shape = len(samples), samples.values.shape[1], same, count
    return Support(*shape, (smallest, largest), theta_d, samples.azimuth_observed, limits)


def warnings(plan: Plan, support: Support, y: Tensor, typical: Tensor, loss: str) -> list[tuple[str, ...]]:
    """The sentences that concern what this plan fits to values y (M, C, N), by material.

    They are about directions, the number of samples and values, whose positive ones have the median `typical` (M,).
    """
    concerned = {"directions"} if plan.free else set()
    for term in plan.form.terms:
        concerned |= _concerns(plan, term)
    found = [sentence for effect, sentence in support.limits.items() if effect in concerned]
    _, channels, count = y.shape
    sizes = {key: plan.start[key].numel() for key in plan.free}
    each = sum(size == channels for size in sizes.values())
    if sum(sizes.values()) > channels * count or each > count:
        found.append(
            f"{_counted(sum(sizes.values()), 'value is', 'values are')} fitted to "
            f"{_counted(count, 'sample', 'samples')} of {_counted(channels, 'channel', 'channels')}, too few to "
            "determine all. Fix some, or measure more."
        )
    has_lobe = bool(concerned - {"directions"})
    sees_peak = has_lobe and LOSSES[loss].statistical
    largest, constant = y.amax((1, 2)), (y == y[..., :1]).all(-1).all(-1)
    rows = zip(largest.tolist(), (largest / typical).tolist(), constant.tolist(), strict=True)
    return [
        (
            *found,
            *_of_values(
                top, ratio if sees_peak else 0.0, loss, free=bool(plan.free), same=same and has_lobe and count > 1
            ),
        )
        for top, ratio, same in rows
    ]


def _counted(count: int, one: str, more: str) -> str:
    return f"{count} {one if count == 1 else more}"


def too_bright(problem: Problem, x: Tensor) -> list[tuple[str, ...]]:
    """A sentence for each material of optima x (M, D) that shines far less than it should with a reflectance of 1."""
    plan, data = problem.plan, problem.data
    found: list[tuple[str, ...]] = [()] * len(x)
    scales = [f"{term.label}.{term.model.scale}" for term in plan.form.terms]
    full = torch.zeros(len(x), dtype=torch.bool)
    for key in scales:
        if key in plan.free:
            full |= (x[:, problem.slices[key]] >= plan.form.parameters[key].high).any(-1)
    for row in full.nonzero()[:, 0].tolist():
        which = torch.tensor([row])
        pieces = [piece.rows(which) for piece in data.chunks(1)]
        ratio = torch.cat([(piece.y / problem.f(x[which], piece).clamp(min=1e-300)).flatten() for piece in pieces])
        counted = torch.cat([piece.root_weight.expand_as(piece.y).flatten() for piece in pieces]) > 0
        if counted.any() and (times := float(ratio[counted].median())) > _BRIGHT:
            found[row] = (
                f"Half of the values are more than {times:.2g} times what this material makes with reflectances of at "
                "most 1. Check the unit and the quantity (percent, counts, a reflectance factor), or add a lobe.",
            )
    return found


def _of_values(largest: float, ratio: float, loss: str, *, free: bool, same: bool) -> Iterator[str]:
    """The sentences about one material's values: their largest, over the median of the positive ones, all the same."""
    if free and largest <= 0:
        yield "No value is positive, so a reflectance of 0 fits best and no shape can be seen. Check the data."
    elif same:
        yield "All samples have the same value, in which no lobe can be seen. A diffuse term alone fits them."
    if ratio > 10**_DECADES:
        yield (
            f"The largest value is {ratio:.1g} times the median, so the {loss} loss sees little but the peak. "
            'Choose loss="log", "cube_root" or "relative" if the rest matters.'
        )


def _concerns(plan: Plan, term: Term) -> set[str]:
    """Which limits concern a term: a lobe is one that has widths or an exponent, which are stored as logarithms."""
    free = {name for name in term.model.parameter if f"{term.label}.{name}" in plan.free}
    shapes = {name for name in term.model.parameter if term.model.parameter[name].scale == "log"}
    found = {"incidence"} if shapes and free else set()
    if shapes & free:
        found.add("width")
        if "anisotropic" in term.model.options:
            found.add("anisotropy")
    if "ks" in free and free & {"f0", "eta", "k"}:
        found.add("fresnel")
    return found
