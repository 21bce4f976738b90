"""Fields as arrays."""

import numpy as np
import pytest

import elastocap

pytestmark = pytest.mark.filterwarnings("ignore::elastocap.ElastocapWarning")


def test_the_field_on_a_grid_fits_its_potential():
    case = elastocap.load("cases/cube-in-cube.toml").with_(relative_tolerance=1e-2)
    field = elastocap.run(case, fields=True)[0].field
    nodes = tuple(map(len, field.axes))
    assert isinstance(field, elastocap.GridField) and field.potential.shape == nodes
    assert field.electric_field.shape == (*nodes, 2, 3) and field.body_id.shape == tuple(n - 1 for n in nodes)
    assert field.potential.min() == 0 and field.potential.max() == 1, "one volt on the inner cube"
    # The slope of the potential in the middle of the gap between the cubes, and the field there.
    x = field.axes[0]
    i = np.searchsorted(x, 0.75)
    j, k = (np.argmin(np.abs(axis)) for axis in field.axes[1:])
    slope = -(field.potential[i, j, k] - field.potential[i - 1, j, k]) / (x[i] - x[i - 1])
    ends = [field.electric_field[i - 1, j, k, 1, 0], field.electric_field[i, j, k, 0, 0]]
    assert min(ends) * 0.98 <= slope <= max(ends) * 1.02
    assert field.body_names[field.body_id[tuple(n // 2 for n in field.body_id.shape)]] == "inner"


def test_the_field_on_tetrahedra_has_its_arrays_by_name():
    case = elastocap.load("cases/dome-from-gmsh.toml").with_({"electrostatics.relative_tolerance": 0.2})
    field = elastocap.run(case, fields=True)[0].field
    assert isinstance(field, elastocap.MeshField)
    assert field.points.shape[1] == 3 and field.cells.shape[1] == 4
    assert field.cells.min() == 0 and field.cells.max() == len(field.points) - 1
    assert field.point_data["potential"].shape == (len(field.points),)
    assert len(field.body_id) == len(field.cells) and field.body_id.max() < len(field.body_names)


def test_there_is_no_field_unless_it_is_asked_for():
    case = elastocap.load("cases/cube-in-cube.toml").with_(relative_tolerance=1e-2)
    assert elastocap.run(case)[0].field is None
