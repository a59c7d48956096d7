"""Fixtures that every test may use."""

import os
import pathlib

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of numpy and scipy, who read it when they are loaded

import hypothesis
import pytest
import torch
from jaxtyping import install_import_hook

# the same examples every time, however busy the machine is
hypothesis.settings.register_profile("seeded", derandomize=True, deadline=None)
hypothesis.settings.load_profile("seeded")
torch.set_num_threads(1)  # the tests' tensors are small, and threads that wait for each other make a busy machine slow

# the shapes that annotations state are checked while tests run; to be installed before the modules are loaded
CHECKS = install_import_hook(["brdfcore.geometry", "brdfcore.models", "brdfcore.parameters"], "beartype.beartype")


def pytest_configure(config: pytest.Config) -> None:
    """Benches measure what a user runs, without the checks of shapes."""
    if config.getoption("markexpr") == "bench":
        CHECKS.uninstall()


@pytest.fixture(scope="session")
def measured() -> pathlib.Path:
    """The folder of real measurements that BRDF_MEASURED names; without it the test is skipped, except under CI."""
    folder = os.environ.get("BRDF_MEASURED")
    if folder and pathlib.Path(folder).is_dir():
        return pathlib.Path(folder)
    if os.environ.get("CI") == "true":
        pytest.fail("BRDF_MEASURED must name the folder of measurements when CI=true")
    pytest.skip("needs real measurements: set BRDF_MEASURED to their folder")


@pytest.fixture
def generator() -> torch.Generator:
    """A seeded source of random numbers."""
    return torch.Generator().manual_seed(20100629)
