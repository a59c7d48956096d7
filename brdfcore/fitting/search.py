"""From samples to optima: scan, race of the starts on a subset, then the winner on all the data.

Where residuals are linear in f, starts run over the shapes alone by variable projection; where they are not, those
solutions of the cosine loss join the starts of Levenberg-Marquardt on all values. The winner ends with that too,
whatever came before: it keeps every end of the box, and computes residuals one by one, so that none cancel.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from ..formats.samples import Samples
from .adam import adam
from .lbfgs import lbfgs
from .least_squares import least_squares
from .levenberg_marquardt import DECREMENT, OnStep, Outcome
from .losses import LOSSES
from .plan import Plan
from .problem import Problem
from .projection import Projection
from .result import Cost
from .robust import ROBUST, SPREAD, Robust
from .starts import rescan, scan, several_lobes
from .variable_projection import variable_projection

SUBSET = 2000  # samples on which starts are told apart; the optimum is always polished on all
_STARTS = 4  # best points of the scan, which run as one batch; of one shape half of them
_MANY_STARTS = 16  # the same of two lobes and more, whose optima are many
_AGAIN = 2  # starts of each of several lobes, whose shapes are searched again beside the best of the others
_DESCENTS = 2  # starts of Adam and LBFGS
_POLISH = 300  # their steps on all the data, after the subset
_NONLINEAR = 6  # starts of a lone lobe under a loss that is not linear in f, whose steps move every reflectance
_HOPELESS = 2.0  # times the best point's loss, from where a lone lobe's other points lead nowhere else
_RACE_ALL = 1e-6  # of the loss, the same as the next where reflectances move too
_TURNS = 20  # of spread and fit under a robust form; plain data take two, a fifth of gross outliers up to 14
_STANDS = 0.01  # of the scale: what another turn would change, a hundredth of what the forms' efficiency is worth
_RACE = 1e-4  # of the loss: what another step would gain once a start's end is clear

Say = Callable[[str, float, float], None]


@dataclass(frozen=True)
class Found:
    """Where M materials ended, and what it took."""

    problem: Problem  # on all the data
    outcome: Outcome  # a row a material
    starts: int
    evaluations: int
    iterations: int
    optimizer: str

    def of_material(self, row: int) -> "Found":
        """Where one of the materials ended, as if it had been searched alone."""
        whole, which = self.problem, torch.tensor([row])
        scale = None if whole.robust_scale is None else whole.robust_scale[which]
        alone = Problem(whole.plan, [], whole.loss_kind, robust_scale=scale, data=whole.data.rows(which))
        return replace(self, problem=alone, outcome=self.outcome.pick(which))

    def cost(self, begun: float, materials: int) -> Cost:
        """What each of so many materials cost since then, by the clock; uncertainty evaluates once more."""
        seconds = (time.perf_counter() - begun) / materials
        return Cost(seconds, self.evaluations // materials + 1, self.iterations, self.starts, self.optimizer)


def search(plan: Plan, samples: Sequence[Samples], loss: str, optimizer: str, seed: int, say: Say) -> Found:
    """The best optimum that the scan's starts lead to, for each of the materials that share their directions."""
    say("scan", 0.0, torch.nan)
    if plan.robust is None or plan.robust_scale is not None:
        given = (
            None if plan.robust_scale is None else torch.full((len(samples),), plan.robust_scale, dtype=torch.float64)
        )
        return _found(plan, samples, loss, optimizer, seed, say, given)
    near = near_scale(plan, samples, loss, optimizer, seed, _part(say, 0.0, 0.4))
    found = _found(plan, samples, loss, optimizer, seed, _part(say, 0.4, 0.9), near.problem.robust_scale)
    before = found.problem.loss(near.outcome.x, torch.arange(len(samples)))
    lower = before < (1 - _RACE_ALL) * found.outcome.loss
    if bool(lower.any()):
        x = torch.where(lower.unsqueeze(-1), near.outcome.x, found.outcome.x)
        found = replace(found, outcome=found.outcome._replace(x=x))
    return joined(near, _settled(plan, ROBUST[plan.robust], found))


def near_scale(plan: Plan, samples: Sequence[Samples], loss: str, optimizer: str, seed: int, say: Say) -> Found:
    """A robust optimum of a subset, at the scale that its own residuals make: a first one, of few samples."""
    few = _subset(samples, seed)
    plain = _found(replace(plan, robust=None, robust_scale=None), few, loss, optimizer, seed, say, None)
    return _settled(plan, ROBUST[plan.robust or ""], plain)


def _settled(plan: Plan, form: Robust, found: Found) -> Found:
    """The robust optimum next to what was found, at the scale that its own residuals make.

    Outliers draw an optimum to themselves, which inflates the spread about it: fit and spread take turns.
    """
    scale = form.multiple * _spread(found)
    for _ in range(_TURNS):
        found = _polished(plan, found, scale, _RACE)
        last, scale = scale, form.multiple * _spread(found)
        if bool(((scale - last).abs() < _STANDS * last).all()):
            break
    return _polished(plan, found, scale)


def _polished(plan: Plan, found: Found, scale: Tensor, tolerance: float = DECREMENT) -> Found:
    """The robust optimum at this scale (M,) that what was found leads to."""
    x, which = found.outcome.x, torch.arange(len(scale))
    problem = Problem(plan, [], found.problem.loss_kind, robust_scale=scale, data=found.problem.data)
    outcome = Outcome(x, problem.loss(x, which), torch.ones(len(x), dtype=torch.bool), 0)
    if problem.size:
        outcome = least_squares(problem, x, which, tolerance)
    return joined(
        found,
        replace(
            found, problem=problem, outcome=outcome, evaluations=problem.evaluations, iterations=outcome.iterations
        ),
    )


def joined(before: Found, after: Found) -> Found:
    """What came after, its cost with that of what came before."""
    return replace(
        after, evaluations=before.evaluations + after.evaluations, iterations=before.iterations + after.iterations
    )


def _spread(found: Found) -> Tensor:
    """The spread of each material's plain residuals where it ended, (M,); above 0 where the fit is exact.

    It is the residuals' before their weights, each counted as often as its weight says.
    """
    problem, which = found.problem, torch.arange(len(found.outcome.x))
    plain = Problem(replace(problem.plan, robust=None), [], problem.loss_kind, data=problem.data)
    data = problem.data.rows(which)
    r = plain.residuals(problem.f(found.outcome.x, data), data, which)[1]
    size = (r / data.counted).abs().flatten(1)
    weight = data.root_factor.square().masked_fill(data.root_weight[:, :1] <= 0, 0).expand_as(r).flatten(1)
    size, order = size.sort(1)
    before = weight.gather(1, order).cumsum(1)
    middle = (before < before[:, -1:] / 2).sum(1, keepdim=True).clamp(max=size.shape[1] - 1)
    least = 1e-12 * (problem.squares / before[:, -1].clamp(min=1e-300)).sqrt()
    return torch.maximum(SPREAD * size.gather(1, middle)[:, 0], least.clamp(min=1e-300))


def _found(
    plan: Plan, samples: Sequence[Samples], loss: str, optimizer: str, seed: int, say: Say, robust_scale: Tensor | None
) -> Found:
    """The search under one loss whose scale is known."""
    kind = LOSSES[loss]
    whole = Problem(plan, samples, kind, robust_scale=robust_scale)
    coarse, few = whole, list(samples)
    if len(samples[0]) > SUBSET:
        few = _subset(samples, seed)
        coarse = Problem(plan, few, kind, whole.data.scales, robust_scale)
    if not whole.size:
        x, which = torch.zeros(len(samples), 0, dtype=torch.float64), torch.arange(len(samples))
        outcome = Outcome(x, whole.loss(x, which), torch.ones(len(x), dtype=torch.bool), 0)
        return Found(whole, outcome, 1, whole.evaluations, 0, "none")
    if optimizer in ("auto", "least_squares"):
        return _race(whole, coarse, few, optimizer, seed, say)
    return _descents(whole, coarse, few, optimizer, seed, say)


def _subset(samples: Sequence[Samples], seed: int) -> list[Samples]:
    """Those of the samples on which starts are told apart, the same of every material; all where they are few.

    What has no weight in any material is not among them.
    """
    if len(samples[0]) <= SUBSET:
        return list(samples)
    order = torch.randperm(len(samples[0]), generator=torch.Generator().manual_seed(seed))
    weights = [one.weight for one in samples]
    if all(weight is not None for weight in weights):
        heavy = torch.stack([weight > 0 for weight in weights if weight is not None]).any(0)
        order = order[heavy[order]]
    chosen = order[:SUBSET].sort().values
    return [one.subset(chosen) for one in samples]


def _kindred(problem: Problem, samples: Sequence[Samples]) -> Projection:
    """The projection of a problem, or where its residuals are not linear, of the cosine loss on its samples."""
    if problem.linear:
        return Projection(problem)
    return Projection(Problem(replace(problem.plan, robust=None), samples, LOSSES["cosine"], problem.data.scales))


def _race(whole: Problem, coarse: Problem, few: Sequence[Samples], optimizer: str, seed: int, say: Say) -> Found:
    """Batched starts on the subset, then the best on all the data."""
    materials = whole.materials
    projection = _kindred(coarse, few)
    linear = projection.problem is coarse
    few_starts = _STARTS if len(projection.shapes) > 1 else _STARTS // 2
    count = _MANY_STARTS if several_lobes(projection) else few_starts
    starts, shares = scan(coarse, projection, count, seed)
    each = starts.shape[1]
    which = torch.arange(materials).repeat_interleave(each)
    x = starts.reshape(-1, whole.size)
    tell = _tell(say, 0.05, 0.5)
    projected = optimizer == "auto" and projection.useful and bool(projection.shapes)
    if projected and linear:
        if not several_lobes(projection):
            hopeful = shares.reshape(-1) <= _HOPELESS
            x, which = x[hopeful], which[hopeful]
        lone = torch.bincount(which, minlength=materials)[which] == 1  # without a rival: runs to its end at once
        ends = torch.where(lone, DECREMENT, _RACE) if whole is coarse else _RACE
        best, iterations = _raced(projection, x, which, tell, ends)
        if several_lobes(projection):
            again = torch.cat([best.x.unsqueeze(1), rescan(projection, best.x, _AGAIN, seed)], dim=1)
            which = torch.arange(materials).repeat_interleave(again.shape[1])
            best, more = _raced(projection, again.reshape(-1, whole.size), which, tell)
            iterations += more
            each += again.shape[1] - 1
    else:
        iterations = 0
        if projected:
            raced = variable_projection(projection, x, which, _RACE, on_step=tell)
            iterations += raced.iterations
            x = torch.cat([starts, raced.x.reshape(starts.shape)], dim=1).reshape(-1, whole.size)
            kept = _MANY_STARTS if several_lobes(projection) else _NONLINEAR
            x, which = _lowest(coarse, x, min(kept, 2 * each))
        outcome = least_squares(coarse, x, which, _RACE_ALL, on_step=tell)
        iterations += outcome.iterations
        best = outcome.pick(_best(outcome.loss, which, materials))
    name = "variable_projection" if projected and linear else "least_squares"
    rows = torch.arange(materials)
    tell = _tell(say, 0.5, 0.9)
    x = best.x
    if projected and linear:
        if whole is coarse and not projection.may_leave_the_box:
            best = variable_projection(projection, x, rows, on_step=tell, known=best.gram)
        else:
            best = variable_projection(Projection(whole), x, rows, on_step=tell)
        iterations += best.iterations
        x = best.x
    best = least_squares(whole, x, rows, on_step=tell)
    iterations += best.iterations
    seen = {id(p): p.evaluations for p in (whole, coarse, projection.problem)}
    return Found(whole, best, each, sum(seen.values()), iterations, name)


def _raced(
    projection: Projection, x: Tensor, which: Tensor, tell: OnStep, tolerance: float | Tensor = _RACE
) -> tuple[Outcome, int]:
    """Where the best of each material's starts x (S, D) ends, and the iterations that took."""
    outcome = raced = variable_projection(projection, x, which, tolerance, on_step=tell)
    if projection.may_leave_the_box:
        outcome = least_squares(projection.problem, raced.x, which, on_step=tell)
    return outcome.pick(_best(outcome.loss, which, projection.problem.materials)), raced.iterations


def _lowest(problem: Problem, x: Tensor, count: int) -> tuple[Tensor, Tensor]:
    """The rows x (M R, D) whose own loss is lowest, so many a material, and the material of each."""
    which = torch.arange(problem.materials).repeat_interleave(len(x) // problem.materials)
    loss = problem.loss(x, which)
    order = torch.where(loss.isfinite(), loss, torch.inf).reshape(problem.materials, -1).argsort(dim=1)[:, :count]
    chosen = order + order.new_tensor(range(problem.materials)).unsqueeze(-1) * (len(x) // problem.materials)
    return x[chosen.reshape(-1)], torch.arange(problem.materials).repeat_interleave(count)


def _best(loss: Tensor, which: Tensor, materials: int) -> Tensor:
    """The row of each material, named by `which` (S,), whose loss (S,) is lowest, (M,)."""
    own = which == torch.arange(materials).unsqueeze(-1)
    loss = loss.nan_to_num(nan=torch.inf).clamp(max=torch.finfo(loss.dtype).max)  # its own, even where none is finite
    return torch.where(own, loss, torch.inf).argmin(1)


def _descents(whole: Problem, coarse: Problem, few: Sequence[Samples], optimizer: str, seed: int, say: Say) -> Found:
    """Adam or LBFGS from a few starts, then from the best on all the data."""
    run = {"adam": adam, "lbfgs": lbfgs}[optimizer]
    starts, _ = scan(coarse, _kindred(coarse, few), _DESCENTS, seed)
    materials, each = starts.shape[:2]
    which = torch.arange(materials).repeat_interleave(each)
    found = run(coarse, starts.reshape(-1, whole.size), which, on_step=_tell(say, 0.05, 0.7))
    steps = found.iterations
    best = found.pick(_best(found.loss, which, materials))
    if coarse is not whole:
        best = run(whole, best.x, torch.arange(materials), max_iterations=_POLISH, on_step=_tell(say, 0.7, 0.9))
        steps += best.iterations
    evaluations = whole.evaluations + (coarse.evaluations if coarse is not whole else 0)
    return Found(whole, best._replace(iterations=steps), each, evaluations, steps, optimizer)


def _part(say: Say, begin: float, end: float) -> Say:
    return lambda stage, fraction, loss: say(stage, begin + (end - begin) * fraction, loss)


def _tell(say: Say, begin: float, end: float) -> OnStep:
    return lambda i, value: say("fit", begin + (end - begin) * (1 - 0.95**i), value)
