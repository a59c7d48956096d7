"""A small good file of every format, as bytes."""

from pathlib import Path

import numpy as np

from brdfcore.formats import merl

CSV = """\
# quantity: brdf
# made for the tests
theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,r,g,b,sigma_r,sigma_g,sigma_b,weight
45,0,45,180,1.25,1.5,1.75,.01,.02,.03,1
30,0,10,20,0.25,0.5,0.75,.01,.02,.03,2
60,90,20,30,0.125,0.25,-0.5,.01,.02,.03,0.5
"""

CORNELL = """\
# Cornell University, Program of Computer Graphics
# num wls
2

# wls
400 410.5
# theta i, phi i, theta s, phi_s, spectral sample values
0.872665 0.000000 0.573513 0.000000 0.023025 0.013790
0.698132 0.000000 0.427512 -0.261799 0.000000 0.011102
0.698132 0.000000 0.698132 -3.141593 12.5 10.25
"""

SMALL_MERL = (6, 5, 8)


def csv_bytes() -> bytes:
    return CSV.encode()


def cornell_bytes() -> bytes:
    return CORNELL.encode()


def merl_bytes() -> bytes:
    """A MERL file of merl.SHAPE: a peak along theta_h, coloured, with -1 where a direction is below the horizon."""
    theta_h, theta_d, phi_d = merl_centres()
    values = (0.1 + np.exp(-((theta_h / 0.1) ** 2)) + 0.01 * theta_d)[None] * np.array([[1.0], [2.0], [3.0]])
    values /= np.array(merl.SCALE)[:, None]
    below = np.cos(theta_h) * np.cos(theta_d) <= np.sin(theta_h) * np.sin(theta_d) * np.abs(np.cos(phi_d))
    values[:, below] = -1.0
    return np.array(merl.SHAPE, dtype="<i4").tobytes() + values.astype("<f8").tobytes()


def merl_centres() -> list[np.ndarray]:
    """theta_h, theta_d, phi_d [rad] of every bin in the file's order."""
    h, d, p = ((np.arange(n) + 0.5) / n for n in merl.SHAPE)
    return [a.ravel() for a in np.meshgrid(h**2 * np.pi / 2, d * np.pi / 2, p * np.pi, indexing="ij")]


def npz_arrays() -> dict[str, np.ndarray]:
    """What a complete npz holds, with angles."""
    return {
        "theta_i": np.array([45.0, 30.0, 60.0]),
        "phi_i": np.array([0.0, 0.0, 90.0]),
        "theta_o": np.array([45.0, 10.0, 20.0]),
        "phi_o": np.array([180.0, 20.0, 30.0]),
        "angle_unit": np.array("degrees"),
        "quantity": np.array("brdf"),
        "values": np.array([[1.25, 1.5], [0.25, 0.5], [0.125, -0.25]]),
        "channels": np.array(["visible", "infrared"]),
        "sigma": np.full((3, 2), 0.01),
        "weight": np.array([1.0, 2.0, 0.5]),
    }


def npz_bytes(folder: Path) -> bytes:
    path = folder / "made.npz"
    np.savez(path, **npz_arrays())
    return path.read_bytes()
