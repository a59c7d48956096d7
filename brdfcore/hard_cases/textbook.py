"""Equations as they are typed in from a paper: angles by acos and atan2, a normalised h, no case taken apart."""

import functools
from collections.abc import Callable, Hashable, Sequence
from functools import cached_property
from typing import Any, ClassVar

import torch

from ..models._compensation import coefficients as lost_energy
from .symbols import Number, Symbols, Vector


class Textbook(Symbols):
    """Pairs of directions (N,) in torch's float32 or float64, with gradients."""

    math: ClassVar[Any] = torch

    @cached_property
    def h(self) -> Vector:
        """The sum wi + wo over its length."""
        x, y, z = (i + o for i, o in zip(self.wi, self.wo, strict=True))
        norm = torch.sqrt(x**2 + y**2 + z**2)
        return x / norm, y / norm, z / norm

    @cached_property
    def tan2_h(self) -> Number:
        """By the angle."""
        return torch.tan(self.angle(self.cos_h)) ** 2

    @property
    def cos_d(self) -> Number:
        """The product h.wo."""
        x, y, z = self.h
        return x * self.wo[0] + y * self.wo[1] + z * self.wo[2]

    @property
    def one_plus_cosine(self) -> Number:
        """By the product wi.wo, which the cosines make up."""
        return 1 + sum(i * o for i, o in zip(self.wi, self.wo, strict=True))

    @property
    def level(self) -> Number:
        """wi.wo less the product of the heights."""
        return sum(i * o for i, o in zip(self.wi, self.wo, strict=True)) - self.cos_i * self.cos_o

    @property
    def relief(self) -> Number:
        """By the angles."""
        theta_i, theta_o = self.angle(self.cos_i), self.angle(self.cos_o)
        alpha, beta = torch.maximum(theta_i, theta_o), torch.minimum(theta_i, theta_o)
        return self._cos_between * torch.sin(alpha) * torch.tan(beta)

    @property
    def _cos_between(self) -> Number:
        return torch.cos(_azimuth(self.wi) - _azimuth(self.wo))

    def turned(self, x: Number, y: Number) -> Number:
        """By the azimuth; where both are one, no azimuth is in the equation."""
        phi = _azimuth(self.h)
        return x if x is y else torch.cos(phi) ** 2 * x + torch.sin(phi) ** 2 * y

    def turned_by_components(self, x: Number, y: Number) -> Number:
        """As it is written."""
        return (x * self.h[0] ** 2 + y * self.h[1] ** 2) / (1 - self.h[2] ** 2)

    def stretched_tangent(self, w: Vector, ax: Number, ay: Number) -> Number:
        """By the angles."""
        phi, tangent = _azimuth(w), torch.tan(self.angle(w[2]))
        return tangent * (ax if ax is ay else torch.sqrt(torch.cos(phi) ** 2 * ax**2 + torch.sin(phi) ** 2 * ay**2))

    def angle(self, cosine: Number) -> Number:
        """The arc cosine."""
        return torch.acos(cosine)

    def sine(self, cosine: Number) -> Number:
        """By the angle."""
        return torch.sin(self.angle(cosine))

    def complex(self, real: Number, imaginary: Number) -> Number:
        """A complex tensor."""
        return torch.complex(real, imaginary)

    def over(self, x: Number, y: Number) -> Number:
        """The quotient."""
        return x / y

    def positive(self, x: Number) -> Number:
        """The number, clamped."""
        return x.clamp(min=0)

    def where_positive(self, x: Number, then: Number, otherwise: Number) -> Number:
        """The choice, which lets the NaN of what it leaves out through to the gradient."""
        return torch.where(x > 0, then, otherwise)

    def maximum(self, *numbers: Number) -> Number:
        """The largest; a tensor comes first."""
        return functools.reduce(lambda x, y: x.clamp(min=y), numbers)

    def minimum(self, *numbers: Number) -> Number:
        """The smallest; a tensor comes first."""
        return functools.reduce(lambda x, y: x.clamp(max=y), numbers)

    def surface(self, table: str, x: Number, y: Number) -> Number:
        """By all the B-splines."""
        coefficients = lost_energy(table)
        rows, columns = (_splines(z, count) for z, count in zip((y, x), coefficients.shape, strict=True))
        return (rows @ coefficients.to(rows.dtype) * columns).sum(-1)

    def total(
        self, part: Callable[[Number, Number], Number], rule: tuple[Sequence[float], Sequence[float]], key: Hashable
    ) -> Number:
        """All nodes at once, on an axis before the pairs'."""
        like = torch.as_tensor(self.wi[2]).dtype
        nodes, weights = (torch.tensor(numbers, dtype=like)[:, None] for numbers in rule)
        return part(nodes, weights).sum(0)


def _splines(x: Number, count: int) -> Number:
    """The uniform cubic B-splines (..., count) at x in [0, 1], by powers of the distance from their middles."""
    distance = abs(x[..., None] * (count - 3) + 1 - torch.arange(count))
    return ((2 - distance).clamp(min=0) ** 3 - 4 * (1 - distance).clamp(min=0) ** 3) / 6


def _azimuth(w: Vector) -> Number:
    return torch.atan2(w[1], w[0])
