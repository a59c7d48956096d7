"""`brdf info FILE`: what a measured file is, what it covers, and what was left out of it."""

import json
from pathlib import Path
from typing import Annotated

import typer

from ._reading import AngleUnitOption, ColumnsOption, FileArgument, FormatOption, MaterialOption, QuantityOption


def command(
    file: FileArgument,
    format_: FormatOption = None,
    quantity: QuantityOption = None,
    angle_unit: AngleUnitOption = None,
    columns: ColumnsOption = None,
    which: MaterialOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Draw where the directions lie to this .svg or .png file.")] = None,
) -> None:
    """Say what a measured file is: geometries, angles, channels, values, what is masked and what it can show."""
    import brdfcore as bc

    if plot is not None:  # what cannot be drawn is refused before the work, not after it
        bc.plots.kind_of(plot)
    samples = bc.read(file, format=format_, quantity=quantity, angle_unit=angle_unit, columns=columns, material=which)
    found = bc.info(samples)
    typer.echo(json.dumps(found.to_dict(), indent=2, allow_nan=False) if as_json else found.text())
    if plot is not None:
        typer.echo(f"Plot of the directions: {bc.plots.save(bc.plots.directions(samples), plot)}", err=as_json)
