"""Tables as CSV and Markdown."""

import csv

from research.table_writer import EMPTY, markdown_table, write_csv


def cells(line):
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_columns_of_numbers_go_to_the_right_in_markdown():
    text = markdown_table(["a", "b", "c"], [["x", "1,000.5", 7], ["y, 5", "2", None]])
    head, rule, *rows = text.splitlines()
    assert cells(head) == ["a", "b", "c"]
    assert [cell.endswith(":") for cell in cells(rule)] == [False, True, True]
    assert [cells(row) for row in rows] == [["x", "1,000.5", "7"], ["y, 5", "2", "None"]]


def test_numbers_stay_as_they_are_written():
    assert "| 0.10 |" in markdown_table(["n"], [["0.10"]])


def test_a_table_without_rows_says_so():
    assert markdown_table(["a"], []) == EMPTY


def test_rows_of_a_csv_have_all_columns(tmp_path):
    path = tmp_path / "a.csv"
    write_csv(path, [{"a": 1, "b": "x,y"}, {"a": 2, "c": None}])
    with path.open(newline="") as file:
        assert list(csv.DictReader(file)) == [
            {"a": "1", "b": "x,y", "c": ""},
            {"a": "2", "b": "", "c": ""},
        ]
