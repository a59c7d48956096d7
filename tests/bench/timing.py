"""Times as ratios: the two that are compared run by turns, so that a busy machine slows both alike."""

import statistics
import time
from collections.abc import Callable

SLOW = 15.0


def ratio(a: Callable[[], object], b: Callable[[], object], seconds: float = 0.5) -> float:
    """How often the processor time of b goes into that of a [1], by the median of each.

    Of one thread it is the time that passes, but for what others take of the machine meanwhile. The rounds, each of one
    call of both, fill about `seconds`, after one that is not counted, every other one in reverse order. At least 9 run,
    or as many as `SLOW` seconds hold, but 3.
    """

    def timed(call: Callable[[], object]) -> float:
        begun = time.process_time()
        call()
        return time.process_time() - begun

    a(), b()
    of_a: list[float] = []
    of_b: list[float] = []
    end = time.perf_counter() + seconds
    while len(of_a) < 3 or time.perf_counter() < (end if len(of_a) >= 9 else end + SLOW):
        turns = [(a, of_a), (b, of_b)]
        for call, times in turns if len(of_a) % 2 else reversed(turns):
            times.append(timed(call))
    return statistics.median(of_a) / statistics.median(of_b)
