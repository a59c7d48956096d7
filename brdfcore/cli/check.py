"""`brdf check`: whether a material could exist, or, with --hard-cases, how exact the models are."""

from typing import Annotated

import typer


def command(
    material: Annotated[
        str | None,
        typer.Argument(
            help="A material's text or a preset's name. With --hard-cases, a model's name, or nothing for all models.",
            show_default=False,
        ),
    ] = None,
    hard_cases: Annotated[
        bool, typer.Option("--hard-cases", help="Compare with the printed equations and with mpmath.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Say what a material reflects at most and whether it is reciprocal; exit code 1 where it may exceed 1.

    With --hard-cases, check models where floating-point arithmetic is hardest; exit code 1 where one misses its bar.
    """
    from ..errors import InvalidValueError
    from . import _certificate, _hard_cases

    if hard_cases:
        raise typer.Exit(0 if _hard_cases.check(material, as_json=as_json) else 1)
    if material is None:
        raise InvalidValueError(
            "Expected brdf check to be told what to check, got nothing. Name a material, or add --hard-cases.",
            field="material",
        )
    report, conserving = _certificate.check(material, as_json=as_json)
    typer.echo(report)
    raise typer.Exit(0 if conserving else 1)
