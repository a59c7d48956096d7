"""What the service counts, in Prometheus's text format."""

from collections.abc import Iterator

from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily, Metric

from .jobs.store import JobStore

_SECONDS = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100, 300, 1000, 3000)
_METHODS = (
    "DELETE",
    "GET",
    "HEAD",
    "OPTIONS",
    "PATCH",
    "POST",
    "PUT",
)  # any other is "other": a client may invent them
_MOST_MODELS = 50  # further models are counted as "other": a label for every text that is sent would grow for ever


class Metrics:
    """The counts of one running app."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self._requests = Histogram(
            "brdf_request_seconds",
            "Time to answer a request [s]",
            ("method", "route", "status"),
            buckets=(0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 60),
            registry=self.registry,
        )
        self._jobs = Histogram(
            "brdf_job_seconds",
            "Time that succeeded jobs ran [s]",
            ("kind", "model"),
            buckets=_SECONDS,
            registry=self.registry,
        )
        self._failures = Counter(
            "brdf_job_failures", "Jobs that failed, by reason", ("kind", "reason"), registry=self.registry
        )
        self._models: set[str] = set()

    def watch(self, store: JobStore) -> None:
        """Show the store's jobs by status, and the depth of its queue, whenever asked."""
        self.registry.register(_Jobs(store))

    def answered(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count a request."""
        self._requests.labels(method if method in _METHODS else "other", route, str(status)).observe(seconds)

    def succeeded(self, kind: str, model: str, seconds: float) -> None:
        """Count a job that ran for so long."""
        if model not in self._models and len(self._models) >= _MOST_MODELS:
            model = "other"
        self._models.add(model)
        self._jobs.labels(kind, model).observe(seconds)

    def failed(self, kind: str, reason: str) -> None:
        """Count a job that failed."""
        self._failures.labels(kind, reason).inc()

    def text(self) -> bytes:
        """All of it."""
        return generate_latest(self.registry)


class _Jobs:
    """Gauges that are read from the store."""

    def __init__(self, store: JobStore) -> None:
        self._store = store

    def collect(self) -> Iterator[Metric]:
        """The jobs by kind and status."""
        gauge = GaugeMetricFamily("brdf_jobs", "Jobs in the store", labels=("kind", "status"))
        queued = 0
        for kind, status, count in self._store.counts():
            gauge.add_metric((kind, status), count)
            queued += count if status == "queued" else 0
        yield gauge
        yield GaugeMetricFamily("brdf_queue_depth", "Jobs that wait for a worker", value=queued)
