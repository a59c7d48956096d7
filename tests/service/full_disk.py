"""A script for a mount namespace of its own: a service whose disk fills up, and what is left once there is room again.

Prints a JSON object.
"""

import json
import pathlib
import sqlite3
import subprocess
import sys

from service_cases import csv_file, measured_diffuser
from service_process import COUNTING, server, until

from service.client import ProblemError


def main(folder: pathlib.Path) -> None:
    data = folder / "data"
    data.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=4m", "none", str(data)], check=True)
    told: dict[str, object] = {}
    accepted: list[str] = []
    (folder / "small.csv").write_bytes(csv_file())
    (folder / "large.csv").write_bytes(csv_file(20_000))
    with server(data, workers=2) as (process, client):
        with sqlite3.connect(data / "jobs.sqlite3", timeout=10) as db:
            db.executescript(COUNTING)

        def submit(seed: int) -> None:
            accepted.append(client.fit(measured_diffuser(200), model="lambert + kurt", wait=False, seed=seed).id)

        dataset = client.upload(folder / "small.csv", quantity="brdf")
        for seed in range(4):
            submit(seed)
        with (data / "filler").open("wb", buffering=0) as filler:
            try:
                while True:
                    filler.write(bytes(4096))
            except OSError as error:
                told["filled"] = error.errno
        refused = []
        try:
            client.upload(folder / "large.csv", quantity="brdf")
        except ProblemError as error:
            refused.append([error.status, error.detail])
        try:
            for seed in range(4, 200):  # the store has some room of its own left
                submit(seed)
        except ProblemError as error:
            refused.append([error.status, error.detail])
        told["refused"] = refused
        told["alive"] = [client._http.get(path).status_code for path in ("/healthz", "/readyz", "/v1/fits")]
        told["read"] = client._http.get(f"/v1/datasets/{dataset.id}").status_code
        (data / "filler").unlink()
        until(lambda: not client.recent(status="queued") and not client.recent(status="running"), seconds=120)
        told["same server"] = process.poll() is None
        client.upload(folder / "large.csv", quantity="brdf")
        told["statuses"] = sorted({client.get(fit_id).job_status for fit_id in accepted})
        told["left"] = [path.name for path in (data / "incoming").iterdir()]
    with sqlite3.connect(data / "jobs.sqlite3") as db:
        told["integrity"] = db.execute("PRAGMA integrity_check").fetchall()
        told["kept"] = db.execute("SELECT count(*) FROM jobs").fetchone()[0] == len(accepted)
        commits = [row[0] for row in db.execute("SELECT job FROM commits")]
    told["committed_once"] = sorted(commits) == sorted(accepted)
    print(json.dumps(told))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
