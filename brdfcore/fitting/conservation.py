"""Fits under the condition that no direction sees more than all of the light: every albedo is at most 1.

    minimise loss(x)   where   a_c(theta, phi; x) <= 1   for every direction and every channel c

The directions are infinitely many, and few of them matter. From the free optimum, the certificate finds where the
albedo is largest; sequential quadratic programming holds it at 1 there, in all channels; the certificate looks again,
until it finds nothing above 1 (an exchange method: Hettich and Kortanek 1993, "Semi-infinite programming"). Each step
solves the Gauss-Newton model of the loss under the albedos' linear ones, which are exact in the reflectances:

    minimise g.d + d.(M + lambda diag M) d / 2   where   a + A d <= 1,   low <= x + d <= high

by its dual, and is kept if loss + weight times excess falls. A shape for which the albedo has no limit towards grazing
is fixed first where it has one (the power `alpha` of Kurt's lobe at 0); where no shape has one (Ward's), the
reflectance is 0. Intervals are those along the limits that hold. The optimum is the one that the free fit's leads to:
others may exist.
"""

import math
import time
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import torch
from torch import Tensor

from ..energy.albedo import of_form
from ..energy.certificate import Certificate, certify
from ..formats.samples import Samples
from ..models.form import Form, Term
from ..models.material import Material
from .levenberg_marquardt import Outcome
from .plan import Plan
from .problem import Problem
from .result import Conservation, Fit
from .search import Found, Say, joined, search
from .solve import solve_box
from .worth import fits

MARGIN = 2e-7  # below 1 where albedos are held: their claimed errors, and what lies between the directions
TOLERANCE = 1e-8  # of the albedos
LOWEST = 1e-12  # cosine that stands for the limit towards grazing
CLOSE = 0.9  # albedos below this are not about to reach 1 in a step
ROUNDS, STEPS = 20, 100
STIFF = 1e4  # times as curved as the loss is along a limit's normal, so that no interval reaches across
GAIN = 1e-10  # of the loss: a step that promises less ends the search
HARDEST = 1e12  # damping beyond which a step no longer changes x


def conserving(free: Fit, found: Found, kept: Samples, whole: Samples, optimizer: str, say: Say) -> Fit:
    """The fit near the free one in which no albedo exceeds 1, with what that took; `whole` is before any were left out.

    A fit that cannot get there, since values are fixed, is the nearest one found, and its status says so.
    """
    begun = time.perf_counter()
    seed, loss = int(free.provenance["seed"]), free.loss
    fixed: tuple[str, ...] = ()
    certificate, directions = free.certificate, torch.zeros(0, 2, dtype=torch.float64)
    while math.isinf(certificate.max_albedo) and (plan := _limited(found)) is not None:
        fixed = (*fixed, *(plan.fixed - found.problem.plan.fixed))
        found = joined(found, search(_at_scale(found, plan), [kept], loss, optimizer, seed, say))
        certificate = _certificate(found)
    for done in range(ROUNDS):
        hopeless = len(directions) > 0 and not bool(found.outcome.converged[0])
        if certificate.max_albedo <= 1 or math.isinf(certificate.max_albedo) or hopeless:
            break
        say("conserve energy", 0.95 + 0.04 * done / ROUNDS, float(found.outcome.loss[0]))
        worst = [math.cos(min(certificate.at_theta, math.pi / 2 - LOWEST)), certificate.at_phi]
        directions = torch.cat([directions, directions.new_tensor([worst])])
        found = _held(found, directions)
        certificate = _certificate(found)
    made = free
    if fixed or len(directions):
        (made,) = fits(found.problem, found.outcome, [kept], [whole], seed, partial(found.cost, begun, 1))
    conservation = Conservation(
        free_objective=free.objective,
        free_max_albedo=free.certificate.max_albedo,
        fixed=fixed,
        directions=len(directions),
        seconds=time.perf_counter() - begun,
    )
    reached = certificate.energy_conserving
    return replace(
        made,
        conservation=conservation,
        message=f"{made.message} {_sentence(conservation, made, reached=reached)}",
        status=made.status if reached else "stopped_early",
    )


def _sentence(it: Conservation, made: Fit, *, reached: bool) -> str:
    """What conserving energy cost, in words."""
    if not it.fixed and not it.directions and reached:
        return "Energy is conserved without being asked for, so that cost nothing."
    at = "has no limit" if math.isinf(it.free_max_albedo) else f"is {it.free_max_albedo:.4g}"
    more = f" (+{100 * (made.objective / it.free_objective - 1):.3g} %)" if it.free_objective > 0 else ""
    parts = [
        f"Conserving energy made the error {made.objective:.4g} instead of {it.free_objective:.4g}{more}; "
        f"the largest albedo of the free optimum {at}."
    ]
    if it.fixed:
        parts.append(f"It fixed {', '.join(it.fixed)}, without which the albedo has no limit towards grazing.")
    if not reached:
        parts.append("The largest albedo still exceeds 1: free what is fixed, or choose a lobe of bounded albedo.")
    return " ".join(parts)


def _certificate(found: Found) -> Certificate:
    problem = found.problem
    return certify(Material(problem.plan.form, problem.unpack(found.outcome.x[0])), tolerance=MARGIN)


def _limited(found: Found) -> Plan | None:
    """The plan with one more value fixed, where a term's albedo has a limit; None where no free value gives it one."""
    problem = found.problem
    plan, values = problem.plan, problem.unpack(found.outcome.x[0])
    for term in plan.form.terms:
        own = plan.form.of_term(term, values)
        if not _grows(term, own):
            continue
        keys = {name: term.tied[name].owner if name in term.tied else f"{term.label}.{name}" for name in own}
        shapes = [name for name in own if name != term.model.scale and keys[name] in plan.free]
        for name in shapes:
            for end in plan.limits(keys[name]):
                if not _grows(term, {**own, name: end}):
                    return _with_fixed(plan, keys[name], end)
        scale = term.model.scale
        if scale in own and keys[scale] in plan.free and bool((plan.limits(keys[scale])[0] <= 0).all()):
            return _with_fixed(plan, keys[scale], torch.zeros(()))
    return None


def _at_scale(found: Found, plan: Plan) -> Plan:
    """The plan at the robust scale that what was found has: only then do the objectives compare."""
    scale = found.problem.robust_scale
    return plan if scale is None else replace(plan, robust_scale=float(scale[0]))


def _with_fixed(plan: Plan, key: str, value: Tensor) -> Plan:
    start = {**plan.start, key: value.double().expand_as(plan.start[key]).clone()}
    return replace(plan, start=start, fixed=plan.fixed | {key}, starts=())


def _grows(term: Term, own: dict[str, Tensor]) -> bool:
    """Whether the albedo of a term by itself has no limit towards grazing."""
    alone = Form((Term(term.label, term.model),))
    material = Material(alone, {f"{term.label}.{name}": value for name, value in own.items()})
    return math.isinf(certify(material, tolerance=1e-2).max_albedo)


def _held(found: Found, directions: Tensor) -> Found:
    """The optimum from here under albedos of at most 1 at the directions (J, 2), cosine and azimuth, by one search."""
    problem = found.problem
    x, normals, steps, converged = _descent(problem, found.outcome.x[0], directions)
    gram = problem.gram(x.unsqueeze(0))
    gram = gram._replace(matrix=gram.matrix + _stiff(gram.matrix[0], normals))
    outcome = Outcome(x.unsqueeze(0), gram.loss, torch.tensor([converged]), steps, gram)
    return replace(
        found,
        outcome=outcome,
        evaluations=found.evaluations + steps,
        iterations=found.iterations + steps,
    )


def _stiff(matrix: Tensor, normals: Tensor) -> Tensor:
    """What makes moves along the normals (A, D) of active limits all but impossible: intervals know of the limits."""
    square = normals.square().sum(-1).clamp(min=1e-300)
    curvature = ((normals @ matrix) * normals).sum(-1) / square
    return (normals.T * (STIFF * curvature / square)) @ normals


def _descent(problem: Problem, x: Tensor, directions: Tensor) -> tuple[Tensor, Tensor, int, bool]:
    """The constrained optimum that x (D,) leads to, the slopes of active limits there, the steps, whether reached."""
    here = _model(problem, x, directions)
    damping, growth, price = 1e-3, 2.0, 0.0
    for steps in range(1, STEPS + 1):
        step, prices = _step(problem, x, here, damping)
        price = max(price, 2 * float(prices.max()))
        promised = here.fall(step) + price * (here.above() - here.above(step))
        if promised <= GAIN * here.loss and here.above() <= MARGIN:
            return x, here.slopes[prices > 0], steps, True
        trial = x + step
        there = _model(problem, trial, directions)
        gained = here.loss - there.loss + price * (here.above() - there.above())
        if gained > 0:
            ratio = min(gained / max(promised, 1e-300), 2.0)
            damping, growth = max(damping * max(1 / 3, 1 - (2 * ratio - 1) ** 3), 1e-15), 2.0
            x, here = trial, there
        else:
            damping, growth = damping * growth, 2 * growth
            if damping > HARDEST:
                return x, here.slopes[prices > 0], steps, here.above() <= MARGIN
    return x, here.slopes[prices > 0], STEPS, False


class _Model(NamedTuple):
    """The loss and the albedos about a point, to the order that a step needs."""

    loss: float
    gradient: Tensor  # (D,)
    matrix: Tensor  # (D, D), Gauss and Newton's
    excess: Tensor  # (K,) of the albedos over 1 - MARGIN
    slopes: Tensor  # (K, D)

    def fall(self, step: Tensor) -> float:
        """By how much the loss falls in a step."""
        return -float(step @ (self.gradient + 0.5 * self.matrix @ step))

    def above(self, step: Tensor | None = None) -> float:
        """What the albedos have above their limit, all together, after a step."""
        excess = self.excess if step is None else self.excess + self.slopes @ step
        return float(excess.clamp(min=0).sum())


def _model(problem: Problem, x: Tensor, directions: Tensor) -> _Model:
    gram = problem.gram(x.unsqueeze(0))
    with torch.enable_grad():
        leaf = x.clone().requires_grad_()
        cosine, azimuth = directions.unbind(1)
        albedo = of_form(problem.plan.form, problem.unpack(leaf), cosine, azimuth, TOLERANCE).values.reshape(-1)
        slopes = torch.zeros(len(albedo), len(x), dtype=torch.float64)
        for row in torch.nonzero(albedo > CLOSE).flatten().tolist():
            (slopes[row],) = torch.autograd.grad(albedo[row], leaf, retain_graph=True)
    return _Model(float(gram.loss), 2 * gram.gradient[0], 2 * gram.matrix[0], albedo.detach() - (1 - MARGIN), slopes)


def _step(problem: Problem, x: Tensor, here: _Model, damping: float) -> tuple[Tensor, Tensor]:
    """The step (D,) to the model's constrained minimum, and the price (K,) of each albedo's limit."""
    diagonal = here.matrix.diagonal()
    least = 1e-12 * diagonal.max().clamp(min=1e-300)
    curved = here.matrix + torch.diag(damping * diagonal + (1 + damping) * (diagonal <= least) * least)
    ends = torch.eye(len(x), dtype=torch.float64)
    rows = torch.cat([here.slopes, ends, -ends])
    room = torch.cat([-here.excess, problem.high - x, x - problem.low])
    bounded = room.isfinite()
    rows, room = rows[bounded], room[bounded]
    factor = torch.linalg.cholesky(curved)
    solved = torch.cholesky_solve(torch.cat([rows.T, here.gradient.unsqueeze(-1)], dim=1), factor)
    along, plain = solved[:, :-1], solved[:, -1]
    zero = torch.zeros_like(room)
    prices, _ = solve_box(rows @ along, -(room + rows @ plain), zero, zero + math.inf)
    step = -(plain + along @ prices)
    return torch.minimum(torch.maximum(step, problem.low - x), problem.high - x), prices[: len(here.excess)]
