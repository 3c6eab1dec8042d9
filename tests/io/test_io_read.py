"""Behavior of `read_mesh` that is the same for all formats."""

import os
import subprocess
import sys
import time

import pytest
from mesh_files import glb, ply_binary, ply_text, stl_binary, whole_files

from superfacets import MeshError
from superfacets.files.formats import FORMATS
from superfacets.files.readers.read import read_mesh
from superfacets.mesh.convert import as_mesh


@pytest.mark.parametrize("ending", FORMATS.meshes)
def test_an_empty_file_is_refused(refuse, ending):
    refuse(f"a{ending}", b"", "the file is empty")


@pytest.mark.parametrize(
    ("name", "got"),
    [("a.dwg", ".dwg: convert the file first"), ("a", "none"), (".ply", "none"),
     ("lh.pial.T1", ".t1: if it is a .pial file, rename a copy, or use --format pial")],
)  # fmt: skip
def test_an_unknown_ending_is_refused(refuse, name, got):
    endings = ", ".join(FORMATS.meshes)
    refuse(name, b"ply", f"expected the ending {endings}, got {got}")


def test_files_that_meshio_converts_are_refused_with_the_command(refuse):
    refuse("a.bdf", b"CEND", "a.bdf: convert the file first: meshio convert IN OUT.msh")
    refuse("lh.annot", b"", "lh.annot: a label file: give the mesh of these labels first")


@pytest.mark.parametrize(
    ("name", "format"),
    [("a.STEP", "STEP"), ("a.stp", "STEP"), ("a.iges", "IGES"), ("a.igs", "IGES"),
     ("a.brep", "BREP"), ("a.FCStd", "FCStd"), ("a.stl", "STEP")],
)  # fmt: skip
def test_files_of_cad_programs_are_refused_with_advice(refuse, name, format):
    advice = "gmsh part.step -2 -o part.msh keeps its faces as gmsh:geometrical"
    refuse(name, b"ISO-10303-21;\nHEADER;\n", f"{format} is a CAD format: {advice}")


@pytest.mark.parametrize("ending", FORMATS.meshes)
def test_a_file_of_another_format_is_refused(read, ending):
    for name, data in whole_files().items():
        if not name.endswith((".glb", ".gltf") if ending in (".glb", ".gltf") else ending):
            with pytest.raises(MeshError):
                read(f"a{ending}", data)


def test_all_faces_at_one_point_are_refused(refuse):
    refuse("a.ply", ply_text(vertices=[[1, 1, 1]] * 5), "all faces lie at one point")


@pytest.mark.parametrize(
    ("name", "make"), [("a.ply", ply_binary), ("a.stl", stl_binary), ("a.glb", glb)]
)
def test_a_signaling_nan_is_refused_without_a_warning(refuse, name, make):
    one, signaling_nan = b"\0\0\x80\x3f", b"\1\0\x80\x7f"
    data = make()
    place = data.rindex(one)
    refuse(name, data[:place] + signaling_nan + data[place + 4 :], "] must be finite, got [")


def test_a_missing_file_is_an_os_error(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"a\.ply: no such file"):
        read_mesh(tmp_path / "a.ply")


def test_a_folder_is_an_os_error(tmp_path):
    (tmp_path / "a.ply").mkdir()
    with pytest.raises(IsADirectoryError, match=r"a\.ply: is a folder, not a file"):
        read_mesh(tmp_path / "a.ply")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_an_os_error_and_does_not_hang(tmp_path):
    os.mkfifo(tmp_path / "a.ply")
    with pytest.raises(OSError, match=r"a\.ply: is not a regular file"):
        read_mesh(tmp_path / "a.ply")


def test_a_file_that_may_not_be_read_is_an_os_error(tmp_path, forbid):
    (tmp_path / "a.ply").write_bytes(ply_text())
    forbid()  # root may read everything
    with pytest.raises(PermissionError, match=r"a\.ply: you have no permission to read"):
        read_mesh(tmp_path / "a.ply")


def test_paths_may_be_text(tmp_path):
    (tmp_path / "a.ply").write_bytes(ply_text())
    assert read_mesh(str(tmp_path / "a.ply")).n_faces == 2
    assert as_mesh(str(tmp_path / "a.ply")).n_faces == 2


def test_nothing_is_printed(read, capfd):
    for name, data in whole_files().items():
        read(name, data)
        with pytest.raises(MeshError):
            read(name, data[: len(data) // 2 - 7])
    assert capfd.readouterr() == ("", "")


def test_reading_imports_nothing_but_numpy():
    others = {"lagrange", "trimesh", "pyvista", "scipy", "vtk", "matplotlib", "meshio", "PIL"}
    code = f"import sys, superfacets.files.readers.read; print({others} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_the_bunny_is_read_fast(data_dir):
    path = data_dir / "meshes" / "bunny.ply"
    durations = []
    for _ in range(5):
        begin = time.process_time()
        read_mesh(path)
        durations.append(time.process_time() - begin)
    assert min(durations) < 0.05
