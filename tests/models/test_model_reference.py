"""Values, densities and gradients of every model and choice of options against its equation in 160 digits.

The hard cases that have a name are in tests/hard_cases; here are the lobes that fits meet and, at the full tier, hard
directions at values from all over the box.
"""

from collections.abc import Sequence

import numpy as np
import pytest
import torch
from model_cases import (
    CHOICE_IDS,
    CHOICES,
    DTYPES,
    above_horizon,
    counted,
    draw_values,
    lobe_pairs,
    material_of,
)

import brdfcore as bc
from brdfcore.geometry import FLOOR
from brdfcore.hard_cases import Point
from brdfcore.hard_cases.accuracy import measure

every_dtype = pytest.mark.parametrize("dtype", DTYPES, ids=["float32", "float64"])


def points_of(material: bc.Material, wi: torch.Tensor, wo: torch.Tensor) -> list[Point]:
    """The evaluations of a material of one term at pairs of directions."""
    (term,) = material.form.terms
    values = tuple((key.split(".")[1], float(value.detach())) for key, value in material.values().items())
    pairs = zip(wi.tolist(), wo.tolist(), strict=True)
    return [Point(term.model, values, tuple(one), tuple(other)) for one, other in pairs]


def assert_within_bars(points: Sequence[Point], dtype: torch.dtype) -> None:
    for point, errors in zip(points, measure(points, dtype), strict=True):
        for quantity, error in errors.items():
            assert not error.missed, f"{quantity} of {point}: {error}"


@every_dtype
@pytest.mark.parametrize(("choice", "count"), counted(1, 8))
def test_lobes_of_the_search_ranges(choice, count, dtype):
    rng = np.random.default_rng(1)
    for _ in range(count):
        material = material_of(choice, draw_values(choice, rng))
        wi, wo = lobe_pairs(material, rng, 8, dtype)
        assert len(wi) >= 5
        assert_within_bars(points_of(material, wi, wo), dtype)


@every_dtype
@pytest.mark.full
@pytest.mark.parametrize("choice", CHOICES, ids=CHOICE_IDS)
def test_hard_directions_over_the_whole_box(choice, dtype):
    """Grazing to 1e-12, retro, mirror, h = n exactly; shapes (stored as logarithms) at both their ends, too."""
    rng = np.random.default_rng(2)
    wi, wo = above_horizon(dtype)
    representable = (wi[:, 2] > FLOOR[dtype]) & (wo[:, 2] > FLOOR[dtype])
    wi, wo = wi[representable], wo[representable]
    shapes = [p for p in choice.parameters if p.scale == "log"]
    ends = ({p.name: p.low for p in shapes}, {p.name: p.high for p in shapes})
    for end in (*[{}] * 4, *ends):
        material = material_of(choice, draw_values(choice, rng, where="box") | end)
        lit = material.f(wi, wo).detach()[:, 0] > 0
        for mask, count in ((lit, 16), (~lit, 2)):
            rows = rng.permutation(np.flatnonzero(mask.numpy()))[:count]
            assert_within_bars(points_of(material, wi[rows], wo[rows]), dtype)
