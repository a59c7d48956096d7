"""Equations in exact arithmetic, to 160 digits, on the components of the directions as they are stored.

The directions are not normalised again: near wi = -wo that would change everything. Since stored vectors are not
exactly of length 1, the cosine h.wo is taken as the mean of h.wi and h.wo, which is |wi + wo|/2 whatever their
lengths, and angles are eliminated from the equations, by identities that hold for unit vectors, in favour of the
components of H = wi + wo.
"""

import functools
from collections.abc import Callable, Hashable, Sequence
from functools import cached_property
from typing import Any, ClassVar

import mpmath  # type: ignore[import-untyped]

from ..models._compensation import coefficients as lost_energy
from .symbols import Number, Symbols, Vector

mp = mpmath.mp.clone()
mp.dps = 160  # at the lowest height that is evaluated, 7e-49, an equation may lose 97 of them
for name in ("exp", "erf", "acos"):  # most differences leave most of an equation as it was
    setattr(mp, name, functools.lru_cache(maxsize=1024)(getattr(mp, name)))


class Exact(Symbols):
    """One pair of directions; remembers how near its equation came to a kink."""

    math: ClassVar[Any] = mp

    def __init__(self, wi: Vector, wo: Vector) -> None:
        super().__init__(wi, wo)
        self.tie = mp.mpf(1)  # about how far, relative to 1, the arguments of a choice were from a tie

    @cached_property
    def sum(self) -> Vector:
        """H = wi + wo."""
        x, y, z = (i + o for i, o in zip(self.wi, self.wo, strict=True))
        return x, y, z

    @cached_property
    def norm(self) -> Number:
        """The length |H|."""
        return mp.sqrt(sum(c**2 for c in self.sum))

    @cached_property
    def h(self) -> Vector:
        """H / |H|."""
        x, y, z = (c / self.norm for c in self.sum)
        return x, y, z

    @property
    def tan2_h(self) -> Number:
        """(Hx^2 + Hy^2) / Hz^2."""
        return (self.sum[0] ** 2 + self.sum[1] ** 2) / self.sum[2] ** 2

    @property
    def cos_d(self) -> Number:
        """|H| / 2."""
        return self.norm / 2

    @property
    def one_plus_cosine(self) -> Number:
        """|H|^2 / 2."""
        return self.norm**2 / 2

    @property
    def level(self) -> Number:
        """The sum xi xo + yi yo."""
        return self.wi[0] * self.wo[0] + self.wi[1] * self.wo[1]

    @property
    def relief(self) -> Number:
        """The same over the larger cosine."""
        return self.level / self.maximum(self.cos_i, self.cos_o)

    def turned(self, x: Number, y: Number) -> Number:
        """(x Hx^2 + y Hy^2) / (Hx^2 + Hy^2); at h = n any azimuth serves, since it multiplies 0."""
        hx2, hy2 = self.sum[0] ** 2, self.sum[1] ** 2
        return (x * hx2 + y * hy2) / (hx2 + hy2) if hx2 + hy2 else x

    turned_by_components = turned

    def stretched_tangent(self, w: Vector, ax: Number, ay: Number) -> Number:
        """sqrt(ax^2 x^2 + ay^2 y^2) / z."""
        return mp.sqrt((ax * w[0]) ** 2 + (ay * w[1]) ** 2) / w[2]

    def angle(self, cosine: Number) -> Number:
        """The arc cosine, 0 for a stored cosine above 1."""
        return mp.acos(min(cosine, mp.mpf(1)))

    def sine(self, cosine: Number) -> Number:
        """sqrt(1 - cosine^2), 0 for a stored cosine above 1."""
        return mp.sqrt(max(1 - cosine**2, mp.mpf(0)))

    def complex(self, real: Number, imaginary: Number) -> Number:
        """A complex number."""
        return mp.mpc(real, imaginary)

    def over(self, x: Number, y: Number) -> Number:
        """The quotient, or its limit."""
        return x / y if y else mp.inf if x else mp.mpf(0)

    def positive(self, x: Number) -> Number:
        """The number or 0."""
        return max(x, mp.mpf(0))

    def where_positive(self, x: Number, then: Number, otherwise: Number) -> Number:
        """The choice, and how near x was to 0."""
        self.tie = min(self.tie, abs(x))
        return then if x > 0 else otherwise

    def maximum(self, *numbers: Number) -> Number:
        """The largest, and how near the next was."""
        return self._first(sorted(numbers, reverse=True))

    def minimum(self, *numbers: Number) -> Number:
        """The smallest, and how near the next was."""
        return self._first(sorted(numbers))

    def _first(self, numbers: list[Number]) -> Number:
        first, second, *_ = numbers
        self.tie = min(self.tie, abs(first - second) / max(abs(first), abs(second)))
        return first

    def surface(self, table: str, x: Number, y: Number) -> Number:
        """By the B-splines that are not 0 there; beyond 1 the last piece goes on."""
        coefficients = _coefficients(table)
        rows, columns = _splines(y, len(coefficients)), _splines(x, len(coefficients[0]))
        return sum(r * sum(c * coefficients[j][i] for i, c in columns) for j, r in rows)

    def total(
        self, part: Callable[[Number, Number], Number], rule: tuple[Sequence[float], Sequence[float]], key: Hashable
    ) -> Number:
        """One by one, and once a key."""
        if key not in _TOTALS:
            if len(_TOTALS) == MEMORY:
                _TOTALS.clear()
            _TOTALS[key] = mp.fsum(part(mp.mpf(node), mp.mpf(weight)) for node, weight in zip(*rule, strict=True))
        return _TOTALS[key]


MEMORY = 1024
_TOTALS: dict[Hashable, Number] = {}


@functools.cache
def _coefficients(table: str) -> list[list[Number]]:
    return [[mp.mpf(c) for c in row] for row in lost_energy(table).tolist()]


@functools.lru_cache(maxsize=1024)
def _splines(x: Number, count: int) -> list[tuple[int, Number]]:
    """The uniform cubic B-splines that are not 0 at x in [0, 1], each after its index."""
    first = min(max(int(mp.floor(x * (count - 3))), 0), count - 4)
    t = x * (count - 3) - first
    parts = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, 3 * (1 - t) ** 3 - 6 * (1 - t) ** 2 + 4, t**3)
    return [(first + k, part / 6) for k, part in enumerate(parts)]
