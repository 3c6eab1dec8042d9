"""Numbers in lines of text."""

import random

import numpy as np
import pytest

from superfacets import MeshError
from superfacets.kit import Lines


def test_lines_know_where_they_are():
    lines = Lines.of(b"\n  ab 1 2 \r\n\t\nc\n   # d\n e # f", comment=b"#")
    assert [lines.number(line) for line in range(3)] == [2, 4, 6]
    assert lines.counts.tolist() == [3, 1, 1]
    assert [lines.content(line).strip() for line in range(3)] == [b"ab 1 2", b"c", b"e"]
    assert len(lines[1:]) == 2


@pytest.mark.parametrize("text", [b"", b"\n", b" \t\r\n \n"])
def test_a_text_may_have_no_lines(text):
    lines = Lines.of(text)
    assert len(lines) == 0
    assert len(lines.parse(np.float64)) == 0
    assert len(lines.parse_integers_or_floats()) == 0


def test_bytes_that_are_neither_tokens_nor_blanks_are_refused():
    with pytest.raises(MeshError, match=r"line 2: expected a number, got '\\x01'"):
        Lines.of(b"1\n\1\n2").parse(np.float64)


def test_zeros_may_fill_up_a_text():
    assert Lines.of(b"1\n2\n\0\0\0").parse(np.int64).tolist() == [1, 2]


@pytest.mark.parametrize("bad", [1, 2500, 5000])
@pytest.mark.parametrize("dtype", [np.float64, np.int64])
def test_the_first_bad_token_is_found_among_many_lines(bad, dtype):
    tokens = [b"1"] * 5000
    tokens[bad - 1] = b"x"
    tokens[-1] = b"x"
    with pytest.raises(MeshError, match=f"line {bad}: expected a"):
        Lines.of(b"\n".join(tokens)).parse(dtype)


def concatenate(parts):
    fields = ("starts", "ends", "counts")
    arrays = [np.concatenate([getattr(part, field) for part in parts]) for field in fields]
    return Lines(parts[0].text, *arrays)


def assert_same_lines(found, expected):
    for field in ("starts", "ends", "counts"):
        np.testing.assert_array_equal(getattr(found, field), getattr(expected, field))


def test_blocks_are_the_same_lines(limit):
    text = b"".join(b" " * (i % 7) + b"%d x\n" % i * (i % 3) + b"\n" for i in range(100_000))
    limit("block of text", 10_000)
    whole, blocks = Lines.of(text), list(Lines.blocks(text))
    assert len(blocks) > 100
    assert_same_lines(concatenate(blocks), whole)


@pytest.mark.parametrize("block", [1, 2, 3, 5, 8, 1000])
@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
@pytest.mark.parametrize("is_whole", [True, False])
def test_lines_are_cut_at_their_ends_only(limit, block, end, is_whole):
    text = b"1 2\n\n 3\n45 6 7 # 8\n" * 3 + b"9" + b"\n" * is_whole
    text = text.replace(b"\n", end)
    limit("block of text", block)
    lines = concatenate(list(Lines.blocks(text, comment=b"#")))
    assert_same_lines(lines, Lines.of(text, comment=b"#"))
    assert lines.parse(np.int64).tolist() == [1, 2, 3, 45, 6, 7] * 3 + [9]


@pytest.mark.parametrize("n_threads", [1, 2, 3, 8])
def test_threads_do_not_change_what_is_read(monkeypatch, n_threads):
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", str(n_threads))
    source = random.Random(7)
    # A text of one megabyte, which is parsed in several pieces.
    rows = [[source.uniform(-9, 9) for _ in range(source.randint(0, 5))] for _ in range(30_000)]
    lines = Lines.of("\r\n".join(" ".join(map(repr, row)) for row in rows).encode())
    full = [row for row in rows if row]
    assert lines.counts.tolist() == [len(row) for row in full]
    assert lines.parse(np.float64).tolist() == [value for row in full for value in row]
    assert lines.number(len(full) - 1) == 1 + max(i for i, row in enumerate(rows) if row)


HARD_DECIMALS = [
    "9007199254740993",  # halfway between two doubles
    "9007199254740992." + "9" * 70, "9007199254740993." + "0" * 70 + "1", "2.2250738585072011e-308",
    "2.2250738585072014e-308", "4.9406564584124654e-324", "2.4703282292062327e-324",
    "2.4703282292062328e-324", "1.7976931348623157e308", "1.7976931348623159e308", "-1e400",
    "1e-400", "0.348799", "0.1" + "0" * 800 + "1", "1" * 400, "0" * 400 + ".5e-3",
    "0." + "0" * 340 + "123e340", "+.5", "-5.", "+1.E+5", "-0", "-0.0e-99999999999999999999",
    "1e99999999999999999999", "nan", "-NaN", "+Infinity", "-inf",
]  # fmt: skip


@pytest.mark.parametrize("token", HARD_DECIMALS)
def test_decimals_are_rounded_as_python_rounds_them(token):
    values = Lines.of(f"1 {token}\n2".encode()).parse(np.float64)
    np.testing.assert_array_equal(values, [1.0, float(token), 2.0])
    assert np.signbit(values[1]) == (token[0] == "-")


def test_any_double_comes_back():
    doubles = np.random.default_rng(5).integers(0, 2**64, 20_000, dtype=np.uint64).view(np.float64)
    for form in ("%.17g", "%r", "%.20e"):
        text = "\n".join(form % value for value in doubles.tolist()).encode()
        np.testing.assert_array_equal(Lines.of(text).parse(np.float64), doubles)


def test_decimals_of_any_length_are_rounded_as_python_rounds_them():
    source = random.Random(11)
    tokens = [
        "".join(source.choice("0123456789") for _ in range(source.randint(1, 40)))
        + "."
        + "".join(source.choice("0059") for _ in range(source.randint(0, 40)))
        + source.choice(["", f"e{source.randint(-330, 310)}", f"E+{source.randint(0, 30)}"])
        for _ in range(20_000)
    ]
    values = Lines.of(" ".join(tokens).encode()).parse(np.float64)
    assert values.tolist() == [float(token) for token in tokens]


@pytest.mark.parametrize("token", ["0x10", "1e", "1e+", "1_0", "1,5", "1-2", "nan(1)", "1d5", "."])
def test_what_other_parsers_take_for_numbers_is_refused(token):
    with pytest.raises(MeshError, match=r"line 2: expected a number, got"):
        Lines.of(f"1\n{token}\n".encode()).parse(np.float64)


@pytest.mark.parametrize(("token", "value", "dtype"), [
    ("2147483647", 2**31 - 1, np.int32), ("-2147483648", -(2**31), np.int32),
    ("2147483648", 2**31, np.int64), ("-2147483649", -(2**31) - 1, np.int64),
    ("+9223372036854775807", 2**63 - 1, np.int64), ("9223372036854775808", 2**63 - 1, np.int64),
    ("-9223372036854775808", -(2**63), np.int64), ("-" + "9" * 5000, -(2**63), np.int64),
    ("0" * 5000 + "7", 7, np.int32),
])  # fmt: skip
def test_integers_are_exact_or_the_nearest_that_fits(token, value, dtype):
    values = Lines.of(f"9007199254740993 {token}\n1".encode()).parse(np.int64)
    assert values.tolist() == [9007199254740993, value, 1]
    assert Lines.of(token.encode()).parse(np.int64).dtype == dtype


@pytest.mark.parametrize(("text", "indices"), [
    ("7 7/2 7//3 7/2/3 7/ 7//", [7] * 6), ("-1/-2/-3 +4/5", [-1, 4]),
    ("1/99999999999999999999 2", [1, 2]), ("99999999999/1 1/2", [99999999999, 1]),
    ("99999999999999999999/1/", [2**63 - 1]),
])  # fmt: skip
def test_corners_begin_with_their_vertex(text, indices):
    assert Lines.of(text.encode()).parse_corners().tolist() == indices


@pytest.mark.parametrize(("text", "message"), [
    ("1 /2 3", "line 1: a corner has no vertex index"),
    ("1/x 2 3", "line 1: expected an integer, got 'x'"),
    ("1 2.5/1 3", r"line 1: expected an integer, got '2\.5'"),
    ("1\n\n1/2/3.5", r"line 3: expected an integer, got '3\.5'"),
    ("1/-", "line 1: expected an integer, got '-'"),
])  # fmt: skip
def test_other_corners_are_refused(text, message):
    with pytest.raises(MeshError, match=message):
        Lines.of(text.encode()).parse_corners()


def test_keywords_are_whole_tokens():
    lines = Lines.of(b"v 1\nvt 2\n v\t3\nV 4\nv#5\nvertex\nv\0 6\n", comment=b"#")
    assert lines.keywords([b"v", b"vertex"]).tolist() == [0, 2, 0, 2, 0, 1, 0]
    assert lines.keywords([b"v"], any_case=True).tolist() == [0, 1, 0, 0, 0, 1, 0]
    lines = lines[:6]
    rest = lines.after_keyword(lines.keywords([b"v"]) == 0, b"v")
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
        lines = Lines.of(f"7\n{token}\n8".encode())
        if expected is None:
            with pytest.raises(MeshError, match="line 2: expected a"):
                lines.parse(dtype)
        else:
            n_numbers += 1
            np.testing.assert_array_equal(lines.parse(dtype), np.array([7, expected, 8], dtype))
    assert n_numbers > 500
