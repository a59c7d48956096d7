"""What the library makes of points, and what the equations as printed do, values and gradients at once."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.func import grad, vmap

from ..geometry import geometry
from ..models import Model
from . import formulas
from .catalogue import Point, form_of
from .textbook import Textbook


@dataclass(frozen=True)
class Results:
    """What some arithmetic makes of points: f and density (N,), df by directions (N, 6) and by each value (N,)."""

    f: Tensor
    density: Tensor
    by_direction: Tensor
    by_value: dict[str, Tensor]


def ours(choice: Model, values: dict[str, Tensor], wi: Tensor, wo: Tensor) -> Results:
    """The library's results for points of one choice; values (N,) by name, directions (N, 3)."""
    form = form_of(choice)

    def keyed(values: dict[str, Tensor]) -> dict[str, Tensor]:
        return {f"{choice.name}.{name}": value for name, value in values.items()}

    def f(values: dict[str, Tensor], wi: Tensor, wo: Tensor) -> Tensor:
        return form.f(keyed(values), geometry(wi, wo, form.needs)).squeeze(-1)

    def density(values: dict[str, Tensor], wi: Tensor, wo: Tensor) -> Tensor:
        return form.pdf(keyed(values), geometry(wi, wo, form.pdf_needs))

    by_value, by_wi, by_wo = vmap(grad(f, argnums=(0, 1, 2)))(values, wi, wo)
    return Results(vmap(f)(values, wi, wo), vmap(density)(values, wi, wo), torch.cat([by_wi, by_wo], dim=-1), by_value)


def printed(choice: Model, values: dict[str, Tensor], wi: Tensor, wo: Tensor) -> Results:
    """The results of the model's equations as they are printed, in the precision of the directions."""
    leaves = {name: value.clone().requires_grad_() for name, value in values.items()}
    components = [x.clone().requires_grad_() for w in (wi, wo) for x in w.unbind(-1)]
    pair = Textbook((components[0], components[1], components[2]), (components[3], components[4], components[5]))
    f = formulas.value(choice)(pair, leaves)[0]
    slopes = torch.autograd.grad(f.sum(), [*components, *leaves.values()], allow_unused=True, materialize_grads=True)
    density = formulas.density(choice)(pair, leaves).detach()
    return Results(f.detach(), density, torch.stack(slopes[:6], dim=-1), dict(zip(leaves, slopes[6:], strict=True)))


def stored(points: Sequence[Point], dtype: torch.dtype) -> list[Point]:
    """The points with their numbers rounded to a precision."""

    def rounded(numbers: Iterable[float]) -> list[float]:
        return torch.tensor(list(numbers), dtype=torch.float64).to(dtype).tolist()

    found = []
    for point in points:
        names, numbers = zip(*point.values, strict=True)
        xi, yi, zi, xo, yo, zo = rounded((*point.wi, *point.wo))
        values = tuple(zip(names, rounded(numbers), strict=True))
        found.append(Point(point.choice, values, (xi, yi, zi), (xo, yo, zo)))
    return found
