"""Write vertex labels of brain cortex meshes as GIFTI or FreeSurfer annotation files."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import IO
from xml.sax.saxutils import escape

import numpy as np

from superfacets.kit import Array, Bytes

from .cortex import STRUCTURE

_UNKNOWN = (25, 5, 25)
"""Color of vertices in no region, as in FreeSurfer."""

_MOST_ROWS = 1 << 16
"""Maximum number of rows if unused labels have rows, too. Writing these rows takes 0.3 s."""

_GIFTI = """\
<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE GIFTI SYSTEM "http://www.nitrc.org/frs/download.php/115/gifti.dtd">
<GIFTI Version="1.0" NumberOfDataArrays="1">
<MetaData>{structure}</MetaData>
<LabelTable>
{table}
</LabelTable>
<DataArray Intent="NIFTI_INTENT_LABEL" DataType="NIFTI_TYPE_INT32" \
ArrayIndexingOrder="RowMajorOrder" Dimensionality="1" Dim0="{n}" \
Encoding="GZipBase64Binary" Endian="LittleEndian" ExternalFileName="" ExternalFileOffset="">
<MetaData/>
<Data>{data}</Data>
</DataArray>
</GIFTI>
"""


def write_cortex(
    file: IO[bytes], ending: str, labels: Array, colors: Bytes, *,
    comments: Sequence[str] = (), names: Mapping[int, str] = MappingProxyType({}),
) -> None:  # fmt: skip
    """Write the label of each vertex, or -1 for no region, as ``.label.gii`` or ``.annot``.

    `colors`, (K, 3), has the color of each region, in ascending order of the labels; fewer colors
    are repeated. `names` has the name of each label, by default ``region_LABEL``. GIFTI stores the
    anatomical structure of the surface, if one of the `comments` has it.
    """
    regions = np.unique(labels[labels >= 0])
    colors = colors[np.arange(len(regions)) % len(colors)]
    if ending == ".label.gii":
        _write_gifti(file, labels, regions, colors, comments, names)
    else:
        _write_annot(file, labels, regions, colors, names)


def _write_gifti(
    file: IO[bytes], labels: Array, regions: Array, colors: Bytes, comments: Sequence[str],
    names: Mapping[int, str],
) -> None:  # fmt: skip
    """Write GIFTI. The key of a region is its label + 1. Key 0, named ``???``, means no region."""
    row = '<Label Key="{}" Red="{:.6g}" Green="{:.6g}" Blue="{:.6g}" Alpha="{}">{}</Label>'
    rows = [row.format(0, 1, 1, 1, 0, "???")]
    for region, color in zip(regions.tolist(), (colors / 255).tolist(), strict=True):
        name = escape(names.get(region, f"region_{region}"))
        rows.append(row.format(region + 1, *color, 1, name))
    data = base64.b64encode(zlib.compress((labels.astype("<i4") + 1).tobytes())).decode("ascii")
    pair = "<MD><Name>AnatomicalStructurePrimary</Name><Value>{}</Value></MD>"
    found = [line.removeprefix(STRUCTURE) for line in comments if line.startswith(STRUCTURE)]
    stored = "".join(pair.format(escape(name)) for name in found[:1])
    text = _GIFTI.format(table="\n".join(rows), n=len(labels), data=data, structure=stored)
    file.write(text.encode("ascii", "xmlcharrefreplace"))


def _write_annot(
    file: IO[bytes], labels: Array, regions: Array, colors: Bytes, names: Mapping[int, str]
) -> None:
    """Write an annotation file. Row 0 of its color table is no region, row i + 1 is region i."""
    # nibabel reads names without row numbers, so unused labels have rows, too.
    highest = int(labels.max())
    rows = np.arange(highest + 1) if highest < _MOST_ROWS else regions
    colors = colors[np.searchsorted(regions, rows) % max(len(colors), 1)]
    # The colors of regions must differ, because the file stores the region of a vertex as a color.
    table = np.array([_UNKNOWN, *_distinct(colors)], np.int64)
    packed = table @ [1, 1 << 8, 1 << 16]
    places = np.where(labels < 0, 0, np.searchsorted(rows, labels) + 1)
    pairs = np.stack([np.arange(len(labels)), packed[places]], axis=1)
    file.write(_integers(len(labels)) + pairs.astype(">i4").tobytes())
    file.write(_integers(1, -2, highest + 2) + _text("superfacets") + _integers(len(table)))
    for row, color in zip((-1, *rows.tolist()), table.tolist(), strict=True):
        name = "unknown" if row < 0 else names.get(row, f"region_{row}")
        file.write(_integers(row + 1) + _text(name) + _integers(*color, 0))


def _distinct(colors: Bytes) -> Iterator[tuple[int, ...]]:
    """Yield each color, with changed low bits if it is black, `_UNKNOWN` or already in use."""
    taken, tried = {_UNKNOWN, (0, 0, 0)}, dict[tuple[int, ...], int]()
    for color in map(tuple, colors.tolist()):
        changed = color
        while changed in taken:
            tried[color] = tried.get(color, 0) + 1
            changed = tuple(
                channel ^ sum((tried[color] >> 3 * bit + place & 1) << bit for bit in range(8))
                for place, channel in enumerate(color)
            )
        taken.add(changed)
        yield changed


def _integers(*numbers: int) -> bytes:
    return np.array(numbers, ">i4").tobytes()


def _text(text: str) -> bytes:
    content = text.encode() + b"\0"
    return _integers(len(content)) + content
