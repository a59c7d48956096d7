"""`brdf fit FILE --model TEXT`: fits a measured file and prints what came out."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..fitting import Fit, Progress

T = TypeVar("T")


def command(
    file: Annotated[Path, typer.Argument(help="A measured file of any known format.", show_default=False)],
    model: Annotated[str, typer.Option(help='A material, as in "lambert + ward_bounded".', show_default=False)],
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
    format_: Annotated[str | None, typer.Option("--format", help="Insist on a format; else its content tells.")] = None,
    quantity: Annotated[
        str | None, typer.Option(help="brdf, brdf_cos or reflectance_factor, where the file does not say.")
    ] = None,
    angle_unit: Annotated[str | None, typer.Option(help="degrees or radians, where the file does not say.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Write the lobe plot to this .svg or .png file.")] = None,
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
    declared = {"format": format_, "quantity": quantity, "angle_unit": angle_unit}
    if server is not None:
        drawn = {"scale": scale, "channel": channel}
        _remote(server, api_key, file, asked | declared | {"max_theta_deg": max_theta_deg}, as_json, plot, drawn)
        return
    import brdfcore as bc

    if plot is not None:  # what cannot be drawn is refused before the work, not after it
        bc.plots.kind_of(plot)
        bc.plots.check_scale(scale)
    max_theta = None if max_theta_deg is None else math.radians(max_theta_deg)
    samples = bc.read(file, **declared)

    def run(progress: "Callable[[Progress], None] | None") -> "Fit":
        return bc.fit(samples, **asked, max_theta=max_theta, progress=progress)

    result = _with_bar(run)
    typer.echo(json.dumps(result.to_dict(), indent=2) if as_json else result.report())
    if plot is not None:
        figure = bc.plots.lobes(result.material, samples, scale=scale, channel=channel)
        typer.echo(f"Lobe plot: {bc.plots.save(figure, plot)}", err=as_json)


def _remote(
    server: str,
    api_key: str | None,
    file: Path,
    asked: dict[str, Any],
    as_json: bool,
    plot: Path | None,
    drawn: dict[str, Any],
) -> None:
    """The same, done by a service."""
    from service.client import Client, ClientError

    from .. import plots
    from ..errors import BrdfError

    kind = "svg" if plot is None else plots.kind_of(plot)
    try:
        with Client(server, api_key) as client:
            fit = _with_bar(lambda progress: client.fit(file, **asked, progress=progress))
            typer.echo(fit.result.model_dump_json(indent=2) if as_json else fit.report())
            if plot is not None:
                plot.write_bytes(fit.plot("lobes", kind, **drawn))
                typer.echo(f"Lobe plot: {plot}", err=as_json)
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
