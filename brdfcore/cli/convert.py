"""`brdf convert IN OUT`: a measured file in another format, by the suffix of OUT."""

from pathlib import Path
from typing import Annotated

import typer

from ._reading import AngleUnitOption, ColumnsOption, FileArgument, FormatOption, MaterialOption, QuantityOption


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
) -> None:
    """Write a measured file's samples, as the BRDF [1/sr], with sigma, weights and channels; say what was masked."""
    import brdfcore as bc

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
    samples = bc.read(file, format=format_, quantity=quantity, angle_unit=angle_unit, columns=columns, material=which)
    write(samples, out)
    kept = [name for name in ("sigma", "weight", "cell") if getattr(samples, name) is not None]
    extras = f", with {' and '.join(kept)}" if kept else ""
    channels = f"in {len(samples.channels)} channel{'s' * (len(samples.channels) > 1)}"
    typer.echo(f"{out}: {len(samples):,} samples of the BRDF [1/sr] {channels}{extras}")
    for masked in samples.masked:
        typer.echo(f"left out: {masked.count:,} where {masked.reason}")
