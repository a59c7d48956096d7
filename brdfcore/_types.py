"""Shape aliases for annotations; jaxtyping's names, checked while the tests run.

Leading dimensions broadcast against each other; a trailing 1 is a quantity that all channels share.
"""

from jaxtyping import Bool, Float
from torch import Tensor

Directions = Float[Tensor, "... 3"]  # unit vectors that leave the surface
Quantity = Float[Tensor, "... 1"]  # one number a pair of directions
Mask = Bool[Tensor, "... 1"]
Spectrum = Float[Tensor, "... channels"]  # one number a pair of directions and channel (1 channel when gray)
Density = Float[Tensor, "..."]  # per solid angle [1/sr]
Value = Float[Tensor, ""] | Float[Tensor, " channels"]  # a parameter: one number, or one a channel
