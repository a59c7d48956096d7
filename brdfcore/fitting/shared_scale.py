"""The one scale of a robust form for several models of the same samples, without which they could not be compared.

A model that fits worse has larger residuals, and a scale of its own would forgive it those. The scale is that of the
model whose residuals are the smallest, the number of its values allowed for; of "auto", of the richest that it may
come to.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..formats.samples import Samples
from ._fit import check_samples, planned
from .asked import check, form_of, own, texts
from .effects import AUTO, FAMILIES, RICHEST
from .search import near_scale

_NEAR = 0.25  # of the scale that the climb reaches: a later shape that fits exactly would make all before it outliers
_OTHERWISE: dict[str, Any] = {"loss": "cosine", "optimizer": "auto", "seed": 0}


def with_shared_scale(samples: Samples, model: str | Sequence[str], keywords: Mapping[str, Any]) -> dict[str, Any]:
    """The keywords of `fit`, with a scale where they name a robust form alone; raises what `fit` would raise."""
    alone = model != AUTO and len(texts(model)) == 1
    if alone or keywords.get("robust") is None or keywords.get("robust_scale") is not None:
        return dict(keywords)
    check_samples(samples)
    check(samples.values.shape[1], model, azimuth_observed=samples.azimuth_observed, **keywords)
    if not bool(samples.values.any()):  # fitted exactly by every model, at whatever scale
        return dict(keywords)
    if model != AUTO:
        return {**keywords, "robust_scale": _least(samples, texts(model), keywords)}
    within = [effects for effects in RICHEST if samples.azimuth_observed or not effects.anisotropic]
    climbed, least = (
        _least(samples, [effects.text() for effects in within if (effects.family == FAMILIES[0]) == climbs], keywords)
        for climbs in (True, False)
    )
    return {**keywords, "robust_scale": min(climbed, max(least, _NEAR * climbed))}


def _least(samples: Samples, several: Sequence[str], keywords: Mapping[str, Any]) -> float:
    """The scale of the one of several models whose residuals are the smallest."""
    found: list[tuple[float, float]] = []
    for text in several:
        plan, (kept,) = planned(
            [samples], text, **own(keywords, form_of(text, azimuth_observed=samples.azimuth_observed))
        )
        loss, optimizer, seed = (keywords.get(name, value) for name, value in _OTHERWISE.items())
        problem = near_scale(plan, [kept], loss, optimizer, seed, _silent).problem
        scale = math.nan if problem.robust_scale is None else float(problem.robust_scale[0])
        count = int((problem.data.root_weight > 0).expand_as(problem.data.y).sum())
        found.append((scale * math.sqrt(count / (count - problem.size)) if count > problem.size else math.inf, scale))
    return min(found)[1]


def _silent(stage: str, fraction: float, loss: float) -> None:
    """Progress is told once the fits begin."""
