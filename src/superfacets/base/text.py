"""Check JSON text from files and requests, and shorten messages."""

from __future__ import annotations

import json
import math
from collections import Counter
from typing import Any

from .errors import MeshError

MAX_DIGITS = 20  # maximum length of an integer in JSON; int64 has 19 digits and a sign


def parsed_json(text: str | bytes | bytearray, name: str = "it") -> Any:
    """Return the content of JSON text. Apps parse files and requests with this function.

    Numbers must fit into int64 or float64, and the keys of an object must differ. Raises a
    MeshError that begins with `name` for all other text. As NaN and infinity are refused, `int` of
    a number never fails, and a check of both ends of a range is enough.
    """
    try:
        return json.loads(
            text, parse_int=_whole_number, parse_float=_finite_number,
            parse_constant=_finite_number, object_pairs_hook=_object_of,
        )  # fmt: skip
    except RecursionError:
        raise MeshError(f"{name} is nested too deeply") from None
    except MeshError as error:
        raise MeshError(f"{name} {error}") from None
    except ValueError as error:
        raise MeshError(f"{name} is not valid JSON: {error}") from None


def _whole_number(text: str) -> int:
    number = int(text) if len(text) <= MAX_DIGITS else None
    if number is None or not -(2**63) <= number < 2**63:
        raise MeshError(f"has the number {shortened(text)}, which does not fit into 64 bits")
    return number


def _finite_number(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise MeshError(f"has the number {shortened(text)}, which does not fit into 64 bits")
    return number


def _object_of(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        double = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise MeshError(f"has an object with the key {shortened(double)} twice")
    return found


def shortened(message: str) -> str:
    """Return a message of another library as one line of at most 200 characters."""
    line = " ".join(message.split())
    return line if len(line) <= 200 else f"{line[:197]}..."
