"""Pairs of directions that are hard, by name, and why: at the normal, at the horizon, and where they cancel."""

import math
from dataclasses import dataclass

Direction = tuple[float, float, float]
Pair = tuple[Direction, Direction]

NORMAL = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Place:
    """A kind of pair (wi, wo) that breaks some way of writing an equation."""

    name: str
    why: str
    pairs: tuple[Pair, ...]


def at(height: float, azimuth: float = 0.3) -> Direction:
    """The direction of a height above the horizon, cos theta, and an azimuth [radians]."""
    side = math.sqrt((1 - height) * (1 + height))
    return side * math.cos(azimuth), side * math.sin(azimuth), height


def mirrored(w: Direction) -> Direction:
    """The direction that the normal mirrors exactly."""
    return -w[0], -w[1], w[2]


def _tilted(height: float, slope: float) -> Pair:
    """A pair whose half vector is off the normal by a slope: wo mirrored at it."""
    w, h = at(height, 0.4), (slope, 0.5 * slope, 1.0)
    twice = 2 * sum(a * b for a, b in zip(w, h, strict=True)) / sum(a * a for a in h)
    x, y, z = (twice * b - a for a, b in zip(w, h, strict=True))
    return (x, y, z), w


def opposite(height: float, aside: float) -> Pair:
    """A pair just above the horizon, one twice as high, nearly opposite: h has the slope aside / 3 along y."""
    y, z = aside * height, 2 * height
    return (math.sqrt((1 - height) * (1 + height)), 0.0, height), (-math.sqrt(1 - y * y - z * z), y, z)


def _turned(w: Direction, azimuth: float) -> Direction:
    cosine, sine = math.cos(azimuth), math.sin(azimuth)
    return cosine * w[0] - sine * w[1], sine * w[0] + cosine * w[1], w[2]


def _opposites(height: float) -> tuple[Pair, ...]:
    """Such pairs along x, and at azimuths where their components do not cancel exactly."""
    along_x = tuple(opposite(height, aside) for aside in (0.1, 0.6, 3.0))
    wi, wo = along_x[1]
    return (*along_x, *((_turned(wi, azimuth), _turned(wo, azimuth)) for azimuth in (0.4, 1.1, 2.0)))


_LOW = (1e-12, 1e-8, 1e-4)
_DENORMAL = (5e-324, 1e-310, 1e-45, 1e-40)

PLACES = (
    Place(
        "light and viewer at the normal",
        "acos has no slope at 1; the azimuth of h is undefined",
        ((NORMAL, NORMAL),),
    ),
    Place(
        "mirror, h = n exactly",
        "sin theta_h = 0: the azimuth of h is 0/0",
        tuple((at(z, t), mirrored(at(z, t))) for z, t in ((0.9, 0.0), (0.5, 0.4), (0.1, 2.9), (0.7, math.pi / 2))),
    ),
    Place(
        "mirror but for 1e-9 to 1e-2",
        "cos theta_h = 1 - 5e-19 rounds to 1, its acos to 0",
        tuple(_tilted(0.6, by) for by in (1e-9, 1e-6, 1e-4, 1e-3, 1e-2)),
    ),
    Place(
        "retro, wi = wo",
        "h.wo = 1 but for a rounding: 1 - h.wo may be < 0",
        (
            *((at(z), at(z)) for z in (0.95, 0.6, 0.1)),
            ((0.6, 0.0, 0.8), (0.6, 1e-12, 0.8)),
        ),
    ),
    Place(
        "far from the lobe",
        "exp(-tan^2/a^2) underflows; 0 times infinity is NaN",
        tuple((at(z), at(z, 0.5)) for z in (0.7, 0.3, 0.03)),
    ),
    Place(
        "one at the horizon, one at the normal",
        "1/cos theta = 1e12, and squared in derivatives",
        tuple(pair for z in _LOW for pair in ((at(z), NORMAL), (at(0.5, 2.0), at(z)))),
    ),
    Place(
        "mirror at the horizon",
        "ci co = 1e-24, Hz^4 = 2e-47: 0 in float32",
        tuple((at(z), mirrored(at(z))) for z in _LOW),
    ),
    Place(
        "retro at the horizon",
        "tan theta_h = 1e12: its 4th power overflows float32",
        tuple((at(z), at(z)) for z in _LOW),
    ),
    Place(
        "nearly opposite, 1e-12 above the horizon",
        "1 + wi.wo = 1e-24 cancels to nothing",
        _opposites(1e-12),
    ),
    Place(
        "nearly opposite, 1e-8 to 1e-3 above it",
        "wi + wo is short: it is what roundings leave of it",
        tuple(pair for z in (1e-8, 1e-5, 1e-3) for pair in _opposites(z)),
    ),
    Place(
        "wi = -wo on the horizon",
        "wi + wo = 0: every quotient is 0/0; f is 0",
        (((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)), ((0.6, 0.8, 0.0), (-0.6, -0.8, 0.0))),
    ),
    Place(
        "on and below the horizon",
        "f is 0; a 1/0 masked later still makes gradients NaN",
        (
            ((1.0, 0.0, 0.0), NORMAL),
            (at(0.5), (0.0, 1.0, 0.0)),
            ((0.6, 0.0, -0.8), NORMAL),
            (at(-1e-12), at(1e-12)),
            (at(0.3), (-at(0.3)[0], -at(0.3)[1], -0.3)),
            ((0.6, 0.0, -0.8), (-0.6, 0.0, -0.8)),
        ),
    ),
    Place(
        "heights that are denormal numbers",
        "1/cos overflows; counts as 2^-40, in float64 2^-160",
        tuple(
            pair
            for z in _DENORMAL
            for pair in (((1.0, 0.0, z), NORMAL), ((0.6, 0.8, z), (-0.6, -0.8, z)), ((1.0, 0.0, z), (1.0, 0.0, z)))
        ),
    ),
    Place(
        "longer than 1 by a rounding",
        "cos theta > 1: acos is NaN",
        (
            ((0.0, 0.0, 1 + 2.0**-23), NORMAL),
            ((0.0, 0.0, 1 + 2.0**-52), (0.0, 0.0, 1 + 2.0**-52)),
            (NORMAL, (3e-8, 0.0, 1.0)),
            ((0.6, 0.0, 0.8 + 2.0**-22), (0.6, 0.0, 0.8 + 2.0**-22)),
        ),
    ),
)
