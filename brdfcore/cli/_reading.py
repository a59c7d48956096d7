"""What every command that reads a measured file asks: the file, and what it does not say of itself."""

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

FileArgument: TypeAlias = Annotated[
    Path, typer.Argument(help="A measured file of any known format.", show_default=False)
]
FormatOption: TypeAlias = Annotated[
    str | None, typer.Option("--format", help="Insist on a format; else its content tells.")
]
QuantityOption: TypeAlias = Annotated[
    str | None, typer.Option(help="brdf, brdf_cos or reflectance_factor, where the file does not say.")
]
AngleUnitOption: TypeAlias = Annotated[
    str | None, typer.Option(help="degrees or radians, where the file does not say.")
]
ColumnsOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        help="Names of a table's columns, as theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value, if it lacks them."
    ),
]
RgbOption: TypeAlias = Annotated[
    bool, typer.Option("--rgb", help="Turn a spectrum into red, green and blue, which renderers take.")
]
MaterialOption: TypeAlias = Annotated[
    str | None, typer.Option("--material", help="Which one, where a file holds several (CUReT: 1 to 61).")
]
