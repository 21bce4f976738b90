"""A grounded ball over the paper's pair by NGSolve, at one distance after the other, beside what elastocap found.

    python ngsolve_approach.py [RESULT/curve.csv] [--distances 2e-3 5e-4 ...] [--refinements 3] [--threads 2]

The scene is that of a run with [mechanics.solid], indenter = { sphere = { radius = "2 mm" } } and role = "grounded" before contact: a
layer of 450 um on a substrate of 1.6 mm, both without end, under air. P2, the Zienkiewicz-Zhu loop of ngsolve_fem.py, curved elements;
open space is a ball of 80 mm with du/dr = -u/R on it. Each refined mesh is one line; with a curve.csv its bounds stand beside them.
The energy of potentials on a mesh is more than the true one, so that the mutual capacitance comes down as meshes are refined.
"""

import argparse
import csv

from netgen.occ import Box, Glue, OCCGeometry, Sphere
from ngsolve import Mesh, SetNumThreads, TaskManager

from ngsolve_fem import Problem

UNIT = 1e-5  # m
FAR = 8000
LAYER, SUBSTRATE, RADIUS = 45, 160, 200


def scene(distance):
    """Lengths in 10 um; x1, x2 (up), x3."""
    left, right = Box((-32.5, 21.5, -25), (-2.5, 23.5, 25)), Box((2.5, 21.5, -25), (32.5, 23.5, 25))
    left.faces.name, right.faces.name = "c1", "c2"
    for face in list(left.faces) + list(right.faces):
        face.maxh = 10
    ball = Sphere((0, LAYER + distance / UNIT + RADIUS, 0), RADIUS)
    ball.faces.name = "ground"
    for face in ball.faces:
        face.maxh = 60
    space = Sphere((0, 0, 0), FAR)
    space.faces.name = "far"
    wide = 2 * FAR
    slab = lambda low, high: space * Box((-wide, low, -wide), (wide, high, wide))
    layer = slab(0, LAYER) - left - right
    substrate, above, below = slab(-SUBSTRATE, 0), slab(LAYER, wide) - ball, slab(-wide, -SUBSTRATE)
    for body, name in ((layer, "layer"), (substrate, "substrate"), (above, "air"), (below, "air")):
        body.mat(name)
    drives = [{"c1": 1}, {"c2": 1}]
    return dict(shape=Glue([layer, substrate, above, below]), drives=drives, unit=UNIT, radius=FAR, eps={"layer": 2.8, "substrate": 4.4})


def solved(distance, refinements):
    own = scene(distance)
    mesh = Mesh(OCCGeometry(own["shape"]).GenerateMesh(maxh=2000, grading=0.5))
    mesh.Curve(2)
    problem = Problem(own, mesh, 2, "multigrid")
    for level in range(refinements + 1):
        problem.solve()
        yield problem.space.ndof, -problem.energies()[0, 1]
        if level < refinements:
            total = sum(problem.estimates(2))
            mesh.ngmesh.Elements3D().NumPy()["refine"] = total > 0.25 * total.max()
            mesh.Refine()
            mesh.Curve(2)


def main():
    options = argparse.ArgumentParser()
    options.add_argument("curve", nargs="?")
    options.add_argument("--distances", type=float, nargs="*", default=[8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5])
    options.add_argument("--refinements", type=int, default=4)
    options.add_argument("--threads", type=int, default=2)
    chosen = options.parse_args()
    SetNumThreads(chosen.threads)
    bounds = {}
    if chosen.curve:
        with open(chosen.curve) as file:
            for row in csv.DictReader(file):
                key = float(row["distance_m"])
                bounds.setdefault(key, [float(row[f"capacitance_{end}_f"]) for end in ("lower", "upper")])
    with TaskManager():
        for distance in chosen.distances:
            for unknowns, found in solved(distance, chosen.refinements):
                beside = bounds.get(distance)
                words = f", elastocap {beside[0] * 1e15:.4f} to {beside[1] * 1e15:.4f} fF" if beside else ""
                print(f"{distance * 1e6:8.1f} um  {unknowns:8d} unknowns  {found * 1e15:.4f} fF{words}", flush=True)


if __name__ == "__main__":
    main()
