"""The wire contract: every body that the service reads or writes. Needs pydantic only, so clients import it too.

Numbers are strict going in: no booleans, no numeric strings, no NaN or Infinity, no unknown fields. Angles are in
degrees and their names end in `_deg`; the BRDF is in 1/sr and never includes the cosine.
"""

import math
from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

JobKind = Literal["fit", "albedo_table"]
JobStatus = Literal["queued", "running", "succeeded", "failed", "cancelled"]
FINISHED: tuple[JobStatus, ...] = ("succeeded", "failed", "cancelled")

# fail_fast: of 10,000 bad rows the first is named, and the others take no time
Column = Annotated[list[float], Field(fail_fast=True)]
Direction = Annotated[list[float], Field(min_length=3, max_length=3, fail_fast=True)]
Directions = Annotated[list[Direction], Field(min_length=1, fail_fast=True)]
Angles = Annotated[list[float], Field(min_length=1, fail_fast=True)]
Theta = Annotated[float, Field(ge=0, lt=90)]
Range = Annotated[list[float], Field(min_length=2, max_length=2)]
Rows = Annotated[list[Column], Field(min_length=1, fail_fast=True)]
# the tags never reach a user: errors.py drops them from the path to the offending field
PerChannel = Annotated[
    Annotated[float, Tag("<number>")] | Annotated[list[float], Tag("<numbers>")],
    Discriminator(lambda value: "<numbers>" if isinstance(value, list) else "<number>"),
]


MaterialText = Annotated[str, Field(min_length=1, max_length=2000), Tag("<text>")]
# a text, a preset's name, or the JSON that a fit's result holds as `material`
MaterialIn = Annotated[
    MaterialText | Annotated[dict[str, Any], Tag("<json>")],
    Discriminator(lambda value: "<json>" if isinstance(value, dict) else "<text>"),
]


class Body(BaseModel):
    """What a client sends."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


class View(BaseModel):
    """What the service answers; a client reads on when later versions add to it."""

    model_config = ConfigDict(extra="allow", frozen=True)


class ProgressView(View):
    """How far a running job is; only a fit has a loss."""

    stage: str
    fraction: float
    loss: float | None


class ProgressEvent(View):
    """How a job stands, as its events tell it."""

    status: JobStatus
    progress: ProgressView | None
    error: str | None
    attempts: int


class JobView(View):
    """What every job shows of itself."""

    id: str
    status: JobStatus
    progress: ProgressView | None
    error: str | None = Field(description="why it failed, in one sentence")
    attempts: int = Field(description="how often it was started")
    reused: str | None = Field(None, description="the earlier job of the same work, whose result this is")
    created: datetime
    started: datetime | None
    finished: datetime | None


class DirectionPairs(Body):
    """Pairs of directions, one row each: unit vectors (`wi`, `wo`) or the four angles.

    `wi` points to the light, `wo` to the viewer, z along the normal; the mirror of azimuth phi is phi + 180.
    """

    wi: Directions | None = Field(None, description="unit vectors to the light")
    wo: Directions | None = Field(None, description="unit vectors to the viewer")
    theta_i_deg: Angles | None = Field(None, description="polar angle of wi [degrees]")
    phi_i_deg: Angles | None = Field(None, description="azimuth of wi [degrees]")
    theta_o_deg: Angles | None = Field(None, description="polar angle of wo [degrees]")
    phi_o_deg: Angles | None = Field(None, description="azimuth of wo [degrees]")

    @model_validator(mode="after")
    def _one_geometry(self) -> Self:
        vectors = (self.wi, self.wo)
        angles = (self.theta_i_deg, self.phi_i_deg, self.theta_o_deg, self.phi_o_deg)
        full = [all(part is not None for part in parts) for parts in (vectors, angles)]
        some = [any(part is not None for part in parts) for parts in (vectors, angles)]
        if full != some or sum(full) != 1:
            raise ValueError(
                "Expected directions as either wi and wo, or theta_i_deg, phi_i_deg, theta_o_deg and phi_o_deg. "
                "Give one of the two, in full."
            )
        return self


class InlineSamples(DirectionPairs):
    """Measured samples, one row each: a pair of directions and the values measured there."""

    values: Rows = Field(description="one row a sample, one number a channel, in the declared quantity")
    quantity: str = Field(description="what values are: brdf [1/sr], brdf_cos [1/sr] or reflectance_factor [1]")
    channels: list[str] | None = Field(None, description="a name for each channel")
    sigma: Rows | None = Field(None, description="standard deviations, shaped and declared as values are")
    weight: Column | None = Field(None, description="factor of each sample in every loss")
    cell: Column | None = Field(None, description="measure of each sample's grid cell [sr^2]")
    azimuth_observed: bool | None = Field(None, description="whether the sample was turned; the data say, if absent")

    @model_validator(mode="after")
    def _same_channels(self) -> Self:
        for name, rows in (("values", self.values), ("sigma", self.sigma or [])):
            for number, row in enumerate(rows):
                if len(row) != len(rows[0]) or not row:
                    raise ValueError(
                        f"Expected samples.{name} to hold one number a channel in each row, got {len(row)} in row "
                        f"{number} and {len(rows[0])} in row 0. Give every row the same channels."
                    )
        return self


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


class EvaluationRequest(DirectionPairs):
    """A material, and the pairs of directions at which it is evaluated."""

    material: MaterialIn = Field(description="text, name of a preset, or a material's JSON")


class EvaluationView(View):
    """A material's values, one row a pair of directions, one column a channel; null where there is no finite number."""

    material: str = Field(description="the text that was evaluated, all values in it")
    f: list[list[float | None]] = Field(description="the BRDF, without the cosine [1/sr]")
    pdf: list[float | None] = Field(description="density with which wi is sampled for wo [1/sr]")
    weight: list[list[float | None]] = Field(description="f cos theta_i / pdf, 0 where pdf is 0 [1]")


class AlbedoRequest(Body):
    """A material, and either the angles of which albedos are given at once, or the axes of a table, which is a job."""

    material: MaterialIn = Field(description="text, name of a preset, or a material's JSON")
    theta_deg: Annotated[list[Theta], Field(min_length=1, fail_fast=True)] | None = Field(
        None, description="polar angles [degrees]; values are given at once"
    )
    phi_deg: float = Field(0.0, description="azimuth of the values [degrees]")
    axes: dict[str, Range | None] | None = Field(
        None,
        description='axes of a table, such as {"theta_deg": [0, 85], "kurt.m": null}; null is the usual range. '
        "theta_deg is always an axis, to the horizon unless it is given an end",
    )
    tolerance: float | None = Field(
        None, ge=1e-12, le=0.1, description="largest error, as a share of max(1, albedo); 1e-6, and 1e-4 for a table"
    )

    @model_validator(mode="after")
    def _values_or_table(self) -> Self:
        if (self.theta_deg is None) == (self.axes is None):
            raise ValueError(
                "Expected either theta_deg, for values, or axes, for a table, to be given. Give exactly one of them."
            )
        return self


class AlbedoView(View):
    """Directional albedos, one row an angle, one column a channel; null where there is no finite number."""

    material: str = Field(description="the text that was integrated, all values in it")
    theta_deg: list[float]
    phi_deg: float
    values: list[list[float | None]] = Field(description="directional albedos [1]")
    error: list[list[float | None]] = Field(description="the error claimed for each [1]")
    tolerance: float
    met: bool = Field(description="whether every claimed error is at most tolerance * max(1, value)")
    method: str
    evaluations: int = Field(description="directions at which lobes were evaluated")
    seconds: float


class TableRequestView(View):
    """A table's request as it was accepted."""

    material: str
    axes: dict[str, list[float] | None]
    tolerance: float


class AxisView(View):
    """An axis of a table; the names of angles end in _deg, and their ends are in degrees."""

    name: str
    low: float
    high: float
    nodes: int


class TableOutcome(View):
    """A finished table, without its numbers: GET /v1/albedo/{table_id}/table sends those."""

    hash: str = Field(description="of what made it: version, material, axes and tolerance")
    axes: list[AxisView]
    channels: int
    tolerance: float
    error: float = Field(description="claimed, with interpolation, as a share of max(1, albedo)")
    met: bool = Field(description="whether error is at most tolerance")
    evaluations: int
    seconds: float = Field(description="that making it took, once; the same table is not made again")


class TableSummary(JobView):
    """A table's job without its result, as the list shows it."""

    request: TableRequestView


class TableView(TableSummary):
    """A table's job and, once it has succeeded, what came out."""

    result: TableOutcome | None


class TablePage(View):
    """Tables, newest first; `next` is the cursor of the page that follows."""

    items: list[TableSummary]
    next: str | None


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
    bounds: dict[str, list[float]] = {}
    starts: list[dict[str, float | list[float]]] = []
    robust: str | None = None
    robust_scale: float | None = None
    max_theta_deg: float | None = None
    conserve_energy: bool = False


class CostView(View):
    """What a fit took."""

    seconds: float
    evaluations: int
    iterations: int
    starts: int
    optimizer: str


class CertificateView(View):
    """Whether the fitted material could exist, exactly as `Certificate.to_dict()` gives it; null where infinite."""

    verdict: str = Field(description="the finding in plain sentences")
    energy_conserving: bool
    decided: bool = Field(description="whether the claimed error leaves no doubt of that")
    max_albedo: float | None = Field(description="the largest directional albedo [1]")
    error: float = Field(description="claimed for it [1]")
    at_theta_deg: float = Field(description="where it is; 90 is the limit towards grazing")
    at_phi_deg: float
    channel: int
    grazing_limit: float | None
    grazing_exponent: float = Field(description="e of albedo ~ (cos theta)^-e; 0 where there is a limit")
    exceeds_deg: tuple[float, float] | None = Field(description="first and last angle with an albedo above 1")
    largest_before: float | None
    reciprocal: bool
    reciprocity_error: float
    min_value: float = Field(description="the smallest BRDF met [1/sr]")
    pairs: int
    tolerance: float
    evaluations: int
    seconds: float


class ConservationView(View):
    """What it took to keep every albedo at 1 or below, and what that cost in error."""

    free_objective: float = Field(description="the objective of the free optimum")
    free_max_albedo: float | None = Field(description="its largest albedo [1]; null where infinite")
    fixed: list[str] = Field(description="keys fixed where the albedo has a limit towards grazing")
    directions: int = Field(description="at which albedos are held at 1")
    seconds: float


Interval = tuple[float, float] | None


class RungView(View):
    """A material that was tried on the way to the chosen one, and how it did."""

    effect: str
    model: str
    error: float | None = Field(description="root mean square of the loss's residuals")
    held_out: float | None = Field(description="the same at incidences that were left out")
    criterion: float | None = Field(description="below 0 it asks for the richer of the two materials compared [1]")
    parameters: int
    seconds: float
    kept: bool
    reason: str


class FitOutcome(View):
    """A finished fit, exactly as `Fit.to_dict()` gives it; null where there is no finite number."""

    model: str
    material_text: str
    material: dict[str, Any]
    loss: str
    objective: float | None
    status: Literal["converged", "undetermined", "stopped_early"] = Field(
        description="undetermined: converged, but the data leave some values free"
    )
    message: str
    parameters: dict[str, float | list[float | None] | None]
    standard_errors: dict[str, float | list[float | None] | None]
    intervals: dict[str, Interval | list[Interval]]
    units: dict[str, str]
    errors: dict[str, float | None]
    undetermined: list[str] = Field(
        description='what the data leave free: keys, or "key with key" where only the combination is determined'
    )
    combinations: list[dict[str, float]] = Field(
        description="for each such combination, how its values change together, in their units, of length 1"
    )
    singular_values: list[float] = Field(description="of the Jacobian, its columns scaled to length 1, falling")
    covariance_keys: list[str] = Field(description="the rows and columns of covariance and correlations")
    covariance: list[list[float]] | None = Field(description="in the parameters' units; null for none or more than 32")
    correlations: list[list[float]] | None
    warnings: list[str] = Field(description="what the data cannot show of this model, a sentence each")
    choices: list[str]
    fixed: list[str]
    gray: list[str]
    per_channel: list[str]
    chi_square: tuple[float, int] | None = Field(description="and its degrees of freedom, where sigma is known")
    certificate: CertificateView
    conservation: ConservationView | None = Field(description="where conserve_energy was asked for")
    cost: CostView
    channels: list[str]
    data: dict[str, Any]
    provenance: dict[str, Any]
    ladder: list[RungView] = Field([], description="the materials that were tried, where the fit chose among several")
    report: str = Field(description="all of this as plain text, for people")


class RankedView(View):
    """One of the models that were compared, with its fit."""

    rank: int
    model: str
    errors: dict[str, float | None]
    objective: float | None
    status: Literal["converged", "stopped_early"]
    message: str
    undetermined: list[str]
    parameters: int = Field(description="free values, channels counted")
    seconds: float
    fit: FitOutcome


class ComparisonView(View):
    """Several models at the same samples, that with the lowest minimised loss first."""

    loss: str
    ranking: list[RankedView]
    seconds: float
    report: str


class ComparedOutcome(FitOutcome):
    """The best of several models' fits, and the comparison of all."""

    comparison: ComparisonView


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


class BatchRow(View):
    """One fit of a batch, in the order of datasets, then of models."""

    dataset: str
    model: str
    fit: str = Field(description="id of the fit")
    status: JobStatus
    fit_status: Literal["converged", "undetermined", "stopped_early"] | None
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
    fraction: float = Field(description="of the work that is done")
    counts: dict[JobStatus, int]


class BatchTable(View):
    """The fits of a batch."""

    rows: list[BatchRow]


class BatchPage(View):
    """Batches, newest first; `next` is the cursor of the page that follows."""

    items: list[BatchView]
    next: str | None


class DatasetView(View):
    """An uploaded file that was read in full."""

    id: str
    bytes: int
    sha256: str
    declared: dict[str, str | None] = Field(
        description="format, quantity, angle_unit and columns as the upload declared them"
    )
    created: datetime
    report: dict[str, Any] = Field(description="what the samples are, what was masked and why")


class DatasetSamples(View):
    """Measured samples of a dataset, one row each: every `stride`-th of them, from the first on."""

    count: int = Field(description="samples of the dataset")
    stride: int = Field(description="1 where every sample is here")
    channels: list[str]
    theta_i_deg: list[float] = Field(description="polar angle of wi [degrees]")
    phi_i_deg: list[float] = Field(description="azimuth of wi [degrees]")
    theta_o_deg: list[float] = Field(description="polar angle of wo [degrees]")
    phi_o_deg: list[float] = Field(description="azimuth of wo [degrees]")
    values: list[list[float | None]] = Field(description="one column a channel, whatever was uploaded: the BRDF [1/sr]")


class ModelView(View):
    """A model of the registry, as its own file describes it."""

    name: str
    summary: str
    text: str = Field(description="formula, symbols and source")
    options: list[list[str]] = Field(description="groups of words; the first of a group is the default")
    parameters: list[dict[str, Any]]


class PresetView(View):
    """A named material: its name stands for its whole text wherever a material's text is read."""

    name: str
    text: str = Field(description="the material's text")
    summary: str
    source: str


class ModelList(View):
    """Every model that the text of a fit may name, and every preset that may be the text."""

    items: list[ModelView]
    presets: list[PresetView]


class FormatView(View):
    """A format of measured files; an uploaded file is told by its content to have it."""

    name: str = Field(description="what `format` takes, to insist on it")
    description: str
    uploads: bool = Field(description="whether one file holds it all, so that it can be uploaded")


class FormatList(View):
    """Every format of measured files that is read."""

    items: list[FormatView]


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
