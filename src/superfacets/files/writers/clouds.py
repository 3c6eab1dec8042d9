"""Write point clouds with one label per point as CSV."""

from __future__ import annotations

from typing import IO

from .content import Output
from .text import write_rows


def write_csv(file: IO[bytes], content: Output) -> None:
    """Write points as CSV: a header line, then one line per point with x, y, z and the label.

    If there are no labels, the property ``label`` is written if it contains integers.
    """
    cloud, labels = content.cells, content.labels
    if labels is None and content.attributes is not None:
        stored = content.attributes.vertex.get("label")
        labels = stored if stored is not None and stored.dtype.kind in "iu" else None
    more = [] if labels is None else [labels]
    file.write(b"x,y,z,label\n" if more else b"x,y,z\n")
    row = ",".join(["%.17g"] * 3 + ["%d"] * len(more)) + "\n"
    write_rows(file, row, [*cloud.points.T, *more])
