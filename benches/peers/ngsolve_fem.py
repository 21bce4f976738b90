"""One scene by NGSolve's finite elements: one line of JSON for each refinement, seconds from the start of meshing.

    python ngsolve_fem.py SCENE [--method adaptive|hp] [--threads 2] [--seconds 50]

adaptive  P2, the Zienkiewicz-Zhu loop of NGSolve's tutorial 1.6 (flux interpolated in HDiv of one order less, elements above
          a quarter of the largest error refined), multigrid-preconditioned CG to 1e-8
hp        elements shrink by 1/8 towards edges and corners (RefineHP) and the degree goes up with the layers; where there
          are no edges the degree goes up alone. Inner unknowns condensed, BDDC-preconditioned CG. No error estimate.

Curved surfaces are curved elements of the same order. Open space is a ball of 40 times the scene's radius with
du/dr = -u/R on it, which is exact for the net charge; the dipole's part is wrong by about (1/40)^3 = 2e-5.
"""

import argparse
import json
import time

import numpy as np
from netgen.occ import Box, Glue, OCCGeometry, Sphere, WorkPlane, Axes, X, Z
from ngsolve import (CGSolver, BilinearForm, GridFunction, H1, HDiv, InnerProduct, Integrate, Mesh, Preconditioner, SetNumThreads,
                     TaskManager, VOL, ds, dx, grad)

from scenes import EPS0

FAR = 40


def cube_in_cube():
    inner = Box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    inner.faces.name = "c1"
    for edge in inner.edges:
        edge.hpref = 1
    outer = Box((-1, -1, -1), (1, 1, 1))
    outer.faces.name = "ground"
    return dict(shape=outer - inner, drives=[{"c1": 1}], unit=1.0, maxh=0.5, edges=True)


def two_spheres():
    a, b = Sphere((-2.5, 0, 0), 1), Sphere((2.5, 0, 0), 2)
    a.faces.name, b.faces.name = "c1", "c2"
    ball = Sphere((0, 0, 0), 4.5 * FAR)
    ball.faces.name = "far"
    return dict(shape=ball - a - b, drives=[{"c1": 1}, {"c2": 1}], unit=1e-2, radius=4.5 * FAR, curved=True, maxh=60, near=1.0)


def layered_spheres():
    inner, middle, outer = (Sphere((0, 0, 0), r) for r in (1, 1.5, 2))
    inner.faces.name, outer.faces.name = "c1", "ground"
    first, second = middle - inner, outer - middle
    first.mat("first")
    second.mat("second")
    return dict(shape=Glue([first, second]), drives=[{"c1": 1}], unit=1e-3, curved=True, eps={"first": 4, "second": 2}, maxh=0.6)


def in_plane_pair():
    """Lengths in 10 um; x1, x2 (up), x3. All outer walls insulated."""
    left, right = Box((-32.5, 21.5, -25), (-2.5, 23.5, 25)), Box((2.5, 21.5, -25), (32.5, 23.5, 25))
    left.faces.name, right.faces.name = "c1", "c2"
    for body in (left, right):
        for edge in body.edges:
            edge.hpref = 1
    layer = Box((-132.5, 0, -125), (132.5, 45, 125)) - left - right
    above = Box((-132.5, 45, -125), (132.5, 145, 125))
    layer.mat("layer")
    above.mat("above")
    # Nothing leaves through the walls, so that one volt between the two gives C.
    return dict(shape=Glue([layer, above]), drives=[{"c1": 1}], entry="C", unit=1e-5, eps={"layer": 2.8, "above": 1}, maxh=60,
                edges=True)


def square_plates():
    ball = Sphere((0, 0, 0), 0.75 * FAR)
    ball.faces.name = "far"
    plates = []
    for name, z in (("c1", -0.05), ("c2", 0.05)):
        plate = WorkPlane(Axes((0, 0, z), Z, X)).RectangleC(1, 1).Face()
        plate.faces.name = name
        for edge in plate.edges:
            edge.hpref = 1
        plates.append(plate)
    # Two equal plates: half a volt each way puts equal and opposite charges on them.
    return dict(shape=Glue([ball] + plates), drives=[{"c1": 0.5, "c2": -0.5}], entry="C", unit=1.0, radius=0.75 * FAR, maxh=10,
                near=0.3, edges=True)


def coaxial_discs():
    ball = Sphere((0, 0, 0), 1.1 * FAR)
    ball.faces.name = "far"
    discs = []
    for name, z in (("c1", -0.05), ("c2", 0.05)):
        disc = WorkPlane(Axes((0, 0, z), Z, X)).Circle(1).Face()
        disc.faces.name = name
        for edge in disc.edges:
            edge.hpref = 1
        discs.append(disc)
    return dict(shape=Glue([ball] + discs), drives=[{"c1": 0.5, "c2": -0.5}], entry="C", unit=0.03, radius=1.1 * FAR, maxh=15,
                near=0.5, edges=True, curved=True)


GEOMETRIES = {
    "cube-in-cube": cube_in_cube,
    "two-spheres": two_spheres,
    "layered-spheres": layered_spheres,
    "in-plane-pair": in_plane_pair,
    "square-plates": square_plates,
    "coaxial-discs": coaxial_discs,
}


class Problem:
    """Laplace's equation on one mesh, one potential for each way to drive the conductors."""

    def __init__(self, scene, mesh, order, preconditioner, condense=False):
        self.scene, self.mesh, self.condense = scene, mesh, condense
        self.drives = scene["drives"]
        self.dirichlet = "c1|c2|ground"
        self.space = H1(mesh, order=order, dirichlet=self.dirichlet, autoupdate=True)
        self.eps = mesh.MaterialCF(scene.get("eps", {}), default=1)
        u, v = self.space.TnT()
        self.form = BilinearForm(self.space, symmetric=True, condense=condense)
        self.form += self.eps * grad(u) * grad(v) * dx
        if "radius" in scene:
            self.form += u * v / scene["radius"] * ds("far")
        self.preconditioner = Preconditioner(self.form, preconditioner)
        self.potentials = [GridFunction(self.space, autoupdate=True) for _ in self.drives]

    def solve(self):
        self.form.Assemble()
        a = self.form
        inverse = CGSolver(a.mat, self.preconditioner.mat, tol=1e-8, maxiter=500)
        for volts, u in zip(self.drives, self.potentials):
            u.Set(self.mesh.BoundaryCF(volts, default=0), definedon=self.mesh.Boundaries(self.dirichlet))
            r = (-a.mat * u.vec).Evaluate()
            if self.condense:
                r.data += a.harmonic_extension_trans * r
                u.vec.data += inverse * r
                u.vec.data += a.harmonic_extension * u.vec
            else:
                u.vec.data += inverse * r

    def energies(self):
        """Matrix in farad: the energy form of each pair of potentials."""
        n = len(self.drives)
        c = np.zeros((n, n))
        exact = 2 * self.space.globalorder
        for i, u in enumerate(self.potentials):
            for k, v in enumerate(self.potentials[: i + 1]):
                energy = Integrate(self.eps * grad(u) * grad(v) * dx(bonus_intorder=exact), self.mesh)
                if "radius" in self.scene:
                    energy += Integrate(u * v / self.scene["radius"] * ds("far", bonus_intorder=exact), self.mesh)
                c[i, k] = c[k, i] = energy
        return c * EPS0 * self.scene["unit"]

    def estimates(self, order):
        """For each potential, the estimated squared energy error of each element."""
        fluxes = HDiv(self.mesh, order=order - 1)
        answer = []
        for u in self.potentials:
            flux = GridFunction(fluxes)
            flux.Set(self.eps * grad(u))
            gap = flux - self.eps * grad(u)
            answer.append(Integrate(gap * gap / self.eps, self.mesh, VOL, element_wise=True).NumPy())
        return answer


def entries_of(scene, c):
    if len(c) == 1:
        return {scene.get("entry", "C11"): c[0, 0]}
    return {"C11": c[0, 0], "C22": c[1, 1], "C12": c[0, 1]}


def tell(setting, problem, c, begin, stated=None):
    line = dict(setting=setting, unknowns=problem.space.ndof, entries=entries_of(problem.scene, c), stated=stated,
                seconds=time.perf_counter() - begin[0], cpu_seconds=time.process_time() - begin[1])
    print(json.dumps(line), flush=True)


def first_mesh(scene):
    shape = scene["shape"]
    if "near" in scene:
        for face in shape.faces:
            if face.name in ("c1", "c2"):
                face.maxh = scene["near"]
    # Coarser than Netgen's 0.3 where edges decide: refinement puts the elements to better use.
    grading = 0.7 if scene.get("edges") else 0.3
    return Mesh(OCCGeometry(shape).GenerateMesh(maxh=scene["maxh"], grading=grading))


def adaptive(name, seconds):
    order, begin = 2, (time.perf_counter(), time.process_time())
    scene = GEOMETRIES[name]()
    mesh = first_mesh(scene)
    if scene.get("curved"):
        mesh.Curve(order)
    problem = Problem(scene, mesh, order, "multigrid")
    level = 0
    while True:
        step = time.perf_counter()
        problem.solve()
        c = problem.energies()
        local = problem.estimates(order)
        stated = max(e.sum() * EPS0 * scene["unit"] / c[k, k] for k, e in enumerate(local))
        tell(f"{level} refinements, {problem.space.ndof} unknowns", problem, c, begin, stated)
        took = time.perf_counter() - step
        # The next mesh has about twice the elements.
        if time.perf_counter() - begin[0] + 2 * took > seconds:
            return
        total = sum(local)
        mesh.ngmesh.Elements3D().NumPy()["refine"] = total > 0.25 * total.max()
        mesh.Refine()
        if scene.get("curved"):
            mesh.Curve(order)
        level += 1


def hp(name, seconds):
    for levels in range(1, 6):
        # Each answer stands alone: its time holds its own meshing.
        begin = (time.perf_counter(), time.process_time())
        order = levels + 2
        scene = GEOMETRIES[name]()
        mesh = first_mesh(scene)
        if scene.get("edges"):
            mesh.RefineHP(levels, factor=0.125)
        if scene.get("curved"):
            mesh.Curve(order)
        problem = Problem(scene, mesh, order, "bddc", condense=True)
        problem.solve()
        layers = f", {levels} layers" if scene.get("edges") else ""
        tell(f"order {order}{layers}, {problem.space.ndof} unknowns", problem, problem.energies(), begin)
        seconds -= time.perf_counter() - begin[0]
        if 4 * (time.perf_counter() - begin[0]) > seconds:
            return


def main():
    options = argparse.ArgumentParser()
    options.add_argument("scene", choices=GEOMETRIES)
    options.add_argument("--method", choices=("adaptive", "hp"), default="adaptive")
    options.add_argument("--threads", type=int, default=2)
    options.add_argument("--seconds", type=float, default=50)
    chosen = options.parse_args()
    SetNumThreads(chosen.threads)
    with TaskManager():
        (adaptive if chosen.method == "adaptive" else hp)(chosen.scene, chosen.seconds)


if __name__ == "__main__":
    main()
