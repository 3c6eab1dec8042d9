"""Measure the active time and the strokes that the work on a file took."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import Any

from superfacets.kit import counted

PAUSE = 60.0  # a longer time between two steps, in seconds, is a pause
_LIMIT = 2**53  # numbers from here on are damaged; smaller ones can be added as floats


@dataclass(frozen=True)
class Effort:
    """Active time and strokes until the last step; undo and redo are steps, but no strokes."""

    seconds: float = 0.0  # sum of the times between successive steps, without pauses
    strokes: int = 0
    time: float = -_LIMIT  # time of the last step, in seconds since 1970; none without steps

    @classmethod
    def read(cls, line: dict[str, Any]) -> Effort | None:
        """Return the effort in a line of a work file, or None if it is missing or damaged."""
        numbers: list[Any] = [line.get(name) for name in ("seconds", "strokes", "time")]
        if all(type(one) in (int, float) and 0 <= one < _LIMIT for one in numbers):
            return cls(float(numbers[0]), int(numbers[1]), float(numbers[2]))
        return None


NO_STEP = Effort()


def line_after(effort: Effort | None, n_strokes: int) -> dict[str, Any]:
    """Return the entries of the line of a step that is done now; unknown effort stays unknown.

    If the clock was set back since the last step, the time between both steps is a pause, too.
    """
    now = round(time.time(), 3)
    if effort is None:
        return {"time": now}
    passed = now - effort.time
    seconds = round(effort.seconds + (passed if 0 <= passed <= PAUSE else 0.0), 3)
    return asdict(Effort(seconds, effort.strokes + n_strokes, now))


def statistics(effort: Effort | None) -> dict[str, Any]:
    """Return the entry "statistics" of lists and exports; empty if unknown, or without a step."""
    if effort is None or effort.time < 0:
        return {}
    return {"statistics": {"seconds": effort.seconds, "strokes": effort.strokes}}


def effort_text(entry: dict[str, Any]) -> str:
    """Return the "statistics" in an entry of a list, such as "  12 min, 43 strokes", or ""."""
    if "statistics" not in entry:
        return ""
    seconds, strokes = entry["statistics"]["seconds"], entry["statistics"]["strokes"]
    return f"  {int(seconds // 60) or '< 1'} min, {counted(strokes, 'stroke')}"
