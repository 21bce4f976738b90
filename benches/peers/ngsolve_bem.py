"""One scene by NGSolve's boundary elements, as in its demo "Dirichlet Laplace indirect method": lines of JSON.

    python ngsolve_bem.py SCENE [--threads 2] [--seconds 50]

Charge density of order 2 on curved triangles of a size halved each time; single-layer operator with the settings of the demo;
CG to 1e-8 preconditioned with the mass matrix. Homogeneous scenes only: the demo has no dielectrics. No error estimate.
"""

import argparse
import json
import time

import numpy as np
from netgen.meshing import MeshingStep
from netgen.occ import Axes, Box, Compound, OCCGeometry, Sphere, WorkPlane, X, Z
from ngsolve import BilinearForm, GridFunction, InnerProduct, LinearForm, Mesh, SetNumThreads, SurfaceL2, TaskManager, ds
from ngsolve.bem import LaplaceSL
from ngsolve.solvers import CG

from scenes import EPS0

ORDER = 2


def cube_in_cube():
    inner, outer = Box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)), Box((-1, -1, -1), (1, 1, 1))
    inner.faces.name, outer.faces.name = "c1", "ground"
    return dict(shape=Compound([inner, outer]), drives=[{"c1": 1}], unit=1.0, maxh=1.0)


def two_spheres():
    a, b = Sphere((-2.5, 0, 0), 1), Sphere((2.5, 0, 0), 2)
    a.faces.name, b.faces.name = "c1", "c2"
    return dict(shape=Compound([a, b]), drives=[{"c1": 1}, {"c2": 1}], unit=1e-2, maxh=3, curved=True)


def square_plates():
    plates = []
    for name, z in (("c1", -0.05), ("c2", 0.05)):
        plate = WorkPlane(Axes((0, 0, z), Z, X)).RectangleC(1, 1).Face()
        plate.faces.name = name
        plates.append(plate)
    return dict(shape=Compound(plates), drives=[{"c1": 0.5, "c2": -0.5}], entry="C", unit=1.0, maxh=0.4)


def coaxial_discs():
    discs = []
    for name, z in (("c1", -0.05), ("c2", 0.05)):
        disc = WorkPlane(Axes((0, 0, z), Z, X)).Circle(1).Face()
        disc.faces.name = name
        discs.append(disc)
    return dict(shape=Compound(discs), drives=[{"c1": 0.5, "c2": -0.5}], entry="C", unit=0.03, maxh=0.8, curved=True)


GEOMETRIES = {
    "cube-in-cube": cube_in_cube,
    "two-spheres": two_spheres,
    "square-plates": square_plates,
    "coaxial-discs": coaxial_discs,
}


def solve(scene, maxh):
    mesh = Mesh(OCCGeometry(scene["shape"]).GenerateMesh(maxh=maxh, perfstepsend=MeshingStep.MESHSURFACE))
    if scene.get("curved"):
        mesh.Curve(ORDER + 1)
    space = SurfaceL2(mesh, order=ORDER, dual_mapping=True)
    u, v = space.TnT()
    operator = LaplaceSL(u * ds) * v * ds
    preconditioner = BilinearForm(u * v * ds, diagonal=True).Assemble().mat.Inverse()
    loads, charges = [], []
    for volts in scene["drives"]:
        load = LinearForm(mesh.BoundaryCF(volts, default=0) * v * ds).Assemble()
        charge = GridFunction(space)
        CG(mat=operator.mat, pre=preconditioner, rhs=load.vec, sol=charge.vec, tol=1e-8, maxsteps=500, printrates=False)
        loads.append(load)
        charges.append(charge)
    c = np.array([[InnerProduct(load.vec, charge.vec) for charge in charges] for load in loads])
    return space.ndof, c * EPS0 * scene["unit"]


def main():
    options = argparse.ArgumentParser()
    options.add_argument("scene", choices=GEOMETRIES)
    options.add_argument("--threads", type=int, default=2)
    options.add_argument("--seconds", type=float, default=50)
    chosen = options.parse_args()
    SetNumThreads(chosen.threads)
    left, halvings = chosen.seconds, 0
    with TaskManager():
        while True:
            begin = (time.perf_counter(), time.process_time())
            scene = GEOMETRIES[chosen.scene]()
            unknowns, c = solve(scene, scene["maxh"] / 2**halvings)
            if len(c) == 1:
                entries = {scene.get("entry", "C11"): c[0, 0]}
            else:
                entries = {"C11": c[0, 0], "C22": c[1, 1], "C12": c[0, 1]}
            took = time.perf_counter() - begin[0]
            line = dict(setting=f"order {ORDER}, {unknowns} unknowns", unknowns=unknowns, entries=entries, stated=None, seconds=took,
                        cpu_seconds=time.process_time() - begin[1])
            print(json.dumps(line), flush=True)
            left -= took
            if 5 * took > left:
                return
            halvings += 1


if __name__ == "__main__":
    main()
