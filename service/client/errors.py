"""What the client raises on purpose.

ClientError
|-- UnreachableError            no answer at all, or not one of this service
|-- ProblemError                the service refused, in its own sentence: .status .detail .field .errors
|-- JobFailedError              the job was accepted and has failed or was cancelled
|   `-- FitFailedError          and it was a fit
|-- JobUnfinishedError          a result was asked of a job that has none yet
|   `-- FitUnfinishedError      and it was a fit
`-- WaitError (TimeoutError)    the job was not finished in the time given
"""

from ..schemas import Problem


class ClientError(Exception):
    """Base of every error that the client raises on purpose."""


class UnreachableError(ClientError):
    """Nothing answered at the URL, or something that is no such service."""


class ProblemError(ClientError):
    """The service refused; the message is its sentence."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.detail)
        self.status, self.detail, self.field = problem.status, problem.detail, problem.field
        self.errors = problem.errors or []


class JobFailedError(ClientError):
    """The job has failed or was cancelled; the message says why."""


class FitFailedError(JobFailedError):
    """The fit has failed or was cancelled; the message says why."""


class JobUnfinishedError(ClientError):
    """The job has no result yet."""


class FitUnfinishedError(JobUnfinishedError):
    """The fit has no result yet."""


class WaitError(ClientError, TimeoutError):
    """The job did not finish in the time that was given to wait."""
