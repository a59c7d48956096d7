"""What the fork server imports before it forks, so that no attempt has to: the work, and what torch loads late.

Torch's first forward derivative imports 800 modules, which takes longer than a small fit. Only the fork server needs
them this early. No backward pass here: on a machine with a GPU it would start threads, and a fork loses threads.
"""

import atexit
import os

import torch

from . import work

__all__ = ["work"]

atexit.register(os._exit, 0)  # the fork server ends with its server at once; taking torch down takes a second
torch.func.jacfwd(lambda x: (2 * x).sum())(torch.zeros(1))
