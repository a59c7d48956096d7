"""What a fit is asked: the text's form with its open options decided, and which values are free, fixed or gray."""

import functools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import torch
from torch import Tensor

from ..errors import ModelTextError, ParameterError, unknown_name
from ..models.form import Form, build
from ..models.text import ParsedTerm, Tie, parse
from ..parameters import Parameter
from .effects import AUTO
from .given import check_known, whole
from .limits import check_max_theta, check_robust, checked_bounds
from .losses import LOSSES

GRADIENT = ("lbfgs", "adam")  # which follow the gradient alone
OPTIMIZERS = ("auto", "least_squares", *GRADIENT)


@dataclass(frozen=True)
class Plan:
    """A form, every start (shape () or (C,)), which keys are fixed, gray or per channel, and what the data decided."""

    form: Form
    start: dict[str, Tensor]
    fixed: frozenset[str]
    gray: frozenset[str]
    per_channel: frozenset[str]
    choices: tuple[str, ...]
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # narrower boxes of the user's
    starts: tuple[dict[str, Tensor], ...] = ()  # the user's: the text's where it has values, and more
    robust: str | None = None
    robust_scale: float | None = None
    max_theta: float | None = None  # [rad]
    conserve_energy: bool = False

    @functools.cached_property
    def free(self) -> tuple[str, ...]:
        """The keys that the fit determines, in the order of the text."""
        return tuple(key for key in self.form.parameters if key not in self.fixed)

    def limits(self, key: str) -> tuple[Tensor, Tensor]:
        """The smallest and largest values of a free key, shaped as its start: its box, its ties', and the user's."""
        low, high = self.form.bounds(key, self.start[key])
        least, most = self.bounds.get(key, (-math.inf, math.inf))
        return low.clamp(min=least), high.clamp(max=most)

    def search_range(self, key: str) -> tuple[float, float]:
        """The range from which a key's starts are drawn: the parameter's, within the user's bounds."""
        low, high = self.form.parameters[key].search_range
        least, most = self.bounds.get(key, (low, high))
        inside = max(low, least), min(high, most)
        return inside if inside[0] < inside[1] else (least, most)


def plan(
    channels: int,
    model: str,
    *,
    azimuth_observed: bool = False,
    fixed: Mapping[str, float | Sequence[float]] | None = None,
    gray: Iterable[str] = (),
    per_channel: Iterable[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    starts: Iterable[Mapping[str, float | Sequence[float]]] = (),
) -> Plan:
    """The plan for data of so many channels; raises ModelTextError, ParameterError or UnknownNameError.

    An option that the text leaves open is decided by the data: a lobe is anisotropic where the sample's azimuth was
    observed. Values in the text are starts. A reflectance has one value a channel unless `gray` names it; an f0 has
    one for all unless `per_channel` names it or its start is a list.
    """
    parsed = parse(model)
    form, given, left_open = build(parsed, prefer=("anisotropic",) if azimuth_observed else ())
    choices = tuple(
        f"{label} is {word}: the sample's azimuth was {'' if azimuth_observed else 'not '}observed."
        for label, words in left_open.items()
        for word in words
        if word in ("isotropic", "anisotropic")
    )
    if azimuth_observed:
        choices += tuple(_held_isotropic(form, parsed))
    fixed = dict(fixed or {})
    gray, per_channel = frozenset(gray), frozenset(per_channel)
    for name, known in (("fixed", fixed), ("gray", gray), ("per_channel", per_channel)):
        for key in known:
            if key not in form.parameters:
                raise unknown_name(f"a key of {name}", key, form.parameters, field=name)
    if both := sorted(gray & per_channel):
        raise ParameterError(
            f"Expected {both[0]} in gray or in per_channel, got it in both. Keep one.", field="per_channel"
        )
    start = {
        key: _start(key, parameter, fixed.get(key, given.get(key, parameter.default)), channels, gray, per_channel)
        for key, parameter in form.parameters.items()
    }
    for key, tie in form.ties.items():
        _check_tie(form, key, tie, channels, start, fixed)
    narrowed = checked_bounds(form, bounds, start, {*given, *fixed})
    further = [start] if set(given) - set(fixed) else []
    for values in starts:
        for key in values:
            if key not in form.parameters:
                raise unknown_name("a key of starts", key, form.parameters, field="starts")
        own = {key: _start(key, form.parameters[key], v, channels, gray, per_channel) for key, v in values.items()}
        further.append({**start, **own})
    return Plan(form, start, frozenset(fixed), gray, per_channel, choices, narrowed, tuple(further))


def _start(
    key: str, parameter: Parameter, number: object, channels: int, gray: frozenset[str], per_channel: frozenset[str]
) -> Tensor:
    """The value as a start, () or (C,); raises where it leaves the box or has a wrong number of channels."""
    value = _tensor(key, number)
    parameter.check(key, value)
    wide = parameter.per_channel == "yes" or key in per_channel or value.ndim == 1
    if key in per_channel and parameter.per_channel == "no":
        raise ParameterError(
            f"Expected per_channel to name reflectances, got {key}. It has one value for all channels; drop it.",
            field="per_channel",
        )
    if value.ndim == 1 and value.numel() != channels:
        raise ParameterError(
            f"Expected {key} to have {channels} channels as the data has, got {value.numel()}. "
            "Give one number, or one a channel.",
            field=key,
        )
    if key in gray or not wide:
        if value.ndim == 1:
            raise ParameterError(
                f"Expected {key} to be one number, since gray names it, got {value.numel()}. Give one.", field=key
            )
        return value
    return value.reshape(()) if channels == 1 else value.expand(channels).clone()


def _held_isotropic(form: Form, parsed: Sequence[ParsedTerm]) -> Iterator[str]:
    """A sentence for each term that another of its words, and nothing else, keeps from being anisotropic."""
    for term, written in zip(form.terms, parsed, strict=True):
        if "anisotropic" in term.model.options:
            continue
        for pair in term.model.apart:
            rest = [word for word in written.words if word not in pair]
            others = type(term.model).with_words(rest, tuple(written.arguments))
            if len(rest) < len(written.words) and any("anisotropic" in other.options for other in others):
                yield f"{term.label} is isotropic, which {pair[1]} lobes are, though the sample's azimuth was observed."


def _tensor(key: str, value: object) -> Tensor:
    """The value as a tensor; raises ParameterError where it is no number and no list of numbers."""
    numbers = value if isinstance(value, list | tuple) else [value]
    if all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers):
        return torch.tensor(value, dtype=torch.float64)
    raise ParameterError(
        f"Expected {key} to be a number, or a list of one a channel, got {value!r}. Give it as such.", field=key
    )


def _check_tie(
    form: Form, key: str, tie: Tie, channels: int, start: Mapping[str, Tensor], fixed: Mapping[str, object]
) -> None:
    """Raise where a tie has a wrong number of channels, or leaves its owner no value, or not the one it is fixed at."""
    if tie.total is not None and len(tie.total) not in (1, channels):
        raise ParameterError(
            f"Expected the total of {key} to have {channels} channels as the data has, got {len(tie.total)}. "
            "Give one number, or one a channel.",
            field=key,
        )
    form.all_parameters[key].check_shape(key, form.resolve(key, start))
    owner = start[tie.owner]
    low, high = form.bounds(tie.owner, owner)
    if bool((low > high).any()):
        raise ParameterError(
            f"Expected {key} to be in {form.all_parameters[key].box}, but no value of {tie.owner} in "
            f"{form.parameters[tie.owner].box} leaves it there. Change the total.",
            field=key,
        )
    if tie.owner in fixed and bool(((owner < low) | (owner > high)).any()):
        raise ParameterError(
            f"Expected {tie.owner} to be fixed within [{float(low.max()):g}, {float(high.min()):g}], where {key} "
            f"stays in its box, got {float(owner.max()):g}. Fix it there.",
            field=tie.owner,
        )


def check(
    channels: int,
    model: str,
    loss: str = "cosine",
    optimizer: str = "auto",
    fixed: Mapping[str, float | Sequence[float]] | None = None,
    gray: Iterable[str] = (),
    per_channel: Iterable[str] = (),
    seed: int = 0,
    *,
    azimuth_observed: bool = False,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    starts: Iterable[Mapping[str, float | Sequence[float]]] = (),
    robust: str | None = None,
    robust_scale: float | None = None,
    max_theta: float | None = None,
    conserve_energy: bool = False,
) -> Plan:
    """The plan of these arguments of `fit` for data of so many channels; raises what `fit` would raise."""
    if not isinstance(model, str):
        raise ModelTextError(
            f"Expected model to be a text, got {type(model).__name__}. Write it like 'lambert + ward'.", field="model"
        )
    if model == AUTO:
        raise ModelTextError(
            f'Expected model to be one text here, got "{AUTO}", which chooses among several. Use bc.fit for that.',
            field="model",
        )
    check_known("a loss", loss, LOSSES, "loss")
    check_known("an optimizer", optimizer, OPTIMIZERS, "optimizer")
    if (number := whole(seed)) is None or not 0 <= number < 2**63:
        raise ParameterError(
            f"Expected seed to be a whole number from 0 to 2^63 - 1, got {seed!r}. Choose another.", field="seed"
        )
    check_robust(robust, robust_scale)
    check_max_theta(max_theta)
    if not isinstance(conserve_energy, bool):
        raise ParameterError(
            f"Expected conserve_energy to be true or false, got {conserve_energy!r}. Pass one of them.",
            field="conserve_energy",
        )
    made = plan(
        channels,
        model,
        azimuth_observed=azimuth_observed,
        fixed=fixed,
        gray=gray,
        per_channel=per_channel,
        bounds=bounds,
        starts=starts,
    )
    return replace(made, robust=robust, robust_scale=robust_scale, max_theta=max_theta, conserve_energy=conserve_energy)
