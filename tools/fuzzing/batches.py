"""Damaged manifests of a batch: files without a valid record are processed again."""

from __future__ import annotations

import functools
import json
import random
import tempfile
from pathlib import Path

import damage
import numpy as np
import shapes

import superfacets as sf

from .files import ODD_VALUES


def check_manifest(rng: np.random.Generator, folder: Path) -> None:
    """Check that a batch of one file succeeds with any content of its manifest."""
    source = random.Random(int(rng.integers(2**63)))
    path, out = folder / "sheet.ply", folder / "out"
    sf.write_mesh(path, shapes.bumpy_sheet(4))
    out.mkdir()
    record = json.loads(_whole_manifest())
    record["input"] = str(path)
    if source.random() < 0.5:
        record[source.choice(sorted(record))] = source.choice(ODD_VALUES)
    content = (json.dumps(record) + "\n").encode() * source.choice((1, 2))
    if source.random() < 0.5:
        content = damage.damaged(content, source)
    (out / "manifest.jsonl").write_bytes(content)
    result = sf.batch([path], out, n_segments=3, formats=["npy"])
    assert result.n_failed == 0, result.records
    if result.n_done:  # if 0, a record states that the file has been processed before
        assert len(np.load(out / "sheet.superfacets.npy")) == 32
    assert sf.batch([path], out, n_segments=3, formats=["npy"]).n_kept == 1


@functools.cache
def _whole_manifest() -> bytes:
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        folder = Path(name)
        sf.write_mesh(folder / "sheet.ply", shapes.bumpy_sheet(4))
        sf.batch([folder / "sheet.ply"], folder / "out", n_segments=3, formats=["npy"])
        return (folder / "out" / "manifest.jsonl").read_bytes()
