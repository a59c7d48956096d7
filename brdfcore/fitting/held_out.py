"""`bc.held_out`: how well a model foretells incidences that it was not fitted to.

    error = sqrt(sum w r_i^2 / sum w)      r_i, the loss's difference at sample i, of the fit that never saw i's block

of which a robust form's rho(r_i) takes the place of r_i^2.

Each fold is fitted to the samples of the others, from the optimum of all, all folds as one batch; so it costs a few
steps beside the fit itself, and finds the optimum next to that of all the data. Under `conserve_energy` each fold is a
fit of its own.
"""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from ..errors import ParameterError
from ..formats.samples import Samples, angles
from ._fit import Progress, Teller, fit, planned
from .data import Data
from .folds import split
from .given import plainly, whole
from .least_squares import least_squares
from .problem import Problem
from .result import number
from .search import search

_STEPS = 40  # of a fold; it begins next to its optimum
_ENOUGH = 1e-9  # of a fold's loss: what another step would gain


@dataclass(frozen=True)
class Incidence:
    """A block of samples that were left out together: its mean theta_i [rad], fold, samples and error.

    The error is NaN where no sample of the block has weight.
    """

    theta: float
    fold: int
    samples: int
    error: float


@dataclass(frozen=True)
class HeldOut:
    """Errors at samples that were left out, root mean squares in the unit of the loss's residual, by fold and by block.

    NaN stands for a fold or block in which no sample has weight.
    `fitted` is the same error of the fit to all samples, at the samples it was fitted to.
    """

    error: float
    fitted: float
    folds: tuple[float, ...]
    incidences: tuple[Incidence, ...]
    loss: str
    seconds: float  # without the fit to all samples
    robust: str | None = None  # the form that counts the residuals, and the residual beyond which they count less
    robust_scale: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """The errors as JSON-able data, null where there is no number."""
        blocks = [{**vars(one), "error": number(one.error)} for one in self.incidences]
        whole = {"error": number(self.error), "fitted": number(self.fitted)}
        return {**vars(self), **whole, "folds": [number(one) for one in self.folds], "incidences": blocks}

    def __str__(self) -> str:
        """The errors as plain text, a line for each incidence that was left out, the steepest last."""
        lines = [
            f"held out: error {self.error:.5g}, and {self.fitted:.5g} where fitted: root mean squares of the "
            f"{self.loss} loss's residual{self._counted()}, {len(self.folds)} folds in {self.seconds:.2f} s",
            f"{'incidence [deg]':<20}{'fold':>8}{'samples':>10}{'error':>12}",
        ]
        blocks = sorted(self.incidences, key=lambda one: (one.theta, one.fold))
        lines += [f"{math.degrees(b.theta):<20.4g}{b.fold:>8}{b.samples:>10}{b.error:>12.5g}" for b in blocks]
        return "\n".join(lines)

    def _counted(self) -> str:
        return "" if self.robust is None else f", as {self.robust} counts those beyond {self.robust_scale:.4g}"


def held_out(
    samples: Samples,
    model: str,
    loss: str = "cosine",
    folds: int = 5,
    seed: int = 0,
    progress: Callable[[Progress], None] | None = None,
    **keywords: Any,
) -> HeldOut:
    """The model's error under the loss at incidences that were left out; the keywords are those of `fit`.

    folds    how many parts of the data are left out in turn, at least 2; what a part is: folds.py
    seed     of the scan of the fit to all samples, and of what goes into which part

    Raises what `fit` raises, and ParameterError where there are not enough samples.
    """
    keywords = plainly({**keywords, "loss": loss, "seed": seed})
    plan, (kept,) = planned([samples], model, **keywords)
    parts, seed, say = checked_folds(folds, len(kept)), keywords["seed"], Teller(progress)
    found = search(plan, [kept], loss, keywords.get("optimizer", "auto"), seed, say)
    problem, x = found.problem, found.outcome.x
    if plan.conserve_energy:
        x = _conserving(problem, kept, model, keywords)
    begun = time.perf_counter()
    block, fold = split(kept, parts, seed)
    if plan.conserve_energy:
        rows = [_conserving(problem, kept.subset(fold != k), model, keywords) for k in range(int(fold.max()) + 1)]
        squares, weights = _squares(problem, torch.cat(rows), fold), _weights(problem)
    else:
        squares, weights = left_out(problem, x, fold)
    own = _squares(problem, x, torch.zeros_like(fold))
    say("done", 1.0, float(found.outcome.loss[0]))
    theta = _mean(angles(kept.wi)[0], torch.ones_like(weights), block)
    sizes = block.bincount().tolist()
    error = _mean(squares, weights, block).sqrt().tolist()
    at = dict(zip(block.tolist(), fold.tolist(), strict=True))
    return HeldOut(
        float((squares.sum() / weights.sum()).sqrt()),
        float((own.sum() / weights.sum()).sqrt()),
        tuple(_mean(squares, weights, fold).sqrt().tolist()),
        tuple(Incidence(t, at[i], sizes[i], error[i]) for i, t in enumerate(theta.tolist())),
        loss,
        time.perf_counter() - begun,
        problem.plan.robust,
        None if problem.robust_scale is None else float(problem.robust_scale[0]),
    )


def _conserving(problem: Problem, samples: Samples, model: str, keywords: Mapping[str, Any]) -> Tensor:
    """The raw values (1, D) of the fit to these samples that conserves energy, under the problem's own robust scale."""
    scale = problem.robust_scale
    own = {**keywords, "robust_scale": None if scale is None else float(scale[0])}
    return problem.pack(fit(samples, model, **own).values).unsqueeze(0)


def checked_folds(folds: object, count: int) -> int:
    """The number of folds; raises where this is none, or there are fewer samples than folds."""
    if (number := whole(folds)) is None or number < 2:
        raise ParameterError(f"Expected folds to be a whole number from 2 on, got {folds!r}. Use 5.", field="folds")
    if count < number:
        raise ParameterError(
            f"Expected folds to be at most the number of samples, got {number} for {count}. Lower it.", field="folds"
        )
    return number


def left_out(problem: Problem, x: Tensor, fold: Tensor) -> tuple[Tensor, Tensor]:
    """The weighed squares (N,) of each sample's residuals in the fit that did not see its fold, and their weights.

    x (1, D) is the optimum of the problem's only material, fold (N,) each sample's fold, from 0 on.
    """
    data, folds = problem.data, int(fold.max()) + 1
    seen = (fold != torch.arange(folds).unsqueeze(1)).to(data.y).unsqueeze(1)  # (K, 1, N)
    which = torch.arange(folds)
    parts = Data(
        data.g,
        data.c,
        data.y.expand(folds, -1, -1),
        data.root_weight * seen,
        data.root_factor,
        None if data.sigma is None else data.sigma.expand(folds, -1, -1),
        data.scales.rows(torch.zeros_like(which)),
    )
    scale = None if problem.robust_scale is None else problem.robust_scale.expand(folds)
    trained = Problem(problem.plan, [], problem.loss_kind, robust_scale=scale, data=parts)
    rows = x.expand(folds, -1)
    if problem.size:
        rows = least_squares(trained, rows.clone(), which, _ENOUGH, _STEPS).x
    return _squares(problem, rows, fold), _weights(problem)


def _weights(problem: Problem) -> Tensor:
    """The weights (N,) of each sample's residuals, over the channels."""
    return problem.data.root_weight.square().expand_as(problem.data.y).sum((0, 1))


def typical(squares: Tensor, weights: Tensor, block: Tensor, least: float) -> float:
    """The geometric mean over the samples of their blocks' errors, each at least `least`, in the residual's unit.

    Samples of weight 0 do not count. It falls where the errors of most samples' blocks do. The root mean square is that
    of one block where none of the others is like it, as the steepest incidence of a paint, which models then miss by as
    much as chance has it.
    """
    errors = _mean(squares, weights, block).sqrt().clamp(min=least)
    counts = block.bincount((weights > 0).to(weights))
    return float((counts / counts.sum() * errors.log())[counts > 0].sum().exp())


def _squares(problem: Problem, x: Tensor, row: Tensor) -> Tensor:
    """The weighed squares (N,) of the residuals at each sample of the x (K, D) that `row` (N,) names."""
    found, at = [], 0
    for piece in problem.data.chunks(len(x)):
        here = row[at : at + len(piece.c)]
        f = problem.f(x, piece)[here, :, torch.arange(len(here))].T.unsqueeze(0)  # (1, C, n)
        found.append(problem.residuals(f, piece, None)[0].sum((0, 1)))
        at += len(here)
    return torch.cat(found)


def _mean(values: Tensor, weights: Tensor, label: Tensor) -> Tensor:
    """The sums of the values over those of the weights, a label (L,); NaN for a label without weight."""
    sums = torch.zeros(2, int(label.max()) + 1, dtype=torch.float64)
    sums.index_add_(1, label, torch.stack([values, weights]))
    return sums[0] / sums[1]
