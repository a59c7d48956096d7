"""`brdf study [NAME ...]`: what accuracy costs in time, on this machine."""

import json
from pathlib import Path
from typing import Annotated

import typer

_NAMES = "albedo, evaluation, fitting, sampling, effects, render or papers; without a name all but papers."


def command(
    names: Annotated[list[str] | None, typer.Argument(help=_NAMES, show_default=False)] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Smaller cases: all within a minute.")] = False,
    output: Annotated[Path, typer.Option(help="Folder of the tables, JSON and plots.")] = Path("brdf-study"),
    seed: Annotated[int, typer.Option(help="Of directions, starts and samples.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, by the study's name.")] = False,
) -> None:
    """Measure accuracy against time; print a table and a sentence to act on, write them, JSON and plots.

    Files in the folder that an earlier run of the same study left are replaced, others are not touched.
    """
    from ..study import check, run
    from ..study.report import text, to_dict, write

    chosen = check(names or [], seed)
    output.mkdir(parents=True, exist_ok=True)  # what cannot be written is refused before the work, not after it
    found = {}
    for name in chosen:
        typer.echo(f"{name} ...", err=True)  # one may take minutes
        study = run(name, quick=quick, seed=seed)
        found[name] = to_dict(study)
        if not as_json:
            typer.echo(text(study) + "\n")
        files = write(study, output)
        typer.echo(f"{name}: {', '.join(file.name for file in files)} in {output}\n", err=as_json)
    if as_json:
        typer.echo(json.dumps(found, indent=2, allow_nan=False))
