"""Times as ratios: the two that are compared run by turns, so that a busy machine slows both alike."""

import statistics
import time
from collections.abc import Callable


def ratio(a: Callable[[], object], b: Callable[[], object], seconds: float = 0.5) -> float:
    """How often the time of b goes into that of a [1]: the median over rounds, each of one call of both.

    The rounds fill about `seconds`, after one that is not counted; at least 9 run, every other one in reverse order.
    """

    def timed(call: Callable[[], object]) -> float:
        begun = time.perf_counter()
        call()
        return time.perf_counter() - begun

    a(), b()
    rounds: list[float] = []
    end = time.perf_counter() + seconds
    while len(rounds) < 9 or time.perf_counter() < end:
        if len(rounds) % 2:
            of_b = timed(b)
            of_a = timed(a)
        else:
            of_a = timed(a)
            of_b = timed(b)
        rounds.append(of_a / of_b)
    return statistics.median(rounds)
