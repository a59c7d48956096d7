"""What a fit may be asked to choose from: one text, a list of texts, or "auto"; and what of the rest concerns which."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import ModelTextError, unknown_name
from ..models.form import Form, build
from ..models.text import parse
from . import plan
from .effects import AUTO, RICHEST
from .given import plainly
from .plan import Plan

_BY_KEY = ("fixed", "bounds", "gray", "per_channel")  # keywords that name a material's values


def texts(model: object) -> tuple[str, ...]:
    """The texts that a model may be, for "auto" those with every effect; raises for a list that is not of texts."""
    if isinstance(model, str) and model == AUTO:
        return tuple(effects.text() for effects in RICHEST)
    if isinstance(model, str):
        return (model,)
    if not isinstance(model, list | tuple) or not model or not all(isinstance(t, str) and t != AUTO for t in model):
        raise ModelTextError(
            f'Expected model to be a text, a list of texts or "{AUTO}", got {model!r}. Write each like '
            "'lambert + ward'.",
            field="model",
        )
    return tuple(dict.fromkeys(model))


def own(keywords: Mapping[str, Any], form: Form) -> dict[str, Any]:
    """The keywords of `fit`, made plain (given.py), those that name values without what the form does not have."""
    found = dict(keywords)
    for name in _BY_KEY:
        given = keywords.get(name)
        if isinstance(given, Mapping):
            found[name] = {key: value for key, value in given.items() if key in form.parameters}
        elif given is not None:
            found[name] = [key for key in given if key in form.parameters]
    starts = keywords.get("starts") or ()
    found["starts"] = [{k: v for k, v in one.items() if k in form.parameters} for one in starts]
    return found


def fell_away(keywords: Mapping[str, Any], form: Form) -> tuple[str, ...]:
    """A sentence for each keyword that names values which the chosen form does not have."""
    return tuple(
        f"{name} names {', '.join(keys)}, which the material chosen does not have, so that had no effect on it."
        for name in _BY_KEY
        if (keys := [key for key in keywords.get(name) or () if key not in form.parameters])
    )


def check(channels: int, model: str | Sequence[str], *, azimuth_observed: bool = False, **keywords: Any) -> Plan:
    """The plan of these arguments of `fit` for data of so many channels, of several models the last; raises as it."""
    several, keywords = texts(model), plainly(keywords)
    if len(several) == 1:
        return plan.check(channels, several[0], azimuth_observed=azimuth_observed, **keywords)
    known: set[str] = set()
    made = []
    for text in several:
        form = form_of(text, azimuth_observed=azimuth_observed)
        known |= set(form.parameters)
        made.append(plan.check(channels, text, azimuth_observed=azimuth_observed, **own(keywords, form)))
    named = {name: keywords.get(name) or () for name in _BY_KEY}
    named["starts"] = [key for one in keywords.get("starts") or () for key in one]
    for name, keys in named.items():
        for key in keys:
            if key not in known:
                raise unknown_name(f"a key of {name}", key, sorted(known), field=name)
    return made[-1]


def form_of(text: str, *, azimuth_observed: bool) -> Form:
    """The form of a text, the options that it leaves open decided as a fit decides them."""
    return build(parse(text), prefer=("anisotropic",) if azimuth_observed else ())[0]
