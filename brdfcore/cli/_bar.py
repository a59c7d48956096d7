"""A progress bar for work that tells what share of it is done."""

from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def with_bar(name: str, run: Callable[[Callable[[float], None] | None], T]) -> T:
    """The result of `run`, which gets a progress callback; the bar shows on a terminal's error output only."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        return run(None)
    with Progress(TextColumn(name), BarColumn(), TimeElapsedColumn(), console=console, transient=True) as bar:
        task = bar.add_task(name, total=1.0)
        return run(lambda share: bar.update(task, completed=share))
