"""Several models fitted to many datasets."""

from datetime import datetime
from typing import Annotated, Self

from pydantic import Field, model_validator

from ._base import View
from .fits import FitOptions
from .jobs import JobStatus
from .results import FitStatus


class BatchRequest(FitOptions):
    """One or several models to fit to many datasets, all with the same options."""

    datasets: list[str] = Field(min_length=1, max_length=1000, description="ids that POST /v1/datasets gave")
    models: list[Annotated[str, Field(min_length=1, max_length=2000)]] = Field(min_length=1, max_length=20)

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        for name in ("datasets", "models"):
            given = getattr(self, name)
            if len(set(given)) < len(given):
                raise ValueError(f"Expected {name} to be given once each, got one of them twice. Leave it out.")
        return self


class BatchRow(View):
    """One fit of a batch, in the order of datasets, then of models."""

    dataset: str
    model: str
    fit: str = Field(description="id of the fit")
    status: JobStatus
    fit_status: FitStatus | None
    errors: dict[str, float | None] | None
    parameters: dict[str, float | list[float | None] | None] | None
    undetermined: list[str] | None
    seconds: float | None
    error: str | None = Field(description="why it failed, in one sentence")


class BatchView(View):
    """Fits that were submitted together: one progress, one table."""

    id: str
    created: datetime
    datasets: int
    models: list[str]
    finished: bool = Field(description="whether no fit of it is queued or running")
    fraction: float = Field(description="of the work that is done; 1 when it is finished")
    counts: dict[JobStatus, int]


class BatchTable(View):
    """The fits of a batch."""

    rows: list[BatchRow]


class BatchPage(View):
    """Batches, newest first; `next` is the cursor of the page that follows."""

    items: list[BatchView]
    next: str | None
