"""The job store: fencing, leases, caps, and claims under contention."""

import pathlib
import sqlite3
import threading
from collections.abc import Iterator

import pytest

from brdfcore.errors import InvalidValueError
from service.jobs.records import _TABLE, Attempt, Job
from service.jobs.retries import MOST_CRASHES, MOST_INTERRUPTED
from service.jobs.store import JobStore


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


@pytest.mark.parametrize("word", ["progress", "succeed", "fail", "retry", "interrupt"])
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


def current(store: JobStore, job: Job) -> Job:
    found = store.get(job.id)
    assert found is not None
    return found


def test_a_crash_is_retried_at_once_up_to_the_cap(store: JobStore) -> None:
    job = store.submit("{}", b"")
    for _ in range(MOST_CRASHES):
        assert store.retry(claimed(store), "ended with exit code 7")
    failed = current(store, job)
    assert (failed.status, failed.attempts) == ("failed", 3)
    assert failed.error == (
        "The job ended with exit code 7 in each of 3 attempts. Try fewer samples, fewer axes or a simpler model."
    )
    assert store.claim() is None


def test_an_end_from_outside_is_no_crash_and_pauses_ever_longer(store: JobStore, clock: Clock) -> None:
    job = store.submit("{}", b"")
    pauses: list[float] = []
    attempt = claimed(store)
    for _ in range(MOST_INTERRUPTED - 1):
        assert store.interrupt(attempt, "ended with exit code -9") == "queued"
        ended = clock.now
        while (again := store.claim()) is None:
            clock.now += 0.25
        attempt = again
        pauses.append(clock.now - ended)
    assert pauses == pytest.approx([0.5, 1, 2, 4, 8, 16, 32, *[60] * (MOST_INTERRUPTED - 8)], abs=0.26)
    for _ in range(MOST_CRASHES - 1):  # of these it has all its attempts left
        assert store.retry(attempt, "died") == "queued"
        attempt = claimed(store)
    assert store.interrupt(attempt, "ended with exit code -9") == "failed"
    assert (current(store, job).error or "").startswith(
        "The job was interrupted 30 times; the last attempt ended with exit code -9. Submit it again once"
    )


def test_a_job_that_pauses_lets_the_others_go_first(store: JobStore, clock: Clock) -> None:
    first, second = (store.submit("{}", b"").id for _ in range(2))
    store.interrupt(claimed(store), "was killed")
    assert claimed(store).id == second
    clock.now += 1
    assert claimed(store).id == first


def test_an_abandoned_job_is_interrupted(store: JobStore, clock: Clock) -> None:
    job = store.submit("{}", b"")
    for number in range(MOST_INTERRUPTED):
        assert claimed(store).fence == number + 1
        clock.now += 31
    assert store.claim() is None
    failed = current(store, job)
    assert failed.status == "failed"
    assert failed.error == (
        "The job was interrupted 30 times; the last attempt was abandoned by its worker. Submit it again once what "
        "computes is stable and has the memory for it."
    )


def test_restarts_are_no_crashes_and_need_no_pause(store: JobStore) -> None:
    job = store.submit("{}", b"")
    waiting = store.submit("{}", b"")
    for _ in range(MOST_INTERRUPTED - 1):
        assert claimed(store).id == job.id
        store.reclaim()
        assert current(store, job).status == "queued"
    for _ in range(MOST_CRASHES - 1):
        assert store.retry(claimed(store), "died") == "queued"
    claimed(store)
    store.reclaim()
    failed = current(store, job)
    assert failed.status == "failed"
    assert failed.error is not None
    assert failed.error.startswith("The job was interrupted 30 times; the last attempt ended with its server.")
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
    gone = store.delete(job.id)
    assert gone is not None
    assert (gone.id, gone.status) == (job.id, "running")
    assert store.delete(job.id) is None
    assert (store.get(job.id), store.body(job.id)) == (None, None)
    assert not store.succeed(attempt, "{}")


def test_a_removed_job_has_the_result_that_came_last_and_a_listed_one_has_none(store: JobStore) -> None:
    job = store.submit("{}", b"")
    assert store.succeed(claimed(store), '{"hash": "1"}')
    assert [(listed.status, listed.result) for listed in store.newest(1)] == [("succeeded", None)]
    gone = store.delete(job.id)
    assert gone is not None
    assert gone.result == '{"hash": "1"}'


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


def test_what_is_asked_often_does_not_stand_behind_the_body(store: JobStore) -> None:
    assert store._reader.execute("SELECT name FROM pragma_table_info('jobs')").fetchall()[-1] == ("body",)


def test_a_table_is_made_whole_or_not_at_all(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "jobs.sqlite3"
    with monkeypatch.context() as broken:
        broken.setattr("service.jobs.records._TABLE", f"{_TABLE}; CREATE TABLE fails (")
        with pytest.raises(sqlite3.OperationalError, match="incomplete input"):
            JobStore(path)
    JobStore(path).close()


def test_a_store_of_another_version_is_refused(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "jobs.sqlite3"
    JobStore(path).close()
    JobStore(path).close()
    with sqlite3.connect(path) as db:
        db.execute("PRAGMA user_version = 1")
    with pytest.raises(InvalidValueError, match=r"of this version of the service \(\d+\), got version 1\."):
        JobStore(path)
