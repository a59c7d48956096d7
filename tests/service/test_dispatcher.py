"""The dispatcher with real processes: what attempts say reaches the store, and no process stays behind."""

import contextlib
import json
import logging
import os
import pathlib
import sys
import threading
import time
import types
from collections.abc import Iterator

import pytest
import service_attempts as attempts
from service_cases import measured_diffuser
from service_process import until

from service.jobs.dispatcher import Dispatcher
from service.jobs.records import Attempt, Job
from service.jobs.runner import Event, LocalRunner, Runner, Work
from service.jobs.store import JobStore


@pytest.fixture
def store(tmp_path: pathlib.Path) -> Iterator[JobStore]:
    store = JobStore(tmp_path / "jobs.sqlite3")
    yield store
    store.close()


@contextlib.contextmanager
def dispatching(
    store: JobStore, folder: pathlib.Path, work: Work | Runner, *, workers: int = 2, seconds: float = 60.0
) -> Iterator[Dispatcher]:
    runner = LocalRunner(folder, 2**33, target=work) if callable(work) else work
    dispatcher = Dispatcher(store, runner, folder / "lock", workers=workers, fit_seconds=seconds)
    dispatcher.start()
    try:
        yield dispatcher
    finally:
        dispatcher.stop()
        assert not dispatcher.alive


def ended(store: JobStore, job: Job) -> Job:
    """The job once it has ended."""
    until(lambda: current(store, job).status not in ("queued", "running"))
    return current(store, job)


def current(store: JobStore, job: Job) -> Job:
    found = store.get(job.id)
    assert found is not None
    return found


def gone(pid: int) -> bool:
    return not pathlib.Path(f"/proc/{pid}").exists()


def pid_of(folder: pathlib.Path) -> int:
    """The process of the attempt that hangs."""
    path = folder / "pid"
    until(lambda: path.exists() and path.read_text())
    return int(path.read_text())


def test_results_and_progress_reach_the_store(store: JobStore, tmp_path: pathlib.Path) -> None:
    with dispatching(store, tmp_path, attempts.answers) as dispatcher:
        job = store.submit("{}", b'"abc"')
        dispatcher.wake()
        done = ended(store, job)
    assert (done.status, done.result, done.attempts) == ("succeeded", '"ABC"', 1)
    assert done.progress == '{"stage": "fit", "fraction": 0.5, "loss": null}'


def test_a_refusal_fails_the_job_at_once(store: JobStore, tmp_path: pathlib.Path) -> None:
    with dispatching(store, tmp_path, attempts.refuses):
        failed = ended(store, store.submit("{}", b""))
    assert (failed.status, failed.error, failed.attempts) == ("failed", "Expected something else.", 1)


def test_a_child_that_dies_is_retried(
    store: JobStore, tmp_path: pathlib.Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING, "service.jobs"), dispatching(store, tmp_path, attempts.dies_once):
        done = ended(store, store.submit("{}", b""))
    assert (done.status, done.attempts, done.error) == ("succeeded", 2, None)
    assert "exit code 7" in caplog.text


def test_a_child_that_keeps_crashing_fails_in_words(store: JobStore, tmp_path: pathlib.Path) -> None:
    with dispatching(store, tmp_path, attempts.faults):
        failed = ended(store, store.submit("{}", b""))
    assert (failed.status, failed.attempts) == ("failed", 3)
    assert (failed.error or "").startswith("The job ended with exit code -11 in each of 3 attempts.")


def test_a_child_that_is_killed_is_tried_again_after_a_pause(tmp_path: pathlib.Path) -> None:
    store = JobStore(tmp_path / "jobs.sqlite3", lease=3600.0, clock=lambda: 50 * time.time())
    with dispatching(store, tmp_path, attempts.killed_three_times):
        done = ended(store, store.submit("{}", b""))
    store.close()
    assert (done.status, done.attempts, done.error) == ("succeeded", 4, None)
    assert (done.finished or 0) - (done.started or 0) >= 0.5 + 1 + 2


def test_an_oversize_fit_fails_alone(store: JobStore, tmp_path: pathlib.Path) -> None:
    body = json.dumps({"samples": measured_diffuser(), "model": "lambert"}).encode()
    with dispatching(store, tmp_path, attempts.asks_for_too_much):
        failed = ended(store, store.submit("{}", body))
    assert (failed.status, failed.attempts) == ("failed", 1)
    assert failed.error == (
        "Expected the job to need less than 8589934592 bytes, but it asked for more. "
        "Try fewer samples, fewer axes or a simpler model."
    )


def test_an_internal_error_fails_the_job_and_is_logged(store: JobStore, tmp_path: pathlib.Path) -> None:
    body = json.dumps({"samples": measured_diffuser(), "model": "lambert"}).encode()
    with dispatching(store, tmp_path, attempts.trips):
        failed = ended(store, store.submit("{}", body))
    assert (failed.status, failed.attempts) == ("failed", 1)
    assert failed.error == "The job stopped with an internal error, IndexError. The server's log has the details."
    assert "IndexError: list index out of range" in (tmp_path / "log").read_text()


@pytest.mark.parametrize("end", ["cancel", "delete"])
def test_a_job_that_is_taken_away_ends_its_process(store: JobStore, tmp_path: pathlib.Path, end: str) -> None:
    with dispatching(store, tmp_path, attempts.hangs):
        job = store.submit("{}", b"")
        pid = pid_of(tmp_path)
        getattr(store, end)(job.id)
        until(lambda: gone(pid), seconds=1.0)
    left = store.get(job.id)
    assert left is None if end == "delete" else left is not None and left.status == "cancelled"


def test_a_fit_beyond_its_time_fails(store: JobStore, tmp_path: pathlib.Path) -> None:
    with dispatching(store, tmp_path, attempts.hangs, seconds=0.5):
        failed = ended(store, store.submit("{}", b""))
        assert gone(pid_of(tmp_path))
    assert failed.status == "failed"
    assert failed.error == (
        "Expected the job to end within 0.5 s, but it did not. Try fewer samples, fewer axes or a simpler model."
    )


def test_stopping_ends_the_processes_and_keeps_the_jobs(store: JobStore, tmp_path: pathlib.Path) -> None:
    begun = 0.0
    with dispatching(store, tmp_path, attempts.hangs, workers=1):
        jobs = [store.submit("{}", b"") for _ in range(2)]
        pid = pid_of(tmp_path)
        begun = time.monotonic()
    assert time.monotonic() - begun < 2.0
    assert gone(pid)
    assert [current(store, job).status for job in jobs] == ["queued", "queued"]


def test_no_more_attempts_run_than_there_are_workers(store: JobStore, tmp_path: pathlib.Path) -> None:
    with dispatching(store, tmp_path, attempts.hangs, workers=1):
        first, second = (store.submit("{}", b"") for _ in range(2))
        pid_of(tmp_path)
        assert store.running() == {first.id: 1}
        store.cancel(first.id)
        until(lambda: store.running() == {second.id: 1})


def test_what_a_killed_server_left_running_is_run_again(store: JobStore, tmp_path: pathlib.Path) -> None:
    job = store.submit("{}", b'"abc"')
    assert store.claim()  # by a server that is no more; its lease has most of its time to go
    with dispatching(store, tmp_path, attempts.answers):
        done = ended(store, job)
    assert (done.status, done.attempts) == ("succeeded", 2)


def test_a_second_dispatcher_stands_by_until_the_lock_is_free(store: JobStore, tmp_path: pathlib.Path) -> None:
    with contextlib.ExitStack() as first:
        first.enter_context(dispatching(store, tmp_path, attempts.hangs))
        job = store.submit("{}", b"{}")
        pid_of(tmp_path)
        with dispatching(store, tmp_path, attempts.answers):
            waiting = store.submit("{}", b"{}")
            until(lambda: store.running() == {job.id: 1, waiting.id: 1})  # the first has two workers
            first.close()
            assert [ended(store, j).status for j in (job, waiting)] == ["succeeded", "succeeded"]


def test_children_do_not_run_the_main_script_again(
    store: JobStore, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = tmp_path / "script.py"
    script.write_text(f"import pathlib\npathlib.Path({str(tmp_path / 'ran')!r}).touch()\n")
    main = types.ModuleType("__main__")
    main.__file__ = str(script)
    monkeypatch.setitem(sys.modules, "__main__", main)
    with dispatching(store, tmp_path, attempts.answers):
        assert ended(store, store.submit("{}", b"{}")).status == "succeeded"
    assert not (tmp_path / "ran").exists()
    assert main.__spec__ is None


class Scripted:
    """A runner that says what it is told to."""

    def __init__(self, events: list[str], *, starts: bool = True) -> None:
        self.events, self.starts = events, starts
        self.attempt: Attempt | None = None
        self.killed: list[Attempt] = []

    def ready(self) -> bool:
        return True

    def start(self, attempt: Attempt) -> None:
        if not self.starts:
            self.starts = True
            raise OSError("no more processes")
        self.attempt = attempt

    def poll(self, seconds: float) -> list[Event]:
        time.sleep(0.01)
        if self.attempt is None or not self.events:
            return []
        return [Event(self.attempt, self.events.pop(0), "{}")]  # type: ignore[arg-type]

    def kill(self, attempt: Attempt) -> None:
        self.killed.append(attempt)


def test_nothing_is_claimed_before_the_runner_is_ready(
    store: JobStore, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ready: list[bool] = []
    monkeypatch.setattr(Scripted, "ready", lambda self: bool(ready))
    with dispatching(store, tmp_path, Scripted(["succeeded"])):
        job = store.submit("{}", b"")
        time.sleep(0.2)
        assert current(store, job).status == "queued"
        ready.append(True)
        assert ended(store, job).status == "succeeded"


def test_an_attempt_that_cannot_start_is_retried(store: JobStore, tmp_path: pathlib.Path) -> None:
    with dispatching(store, tmp_path, Scripted(["succeeded"], starts=False)):
        done = ended(store, store.submit("{}", b""))
    assert (done.status, done.attempts) == ("succeeded", 2)


def test_a_result_outlives_a_store_that_cannot_write(
    store: JobStore, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = []
    succeed = store.succeed

    def full_disk(attempt: Attempt, result: str) -> bool:
        if not refused:
            refused.append(attempt)
            raise OSError("database or disk is full")
        return succeed(attempt, result)

    monkeypatch.setattr(store, "succeed", full_disk)
    with dispatching(store, tmp_path, Scripted(["progress", "succeeded"])):
        done = ended(store, store.submit("{}", b""))
    assert refused
    assert (done.status, done.attempts) == ("succeeded", 1)


def test_a_stopped_worker_that_wakes_after_its_lease_is_refused(tmp_path: pathlib.Path) -> None:
    store = JobStore(tmp_path / "jobs.sqlite3", lease=0.5)
    woken = threading.Event()

    class Stopped(Scripted):
        def poll(self, seconds: float) -> list[Event]:
            woken.wait(10)
            return super().poll(seconds)

    (tmp_path / "other").mkdir()  # a lock of its own: a dispatcher of another machine, say
    with dispatching(store, tmp_path, Stopped(["succeeded"])):
        job = store.submit("{}", b"")
        until(lambda: store.running().get(job.id) == 1)  # by the one that then sleeps
        with dispatching(store, tmp_path / "other", Scripted([])):
            until(lambda: store.running().get(job.id) == 2)
            woken.set()
            time.sleep(0.3)
            assert current(store, job).status == "running"
    store.close()


def test_attempts_are_told_to_use_one_thread(store: JobStore, tmp_path: pathlib.Path) -> None:
    LocalRunner(tmp_path, 2**33)
    assert os.environ["OMP_NUM_THREADS"] == "1"
