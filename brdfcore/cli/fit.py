"""`brdf fit FILE --model TEXT`: fits a measured file and prints what came out."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

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

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..fitting import Fit, Progress

T = TypeVar("T")

_TITLES = {"lobes": "Lobe plot", "residuals": "Residuals"}


def command(
    file: FileArgument,
    model: Annotated[
        str, typer.Option(help='A material, as in "lambert + ward_bounded", or auto.', show_default=False)
    ],
    loss: Annotated[str, typer.Option(help="cosine, l2, log, cube_root or relative.")] = "cosine",
    optimizer: Annotated[str, typer.Option(help="auto, least_squares, lbfgs or adam.")] = "auto",
    fixed: Annotated[list[str] | None, typer.Option(help="KEY=VALUE to keep, as kurt.f0=0.04; repeatable.")] = None,
    gray: Annotated[list[str] | None, typer.Option(help="A key with one value for all channels; repeatable.")] = None,
    per_channel: Annotated[list[str] | None, typer.Option(help="An f0 with a value a channel; repeatable.")] = None,
    seed: Annotated[int, typer.Option(help="Of the scan for starts.")] = 0,
    bounds: Annotated[list[str] | None, typer.Option(help="KEY=LOW:HIGH within KEY's box; repeatable.")] = None,
    robust: Annotated[str | None, typer.Option(help="soft_l1 or cauchy: outliers count less.")] = None,
    robust_scale: Annotated[float | None, typer.Option(help="Residual from which they do; else the data say.")] = None,
    max_theta_deg: Annotated[float | None, typer.Option(help="Leave steeper samples out [degrees].")] = None,
    conserve_energy: Annotated[bool, typer.Option("--conserve-energy", help="Keep every albedo at 1 or less.")] = False,
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
    asked: dict[str, Any] = {
        "model": model,
        "loss": loss,
        "optimizer": optimizer,
        "fixed": dict(_pair(text) for text in fixed or []),
        "gray": gray or (),
        "per_channel": per_channel or (),
        "seed": seed,
        "bounds": dict(_range(text) for text in bounds or []),
        "robust": robust,
        "robust_scale": robust_scale,
        "conserve_energy": conserve_energy,
    }
    declared: dict[str, Any] = {"format": format_, "quantity": quantity, "angle_unit": angle_unit, "columns": columns}
    declared["rgb"] = rgb
    if server is not None:
        if which is not None:
            from ..errors import InvalidValueError

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

    for path in (plot, residuals):  # what cannot be drawn is refused before the work, not after it
        if path is not None:
            bc.plots.kind_of(path)
            bc.plots.check_scale(scale)
    max_theta = None if max_theta_deg is None else math.radians(max_theta_deg)
    samples = bc.read(file, **declared, material=which)

    def run(progress: "Callable[[Progress], None] | None") -> "Fit":
        return bc.fit(samples, **asked, max_theta=max_theta, progress=progress)

    result = _with_bar(run)
    typer.echo(json.dumps(result.to_dict(), indent=2) if as_json else result.report())
    if plot is not None:
        figure = bc.plots.lobes(result.material, samples, scale=scale, channel=channel)
        typer.echo(f"{_TITLES['lobes']}: {bc.plots.save(figure, plot)}", err=as_json)
    if residuals is not None:
        figure = bc.plots.residuals(result, channel=channel)
        typer.echo(f"{_TITLES['residuals']}: {bc.plots.save(figure, residuals)}", err=as_json)


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
            fit = _with_bar(lambda progress: client.fit(file, **asked, progress=progress))
            typer.echo(fit.result.model_dump_json(indent=2) if as_json else fit.report())
            for name, path, kind, drawn in wanted:
                path.write_bytes(fit.plot(name, kind, **drawn))
                typer.echo(f"{_TITLES[name]}: {path}", err=as_json)
    except ClientError as error:
        raise BrdfError(str(error)) from error


def _pair(text: str) -> tuple[str, float]:
    """The key and the number of KEY=VALUE."""
    from ..errors import ParameterError

    key, _, value = text.partition("=")
    try:
        return key.strip(), float(value)
    except ValueError as error:
        raise ParameterError(
            f"Expected --fixed to be KEY=NUMBER, got {text!r}. Write it like kurt.f0=0.04.", field="fixed"
        ) from error


def _range(text: str) -> tuple[str, tuple[float, float]]:
    """The key and the two numbers of KEY=LOW:HIGH."""
    from ..errors import ParameterError

    key, _, ends = text.partition("=")
    low, _, high = ends.partition(":")
    try:
        return key.strip(), (float(low), float(high))
    except ValueError as error:
        raise ParameterError(
            f"Expected --bounds to be KEY=LOW:HIGH, got {text!r}. Write it like ggx.a=0.1:0.3.", field="bounds"
        ) from error


def _with_bar(run: "Callable[[Callable[[Any], None] | None], T]") -> T:
    """The result of `run`, which gets a progress callback; the bar shows on a terminal's error output only."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        return run(None)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("loss {task.fields[loss]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("scan", total=1.0, loss="")
        return run(lambda p: bar.update(task, description=p.stage, completed=p.fraction, loss=f"{p.loss:.6g}"))
