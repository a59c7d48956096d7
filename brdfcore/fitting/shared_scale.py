"""The one scale of a robust form for several models of the same samples, without which they could not be compared.

A model that fits worse has larger residuals, and a scale of its own would forgive it those. The scale is that of the
model whose residuals are the smallest, the number of its values allowed for.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..formats.samples import Samples
from ._fit import check_samples, planned
from .asked import check, form_of, own, texts
from .search import near_scale


def with_shared_scale(samples: Samples, model: str | Sequence[str], keywords: Mapping[str, Any]) -> dict[str, Any]:
    """The keywords of `fit`, with a scale where they name a robust form alone; raises what `fit` would raise."""
    if keywords.get("robust") is None or keywords.get("robust_scale") is not None or len(texts(model)) == 1:
        return dict(keywords)
    check_samples(samples)
    observed = samples.azimuth_observed
    check(samples.values.shape[1], model, azimuth_observed=observed, **keywords)
    found: list[tuple[float, float]] = []
    for text in texts(model):
        plan, (kept,) = planned([samples], text, **own(keywords, form_of(text, azimuth_observed=observed)))
        loss, optimizer, seed = (keywords.get(name, value) for name, value in _OTHERWISE.items())
        problem = near_scale(plan, [kept], loss, optimizer, seed, _silent).problem
        scale = math.nan if problem.robust_scale is None else float(problem.robust_scale[0])
        count = int((problem.data.root_weight > 0).expand_as(problem.data.y).sum())
        found.append((scale * math.sqrt(count / (count - problem.size)) if count > problem.size else math.inf, scale))
    return {**keywords, "robust_scale": min(found)[1]}


_OTHERWISE: dict[str, Any] = {"loss": "cosine", "optimizer": "auto", "seed": 0}


def _silent(stage: str, fraction: float, loss: float) -> None:
    """Progress is told once the fits begin."""
