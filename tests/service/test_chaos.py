"""kill -9 at random points, of workers and of the server: nothing accepted is lost, nothing is committed twice."""

import contextlib
import os
import pathlib
import random
import signal
import sqlite3
import time

import pytest
from service_cases import measured_diffuser
from service_process import COUNTING, SLOW, server, session_ids, until

JOBS, KILLS, SERVERS = 120, 100, 25  # of the kills, so many hit the server


@pytest.mark.full
def test_a_hundred_kills_lose_nothing(tmp_path: pathlib.Path) -> None:
    data, rng, accepted = tmp_path / "data", random.Random(7), []
    kills = ["server"] * SERVERS + ["worker"] * (KILLS - SERVERS)
    rng.shuffle(kills)
    with server(data, workers=2), sqlite3.connect(data / "jobs.sqlite3", timeout=10) as db:
        db.executescript(COUNTING)
    while kills:
        with server(data, workers=2) as (process, client):
            for _ in range(min(5, JOBS - len(accepted))):
                accepted.append(client.fit(measured_diffuser(200), wait=False, seed=len(accepted), **SLOW).id)
            while kills:
                kill = kills.pop()
                if kill == "server":
                    time.sleep(rng.uniform(0.0, 0.5))
                    process.kill()
                    process.wait()
                    break
                until(lambda: client.recent(status="running"), seconds=120)
                time.sleep(rng.uniform(0.0, 0.5))
                workers = [pid for pid in session_ids(process.pid) if pid != process.pid]
                # mostly the newest, an attempt; else any, the fork server among them, which takes seconds to come back
                for pid in [max(workers) if rng.random() < 0.8 else rng.choice(workers)] if workers else ():
                    with contextlib.suppress(ProcessLookupError):  # it ended by itself just now
                        os.kill(pid, signal.SIGKILL)
    with server(data, workers=2) as (_, client):
        while len(accepted) < JOBS:
            accepted.append(client.fit(measured_diffuser(200), wait=False, seed=len(accepted), **SLOW).id)
        until(lambda: not client.recent(status="queued") and not client.recent(status="running"), seconds=600)
        ends = {fit_id: client.get(fit_id).view for fit_id in accepted}
    assert [view.error for view in ends.values() if view.error] == []
    succeeded = [fit_id for fit_id, view in ends.items() if view.status == "succeeded"]
    assert len(succeeded) == JOBS
    with sqlite3.connect(data / "jobs.sqlite3") as db:
        assert db.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert sorted(row[0] for row in db.execute("SELECT job FROM commits")) == sorted(succeeded)
        assert db.execute("SELECT count(*) FROM jobs").fetchone()[0] == JOBS
