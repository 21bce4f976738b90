"""One scene by FastCap2's surface panels: one line of JSON for each number of panels.

    python fastcap_panels.py SCENE [--seconds 50]

Plane faces have edge panels a tenth as wide as the others, as FastCap's own cube generator makes them; discs have rings that get
narrower towards the rim; spheres are cubes blown up, corners on the sphere. Multipole order 2 (its default) and 4; iterations to 1e-3 instead of 1e-2, which costs little.
One thread: FastCap has no more. It has no insulated walls and no error estimate.
"""

import argparse
import json
import math
import time

import fastcap2
import numpy as np

from scenes import two_terminal


def sphere(name, centre, radius, n):
    """6 n^2 quadrilaterals."""
    surface = fastcap2.Surface(name=name) if name else fastcap2.Surface()
    t = np.tan(np.linspace(-math.pi / 4, math.pi / 4, n + 1))
    corner = np.empty((n + 1, n + 1, 3))
    for axis in range(3):
        for side in (-1, 1):
            corner[..., axis] = side
            corner[..., (axis + 1) % 3] = t[:, None]
            corner[..., (axis + 2) % 3] = t[None, :]
            p = np.asarray(centre) + radius * corner / np.linalg.norm(corner, axis=-1, keepdims=True)
            for i in range(n):
                for j in range(n):
                    four = (p[i, j], p[i + 1, j], p[i + 1, j + 1], p[i, j + 1])
                    surface.add_quad(*(tuple(map(float, q)) for q in four))
    return surface


def rectangle(surface, origin, one, other, n):
    """n^2 panels of one size, n + 2 each way with the narrow ones along the edges."""
    surface.add_meshed_quad(origin, one, other, num=n, edge_fraction=0.1 / (n + 0.2))


def cube(name, half, n):
    surface = fastcap2.Surface(name=name)
    for axis in range(3):
        for side in (-half, half):
            corners = [[-half] * 3 for _ in range(3)]
            for corner in corners:
                corner[axis] = side
            corners[1][(axis + 1) % 3] = half
            corners[2][(axis + 2) % 3] = half
            rectangle(surface, *map(tuple, corners), n)
    return surface


def cube_in_cube(problem, n):
    problem.add(cube("c1", 0.5, n))
    problem.add(cube("ground", 1.0, n))
    return 2 * 6 * (n + 2) ** 2


def two_spheres(problem, n):
    problem.add(sphere("c1", (0, 0, 0), 0.01, n))
    problem.add(sphere("c2", (0.05, 0, 0), 0.02, n))
    return 2 * 6 * n**2


def layered_spheres(problem, n):
    problem.add(sphere("c1", (0, 0, 0), 1e-3, n), outside_perm=4.0)
    problem.add(sphere("ground", (0, 0, 0), 2e-3, n), outside_perm=2.0)
    middle = sphere(None, (0, 0, 0), 1.5e-3, n)
    problem.add(middle, kind=fastcap2.Problem.DIELEC, inside_perm=4.0, outside_perm=2.0, r=(0, 0, 0), ref_point_inside=True)
    return 3 * 6 * n**2


def square_plates(problem, n):
    n *= 2
    for name, z in (("c1", 0.0), ("c2", 0.1)):
        plate = fastcap2.Surface(name=name)
        rectangle(plate, (0.0, 0.0, z), (1.0, 0.0, z), (0.0, 1.0, z), n)
        problem.add(plate)
    return 2 * (n + 2) ** 2


def disc(surface, height, radius, n):
    """n rings, ever narrower towards the rim, of 4 n panels each; the polygon has the area of the circle."""
    turns = np.linspace(0, 2 * math.pi, 4 * n + 1)
    step = turns[1]
    radii = radius * math.sqrt(step / math.sin(step)) * np.sin(np.linspace(0, math.pi / 2, n + 1))

    def at(ring, turn):
        return (float(radii[ring] * math.cos(turn)), float(radii[ring] * math.sin(turn)), height)

    for a, b in zip(turns, turns[1:]):
        surface._add_tri(at(0, a), at(1, a), at(1, b))  # add_tri of this version wants four corners
        for ring in range(1, n):
            surface.add_quad(at(ring, a), at(ring + 1, a), at(ring + 1, b), at(ring, b))


def coaxial_discs(problem, n):
    for name, z in (("c1", 0.0), ("c2", 0.003)):
        surface = fastcap2.Surface(name=name)
        disc(surface, z, 0.03, n)
        problem.add(surface)
    return 2 * 4 * n * n


SCENES = {
    "cube-in-cube": cube_in_cube,
    "two-spheres": two_spheres,
    "layered-spheres": layered_spheres,
    "square-plates": square_plates,
    "coaxial-discs": coaxial_discs,
}


def main():
    options = argparse.ArgumentParser()
    options.add_argument("scene", choices=SCENES)
    options.add_argument("--seconds", type=float, default=50)
    chosen = options.parse_args()
    for multipoles in (2, 4):
        left, n = chosen.seconds / 2, 6
        while True:
            begin = (time.perf_counter(), time.process_time())
            problem = fastcap2.Problem()
            problem.iter_tol = 1e-3
            problem.expansion_order = multipoles
            panels = SCENES[chosen.scene](problem, n)
            c = problem.solve()
            names = [name.split("%")[0] for name in problem.conductors()]
            one, two = names.index("c1"), 1 - names.index("c1")
            entries = {"C11": c[one][one], "C22": c[two][two], "C12": c[one][two]}
            entries["C"] = two_terminal(entries["C11"], entries["C12"], entries["C22"])
            took = time.perf_counter() - begin[0]
            line = dict(setting=f"{panels} panels, multipoles {multipoles}", unknowns=panels, entries=entries, stated=None,
                        seconds=took, cpu_seconds=time.process_time() - begin[1])
            print(json.dumps(line), flush=True)
            left -= took
            if 6 * took > left:
                break
            n *= 2


if __name__ == "__main__":
    main()
