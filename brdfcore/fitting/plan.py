"""What a fit is asked: the text's form with its open options decided, and which values are free, fixed or gray."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from ..errors import ModelTextError, ParameterError, unknown_name
from ..models.form import Form, build
from ..models.text import ParsedTerm, Tie, parse
from .losses import LOSSES

OPTIMIZERS = ("auto", "least_squares", "lbfgs", "adam")


@dataclass(frozen=True)
class Plan:
    """A form, every start (shape () or (C,)), which keys are fixed, gray or per channel, and what the data decided."""

    form: Form
    start: dict[str, Tensor]
    fixed: frozenset[str]
    gray: frozenset[str]
    per_channel: frozenset[str]
    choices: tuple[str, ...]

    @property
    def free(self) -> tuple[str, ...]:
        """The keys that the fit determines, in the order of the text."""
        return tuple(key for key in self.form.parameters if key not in self.fixed)


def plan(
    channels: int,
    model: str,
    *,
    azimuth_observed: bool = False,
    fixed: Mapping[str, float | Sequence[float]] | None = None,
    gray: Iterable[str] = (),
    per_channel: Iterable[str] = (),
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
    for field, keys in (("gray", gray), ("per_channel", per_channel)):
        if isinstance(keys, str):
            raise ParameterError(
                f"Expected {field} to be a list of keys, got the text {keys!r}. Write [{keys!r}].", field=field
            )
    gray, per_channel = frozenset(gray), frozenset(per_channel)
    for field, known in (("fixed", fixed), ("gray", gray), ("per_channel", per_channel)):
        for key in known:
            if key not in form.parameters:
                raise unknown_name(f"a key of {field}", key, form.parameters, field=field)
    if both := sorted(gray & per_channel):
        raise ParameterError(
            f"Expected {both[0]} in gray or in per_channel, got it in both. Keep one.", field="per_channel"
        )
    start = {}
    for key, parameter in form.parameters.items():
        value = _tensor(key, fixed.get(key, given.get(key, parameter.default)))
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
            start[key] = value
        elif channels == 1:
            start[key] = value.reshape(())
        else:
            start[key] = value.expand(channels).clone()
    for key, tie in form.ties.items():
        _check_tie(form, key, tie, channels, start, fixed)
    return Plan(form, start, frozenset(fixed), gray, per_channel, choices)


def _held_isotropic(form: Form, parsed: Sequence[ParsedTerm]) -> Iterator[str]:
    """A sentence for each term that another of its words, and nothing else, keeps from being anisotropic."""
    for term, written in zip(form.terms, parsed, strict=True):
        for pair in term.model.apart:
            rest = [word for word in written.words if word not in pair]
            others = type(term.model).with_words(rest, tuple(written.arguments))
            if len(rest) < len(written.words) and any("anisotropic" in other.options for other in others):
                yield f"{term.label} is isotropic, which {pair[1]} lobes are, though the sample's azimuth was observed."


def _tensor(key: str, value: object) -> Tensor:
    """The value as a tensor; raises ParameterError where it is no number and no list of numbers."""
    numbers = value if isinstance(value, list | tuple) else [value]
    if isinstance(value, Tensor) or all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers):
        return torch.as_tensor(value, dtype=torch.float64).detach()
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
) -> Plan:
    """The plan of these arguments of `fit` for data of so many channels; raises what `fit` would raise."""
    if not isinstance(model, str):
        raise ModelTextError(
            f"Expected model to be a text, got {type(model).__name__}. Write it like 'lambert + ward'.", field="model"
        )
    if loss not in LOSSES:
        raise unknown_name("a loss", loss, LOSSES, field="loss")
    if optimizer not in OPTIMIZERS:
        raise unknown_name("an optimizer", optimizer, OPTIMIZERS, field="optimizer")
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**63:
        raise ParameterError(
            f"Expected seed to be a whole number from 0 to 2^63 - 1, got {seed!r}. Choose another.", field="seed"
        )
    return plan(channels, model, azimuth_observed=azimuth_observed, fixed=fixed, gray=gray, per_channel=per_channel)
