"""A script for a network namespace of its own: a Ray cluster, a service on it, kills, and what is left at the end.

Prints a JSON object. Ray listens beyond loopback, so nothing outside of the namespace may reach it.
"""

import contextlib
import json
import os
import pathlib
import random
import signal
import sqlite3
import subprocess
import sys
import time

from service_cases import measured_diffuser
from service_process import COUNTING, server, until

RAY = [sys.executable, "-m", "ray.scripts.scripts"]


def workers() -> list[int]:
    """The processes of the cluster in which an attempt computes now."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if "ray::_attempt" in path.read_text():
                found.append(int(path.parent.name))
    return found


def main(folder: pathlib.Path, fits: int, kills: int) -> None:
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    start = [*RAY, "start", "--head", "--num-cpus=2", "--include-dashboard=false", "--disable-usage-stats"]
    subprocess.run(start, check=True, capture_output=True)
    os.environ |= {"BRDF_RAY_ADDRESS": "auto", "RAY_USAGE_STATS_ENABLED": "0"}
    data, rng, killed = folder / "data", random.Random(3), 0
    try:
        with server(data, workers=4) as (process, client):
            with sqlite3.connect(data / "jobs.sqlite3", timeout=10) as db:
                db.executescript(COUNTING)
            submitted = (
                client.fit(measured_diffuser(2000), model="lambert + kurt", wait=False, seed=n) for n in range(fits)
            )
            accepted = [fit.id for fit in submitted]
            while killed < kills:
                time.sleep(rng.uniform(0.0, 0.5))
                for pid in rng.sample(found, 1) if (found := workers()) else ():
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGKILL)
                        killed += 1
            process.kill()
            process.wait()
        with server(data, workers=4) as (_, client):
            until(lambda: not client.recent(status="queued") and not client.recent(status="running"), seconds=600)
            ends = [client.get(fit_id).view for fit_id in accepted]
        with sqlite3.connect(data / "jobs.sqlite3") as db:
            commits = [row[0] for row in db.execute("SELECT job FROM commits")]
        told = {
            "killed": killed,
            "statuses": [view.status for view in ends],
            "attempts": [view.attempts for view in ends],
            "errors": [view.error for view in ends if view.error],
            "committed_once": sorted(commits) == sorted(v.id for v in ends if v.status == "succeeded"),
        }
        print(json.dumps(told))
    finally:
        subprocess.run([*RAY, "stop", "--force"], capture_output=True)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
