"""What optima are worth: values with intervals, errors under every loss, and sentences, for all materials at once."""

import math
from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from .. import __version__
from ..formats.samples import Samples
from .data import is_weighed, stacked_weights
from .identifiability import name_of, named
from .levenberg_marquardt import Outcome
from .losses import root_mean
from .plan import GRADIENT
from .problem import Problem
from .result import Cost, Fit
from .support import supports, too_bright, warnings
from .uncertainty import Uncertainty, uncertainty


def fits(
    problem: Problem,
    outcome: Outcome,
    fitted: Sequence[Samples],
    given: Sequence[Samples],
    seed: int,
    cost: Callable[[], Cost],
) -> list[Fit]:
    """What each material's optimum is worth; `given` are the samples before any were left out.

    The cost of each is asked for when all but their writing down is done.
    """
    plan, x, channels = problem.plan, outcome.x, fitted[0].channels
    weighed = is_weighed(fitted[0], problem.loss_kind)
    known = uncertainty(problem, x, outcome.gram)
    values = {key: value.squeeze(1).expand(len(x), -1) for key, value in _rows(problem, x).items()}
    described = _described(problem, values, known)
    chi_square: list[float] | None = None
    if problem.data.sigma is not None:
        f = torch.cat([problem.f(x, piece) for piece in problem.data.chunks(len(x))], dim=-1)  # (M, C, N)
        squares = ((f - problem.data.y) / problem.data.sigma).square()
        chi_square = torch.where(problem.data.root_weight > 0, squares, 0.0).sum((1, 2)).tolist()
    minima = outcome.loss
    if problem.loss_kind.is_mean and not (weighed or plan.robust):
        minima = root_mean(minima, stacked_weights(fitted, problem.loss_kind), problem.channels)
    scales = None if plan.robust is None or problem.robust_scale is None else problem.robust_scale.tolist()
    freedom, objectives, ends = known.freedom.tolist(), minima.tolist(), outcome.converged.tolist()
    typical = torch.as_tensor(problem.data.scales.y, dtype=torch.float64).reshape(-1)
    told = warnings(plan, supports(fitted[0]), problem.data.y, typical, problem.loss_kind.name)
    bright = too_bright(problem, x)
    names = [name_of(problem, at, channels) for at in range(problem.size)]
    covariances = _certain(known.covariance, names)
    of_row = {key: value.reshape(len(x), *plan.start[key].shape).unbind() for key, value in values.items()}
    held, by_chance, vague = (flags.tolist() for flags in (known.held, known.by_chance, known.vague))
    found, spent = [], cost()
    for row, (samples, whole) in enumerate(zip(fitted, given, strict=True)):
        parameters, standard_errors, intervals = described[row]
        undetermined, combinations = named(problem, known.unseen[row], known.chain[row], channels)
        found.append(
            Fit(
                plan=plan,
                form=plan.form,
                values={key: each[row] for key, each in of_row.items()},
                samples=samples,
                parameters=parameters,
                standard_errors=standard_errors,
                intervals=intervals,
                undetermined=undetermined,
                combinations=combinations,
                singular_values=known.singular_values[row],
                covariance=covariances[row][0],
                covariance_keys=covariances[row][1],
                loss=problem.loss_kind.name,
                objective=objectives[row],
                weighed=weighed,
                robust_scale=None if scales is None else scales[row],
                status=("undetermined" if undetermined else "converged") if ends[row] else "stopped_early",
                message=_message(
                    problem,
                    held[row],
                    by_chance[row],
                    vague[row],
                    undetermined,
                    freedom[row],
                    converged=ends[row],
                    weighed=weighed,
                    by_gradient=spent.optimizer in GRADIENT,
                ),
                warnings=(*told[row], *bright[row]),
                choices=plan.choices,
                fixed=tuple(sorted(plan.fixed)),
                gray=tuple(sorted(plan.gray)),
                per_channel=tuple(sorted(plan.per_channel)),
                chi_square=None if chi_square is None else (chi_square[row], freedom[row]),
                cost=spent,
                channels=samples.channels,
                provenance={"version": __version__, "torch": torch.__version__, "seed": seed, "input": whole.hash},
            )
        )
    return found


def _certain(covariance: Tensor, names: Sequence[str]) -> list[tuple[Tensor, tuple[str, ...]]]:
    """Of each covariance (M, D, D) what has a standard error, (K, K), and its names."""
    found: list[tuple[Tensor, tuple[str, ...]]] = []
    all_names = tuple(names)
    rows = zip(covariance.unbind(), covariance.diagonal(dim1=-2, dim2=-1).isfinite().tolist(), strict=True)
    for whole, certain in rows:
        if all(certain):
            found.append((whole.clone(), all_names))
        else:
            kept = [at for at, one in enumerate(certain) if one]
            found.append((whole[kept][:, kept], tuple(names[at] for at in kept)))
    return found


def _rows(problem: Problem, x: Tensor) -> dict[str, Tensor]:
    """All natural values by key in the order of the text, (M, 1, n)."""
    natural = problem.natural(x)
    return {key: natural[key].reshape(-1, 1, natural[key].shape[-1] if natural[key].ndim else 1) for key in natural}


Described = tuple[dict[str, Tensor], dict[str, Tensor], dict[str, Tensor]]


def _described(problem: Problem, values: dict[str, Tensor], known: Uncertainty) -> list[Described]:
    """Values, standard errors and intervals by key, tied parameters included, by material."""
    form, start = problem.plan.form, problem.plan.start
    materials = len(known.freedom)
    found: list[Described] = [({}, {}, {}) for _ in range(materials)]
    for key in form.all_parameters:
        tie = form.ties.get(key)
        owner = key if tie is None else tie.owner
        value = form.resolve(key, values)  # (M, n)
        one = start[owner].ndim == 0 and (tie is None or tie.total is None or len(tie.total) == 1)
        error = torch.full_like(value, math.nan)
        low, high, blind = error, error, torch.zeros_like(error, dtype=torch.bool)
        if owner in problem.slices:
            at = problem.slices[owner]
            error, low, high, blind = (
                t[:, at].expand_as(value) for t in (known.standard_error, known.low, known.high, known.undetermined)
            )
            if tie is not None and tie.total is not None:
                total = value + values[owner]
                low, high = total - high, total - low
            value = torch.where(blind, math.nan, value)
        columns = (value, error, torch.stack([low, high], dim=-1))
        each = zip(*(c[:, 0] if one else c for c in columns), strict=True)
        for row, (value_, error_, interval) in enumerate(each):
            parameters, standard_errors, intervals = found[row]
            parameters[key], standard_errors[key], intervals[key] = value_, error_, interval
    return found


def _message(
    problem: Problem,
    held: list[bool],
    by_chance: list[bool],
    vague: list[bool],
    undetermined: Sequence[str],
    freedom: int,
    *,
    converged: bool,
    weighed: bool,
    by_gradient: bool,
) -> str:
    """What the user must know of a result, in sentences; `held`, `by_chance` and `vague` are by raw position."""
    if not problem.size:
        parts = ["Every value is fixed, so this is an evaluation."]
    elif converged:
        parts = ["The optimum was reached; no step gains more than rounding."]
    else:
        advice = "use least_squares" if by_gradient else "give starts near it"
        parts = [f"The optimizer stopped before the optimum; treat values and intervals with care, or {advice}."]
    on_end = [key for key, at in problem.slices.items() if any(held[at])]
    if on_end:
        where = _of_channels(problem, on_end)
        parts.append(f"{', '.join(on_end)} ended on an end of the box{where}, so no interval is given there.")
    near_end = [key for key, at in problem.slices.items() if any(by_chance[at])]
    if near_end:
        where = _of_channels(problem, near_end)
        parts.append(
            f"{', '.join(near_end)} ended on an end of the box{where}, where noise alone may have put it, so the "
            "interval reaches inwards from there."
        )
    together = [words for words in undetermined if " with " in words]
    alone = [words for words in undetermined if words not in together]
    if alone:
        parts.append(f"The data do not determine {', '.join(alone)}; no number is given for what they leave free.")
    if together:
        parts.append(
            f"The data do not determine {', nor '.join(together)} one by one, only together; no number is given for "
            "any of them. Fix one of them, or measure where their effects differ."
        )
    few = [key for key, at in problem.slices.items() if any(vague[at])]
    if few:
        parts.append(
            f"Few samples decide {', '.join(few)}, so an interval there is as long as the range that is searched."
        )
    if problem.data.sigma is None and freedom <= 0:
        parts.append("There are no more samples than values, so no interval can be given.")
    if weighed and problem.plan.robust is None:
        parts.append("Samples were weighted by 1/sigma^2, so the minimised loss is chi-square.")
    elif weighed:
        parts.append(
            f"Residuals were counted in sigma and made {problem.plan.robust}, so the minimised loss is not chi-square."
        )
    return " ".join(parts)


def _of_channels(problem: Problem, keys: Sequence[str]) -> str:
    """What a sentence on values adds where some of them are one a channel."""
    several = any(problem.slices[key].stop - problem.slices[key].start > 1 for key in keys)
    return " in some channel" if several else ""
