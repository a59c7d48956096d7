"""The job store: fencing, leases, caps, and claims under contention."""

import pathlib
import sqlite3
import threading
from collections.abc import Iterator

import pytest

from brdfcore.errors import InvalidValueError
from service.jobs.records import Attempt
from service.jobs.store import MOST_CRASHES, MOST_RESTARTS, JobStore


class Clock:
    now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def store(tmp_path: pathlib.Path, clock: Clock) -> Iterator[JobStore]:
    store = JobStore(tmp_path / "jobs.sqlite3", lease=30.0, clock=clock)
    yield store
    store.close()


def claimed(store: JobStore) -> Attempt:
    attempt = store.claim()
    assert attempt is not None
    return attempt


def test_a_job_goes_from_queued_through_running_to_succeeded(store: JobStore, clock: Clock) -> None:
    job = store.submit('{"model": "lambert"}', b"body")
    assert (job.status, job.attempts, job.created, job.request) == ("queued", 0, 1000.0, '{"model": "lambert"}')
    clock.now += 1
    attempt = claimed(store)
    assert attempt == Attempt(job.id, 1, b"body")
    assert store.running() == {job.id: 1}
    assert store.progress(attempt, '{"fraction": 0.5}')
    clock.now += 1
    assert store.succeed(attempt, '{"x": 1}')
    done = store.get(job.id)
    assert done is not None
    assert (done.status, done.result, done.progress) == ("succeeded", '{"x": 1}', '{"fraction": 0.5}')
    assert (done.created, done.started, done.finished) == (1000.0, 1001.0, 1002.0)
    assert store.claim() is None


def test_jobs_are_claimed_in_the_order_of_their_submission(store: JobStore) -> None:
    ids = [store.submit("{}", b"").id for _ in range(3)]
    assert [claimed(store).id for _ in ids] == ids


@pytest.mark.parametrize("word", ["progress", "succeed", "fail", "retry"])
def test_a_stale_worker_is_refused(store: JobStore, clock: Clock, word: str) -> None:
    job = store.submit("{}", b"")
    stale = claimed(store)
    clock.now += 31
    fresh = claimed(store)
    assert (fresh.id, fresh.fence) == (stale.id, 2)
    assert not getattr(store, word)(stale, "late")
    assert store.running() == {job.id: 2}
    assert store.succeed(fresh, "{}")
    assert not getattr(store, word)(stale, "later")
    assert not store.succeed(fresh, '"twice"')
    done = store.get(job.id)
    assert done is not None
    assert (done.status, done.result, done.progress) == ("succeeded", "{}", None)


def test_a_renewed_lease_keeps_its_job(store: JobStore, clock: Clock) -> None:
    store.submit("{}", b"")
    attempt = claimed(store)
    clock.now += 29
    store.renew([attempt])
    clock.now += 29
    assert store.claim() is None
    clock.now += 2
    assert claimed(store).fence == 2


def test_a_stale_worker_cannot_renew(store: JobStore, clock: Clock) -> None:
    store.submit("{}", b"")
    stale = claimed(store)
    clock.now += 31
    claimed(store)
    clock.now += 29
    store.renew([stale])
    clock.now += 2
    assert claimed(store).fence == 3


def test_an_abandoned_job_fails_after_its_last_attempt(store: JobStore, clock: Clock) -> None:
    job = store.submit("{}", b"")
    for _ in range(MOST_CRASHES):
        claimed(store)
        clock.now += 31
    assert store.claim() is None
    failed = store.get(job.id)
    assert failed is not None
    assert failed.status == "failed"
    assert failed.error is not None
    assert failed.error.startswith("The job was abandoned by its worker in each of 3 attempts.")


def test_a_crash_is_retried_up_to_the_cap(store: JobStore) -> None:
    job = store.submit("{}", b"")
    for _ in range(MOST_CRASHES):
        assert store.retry(claimed(store), "ended its process with exit code -9")
    failed = store.get(job.id)
    assert failed is not None
    assert (failed.status, failed.attempts) == ("failed", 3)
    assert failed.error == (
        "The job ended its process with exit code -9 in each of 3 attempts. "
        "Try fewer samples, fewer axes or a simpler model."
    )
    assert store.claim() is None


def test_restarts_are_no_crashes_but_have_a_cap_of_their_own(store: JobStore) -> None:
    job = store.submit("{}", b"")
    waiting = store.submit("{}", b"")
    for _ in range(MOST_RESTARTS):
        assert claimed(store).id == job.id
        store.reclaim()
        again = store.get(job.id)
        assert again is not None
        assert again.status == "queued"
    for _ in range(MOST_CRASHES - 1):
        store.retry(claimed(store), "died")
        again = store.get(job.id)
        assert again is not None
        assert again.status == "queued"
    claimed(store)
    store.reclaim()
    failed = store.get(job.id)
    assert failed is not None
    assert failed.status == "failed"
    assert failed.error == ("The server stopped during each of 21 attempts. Submit the job again once it is stable.")
    assert claimed(store).id == waiting.id


def test_cancelling_ends_queued_and_running_jobs_only(store: JobStore) -> None:
    queued, running, done = (store.submit("{}", b"").id for _ in range(3))
    for expected in (queued, running, done):
        assert claimed(store).id == expected
    assert store.succeed(Attempt(done, 1, b""), "{}")
    assert store.retry(Attempt(queued, 1, b""), "died")
    for job_id in (queued, running, queued):
        cancelled = store.cancel(job_id)
        assert cancelled is not None
        assert cancelled.status == "cancelled"
    kept = store.cancel(done)
    assert kept is not None
    assert kept.status == "succeeded"
    assert not store.succeed(Attempt(running, 1, b""), "{}")
    assert store.claim() is None
    assert store.cancel("nothing") is None


def test_deleting_removes_the_job_and_its_body(store: JobStore) -> None:
    job = store.submit("{}", b"secret")
    attempt = claimed(store)
    assert store.body(job.id) == b"secret"
    assert store.delete(job.id)
    assert not store.delete(job.id)
    assert (store.get(job.id), store.body(job.id)) == (None, None)
    assert not store.succeed(attempt, "{}")


def test_the_list_is_paged_newest_first(store: JobStore) -> None:
    ids = [store.submit("{}", b"").id for _ in range(5)]
    first = store.newest(2)
    assert [job.id for job in first] == [ids[4], ids[3]]
    assert [job.id for job in store.newest(10, first[-1].number)] == [ids[2], ids[1], ids[0]]


def test_two_stores_never_claim_the_same_job(tmp_path: pathlib.Path) -> None:
    stores = [JobStore(tmp_path / "jobs.sqlite3") for _ in range(2)]
    submitted, taken = [], [[] for _ in stores]

    def submit(store: JobStore) -> None:
        submitted.extend([store.submit("{}", b"").id for _ in range(20)])

    def claim(store: JobStore, mine: list[str]) -> None:
        while attempt := store.claim():
            mine.append(attempt.id)

    for work in ([(submit, (store,)) for store in stores], [(claim, pair) for pair in zip(stores, taken, strict=True)]):
        threads = [threading.Thread(target=function, args=arguments) for function, arguments in work for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len(submitted) == 80
    assert sorted(taken[0] + taken[1]) == sorted(submitted)
    for store in stores:
        store.close()


def test_what_was_submitted_is_there_for_the_next_process(tmp_path: pathlib.Path) -> None:
    store = JobStore(tmp_path / "jobs.sqlite3")
    job = store.submit("{}", b"body")
    other = JobStore(tmp_path / "jobs.sqlite3")  # before the first is closed, as after a kill
    assert other.get(job.id) == job
    other.close()
    store.close()


def test_a_failed_write_leaves_the_store_usable(store: JobStore) -> None:
    with pytest.raises(sqlite3.IntegrityError):
        store.submit(None, b"")  # type: ignore[arg-type]
    assert store.submit("{}", b"").status == "queued"


def test_writes_are_synced_to_the_disk(store: JobStore) -> None:
    assert store._writer.execute("PRAGMA synchronous").fetchone() == (2,)
    assert store._writer.execute("PRAGMA journal_mode").fetchone() == ("wal",)


def test_what_ended_long_ago_is_forgotten(store: JobStore, clock: Clock) -> None:
    old, new, queued = (store.submit(f'{{"dataset": "{name}"}}', b"").id for name in ("aa", "bb", "cc"))
    assert store.succeed(claimed(store), "{}")
    clock.now += 100
    assert store.fail(claimed(store), "why")
    assert store.forget(clock.now - 50) == 1
    assert store.get(old) is None
    assert store.get(new) is not None
    assert store.get(queued) is not None
    assert store.forget(clock.now - 50) == 0
    assert [store.asks_for(name) for name in ("aa", "bb", "cc")] == [False, True, True]


def test_a_store_of_another_version_is_refused(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "jobs.sqlite3"
    JobStore(path).close()
    JobStore(path).close()
    with sqlite3.connect(path) as db:
        db.execute("PRAGMA user_version = 1")
    with pytest.raises(InvalidValueError, match=r"of this version of the service \(\d+\), got version 1\."):
        JobStore(path)
