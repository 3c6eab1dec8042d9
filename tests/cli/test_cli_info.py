"""The command `info`."""

import json
import re


def test_info_prints_counts(run, sheet):
    status, out, err = run("info", sheet)
    assert (status, err) == (0, "")
    rows = dict(re.split(r" {2,}", line, maxsplit=1) for line in out.splitlines())
    assert rows["faces"] == "1152"
    assert rows["boundary edges"] == "96"
    assert rows["inside out"] == "no"
    facts = json.loads(run("info", sheet, "--json")[1])
    assert facts["n_faces"] == 1152
    assert facts["n_boundary_edges"] == 96


def test_info_takes_several_files_and_goes_on_after_a_bad_one(run, sheet):
    bad = sheet.with_name("bad.ply")
    bad.write_bytes(b"junk")
    status, out, err = run("info", sheet, bad, sheet)
    assert status == 1
    assert (
        err == f"superfacets: error: {bad}: not a PLY file: it does not begin with the word ply\n"
    )
    assert [line.split()[1] for line in out.splitlines() if line.startswith("file ")] == [
        str(sheet)
    ] * 2
    status, out, _ = run("info", sheet, sheet, "--json")
    assert [json.loads(line)["file"] for line in out.splitlines()] == [str(sheet)] * 2
