"""`brdf compare FILE`: fits several models to a measured file and ranks them under every loss."""

import json
from pathlib import Path
from typing import Annotated

import typer

from ._reading import (
    AngleUnitOption,
    ColumnsOption,
    FileArgument,
    FormatOption,
    MaterialOption,
    QuantityOption,
    RgbOption,
)
from .fit import _pair, _with_bar


def command(
    file: FileArgument,
    models: Annotated[
        list[str] | None,
        typer.Option(help='A material, as in "lambert + kurt"; repeatable. By default Lambert with each lobe.'),
    ] = None,
    loss: Annotated[str, typer.Option(help="The loss that is minimised, and ranked by.")] = "cosine",
    losses: Annotated[list[str] | None, typer.Option(help="A loss to show; repeatable. By default all.")] = None,
    fixed: Annotated[list[str] | None, typer.Option(help="KEY=VALUE to keep, as kurt.f0=0.04; repeatable.")] = None,
    gray: Annotated[list[str] | None, typer.Option(help="A key with one value for all channels; repeatable.")] = None,
    seed: Annotated[int, typer.Option(help="Of the scan for starts.")] = 0,
    format_: FormatOption = None,
    quantity: QuantityOption = None,
    angle_unit: AngleUnitOption = None,
    columns: ColumnsOption = None,
    which: MaterialOption = None,
    rgb: RgbOption = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with each model's fit.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Draw the errors to this .svg or .png file.")] = None,
) -> None:
    """Fit several models to a measured file; print every model's error under every loss, the best first."""
    import brdfcore as bc

    from ..fitting.comparison import check_losses

    check_losses(losses or ())
    if plot is not None:  # what cannot be drawn is refused before the work, not after it
        bc.plots.kind_of(plot)
    declared = {"format": format_, "quantity": quantity, "angle_unit": angle_unit, "columns": columns}
    samples = bc.read(file, **declared, material=which, rgb=rgb)
    result = _with_bar(
        lambda progress: bc.compare(
            samples,
            models or None,
            loss=loss,
            progress=progress,
            fixed=dict(_pair(text) for text in fixed or []),
            gray=gray or (),
            seed=seed,
        )
    )
    typer.echo(json.dumps(result.to_dict(), indent=2) if as_json else result.report(losses))
    if plot is not None:
        figure = bc.plots.comparison(result, losses, title=f"{file.name}: {len(samples)} samples")
        typer.echo(f"Plot: {bc.plots.save(figure, plot)}", err=as_json)
