"""Messages of type checkers for correct and for wrong calls."""

import shutil
import subprocess
import sys

import pytest

RIGHT = """
import numpy as np
import superfacets as sf

mesh = sf.read_mesh("scan.ply")
assert isinstance(mesh, sf.Mesh)  # not of polygons or tetrahedra
labels: np.ndarray = sf.segment(mesh, 150).labels
sf.segment("scan.ply", radius=0.03, weights="superfacets", init="farthest")
sf.segment((mesh.vertices, mesh.faces), init=[0, 1], weights=np.ones(9), islands="nearest")
sf.segment_graph(sf.build_face_graph(mesh).with_weights(np.ones(9)), 5, init=np.array([1, 2]))
sf.metrics.undersegmentation_error(mesh, labels, labels)
sf.metrics.undersegmentation_error(sf.metrics.area_overlap(labels, labels, np.ones(9)))
sf.view(mesh, labels, title="A scan").save("scan.html")
"""

WRONG = [
    "sf.segment(42)", "sf.segment('scan.ply', init='kmeans')",
    "sf.segment('scan.ply', weights='heavy')", "sf.segment('scan.ply', islands='drown')",
    "sf.segment('scan.ply', n_segments='many')",
    "sf.segment('scan.ply', smooth=True, straight=True)", "sf.segment_graph('scan.ply')",
    "sf.place_seeds(sf.segment('scan.ply'))", "sf.metrics.compactness(7, [0, 1])",
    "sf.metrics.accuracy",
]  # fmt: skip


def messages(checker: str, code: str, folder) -> list[str]:
    """Return the messages of a type checker about the code."""
    path = folder / "snippet.py"
    path.write_text(code)
    if checker == "mypy":
        pytest.importorskip("mypy")
        command = [sys.executable, "-m", "mypy", "--strict", "--no-error-summary"]
        command += ["--cache-dir", str(folder.parent / "mypy-cache")]
    else:
        if shutil.which("pyright") is None:
            pytest.skip("pyright is not installed")
        command = ["pyright", "--pythonpath", sys.executable]
    done = subprocess.run([*command, str(path)], capture_output=True, text=True, check=False)
    return [line for line in done.stdout.splitlines() if "error" in line and "snippet.py" in line]


@pytest.mark.parametrize("checker", ["mypy", "pyright"])
def test_right_calls_are_right_and_wrong_ones_are_found(checker, tmp_path):
    assert messages(checker, RIGHT, tmp_path) == []
    code = "import superfacets as sf\n" + "\n".join(WRONG) + "\n"
    found = messages(checker, code, tmp_path)
    missed = [
        call for line, call in enumerate(WRONG, 2) if not any(f":{line}:" in m for m in found)
    ]
    assert missed == []
