"""Fixtures of the file tests."""

from collections.abc import Callable
from pathlib import Path

import pytest

from superfacets import Mesh, MeshError
from superfacets.files.readers.read import read_mesh


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str, bytes], Mesh]:
    """Return a function that reads a mesh from a file with this name and content."""

    def read_content(name: str, data: bytes) -> Mesh:
        path = tmp_path / name
        path.write_bytes(data)
        return read_mesh(path)

    return read_content


@pytest.fixture
def refuse(read: Callable[[str, bytes], Mesh], tmp_path: Path) -> Callable[[str, bytes, str], None]:
    """Return a function that expects a one-line MeshError with the path and this message."""

    def expect_refusal(name: str, data: bytes, message: str) -> None:
        with pytest.raises(MeshError) as caught:
            read(name, data)
        text = str(caught.value)
        assert text.startswith(f"{tmp_path / name}: ")
        assert "\n" not in text
        assert message in text

    return expect_refusal
