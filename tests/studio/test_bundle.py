"""The page that is shipped is that of the sources in `frontend/`, and names what is in it."""

import hashlib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FRONTEND = ROOT / "frontend"
BUNDLE = ROOT / "src" / "superfacets" / "studio" / "static"
SINGLE_FILES = [
    "index.html", "package.json", "package-lock.json", "tsconfig.json", "vite.config.js",
    "stamp.mjs",
]  # fmt: skip


@pytest.fixture
def sources():
    """What the bundle is made of: paths in `frontend/`."""
    if not FRONTEND.is_dir():
        pytest.skip("the sources of the page are not part of this distribution")
    inside = (path for path in (FRONTEND / "src").rglob("*") if path.is_file())
    return sorted([*(path.relative_to(FRONTEND).as_posix() for path in inside), *SINGLE_FILES])


def test_the_bundle_is_that_of_the_sources(sources):
    stamp = (BUNDLE / "SOURCES.sha256").read_text().splitlines()
    built_of = {path: digest for digest, path in (line.split("  ") for line in stamp)}
    now = {path: hashlib.sha256((FRONTEND / path).read_bytes()).hexdigest() for path in sources}
    changed = sorted(path for path in {*built_of, *now} if built_of.get(path) != now.get(path))
    assert changed == [], "run `make frontend` and commit what it writes"


def test_the_page_loads_nothing_from_elsewhere_and_names_no_machine():
    for path in BUNDLE.iterdir():
        text = path.read_text()
        assert "/home/" not in text
        assert "/work/" not in text
    page = (BUNDLE / "index.html").read_text()
    assert 'src="/static/studio.js"' in page
    assert "http" not in page


def test_licences_of_the_libraries_are_beside_the_bundle():
    text = (BUNDLE / "THIRD_PARTY").read_text()
    for name in ("three ", "three-mesh-bvh "):
        assert f"\n{name}" in text
    assert text.count("Permission is hereby granted, free of charge") == 2
