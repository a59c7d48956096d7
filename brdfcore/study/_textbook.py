"""Ward's lobe as it is printed, in NumPy as a textbook writes it, and to 40 digits.

    rs / (4 pi ax ay sqrt(ci co)) exp(-tan^2 theta_h (cos^2 phi_h / ax^2 + sin^2 phi_h / ay^2))     Walter eq. 3 [1/sr]
    rs / (4 pi ax ay sqrt(ci co)) exp(-((h.x/ax)^2 + (h.y/ay)^2) / (h.n)^2)                         Walter eq. 4 [1/sr]
    rs / (4 pi ax ay sqrt(ci co)) exp(-2 ((h.x/ax)^2 + (h.y/ay)^2) / (1 + h.n))              Ward 1992 eq. 5b [1/sr]

The first two are equal, the third is Ward's "computationally convenient approximation"; Walter 2005, section 2, says of
it: "There is no reason to ever use this approximation." Directions (N, 3) above the horizon; float32 stays float32.
"""

import decimal
from collections.abc import Iterable
from decimal import Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

_PI = Decimal("3.14159265358979323846264338327950288419716939937511")
_DIGITS = 40


def _half(wi: Array, wo: Array) -> Array:
    """The unit half vector."""
    total = wi + wo
    return np.asarray(total / np.linalg.norm(total, axis=-1, keepdims=True))


def _scale(wi: Array, wo: Array, rs: float, ax: float, ay: float) -> Array:
    return rs / (4 * np.pi * ax * ay * np.sqrt(wi[:, 2] * wo[:, 2]))


def walter_3(wi: Array, wo: Array, rs: float, ax: float, ay: float) -> Array:
    """The lobe [1/sr] by the half vector's angles."""
    h = _half(wi, wo)
    theta = np.arccos(np.minimum(h[:, 2], 1))
    phi = np.arctan2(h[:, 1], h[:, 0])
    exponent = np.tan(theta) ** 2 * (np.cos(phi) ** 2 / ax**2 + np.sin(phi) ** 2 / ay**2)
    return _scale(wi, wo, rs, ax, ay) * np.exp(-exponent)


def walter_4(wi: Array, wo: Array, rs: float, ax: float, ay: float) -> Array:
    """The lobe [1/sr] by the half vector's components, which need no length 1 here, as Walter notes."""
    h = wi + wo
    exponent = ((h[:, 0] / ax) ** 2 + (h[:, 1] / ay) ** 2) / h[:, 2] ** 2
    return _scale(wi, wo, rs, ax, ay) * np.exp(-exponent)


def ward_5b(wi: Array, wo: Array, rs: float, ax: float, ay: float) -> Array:
    """Ward's approximation of the lobe [1/sr]."""
    h = _half(wi, wo)
    exponent = 2 * ((h[:, 0] / ax) ** 2 + (h[:, 1] / ay) ** 2) / (1 + h[:, 2])
    return _scale(wi, wo, rs, ax, ay) * np.exp(-exponent)


def exact(wi: Array, wo: Array, rs: float, ax: float, ay: float) -> list[Decimal]:
    """The lobe [1/sr] to 40 digits on the components as they are stored, from eq. 4."""
    with decimal.localcontext(prec=_DIGITS):
        over = Decimal(rs) / (4 * _PI * Decimal(ax) * Decimal(ay))
        x2, y2 = Decimal(ax) ** 2, Decimal(ay) ** 2
        found = []
        for i, o in zip(_decimals(wi), _decimals(wo), strict=True):
            x, y, z = (a + b for a, b in zip(i, o, strict=True))
            exponent = (x * x / x2 + y * y / y2) / (z * z)
            found.append(over * (-exponent).exp() / (i[2] * o[2]).sqrt())
        return found


def relative_errors(values: Array, reference: Iterable[Decimal]) -> NDArray[np.float64]:
    """|value / reference - 1| of each, without the rounding of the reference; infinite for a NaN."""
    with decimal.localcontext(prec=_DIGITS):
        pairs = zip(values.tolist(), reference, strict=True)
        errors = [abs(Decimal(v) / r - 1) if np.isfinite(v) else Decimal("inf") for v, r in pairs]
    return np.array([float(error) for error in errors])


def _decimals(directions: Array) -> list[list[Decimal]]:
    return [[Decimal(component) for component in row] for row in directions.tolist()]
