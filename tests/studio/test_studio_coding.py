"""The encoding of cells and arrays in the studio."""

import base64
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from superfacets_studio.labels import coding


@given(st.sets(st.integers(0, 2**32 - 1), max_size=40))
def test_cells_come_back_as_they_were_packed(cells):
    array = np.array(sorted(cells), np.uint32)
    assert np.array_equal(coding.unpack_cells(coding.pack_cells(array), 2**32), array)


def test_a_run_of_a_million_cells_takes_few_bytes():
    assert len(coding.pack_cells(np.arange(1_000_000, dtype=np.uint32))) < 5_000


@pytest.mark.parametrize(("packed", "n_cells", "message"), [
    (b"no zlib", 9, "packed numbers are damaged"),
    (coding.pack_cells(np.arange(9, dtype=np.uint32))[:-1], 9, "packed numbers are damaged"),
    (zlib.compress(bytes(1 << 20)), 9, "packed numbers are damaged"),
    (coding.pack_cells(np.array([3, 9], np.uint32)), 9,
     "cells must be ascending numbers between 0 and 8"),
    (zlib.compress(b"\x80"), 9, "a number is incomplete or too long"),
    (zlib.compress(b"\xff" * 9 + b"\1"), 9, "a number is incomplete or too long"),
    (zlib.compress(b"\1\0"), 9, "cells must be ascending numbers between 0 and 8"),
])  # fmt: skip
def test_damaged_cells_are_refused(packed, n_cells, message):
    with pytest.raises(ValueError, match=message):
        coding.unpack_cells(packed, n_cells)


def test_cells_of_a_client_are_sorted_and_each_is_there_once():
    assert coding.cells_from(coding.base64_of(np.array([7, 2, 7], np.uint32)), 8).tolist() == [2, 7]


@pytest.mark.parametrize(("text", "message"), [
    (None, "cells must be base64"),
    ("%%%", "cells must be base64"),
    (base64.b64encode(b"abc").decode(),
     "cells must be uint32, so the number of bytes must be a multiple of 4, got 3"),
    (coding.base64_of(np.array([8], np.uint32)), "cell 8 does not exist: the mesh has 8 cells"),
])  # fmt: skip
def test_wrong_cells_of_a_client_are_refused(text, message):
    with pytest.raises(ValueError, match=message):
        coding.cells_from(text, 8)


def test_bytes_of_a_client_are_base64():
    assert coding.bytes_from("AAE=") == b"\0\1"
    with pytest.raises(ValueError, match="data must be base64"):
        coding.bytes_from(12)


def test_arrays_of_a_packet_begin_at_multiples_of_four():
    from studio_client import unpacked

    given_arrays = {"a": np.array([1, 2, 3], np.uint8), "b": np.array([[1.5, 2.5]], np.float32)}
    header, arrays = unpacked(coding.packet({"kind": "test"}, given_arrays))
    assert header["kind"] == "test"
    assert arrays["a"].tolist() == [1, 2, 3]
    assert arrays["b"].tolist() == [[1.5, 2.5]]
