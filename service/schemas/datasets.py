"""Measured samples, inline or as an uploaded file, and the formats that are read."""

from datetime import datetime
from typing import Any, Self

from pydantic import Field, model_validator

from ._base import Column, DirectionPairs, Rows, View


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


class DatasetView(View):
    """An uploaded file that was read in full."""

    id: str
    bytes: int
    sha256: str
    declared: dict[str, str | bool | None] = Field(
        description="format, quantity, angle_unit, columns and rgb as the upload declared them"
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


class FormatView(View):
    """A format of measured files; an uploaded file is told by its content to have it."""

    name: str = Field(description="what `format` takes, to insist on it")
    description: str
    uploads: bool = Field(description="whether one file holds it all, so that it can be uploaded")


class FormatList(View):
    """Every format of measured files that is read."""

    items: list[FormatView]
