"""The folders and files of the Princeton benchmark, complete and damaged."""

import pytest
import shapes
from research.princeton import CATEGORIES, Benchmark, category_of

from superfacets import MeshError


@pytest.fixture
def folder(tmp_path):
    """Return a folder with models 3 and 281: two faces and two ground truths each."""
    (tmp_path / "off").mkdir()
    square = shapes.strip(2)
    rows = [*square.vertices.tolist(), *([3, *face] for face in square.faces.tolist())]
    text = "OFF\n4 2 0\n" + "\n".join(" ".join(map(str, row)) for row in rows) + "\n"
    for number in (3, 281):
        (tmp_path / "off" / f"{number}.off").write_text(text)
        truths = tmp_path / "seg" / "Benchmark" / str(number)
        truths.mkdir(parents=True)
        for j in range(2):
            (truths / f"{number}_{j}.seg").write_text(f"0\n{j}\n")
    return tmp_path


def test_models_are_read_with_their_ground_truths(folder):
    benchmark = Benchmark(folder)
    assert benchmark.numbers == (3, 281)
    model = benchmark.load(281)
    assert (model.number, model.category, model.mesh.n_faces) == (281, "Armadillo", 2)
    assert [truth.tolist() for truth in model.ground_truths] == [[0, 0], [0, 1]]
    assert model.problems == ()


def test_files_of_other_names_are_no_models(folder):
    for name in ("notes.txt", "3.obj", "03.off", "x.off"):
        (folder / "off" / name).write_text("")
    assert Benchmark(folder).numbers == (3, 281)


def test_ten_comes_after_nine(folder):
    truths = folder / "seg" / "Benchmark" / "3"
    for j in range(2, 12):
        (truths / f"3_{j}.seg").write_text(f"{j}\n0\n")
    assert [truth[0] for truth in Benchmark(folder).load(3).ground_truths] == [0, 0, *range(2, 12)]


def test_missing_and_mismatched_ground_truths_are_named_and_left_out(folder):
    truths = folder / "seg" / "Benchmark" / "3"
    (truths / "3_2.seg").write_text("0\n1\n2\n")
    (truths / "3_4.seg").write_text("1\nx\n")
    (truths / "3_5.seg").write_text("1\n1\n")
    model = Benchmark(folder).load(3)
    assert [truth.tolist() for truth in model.ground_truths] == [[0, 0], [0, 1], [1, 1]]
    missing, wrong = sorted(model.problems, key=lambda line: "3_3" not in line)[:2]
    assert missing == f"{truths / '3_3.seg'}: no such file"
    assert wrong == f"{truths / '3_2.seg'}: labels must have one value per cell (2), got 3 values"
    assert len(model.problems) == 3


def test_a_model_without_ground_truths_says_so(folder):
    for path in (folder / "seg" / "Benchmark" / "3").iterdir():
        path.unlink()
    model = Benchmark(folder).load(3)
    assert model.ground_truths == ()
    assert model.problems == (f"{folder / 'seg' / 'Benchmark' / '3'}: there are no ground truths",)


def test_a_damaged_mesh_is_an_error(folder):
    (folder / "off" / "3.off").write_text("OFF\n4 2 0\n0 0 0\n")
    with pytest.raises(MeshError, match=r"3\.off: "):
        Benchmark(folder).load(3)


def test_a_folder_that_is_no_benchmark_is_refused(tmp_path):
    with pytest.raises(
        MeshError, match="not a copy of the Princeton benchmark: it has no folder 'off'"
    ):
        Benchmark(tmp_path)
    (tmp_path / "off").mkdir()
    with pytest.raises(MeshError, match="contains no model"):
        Benchmark(tmp_path)


def test_categories_are_twenty_models_each_and_the_fourteenth_is_empty():
    assert len(CATEGORIES) == 19
    numbers = [n for n in range(1, 401) if not 261 <= n <= 280]
    assert [category_of(n) for n in numbers] == [name for name in CATEGORIES for _ in range(20)]
    for number in (-5, 0, 261, 280, 401):
        with pytest.raises(ValueError, match=f"model must be 1 to 260 or 281 to 400, got {number}"):
            category_of(number)


def test_the_real_benchmark_is_whole(data_dir):
    benchmark = Benchmark(data_dir / "psb")
    assert len(benchmark.numbers) == 95
    model = benchmark.load(125)
    assert (model.category, model.mesh.n_faces, model.problems) == ("Octopus", 2682, ())
    assert len(model.ground_truths) >= 5
