"""`brdf fit FILE --model TEXT`: fits a measured file and prints what came out."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..fitting import Fit, Progress
    from ..fitting.held_out import HeldOut
    from ..formats.samples import Samples

_TITLES = {"lobes": "Lobe plot", "residuals": "Residuals"}


def command(
    file: FileArgument,
    model: Annotated[
        str, typer.Option(help='A material, as in "lambert + ward_bounded", or auto.', show_default=False)
    ],
    loss: Annotated[str, typer.Option(help="cosine, l2, log, cube_root or relative.")] = "cosine",
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
    held_out: Annotated[
        bool, typer.Option("--held-out", help="Also print the error at incidences that were left out.")
    ] = False,
    following: Annotated[
        int | None, typer.Option("--next", help="Also print so many directions to measure next.", show_default=False)
    ] = None,
    format_: FormatOption = None,
    quantity: QuantityOption = None,
    angle_unit: AngleUnitOption = None,
    columns: ColumnsOption = None,
    which: MaterialOption = None,
    rgb: RgbOption = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Write the lobe plot to this .svg or .png file.")] = None,
    residuals: Annotated[Path | None, typer.Option(help="Write the residuals by angle to this .svg or .png.")] = None,
    scale: Annotated[str, typer.Option(help="Of the plot's radius: linear, cube_root or log.")] = "linear",
    channel: Annotated[str | None, typer.Option(help="The channel that is plotted; else the brightest.")] = None,
    server: Annotated[str | None, typer.Option(help="Let the service at this URL do the work.")] = None,
    api_key: Annotated[str | None, typer.Option(envvar="BRDF_API_KEY", help="The key that it asks for.")] = None,
) -> None:
    """Fit a material to a measured file; print parameters with 95 % intervals, errors and cost."""
    from ..errors import InvalidValueError, unknown_name

    asked: dict[str, Any] = {
        "model": model,
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
        "conserve_energy": conserve_energy,
    }
    declared: dict[str, Any] = {"format": format_, "quantity": quantity, "angle_unit": angle_unit, "columns": columns}
    declared["rgb"] = rgb
    max_theta = radians(max_theta_deg)
    if server is not None:
        for option, given in (("--held-out", held_out), ("--next", following is not None)):
            if given:
                raise InvalidValueError(
                    f"Expected {option} to go without --server, which does not serve it, got both. Drop one.",
                    field=option.strip("-").replace("-", "_"),
                )
        if which is not None:
            raise InvalidValueError(
                "Expected --material to go without --server, which takes files of one material, got both. "
                "Send what `brdf convert` makes of the file.",
                field="material",
            )
        drawn = {"scale": scale, "channel": channel}
        images = {"lobes": (plot, drawn), "residuals": (residuals, {"channel": channel})}
        _remote(server, api_key, file, asked | declared | {"max_theta_deg": max_theta_deg}, as_json, images)
        return
    import brdfcore as bc

    from ..fitting.next_directions import check_count

    for path in (plot, residuals):  # what cannot be drawn is refused before the work, not after it
        if path is not None:
            bc.plots.kind_of(path)
            bc.plots.check_scale(scale)
    samples = bc.read(file, **declared, material=which)
    if channel is not None and channel not in samples.channels:
        raise unknown_name("a channel", channel, samples.channels, field="channel")
    asked["max_theta"] = max_theta

    def run(progress: "Callable[[Progress], None] | None") -> "Fit":
        return bc.fit(samples, **asked, progress=progress)

    if following is not None:
        check_count(following)
    result = with_bar(run)
    more: dict[str, Any] = {}
    if held_out:
        more["held_out"] = _foretold(samples, asked, result)
    if following is not None:
        more["next_directions"] = bc.next_directions(result, following)
    if as_json:
        typer.echo(json.dumps(result.to_dict() | {name: one.to_dict() for name, one in more.items()}, indent=2))
    else:
        typer.echo("\n\n".join([result.report(), *map(str, more.values())]))
    if plot is not None:
        figure = bc.plots.lobes(result.material, samples, scale=scale, channel=channel)
        typer.echo(f"{_TITLES['lobes']}: {bc.plots.save(figure, plot)}", err=as_json)
    if residuals is not None:
        figure = bc.plots.residuals(result, channel=channel)
        typer.echo(f"{_TITLES['residuals']}: {bc.plots.save(figure, residuals)}", err=as_json)


def _foretold(samples: "Samples", asked: dict[str, Any], result: "Fit") -> "HeldOut":
    """The held-out errors of the material that was fitted, which "auto" may have chosen."""
    import brdfcore as bc

    from ..fitting.asked import own

    asked = asked | {"model": result.model if result.ladder else asked["model"], "robust_scale": result.robust_scale}
    return with_bar(lambda progress: bc.held_out(samples, progress=progress, **own(asked, result.form)))


def _remote(
    server: str,
    api_key: str | None,
    file: Path,
    asked: dict[str, Any],
    as_json: bool,
    images: dict[str, tuple[Path | None, dict[str, Any]]],
) -> None:
    """The same, done by a service."""
    from service.client import Client, ClientError

    from .. import plots
    from ..errors import BrdfError

    wanted = [(name, path, plots.kind_of(path), drawn) for name, (path, drawn) in images.items() if path is not None]
    try:
        with Client(server, api_key) as client:
            fit = with_bar(lambda progress: client.fit(file, **asked, progress=progress))
            typer.echo(fit.result.model_dump_json(indent=2) if as_json else fit.report())
            for name, path, kind, drawn in wanted:
                path.write_bytes(fit.plot(name, kind, **drawn))
                typer.echo(f"{_TITLES[name]}: {path}", err=as_json)
    except ClientError as error:
        raise BrdfError(str(error)) from error
