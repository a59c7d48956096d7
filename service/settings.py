"""What the operator may set, from arguments or from the environment variables BRDF_DATA, BRDF_HOST and so on."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from brdfcore.errors import InvalidValueError

from .keys import hashes

LOG_LEVELS = ("debug", "info", "warning", "error")


@dataclass(frozen=True)
class Settings:
    """One value a field; the environment variable of `data` is BRDF_DATA, of `fit_seconds` BRDF_FIT_SECONDS.

    data            folder of the datasets, the job store and its lock; made where it does not exist
    host, port      where the service listens
    workers         fits and tables that run at the same time, each in one process with one thread
    upload_limit    largest dataset that is accepted [bytes]
    inline_rows     most samples that POST /v1/fits takes inline, more go through POST /v1/datasets; and most pairs of
                    directions that POST /v1/evaluate takes
    fit_seconds     longest that one attempt at a fit or a table may run [s]
    fit_memory      most memory that one attempt may allocate [bytes]
    ray_address     of a Ray cluster whose nodes compute instead of this machine's processes; empty for these
    ray_cpus, ray_gpus   what one job takes of the cluster; fractions share a GPU
    queue_limit     unfinished jobs that one key, or everybody without keys, may have
    keep_days       ended jobs, and datasets that no job is of, are removed after so many days; 0 keeps them for ever
    api_keys        keys that are let in, as their SHA-256; without any, everybody is. The variable holds the keys
                    themselves, or sha256:HEX, with commas between
    log_level       debug, info (a line for every request), warning or error; the log is JSON lines on standard error
    """

    data: Path = Path("brdf-data")
    host: str = "127.0.0.1"
    port: int = 8000
    workers: int = field(default_factory=lambda: os.cpu_count() or 1)
    upload_limit: int = 512 * 2**20
    inline_rows: int = 10_000
    fit_seconds: float = 3600.0
    fit_memory: int = 8 * 2**30
    ray_address: str = ""
    ray_cpus: float = 1.0
    ray_gpus: float = 0.0
    queue_limit: int = 1000
    keep_days: float = 0.0
    api_keys: tuple[str, ...] = field(default=(), repr=False, metadata={"read": hashes})
    log_level: str = "warning"

    def __post_init__(self) -> None:
        for name in ("workers", "upload_limit", "inline_rows", "fit_seconds", "fit_memory", "queue_limit"):
            if not getattr(self, name) > 0:
                raise _refused(name, "above 0", getattr(self, name))
        if not self.fit_memory < 2**63:  # what the system can be told
            raise _refused("fit_memory", "below 2^63", self.fit_memory)
        if not 0 <= self.port <= 65535:
            raise _refused("port", "within 0..65535", self.port)
        for name in ("ray_cpus", "ray_gpus"):
            if not 0 <= getattr(self, name) < math.inf:
                raise _refused(name, "0 or more", getattr(self, name))
        if not 0 <= self.keep_days < math.inf:
            raise _refused("keep_days", "0 or more", self.keep_days)
        if self.log_level not in LOG_LEVELS:
            raise _refused("log_level", f"one of {', '.join(LOG_LEVELS)}", self.log_level)

    @property
    def loopback(self) -> bool:
        """Whether only this machine reaches the service."""
        return self.host.startswith("127.") or self.host in ("localhost", "::1")

    def check_open(self) -> None:
        """Refuse to be open to other machines without a key."""
        if not self.loopback and not self.api_keys:
            raise InvalidValueError(
                f"Expected an API key, since {self.host} is open to other machines, got none. Set BRDF_API_KEYS, for "
                "example to the output of: openssl rand -hex 24; or listen on 127.0.0.1.",
                field="api_keys",
            )

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ, **given: Any) -> "Settings":
        """The settings of the variables that are not empty, except where an argument other than None is given."""
        values: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
        for setting in fields(cls):
            text = environment.get(f"BRDF_{setting.name.upper()}")
            if text and setting.name not in values:
                read = setting.metadata.get("read")
                values[setting.name] = read(text) if read else _converted(setting.name, setting.type, text)
        return cls(**values)


def _converted(name: str, kind: Any, text: str) -> Any:
    try:
        return kind(text)
    except ValueError:
        raise _refused(name, f"of type {kind.__name__}", text) from None


def _refused(name: str, rule: str, value: object) -> InvalidValueError:
    return InvalidValueError(
        f"Expected {name} to be {rule}, got {value!r}. Correct it, or the environment variable BRDF_{name.upper()}.",
        field=name,
    )
