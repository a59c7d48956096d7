"""An upper bound of f cos theta_o over all directions into a box.

    maximum(material, wi, (low, high)) >= f(wi, wo) cos theta_o  for every wo = v/|v|, low <= v <= high       [1/sr]

Walter 2005, section 4, bounds isotropic Ward in one step: the largest cos theta_h over the box, times the largest
cosine. Here the intervals of wo's components (his eq. 27) give those of the half vector's slopes, from which every
model of `BOUNDS` follows, isotropic or anisotropic (his future work). The box is bisected where the bound is largest,
until the bound is within `TOLERANCE` of a value that f cos theta_o takes, or the budget is spent. Stopping early makes
a bound looser, never wrong: it is the largest over pieces that cover the box. Rounding is counted against it, so that
no direction in the box evaluates higher in the precision of wi, denormals aside (tests/test_bounds.py).
Departures: no closed form in h, so the paper's eq. 29, which needs v*_x in its numerator, is not used; the terms of a
material are bounded together on each piece, which is never looser than the sum of their bounds.
"""

import torch
from torch import Tensor

from .._types import Directions, Spectrum
from ..errors import InvalidValueError
from ..geometry import FLOOR, check_broadcast, check_directions
from ..models.material import Material, check_material
from .pieces import Interval, faces, middle_of, pieces_of
from .terms import BOUNDS, OPTIONS

TOLERANCE = 0.01  # of the bound above a value that is taken
NEGLIGIBLE = 1e-300  # [1/sr]: a bound below this is not worth refining
SPLITS = 8  # pieces of a box that are bisected at a time
POOL = 96  # pieces of a box that are remembered; those beyond count with their bound
ROUNDS = 60  # of bisections
ROWS = 2048  # boxes at a time, for the memory


def maximum(material: Material, wi: Directions, box: tuple[Tensor, Tensor]) -> Spectrum:
    """An upper bound of f cos theta_o [1/sr] over the directions wo that point into a box, (..., C), no gradient.

    wi is (..., 3); the box's corners low and high are (3,), or (..., 3) for a box each, in the tangent frame and in any
    unit of length. Directions at or below the horizon reflect nothing: a box that lies below it has the bound 0, one
    that straddles it counts with its upper part. A box that holds the origin is met in every direction, so its bound is
    over the hemisphere. The bound is finite for every wi above the horizon (float32 may overflow), and 0 for others.
    Raises InvalidValueError for a model or option that has no bound, and for corners that make no box.
    """
    check_material(material)
    check_directions("wi", wi)
    low, high = _corners(wi, box)
    for term in material.form.terms:
        if term.model.name not in BOUNDS or not set(term.model.options) <= OPTIONS:
            raise InvalidValueError(
                f"Expected every term to be one of {', '.join(BOUNDS)} (options: {', '.join(sorted(OPTIONS))}), "
                f"got {term.model.name}({', '.join(term.model.options)}). Bound the material without it.",
                field="material",
            )
    with torch.no_grad():
        upper = _Upper(material, wi)
        w, low, high = torch.broadcast_tensors(wi.double(), low, high)
        rows = [w.reshape(-1, 3), low.reshape(-1, 3), high.reshape(-1, 3)]
        parts = [_refined(upper, *chunk) for chunk in zip(*(row.split(ROWS) for row in rows), strict=True)]
        return torch.cat(parts).reshape(*w.shape[:-1], material.channels).to(wi.dtype)


def _corners(wi: Tensor, box: tuple[Tensor, Tensor]) -> Interval:
    """The box's corners in double precision, or an error."""
    try:
        low, high = (torch.as_tensor(corner, dtype=torch.float64, device=wi.device) for corner in box)
    except (TypeError, ValueError, RuntimeError):
        got = f"{len(box)} of them" if isinstance(box, tuple | list) and len(box) != 2 else repr(box)
        raise InvalidValueError(
            f"Expected the box to be two corners, (low, high), got {got}. Pass each as (3,) or (..., 3).", field="box"
        ) from None
    for name, corner in (("low", low), ("high", high)):
        if corner.ndim == 0 or corner.shape[-1] != 3:
            raise InvalidValueError(
                f"Expected the box's corner {name} to be three coordinates on the last axis, got shape "
                f"{tuple(corner.shape)}. Pass it as (3,) or (..., 3).",
                field="box",
            )
    for name, value in (("wi", wi), ("low", low), ("high", high)):
        if not bool(value.isfinite().all()):
            raise InvalidValueError(
                f"Expected {name} to be finite, got {value[~value.isfinite()][0].item()}. Give it finite numbers.",
                field="wi" if name == "wi" else "box",
            )
    check_broadcast("wi and the box", wi, low, high, field="box")
    swapped = low > high
    if bool(swapped.any()):
        a, b = (corner.expand_as(swapped)[swapped][0].item() for corner in (low, high))
        raise InvalidValueError(
            f"Expected the box's corner low to be at most high, got {a:g} above {b:g}. Swap them.", field="box"
        )
    return low, high


class _Upper:
    """The largest value of a material's f cos theta_o over the directions into pieces of faces, per channel."""

    def __init__(self, material: Material, like: Tensor) -> None:
        values = {key: value.detach().to(like.device) for key, value in material.values().items()}
        self.terms = [(term.model, material.form.of_term(term, values)) for term in material.form.terms]
        coefficients = [torch.atleast_1d(c) for model, own in self.terms for c in model.coefficients(own)]
        self.coefficients = [c.expand(material.channels) for c in coefficients]
        self.eps, self.floor = torch.finfo(like.dtype).eps, FLOOR[like.dtype]

    def __call__(self, wi: Tensor, low: Tensor, high: Tensor) -> Tensor:
        """For wi (rows, 1, 3) and pieces low <= v <= high (rows, pieces, 3), one coordinate of v being 1 or -1."""
        pieces = pieces_of(wi, low, high, self.eps, self.floor)
        bases = [basis for model, own in self.terms for basis in BOUNDS[model.name](model, own, pieces)]
        bound = torch.stack([b * c for b, c in zip(bases, self.coefficients, strict=True)]).sum(0)
        return torch.where(high[..., 2:] > 0, bound * (1 + 64 * self.eps), 0.0)


def _refined(upper: _Upper, wi: Tensor, low: Tensor, high: Tensor) -> Tensor:
    """The bound of each row's box, (rows, C)."""
    result = low.new_zeros(len(low), len(upper.coefficients[0]))
    row = torch.nonzero(wi[:, 2] > 0).squeeze(-1)  # the rows that are not settled
    wi = wi[row].unsqueeze(1)
    low, high = faces(low[row], high[row])
    bound = upper(wi, low, high)
    middle = middle_of(low, high)
    taken = upper(wi, middle, middle).amax(1)  # a value that f cos theta_o has somewhere
    forgotten = torch.zeros_like(taken)  # the largest bound of the pieces that are not split any more
    for _ in range(ROUNDS):
        largest = bound.amax(1)
        result[row] = torch.maximum(largest, forgotten)
        target = ((1 + TOLERANCE) * taken).clamp(min=NEGLIGIBLE)
        active = ((largest > target) & (largest > forgotten)).any(-1)
        if not bool(active.any()):
            break
        row, wi, low, high, bound = row[active], wi[active], low[active], high[active], bound[active]
        taken, forgotten, target = taken[active], forgotten[active], target[active].unsqueeze(1)
        order = (bound / target).amax(-1).argsort(dim=1, descending=True).unsqueeze(-1)
        low, high, bound = (x.gather(1, order.expand_as(x)) for x in (low, high, bound))
        if bound.shape[1] > POOL:
            forgotten = torch.maximum(forgotten, bound[:, POOL:].amax(1))
        first, rest = slice(SPLITS), slice(SPLITS, POOL)
        middle = middle_of(low[:, first], high[:, first])
        taken = torch.maximum(taken, upper(wi, middle, middle).amax(1))
        halves = _halves(upper, wi, low[:, first], high[:, first], middle, target)
        low, high, bound = (
            torch.cat([half, old[:, rest]], dim=1) for half, old in zip(halves, (low, high, bound), strict=True)
        )
    return result


def _halves(
    upper: _Upper, wi: Tensor, low: Tensor, high: Tensor, middle: Tensor, target: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """The halves of pieces (rows, 2 pieces, 3), cut across the angle that lowers the bounds more, and their bounds.

    The wider angle need not be that one: near the horizon and across a stretched lobe, f varies most over thin pieces.
    """
    lows, highs = [], []
    for axis in (torch.atan(high) - torch.atan(low)).topk(2, dim=-1).indices.split(1, dim=-1):
        cut = torch.arange(3, device=low.device) == axis
        lows += [low, torch.where(cut, middle, low)]
        highs += [torch.where(cut, middle, high), high]
    low, high = torch.cat(lows, dim=1), torch.cat(highs, dim=1)
    bound = upper(wi, low, high)
    cost = (bound / target).amax(-1).unflatten(1, (2, 2, -1)).sum(2)  # rows, axes, pieces
    other = (cost[:, 1] < cost[:, 0]).repeat(1, 2).unsqueeze(-1)
    a, b, c = (torch.where(other, y, x) for x, y in (z.chunk(2, dim=1) for z in (low, high, bound)))
    return a, b, c
