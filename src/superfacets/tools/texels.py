"""Mean colors of the texels in triangles, and images of the ids of triangles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .. import _core
from ..base.types import Bytes, Floats, Ints


@dataclass(frozen=True)
class Texels:
    """Grid of the texels of an image, and how the image continues outside of [0, 1].

    Apps use it for the colors under faces, and for images of regions in the layout of a texture.
    Each row of `corners`, (n, 3), has the indices in `coordinates`, (T, 2), of one triangle.
    """

    WRAPS: ClassVar[tuple[str, ...]] = ("repeat", "clamp", "mirror")
    """Wrap modes. The C++ core uses indices of this tuple."""

    width: int
    height: int
    wrap: tuple[str, str]  # wrap modes of u and v

    def colors(
        self, pixels: Bytes, linear: Ints, coordinates: Floats, corners: Ints, n_threads: int
    ) -> tuple[Floats, Floats]:
        """Return mean, (n, 3), and standard deviation, (n,), of the texels in each triangle.

        The table `linear`, (256,), converts `pixels`, (height, width, 3), to linear light. Both
        results are NaN if a corner is -1, or if a coordinate is not finite or too large.
        """
        if pixels.shape != (shape := (self.height, self.width, 3)):
            raise ValueError(f"pixels must have shape {shape}, got {pixels.shape}")
        size = self.width, self.height
        where = _flat(coordinates, corners)
        return _core.texel_colors(
            pixels.reshape(-1), *size, *self._codes, linear, *where, n_threads
        )

    def painted(
        self, ids: Ints, coordinates: Floats, corners: Ints, bleed: int, n_threads: int
    ) -> Ints:
        """Return an image, (height, width), of the id of the triangle at each texel; -1 for none.

        Ids, (n,), extend beyond the triangles by `bleed` texels.
        """
        if ids.shape != corners.shape[:1]:
            raise ValueError(f"ids must have shape ({len(corners)},), got {ids.shape}")
        size = self.width, self.height
        where = _flat(coordinates, corners)
        painted = _core.paint_ids(*size, *self._codes, *where, ids, bleed, n_threads)
        return painted.reshape(self.height, self.width)

    @property
    def _codes(self) -> tuple[int, int]:
        return self.WRAPS.index(self.wrap[0]), self.WRAPS.index(self.wrap[1])


def _flat(coordinates: Floats, corners: Ints) -> tuple[Floats, Ints]:
    if corners.max(initial=-1) >= len(coordinates):
        raise ValueError(f"corners must be below {len(coordinates)}, got {corners.max()}")
    return coordinates.reshape(-1), corners.reshape(-1)
