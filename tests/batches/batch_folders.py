"""What several tests of batches ask of an output folder."""

import json


def results_in(folder):
    """The bytes of all results, by name."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in (".lock", "manifest.jsonl")
    }


def lines_of(folder):
    return (folder / "manifest.jsonl").read_text().splitlines()


def records_of(folder):
    """The records without seconds, by name; each name has one."""
    records = {record["name"]: record for record in map(json.loads, lines_of(folder))}
    assert len(records) == len(lines_of(folder))
    for record in records.values():
        record.pop("seconds", None)
    return records
