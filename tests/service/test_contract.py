"""The OpenAPI document against the running service, by schemathesis: thousands of generated requests, every check."""

import pathlib
import re
import shutil
import subprocess
import sys

import pytest

from brdfcore.cli.serve import background
from service.settings import Settings

SCHEMATHESIS = shutil.which("schemathesis") or shutil.which("schemathesis", path=pathlib.Path(sys.executable).parent)
# what is valid by its schema may still name no dataset, or hold no measurement: 4xx with a sentence is right, 5xx never
CONFIG = '[checks]\npositive_data_acceptance.expected-statuses = ["2xx", "4xx"]\n'


@pytest.mark.full
@pytest.mark.skipif(SCHEMATHESIS is None, reason="needs schemathesis: pip install -e '.[contract]'")
def test_two_thousand_generated_requests_find_nothing(tmp_path: pathlib.Path) -> None:
    config = tmp_path / "schemathesis.toml"
    config.write_text(CONFIG)
    with background(Settings(data=tmp_path / "data", port=0, workers=1, fit_seconds=20)) as url:
        options = ["--checks", "all", "--max-examples", "25", "--seed", "1", "--suppress-health-check", "all"]
        options += ["--max-response-time", "60"]  # test_bars.py measures times; here other work may slow the machine
        command = [str(SCHEMATHESIS), "--config-file", str(config), "run", f"{url}/openapi.json", *options]
        ran = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=1500)
    assert ran.returncode == 0, ran.stdout[-5000:]
    told = re.search(r"(\d+) generated, (\d+) passed", ran.stdout)
    assert told is not None, ran.stdout[-5000:]
    assert int(told[1]) == int(told[2]) >= 2000
