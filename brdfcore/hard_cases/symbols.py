"""The symbols that papers write their equations in: a pair of directions, its half vector, and the arithmetic.

The equations (formulas.py) are written once. Read with `textbook.Textbook` they are what a programmer gets who types
them in as printed, in float32 or float64; read with `exact.Exact` they are the truth, to 160 digits.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any, ClassVar

Number = Any  # a tensor of torch's, (N,), or a number of mpmath's
Values = Mapping[str, Number]  # by parameter name
Vector = tuple[Number, Number, Number]


class Symbols(ABC):
    """A pair of directions as equations see it. What is called cos, tan and so on has no unit; angles are radians."""

    math: ClassVar[Any]  # torch or mpmath's context: exp, log, sqrt, erf, pi

    def __init__(self, wi: Vector, wo: Vector) -> None:
        self.wi, self.wo = wi, wo

    @property
    def cos_i(self) -> Number:
        """The cosine of theta_i."""
        return self.wi[2]

    @property
    def cos_o(self) -> Number:
        """The cosine of theta_o."""
        return self.wo[2]

    @property
    @abstractmethod
    def h(self) -> Vector:
        """The unit half vector."""

    @property
    def cos_h(self) -> Number:
        """The cosine of theta_h."""
        return self.h[2]

    @property
    @abstractmethod
    def tan2_h(self) -> Number:
        """The squared tangent of theta_h."""

    @property
    @abstractmethod
    def cos_d(self) -> Number:
        """The cosine between the half vector and either direction."""

    @property
    @abstractmethod
    def one_plus_cosine(self) -> Number:
        """1 + cos theta_i cos theta_o + sin theta_i sin theta_o cos(phi_i - phi_o)."""

    @property
    @abstractmethod
    def level(self) -> Number:
        """cos(phi_i - phi_o) sin theta_i sin theta_o, the product of the horizontal components."""

    @property
    @abstractmethod
    def relief(self) -> Number:
        """cos(phi_i - phi_o) sin alpha tan beta, alpha the larger and beta the smaller of theta_i and theta_o."""

    @abstractmethod
    def turned(self, x: Number, y: Number) -> Number:
        """The sum x cos^2 phi_h + y sin^2 phi_h."""

    @abstractmethod
    def turned_by_components(self, x: Number, y: Number) -> Number:
        """(x hx^2 + y hy^2) / (1 - hz^2), which is the same."""

    @abstractmethod
    def stretched_tangent(self, w: Vector, ax: Number, ay: Number) -> Number:
        """The product tan theta sqrt(ax^2 cos^2 phi + ay^2 sin^2 phi) of a direction."""

    @abstractmethod
    def angle(self, cosine: Number) -> Number:
        """The angle of a cosine [radians]."""

    @abstractmethod
    def sine(self, cosine: Number) -> Number:
        """The sine of that angle."""

    @abstractmethod
    def complex(self, real: Number, imaginary: Number) -> Number:
        """A complex number."""

    @abstractmethod
    def over(self, x: Number, y: Number) -> Number:
        """The quotient x/y; in exact arithmetic, 0/0 is 0 and 1/0 infinite, as the limits are."""

    @abstractmethod
    def positive(self, x: Number) -> Number:
        """The larger of x and 0, where a power of it is taken that leaves no kink."""

    @abstractmethod
    def where_positive(self, x: Number, then: Number, otherwise: Number) -> Number:
        """`then` where x > 0, else `otherwise`."""

    @abstractmethod
    def maximum(self, *numbers: Number) -> Number:
        """The largest."""

    @abstractmethod
    def minimum(self, *numbers: Number) -> Number:
        """The smallest."""

    @abstractmethod
    def surface(self, table: str, x: Number, y: Number) -> Number:
        """The bicubic spline of a table of lost energy at x and y in [0, 1]."""

    @abstractmethod
    def total(
        self, part: Callable[[Number, Number], Number], rule: tuple[Sequence[float], Sequence[float]], key: Hashable
    ) -> Number:
        """The sum of part(node, weight) over a rule's nodes and weights; `key` holds all that it depends on."""
