"""Fits of a real 31-channel measurement against the best that scipy's least_squares finds from 16 random starts."""

import pathlib

import numpy as np
import pytest
import scipy.optimize
import scipy.sparse
import torch

import brdfcore as bc
from brdfcore.fitting.losses import LOSSES
from brdfcore.fitting.plan import plan
from brdfcore.fitting.problem import Problem

MODELS = {
    "ward_bounded": "lambert + ward_bounded",
    "kurt": "lambert + kurt",
    "ashikhmin_shirley": "ashikhmin_shirley + ashikhmin_shirley_diffuse(f0=ashikhmin_shirley.f0)",
}


def best_of_scipy(samples: bc.Samples, text: str, starts: int) -> float:
    """The lowest sum of squares of trust-region-reflective fits in the same box, with exact derivatives."""
    made = plan(samples.values.shape[1], text, azimuth_observed=samples.azimuth_observed)
    problem = Problem(made, samples, LOSSES["cosine"])
    count, channels = samples.values.shape
    rows = np.arange(count * channels).reshape(count, channels, 1).repeat(len(problem.keys), axis=2)
    columns = np.broadcast_to(problem.index.numpy(), rows.shape)

    def residuals(x: np.ndarray) -> np.ndarray:
        f = problem.f(torch.from_numpy(x).unsqueeze(0), problem.data)
        return problem.residuals(f, problem.data, None)[1][0].T.reshape(-1).numpy()

    def jacobian(x: np.ndarray) -> np.ndarray:
        values = problem.jacobian(torch.from_numpy(x).unsqueeze(0), problem.data)[1][0].permute(2, 0, 1).numpy()
        shape = (count * channels, problem.size)
        return scipy.sparse.csr_matrix((values.reshape(-1), (rows.reshape(-1), columns.reshape(-1))), shape).toarray()

    low, high = problem.low.numpy(), problem.high.numpy()
    random = np.random.default_rng(0)
    found = []
    for _ in range(starts):
        start = problem.pack(made.start).numpy()
        for key, at in problem.slices.items():
            parameter = made.form.parameters[key]
            ends = parameter.to_raw(torch.tensor(parameter.search_range, dtype=torch.float64)).numpy()
            start[at] = random.uniform(ends[0], ends[1], start[at].shape)
        start = np.clip(start, low + 1e-6, high - 1e-6)
        fit = scipy.optimize.least_squares(residuals, start, jacobian, (low, high), x_scale="jac", max_nfev=150)
        found.append(2 * fit.cost)
    return min(found)


def compare(measured: pathlib.Path, name: str, starts: int) -> None:
    samples = bc.read(measured / "cornell" / "garnet_red.brdf")
    ours = bc.fit(samples, MODELS[name])
    theirs = best_of_scipy(samples, MODELS[name], starts)
    print(
        f"{name}: ours {ours.objective:.8g}, scipy's best of {starts} {theirs:.8g}, ratio {ours.objective / theirs:.6f}"
    )
    assert ours.status == "converged"
    assert ours.objective <= 1.001 * theirs


@pytest.mark.parametrize("name", ["ashikhmin_shirley"])
def test_garnet_red_is_as_good_as_scipys_best(measured: pathlib.Path, name: str) -> None:
    compare(measured, name, starts=2)


@pytest.mark.full
@pytest.mark.parametrize("name", MODELS)
def test_garnet_red_is_as_good_as_scipys_best_of_16(measured: pathlib.Path, name: str) -> None:
    compare(measured, name, starts=16)
