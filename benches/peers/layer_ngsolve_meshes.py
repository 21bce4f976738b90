"""The meshes of layer_ngsolve.py: triangles for the pair in plane strain, bricks for the pair under the block."""

import numpy as np
from netgen.meshing import Element2D, Element3D, FaceDescriptor, Mesh as NetgenMesh, MeshPoint, Pnt
from netgen.occ import Glue, MoveTo, OCCGeometry
from ngsolve import Mesh

from layer_scene import H, footprint_lines


def triangles(size):
    layer = MoveTo(0, 0).Rectangle(1000, H).Face()
    electrode = MoveTo(25, 215).Rectangle(300, 20).Face()
    rubber = layer - electrode
    rubber.name, electrode.name = "rubber", "electrode"
    body = Glue([rubber, electrode])
    for edge in body.edges:
        x, y = edge.center.x, edge.center.y
        sides = [(x, 0, "axis"), (x, 1000, "end"), (y, 0, "bottom"), (y, H, "top"), (x, 25, "inner")]
        edge.name = next((name for at, where, name in sides if abs(at - where) < 1e-6), "other")
    for corner in body.vertices:
        if 20 < corner.p.x < 330:
            corner.maxh = 4 * size
        elif corner.p.x > 999 and corner.p.y < 1:
            corner.maxh = 16 * size
    return Mesh(OCCGeometry(body, dim=2).GenerateMesh(maxh=90 * size, grading=0.3))


def bricks(size):
    xs, ys, zs = footprint_lines(size)
    mesh, shape = NetgenMesh(3), (len(xs), len(ys), len(zs))
    nodes = np.array([mesh.Add(MeshPoint(Pnt(x, y, z))) for x in xs for y in ys for z in zs], object).reshape(shape)
    names = ["axis", "end", "bottom", "top", "axis3", "side", "inner"]
    for number, name in enumerate(names, 1):
        mesh.Add(FaceDescriptor(surfnr=number, domin=1, domout=0, bc=number))
        mesh.SetBCName(number - 1, name)
    mesh.SetMaterial(1, "rubber")
    mesh.SetMaterial(2, "electrode")
    ring = [(0, 0), (1, 0), (1, 1), (0, 1)]
    cells = [s - 1 for s in shape]
    for i, j, k in np.ndindex(*cells):
        x, y, z = (xs[i] + xs[i + 1]) / 2, (ys[j] + ys[j + 1]) / 2, (zs[k] + zs[k + 1]) / 2
        stiff = 25 < x < 325 and 215 < y < 235 and z < 250
        mesh.Add(Element3D(2 if stiff else 1, [nodes[i + a, j + b, k + c] for c in (0, 1) for a, b in ring]))
        faces = [(i == 0, 1, 0, 0), (i == cells[0] - 1, 2, 0, 1), (j == 0, 3, 1, 0), (j == cells[1] - 1, 4, 1, 1)]
        faces += [(k == 0, 5, 2, 0), (k == cells[2] - 1, 6, 2, 1), (stiff and abs(xs[i] - 25) < 1e-6, 7, 0, 0)]
        for here, number, axis, side in faces:
            if here:
                quad = [np.insert(corner, axis, side) for corner in ring]
                mesh.Add(Element2D(number, [nodes[i + a, j + b, k + c] for a, b, c in quad]))
    return Mesh(mesh)
