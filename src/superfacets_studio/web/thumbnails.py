"""Draw thumbnails in another process, so that a crash of a graphics driver ends no server."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from superfacets import RenderError

SECONDS = 120.0  # time limit for drawing a thumbnail, in seconds


class Thumbnails:
    """Draws thumbnails one at a time, and caches each until its file changes."""

    def __init__(self) -> None:
        self._kept: dict[Path, tuple[tuple[int, int], bytes]] = {}
        self._lock = threading.Lock()
        self._drawing: subprocess.Popen[str] | None = None
        self._is_closed = False

    def png(self, path: Path, up: str = "auto") -> bytes:
        """Return the thumbnail of a file as PNG; raise RenderError or OSError if this fails."""
        status = path.stat()
        stamp = (status.st_mtime_ns, status.st_size)
        with self._lock:
            kept = self._kept.get(path)
            if kept is None or kept[0] != stamp:
                kept = self._kept[path] = (stamp, self._drawn(path, up))
        return kept[1]

    def close(self) -> None:
        """Kill the drawing process, and prevent new ones; waiting threads get a RenderError."""
        self._is_closed = True
        drawing = self._drawing
        if drawing is not None:
            drawing.kill()

    def _drawn(self, path: Path, up: str) -> bytes:
        with tempfile.TemporaryDirectory(prefix="superfacets-") as folder:
            target = Path(folder, "picture.png")
            # Without -P, Python could import modules from the current folder.
            render = [sys.executable, "-P", "-m", "superfacets", "render", str(path.absolute())]
            status, errors = self._run(
                [*render, "--up", up, "--size", "320x240", "-o", str(target)]
            )
            if status or not target.exists():
                lines = errors.strip().splitlines()
                raise RenderError(lines[-1] if lines else f"drawing failed with status {status}")
            return target.read_bytes()

    def _run(self, command: list[str]) -> tuple[int, str]:
        """Run a command that `close` can kill; return its exit status and stderr."""
        with subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            text=True,
        ) as process:  # fmt: skip
            self._drawing = process
            if self._is_closed:  # `close` ran before the process started
                process.kill()
            try:
                _, errors = process.communicate(timeout=SECONDS)
            except subprocess.TimeoutExpired:
                process.kill()
                raise RenderError(f"drawing took more than {SECONDS:g} seconds") from None
            finally:
                self._drawing = None
        return process.returncode, errors
