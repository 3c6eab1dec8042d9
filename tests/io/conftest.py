"""Fixtures of the file tests."""

from collections.abc import Callable
from pathlib import Path

import pytest

from superfacets import Mesh, MeshError
from superfacets.io.readers.read import read_mesh


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str, bytes], Mesh]:
    """Read the mesh of a file with this name and content."""

    def read_content(name: str, data: bytes) -> Mesh:
        path = tmp_path / name
        path.write_bytes(data)
        return read_mesh(path)

    return read_content


@pytest.fixture
def refuse(read: Callable[[str, bytes], Mesh], tmp_path: Path) -> Callable[[str, bytes, str], None]:
    """Expect a MeshError of one line, that begins with the path, and says this."""

    def expect_refusal(name: str, data: bytes, message: str) -> None:
        with pytest.raises(MeshError) as caught:
            read(name, data)
        text = str(caught.value)
        assert text.startswith(f"{tmp_path / name}: ")
        assert "\n" not in text
        assert message in text

    return expect_refusal
