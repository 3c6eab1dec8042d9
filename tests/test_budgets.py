"""Budgets of lines: a feature that breaks a budget brings its deletion in the same change."""

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ENGINE = ["base", "mesh", "graph", "weights", "cleanup", "clustering", "pipeline.py"]

BUDGETS = [
    ("the engine", 10_500, [f"src/superfacets/{part}" for part in ENGINE]),
    ("superfacets", 19_800, ["src/superfacets"]),
    ("superfacets.files", 4_600, ["src/superfacets/files"]),
    ("superfacets_cli", 3_000, ["src/superfacets_cli"]),
    ("superfacets_show", 3_300, ["src/superfacets_show"]),
    ("superfacets_studio", 5_000, ["src/superfacets_studio"]),
    ("superfacets_formats", 3_000, ["src/superfacets_formats"]),
    ("superfacets_textures", 1_800, ["src/superfacets_textures"]),
    ("superfacets_scans", 2_300, ["src/superfacets_scans"]),
    ("superfacets_batch", 800, ["src/superfacets_batch"]),
    ("all Python in the wheel", 39_000, ["src"]), ("C++", 20_600, ["src/core"]),
    ("the front end", 9_000, ["frontend/src"]), ("the tests", 44_000, ["tests"]),
]  # fmt: skip
"""Name, maximum number of lines, and folders or files."""

ENDINGS = {"C++": (".cpp", ".hpp"), "the front end": (".ts", ".css", ".html")}
"""Endings of counted files. All other rows count Python."""

TEXTS = "frontend/src/studio/text/en.ts"
NOT_COUNTED = ("src/superfacets/_core.pyi", "tests/reference/", "tests/research/", TEXTS)
"""A generated file, tests that are slow and readable instead of short, and a table of texts."""


def sizes_of(endings, parts):
    """Return the number of lines of each file, the largest first."""
    paths = [path for part in parts for path in (ROOT / part, *(ROOT / part).rglob("*"))]
    sizes = {
        name: path.read_bytes().count(b"\n")
        for path in paths
        if (name := path.relative_to(ROOT).as_posix()).endswith(endings)
        and not name.startswith(NOT_COUNTED)
    }
    return dict(sorted(sizes.items(), key=lambda item: -item[1]))


@pytest.mark.parametrize(("name", "most", "parts"), BUDGETS, ids=[row[0] for row in BUDGETS])
def test_lines_stay_within_the_budget(name, most, parts):
    sizes = sizes_of(ENDINGS.get(name, (".py", ".pyi")), parts)
    assert sizes, f"{name} has no files"
    total = sum(sizes.values())
    largest = ", ".join(f"{file} ({size:,})" for file, size in list(sizes.items())[:5])
    assert total <= most, (
        f"{name} has {total:,} lines, {total - most:,} more than its budget; largest: {largest}"
    )
