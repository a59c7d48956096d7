"""What a study finds, and what it was found with."""

import os
import platform
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

from ..plots._panels import Panel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | float | int | bool | None
PEERS = ("scipy", "lmfit")


@dataclass(frozen=True)
class Chart:
    """One plot of a study: `accuracy` is log-log, `curves` has plain axes, `lobes` plain axes of one scale."""

    name: str  # of its file, without the suffix
    title: str
    panels: tuple[Panel, ...]
    x: str = "time [s]"  # what stands on the axes, with its unit
    y: str = "relative error [1]"
    kind: Literal["accuracy", "curves", "lobes"] = "accuracy"
    columns: int | None = None  # of panels; by default as many as fit well


@dataclass(frozen=True)
class Picture:
    """A figure of images, which has no curves whose points could be told."""

    name: str  # of its file, without the suffix
    title: str
    figure: "Figure"


@dataclass(frozen=True)
class Study:
    """A table, plots of accuracy against time, pictures, one sentence to act on, and what a reader has to know of them.

    `provenance` holds the machine, versions, threads, seed and date once `run` has made the study.
    """

    name: str
    question: str
    columns: tuple[str, ...]  # with their units
    rows: tuple[tuple[Cell, ...], ...]
    charts: tuple[Chart, ...]
    sentence: str
    notes: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    provenance: dict[str, Any] = field(default_factory=dict)


class MakeStudy(Protocol):
    """A study as a function; with `quick` it takes a few seconds, and its table is shorter."""

    def __call__(self, quick: bool = False, seed: int = 0) -> Study:
        """The study with these seeds."""


def two_digits(number: float) -> str:
    """A positive number for a sentence: two digits, without an exponent where that is shorter."""
    return f"{float(f'{number:.2g}'):g}"


def installed(package: str) -> str | None:
    """The version of an installed package, None where there is none."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def machine() -> dict[str, Any]:
    """The processor's name, how many cores it shows, and the operating system."""
    system = f"{platform.system()} {platform.machine()}".strip()
    return {"cpu": _processor() or system or "unknown", "cores": os.cpu_count(), "system": system}


def versions() -> dict[str, str | None]:
    """The versions of Python and of all packages that a study may time; None for one that is not installed."""
    return {
        "python": platform.python_version(),
        **{name: installed(name) for name in ("brdfcore", "torch", "numpy", *PEERS)},
    }


def _processor() -> str:
    """The processor's name where the system tells it."""
    listing = Path("/proc/cpuinfo")
    if listing.is_file():
        for line in listing.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                return value.strip()
    return platform.processor()
