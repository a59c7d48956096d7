"""What the hard cases of a model come to: the worst errors of each, the printed equations' beside the library's."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import torch

from ..errors import InvalidValueError
from ..geometry import geometry
from ..models import Model
from .accuracy import DTYPES, Error, Quantity, measure
from .catalogue import HardCase, Point, catalogue, form_of

QUANTITIES: tuple[Quantity, ...] = ("f", "gradient", "density")
PRECISIONS = tuple(str(dtype).removeprefix("torch.") for dtype in DTYPES)
BROKEN = 0.01  # a relative error that shows in a picture


@dataclass(frozen=True)
class Worst:
    """The worst errors of one quantity of a case in one precision, relative to the truth."""

    textbook: float
    ours: float
    share: float  # of its bar, which differs from point to point, that the library's error takes up; above 1 it misses
    at: Point  # where that share is the largest


def rank(error: float) -> float:
    """An error by how bad it is: NaN worse than infinite."""
    return math.inf if math.isnan(error) else min(error, 1e300)


def _worst(points: Iterable[Point], errors: Iterable[Error]) -> Worst:
    pairs = list(zip(points, errors, strict=True))
    at, worst = max(pairs, key=lambda pair: rank(pair[1].ours / pair[1].bar))
    return Worst(
        max((e.textbook for _, e in pairs), key=rank),
        max((e.ours for _, e in pairs), key=rank),
        worst.ours / worst.bar,
        at,
    )


@dataclass(frozen=True)
class CaseReport:
    """A case and its worst errors, by quantity and precision."""

    case: HardCase
    worst: dict[tuple[Quantity, str], Worst]

    @property
    def broken(self) -> bool:
        """Whether the equations as printed are NaN, infinite or 1 % wrong, in value or gradient, in some precision."""
        return any(not worst.textbook <= BROKEN for (q, _), worst in self.worst.items() if q != "density")

    @property
    def missed(self) -> list[tuple[Quantity, str]]:
        """Where the library is not within its bar."""
        return [key for key, worst in self.worst.items() if not worst.share <= 1]


@dataclass(frozen=True)
class ModelReport:
    """All hard cases of a model."""

    model: type[Model]
    cases: tuple[CaseReport, ...]
    refusals: dict[str, str]  # what half precisions are answered

    def largest(self, precision: str) -> float:
        """The library's largest error in a precision, of f, its gradient and the density."""
        return max((w.ours for case in self.cases for (_, p), w in case.worst.items() if p == precision), key=rank)

    @property
    def share(self) -> float:
        """The largest share of its bar that an error of the library's takes up."""
        return max((worst.share for case in self.cases for worst in case.worst.values()), key=rank)

    @property
    def broken(self) -> int:
        """In how many cases the equations as printed break."""
        return sum(case.broken for case in self.cases)

    @property
    def missed(self) -> list[str]:
        """What the library misses, in words."""
        missed = [
            f"{case.case.name}: {quantity} in {precision}, {described(case.worst[quantity, precision].at)}"
            for case in self.cases
            for quantity, precision in case.missed
        ]
        return missed + [f"{precision} is not refused" for precision, answer in self.refusals.items() if not answer]

    def to_dict(self) -> dict[str, Any]:
        """The report as JSON-able data; a number that is none is a string."""

        def number(x: float) -> float | str:
            return x if math.isfinite(x) else "NaN" if math.isnan(x) else "Infinity"

        cases = []
        for report in self.cases:
            errors: dict[str, dict[str, Any]] = {precision: {} for precision in PRECISIONS}
            for (quantity, precision), worst in report.worst.items():
                errors[precision][quantity] = {
                    "textbook": number(worst.textbook),
                    "ours": number(worst.ours),
                    "share_of_bar": number(worst.share),
                    "at": described(worst.at),
                }
            cases.append(
                {
                    "name": report.case.name,
                    "why": report.case.why,
                    "points": len(report.case.points),
                    "errors": errors,
                    "textbook_breaks": report.broken,
                    "within_bar": not report.missed,
                }
            )
        return {
            "model": self.model.name,
            "cases": cases,
            "textbook_breaks": self.broken,
            "within_bar": not self.missed,
            "missed": self.missed,
            "half_precision": self.refusals,
        }


def described(point: Point) -> str:
    """A point as one can type it: the model with its options and values, and the directions."""
    values = ", ".join([*point.choice.options, *(f"{name}={x!r}" for name, x in point.values)])
    return f"{point.choice.name}({values}), wi = {point.wi}, wo = {point.wo}"


def refusals(choice: Model) -> dict[str, str]:
    """The sentences with which half precisions are refused; empty where one is not."""
    answers = {}
    for dtype in (torch.float16, torch.bfloat16):
        w = torch.tensor([0.0, 0.0, 1.0], dtype=dtype)
        try:
            geometry(w, w, form_of(choice).needs)
        except InvalidValueError as error:
            answers[str(dtype).removeprefix("torch.")] = str(error)
        else:
            answers[str(dtype).removeprefix("torch.")] = ""
    return answers


def check(model: type[Model]) -> ModelReport:
    """The report of a model, in single and double precision; some seconds."""
    cases = catalogue(model)
    points = [point for case in cases for point in case.points]
    errors = dict(zip(PRECISIONS, (measure(points, dtype) for dtype in DTYPES), strict=True))

    def reports() -> Iterator[CaseReport]:
        start = 0
        for case in cases:
            rows = slice(start, start + len(case.points))
            start = rows.stop
            yield CaseReport(
                case,
                {
                    (quantity, precision): _worst(case.points, (e[quantity] for e in errors[precision][rows]))
                    for quantity in QUANTITIES
                    for precision in PRECISIONS
                },
            )

    return ModelReport(model, tuple(reports()), refusals(model()))
