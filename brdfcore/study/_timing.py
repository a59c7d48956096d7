"""Times that can be compared: interleaved repeats of every task, the median of each, one thread for all.

What else the machine does slows neighbours in time alike, so tasks take turns and their ratios are steadier than their
seconds. One thread for torch, since NumPy's own loops have one; the processor's time of one thread is the time that
passes, but for what others take of the machine meanwhile.
"""

import contextlib
import statistics
import time
from collections.abc import Callable, Iterator, Mapping

import torch

THREADS = 1


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let torch compute with one thread until the block ends."""
    before = torch.get_num_threads()
    torch.set_num_threads(THREADS)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def interleaved(tasks: Mapping[str, Callable[[], object]], repeats: int, *, warm: bool = False) -> dict[str, float]:
    """The median processor time [s] of each task over so many rounds.

    Unless they are `warm`, each runs once before, untimed.
    """
    taken: dict[str, list[float]] = {name: [] for name in tasks}
    for task in () if warm else tasks.values():
        task()
    for _ in range(repeats):
        for name, task in tasks.items():
            begun = time.process_time()
            task()
            taken[name].append(time.process_time() - begun)
    return {name: statistics.median(seconds) for name, seconds in taken.items()}
