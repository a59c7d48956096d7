"""Requests to fit, and the jobs that answer them."""

import math
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from ._base import Body, PerChannel, Range, View
from .datasets import InlineSamples
from .jobs import JobView
from .results import ComparedOutcome, FitOutcome


class FitOptions(Body):
    """How to fit, whatever the data and the model are."""

    loss: str = "cosine"
    optimizer: str = "auto"
    fixed: dict[str, PerChannel] = Field({}, description='held values, such as {"kurt.f0": 0.04}')
    gray: list[str] = Field([], description="keys that keep one value over all channels")
    per_channel: list[str] = Field([], description="keys that get one value a channel")
    seed: int = Field(0, ge=0, lt=2**63)
    bounds: dict[str, Range] = Field({}, description='[low, high] within a key\'s own box, {"ggx.a": [0.1, 0.3]}')
    starts: list[dict[str, PerChannel]] = Field([], max_length=64, description="values by key of further starts")
    robust: str | None = Field(None, description="soft_l1 or cauchy: large residuals count less")
    robust_scale: float | None = Field(None, description="residual from which they do; the data say, if absent")
    max_theta_deg: float | None = Field(None, gt=0, le=90, description="steeper samples are left out [degrees]")
    conserve_energy: bool = Field(False, description="keep every directional albedo at 1 or below")


class FitRequest(FitOptions):
    """What to fit to which data; data is either the id of a dataset or inline samples."""

    dataset: str | None = Field(None, description="id that POST /v1/datasets gave")
    samples: InlineSamples | None = None
    model: str | None = Field(
        None,
        min_length=1,
        max_length=2000,
        description='for example lambert + ward_bounded; "auto" chooses the effects that the data call for',
    )
    models: list[Annotated[str, Field(min_length=1, max_length=2000)]] | None = Field(
        None, min_length=1, max_length=32, description="instead of model, several that are compared"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.dataset is None) == (self.samples is None):
            raise ValueError("Expected either dataset or samples to be given. Give exactly one of them.")
        if (self.model is None) == (self.models is None):
            raise ValueError("Expected either model or models to be given. Give exactly one of them.")
        return self

    @property
    def asked(self) -> str | list[str]:
        """The model, or the models that are compared."""
        return self.models or self.model or ""

    def arguments(self) -> dict[str, Any]:
        """What `brdfcore.fit` or `compare` is asked, by keyword: everything but the data and the models."""
        found = self.model_dump(exclude={"dataset", "samples", "model", "models", "max_theta_deg"})
        return {**found, "max_theta": None if self.max_theta_deg is None else math.radians(self.max_theta_deg)}


class SamplesView(View):
    """What stands in for inline samples when a request is shown again."""

    count: int
    hash: str


class RequestView(View):
    """A fit's request as it was accepted, without its inline samples."""

    dataset: str | None
    samples: SamplesView | None
    model: str | None
    models: list[str] | None = None
    loss: str
    optimizer: str
    fixed: dict[str, float | list[float]]
    gray: list[str]
    per_channel: list[str]
    seed: int
    bounds: dict[str, list[float]] = Field({})
    starts: list[dict[str, float | list[float]]] = Field([])
    robust: str | None = None
    robust_scale: float | None = None
    max_theta_deg: float | None = None
    conserve_energy: bool = False


class FitSummary(JobView):
    """A fit without its result, as the list shows it."""

    request: RequestView


class FitView(FitSummary):
    """A fit and, once it has succeeded, its result."""

    result: ComparedOutcome | FitOutcome | None


class FitPage(View):
    """Fits, newest first; `next` is the cursor of the page that follows."""

    items: list[FitSummary]
    next: str | None
