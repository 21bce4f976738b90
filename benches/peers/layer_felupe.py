"""A soft layer with a pair of stiff electrodes under a plate, in plane strain at large strain, by FElupe.

The scene is `pair` of layer_ngsolve.py: 450 um of Mooney-Rivlin rubber (in plane strain the same as neo-Hooke) bonded to a
substrate, half of it, 1 mm long, pressed by a smooth plate over its whole top to 10, 20 and 30 %. Its end is free and may
come down on the substrate. Install and run:

    pip install -r benches/peers/requirements.txt
    OMP_NUM_THREADS=1 python benches/peers/layer_felupe.py --size 1 --element quad9

The fields are displacement, pressure and volume ratio, with the bulk modulus 50,000 times the shear modulus (--bulk).
Elements: quad is bilinear with constant pressure; quad8 has eight nodes and constant pressure; quad9 has nine nodes and a
bilinear pressure, continuous in the rubber and continuous in the electrode. The end touches the substrate by a penalty at
its nodes. The Newton steps printed leave out those of load steps that failed; the processor seconds do not.
"""

import argparse
import warnings

import felupe
import numpy as np

from layer_scene import H, KNOWN, SHEAR, STIFF, WIDTH, pair_lines, tell


def grid(size, element):
    xs, ys = pair_lines(size)
    n, m = len(xs), len(ys)
    points = np.array([(x, y) for x in xs for y in ys])
    first = np.array([i * m + j for i in range(n - 1) for j in range(m - 1)])
    mesh = felupe.Mesh(points, np.stack([first, first + m, first + m + 1, first + 1], axis=1), "quad")
    if element != "quad":
        mesh = mesh.add_midpoints_edges()
    return mesh.add_midpoints_faces() if element == "quad9" else mesh


def main(size, element, bulk, step, stiffness, pardiso):
    solver = {}
    if pardiso:
        import pypardiso

        solver["solver"] = pypardiso.spsolve
    mesh = grid(size, element)
    x, y = mesh.points.T
    cx, cy = mesh.points[mesh.cells[:, :4]].mean(axis=1).T
    stiff = (25 < cx) & (cx < 325) & (215 < cy) & (cy < 235)
    kinds = {"quad": felupe.RegionQuad, "quad8": felupe.RegionQuadraticQuad, "quad9": felupe.RegionBiQuadraticQuad}
    own = {}
    if element == "quad9":  # a continuous pressure in the rubber, and another in the electrode
        names, cells = np.unique(mesh.cells[:, :4] + mesh.npoints * stiff[:, None], return_inverse=True)
        own["mesh"] = felupe.Mesh(np.zeros((len(names), 2)), cells.reshape(-1, 4), "quad")
    field = felupe.FieldsMixed(kinds[element](mesh), n=3, planestrain=True, **own)
    shear = np.where(stiff, STIFF, SHEAR)
    law = felupe.NeoHooke(mu=shear)
    mixed = felupe.NearlyIncompressible(law, bulk=bulk * shear)
    for each in (law, mixed):  # all elements at once: in portions, FElupe does not cut moduli given per element
        each.gradient, each.hessian = each._gradient, each._hessian
    solid = felupe.SolidBody(mixed, field)
    end, corner = np.flatnonzero((x == 1000) & (y > 0)), np.flatnonzero((x == 1000) & (y == 0))[0]
    substrate = felupe.ContactRigidPlane(field, points=end, centerpoint=corner, normal=[0, 1], multiplier=stiffness)
    bounds = {
        "axis": felupe.Boundary(field[0], fx=0.0, skip=(0, 1)),
        "bottom": felupe.Boundary(field[0], fy=0.0),
        "top": felupe.Boundary(field[0], fy=H, skip=(1, 0)),
    }
    inner = np.flatnonzero(np.isclose(x, 25) & (y > 215 - 1e-6) & (y < 235 + 1e-6))
    inner = inner[np.argsort(y[inner])]
    now, iterations = 0.0, 0
    for target in KNOWN["pair"]:
        width = step
        while now < target - 1e-9:
            width = min(width, target - now)
            keep = [f.values.copy() for f in field.fields]
            bounds["top"].update(-(now + width) * H)
            dof0, dof1 = felupe.dof.partition(field, bounds)
            load = dict(dof0=dof0, dof1=dof1, ext0=felupe.dof.apply(field, bounds, dof0))
            try:
                result = felupe.newtonraphson(items=[solid, substrate], **load, tol=1e-6, verbose=0, **solver)
            except (felupe.tools._newton.NewtonConvergenceError, RuntimeError):
                for f, values in zip(field.fields, keep):
                    f.values[:] = values
                width /= 2
                if width < 1e-4:
                    raise SystemExit(f"no solution past {now:.4f}")
                continue
            iterations += result.iterations
            now += width
        u = field[0].values
        force = 2e-6 * WIDTH * abs(np.asarray(result.fun)[: u.size].reshape(-1, 2)[np.isclose(y, H), 1].sum())
        gap = 50 + 2 * np.trapezoid(u[inner, 0], y[inner]) / 20
        tell("pair", target, len(dof1), iterations, force, gap)


np.seterr(all="ignore")
warnings.simplefilter("ignore")
parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--size", type=float, default=1.0, help="factor on the sizes of the elements")
parser.add_argument("--element", choices=["quad", "quad8", "quad9"], default="quad9")
parser.add_argument("--bulk", type=float, default=5e4, help="bulk modulus over shear modulus")
parser.add_argument("--step", type=float, default=0.05, help="compression of a load step, halved where Newton fails")
parser.add_argument("--stiffness", type=float, default=1e5, help="penalty of the substrate at a point of the end")
parser.add_argument("--pardiso", action="store_true", help="solve with pypardiso in place of SciPy")
main(**vars(parser.parse_args()))
