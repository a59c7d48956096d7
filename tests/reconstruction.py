"""MERL-format files of the materials that the networks of Sztrajman et al. 2021 reconstruct; not measurements."""

import pathlib

import numpy as np


def merl_reconstruction(measured: pathlib.Path, name: str) -> bytes:
    """The content of a file with every bin, those with a direction below the horizon marked invalid."""
    with np.load(measured / "merl_nbrdf" / "nbrdf_merl.npz") as data:
        flat = data["weights"][list(data["names"]).index(name)]
    theta_h, theta_d, phi_d = np.meshgrid(
        ((np.arange(90) + 0.5) / 90) ** 2 * np.pi / 2,
        (np.arange(90) + 0.5) / 90 * np.pi / 2,
        (np.arange(180) + 0.5) / 180 * np.pi,
        indexing="ij",
    )
    half = np.stack([np.sin(theta_h), 0 * theta_h, np.cos(theta_h)], -1)
    difference = np.stack([np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)], -1)
    x, at = np.concatenate([half, difference], -1).reshape(-1, 6), 0
    for rows, columns in ((6, 21), (21, 21), (21, 3)):
        kernel, bias = flat[at : at + rows * columns], flat[at + rows * columns :][:columns]
        at += (rows + 1) * columns
        x = x @ kernel.reshape(rows, columns) + bias
        x = np.maximum(x, 0) if columns == 21 else np.maximum(np.exp(x) - 1, 0)
    incident = np.cos(theta_h) * np.cos(theta_d) - np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
    outgoing = 2 * np.cos(theta_d) * np.cos(theta_h) - incident
    x = x / (np.array([1.0, 1.15, 1.66]) / 1500)
    x[((incident <= 0) | (outgoing <= 0)).reshape(-1)] = -1
    return np.array([90, 90, 180], "<i4").tobytes() + np.ascontiguousarray(x.T, "<f8").tobytes()
