"""Reads every .vtu and .pvd of a folder with VTK and with meshio, and checks that both see the same fields.

    pip install vtk meshio
    python tests/readers/read_vtu.py results/in-plane-pair
"""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

POINT_ARRAYS = {"potential": 1, "electric_field": 3}
CELL_ARRAYS = {"relative_permittivity": 1, "body_id": 1}


class Bad(Exception):
    """What is wrong with a file."""


def need(condition, what):
    if not condition:
        raise Bad(what)


def read_with_vtk(path):
    complaints = []
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.AddObserver("ErrorEvent", lambda *_: complaints.append("error"))
    reader.AddObserver("WarningEvent", lambda *_: complaints.append("warning"))
    reader.SetFileName(str(path))
    reader.Update()
    need(not complaints, "VTK complains")
    grid = reader.GetOutput()
    need(grid.GetNumberOfCells() > 0, "VTK finds no cells")

    def arrays(data):
        names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())]
        return {name: vtk_to_numpy(data.GetArray(name)) for name in names}

    types = {grid.GetCellType(c) for c in range(grid.GetNumberOfCells())}
    need(types == {vtk.VTK_HEXAHEDRON}, f"VTK finds cells that are no hexahedra: {types}")
    connectivity = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 8)
    points = vtk_to_numpy(grid.GetPoints().GetData())
    return points, connectivity, arrays(grid.GetPointData()), arrays(grid.GetCellData()), grid


def read_with_meshio(path):
    mesh = meshio.read(path)
    need([block.type for block in mesh.cells] == ["hexahedron"], "meshio does not find one block of hexahedra")
    cell_data = {name: blocks[0] for name, blocks in mesh.cell_data.items()}
    return mesh.points, mesh.cells[0].data, mesh.point_data, cell_data


def check_fields(points, connectivity, point_data, cell_data):
    """Names, shapes, finite numbers; cells the right way round; E along -grad(potential)."""
    for data, wanted, count in ((point_data, POINT_ARRAYS, len(points)), (cell_data, CELL_ARRAYS, len(connectivity))):
        need(set(data) == set(wanted), f"arrays {sorted(data)} instead of {sorted(wanted)}")
        for name, components in wanted.items():
            shape = (count,) if components == 1 else (count, components)
            need(data[name].shape == shape, f"{name} has the shape {data[name].shape}, not {shape}")
            need(np.isfinite(data[name]).all(), f"{name} is not finite everywhere")
    need(np.isfinite(points).all(), "points are not finite")
    need((cell_data["relative_permittivity"] > 0).all(), "a permittivity is not positive")
    need((cell_data["body_id"] >= 0).all(), "a body id is negative")

    corners = points[connectivity]
    potential = point_data["potential"][connectivity]
    upper = np.array([[1, 2, 5, 6], [2, 3, 6, 7], [4, 5, 6, 7]])
    lower = np.array([[0, 3, 4, 7], [0, 1, 4, 5], [0, 1, 2, 3]])
    # From the middle of each face to that of the opposite one: along the axes, unless the scene is bent.
    across = corners[:, upper].mean(axis=2) - corners[:, lower].mean(axis=2)
    unit = np.abs(across).max()
    volume = np.linalg.det(across / unit)
    need((volume > 0).all(), "a cell is flat or inside out")
    fall = potential[:, upper].mean(axis=2) - potential[:, lower].mean(axis=2)
    gradient = np.linalg.solve(across / unit, fall[:, :, None])[:, :, 0] / unit
    field = point_data["electric_field"].astype(float)[connectivity].mean(axis=1)
    field_size, gradient_size = np.linalg.norm(field, axis=1), np.linalg.norm(gradient, axis=1)
    if field_size.max() == 0.0:
        need(gradient_size.max() == 0.0, "E is zero, the potential is not constant")
        return 1.0, 1.0
    # E is the mean of a cell's corners, the gradient their difference. At an edge, where the field
    # has no bound, the two differ in size whatever the grid, so direction and size are judged apart, each by the
    # energy of the cells; the size by the weighted median, which a few cells at edges cannot move.
    # What is left is the coarse look of elements of high order: a few parts in a hundred.
    told = (field_size > 0.0) & (gradient_size > 0.0)
    energy = (volume * field_size**2)[told]
    cosine = -(field * gradient).sum(axis=1)[told] / (field_size * gradient_size)[told]
    cosine = float((energy * cosine).sum() / energy.sum())
    need(cosine > 0.95, f"E and -grad(potential) agree only to a mean cosine of {cosine:.3f}")
    ratio = field_size[told] / gradient_size[told]
    order = np.argsort(ratio)
    middle = np.searchsorted(np.cumsum(energy[order]), energy.sum() / 2)
    ratio = float(ratio[order][middle])
    need(0.8 < ratio < 1.25, f"|E| is {ratio:.3f} times |grad(potential)| in the median")
    return cosine, ratio


def check_vtu(path):
    points, connectivity, point_data, cell_data, grid = read_with_vtk(path)
    cosine, ratio = check_fields(points, connectivity, point_data, cell_data)
    other_points, other_connectivity, other_point_data, other_cell_data = read_with_meshio(path)
    check_fields(other_points, other_connectivity, other_point_data, other_cell_data)
    need(np.array_equal(points, other_points), "VTK and meshio read different points")
    need(np.array_equal(connectivity, other_connectivity), "VTK and meshio read different cells")
    for name in POINT_ARRAYS:
        need(np.array_equal(point_data[name], other_point_data[name]), f"VTK and meshio read different {name}")
    for name in CELL_ARRAYS:
        need(np.array_equal(cell_data[name], other_cell_data[name]), f"VTK and meshio read different {name}")
    quality = vtk.vtkMeshQuality()
    quality.SetInputData(grid)
    quality.SetHexQualityMeasureToVolume()
    quality.Update()
    volumes = vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality"))
    need((volumes > 0).all(), "VTK finds a cell of negative volume")
    return f"{len(points)} points, {len(connectivity)} cells, E against -grad(potential): cosine {cosine:.4f}, size {ratio:.3f}"


def check_tetrahedra(path):
    """A scene of bodies of any shape, with one volt between conductors: both readers see the same."""
    complaints = []
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.AddObserver("ErrorEvent", lambda *_: complaints.append("error"))
    reader.SetFileName(str(path))
    reader.Update()
    need(not complaints, "VTK complains")
    grid = reader.GetOutput()
    points = vtk_to_numpy(grid.GetPoints().GetData())
    connectivity = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4)
    potential = vtk_to_numpy(grid.GetPointData().GetArray("potential"))
    body = vtk_to_numpy(grid.GetCellData().GetArray("body_id"))
    need(potential.shape == (len(points),) and body.shape == (len(connectivity),), "arrays have the wrong length")
    need(np.isfinite(points).all() and np.isfinite(potential).all() and (body >= 0).all(), "an array is not usable")
    # Quadratic elements may go a little beyond the values that they are held at.
    most = 0.5 if potential.min() < -0.3 else 1.0
    need(most - 1.1 < potential.min(), f"potentials from {potential.min()}")
    need(most - 0.1 < potential.max() < most + 0.1, f"potentials up to {potential.max()}")
    corners = points[connectivity].astype(float)
    sides = (corners[:, 1:] - corners[:, :1]) / np.ptp(points, axis=0).max()
    need((np.linalg.det(sides) > 0).all(), "a tetrahedron is flat or inside out")
    field = vtk_to_numpy(grid.GetPointData().GetArray("electric_field"))
    permittivity = vtk_to_numpy(grid.GetCellData().GetArray("relative_permittivity"))
    need(field.shape == (len(points), 3) and np.isfinite(field).all(), "the electric field is not usable")
    need(permittivity.shape == (len(connectivity),) and (permittivity > 0).all(), "a permittivity is not positive")
    rises = potential[connectivity[:, 1:]] - potential[connectivity[:, :1]]
    volume = np.abs(np.linalg.det(sides))
    # The gradient in each tetrahedron, and at each point the mean around it, in units of the largest length.
    gradient = np.linalg.solve(sides, rises[:, :, None])[:, :, 0]
    total = np.zeros((len(points), 3))
    weight = np.zeros(len(points))
    for corner in range(4):
        np.add.at(total, connectivity[:, corner], volume[:, None] * gradient)
        np.add.at(weight, connectivity[:, corner], volume)
    off = -total / weight[:, None] - field * np.ptp(points, axis=0).max()
    # Where the mesh is clipped, pieces too thin to have a gradient that is known have no weight.
    need((np.abs(off).max(axis=1) > 1e-3 * (1 + np.abs(field).max(axis=1) * np.ptp(points, axis=0).max())).mean() < 1e-3,
         "E is not minus the gradient of the potential")
    mesh = meshio.read(path)
    need([block.type for block in mesh.cells] == ["tetra"], "meshio does not find one block of tetrahedra")
    need(np.array_equal(mesh.points, points), "VTK and meshio read different points")
    need(np.array_equal(mesh.cells[0].data, connectivity), "VTK and meshio read different cells")
    need(np.array_equal(mesh.point_data["potential"], potential), "VTK and meshio read different potentials")
    need(np.array_equal(mesh.cell_data["body_id"][0], body), "VTK and meshio read different bodies")
    need(np.array_equal(mesh.point_data["electric_field"], field), "VTK and meshio read different fields")
    return f"{len(points)} points, {len(connectivity)} tetrahedra, potentials from {potential.min():.3f} to {potential.max():.3f}"


def is_of_tetrahedra(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    return {grid.GetCellType(c) for c in range(grid.GetNumberOfCells())} == {vtk.VTK_TETRA}


LAYER_ARRAYS = {"displacement": 3, "cauchy_stress": 6, "pressure": 1, "J": 1, "contact_pressure": 1}


def check_layer(path):
    """A deformed layer of quadratic quadrilaterals or hexahedra: both readers see the same, and the volume is kept."""
    reader = vtk.vtkXMLUnstructuredGridReader()
    complaints = []
    reader.AddObserver("ErrorEvent", lambda *_: complaints.append("error"))
    reader.SetFileName(str(path))
    reader.Update()
    need(not complaints, "VTK complains")
    grid = reader.GetOutput()
    count = grid.GetNumberOfCells()
    need(count > 0, "VTK finds no cells")
    types = {grid.GetCellType(c) for c in range(count)}
    known = {vtk.VTK_BIQUADRATIC_QUAD: ("quad9", 9), vtk.VTK_TRIQUADRATIC_HEXAHEDRON: ("hexahedron27", 27)}
    need(len(types) == 1 and types <= set(known), f"VTK finds other cells than quadratic ones of one kind: {types}")
    kind, per_cell = known[types.pop()]
    points = vtk_to_numpy(grid.GetPoints().GetData())
    data = grid.GetPointData()
    arrays = {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)) for i in range(data.GetNumberOfArrays())}
    need(set(arrays) == set(LAYER_ARRAYS), f"arrays {sorted(arrays)} instead of {sorted(LAYER_ARRAYS)}")
    for name, components in LAYER_ARRAYS.items():
        need(arrays[name].reshape(len(points), -1).shape[1] == components, f"{name} has the wrong number of components")
        need(np.isfinite(arrays[name]).all(), f"{name} is not finite everywhere")
    mesh = meshio.read(path)
    need([block.type for block in mesh.cells] == [kind], f"meshio does not find one block of {kind}")
    need(np.array_equal(mesh.points, points), "VTK and meshio read different points")
    connectivity = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, per_cell)
    need(np.array_equal(mesh.cells[0].data, connectivity), "VTK and meshio read different cells")
    for name, values in arrays.items():
        need(np.array_equal(mesh.point_data[name], values), f"VTK and meshio read different {name}")

    def area(at):
        # Around each cell: corners and middles of sides in turn. What curvature adds to a polygon is small.
        ring = at[connectivity[:, [0, 4, 1, 5, 2, 6, 3, 7]]][:, :, :2]
        after = np.roll(ring, -1, axis=1)
        return 0.5 * (ring[:, :, 0] * after[:, :, 1] - ring[:, :, 1] * after[:, :, 0]).sum()

    def volume(at):
        # By Gauss: the flux of the position through the six faces, each of four flat pieces. VTK's corners, then its
        # edges, then the middles of the faces -x, +x, -y, +y, -z, +z.
        faces = [[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]]
        edges = [[11, 19, 15, 16], [9, 18, 13, 17], [8, 17, 12, 16], [10, 18, 14, 19], [8, 9, 10, 11], [12, 13, 14, 15]]
        outward = [-1, 1, 1, -1, -1, 1]
        total = 0.0
        for face, (corners, sides, sign) in enumerate(zip(faces, edges, outward)):
            middle = at[connectivity[:, 20 + face]]
            ring = [at[connectivity[:, n]] for pair in zip(corners, sides) for n in pair]
            for a, b in zip(ring, ring[1:] + ring[:1]):
                total += sign * (middle * np.cross(a, b)).sum() / 6
        return total

    size, name = (area, "area") if kind == "quad9" else (volume, "volume")
    before, now = size(points - arrays["displacement"].reshape(-1, 3)), size(points)
    need(before > 0 and abs(now / before - 1) < 0.01, f"the {name} goes from {before} to {now}")
    return f"{len(points)} points, {count} cells, {name} {now / before:.5f} of that at rest"


def check_pvd(path):
    root = ElementTree.parse(path).getroot()
    need(root.tag == "VTKFile" and root.get("type") == "Collection", "no VTK collection")
    entries = root.findall("Collection/DataSet")
    need(entries, "an empty collection")
    times = [float(entry.get("timestep")) for entry in entries]
    need(all(a < b for a, b in zip(times, times[1:])), f"times do not increase: {times}")
    for entry in entries:
        need(not Path(entry.get("file")).is_absolute(), "an absolute file name")
        need((path.parent / entry.get("file")).is_file(), f"{entry.get('file')} is missing")
    return f"{len(entries)} steps, times {times}"


def main():
    if len(sys.argv) < 2:
        sys.exit("usage: read_vtu.py FOLDER ...")
    failed = False
    for folder in map(Path, sys.argv[1:]):
        files = sorted([*folder.rglob("*.vtu"), *folder.rglob("*.pvd")])
        if not any(path.suffix == ".vtu" for path in files):
            print(f"FAIL {folder}: no .vtu file in it")
            failed = True
        for path in files:
            try:
                if path.suffix == ".pvd":
                    check = check_pvd
                elif path.name.startswith("layer_"):
                    check = check_layer
                else:
                    check = check_tetrahedra if is_of_tetrahedra(path) else check_vtu
                print(f"ok   {path}: {check(path)}")
            except (Exception, SystemExit) as error:  # meshio leaves by SystemExit when it cannot read a file
                failed = True
                print(f"FAIL {path}: {type(error).__name__}: {error}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
