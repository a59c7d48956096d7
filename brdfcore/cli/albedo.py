"""`brdf albedo MATERIAL`: directional albedos with their errors, a table of them as a file, and their plot."""

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ._bar import with_bar

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from ..energy.albedo import Albedo
    from ..energy.tables import AlbedoTable
    from ..models.material import Material

THETA_DEG = "0,30,60,75,85,89,89.9"


def command(
    material: Annotated[str, typer.Argument(help="A material's text or a preset's name.", show_default=False)],
    theta_deg: Annotated[
        str | None, typer.Option(help="Polar angles, separated by commas.", show_default=THETA_DEG)
    ] = None,
    phi_deg: Annotated[
        float | None, typer.Option(help="Azimuth, which an anisotropic material depends on.", show_default="0")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Largest error; by default 1e-6, and 1e-4 for a table.", show_default=False)
    ] = None,
    table: Annotated[
        Path | None, typer.Option(help="Write a table over all angles to this .npz or .json file instead.")
    ] = None,
    axis: Annotated[
        list[str] | None,
        typer.Option(help="An axis of the table, KEY=LOW:HIGH or KEY, as kurt.m=0.1:1 or theta_deg=0:85; repeatable."),
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the albedo to this .svg or .png file.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Print how much of the light a material gives back, by angle, each with the error claimed for it."""
    import brdfcore as bc

    from ..energy._described import axes_in_radians, described
    from ..energy._table_files import require_suffix
    from ..errors import InvalidValueError

    if plot is not None:  # what cannot be written is refused before the work, not after it
        bc.plots.kind_of(plot)
    if axis and table is None:
        raise InvalidValueError("Expected --axis to go with --table, got no file. Add --table OUT.npz.", field="axis")
    if table is not None and theta_deg is not None:
        raise InvalidValueError(
            f"Expected --theta-deg to go without --table, which holds all angles, got {theta_deg!r}. Leave it out, or "
            "give the table's range as --axis theta_deg=0:85.",
            field="theta_deg",
        )
    if table is not None and phi_deg is not None and plot is None:
        raise InvalidValueError(
            f"Expected --phi-deg to go without --table, which holds every azimuth, got {phi_deg:g}. Leave it out.",
            field="phi_deg",
        )
    phi_deg = 0.0 if phi_deg is None else phi_deg
    made = bc.material(material)
    if table is None:
        angles = _numbers(THETA_DEG if theta_deg is None else theta_deg)
        found = _albedo(made, angles, phi_deg, 1e-6 if tolerance is None else tolerance)
        if as_json:
            typer.echo(json.dumps(described(made, angles, phi_deg, found), indent=2, allow_nan=False))
        else:
            _print_values(made, angles, phi_deg, found)
    else:
        require_suffix(table)
        axes = axes_in_radians(_axes(axis or []))
        wanted = 1e-4 if tolerance is None else tolerance
        result = with_bar("table", lambda progress: bc.albedo_table(made, axes, wanted, progress=progress))
        result.save(table)
        if as_json:
            facts = {name: value for name, value in result.to_dict().items() if name != "values"}
            typer.echo(json.dumps(facts, indent=2, allow_nan=False))
        else:
            _print_table(result, table)
    if plot is not None:
        figure = bc.plots.albedo({material: made}, phi_deg=phi_deg)
        typer.echo(f"Albedo plot: {bc.plots.save(figure, plot)}", err=as_json)


def _albedo(material: "Material", theta_deg: list[float], phi_deg: float, tolerance: float) -> "Albedo":
    """The albedos, (N, C)."""
    import torch

    import brdfcore as bc

    from ..errors import InvalidValueError

    wrong = [angle for angle in theta_deg if not 0 <= angle < 90]
    if wrong:
        raise InvalidValueError(
            f"Expected --theta-deg to be angles in [0, 90), got {wrong[0]:g}. Give polar angles below 90.",
            field="theta_deg",
        )
    if not math.isfinite(phi_deg):
        raise InvalidValueError(
            f"Expected --phi-deg to be a finite angle, got {phi_deg:g}. Give the azimuth in degrees.", field="phi_deg"
        )
    with torch.no_grad():
        theta = torch.deg2rad(torch.tensor(theta_deg, dtype=torch.float64))
        return bc.albedo(material, theta, math.radians(phi_deg), tolerance)


def _print_values(material: "Material", theta_deg: list[float], phi_deg: float, found: "Albedo") -> None:
    from rich import box
    from rich.table import Column, Table
    from rich.text import Text

    channels = found.values.shape[-1]
    names = ["albedo"] if channels == 1 else [f"albedo {k}" for k in range(channels)]
    headers = ("theta [degrees]", *names, "claimed error")
    table = Table(*(Column(Text(name), justify="right", no_wrap=True) for name in headers), box=box.SIMPLE)
    digits = min(max(1 - math.floor(math.log10(found.tolerance)), 3), 14)
    for theta, row, error in zip(theta_deg, found.values.tolist(), found.error.tolist(), strict=True):
        numbers = [Text(f"{a:.{digits}f}", style="bold red" if a > 1 + found.tolerance else "") for a in row]
        table.add_row(Text(f"{theta:g}"), *numbers, Text(f"{max(error):.1e}"))
    console = _console(table)
    console.print(str(material), markup=False, soft_wrap=True)
    console.print(table)
    if bool((found.values > 1 + found.tolerance).any()):
        console.print("It gives back more light than it gets where the albedo exceeds 1.", style="red")
    azimuth = f"azimuth {phi_deg:g} degrees, " if _anisotropic(material) else ""
    met = f"tolerance {found.tolerance:g} met" if found.met else f"TOLERANCE {found.tolerance:g} NOT MET"
    console.print(
        f"{azimuth}{found.method}, {met}, {found.evaluations} evaluations, {found.seconds:.2f} s", soft_wrap=True
    )


def _print_table(result: "AlbedoTable", path: Path) -> None:
    from rich import box
    from rich.table import Column, Table

    table = Table(
        Column("axis", no_wrap=True),
        *(Column(name, justify="right") for name in ("from", "to", "nodes")),
        box=box.SIMPLE,
    )
    for axis, count in zip(result.axes, result.values.shape, strict=False):
        angle = axis.name in ("theta", "phi")
        ends = [math.degrees(end) if angle else end for end in (axis.low, axis.high)]
        table.add_row(f"{axis.name}_deg" if angle else axis.name, *(f"{end:.6g}" for end in ends), str(count))
    console = _console(table)
    console.print(result.material.form.text(), markup=False, soft_wrap=True)
    console.print(table)
    met = f"tolerance {result.tolerance:g} met" if result.met else f"TOLERANCE {result.tolerance:g} NOT MET"
    console.print(
        f"error {result.error:.1e} with interpolation, {met}, {result.evaluations} evaluations, {result.seconds:.2f} s",
        soft_wrap=True,
    )
    size = f"{path.stat().st_size / 1000:.1f} kB"
    console.print(f"Table: {path} ({size}), hash {result.hash[:12]}", markup=False, soft_wrap=True)


def _console(table: "Table") -> "Console":
    """A console at least as wide as the table, so that no digit of a number is cut off."""
    from rich.console import Console
    from rich.measure import Measurement

    console = Console(highlight=False)
    needed = Measurement.get(console, console.options.update(max_width=sys.maxsize), table).maximum
    console.width = max(console.width, needed)
    return console


def _anisotropic(material: "Material") -> bool:
    return any("anisotropic" in term.model.options for term in material.form.terms)


def _numbers(text: str) -> list[float]:
    """The angles of a list."""
    from ..errors import InvalidValueError

    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise InvalidValueError(
            f"Expected --theta-deg to be numbers separated by commas, got {text!r}. Write it like 0,60,89.",
            field="theta_deg",
        ) from error


def _axes(texts: list[str]) -> dict[str, tuple[float, float] | None]:
    """The ranges of the axes by their keys."""
    from ..errors import InvalidValueError

    axes: dict[str, tuple[float, float] | None] = {}
    for text in texts:
        key, ends = _axis(text)
        if key in axes:
            raise InvalidValueError(
                f"Expected --axis to name every axis once, got {key} twice. Drop one of them.", field="axis"
            )
        axes[key] = ends
    return axes


def _axis(text: str) -> tuple[str, tuple[float, float] | None]:
    """The key and the range of KEY=LOW:HIGH, or a key alone."""
    from ..errors import InvalidValueError

    key, given, ends = (part.strip() for part in text.partition("="))
    try:
        low, high = (float(end) for end in ends.split(":")) if given else (0.0, 0.0)
    except ValueError as error:
        raise InvalidValueError(
            f"Expected --axis to be KEY=LOW:HIGH or KEY, got {text!r}. Write it like kurt.m=0.1:1.", field="axis"
        ) from error
    return key, (low, high) if given else None
