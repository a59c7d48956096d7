"""Small measurements whose answer is known, and an app that never starts a job."""

import contextlib
import math
from collections.abc import Iterator
from typing import Any

import pytest
from starlette.testclient import TestClient

from service.app import create_app
from service.jobs.dispatcher import Dispatcher
from service.settings import Settings

KD = 0.4


def measured_diffuser(rows: int = 24, channels: int = 1) -> dict[str, Any]:
    """Inline samples of a Lambertian surface, kd = 0.4 in the first channel, with an error of about 1 %."""
    wobble = [0.01 * math.sin(7.0 * k) for k in range(rows)]
    return {
        "theta_i_deg": [10.0 + 60.0 * k / rows for k in range(rows)],
        "phi_i_deg": [0.0] * rows,
        "theta_o_deg": [70.0 - 60.0 * k / rows for k in range(rows)],
        "phi_o_deg": [180.0] * rows,
        "values": [[KD / math.pi * (1.0 + w) / (1 + c) for c in range(channels)] for w in wobble],
        "quantity": "brdf",
    }


def csv_file(rows: int = 24) -> bytes:
    """The same measurement as a CSV file that declares its unit and leaves its quantity undeclared."""
    samples = measured_diffuser(rows)
    columns = ("theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg")
    lines = ["theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value"]
    for k, values in enumerate(samples["values"]):
        lines.append(",".join(repr(x) for x in (*(samples[name][k] for name in columns), *values)))
    return "\n".join(lines).encode()


class Idle(Dispatcher):
    """A dispatcher that never starts."""

    def start(self) -> None:
        """Leave every job queued."""

    def stop(self) -> None:
        """Nothing to end."""


@contextlib.contextmanager
def idling(settings: Settings) -> Iterator[TestClient]:
    """A client of an app whose dispatcher never starts, so that jobs stay queued."""
    with contextlib.ExitStack() as stack:
        with pytest.MonkeyPatch.context() as patch:  # undone before another app starts
            patch.setattr("service.app.Dispatcher", Idle)
            client = stack.enter_context(TestClient(create_app(settings), raise_server_exceptions=False))
        yield client
