"""`bc.compare`: several models fitted to the same samples, every model's error under every loss, best first.

As Table 3 and Figures 6 and 8 of Kurt et al. 2010, which compare the models' L2 errors at measured materials.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import ModelTextError, unknown_name
from ..formats.samples import Samples
from ..models import MODELS
from ..models._diffuse import CosineSampled
from ._fit import Progress, Teller, check_samples, fit
from .asked import check, form_of, own
from .effects import AUTO
from .given import plainly
from .losses import LOSSES
from .result import Fit
from .shared_scale import with_shared_scale

LOBES = tuple(name for name, model in MODELS.items() if not issubclass(model, CosineSampled))


@dataclass(frozen=True, eq=False)
class Comparison:
    """The fits of several models to the same samples, the one with the lowest minimised loss first.

    fits      the best first; `errors` of each has every loss
    models    their texts as they were given, in the same order
    seconds   of all fits together
    """

    fits: tuple[Fit, ...]
    models: tuple[str, ...]
    loss: str
    seconds: float

    @property
    def best(self) -> Fit:
        """The fit with the lowest minimised loss."""
        return self.fits[0]

    @property
    def weighed(self) -> bool:
        """Whether what was minimised is not the loss by its definition: chi-square for known sigma, a robust form."""
        return any(one.objective != one.errors[self.loss] for one in self.fits)

    def errors(self, loss: str) -> dict[str, float]:
        """Every model's error under a loss, in the order of the ranking; raises UnknownNameError for another name."""
        check_losses([loss])
        return {model: one.errors[loss] for model, one in zip(self.models, self.fits, strict=True)}

    def to_dict(self) -> dict[str, Any]:
        """The comparison as JSON-able data, with each fit's own result."""
        rows = []
        for rank, (model, one) in enumerate(zip(self.models, self.fits, strict=True), start=1):
            result = one.to_dict()
            shared = ("errors", "objective", "status", "message", "undetermined")
            rows.append(
                {
                    "rank": rank,
                    "model": model,
                    **{name: result[name] for name in shared},
                    "parameters": free_values(one),
                    "seconds": one.cost.seconds,
                    "fit": result,
                }
            )
        return {"loss": self.loss, "ranking": rows, "seconds": self.seconds, "report": self.report()}

    def report(self, losses: Sequence[str] | None = None) -> str:
        """The ranking as plain text, one line a model, under all losses or those that are named."""
        shown = list(losses or LOSSES)
        check_losses(shown)
        width = max(map(len, self.models)) + 2
        titles = "".join(f"{name + '*' * (name == self.loss and not self.weighed):>12}" for name in shown)
        titles += f"{'minimised*':>12}" * self.weighed
        lines = [f"{'':<4}{'model':<{width}}{titles}{'values':>8}{'seconds':>9}  status"]
        notes = []
        for rank, (model, one) in enumerate(zip(self.models, self.fits, strict=True), start=1):
            numbers = "".join(f"{one.errors[name]:>12.5g}" for name in shown)
            numbers += f"{one.objective:>12.5g}" * self.weighed
            lines.append(
                f"{rank:<4}{model:<{width}}{numbers}{free_values(one):>8}{one.cost.seconds:>9.2f}  "
                f"{one.status.replace('_', ' ')}"
            )
            if one.undetermined:
                notes.append(f"{model}: not determined by the data: {', '.join(one.undetermined)}")
        return "\n".join([*lines, "", f"* minimised, and ranked by; {self.seconds:.2f} s in all", *notes])


def compare(
    samples: Samples,
    models: Iterable[str] | None = None,
    loss: str = "cosine",
    progress: Callable[[Progress], None] | None = None,
    **keywords: Any,
) -> Comparison:
    """The models fitted to the samples and ranked by the loss; the keywords are those of `fit`.

    models    texts; without them Lambert's term with each lobe of the registry. Keywords that name values concern the
              models that have them

    Raises what `fit` raises, before any work, and ModelTextError where there is no model.
    """
    check_samples(samples)
    texts = [f"lambert + {name}" for name in LOBES] if models is None else _texts(models)
    observed = samples.azimuth_observed
    keywords = plainly({**keywords, "loss": loss})
    check(samples.values.shape[1], texts, azimuth_observed=observed, **keywords)
    begun = time.perf_counter()
    keywords = with_shared_scale(samples, texts, keywords)
    found = []
    for i, text in enumerate(texts):
        concerned = own(keywords, form_of(text, azimuth_observed=observed))
        found.append(fit(samples, text, progress=Teller(progress, i / len(texts), 1 / len(texts)).relay, **concerned))
    order = sorted(range(len(texts)), key=lambda i: found[i].objective)
    seconds = time.perf_counter() - begun
    return Comparison(tuple(found[i] for i in order), tuple(texts[i] for i in order), loss, seconds)


def _texts(models: object) -> list[str]:
    """The texts, each once; raises where they are no list of texts of one material each."""
    found = list(models) if isinstance(models, Iterable) and not isinstance(models, str) else []
    if not found or not all(isinstance(text, str) for text in found):
        raise ModelTextError(
            f"Expected models to be a list of texts, got {found or models!r}. Write it like "
            "['lambert + ward', 'kurt'].",
            field="models",
        )
    if AUTO in found:
        raise ModelTextError(
            f'Expected models to name a material each, got "{AUTO}" among them, which chooses among several. '
            "Use bc.fit for that.",
            field="models",
        )
    return list(dict.fromkeys(found))


def free_values(one: Fit) -> int:
    """How many values the fit determined, channels counted."""
    return sum(value.numel() for key, value in one.values.items() if key not in one.fixed)


def check_losses(losses: Sequence[str]) -> None:
    """Raise UnknownNameError where one is no loss."""
    for name in losses:
        if name not in LOSSES:
            raise unknown_name("a loss", name, LOSSES, field="losses")
