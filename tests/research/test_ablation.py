"""The table of changes of the default."""

import numpy as np
import pytest
from research import ablation
from shapes import bowl, gear

import superfacets as sf


def shape_of(mesh):
    heights = mesh.vertices[mesh.faces].mean(axis=(1, 2))
    return ablation.Shape(mesh.vertices, mesh.faces, (heights > np.median(heights)).astype(int))


BOWL = bowl(96)
BENT = sf.Mesh(BOWL.vertices + 0.03 * np.sin(7 * BOWL.vertices), BOWL.faces)  # no flat edges
MADE = sf.subdivide(gear(12, 1.0, 0.3, np.zeros(3)), max_edge=0.02).mesh
SHAPES = [shape_of(mesh) for mesh in (sf.sample_mesh(5_000), BENT, MADE)]
USUAL = [ablation.quality(("none", shape, 0)) for shape in SHAPES]


@pytest.mark.parametrize("name", list(ablation.CHANGES)[1:])
def test_each_change_changes_the_regions_of_a_shape_and_is_taken_back(name):
    assert [ablation.quality((name, shape, 0)) for shape in SHAPES] != USUAL
    assert ablation.quality(("none", SHAPES[0], 0)) == USUAL[0]
