"""What the service promises of time and memory, measured on a server process; `pytest -m bench` prints it."""

import asyncio
import contextlib
import hashlib
import io
import os
import pathlib
import signal
import socket
import statistics
import threading
import time
import zipfile
from collections.abc import Callable

import numpy as np
import pytest
from service_process import server, session_ids, until, until_empty

import brdfcore as bc
from service.client import Client, ClientError

pytestmark = pytest.mark.bench
LONG = "lambert + kurt(anisotropic) + ggx + kurt + beckmann + cook_torrance + ward"
Show = Callable[[str], None]


@pytest.fixture
def show(capsys: pytest.CaptureFixture[str]) -> Show:
    """Prints a line to the terminal."""

    def line(text: str) -> None:
        with capsys.disabled():
            print(f"\n{text}", end="", flush=True)

    return line


def measurement(rows: int) -> dict[str, np.ndarray]:
    """Columns of a measurement with two lobes and noise."""
    random = np.random.default_rng(0)
    theta, phi = np.rad2deg(np.arccos(random.uniform(0.1, 1, (2, rows)))), random.uniform(0, 360, (2, rows))
    return {
        "theta_i_deg": theta[0],
        "phi_i_deg": phi[0],
        "theta_o_deg": theta[1],
        "phi_o_deg": phi[1],
        "values": random.uniform(0.05, 0.15, rows),
    }


def long_fits(client: Client, count: int) -> list[str]:
    """The ids of fits that run until they are cancelled, and run now."""
    data = measurement(2000)
    made = [client.fit(data, model=LONG, quantity="brdf", seed=seed, wait=False) for seed in range(count)]
    until(lambda: all(fit.refresh().job_status == "running" for fit in made), seconds=60)
    return [fit.id for fit in made]


async def _poll(host: str, port: int, path: str, end: float, times: list[float]) -> None:
    reader, writer = await asyncio.open_connection(host, port)
    while time.monotonic() < end:
        begun = time.perf_counter()
        writer.write(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        head = await reader.readuntil(b"\r\n\r\n")
        assert head.startswith(b"HTTP/1.1 200"), head
        length = next(line for line in head.lower().split(b"\r\n") if line.startswith(b"content-length:"))
        await reader.readexactly(int(length.split(b":")[1]))
        times.append(time.perf_counter() - begun)
    writer.close()


def polled(client: Client, path: str, seconds: float, connections: int = 50) -> list[float]:
    """How long each request for the path took [s], as many at once as there are connections."""
    times: list[float] = []
    host, port = client._http.base_url.host, client._http.base_url.port or 0

    async def run() -> None:
        end = time.monotonic() + seconds
        await asyncio.gather(*(_poll(host, port, path, end, times) for _ in range(connections)))

    asyncio.run(run())
    return times


def p99(times: list[float]) -> float:
    """The time that 99 % of the requests kept [s]."""
    return sorted(times)[int(0.99 * len(times))]


def test_polls_while_two_fits_run(tmp_path: pathlib.Path, show: Show) -> None:
    idle, busy = [], []
    with server(tmp_path / "data", workers=2) as (_, client):
        known = client.fit(measurement(50), model="lambert", quantity="brdf").id
        polled(client, f"/v1/fits/{known}", 1)
        for _ in range(3):
            idle.append(p99(polled(client, f"/v1/fits/{known}", 3)))
            running = long_fits(client, 2)
            busy.append(p99(polled(client, f"/v1/fits/{known}", 3)))
            for fit_id in running:
                client.get(fit_id).delete()
            until(lambda: not client.recent(status="running"))
    ratio = statistics.median(b / i for b, i in zip(busy, idle, strict=True))
    beside = f"{1e3 * min(idle):.0f} ms idle, {1e3 * min(busy):.0f} ms beside two fits"
    show(f"polls at 50 connections: p99 {beside}, {ratio:.2f}x")
    assert ratio <= 2.5


def test_cancelling_and_ending(tmp_path: pathlib.Path, show: Show) -> None:
    with server(tmp_path / "data", workers=2) as (process, client):
        client.fit(measurement(50), model="lambert", quantity="brdf")  # now the fork server is there
        idle = set(session_ids(process.pid))
        took = []
        for _ in range(5):
            (fit_id,) = long_fits(client, 1)
            until(lambda: set(session_ids(process.pid)) - idle)
            begun = time.monotonic()
            client.get(fit_id).cancel()
            until(lambda: not client.recent(status="running"))
            until(lambda: set(session_ids(process.pid)) <= idle)
            took.append(time.monotonic() - begun)
            client.get(fit_id).delete()
        long_fits(client, 2)
        begun = time.monotonic()
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=20)
        until_empty(process.pid, seconds=20)
        ended = time.monotonic() - begun
    show(f"from cancel to no process: {statistics.median(took):.2f} s, from SIGTERM to no process: {ended:.2f} s")
    assert statistics.median(took) < 1
    assert ended < 5


def million(path: pathlib.Path) -> None:
    """Save a million samples."""
    columns = measurement(10**6)
    rows = np.zeros(10**6, dtype=[(name.replace("values", "value"), "f8") for name in columns])
    for name, column in columns.items():
        rows[name.replace("values", "value")] = column
    np.save(path, rows)


def test_a_million_samples_are_taken_beside_other_requests(tmp_path: pathlib.Path, show: Show) -> None:
    path = tmp_path / "million.npy"
    million(path)
    stalls: list[float] = []
    ratios = []
    done = threading.Event()
    with server(tmp_path / "data") as (_, client):

        def watch() -> None:
            with Client(str(client._http.base_url)) as other:
                while not done.is_set():
                    begun = time.perf_counter()
                    other._http.get("/healthz").raise_for_status()
                    stalls.append(time.perf_counter() - begun)
                    time.sleep(0.005)

        client.fit(measurement(50), model="lambert", quantity="brdf")  # now the server has settled
        bc.read(path, quantity="brdf")
        client.upload(path, quantity="brdf")  # and both sides have read once
        watching = threading.Thread(target=watch)
        watching.start()
        for quantity in ("brdf_cos", "reflectance_factor"):  # declared otherwise, it is read anew
            begun = time.perf_counter()
            samples = bc.read(path, quantity=quantity)
            hashlib.sha256(path.read_bytes()).hexdigest()
            local = time.perf_counter() - begun
            assert len(samples) == 10**6
            del samples
            begun = time.perf_counter()
            client.upload(path, quantity=quantity)
            ratios.append((time.perf_counter() - begun) / local)
        done.set()
        watching.join()
    show(
        f"a million samples, {path.stat().st_size / 1e6:.0f} MB: {min(ratios):.2f}x the time to read and "
        f"hash the file here; /healthz took {1e3 * max(stalls):.0f} ms at most"
    )
    assert min(ratios) <= 3
    assert max(stalls) < 0.2


def test_a_server_that_reads_a_large_file_ends_too(tmp_path: pathlib.Path, show: Show) -> None:
    path = tmp_path / "million.npy"
    million(path)
    with server(tmp_path / "data") as (process, client):

        def send() -> None:
            with contextlib.suppress(ClientError):  # the server ends meanwhile
                client.upload(path, quantity="brdf")

        upload = threading.Thread(target=send)
        upload.start()
        until(lambda: any(file.stat().st_size == path.stat().st_size for file in tmp_path.glob("data/incoming/*/data")))
        begun = time.monotonic()
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=60)
        ended = time.monotonic() - begun
        upload.join()
    show(f"from SIGTERM to the end beside a file that is read: {ended:.2f} s")
    assert ended < 5


def resident(pid: int) -> int:
    """The memory of a process [bytes]."""
    return int(pathlib.Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def npz_bomb() -> bytes:
    """An archive whose 600 KB hold 600 MB of zeros."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in ("theta_i", "phi_i", "theta_o", "phi_o", "values"):
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array_header_1_0(
                    file, {"descr": "<f8", "fortran_order": False, "shape": (15 * 10**6,)}
                )
                for _ in range(120):
                    file.write(bytes(10**6))
    return out.getvalue()


def false_shape() -> bytes:
    """A file of 100 bytes whose header says that it holds 10 TiB."""
    out = io.BytesIO()
    shape = (10 * 2**40 // 40,)
    np.lib.format.write_array_header_1_0(
        out,
        {"descr": [(n, "<f8") for n in ("theta_i", "phi_i", "theta_o", "phi_o", "value")], "fortran_order": False}
        | {"shape": shape},
    )
    return out.getvalue()


def test_memory_comes_back_after_what_is_refused(tmp_path: pathlib.Path, show: Show) -> None:
    peak = 0
    with server(tmp_path / "data") as (process, client):
        http = client._http
        declared = {"quantity": "brdf", "angle_unit": "degrees"}
        assert http.post("/v1/datasets", content=b"x", params=declared).status_code == 422
        before = resident(process.pid)
        done = threading.Event()

        def watch() -> None:
            nonlocal peak
            while not done.is_set():
                peak = max(peak, resident(process.pid))
                time.sleep(0.01)

        watching = threading.Thread(target=watch)
        watching.start()
        try:
            for content in (npz_bomb(), false_shape()):
                for _ in range(3):
                    assert http.post("/v1/datasets", content=content, params=declared).status_code == 422
            for content, status in ((b"[" * 15_000_000, 422), (b'{"samples": {"values": [[' + b"1," * 7_000_000, 422)):
                headers = {"content-type": "application/json"}
                assert http.post("/v1/fits", content=content, headers=headers).status_code == status
            assert http.post("/v1/fits", content=b" " * 17 * 2**20, headers=headers).status_code == 413
            assert http.get("/v1/datasets/..%2f..%2fjobs.sqlite3").status_code == 404
            with socket.create_connection((http.base_url.host, http.base_url.port or 0)) as raw:
                refused = b"HTTP/1.1 400"
                with contextlib.suppress(ConnectionError):  # it is cut off, perhaps before the answer is read
                    raw.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\nX-Long: " + b"a" * 10_000_000 + b"\r\n\r\n")
                    refused = raw.recv(100)
            assert refused.split()[1] in (b"400", b"431")
        finally:
            done.set()
            watching.join()
        assert http.get("/healthz").status_code == 200
        after = resident(process.pid)
    said = (f"{size / 1e6:.0f} MB {when}" for size, when in ((before, "before"), (peak, "at most"), (after, "after")))
    show(f"memory at what is refused: {', '.join(said)}")
    assert after - before < 64e6
    assert peak - before < 400e6
