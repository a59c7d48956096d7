"""Errors, and a sign of life."""

from ._base import View


class HealthView(View):
    """A sign of life."""

    status: str


class FieldError(View):
    """One thing that is wrong with a request."""

    field: str
    message: str


class Problem(View):
    """An error, as RFC 9457 writes it; `field` names the input at fault, `errors` each of several."""

    type: str = "about:blank"
    title: str
    status: int
    detail: str
    field: str | None = None
    errors: list[FieldError] | None = None
