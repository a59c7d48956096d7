"""A small good file of every format, as bytes."""

import importlib
import io
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rgl_file import rgl_bytes

from brdfcore.formats import curet, merl

# what `read` has to be told of an example
ARGUMENTS: dict[str, dict[str, Any]] = {"npy": {"quantity": "brdf"}, "curet": {"material": 2}}

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


ALTA = """\
# made for the tests
#DIM 6 1
#PARAM_IN CARTESIAN
#PARAM_OUT INV_STERADIAN
#VS 2
# view, light, value, its interval
0.6 0 0.8 -0.6 0 0.8 12.5 12 13
0 0.6 0.8 -0.6 0 0.8 0.25 0.2 0.3
0 0 1 0 0 1 0.125 0.1 0.2
"""

ASTM = """\
TITLE "made for the tests"
NUM_POINTS 3
ANGLE_UNIT degrees
VARS theta_i,phi_i,theta_s,phi_s,bsdf
45,0,45,180,12.5
30,0,10,20,0.25
60,90,20,30,0.125
"""

NIST = """\
lambda,thetai,phi,thetar,phir,f_r11,f_r12/f_r11
0.532,-45,0,45,0,1.25,.1
0.532,-45,0,20,30,0.25,.1
0.532,-30,0,10,20,0.125,.1
0.633,-45,0,45,0,1.5,.1
0.633,-45,0,20,30,0.5,.1
0.633,-30,0,10,20,0.25,.1
"""


def alta_bytes() -> bytes:
    return ALTA.encode()


def astm_bytes() -> bytes:
    return ASTM.encode()


def nist_bytes() -> bytes:
    return NIST.encode()


def named_columns() -> dict[str, np.ndarray]:
    """A table's columns, the mirror direction first; the values are float32."""
    rows = np.array([[45, 0, 45, 180, 12.5], [30, 0, 10, 20, 0.25], [60, 90, 20, 30, 0.125]], dtype=float)
    names = ("theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg", "value")
    return {name: rows[:, k].astype("f4" if name == "value" else "f8") for k, name in enumerate(names)}


def npy_bytes() -> bytes:
    columns = named_columns()
    table = np.empty(3, dtype=[(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        table[name] = column
    stream = io.BytesIO()
    np.save(stream, table)
    return stream.getvalue()


def arrow_table() -> Any:
    pyarrow = pytest.importorskip("pyarrow")
    return pyarrow.table(named_columns()).replace_schema_metadata({"quantity": "brdf"})


def parquet_bytes() -> bytes:
    table = arrow_table()
    stream = io.BytesIO()
    importlib.import_module("pyarrow.parquet").write_table(table, stream)
    return stream.getvalue()


def arrow_bytes(kind: str = "new_file") -> bytes:
    table = arrow_table()
    ipc, stream = importlib.import_module("pyarrow.ipc"), io.BytesIO()
    with getattr(ipc, kind)(stream, table.schema) as writer:
        writer.write_table(table)
    return stream.getvalue()


def curet_files() -> tuple[bytes, bytes]:
    """abrdf.dat and table.txt: two materials, the second with a peak in the mirror direction."""
    random = np.random.default_rng(1)
    theta = random.uniform(0.1, 1.3, (2, curet.GEOMETRIES))
    phi = random.uniform(-3, 3, (2, curet.GEOMETRIES))
    theta[1, ::5], phi[1, ::5] = theta[0, ::5], phi[0, ::5] + math.pi
    table = "".join(
        f"{k + 1} {theta[1, k]:.6f} {phi[1, k]:.6f} {theta[0, k]:.6f} {phi[0, k]:.6f}\n" for k in range(theta.shape[1])
    )
    values = random.uniform(0.1, 0.2, (2, curet.GEOMETRIES))
    values[1, ::5] += 1
    rows = "".join(f"{k + 1} " + " ".join(f"{x:.3f}" for x in row) + "\n" for k, row in enumerate(values))
    return rows.encode(), table.encode()


def examples_of(folder: Path) -> dict[str, bytes]:
    """The bytes of a small good file of each format; CUReT's table is written into the folder."""
    values, table = curet_files()
    (folder / curet.TABLE).write_bytes(table)
    return {
        "csv": csv_bytes(),
        "cornell": cornell_bytes(),
        "merl": merl_bytes(),
        "npz": npz_bytes(folder),
        "npy": npy_bytes(),
        "parquet": parquet_bytes(),
        "arrow": arrow_bytes(),
        "alta": alta_bytes(),
        "astm": astm_bytes(),
        "nist": nist_bytes(),
        "curet": values,
        "rgl": rgl_bytes(),
    }
