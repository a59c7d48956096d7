"""A material's error under every loss by its definition, whatever loss its values were fitted with."""

import torch

from ..formats.samples import Samples
from ..models.material import Material
from .data import Data, stacked_weights
from .losses import LOSSES, root_mean


def errors(material: Material, samples: Samples) -> dict[str, float]:
    """The material's error under every loss by its definition, and `cosine_rms`, the root of the cosine loss's mean."""
    with torch.no_grad():
        pairs = zip(samples.wi.split(65536), samples.wo.split(65536), strict=True)
        f = torch.cat([material.f(wi, wo) for wi, wo in pairs]).expand_as(samples.values).T.unsqueeze(0)
    data = Data.of([samples], frozenset(), LOSSES["cosine"], None)
    found: dict[str, float] = {}
    for name, kind in LOSSES.items():
        weight = stacked_weights([samples], kind)  # (1, 1, N)
        total = (weight * kind.difference(f, data.y, data.c, data.scales).square()).sum((1, 2))
        found[name] = float(root_mean(total, weight, f.shape[1]) if kind.is_mean else total)
        if name == "cosine":
            found["cosine_rms"] = float(root_mean(total, weight, f.shape[1]))
    return found
