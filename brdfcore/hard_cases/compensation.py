"""What Smith's microfacets lose to single scattering and what returns it, from the models' tables."""

from collections.abc import Callable
from typing import NamedTuple

from ..models._compensation import FRESNEL_RULE, HIGH, LOW, MEAN_RULE
from .fresnel import exact_fresnel
from .symbols import Number, Symbols, Values

Fall = Callable[[Symbols, Number, Number], tuple[Number, Number]]


class Table(NamedTuple):
    """A table's name, whether its masking is correlated, and the factor that is left out of it, with its exponent."""

    name: str
    correlated: bool
    fall: Fall


def algebraic(s: Symbols, mu: Number, a: Number) -> tuple[Number, Number]:
    """The factor of GGX's tables [1], and no exponent."""
    return (a / (mu + a)) ** 2, 0


def gaussian(s: Symbols, mu: Number, a: Number) -> tuple[Number, Number]:
    """The factor of Beckmann's tables [1], and its exponent."""
    q = (0.2 * mu**2 + 0.1 * mu**4 + 0.19 * mu**12) / a**2
    return s.math.exp(-q), q


def _rise(a: Number) -> Number:
    return 0.3 * a / (1 + a**2)


def _across(s: Symbols, mu: Number, a: Number) -> Number:
    return s.math.log(1 + mu / (0.003 * _rise(a))) + 8 * a / (a + 0.1) * mu**2


def _along(s: Symbols, a: Number) -> Number:
    return s.math.log(a) + 2 * s.math.log(1 + 5 * a)


def lost(s: Symbols, table: Table, mu: Number, a: Number) -> tuple[Number, Number]:
    """G of a cosine and a width [1], and its exponent."""
    low, high = (_along(s, a * 0 + end) for end in (LOW, HIGH))
    x = _across(s, mu, a) / _across(s, a * 0 + 1, a)
    smooth = s.surface(table.name, x, (_along(s, a) - low) / (high - low))
    fall, q = table.fall(s, mu, a)
    return smooth * fall * (mu / (mu + _rise(a)) if table.correlated else 1), q


def mean_lost(s: Symbols, table: Table, a: Number) -> Number:
    """Gbar of a width [1]."""
    scale = _rise(a)
    length = s.math.log(1 + 1 / scale)

    def part(x: Number, weight: Number) -> Number:
        mu = scale * (s.math.exp(x * length) - 1)
        return 2 * weight * length * mu * (mu + scale) * lost(s, table, mu, a)[0]

    return s.total(part, MEAN_RULE, (table, a))


def _mean_fresnel(s: Symbols, v: Values) -> Number:
    """Fbar [1]."""
    if "f0" in v:
        return v["f0"] + (1 - v["f0"]) / 21
    index = s.complex(v["eta"], v["k"]) if "k" in v else v["eta"]
    return s.total(lambda c, weight: weight * exact_fresnel(s, c, index), FRESNEL_RULE, index)


def returned(s: Symbols, table: Table, v: Values) -> tuple[Number, Number]:
    """Kulla and Conty 2017, times ks [1/sr], and its exponent."""
    mean = mean_lost(s, table, v["a"])
    (i, q_i), (o, q_o) = (lost(s, table, mu, v["a"]) for mu in (s.cos_i, s.cos_o))
    share = 1
    if "f0" in v or "eta" in v:
        factor = _mean_fresnel(s, v)
        share = factor**2 * (1 - mean) / (1 - factor * mean)
    return v["ks"] * share * i * o / (s.math.pi * mean), q_i + q_o


def mixed(s: Symbols, table: Table, visible: Number, a: Number) -> Number:
    """The density of visible normals' reflections mixed with that of what is returned [1/sr]."""
    share = lost(s, table, s.cos_o, a)[0]
    broad = s.cos_i / (s.math.pi * (s.cos_i**2 + a**2) * s.math.log(1 + 1 / a**2))
    return (visible + share * broad) / (1 + share)
