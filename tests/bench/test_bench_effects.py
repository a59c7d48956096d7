"""What each effect costs: the time of f with it, and of f and its derivatives, over the time without it.

20,000 pairs of directions, float64, one thread. An effect's absence costs nothing, so no ratio may be below 1 by more
than noise. That no operation is left of it: tests/models/test_effects_cost_nothing.py.
"""

from collections.abc import Callable

import pytest
import torch
from timing import ratio

import brdfcore as bc

pytestmark = pytest.mark.bench
COUNT = 20_000
NOISE = 0.85
COLOURS = {channels: ", ".join(["0.2"] * channels) for channels in (3, 31)}


def _uniform(seed: int) -> torch.Tensor:
    w = torch.randn(COUNT, 3, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    w[:, 2] = w[:, 2].abs() + 1e-3
    return w / w.norm(dim=-1, keepdim=True)


WI, WO = _uniform(1), _uniform(2)


def _evaluated(text: str) -> Callable[[], object]:
    material = bc.material(text)

    def run() -> object:
        with torch.no_grad():
            return material.f(WI, WO)

    return run


def _differentiated(text: str) -> Callable[[], object]:
    material = bc.material(text)
    return lambda: torch.autograd.grad(material.f(WI, WO).sum(), list(material.parameters()))


def _switched(off: str, on: str) -> list[tuple[str, str, str]]:
    """The effect, its text without and its text with, for every model that has the word `off` and the word `on`."""
    found = []
    for name, model in bc.MODELS.items():
        if any(off in group and on in group for group in model.option_groups):
            found.append((f"{name}: {on} over {off}", f"{name}({off})", f"{name}({on})"))
    return found


EFFECTS = [
    *_switched("isotropic", "anisotropic"),
    *_switched("constant", "schlick"),
    *_switched("constant", "dielectric"),
    *_switched("constant", "conductor"),
    *_switched("separable", "correlated"),
    *(
        (f"{name}: {channels} channels over gray", f"{name}(ks=0.2)", f"{name}(ks=[{colour}])")
        for name in ("kurt", "ggx")
        for channels, colour in COLOURS.items()
    ),
    ("lambert + kurt over kurt", "kurt", "lambert + kurt"),
    ("kurt + kurt over kurt", "kurt", "kurt + kurt"),
    ("lambert + kurt + kurt over lambert", "lambert", "lambert + kurt + kurt"),
]


@pytest.mark.parametrize(("effect", "without", "present"), EFFECTS, ids=[effect[0] for effect in EFFECTS])
def test_what_an_effect_costs(effect, without, present, show):
    of_f = ratio(_evaluated(present), _evaluated(without), seconds=0.3)
    of_gradient = ratio(_differentiated(present), _differentiated(without), seconds=0.3)
    show(f"{effect:48s} f {of_f:6.2f}   f and derivatives {of_gradient:6.2f}")
    if "separable" not in without:  # two ways to compute, neither of which is an absence
        assert min(of_f, of_gradient) > NOISE
    if "channels" in effect:
        assert of_f < 10  # one wide product: far from one evaluation a channel
