"""Writes the .msh files beside it, or into a folder: small meshes with physical groups.

    pip install gmsh
    python make_msh.py [FOLDER]

Tests read them from the folder that the environment variable ELASTOCAP_MSH names, if they are there.

box: a conducting box "inner" inside a box of "filling" and "air", an "outer" surface around it.
shells: the "gap" between spheres of radius 1 and 2, nothing in the "inner" one.
"""

import pathlib
import sys

import gmsh

HERE = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
HERE.mkdir(exist_ok=True)


def write(name, version, binary):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(HERE / name))


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
outer = occ.addBox(-1, -1, -1, 2, 2, 2)
inner = occ.addBox(-0.5, -0.5, -0.5, 1, 1, 1)
filling = occ.addBox(-1, -1, -1, 2, 2, 0.25)
occ.fragment([(3, outer)], [(3, inner), (3, filling)])
occ.synchronize()


def volume_of(x, y, z):
    for _, tag in gmsh.model.getEntities(3):
        if gmsh.model.isInside(3, tag, [x, y, z]):
            return tag
    raise SystemExit("no volume there")


inner, filling, air = volume_of(0, 0, 0), volume_of(0, 0, -0.9), volume_of(0, 0, 0.9)
gmsh.model.addPhysicalGroup(3, [inner], 1, "inner")
gmsh.model.addPhysicalGroup(3, [filling], 2, "filling")
gmsh.model.addPhysicalGroup(3, [air], 3, "air")
walls = [t for _, t in gmsh.model.getBoundary([(3, inner), (3, filling), (3, air)], combined=True, oriented=False)]
gmsh.model.addPhysicalGroup(2, walls, 4, "outer")
faces = [t for _, t in gmsh.model.getBoundary([(3, inner)], oriented=False)]
top = [t for t in faces if abs(occ.getCenterOfMass(2, t)[2] - 0.5) < 1e-9]
gmsh.model.addPhysicalGroup(2, top, 5, "top of inner")
gmsh.option.setNumber("Mesh.MeshSizeMin", 0.7)
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.7)
gmsh.model.mesh.generate(3)
for version, tag in ((2.2, "22"), (4.1, "41")):
    write(f"boxes-{tag}-ascii.msh", version, 0)
    write(f"boxes-{tag}-binary.msh", version, 1)
tets = gmsh.model.mesh.getElementsByType(4)[0]
print("nodes", len(gmsh.model.mesh.getNodes()[0]), "tetrahedra", len(tets))
gmsh.clear()
occ.addBox(0, 0, 0, 1, 1, 1)
occ.synchronize()
gmsh.option.setNumber("Mesh.MeshSizeMin", 2)
gmsh.option.setNumber("Mesh.MeshSizeMax", 2)
gmsh.model.mesh.generate(3)
gmsh.model.mesh.setOrder(2)
write("second-order-41-ascii.msh", 4.1, 0)
gmsh.clear()
gmsh.option.setNumber("Mesh.ElementOrder", 1)
(gap,), _ = occ.cut([(3, occ.addSphere(0, 0, 0, 2))], [(3, occ.addSphere(0, 0, 0, 1))])
occ.synchronize()
gmsh.model.addPhysicalGroup(3, [gap[1]], 1, "gap")
for _, tag in gmsh.model.getBoundary([gap], oriented=False):
    inside = occ.getMass(2, tag) < 20
    gmsh.model.addPhysicalGroup(2, [tag], name="inner" if inside else "outer")
gmsh.option.setNumber("Mesh.MeshSizeMin", 0.45)
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.7)
gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 14)
gmsh.model.mesh.generate(3)
write("shells-41-binary.msh", 4.1, 1)
tets = gmsh.model.mesh.getElementsByType(4)[0]
print("nodes", len(gmsh.model.mesh.getNodes()[0]), "tetrahedra", len(tets))
gmsh.finalize()
