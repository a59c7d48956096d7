"""What every body of the wire contract is made of.

Numbers are strict going in: no booleans, no numeric strings, no NaN or Infinity, no unknown fields. Angles are in
degrees and their names end in `_deg`; the BRDF is in 1/sr and never includes the cosine.
"""

from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

# fail_fast: of 10,000 bad rows the first is named, and the others take no time
Column = Annotated[list[float], Field(fail_fast=True)]
Direction = Annotated[list[float], Field(min_length=3, max_length=3, fail_fast=True)]
Directions = Annotated[list[Direction], Field(min_length=1, fail_fast=True)]
Angles = Annotated[list[float], Field(min_length=1, fail_fast=True)]
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
