"""The scripts that are shipped, of the studio and of pages, are built from `frontend/`."""

import hashlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FRONTEND = ROOT / "frontend"
SOURCES = ROOT / "src"
STUDIO, PAGE = SOURCES / "superfacets_studio" / "static", SOURCES / "superfacets_show" / "page"
COMMON = ["package.json", "package-lock.json", "tsconfig.json", "vite.config.js", "stamp.mjs"]


def _sources(folder, files):
    """Return the paths in `frontend/` of the sources of a bundle."""
    if not FRONTEND.is_dir():
        pytest.skip("the sources of the bundles are not part of this distribution")
    found = [*(FRONTEND / "src" / folder).rglob("*"), *(FRONTEND / "src" / "shared").rglob("*")]
    paths = [path.relative_to(FRONTEND).as_posix() for path in found if path.is_file()]
    return sorted([*paths, *COMMON, *files])


@pytest.mark.parametrize(
    ("bundle", "folder", "files"),
    [(STUDIO, "studio", ["index.html"]), (PAGE, "page", [])],
    ids=["studio", "page"],
)
def test_each_bundle_is_built_from_the_sources(bundle, folder, files):
    stamp = (bundle / "SOURCES.sha256").read_text().splitlines()
    built_of = {path: digest for digest, path in (line.split("  ") for line in stamp)}
    sources = _sources(folder, files)
    now = {path: hashlib.sha256((FRONTEND / path).read_bytes()).hexdigest() for path in sources}
    changed = sorted(path for path in {*built_of, *now} if built_of.get(path) != now.get(path))
    assert changed == [], "run `make frontend` and commit what it writes"


@pytest.mark.parametrize("path", [*STUDIO.iterdir(), PAGE / "viewer.js"], ids=lambda p: p.name)
def test_bundles_load_nothing_from_elsewhere_and_name_no_machine(path):
    text = path.read_text()
    own = ("/home/", f"{FRONTEND.parent}/", "frontend/", "node_modules")
    for address in (*own, "http:", "https:"):
        assert address not in text


def test_what_is_shared_imports_neither_page_nor_studio_nor_they_each_other():
    if not FRONTEND.is_dir():
        pytest.skip("the sources of the bundles are not part of this distribution")
    for path in (FRONTEND / "src").rglob("*.ts"):
        others = {"page", "studio"} - {path.relative_to(FRONTEND / "src").parts[0]}
        imported = re.findall(r'from "(?:\.\./)+(\w+)/', path.read_text(encoding="utf-8"))
        assert others.isdisjoint(imported), path


def test_the_studio_loads_its_own_script():
    assert 'src="/static/studio.js"' in (STUDIO / "index.html").read_text()
