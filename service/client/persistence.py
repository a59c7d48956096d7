"""How a client keeps at it: each request of a call sent again where the service is busy or does not answer."""

import dataclasses
from typing import Any, TypeVar

import httpx2

from ..schemas import Problem
from .calls import Ask, Call, Pause
from .errors import ProblemError, UnreachableError
from .requests import LONGEST

TRIES = 4  # of one request
_BUSY = (429, 503)
_FIRST, _LONGEST = 0.25, 30.0  # pauses between them [s]
_T = TypeVar("_T")


def settings(url: str, api_key: str | None) -> dict[str, Any]:
    """How httpx2 is to reach the service."""
    headers = {"authorization": f"Bearer {api_key}"} if api_key else {}
    return {"base_url": url, "headers": headers, "timeout": LONGEST + 60}


def persistent(call: Call[_T], url: object) -> Call[_T]:
    """The same call, which takes an answer of any status, or the httpx2.TransportError for none, and tries again.

    Raises ProblemError for what the service refuses, UnreachableError where it does not answer.
    """
    answer: Any = None
    try:
        while True:
            step = call.send(answer)
            answer = (yield step) if isinstance(step, Pause) else (yield from _answered(step, url))
    except StopIteration as done:
        result: _T = done.value
        return result
    finally:
        call.close()  # closes the file that was to be sent


def _answered(ask: Ask, url: object) -> Call[httpx2.Response]:
    attempt = 0
    while True:
        if hasattr(ask.what.get("content"), "seek"):
            ask.what["content"].seek(0)
        answer = yield dataclasses.replace(ask, what=dict(ask.what))
        attempt += 1
        if isinstance(answer, httpx2.TransportError):
            if attempt == TRIES:
                sentence = f"Expected a service at {url}, got {type(answer).__name__}: {answer}. Is it running?"
                raise UnreachableError(sentence) from answer
            yield Pause(_pause(attempt, ""))
        elif answer.status_code in _BUSY and attempt < TRIES:
            yield Pause(_pause(attempt, answer.headers.get("retry-after", "")))
        else:
            return _checked(answer)


def _pause(attempt: int, asked: str) -> float:
    """How long to leave the service alone [s]: what it asks for, else twice as long each time."""
    return min(float(asked) if asked.isdecimal() else _FIRST * 2 ** (attempt - 1), _LONGEST)


def _checked(answer: httpx2.Response) -> httpx2.Response:
    """The answer; raises what it refuses."""
    if answer.is_success:
        return answer
    if answer.headers.get("content-type", "").startswith("application/problem+json"):
        raise ProblemError(Problem.model_validate_json(answer.content))
    detail = f"Expected an answer of this service at {answer.url}, got status {answer.status_code}. Check the URL."
    raise ProblemError(Problem(title=answer.reason_phrase, status=answer.status_code, detail=detail))
