"""The group of commands: help, errors, exit status."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from command_line import COMMAND, files_in

from superfacets.kit import FORMATS
from superfacets_cli.batch import batch_command
from superfacets_cli.main import COMMANDS, GROUPS
from superfacets_cli.segment import segment_command


def test_settings_in_the_environment_are_checked(run, sheet, monkeypatch):
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", "abc")
    status, _, err = run("info", sheet)
    assert (status, err.count("\n")) == (2, 1)
    assert "SUPERFACETS_NUM_THREADS must be a positive integer, got 'abc'" in err
    monkeypatch.setenv("SUPERFACETS_NUM_THREADS", "99999999999")
    assert run("info", sheet)[0] == 0


def test_help_and_version_are_printed(run):
    assert run("--version")[1].startswith("superfacets 0.")
    status, out, _ = run("--help")
    assert status == 0
    assert {"segment", "info", "render", "demo"} <= set(out.split())
    assert "--n-segments" in run("segment", "-h")[1]


def test_without_a_command_the_help_is_shown(run):
    status, out, err = run()
    assert (status, out) == (2, "")
    assert err.startswith("Usage: ")
    assert "segment" in err


INTERRUPTED = """
import os, signal, sys

class Interrupt:
    def find_spec(self, name, *_):
        if name == "NAME":
            os.kill(os.getpid(), signal.SENT)

sys.meta_path.insert(0, Interrupt())
from superfacets.__main__ import main
main()
"""
"""Program that runs the command, and sends a signal when a module is imported."""


def run_code(code, *arguments):
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize(("name", "sent"), [
    ("superfacets_cli.main", "SIGINT"), ("click", "SIGINT"),
    ("superfacets_cli.segment", "SIGINT"), ("superfacets_cli.segment", "SIGTERM"),
    ("superfacets_cli.segment", "SIGHUP"), ("numpy", "SIGINT"),
])  # fmt: skip
def test_a_signal_while_the_command_is_imported_ends_it_as_later(sheet, name, sent):
    code = INTERRUPTED.replace("NAME", name).replace("SENT", sent)
    ended = run_code(code, "segment", str(sheet))
    assert (ended.returncode, ended.stdout) == (130, "")
    assert ended.stderr == "superfacets: error: interrupted\n"


def test_ctrl_c_in_a_finalizer_is_not_lost():
    code = "import os, signal, time; from superfacets_cli import interrupts as i; i.hear_signals()"
    code += "; type('', (), {'__del__': lambda _: os.kill(os.getpid(), signal.SIGINT)})()"
    code += "; [time.sleep(0.1) for _ in range(20)]"
    assert run_code(code).stderr.endswith("KeyboardInterrupt\n")


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
def test_ctrl_c_is_not_heard_where_it_is_ignored(sheet):
    code = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)" + INTERRUPTED
    code = code.replace("NAME", "click").replace("SENT", "SIGINT")
    assert "1152" in run_code(code, "info", str(sheet)).stdout


def test_the_command_is_installed():
    assert shutil.which("superfacets", path=Path(sys.executable).parent)


@pytest.mark.parametrize("name", ["", ".", "/"])
def test_a_folder_in_the_place_of_a_mesh_is_one_line(run, name):
    for arguments in ([name], ["segment", name]):
        status, _, err = run(*arguments)
        assert (status, err.count("\n")) == (1, 1)
        assert err.endswith(": is a folder: use superfacets batch\n")


def test_data_that_cannot_be_used_is_one_line_and_status_1(run, tmp_path):
    (tmp_path / "empty.ply").write_bytes(b"")
    (tmp_path / "foreign.obj").write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0")
    (tmp_path / "points.off").write_text("OFF\n0 0 0\n")
    (tmp_path / "edge.off").write_text("OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 1\n")
    (tmp_path / "nan.off").write_text("OFF\n3 1 0\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n")
    (tmp_path / "index.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n")
    (tmp_path / "mesh.docx").write_text("")
    (tmp_path / "folder.ply").mkdir()
    before = files_in(tmp_path)
    for name in [*before, "missing.ply"]:
        for command in ("segment", "info"):
            status, out, err = run(command, tmp_path / name)
            assert (status, out) == (1, ""), name
            assert err.startswith("superfacets: error: "), name
            assert err.count("\n") == 1, name
            assert name in err, name
    assert files_in(tmp_path) == before


def loaded_by(*arguments):
    """Return the modules that a command line imports in addition to click and NumPy."""
    code = (
        "import atexit, sys, click, numpy\n"
        "before = set(sys.modules)\n"
        "from superfacets_cli.main import main\n"
        "atexit.register(lambda: print(*set(sys.modules) - before))\n"
        "main()"
    )
    return set(run_code(code, *map(str, arguments)).stdout.splitlines()[-1].split())


def test_help_imports_no_command():
    loaded = loaded_by("--help")
    few = {f"superfacets{name}" for name in ("", ".base", ".base.errors", ".base.lazy", ".kit")}
    few |= {f"superfacets_cli{name}" for name in ("", ".failures", ".interrupts", ".main")}
    assert {name for name in loaded if name.startswith("superfacets")} == few
    assert not loaded & {*NEVER_NEEDED}


NEVER_NEEDED = ("hashlib", "importlib.metadata", "numpy.ma", "socket", "xml", "zipfile")
NEVER_NEEDED += ("superfacets.metrics", "superfacets.tools.sample", "superfacets.tools.texels")
NEVER_NEEDED += ("superfacets.regions.region_graph", "superfacets.files.readers.gltf")
NEVER_NEEDED += ("superfacets_batch", "superfacets_formats.", "superfacets_studio")


@pytest.mark.parametrize(("command", "late"), [
    ("info", ("superfacets.pipeline", "superfacets.files.writers", "superfacets_show")),
    ("segment", ("superfacets_textures.t", "superfacets_show.s", "superfacets_cli.info")),
])  # fmt: skip
def test_a_command_imports_what_a_mesh_file_needs_alone(sheet, command, late):
    loaded = loaded_by(command, sheet)
    assert f"superfacets_cli.{command}" in loaded
    assert not {name for name in loaded if name.startswith((*NEVER_NEEDED, *late))}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_list_of_commands_says_what_each_says_itself(run, name):
    status, out, _ = run(name, "--help")
    assert status == 0
    (summary,) = [group[name] for group in GROUPS.values() if name in group]
    first = summary.removesuffix(".")
    assert " ".join(out.split()).split("superfacets " + name)[1].find(first) > 0


def test_a_command_that_is_not_there_is_one_line_that_names_the_nearest(run):
    for word in ("paint", "graph"):  # several functions have the word graph
        status, out, err = run(word)
        assert (status, out) == (2, "")
        assert err == f"superfacets: error: No such command '{word}'. (see superfacets --help)\n"
    for wrong, meant in (("segmnt", "segment"), ("rendr", "render"), ("format", "formats")):
        status, _, err = run(wrong, "scan.ply")
        assert (status, err.count("\n")) == (2, 1)
        assert f"No such command '{wrong}': did you mean {meant}?" in err
    assert "error: no.geojson: a vector file is not a mesh" in run("no.geojson")[2]
    advice = "': in Python: superfacets.cad_faces"
    assert all(f"'{word}{advice}" in run(word, "part.stl")[2] for word in ("cad", "faces"))


def test_a_file_in_place_of_a_command_is_segmented(run, sheet, tmp_path):
    assert run("segment", sheet, "-n", 20, "-o", tmp_path / "a.npy")[0] == 0
    assert run(sheet, "-n", 20, "-o", tmp_path / "b.npy")[0] == 0
    assert (tmp_path / "a.npy").read_bytes() == (tmp_path / "b.npy").read_bytes()
    odd = sheet.with_name("odd.dat")
    odd.write_bytes(sheet.read_bytes())
    assert run(odd, "--format", "ply", "-n", 20, "-o", tmp_path / "c.npy")[0] == 0
    assert run("nowhere.ply") == (1, "", "superfacets: error: nowhere.ply: no such file\n")
    assert "options follow the command, or the file" in run("-n", 20, sheet)[2]


def test_help_is_short_and_help_all_has_every_option(run):
    assert run("--help")[1].count("\n") <= 25
    assert len(COMMANDS) <= 16
    for name, command in (("segment", segment_command), ("batch", batch_command)):
        text, whole = run(name, "-h")[1], run(name, "--help-all")[1]
        assert text == run(name, "--help")[1]
        assert text.count("\n") <= (40 if name == "segment" else 50)
        assert all(word in text for usual in FORMATS.usual_outputs.items() for word in usual)
        given = [each.opts[0] for each in command.params if isinstance(each, click.Option)]
        assert all(name in whole for name in given)


def test_formats_are_listed(run):
    status, out, _ = run("formats")
    assert status == 0
    rows = {line.split()[0]: " ".join(line.split()[1:]) for line in out.splitlines()}
    assert rows.keys() >= {*FORMATS.cells, *FORMATS.labels, *FORMATS.outputs}
    assert rows[".stl"] == "mesh, labels mesh, labels"
    assert rows[".e57"] == "points, labels e57"
    assert rows[".ids.png"] == "labels"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_get_their_completion(shell):
    environment = {**os.environ, "_SUPERFACETS_COMPLETE": f"{shell}_source"}
    command = [sys.executable, "-c", "import sys; sys.argv[0] = 'superfacets'\n" + COMMAND[-1]]
    source = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert "_superfacets_completion" in source.stdout
    environment = {**os.environ, "_SUPERFACETS_COMPLETE": f"{shell}_complete"}
    environment["COMP_WORDS"] = "superfacets segment --init g"
    environment["COMP_CWORD"] = "g" if shell == "fish" else "3"
    found = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert re.findall(r"geodesic|grid|farthest|flood", found.stdout) == ["geodesic", "grid"]


def test_the_documentation_has_the_help_of_every_command():
    docs = Path(__file__).parents[2] / "docs"
    page = docs.joinpath("command.md").read_text(encoding="utf-8")
    assert "{include} help/commands.md" in page
    # The file has a section for each of `COMMANDS` by construction.
    code = docs.joinpath("conf.py").read_text(encoding="utf-8")
    assert '    for name in COMMANDS:\n        is_long = name in ("segment", "batch")' in code


def test_options_are_listed_in_groups(run):
    text = run("segment", "--help-all")[1]
    titles = re.findall(r"^(\w[^\n]*):$", text, re.MULTILINE)
    assert titles[:3] == ["Everyday options", "Presets", "Creases and borders"]
    assert titles[-1] == "Other options"
    others = text.split("Other options:")[1]
    assert re.findall(r"--[a-z-]+", others) == ["--help-all", "--help"]
    assert "x<=None" not in run("render", "--help")[1]


def test_a_warning_of_a_library_is_a_note_of_one_line():
    call = "import warnings; warnings.warn('bad EXIF\\ndata')"
    code = "from superfacets_cli import main as m\n"
    code += f"m.commands.main = lambda **_: exec({call!r})\nm.main()"
    for options, expected in (((), "superfacets: note: bad EXIF data\n"), (("-q",), "")):
        ended = run_code(code, *options)
        assert (ended.returncode, ended.stderr) == (0, expected)
