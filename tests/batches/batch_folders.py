"""Functions that read the output folder of a batch, for several tests."""

import json


def results_in(folder):
    """Return the content of all results, keyed by relative path."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in (".lock", "manifest.jsonl")
    }


def lines_of(folder):
    return (folder / "manifest.jsonl").read_text().splitlines()


def records_of(folder):
    """Return the records without seconds, by name; check that each name has only one record."""
    lines = [line for line in lines_of(folder) if '"begun"' not in line]
    records = {record["name"]: record for record in map(json.loads, lines)}
    assert len(records) == len(lines)
    for record in records.values():
        record.pop("seconds", None)
    return records
