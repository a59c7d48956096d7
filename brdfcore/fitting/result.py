"""A fit's result: values with intervals, errors under every loss, a status in words, and what it cost."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import torch
from torch import Tensor

from ..energy.certificate import Certificate, certify
from ..formats.samples import Samples
from ..models.form import Form
from ..models.material import Material
from .every_error import errors
from .plan import Plan
from .rung import Rung, table

STATUSES = ("converged", "undetermined", "stopped_early")
_MOST = 32  # values whose covariances JSON holds; those of more are in `Fit.covariance` alone
_STRONG = 0.95  # correlations that the report names
_NAMED = 6  # of them, the strongest


@dataclass(frozen=True)
class Cost:
    """What the fit cost."""

    seconds: float
    evaluations: int  # of the residuals of one start
    iterations: int
    starts: int
    optimizer: str


@dataclass(frozen=True)
class Conservation:
    """What it took to keep every albedo at 1 or below, and what that cost in error."""

    free_objective: float  # the loss of the free optimum, as `objective` has that of the result
    free_max_albedo: float  # its largest albedo [1]; may be infinite
    fixed: tuple[str, ...]  # keys fixed where the albedo has a limit towards grazing
    directions: int  # at which albedos are held at 1
    seconds: float


@dataclass(frozen=True, eq=False)
class Fit:
    """What `bc.fit` returns.

    plan, form, values, samples: what was asked, fitted, the best values, stored parameters only, and to what.
    parameters, standard_errors: key -> () or (C,); intervals: key -> (2,) or (C, 2), 95 %. NaN stands where there is no
    number to give: in an interval for a value that was fixed or that the data hold on an end of its box (ends.py), and
    everywhere for one that they leave undetermined. `objective` is what was minimised: chi-square where the samples'
    sigma weighed the loss, the sum of rho under a robust form, else the error of that name.

    status              "converged"; "undetermined", converged but with values that the data leave free; or
                        "stopped_early". `message` says more
    undetermined        what the data leave free: key, or key[channel], or "key with key" for values that only their
                        combination determines (identifiability.py says from where on)
    combinations        for each of those, how its values change together: name -> change, of length 1, natural units
    singular_values     of the Jacobian with its columns scaled to length 1, falling; all values but those on an end
    covariance          (K, K), natural units, of the values in `covariance_keys`: all that have a standard error
    warnings            what the data's directions and values cannot show of this model, a sentence each (support.py)
    """

    plan: Plan
    form: Form
    values: dict[str, Tensor]
    samples: Samples
    parameters: dict[str, Tensor]
    standard_errors: dict[str, Tensor]
    intervals: dict[str, Tensor]
    loss: str
    objective: float
    weighed: bool  # whether the samples' sigma weighed the loss
    robust_scale: float | None  # beyond which residuals count less, in their unit or in sigma, under a robust form
    status: str
    message: str
    undetermined: tuple[str, ...]
    combinations: tuple[dict[str, float], ...]
    singular_values: tuple[float, ...]
    covariance: Tensor
    covariance_keys: tuple[str, ...]
    warnings: tuple[str, ...]
    choices: tuple[str, ...]
    fixed: tuple[str, ...]
    gray: tuple[str, ...]
    per_channel: tuple[str, ...]
    chi_square: tuple[float, int] | None  # with its degrees of freedom, where the samples' sigma is known
    cost: Cost
    channels: tuple[str, ...]
    provenance: dict[str, str | int]
    conservation: Conservation | None = None  # where `conserve_energy` was asked for
    ladder: tuple[Rung, ...] = ()  # the materials that were tried, where the fit chose among several

    @cached_property
    def material(self) -> Material:
        """The fitted material."""
        return Material(self.form, self.values)

    @cached_property
    def errors(self) -> dict[str, float]:
        """The error under every loss, and `cosine_rms` (every_error.py): computed when first read."""
        found = errors(self.material, self.samples)
        return found if self.weighed or self.plan.robust else found | {self.loss: self.objective}

    @cached_property
    def certificate(self) -> Certificate:
        """The largest directional albedo and where, its limit towards grazing, reciprocity: made when first read."""
        return replace(certify(self.material), channel_names=self.samples.channels)

    @property
    def model(self) -> str:
        """The model that was fitted, its options decided, without values."""
        return self.form.text()

    @property
    def correlations(self) -> Tensor:
        """The correlations (K, K) [1] of the values in `covariance_keys`; 0 beside a value without any error."""
        error = self.covariance.diagonal().sqrt()
        scale = torch.where(error > 0, 1 / torch.where(error > 0, error, 1.0), 0.0)
        found = (self.covariance * scale * scale.unsqueeze(-1)).clamp(-1, 1)
        return found.fill_diagonal_(1.0)

    @property
    def options(self) -> dict[str, Any]:
        """What the fit was asked beside model, loss, seed and which values are fixed, gray or one a channel."""
        plan = self.plan
        return {
            "bounds": {key: list(pair) for key, pair in plan.bounds.items()},
            "starts": [{key: _numbers(value) for key, value in start.items()} for start in plan.starts],
            "robust": plan.robust,
            "robust_scale": self.robust_scale,
            "max_theta_deg": None if plan.max_theta is None else math.degrees(plan.max_theta),
            "conserve_energy": plan.conserve_energy,
        }

    def units(self) -> dict[str, str]:
        """What each parameter is, with its unit."""
        return {key: parameter.description for key, parameter in self.form.all_parameters.items()}

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON-able data, null where there is no number, and for covariances of more than 32 values."""
        result = {
            "model": self.model,
            "material_text": str(self.material),
            "material": self.material.to_json(),
            "loss": self.loss,
            "weighed": self.weighed,
            "options": self.options,
            "objective": number(self.objective),
            "status": self.status,
            "message": self.message,
            "parameters": {key: _numbers(value) for key, value in self.parameters.items()},
            "standard_errors": {key: _numbers(value) for key, value in self.standard_errors.items()},
            "intervals": {key: _intervals(value) for key, value in self.intervals.items()},
            "units": self.units(),
            "errors": {key: number(value) for key, value in self.errors.items()},
            "undetermined": list(self.undetermined),
            "combinations": [dict(one) for one in self.combinations],
            "singular_values": list(self.singular_values),
            "covariance_keys": list(self.covariance_keys),
            "covariance": self._matrix(self.covariance),
            "correlations": self._matrix(self.correlations),
            "warnings": list(self.warnings),
            "choices": list(self.choices),
            "fixed": list(self.fixed),
            "gray": list(self.gray),
            "per_channel": list(self.per_channel),
            "chi_square": None if self.chi_square is None else list(self.chi_square),
            "certificate": self.certificate.to_dict(),
            "conservation": None if self.conservation is None else _conservation(self.conservation),
            "cost": vars(self.cost).copy(),
            "channels": list(self.channels),
            "data": self.samples.report(),
            "provenance": dict(self.provenance),
            "ladder": [rung.to_dict() for rung in self.ladder],
        }
        return {**result, "report": _report(result, self._strong())}

    def _matrix(self, matrix: Tensor) -> list[list[float]] | None:
        return matrix.tolist() if 0 < len(matrix) <= _MOST else None

    def _strong(self) -> list[str]:
        """The pairs of values that are strongly correlated, the strongest first, in words."""
        upper = self.correlations.triu(1)
        pairs = (upper.abs() > _STRONG).nonzero().tolist()
        pairs.sort(key=lambda pair: -abs(float(upper[*pair])))
        keys = self.covariance_keys
        words = [f"{keys[i]} and {keys[j]} ({float(upper[i, j]):.3f})" for i, j in pairs[:_NAMED]]
        return words + [f"{len(pairs) - _NAMED} more"] * (len(pairs) > _NAMED)

    def report(self) -> str:
        """The result as plain text, one line a value."""
        return str(self.to_dict()["report"])


def _report(result: dict[str, Any], correlated: list[str]) -> str:
    lines = [result["model"], f"{result['status'].replace('_', ' ')}: {result['message']}", ""]
    lines.append(f"{'parameter':<32}{'value':>12}  {'95 % interval':<27}what it is")
    for key, value in result["parameters"].items():
        without = "fixed" if key in result["fixed"] else "none"
        intervals, what = result["intervals"][key], result["units"].get(key, "")
        if isinstance(value, list):
            names = [f"{key}[{name}]" for name in result["channels"]]
            lines.append(_row(names[0], value[0], intervals[0], without, what))
            rows = list(zip(names, value, intervals, strict=True))[1:]
            lines += [_row(name, v, interval, without, "") for name, v, interval in rows]
        else:
            lines.append(_row(key, value, intervals, without, what))
    lines += ["", "errors: " + ", ".join(f"{name} {value:.6g}" for name, value in result["errors"].items())]
    if result["chi_square"] is not None:
        lines.append("chi-square {:.6g} for {} degrees of freedom".format(*result["chi_square"]))
    if result["undetermined"]:
        lines.append("not determined by the data: " + ", ".join(result["undetermined"]))
        singular = result["singular_values"]
        lines.append(f"singular values of the scaled Jacobian: {singular[0]:.3g} down to {singular[-1]:.3g}")
    if correlated:
        lines.append("strongly correlated: " + ", ".join(correlated))
    lines += _asked(result["options"], result["weighed"])
    lines += [f"note: {sentence}" for sentence in result["warnings"]]
    lines.append(result["certificate"]["verdict"])
    lines += table(result["ladder"])
    lines += result["choices"]
    lines += [f"left out: {m['count']} samples, {m['reason']}" for m in result["data"].get("masked", [])]
    cost, made = result["cost"], result["provenance"]
    lines.append(
        f"{cost['seconds']:.2f} s, {cost['evaluations']} evaluations, {cost['iterations']} iterations, "
        f"{cost['starts']} starts, {cost['optimizer']}"
    )
    lines.append(f"brdfcore {made['version']}, torch {made['torch']}, seed {made['seed']}, input {made['input']}")
    return "\n".join(lines)


def _asked(options: dict[str, Any], weighed: bool) -> list[str]:
    """The options that the fit was given, a line each kind."""
    lines = []
    if options["robust"]:
        unit = " sigma" * weighed
        lines.append(f"robust: {options['robust']}, residuals beyond {options['robust_scale']:.4g}{unit} count less")
    if options["bounds"]:
        lines.append("bounds: " + ", ".join(f"{key} [{a:.6g}, {b:.6g}]" for key, (a, b) in options["bounds"].items()))
    if options["starts"]:
        lines.append(f"starts given: {len(options['starts'])}")
    if options["max_theta_deg"] is not None:
        lines.append(f"directions up to {options['max_theta_deg']:.6g} degrees")
    return lines


def _row(key: str, value: float | None, interval: list[float] | None, without: str, what: str) -> str:
    number = "none" if value is None else f"{value:.6g}"
    span = without if interval is None else f"[{interval[0]:.6g}, {interval[1]:.6g}]"
    return f"{key:<32}{number:>12}  {span:<27}{what}".rstrip()


def _conservation(it: Conservation) -> dict[str, Any]:
    return {**vars(it), "free_max_albedo": number(it.free_max_albedo), "fixed": list(it.fixed)}


def number(value: float) -> float | None:
    """The number as JSON can hold it: None where it is infinite or NaN."""
    return value if math.isfinite(value) else None


def _numbers(value: Tensor) -> Any:
    return number(value.item()) if value.ndim == 0 else [number(v) for v in value.tolist()]


def _intervals(value: Tensor) -> Any:
    if value.ndim == 1:
        return value.tolist() if bool(value.isfinite().all()) else None
    return [_intervals(row) for row in value]
