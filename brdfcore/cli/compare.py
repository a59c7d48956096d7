"""`brdf compare FILE`: fits several models to a measured file and ranks them under every loss."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from ._asking import (
    BoundsOption,
    ConserveOption,
    FixedOption,
    GrayOption,
    MaxThetaOption,
    OptimizerOption,
    PerChannelOption,
    RobustOption,
    RobustScaleOption,
    SeedOption,
    StartsOption,
    fixed_values,
    further_starts,
    radians,
    ranges,
    with_bar,
)
from ._reading import (
    AngleUnitOption,
    ColumnsOption,
    FileArgument,
    FormatOption,
    MaterialOption,
    QuantityOption,
    RgbOption,
)


def command(
    file: FileArgument,
    models: Annotated[
        list[str] | None,
        typer.Option(help='A material, as in "lambert + kurt"; repeatable. By default Lambert with each lobe.'),
    ] = None,
    loss: Annotated[str, typer.Option(help="The loss that is minimised, and ranked by.")] = "cosine",
    losses: Annotated[list[str] | None, typer.Option(help="A loss to show; repeatable. By default all.")] = None,
    optimizer: OptimizerOption = "auto",
    fixed: FixedOption = None,
    gray: GrayOption = None,
    per_channel: PerChannelOption = None,
    seed: SeedOption = 0,
    bounds: BoundsOption = None,
    starts: StartsOption = None,
    robust: RobustOption = None,
    robust_scale: RobustScaleOption = None,
    max_theta_deg: MaxThetaOption = None,
    conserve_energy: ConserveOption = False,
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
    asked: dict[str, Any] = {
        "loss": loss,
        "optimizer": optimizer,
        "fixed": fixed_values(fixed),
        "gray": gray or (),
        "per_channel": per_channel or (),
        "seed": seed,
        "bounds": ranges(bounds),
        "starts": further_starts(starts),
        "robust": robust,
        "robust_scale": robust_scale,
        "max_theta": radians(max_theta_deg),
        "conserve_energy": conserve_energy,
    }
    samples = bc.read(file, **declared, material=which, rgb=rgb)
    result = with_bar(lambda progress: bc.compare(samples, models or None, progress=progress, **asked))
    typer.echo(json.dumps(result.to_dict(), indent=2) if as_json else result.report(losses))
    if plot is not None:
        figure = bc.plots.comparison(result, losses, title=f"{file.name}: {len(samples)} samples")
        typer.echo(f"Plot: {bc.plots.save(figure, plot)}", err=as_json)
