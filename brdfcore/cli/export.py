"""`brdf export MATERIAL --to FORMAT OUT`: writes a material as another program's file and says how far off it is."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from ..models.material import Material


def command(
    material: Annotated[
        str, typer.Argument(help="A material's text, a preset's name, or a JSON file of a fit.", show_default=False)
    ],
    out: Annotated[Path, typer.Argument(help="The file to write.", show_default=False)],
    to: Annotated[str, typer.Option(help="radiance, mitsuba, brdf_explorer, merl or json.", show_default=False)],
    orientation: Annotated[
        str | None, typer.Option(help="Where the material's x axis points in a Radiance scene, as 1,0,0.")
    ] = None,
) -> None:
    """Write a material for another program; where that cannot hold it, the nearest that it can, and how near."""
    import brdfcore as bc

    made = bc.export(_material(material), to, out, orientation=None if orientation is None else _axis(orientation))
    share = f"relative RMS difference of f cos theta_i {made.difference:.2g}"
    typer.echo(f"{made.path}: {made.holds} {'Exact' if made.exact else 'Not exact'}: {share}.")


def _material(given: str) -> "Material":
    """The material of a text, or of the file that `brdf fit --json` or an export to json wrote."""
    import brdfcore as bc

    from ..errors import FormatError

    path = Path(given)
    if path.suffix != ".json":
        return bc.material(given)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise FormatError(
            f"Expected {path.name} to be JSON, got {error}. Give what `brdf fit --json` printed.", field="material"
        ) from error
    return bc.Material.from_json(data.get("material", data) if isinstance(data, dict) else data)


def _axis(text: str) -> tuple[float, float, float]:
    """The three numbers of a direction."""
    from ..errors import InvalidValueError

    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError as error:
        raise InvalidValueError(
            f"Expected --orientation to be three numbers, got {text!r}. Write it like 1,0,0.", field="orientation"
        ) from error
    return x, y, z
