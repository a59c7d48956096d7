"""The wire contract: every body that the service reads or writes. Needs pydantic only, so clients import it too.

Numbers are strict going in: no booleans, no numeric strings, no NaN or Infinity, no unknown fields. Angles are in
degrees and their names end in `_deg`; the BRDF is in 1/sr and never includes the cosine.
"""

from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

JobStatus = Literal["queued", "running", "succeeded", "failed", "cancelled"]
FINISHED: tuple[JobStatus, ...] = ("succeeded", "failed", "cancelled")

# fail_fast: of 10,000 bad rows the first is named, and the others take no time
Column = Annotated[list[float], Field(fail_fast=True)]
Direction = Annotated[list[float], Field(min_length=3, max_length=3, fail_fast=True)]
Directions = Annotated[list[Direction], Field(fail_fast=True)]
Rows = Annotated[list[Column], Field(min_length=1, fail_fast=True)]
# the tags never reach a user: errors.py drops them from the path to the offending field
PerChannel = Annotated[
    Annotated[float, Tag("<number>")] | Annotated[list[float], Tag("<numbers>")],
    Discriminator(lambda value: "<numbers>" if isinstance(value, list) else "<number>"),
]


class Body(BaseModel):
    """What a client sends."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


class View(BaseModel):
    """What the service answers; a client reads on when later versions add to it."""

    model_config = ConfigDict(extra="allow", frozen=True)


class InlineSamples(Body):
    """Measured samples, one row each: directions as unit vectors (`wi`, `wo`) or as the four angles, and values.

    `wi` points to the light, `wo` to the viewer, z along the normal; the mirror of azimuth phi is phi + 180.
    """

    wi: Directions | None = Field(None, description="unit vectors to the light")
    wo: Directions | None = Field(None, description="unit vectors to the viewer")
    theta_i_deg: Column | None = Field(None, description="polar angle of wi [degrees]")
    phi_i_deg: Column | None = Field(None, description="azimuth of wi [degrees]")
    theta_o_deg: Column | None = Field(None, description="polar angle of wo [degrees]")
    phi_o_deg: Column | None = Field(None, description="azimuth of wo [degrees]")
    values: Rows = Field(description="one row a sample, one number a channel, in the declared quantity")
    quantity: str = Field(description="what values are: brdf [1/sr], brdf_cos [1/sr] or reflectance_factor [1]")
    channels: list[str] | None = Field(None, description="a name for each channel")
    sigma: Rows | None = Field(None, description="standard deviations, shaped and declared as values are")
    weight: Column | None = Field(None, description="factor of each sample in every loss")
    cell: Column | None = Field(None, description="measure of each sample's grid cell [sr^2]")
    azimuth_observed: bool | None = Field(None, description="whether the sample was turned; the data say, if absent")

    @model_validator(mode="after")
    def _one_geometry(self) -> Self:
        vectors = (self.wi, self.wo)
        angles = (self.theta_i_deg, self.phi_i_deg, self.theta_o_deg, self.phi_o_deg)
        full = [all(part is not None for part in parts) for parts in (vectors, angles)]
        some = [any(part is not None for part in parts) for parts in (vectors, angles)]
        if full != some or sum(full) != 1:
            raise ValueError(
                "Expected samples to have either wi and wo, or theta_i_deg, phi_i_deg, theta_o_deg and phi_o_deg. "
                "Give one of the two, in full."
            )
        for name, rows in (("values", self.values), ("sigma", self.sigma or [])):
            for number, row in enumerate(rows):
                if len(row) != len(rows[0]) or not row:
                    raise ValueError(
                        f"Expected samples.{name} to hold one number a channel in each row, got {len(row)} in row "
                        f"{number} and {len(rows[0])} in row 0. Give every row the same channels."
                    )
        return self


class FitRequest(Body):
    """What to fit to which data; data is either the id of a dataset or inline samples."""

    dataset: str | None = Field(None, description="id that POST /v1/datasets gave")
    samples: InlineSamples | None = None
    model: str = Field(min_length=1, max_length=2000, description="for example lambert + ward_bounded")
    loss: str = "cosine"
    optimizer: str = "auto"
    fixed: dict[str, PerChannel] = Field({}, description='held values, such as {"kurt.f0": 0.04}')
    gray: list[str] = Field([], description="keys that keep one value over all channels")
    per_channel: list[str] = Field([], description="keys that get one value a channel")
    seed: int = Field(0, ge=0, lt=2**63)

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.dataset is None) == (self.samples is None):
            raise ValueError("Expected either dataset or samples to be given. Give exactly one of them.")
        return self


class SamplesView(View):
    """What stands in for inline samples when a request is shown again."""

    count: int
    hash: str


class RequestView(View):
    """A fit's request as it was accepted, without its inline samples."""

    dataset: str | None
    samples: SamplesView | None
    model: str
    loss: str
    optimizer: str
    fixed: dict[str, float | list[float]]
    gray: list[str]
    per_channel: list[str]
    seed: int


class ProgressView(View):
    """How far a running fit is."""

    stage: str
    fraction: float
    loss: float | None


class CostView(View):
    """What a fit took."""

    seconds: float
    evaluations: int
    iterations: int
    starts: int
    optimizer: str


Interval = tuple[float, float] | None


class FitOutcome(View):
    """A finished fit, exactly as `Fit.to_dict()` gives it; null where there is no finite number."""

    model: str
    material_text: str
    material: dict[str, Any]
    loss: str
    objective: float | None
    status: Literal["converged", "stopped_early"]
    message: str
    parameters: dict[str, float | list[float | None] | None]
    standard_errors: dict[str, float | list[float | None] | None]
    intervals: dict[str, Interval | list[Interval]]
    units: dict[str, str]
    errors: dict[str, float | None]
    undetermined: list[str]
    choices: list[str]
    fixed: list[str]
    gray: list[str]
    per_channel: list[str]
    chi_square: tuple[float, int] | None = Field(description="and its degrees of freedom, where sigma is known")
    cost: CostView
    channels: list[str]
    data: dict[str, Any]
    provenance: dict[str, Any]
    report: str = Field(description="all of this as plain text, for people")


class FitSummary(View):
    """A fit without its result, as the list shows it."""

    id: str
    status: JobStatus
    progress: ProgressView | None
    request: RequestView
    error: str | None = Field(description="why it failed, in one sentence")
    attempts: int = Field(description="how often it was started")
    created: datetime
    started: datetime | None
    finished: datetime | None


class FitView(FitSummary):
    """A fit and, once it has succeeded, its result."""

    result: FitOutcome | None


class FitPage(View):
    """Fits, newest first; `next` is the cursor of the page that follows."""

    items: list[FitSummary]
    next: str | None


class DatasetView(View):
    """An uploaded file that was read in full."""

    id: str
    bytes: int
    sha256: str
    declared: dict[str, str | None] = Field(description="format, quantity and angle_unit as the upload declared them")
    created: datetime
    report: dict[str, Any] = Field(description="what the samples are, what was masked and why")


class ModelView(View):
    """A model of the registry, as its own file describes it."""

    name: str
    summary: str
    text: str = Field(description="formula, symbols and source")
    options: list[list[str]] = Field(description="groups of words; the first of a group is the default")
    parameters: list[dict[str, Any]]


class ModelList(View):
    """Every model that the text of a fit may name."""

    items: list[ModelView]


class HealthView(View):
    """A sign of life."""

    status: str


class FieldError(View):
    """One thing that is wrong with a request."""

    field: str
    message: str


class Problem(View):
    """An error, as RFC 9457 writes it; `field` names the input at fault, `errors` each of several."""

    type: str = "about:blank"
    title: str
    status: int
    detail: str
    field: str | None = None
    errors: list[FieldError] | None = None
