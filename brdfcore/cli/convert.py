"""`brdf convert IN OUT`: a measured file in another format, by the suffix of OUT."""

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


def command(
    file: FileArgument,
    out: Annotated[
        Path,
        typer.Argument(
            help="File to write: .csv, .npz, .parquet or .arrow. One that exists is overwritten.", show_default=False
        ),
    ],
    format_: FormatOption = None,
    quantity: QuantityOption = None,
    angle_unit: AngleUnitOption = None,
    columns: ColumnsOption = None,
    which: MaterialOption = None,
    rgb: RgbOption = False,
) -> None:
    """Write a measured file's samples, as the BRDF [1/sr], with sigma, weights and channels; say what was masked."""
    import brdfcore as bc

    from ..colour import told, wavelengths
    from ..errors import InvalidValueError

    writers = {found.suffix: found.write for found in bc.FORMATS.values() if found.suffix is not None}
    write = writers.get(out.suffix.lower())
    if write is None:
        raise InvalidValueError(
            f"Expected OUT to end in {', '.join(writers)}, got {out.suffix or 'no suffix'!r}. Rename it.", field="out"
        )
    if out.exists() and out.samefile(file):
        raise InvalidValueError(
            f"Expected OUT to be another file than FILE, got {str(out)!r} for both. Rename it.", field="out"
        )
    read = bc.read(file, format=format_, quantity=quantity, angle_unit=angle_unit, columns=columns, material=which)
    samples = read.to_rgb() if rgb else read
    write(samples, out)
    kept = [name for name in ("sigma", "weight", "cell") if getattr(samples, name) is not None]
    extras = f", with {' and '.join(kept)}" if kept else ""
    channels = f"in {len(samples.channels)} channel{'s' * (len(samples.channels) > 1)}"
    typer.echo(f"{out}: {len(samples):,} samples of the BRDF [1/sr] {channels}{extras}")
    nm = wavelengths(read.channels) if rgb else None
    if nm is not None:
        typer.echo(f"red, green and blue (linear sRGB under D65) of {told(nm)}")
    for masked in samples.masked:
        typer.echo(f"left out: {masked.count:,} where {masked.reason}")
