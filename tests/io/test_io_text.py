"""Numbers in lines of text."""

import random

import numpy as np
import pytest

from superfacets import MeshError
from superfacets.io.text import iterate_lines, split_lines


def test_lines_know_where_they_are():
    lines = split_lines(b"\n  ab 1 2 \r\n\t\nc\n   # d\n e # f", comment=b"#")
    assert lines.numbers.tolist() == [2, 4, 6]
    assert lines.counts.tolist() == [3, 1, 1]
    assert [lines.content(line).strip() for line in range(3)] == [b"ab 1 2", b"c", b"e"]
    assert len(lines[1:]) == 2


@pytest.mark.parametrize("text", [b"", b"\n", b" \t\r\n \n"])
def test_a_text_may_have_no_lines(text):
    lines = split_lines(text)
    assert len(lines) == 0
    assert len(lines.parse(np.float64)) == 0
    assert len(lines.parse_integers_or_floats()) == 0


def test_bytes_that_are_neither_tokens_nor_blanks_are_refused():
    with pytest.raises(MeshError, match="the lines from 1 on do not hold numbers only"):
        split_lines(b"1\n\1\n2").parse(np.float64)


@pytest.mark.parametrize("bad", [1, 2500, 5000])
@pytest.mark.parametrize("dtype", [np.float64, np.int64])
def test_the_first_bad_token_is_found_among_many_lines(bad, dtype):
    tokens = [b"1"] * 5000
    tokens[bad - 1] = b"x"
    tokens[-1] = b"x"
    with pytest.raises(MeshError, match=f"line {bad}: expected a"):
        split_lines(b"\n".join(tokens)).parse(dtype)


def test_blocks_are_the_same_lines():
    text = b"".join(b" " * (i % 7) + b"%d x\n" % i * (i % 3) + b"\n" for i in range(400_000))
    whole, blocks = split_lines(text), list(iterate_lines(text))
    assert len(blocks) > 1
    assert np.array_equal(np.concatenate([lines.numbers for lines in blocks]), whole.numbers)
    assert np.array_equal(np.concatenate([lines.counts for lines in blocks]), whole.counts)
    assert blocks[-1].content(-1) == whole.content(-1)


def test_keywords_are_whole_tokens():
    lines = split_lines(b"v 1\nvt 2\n v\t3\nV 4\nv\nvertex\n")
    assert lines.having_keyword(b"v").tolist() == [True, False, True, False, True, False]
    assert lines.having_keyword(b"v", any_case=True).tolist() == [1, 0, 1, 1, 1, 0]
    assert lines.having_keyword(b"vertex").tolist() == [0, 0, 0, 0, 0, 1]
    rest = lines.after_keyword(lines.having_keyword(b"v"), b"v")
    assert rest.counts.tolist() == [1, 1, 0]
    assert rest.parse(np.int64).tolist() == [1, 3]


@pytest.mark.parametrize(("dtype", "convert"), [(np.float64, float), (np.int64, int)])
def test_tokens_are_numbers_where_python_says_so(dtype, convert):
    source = random.Random(3)
    n_numbers = 0
    for _ in range(20_000):
        token = "".join(source.choice("0123+-.eEnaifNIFt_") for _ in range(source.randint(1, 6)))
        try:
            expected = convert(token) if "_" not in token else None
        except ValueError:
            expected = None
        lines = split_lines(f"7\n{token}\n8".encode())
        if expected is None:
            with pytest.raises(MeshError, match="line 2: expected a"):
                lines.parse(dtype)
        else:
            n_numbers += 1
            np.testing.assert_array_equal(lines.parse(dtype), np.array([7, expected, 8], dtype))
    assert n_numbers > 500
