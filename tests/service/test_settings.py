"""Settings: defaults, environment, arguments, refusals."""

import pathlib

import pytest

from brdfcore.errors import InvalidValueError
from service.settings import Settings


def test_the_defaults_are_safe() -> None:
    settings = Settings.from_environment({})
    assert (settings.host, settings.port, settings.data) == ("127.0.0.1", 8000, pathlib.Path("brdf-data"))
    assert settings.workers >= 1
    assert settings.inline_rows == 10_000


def test_arguments_win_over_the_environment_and_none_is_no_argument() -> None:
    environment = {"BRDF_PORT": "9000", "BRDF_DATA": "/data", "BRDF_FIT_SECONDS": "1.5", "BRDF_WORKERS": "3"}
    settings = Settings.from_environment(environment, port=9001, host=None)
    assert (settings.port, settings.host) == (9001, "127.0.0.1")
    assert (settings.data, settings.fit_seconds, settings.workers) == (pathlib.Path("/data"), 1.5, 3)
    assert Settings.from_environment({"BRDF_DATA": "", "BRDF_PORT": ""}) == Settings.from_environment({})


@pytest.mark.parametrize(
    ("name", "text", "rule"),
    [
        ("BRDF_PORT", "http", "port to be of type int, got 'http'"),
        ("BRDF_PORT", "70000", "port to be within 0..65535, got 70000"),
        ("BRDF_WORKERS", "0", "workers to be above 0, got 0"),
        ("BRDF_FIT_SECONDS", "nan", "fit_seconds to be above 0, got nan"),
        ("BRDF_UPLOAD_LIMIT", "1e9", "upload_limit to be of type int"),
        ("BRDF_FIT_MEMORY", str(2**63), r"fit_memory to be below 2\^63"),
        ("BRDF_QUEUE_LIMIT", "0", "queue_limit to be above 0"),
        ("BRDF_KEEP_DAYS", "-1", "keep_days to be 0 or more"),
        ("BRDF_KEEP_DAYS", "inf", "keep_days to be 0 or more"),
        ("BRDF_LOG_LEVEL", "loud", "log_level to be one of debug, info, warning, error"),
    ],
)
def test_a_bad_value_names_its_variable(name: str, text: str, rule: str) -> None:
    with pytest.raises(InvalidValueError, match=rule) as refused:
        Settings.from_environment({name: text})
    assert name in str(refused.value)
    assert refused.value.field == name.removeprefix("BRDF_").lower()
