"""`brdf demo`: the main job from end to end, over HTTP, on the shipped measurement."""

import tempfile
from pathlib import Path
from typing import Annotated

import typer


def command(
    plot: Annotated[Path, typer.Option(help="Where the lobe plot goes (.svg or .png).")] = Path("red_linoleum.svg"),
) -> None:
    """Start the service, post a measurement of red linoleum, print the fit, and write its lobe plot."""
    from service.client import Client
    from service.settings import Settings

    from ..demo import DATA, MODEL
    from ..plots import kind_of
    from .serve import background

    kind = kind_of(plot)

    with tempfile.TemporaryDirectory() as folder, background(Settings(data=Path(folder), port=0, workers=1)) as url:
        typer.echo(f"Service running at {url}")
        with Client(url) as client:
            typer.echo(f"Posting {DATA.name}, 222 geometries, to be fitted with {MODEL}\n")
            fit = client.fit(DATA, model=MODEL)
            typer.echo(fit.report() + "\n")
            plot.write_bytes(fit.plot("lobes", kind))
    typer.echo(f"Lobe plot written to {plot.resolve()}")
