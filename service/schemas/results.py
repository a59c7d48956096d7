"""What a fit found, exactly as the library's own `to_dict()` gives it."""

from typing import Any, Literal

from pydantic import Field

from ._base import View


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
    error: float | None = Field(description="claimed for it [1]")
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
FitStatus = Literal["converged", "undetermined", "stopped_early"]


class RungView(View):
    """A material that was tried on the way to the chosen one, and how it did."""

    effect: str
    model: str
    error: float | None = Field(description="root mean square of the loss's residuals")
    held_out: float | None = Field(description="the same at incidences that were left out, their geometric mean")
    criterion: float | None = Field(description="below 0 it asks for the richer of the two materials compared [1]")
    parameters: int
    seconds: float
    kept: bool
    reason: str


class OptionsView(View):
    """What a fit was asked beside model, loss, seed and which values are fixed, gray or one a channel."""

    bounds: dict[str, tuple[float, float]]
    starts: list[dict[str, float | list[float]]] = Field(description="every value of each start that was given")
    robust: str | None
    robust_scale: float | None = Field(description="that was used: in the residual's unit, in sigma where weighed")
    max_theta_deg: float | None
    conserve_energy: bool


class FitOutcome(View):
    """A finished fit, exactly as `Fit.to_dict()` gives it; null where there is no finite number."""

    model: str
    material_text: str
    material: dict[str, Any]
    loss: str
    weighed: bool | None = Field(None, description="whether the samples' sigma weighed the loss")
    options: OptionsView | None = None
    objective: float | None
    status: FitStatus = Field(description="undetermined: converged, but the data leave some values free")
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
    status: FitStatus
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
