"""The exact solution of small quadratics in boxes and triangles, against scipy's bounded least squares and a grid."""

import numpy as np
import pytest
import scipy.optimize
import torch

from brdfcore.fitting.solve import Block, Faces, solve_box, solve_definite, solve_faces


def design(rng: np.random.Generator, count: int, alike: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A random least-squares problem, its columns made alike by that much of a common one, some solutions negative."""
    columns = rng.standard_normal((30, count)) + alike * rng.standard_normal((30, 1))
    return columns, columns @ rng.uniform(-1, 2, count) + rng.standard_normal(30)


def quadratics(problems: list[tuple[np.ndarray, np.ndarray]]) -> tuple[torch.Tensor, torch.Tensor]:
    gram = torch.stack([torch.from_numpy(a.T @ a) for a, _ in problems]).unsqueeze(1)
    right = torch.stack([torch.from_numpy(a.T @ y) for a, y in problems]).unsqueeze(1)
    return gram, right


def singles(count: int, low: float, high: float) -> Faces:
    ends = torch.tensor([low, high], dtype=torch.float64)
    return Faces.of(tuple(Block((i,), ends[:1], ends[1:]) for i in range(count)))


@pytest.mark.parametrize("alike", [0.0, 10.0])
@pytest.mark.parametrize("high", [np.inf, 1.0])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_faces_are_scipys_bounded_least_squares(count: int, high: float, alike: float) -> None:
    rng = np.random.default_rng(count)
    problems = [design(rng, count, alike) for _ in range(40)]
    z, directions = solve_faces(singles(count, 0.0, high), *quadratics(problems))
    touched = 0
    for (a, y), found, d in zip(problems, z[:, 0].numpy(), directions[:, 0].numpy(), strict=True):
        best = scipy.optimize.lsq_linear(a, y, (0, high), method="bvls", tol=1e-14)
        ours = float(np.square(a @ found - y).sum())
        assert ours <= 2 * best.cost * (1 + 1e-9)
        assert found.min() >= 0
        assert found.max() <= high
        touched += int((found == high).any())
        free = (found > 0) & (found < high)
        assert np.array_equal(np.diag(d) != 0, free)
    assert touched > 3 or high == np.inf


@pytest.mark.parametrize("count", [3, 8, 20])
def test_boxes_are_scipys_bounded_least_squares(count: int) -> None:
    rng = np.random.default_rng(count)
    problems = [design(rng, count, 3.0) for _ in range(20)]
    gram, right = (part[:, 0] for part in quadratics(problems))
    low, high = torch.zeros(count, dtype=torch.float64), torch.full((count,), 0.7, dtype=torch.float64)
    z, free = solve_box(gram, right, low, high)
    for (a, y), found in zip(problems, z.numpy(), strict=True):
        best = scipy.optimize.lsq_linear(a, y, (0, 0.7), method="bvls", tol=1e-14)
        assert float(np.square(a @ found - y).sum()) <= 2 * best.cost * (1 + 1e-9)
    assert torch.equal(free, (z > 0) & (z < 0.7))


def test_a_triangle_is_solved_on_each_of_its_sides_and_corners() -> None:
    """Against the least value on a grid over the triangle; every one of its seven faces is met."""
    rng = np.random.default_rng(0)
    faces = Faces.of((Block((0, 1), torch.zeros(1).double(), torch.ones(1).double()),))
    a = np.array([[1.0, 0.4], [0.0, 1.0]])
    targets = rng.uniform(-1.5, 2.0, (200, 2))
    z, directions = solve_faces(faces, *quadratics([(a, a @ t) for t in targets]))
    u, v = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    grid = np.stack([u, v], -1)[u + v <= 1 + 1e-12]
    for t, found in zip(targets, z[:, 0].numpy(), strict=True):
        value = np.square(a @ (found - t)).sum()
        assert value <= np.square((grid - t) @ a.T).sum(-1).min() + 1e-12
        assert found.min() >= 0
        assert found.sum() <= 1 + 1e-12
    corners = {tuple(np.round(found, 12)) for found in z[:, 0].numpy()}
    assert {(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)} <= corners
    assert len({tuple(d.reshape(-1)) for d in directions[:, 0].numpy()}) == 5  # inside, three sides, a corner


def test_equal_columns_share_and_empty_ones_stay_at_0() -> None:
    gram = torch.tensor([[[[4.0, 4.0, 0.0], [4.0, 4.0, 0.0], [0.0, 0.0, 0.0]]]], dtype=torch.float64)
    right = torch.tensor([[[2.0, 2.0, 0.0]]], dtype=torch.float64)
    z, _ = solve_faces(singles(3, 0.0, 1.0), gram, right)
    assert float(z[0, 0, :2].sum()) == pytest.approx(0.5, rel=1e-9)
    assert float(z[0, 0, 2]) == 0
    box, _ = solve_box(gram[0], right[0], torch.zeros(3).double(), torch.ones(3).double())
    assert float(box[0, :2].sum()) == pytest.approx(0.5, rel=1e-9)


def test_definite_systems_are_solved() -> None:
    rng = np.random.default_rng(1)
    a = torch.from_numpy(rng.standard_normal((50, 5, 9))) * torch.tensor([1e-4, 1, 1e3, 1e-2, 10])[:, None]
    gram = a @ a.mT
    scale = gram.diagonal(dim1=-2, dim2=-1).sqrt()
    true = torch.from_numpy(rng.standard_normal((50, 5))) / scale
    z = solve_definite(gram, (gram @ true.unsqueeze(-1)).squeeze(-1))
    torch.testing.assert_close(z * scale, true * scale, rtol=1e-7, atol=1e-9)  # the ridge times the condition number
