"""What a model is at a pair of directions, value and gradient, by its equation in exact arithmetic."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..models import Model
from .conditions import condition
from .exact import Exact, mp
from .formulas import density, value
from .symbols import Number, Values

STEP = mp.mpf(10) ** -80  # of a difference: f may turn over as little as 1e-4 of the lower direction's height
RESOLVED = 1e-50  # the least derivative that is told from the difference's own error, for f of about 1


@dataclass(frozen=True)
class Truth:
    """What a model is, at a pair of directions: the numbers that floating-point results are held against."""

    f: Number  # [1/sr]
    density: Number  # of the samples [1/sr]
    exponent: Number  # Q, with exp(-Q) the exponential factor of f
    amplified: Number  # the relative error that roundings grow to beside that, whatever the arithmetic
    tie: Number  # how far, relative to 1, from where f has no derivative


def _numbers(values: Mapping[str, float], wi: Sequence[float], wo: Sequence[float]) -> tuple[Values, list[Number]]:
    return {name: mp.mpf(x) for name, x in values.items()}, [mp.mpf(x) for x in (*wi, *wo)]


def _pair(w: Sequence[Number]) -> Exact:
    return Exact((w[0], w[1], w[2]), (w[3], w[4], w[5]))


def truth(choice: Model, values: Mapping[str, float], wi: Sequence[float], wo: Sequence[float], eps: float) -> Truth:
    """What a model is at a pair of directions, stored with roundings of eps; 0 where one is not above the horizon."""
    v, w = _numbers(values, wi, wo)
    if w[2] <= 0 or w[5] <= 0:
        zero = mp.mpf(0)
        return Truth(f=zero, density=zero, exponent=zero, amplified=zero, tie=mp.mpf(1))
    pair = _pair(w)
    f, q = value(choice)(pair, v)
    tie = pair.tie
    return Truth(f, density(choice)(pair, v), q, condition(choice, pair, v, eps), tie)


def gradient(
    choice: Model, values: Mapping[str, float], wi: Sequence[float], wo: Sequence[float]
) -> tuple[list[Number], dict[str, Number]]:
    """The derivatives of f by the six components of wi and wo, and by each value; 0 below the horizon."""
    v, w = _numbers(values, wi, wo)
    if w[2] <= 0 or w[5] <= 0:
        return [mp.mpf(0)] * 6, dict.fromkeys(v, mp.mpf(0))
    equation = value(choice)
    pair = _pair(w)
    f = equation(pair, v)[0]
    step = STEP * min(abs(x) for x in w if x)
    by_direction, by_value = [], {}
    for k, x in enumerate(w):
        by_direction.append((equation(_pair([*w[:k], x + step, *w[k + 1 :]]), v)[0] - f) / step)
    for name, x in v.items():
        by_value[name] = (equation(pair, {**v, name: x + STEP})[0] - f) / STEP
    return by_direction, by_value
