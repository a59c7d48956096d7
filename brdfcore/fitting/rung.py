"""One step of the ladder of materials that a fit climbed."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Rung:
    """A material that was tried: what it adds or leaves out, how it did, and whether the ladder went on from it.

    error and held_out are root mean squares in the unit of the loss's residual: at the samples fitted to, and at incidences
    that were left out (held_out.py). `criterion` is that of the richer of the two materials compared less that of the
    leaner one [1]: below 0 it asks for the richer one (criterion.py); NaN on the first rung.
    """

    effect: str
    model: str
    error: float
    held_out: float
    criterion: float
    parameters: int  # free values, channels counted
    seconds: float
    kept: bool
    reason: str

    def to_dict(self) -> dict[str, Any]:
        """The rung as JSON-able data, null where there is no criterion."""
        return {**vars(self), "criterion": self.criterion if self.criterion == self.criterion else None}
