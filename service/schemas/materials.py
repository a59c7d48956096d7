"""What a material is worth: models and presets, values at directions, albedos."""

from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from ._base import Body, DirectionPairs, MaterialIn, Range, View
from .results import CertificateView


class ModelView(View):
    """A model of the registry, as its own file describes it."""

    name: str
    good_for: str = Field(description="one sentence for a choice: surfaces that it suits, and where it does not")
    summary: str = Field(description="one sentence: which lobe or diffuse term it is")
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


class EvaluationRequest(DirectionPairs):
    """A material, and the pairs of directions at which it is evaluated."""

    material: MaterialIn = Field(description="text, name of a preset, or a material's JSON")


class EvaluationView(View):
    """A material's values, one row a pair of directions, one column a channel; null where there is no finite number."""

    material: str = Field(description="the text that was evaluated, all values in it")
    f: list[list[float | None]] = Field(description="the BRDF, without the cosine [1/sr]")
    pdf: list[float | None] = Field(description="density with which wi is sampled for wo [1/sr]")
    weight: list[list[float | None]] = Field(description="f cos theta_i / pdf, 0 where pdf is 0 [1]")


Theta = Annotated[float, Field(ge=0, lt=90)]


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
    certificate: bool = Field(False, description="with values: also what a fit's certificate says of the material")

    @model_validator(mode="after")
    def _values_or_table(self) -> Self:
        if (self.theta_deg is None) == (self.axes is None):
            raise ValueError(
                "Expected either theta_deg, for values, or axes, for a table, to be given. Give exactly one of them."
            )
        if self.certificate and self.theta_deg is None:
            raise ValueError("Expected certificate to go with theta_deg, got axes. Ask for values, or leave it out.")
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
    certificate: CertificateView | None = Field(None, description="of the material, where it was asked for")


class SphereRequest(Body):
    """A material, and how the sphere of it is shown."""

    material: MaterialIn = Field(description="text, name of a preset, or a material's JSON")
    channels: Annotated[list[str], Field(min_length=1, max_length=64)] | None = Field(
        None, description="names of the channels: wavelengths in nm make a spectrum, three others red, green and blue"
    )
    channel: int = Field(0, ge=0, description="number of the channel that is shown in gray where they have no colour")
    size: int = Field(160, ge=16, le=512, description="pixels along an edge")
