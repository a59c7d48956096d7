"""The command line: one file a command. Nothing here loads torch before a command needs it."""

import sys

import typer

from . import albedo, check, compare, convert, demo, export, fit, info, models, serve, study

app = typer.Typer(
    name="brdf",
    help="Analyse and fit surface reflectance (BRDFs).",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command("fit")(fit.command)
app.command("compare")(compare.command)
app.command("info")(info.command)
app.command("convert")(convert.command)
app.command("models")(models.command)
app.command("albedo")(albedo.command)
app.command("check")(check.command)
app.command("export")(export.command)
app.command("study")(study.command)
app.command("serve")(serve.command)
app.command("demo")(demo.command)


def main() -> None:
    """Run the command that was typed; a mistake of the user's is one sentence and exit code 2."""
    from ..errors import BrdfError

    try:
        app()
    except BrdfError as error:
        typer.echo(f"brdf: {error}", err=True)
        sys.exit(2)
    except OSError as error:
        what = f" {error.filename}" if error.filename else ""
        typer.echo(
            f"brdf: Expected to read or write{what}, got: {error.strerror}. Check the path and its rights.", err=True
        )
        sys.exit(2)
