"""Lambert's ideal diffuse reflection.

    f(wi, wo) = kd / pi                                                       [1/sr]

kd, diffuse reflectance [1].
Box: kd in [0, 1].
Reciprocal; the directional albedo is kd from every direction.
Source: Lambert 1760, Photometria. Departure: none.
"""

import math

from torch import Tensor

from ..geometry import Geometry
from ..parameters import Values
from ._diffuse import Diffuse


class Lambert(Diffuse):
    """The same radiance in every direction."""

    name = "lambert"
    good_for = "Matt paint, paper and plaster: equally bright from every side."

    def basis(self, values: Values, g: Geometry) -> tuple[Tensor, ...]:
        """1/pi, for every pair of directions."""
        return (values["kd"].new_full((1,), 1 / math.pi),)
