"""Which values the data hold on an end of their box: those whose unbounded optimum lies beyond it by more than noise.

    z = (unbounded value - end) / standard error > 2

The unbounded value is the Gauss-Newton step's where the others follow it. A value with less than that lies on its end
by chance, as the noise of these samples has it: the truth may lie inside, and the values coupled to it move when it
does. It counts as free, then: its interval reaches inwards from the end, and those of the others know of it.
"""

import torch
from torch import Tensor

from .identifiability import Spectrum
from .problem import Gram

_BEYOND = 2.0  # standard errors


def certain(gram: Gram, pressed: Tensor, blind: Tensor, total: Tensor) -> Tensor:
    """Which of the values that are pressed on an end (M, D) the data hold there, (M, D) bool.

    `blind` (M, D) move no residual; `total` (M, D, D) is the noise's sum over the residuals (noise.py). A value is
    freed alone at first, then with all that seem to lie on their ends by chance, until those that do are none beyond.
    """
    if not bool(pressed.any()):
        return pressed
    inverse = Spectrum.of(gram.matrix, ~pressed & ~blind).inverse()
    left = torch.eye(pressed.shape[1], dtype=torch.float64) - gram.matrix @ inverse
    variance = ((left @ total) * left).sum(-1)  # of the gradient that is left when the others have followed
    found = pressed & (gram.gradient.square() > _BEYOND**2 * variance)
    while True:
        loose = pressed & ~found
        inverse = Spectrum.of(gram.matrix, ~found & ~blind).inverse()
        right = torch.where(loose, gram.gradient, 0.0)
        step = (inverse @ right.unsqueeze(-1)).squeeze(-1) * right.sign()
        variance = ((inverse @ total) * inverse).sum(-1)
        more = loose & (step > _BEYOND * variance.sqrt())
        if not bool(more.any()):
            return found
        found |= more
