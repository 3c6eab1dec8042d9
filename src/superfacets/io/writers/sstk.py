"""Indexed segmentations of the Scene Toolkit (SSTK), the labeling tool of ScanNet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO

import numpy as np
import numpy.typing as npt

from .text import write_list

__all__ = ["write_sstk"]


def write_sstk(file: IO[bytes], levels: Sequence[npt.NDArray[np.integer]]) -> None:
    """Write the region of each triangle, on each level, the finest first.

    The tool finds the segmentations of a hierarchy by name, and takes its levels from fine to
    coarse. Negative numbers are in no segment.
    """
    file.write(b'{"elementType":"triangles","elementCount":%d,"segmentation":[' % len(levels[0]))
    for level, labels in enumerate(levels):
        file.write(b"," if level else b"")
        file.write(b'{"name":"level%d","elementType":"triangles","index":' % level)
        write_list(file, labels)
        file.write(b"}")
    names = ",".join(f'"level{level}"' for level in range(len(levels)))
    file.write(f'],"hierarchies":[{{"levels":[{names}]}}]}}'.encode("ascii"))
