"""Write GIF and video files of a rotating mesh."""

from __future__ import annotations

import importlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from superfacets import RenderError

from .backend import import_pillow
from .scene import Picture

MOVING_ENDINGS: tuple[str, ...] = (".gif", ".mp4")

_SECONDS = 4.8  # duration of one full rotation, in seconds

# Constant rate factor of H.264, 0 (lossless) to 51 (worst quality). Thin lines need high quality.
_CRF = 18

_N_COLORS = 256


def gif_of(frames: list[Picture]) -> bytes:
    """Encode pictures as a GIF that repeats forever; all pictures share one palette."""
    image = import_pillow("Image")
    sample = np.concatenate(frames[:: max(1, len(frames) // 6)])
    palette = image.fromarray(sample).quantize(_N_COLORS, dither=image.Dither.NONE)
    reduced = [
        image.fromarray(frame).quantize(palette=palette, dither=image.Dither.NONE)
        for frame in frames
    ]
    file = io.BytesIO()
    reduced[0].save(
        file, format="GIF", save_all=True, append_images=reduced[1:], loop=0,
        duration=_milliseconds(len(frames)),
    )  # fmt: skip
    return file.getvalue()


def _milliseconds(n_frames: int) -> int:
    """Return the duration of one picture in milliseconds: at least 20, and a multiple of 10.

    GIF files store durations as multiples of 10 milliseconds.
    """
    return max(20, round(100 * _SECONDS / n_frames) * 10)


def check_video() -> Any:
    """Return the module `imageio_ffmpeg`, or raise a RenderError if it is not installed."""
    try:
        return importlib.import_module("imageio_ffmpeg")
    except ModuleNotFoundError:
        raise RenderError(
            "an .mp4 file needs imageio-ffmpeg: pip install imageio-ffmpeg, or write a .gif file"
        ) from None


def write_video(frames: list[Picture], path: Path) -> None:
    """Write pictures as an H.264 video; an odd height or width is increased by 1 pixel."""
    height, width = frames[0].shape[:2]
    margin = ((0, height % 2), (0, width % 2), (0, 0))
    writer = check_video().write_frames(
        str(path), (width + width % 2, height + height % 2), quality=None, macro_block_size=1,
        fps=1000 / _milliseconds(len(frames)), codec="libx264", ffmpeg_log_level="error",
        output_params=["-crf", str(_CRF), "-f", "mp4", "-movflags", "+faststart"],
    )  # fmt: skip
    writer.send(None)
    try:
        for frame in frames:
            writer.send(np.ascontiguousarray(np.pad(frame, margin, mode="edge")))
    finally:
        writer.close()
