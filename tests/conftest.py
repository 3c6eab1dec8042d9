"""Real meshes for the tests that want them, found as the README says."""

import os
import signal
from pathlib import Path

import pytest

# A shell may have started us such that Ctrl-C is ignored, and what we start would ignore it too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def _find_data() -> Path | None:
    if "SUPERFACETS_DATA" in os.environ:
        return Path(os.environ["SUPERFACETS_DATA"])
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    return beside if beside.is_dir() else None


@pytest.fixture(scope="session")
def real_data() -> Path | None:
    """The folder with `meshes` and `psb`, or None."""
    return _find_data()


@pytest.fixture(scope="session")
def data_dir(real_data: Path | None) -> Path:
    """The folder with `meshes` and `psb`; the test is skipped where there is none."""
    folder = real_data
    if folder is None:
        pytest.skip("no real meshes: set SUPERFACETS_DATA, or put them in ../shared/data")
    assert folder.is_dir(), f"SUPERFACETS_DATA is {folder}, which is not a folder"
    return folder


@pytest.fixture(scope="session")
def benchmark_paths(data_dir: Path) -> list[Path]:
    """The models of the Princeton Segmentation Benchmark that are there, smallest file first."""
    return sorted(
        (data_dir / "psb" / "off").glob("*.off"), key=lambda p: (p.stat().st_size, p.name)
    )
