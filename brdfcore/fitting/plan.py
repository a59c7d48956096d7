"""What a fit is asked: the text's form with its open options decided, and which values are free, fixed or gray."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from ..errors import ParameterError, unknown_name
from ..models.form import Form, build
from ..models.text import parse
from .losses import LOSSES

OPTIMIZERS = ("auto", "least_squares", "lbfgs", "adam")


@dataclass(frozen=True)
class Plan:
    """A form, the start of every value (shape () or (C,)), which keys are fixed, and what the data decided."""

    form: Form
    start: dict[str, Tensor]
    fixed: frozenset[str]
    given: frozenset[str]  # keys whose start the text names
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
    form, given, left_open = build(parse(model), prefer=("anisotropic",) if azimuth_observed else ())
    choices = tuple(
        f"{label} is {word}: the sample's azimuth was {'' if azimuth_observed else 'not '}observed."
        for label, words in left_open.items()
        for word in words
        if word in ("isotropic", "anisotropic")
    )
    fixed, gray, per_channel = dict(fixed or {}), set(gray), set(per_channel)
    for field, keys in (("fixed", fixed), ("gray", gray), ("per_channel", per_channel)):
        for key in keys:
            if key not in form.parameters:
                raise unknown_name(f"a key of {field}", key, form.parameters, field=field)
    start = {}
    for key, parameter in form.parameters.items():
        value = torch.as_tensor(fixed.get(key, given.get(key, parameter.default)), dtype=torch.float64)
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
        if tie.total is not None and len(tie.total) not in (1, channels):
            raise ParameterError(
                f"Expected the total of {key} to have {channels} channels as the data has, got {len(tie.total)}. "
                "Give one number, or one a channel.",
                field=key,
            )
    return Plan(form, start, frozenset(fixed), frozenset(given), choices)


def check(
    channels: int,
    model: str,
    loss: str = "cosine",
    optimizer: str = "auto",
    fixed: Mapping[str, float | Sequence[float]] | None = None,
    gray: Iterable[str] = (),
    per_channel: Iterable[str] = (),
    *,
    azimuth_observed: bool = False,
) -> None:
    """Raise what `fit` would raise for these arguments and data of so many channels, without fitting."""
    if loss not in LOSSES:
        raise unknown_name("a loss", loss, LOSSES, field="loss")
    if optimizer not in OPTIMIZERS:
        raise unknown_name("an optimizer", optimizer, OPTIMIZERS, field="optimizer")
    plan(channels, model, azimuth_observed=azimuth_observed, fixed=fixed, gray=gray, per_channel=per_channel)
