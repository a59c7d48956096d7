"""The runner on a Ray cluster: a clear word where Ray is missing, and every result once whatever is killed."""

import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys

import pytest

from brdfcore.errors import InvalidValueError
from service.jobs.ray_runner import RayRunner
from service.jobs.retries import MOST_INTERRUPTED

HERE = pathlib.Path(__file__).parent


def test_a_cluster_without_the_package_is_refused(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(
        InvalidValueError, match="Expected the package ray to be installed, since ray_address is 'auto'"
    ):
        RayRunner("auto", tmp_path, 2**33)


def can_unshare() -> bool:
    """Whether this process may make a network namespace."""
    unshare = shutil.which("unshare")
    return unshare is not None and subprocess.run([unshare, "-n", "true"], capture_output=True).returncode == 0


@pytest.mark.full
@pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="needs Ray: pip install -e '.[ray]'")
@pytest.mark.skipif(not can_unshare(), reason="needs a network namespace of its own: unshare -n")
def test_fifty_fits_survive_twenty_kills_and_a_new_server(tmp_path: pathlib.Path) -> None:
    script = [sys.executable, str(HERE / "ray_cluster.py"), str(tmp_path), "50", "20"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([*sys.path, str(HERE)])}
    ran = subprocess.run(["unshare", "-n", *script], capture_output=True, text=True, env=environment, timeout=1500)
    assert ran.returncode == 0, ran.stderr[-3000:]
    told = json.loads(ran.stdout.splitlines()[-1])
    assert told["killed"] == 20
    assert told["committed_once"]
    assert told["errors"] == []
    assert told["statuses"] == ["succeeded"] * 50
    # no fit can be given up: 20 kills and a new server are fewer ends from outside than it takes
    assert MOST_INTERRUPTED > 21
    assert sum(told["attempts"]) >= 50 + 20 // 2  # some kills hit a process that had just answered
