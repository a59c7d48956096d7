"""Shape aliases for annotations; jaxtyping's names, checked while the tests run.

`*batch` dimensions broadcast against each other; a trailing 1 is a quantity that all channels share.
"""

from jaxtyping import Bool, Float
from torch import Tensor

Directions = Float[Tensor, "*directions 3"]  # unit vectors that leave the surface
Quantity = Float[Tensor, "*quantity 1"]  # one number a pair of directions
Mask = Bool[Tensor, "*mask 1"]
Spectrum = Float[Tensor, "*spectrum channels"]  # one number a pair of directions and channel (1 channel when gray)
Density = Float[Tensor, "*density"]  # per solid angle [1/sr]
Value = Float[Tensor, ""] | Float[Tensor, " channels"]  # a parameter: one number, or one a channel
