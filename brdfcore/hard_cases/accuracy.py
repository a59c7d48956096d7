"""How far results are from the truth: of the library, and of the equations typed in as printed.

An error is |got - true| / size. The size is, of a value, the true value; of a derivative by the directions, the largest
of them or f (a unit vector's component is of the size of 1); of one by a parameter x, itself, f, or f/x where fits
search over log x; and 1 where f is 0. Derivatives by a direction are taken on the sphere: how an equation goes on
beyond unit vectors is no property of the model. The library's error has a bar:

    4 max(Q, 8) eps, 6 Q eps beyond Q = 20           a value, with exp(-Q) its exponential factor
    8 max(Q, 8) eps                                  a gradient

and 4 (8) times what roundings are amplified to, whatever the arithmetic (conditions.py). Where a lobe alone overflows,
the library stops at the largest number, and any number up to the truth is right. Where a number's factors underflow it
counts as 0.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import torch

from ..geometry import FLOOR
from .catalogue import Point
from .exact import mp
from .results import Results, ours, printed, stored
from .symbols import Number
from .truth import RESOLVED, gradient, truth

Quantity = Literal["f", "gradient", "density"]
DTYPES = (torch.float32, torch.float64)

VALUE, TAIL, GRADIENT = 4, 6, 8
LEAST = 8  # of Q, since an equation has more roundings than its exponent's
CEILING = 0.99  # of the largest number


@dataclass(frozen=True)
class Error:
    """The error of one quantity at one point; NaN or infinite where a result is that and should not be."""

    textbook: float
    ours: float
    bar: float

    @property
    def missed(self) -> bool:
        """Whether the library's result is not within its bar."""
        return not self.ours <= self.bar


class Standard:
    """What results at one point are held against: the truth for the numbers as they are stored in a precision."""

    def __init__(self, point: Point, dtype: torch.dtype) -> None:
        floor = FLOOR[dtype]
        self.limits, self.choice, self.values = torch.finfo(dtype), point.choice, dict(point.values)
        self.wi, self.wo = ((w[0], w[1], floor if 0 < w[2] < floor else w[2]) for w in (point.wi, point.wo))
        self.truth = truth(self.choice, self.values, self.wi, self.wo, self.limits.eps)
        self.exponent = min(max(float(self.truth.exponent), 0.0), 1e6)  # beyond, the exponential is long 0
        floored = floor in (self.wi[2], self.wo[2])
        smooth = self.truth.tie > 16 * self.limits.eps and not floored
        self.slopes = (
            gradient(self.choice, self.values, self.wi, self.wo)
            if smooth and self.exponent < -math.log(self.limits.tiny) * 2 / 3  # beyond, the derivatives' factors are 0
            else None
        )

    def bar(self, quantity: Quantity) -> float:
        """The error that the library's result may have."""
        factor = GRADIENT if quantity == "gradient" else VALUE if self.exponent <= 20 else TAIL
        more = GRADIENT if quantity == "gradient" else VALUE
        return factor * max(self.exponent, LEAST) * self.limits.eps + more * float(self.truth.amplified)

    def errors(self, got: Results, k: int) -> dict[Quantity, float]:
        """The errors of the k-th of some results."""
        scale = self.values.get(self.choice.scale, 1.0)
        return {
            "f": self._of_value(float(got.f[k]), self.truth.f, scale),
            "gradient": self._of_gradient(
                got.by_direction[k].tolist(), {n: float(x[k]) for n, x in got.by_value.items()}
            ),
            "density": self._of_value(float(got.density[k]), self.truth.density, 1.0),
        }

    def _of_value(self, got: float, true: Number, scale: float) -> float:
        if not math.isfinite(got):
            return 0.0 if got == math.inf and true > self.limits.max else abs(got)
        if true > CEILING * self.limits.max * scale and 0 < got <= true:
            return 0.0
        lobe = true * mp.exp(self.exponent)  # what the exponential is multiplied by
        size = max(true, lobe * self.limits.tiny, self.limits.tiny / self.limits.eps**2) if true else 1
        return float(abs(got - true) / size)

    def _of_gradient(self, by_direction: list[float], by_value: dict[str, float]) -> float:
        got = [*by_direction, *by_value.values()]
        if self.slopes is None or max(map(abs, (*self.slopes[0], *self.slopes[1].values()))) > self.limits.max**0.8:
            return math.nan if any(math.isnan(x) for x in got) else 0.0
        if not all(math.isfinite(x) for x in got):
            return math.nan if any(math.isnan(x) for x in got) else math.inf
        least, f = max(self.limits.tiny ** (2 / 3), RESOLVED), self.truth.f or 1
        size = max(*map(abs, self.slopes[0]), f, least)
        wrong = [float((x - true) / size) for x, true in zip(by_direction, self.slopes[0], strict=True)]
        errors = [abs(x) for x in (*_tangential(self.wi, wrong[:3]), *_tangential(self.wo, wrong[3:]))]
        for name, slope in self.slopes[1].items():
            natural = f / self.values[name] if self.choice.parameter[name].scale == "log" else f
            errors.append(float(abs(by_value[name] - slope) / max(abs(slope), natural, least)))
        return max(errors)


def _tangential(w: Sequence[float], slopes: Sequence[float]) -> list[float]:
    """What is left of derivatives by a direction without their part along it."""
    along = sum(a * b for a, b in zip(w, slopes, strict=True)) / sum(a * a for a in w)
    return [b - along * a for a, b in zip(w, slopes, strict=True)]


def measure(points: Sequence[Point], dtype: torch.dtype) -> list[dict[Quantity, Error]]:
    """The errors at each point, its numbers rounded to a precision first."""
    points = stored(points, dtype)
    found: list[dict[Quantity, Error]] = [{} for _ in points]
    for choice in dict.fromkeys(point.choice for point in points):
        rows = [row for row, point in enumerate(points) if point.choice == choice]
        own = [points[row] for row in rows]
        wi, wo = (torch.tensor(w, dtype=dtype) for w in ([p.wi for p in own], [p.wo for p in own]))
        values = {name: torch.tensor([dict(p.values)[name] for p in own], dtype=dtype) for name in choice.parameter}
        results, textbook = ours(choice, values, wi, wo), printed(choice, values, wi, wo)
        for k, row in enumerate(rows):
            standard = Standard(points[row], dtype)
            theirs, mine = standard.errors(textbook, k), standard.errors(results, k)
            found[row] = {q: Error(theirs[q], mine[q], standard.bar(q)) for q in mine}
    return found
