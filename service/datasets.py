"""Uploaded measurements on disk, each in a folder named by the hash of its bytes and of what the upload declared.

    datasets/<id>/data         the file, byte for byte
    datasets/<id>/about.json   what DatasetView shows of it

A folder is filled under incoming/ and renamed once it has been read in full and is on disk, so that what is under
datasets/ is always whole.
"""

import contextlib
import hashlib
import json
import os
import re
import shutil
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from brdfcore.errors import BrdfError
from brdfcore.formats import Samples, at_most, read

from .schemas import DatasetView, DirectionPairs, FitRequest, InlineSamples

_ABANDONED = 24 * 3600.0  # no upload lasts so long, so a folder older than this is what a killed server left [s]


class Datasets:
    """The datasets of one data folder."""

    def __init__(self, folder: Path) -> None:
        self._kept, self._incoming = folder / "datasets", folder / "incoming"
        for place in (self._kept, self._incoming):
            place.mkdir(parents=True, exist_ok=True)
        for left in self._incoming.iterdir():
            if left.stat().st_mtime < time.time() - _ABANDONED:
                shutil.rmtree(left, ignore_errors=True)

    @contextlib.contextmanager
    def incoming(self) -> Iterator[Path]:
        """An empty folder for one upload, gone afterwards whatever happens."""
        folder = Path(tempfile.mkdtemp(dir=self._incoming))
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)  # after `add` has kept it there is nothing left to remove

    def add(self, folder: Path, sha256: str, declared: dict[str, Any], most: int) -> tuple[DatasetView, bool]:
        """The dataset in `folder`/data, of at most so many bytes unpacked, and whether it is new.

        Raises what `brdfcore.read` does.
        """
        name = hashlib.sha256(f"{sha256} {json.dumps(declared, sort_keys=True)}".encode()).hexdigest()
        known = self.get(name)
        if known:
            with contextlib.suppress(FileNotFoundError):
                os.utime(self._kept / name)  # who uploads it again is about to ask for it
                return known, False
        data = folder / "data"
        _check_unpacked(data, most)
        with at_most(most // 8):  # numbers: columns of equal values unpack from next to nothing
            samples = read(data, **declared)
        about = DatasetView(
            id=name,
            bytes=data.stat().st_size,
            sha256=sha256,
            declared=declared,
            created=datetime.now(UTC),
            report={**samples.report(), "source": ""},  # the name that the server gave the file tells nobody anything
        )
        (folder / "about.json").write_text(about.model_dump_json(), encoding="utf-8")
        for path in (data, folder / "about.json", folder):
            _to_disk(path)
        try:
            folder.rename(self._kept / name)
        except OSError:  # the same upload, at the same time, was first
            known = self.get(name)
            if known is None:
                raise
            return known, False
        _to_disk(self._kept)
        return about, True

    def get(self, name: str) -> DatasetView | None:
        """The dataset of that id."""
        if not re.fullmatch("[0-9a-f]{64}", name):
            return None
        try:
            return DatasetView.model_validate_json((self._kept / name / "about.json").read_bytes())
        except FileNotFoundError:
            return None

    def forget(self, before: float, asked_for: Callable[[str], bool]) -> int:
        """How many datasets were uploaded before that time [s since 1970] and no job asks for; they are removed."""
        old = [f for f in self._kept.iterdir() if f.stat().st_mtime < before and not asked_for(f.name)]
        for folder in old:
            with self.incoming() as gone:  # gone at once: what is under datasets/ is always whole
                folder.rename(gone / "data")
        return len(old)

    def files(self, name: str) -> dict[str, bytes]:
        """What is kept of a dataset, by its paths under the data folder; nothing where there is none."""
        if self.get(name) is None:
            return {}
        return {f"datasets/{name}/{file.name}": file.read_bytes() for file in (self._kept / name).iterdir()}

    def samples(self, request: FitRequest) -> Samples:
        """The samples that a fit's request means, inline or uploaded."""
        if request.samples is not None:
            return inline_samples(request.samples)
        return self.read(request.dataset or "")

    def read(self, name: str) -> Samples:
        """The samples of an uploaded dataset."""
        dataset = self.get(name)
        if dataset is None:
            raise missing(name)
        declared: dict[str, Any] = dict(dataset.declared)
        return read(self._kept / name / "data", **declared)


def missing(name: str) -> BrdfError:
    """The error for a fit whose dataset does not exist."""
    return BrdfError(
        f"Expected dataset to be the id of an uploaded dataset, got {name!r}. Upload it with POST /v1/datasets.",
        field="dataset",
    )


def inline_samples(given: InlineSamples) -> Samples:
    """The samples of a request's body; an error names its field as the body does."""
    keywords: dict[str, Any] = {
        "channels": given.channels,
        "sigma": given.sigma,
        "quantity": given.quantity,
        "weight": given.weight,
        "cell": given.cell,
        "azimuth_observed": given.azimuth_observed,
    }
    return _samples(given, torch.tensor(given.values, dtype=torch.float64), "samples", **keywords)


def directions(given: DirectionPairs) -> tuple[Tensor, Tensor]:
    """The unit vectors wi and wo (N, 3) of a request's body, both above the horizon."""
    count = len(given.wi if given.wi is not None else given.theta_i_deg or [])
    samples = _samples(given, torch.zeros(count, dtype=torch.float64), "")
    return samples.wi, samples.wo


def _samples(given: DirectionPairs, values: Tensor, field: str, **keywords: Any) -> Samples:
    try:
        if given.wi is not None and given.wo is not None:
            return Samples(given.wi, given.wo, values, **keywords)
        theta_i, phi_i = given.theta_i_deg or [], given.phi_i_deg or []
        theta_o, phi_o = given.theta_o_deg or [], given.phi_o_deg or []
        return Samples.from_angles(theta_i, phi_i, theta_o, phi_o, values, unit="degrees", **keywords)
    except BrdfError as error:
        name = error.field or ""
        if name in ("theta_i", "phi_i", "theta_o", "phi_o"):
            name += "_deg"
        error.field = ".".join(part for part in (field, name) if part)
        raise


def _check_unpacked(path: Path, most: int) -> None:
    """Refuse a small archive of much: what is no archive has been measured when it came in."""
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
        if size > most:
            raise BrdfError(
                f"Expected an archive of at most {most} bytes unpacked, got {size}. Send less, or raise the server's "
                "limit.",
                field="body",
            )


def _to_disk(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
