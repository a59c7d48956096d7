"""What every command that fits asks of the fit: its options, and the library's keywords that they stand for."""

import math
from collections.abc import Callable, Iterable
from typing import Annotated, Any, TypeAlias, TypeVar

import typer

T = TypeVar("T")

OptimizerOption: TypeAlias = Annotated[str, typer.Option(help="auto, least_squares, lbfgs or adam.")]
FixedOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        help="KEY=VALUE to keep, as kurt.f0=0.04, or a value a channel, as lambert.kd=0.1,0.2,0.3; repeatable."
    ),
]
GrayOption: TypeAlias = Annotated[
    list[str] | None, typer.Option(help="A key with one value for all channels; repeatable.")
]
PerChannelOption: TypeAlias = Annotated[
    list[str] | None, typer.Option(help="An f0 with a value a channel; repeatable.")
]
SeedOption: TypeAlias = Annotated[int, typer.Option(help="Of the scan for starts.")]
BoundsOption: TypeAlias = Annotated[list[str] | None, typer.Option(help="KEY=LOW:HIGH within KEY's box; repeatable.")]
StartsOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(help="KEY=VALUE to start from as well, several with spaces between; repeatable, a start each."),
]
RobustOption: TypeAlias = Annotated[str | None, typer.Option(help="soft_l1 or cauchy: outliers count less.")]
RobustScaleOption: TypeAlias = Annotated[
    float | None, typer.Option(help="Residual from which they do; else the data say.")
]
MaxThetaOption: TypeAlias = Annotated[float | None, typer.Option(help="Leave steeper samples out [degrees].")]
ConserveOption: TypeAlias = Annotated[bool, typer.Option("--conserve-energy", help="Keep every albedo at 1 or less.")]


def fixed_values(texts: Iterable[str] | None) -> dict[str, Any]:
    """The values of every KEY=VALUE of --fixed; raises ParameterError for a key that is given twice."""
    return _each_once("fixed", map(_pair, texts or ()))


def ranges(texts: Iterable[str] | None) -> dict[str, tuple[float, float]]:
    """The ends of every KEY=LOW:HIGH of --bounds; raises ParameterError for a key that is given twice."""
    return _each_once("bounds", map(_range, texts or ()))


def further_starts(texts: Iterable[str] | None) -> list[dict[str, Any]]:
    """The starts that --starts gives, one a text; raises ParameterError for a key that one of them has twice."""
    return [_each_once("starts", (_pair(part, "starts") for part in text.split())) for text in texts or ()]


def radians(degrees: float | None) -> float | None:
    """The angle of --max-theta-deg; raises ParameterError, in degrees, where it is none."""
    from ..errors import ParameterError

    if degrees is None:
        return None
    if not 0 < degrees <= 90:
        raise ParameterError(
            f"Expected --max-theta-deg to be an angle in (0, 90] degrees, got {degrees:g}. MERL's literature drops 80.",
            field="max_theta",
        )
    return math.radians(degrees)


def _each_once(name: str, pairs: Iterable[tuple[str, T]]) -> dict[str, T]:
    from ..errors import ParameterError

    found: dict[str, T] = {}
    for key, value in pairs:
        if key in found:
            raise ParameterError(f"Expected --{name} to name {key} once, got it twice. Drop one.", field=name)
        found[key] = value
    return found


def _pair(text: str, name: str = "fixed") -> tuple[str, float | list[float]]:
    """The key and the number, or numbers, of KEY=VALUE."""
    from ..errors import ParameterError

    key, _, value = text.partition("=")
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError as error:
        raise ParameterError(
            f"Expected --{name} to be KEY=NUMBER, got {text!r}. Write it like kurt.f0=0.04.", field=name
        ) from error
    return key.strip(), numbers if len(numbers) > 1 else numbers[0]


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


def with_bar(run: Callable[[Callable[[Any], None] | None], T]) -> T:
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
