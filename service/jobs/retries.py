"""When a job is tried again, after an attempt that ended without an answer: why it ended decides when and how often.

its own crash            it exits without a word, or by a fault such as SIGSEGV: tried again at once, given up after 3,
                         because what crashes by itself crashes again
an end from outside      killed, not started, lost by the cluster, its lease run out: tried again after a pause, because
                         what ended it (too little memory, a node that fails) may still be there; the pauses double from
                         0.5 s to 60 s; given up after 30, which is some 25 minutes of pauses
the end of the server    tried again at once, because by then there is a new one; counted as an end from outside, so
                         that a job which takes its server down does not do so for ever

An answer is final: a refusal, too much memory or too much time fails the job at once.
Two counts tell them apart: `interrupted` are the attempts that ended from outside, attempts - interrupted the others.
A Ray cluster does not tell a killed process from one that crashed; there both are from outside.
"""

MOST_CRASHES = 3
MOST_INTERRUPTED = 30
ASK_FOR_LESS = "Try fewer samples, fewer axes or a simpler model."

# parts of the store's changes, which see the counts as they were before this end
CRASHED_OUT = f"attempts - interrupted >= {MOST_CRASHES}"
COUNTED = "interrupted = interrupted + 1"
INTERRUPTED_OUT = f"interrupted + 1 >= {MOST_INTERRUPTED}"
PAUSE = "min(60.0, 0.5 * (1 << min(interrupted, 10)))"  # [s]


def ended(over: str) -> str:
    """The change by which a job has failed where `over` holds, and else is queued; of an error and a time."""
    return f"status = iif({over}, 'failed', 'queued'), error = iif({over}, ?, NULL), finished = iif({over}, ?, NULL)"


def crashed_out(what: str) -> str:
    """The sentence for a job whose last attempt crashed so."""
    return f"The job {what} in each of {MOST_CRASHES} attempts. {ASK_FOR_LESS}"


def interrupted_out(what: str) -> str:
    """The sentence for a job whose last attempt was interrupted so."""
    return (
        f"The job was interrupted {MOST_INTERRUPTED} times; the last attempt {what}. Submit it again once what "
        "computes is stable and has the memory for it."
    )
