"""How much more than the exponential a model amplifies the roundings of its input, whatever the arithmetic.

Each is about |d ln f / d input| in eps where that is large for a reason beside Q: a sum of signed terms that nearly
cancels, or a factor that vanishes. The bars of the hard cases are wider by it; a model without an entry needs none.
"""

from collections.abc import Callable

from ..models import Model
from ..models._compensation import coefficients
from .compensation import Table, mean_lost
from .diffuse import oren_nayar, oren_nayar_energy_preserving
from .formulas import disk_radius2, entry, lafortune_product
from .fresnel import schlick
from .microfacets import TABLES
from .symbols import Number, Symbols, Values

EPS = 2.0**-52
DIM = 1e-300  # in place of kd = 0, where the derivative by kd still has a condition


def _horizontal(s: Symbols) -> Number:
    return abs(s.wi[0] * s.wo[0]) + abs(s.wi[1] * s.wo[1])


def _lafortune(s: Symbols, v: Values) -> Number:
    product = lafortune_product(s, v)
    size = abs(v["cx"] * s.wi[0] * s.wo[0]) + abs(v["cy"] * s.wi[1] * s.wo[1]) + s.cos_i * s.cos_o
    return v["n"] * size / product if product > 0 else 0


def _edwards(s: Symbols, v: Values) -> Number:
    radius2 = disk_radius2(s, v)
    return 2 * v["n"] * radius2 / (1 - radius2) if radius2 < 1 else 0


def _oren_nayar(s: Symbols, v: Values) -> Number:
    v = {**v, "kd": v["kd"] or DIM}
    return v["kd"] / s.math.pi * _horizontal(s) / max(s.cos_i, s.cos_o) / oren_nayar(s, v)[0]


def _oren_nayar_energy_preserving(s: Symbols, v: Values) -> Number:
    v = {**v, "kd": v["kd"] or DIM}
    size = 2 * v["sigma"] / s.math.pi * _horizontal(s) / (max(s.cos_i, s.cos_o) if s.level > 0 else 1)
    return s.over(v["kd"] / s.math.pi * size, oren_nayar_energy_preserving(s, v)[0])


def _schlick(s: Symbols, v: Values) -> Number:
    """|c dF/dc / F| at c = h.wo where F is little but (1 - c)^5."""
    slope = 5 * (1 - v["f0"]) * s.cos_d * s.positive(1 - s.cos_d) ** 4
    return s.over(slope, schlick(s, v["f0"])) if slope else 0


Condition = Callable[[Symbols, Values], Number]

# In units of the eps of the directions' precision.
CONDITION: dict[str, Condition] = {
    "edwards": _edwards,
    "oren_nayar": _oren_nayar,
    "oren_nayar(energy_preserving)": _oren_nayar_energy_preserving,
}

# In units of the eps of double precision, in which this is summed whatever the directions' precision is.
IN_DOUBLE: dict[str, Condition] = {
    "lafortune": _lafortune,
}


def _compensated(table: Table, s: Symbols, v: Values) -> Number:
    """Of 1 - Gbar, where nearly all light is lost to single scattering, and of the place within a table's cell."""
    mean = mean_lost(s, table, v["a"])
    return 4 * mean / (1 - mean) + max(coefficients(table.name).shape)


def condition(choice: Model, s: Symbols, v: Values, eps: float) -> Number:
    """The relative error that roundings by `eps` and in double precision may be amplified to, in exact arithmetic."""
    own, in_double = entry(CONDITION, choice), entry(IN_DOUBLE, choice)
    error = (own(s, v) if own else 0) * eps + (in_double(s, v) if in_double else 0) * EPS
    if "compensated" in choice.options:
        error = error + _compensated(entry(TABLES, choice), s, v) * EPS
    lobe = "f0" in choice.parameter and "kd" not in choice.parameter
    return error + _schlick(s, v) * eps if lobe else error
