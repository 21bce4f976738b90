"""The pair of electrodes under a block with rounded edges, in space, by CalculiX: scene `footprint` of layer_ngsolve.py.

    apt-get install calculix-ccx
    OMP_NUM_THREADS=1 python benches/peers/layer_block_calculix.py --size 1.4 --bulk 300 --penalty 300

A quarter of the layer on the same graded grid of bricks as in NGSolve, of C3D20R (20 nodes, reduced integration), with the
true Mooney-Rivlin law and a bulk modulus of --bulk times the shear modulus, pressed to 10 % by a stiff fixed block of one
layer of bricks. Contact is surface to surface without friction, --penalty in kPa per um. Processor seconds are those of
this script and of ccx.
"""

import argparse
import pathlib
import subprocess
import tempfile

import numpy as np

from layer_calculix import listing
from layer_scene import C01, C10, H, STIFF, footprint_lines, tell

CORNERS = [(a, b, c) for c in (0, 2) for a, b in ((0, 0), (2, 0), (2, 2), (0, 2))]
RING = [(1, 0), (2, 1), (1, 2), (0, 1)]
ROUND = CORNERS + [(a, b, c) for c in (0, 2) for a, b in RING] + [(a, b, 1) for a, b in ((0, 0), (2, 0), (2, 2), (0, 2))]


def element(number, nodes):
    words = [str(word) for word in (number, *nodes)]
    return ", ".join(words[:15]) + (",\n" + ", ".join(words[15:]) if words[15:] else "")


def block(first):
    """Nodes and bricks of the block; past the rounding it goes on flat, where nothing touches it."""
    xs, zs = [-20, 150, 300, 400, *np.linspace(421, 498, 8)], [-20, 80, 150, *np.linspace(171, 248, 8)]
    at, number = {}, {}
    for i, x in enumerate(xs):
        for k, z in enumerate(zs):
            radius = min(np.hypot(max(x - 410, 0), max(z - 160, 0)), 88)
            for j, y in enumerate((H + 90 - np.sqrt(90**2 - radius**2) + 1e-4, H + 120)):
                number[i, j, k] = first + len(at)
                at[number[i, j, k]] = (x, y, z)
    cells = [(i, k) for i in range(len(xs) - 1) for k in range(len(zs) - 1)]
    return at, [[number[i + a // 2, b // 2, k + c // 2] for a, b, c in CORNERS] for i, k in cells]


def write(path, size, bulk, penalty, increment):
    xs, ys, zs = (np.interp(np.arange(0, len(p) - 0.75, 0.5), np.arange(len(p)), p) for p in footprint_lines(size))
    at, cells, stiff, touched = {}, [], [], []
    for i in range(0, len(xs) - 1, 2):
        for j in range(0, len(ys) - 1, 2):
            for k in range(0, len(zs) - 1, 2):
                cells.append([1 + ((i + a) * len(ys) + j + b) * len(zs) + k + c for a, b, c in ROUND])
                at.update({n: (xs[i + a], ys[j + b], zs[k + c]) for n, (a, b, c) in zip(cells[-1], ROUND)})
                if 25 < xs[i + 1] < 325 and 215 < ys[j + 1] < 235 and zs[k + 1] < 250:
                    stiff.append(len(cells))
                if j == len(ys) - 3 and xs[i] < 560 and zs[k] < 310:
                    touched.append(len(cells))
    block_at, block_cells = block(len(xs) * len(ys) * len(zs) + 1)
    inner = {n: p for n, p in at.items() if abs(p[0] - 25) < 1e-6 and 214.9 < p[1] < 235.1 and p[2] < 250.1}
    text = ["*NODE"] + [f"{n}, {x:.9g}, {y:.9g}, {z:.9g}" for n, (x, y, z) in {**at, **block_at}.items()]
    text += ["*ELEMENT, TYPE=C3D20R, ELSET=ALL"] + [element(e, nodes) for e, nodes in enumerate(cells, 1)]
    text += ["*ELEMENT, TYPE=C3D8, ELSET=BLOCK"]
    text += [element(e, nodes) for e, nodes in enumerate(block_cells, len(cells) + 1)]
    planes = {"BOTTOM": (1, 0), "AXIS": (0, 0), "END": (0, xs[-1]), "AXIS3": (2, 0)}
    for name, (axis, place) in planes.items():
        text += listing("NSET", name, [n for n, p in at.items() if p[axis] == place])
    text += listing("NSET", "MOVED", block_at) + listing("NSET", "INNER", inner) + listing("ELSET", "STIFF", stiff)
    text += listing("ELSET", "RUBBER", sorted(set(range(1, len(cells) + 1)) - set(stiff)))
    for name, c10, c01 in (("RUBBER", C10, C01), ("STIFF", STIFF / 2, 0.0)):
        text += [f"*MATERIAL, NAME={name}", "*HYPERELASTIC, MOONEY-RIVLIN", f"{c10}, {c01}, {1 / (bulk * (c10 + c01)):.9g}"]
        text += [f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"]
    text += ["*MATERIAL, NAME=BLOCK", "*ELASTIC", "1e5, 0.3", "*SOLID SECTION, ELSET=BLOCK, MATERIAL=BLOCK"]
    text += ["*SURFACE, NAME=TOP, TYPE=ELEMENT"] + [f"{e}, S5" for e in touched]
    text += ["*SURFACE, NAME=UNDER, TYPE=ELEMENT", "BLOCK, S3", "*SURFACE INTERACTION, NAME=TOUCH"]
    text += ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{penalty}, 1e-3, 1e-3"]
    text += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "TOP, UNDER"]
    text += ["*BOUNDARY", "BOTTOM, 1, 3", "AXIS, 1, 1", "END, 1, 1", "AXIS3, 3, 3", "MOVED, 1, 1", "MOVED, 3, 3"]
    text += ["*STEP, NLGEOM, INC=200", "*STATIC", f"{increment}, 1., 1e-4", "*BOUNDARY", f"MOVED, 2, 2, {-0.1 * H}"]
    text += ["*NODE PRINT, NSET=BOTTOM, TOTALS=ONLY, FREQUENCY=1000", "RF"]
    text += ["*NODE PRINT, NSET=INNER, FREQUENCY=1000", "U", "*END STEP"]
    path.write_text("\n".join(text) + "\n")
    return inner, 3 * len(at)


def read(path, inner):
    """Force on the quarter, and the mean of u1 over the inner face by the trapezoidal rule along x2 and then x3."""
    lines = path.read_text().splitlines()
    total = next(lines[k + 2] for k, text in enumerate(lines) if text.startswith(" total force"))
    start = next(k for k, text in enumerate(lines) if text.startswith(" displacements")) + 2
    rows = [row.split() for row in lines[start : start + len(inner)]]
    along = {}
    for number, u, *_ in rows:
        _, y, z = inner[int(number)]
        along.setdefault(z, []).append((y, float(u)))
    means = {z: np.trapezoid(*np.array(sorted(points)).T[::-1]) / 20 for z, points in along.items()}
    zs = sorted(means)
    return abs(float(total.split()[1])), np.trapezoid([means[z] for z in zs], zs) / 250


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=float, default=1.4, help="factor on the sizes of the elements")
    parser.add_argument("--bulk", type=float, default=300.0, help="bulk modulus over shear modulus")
    parser.add_argument("--penalty", type=float, default=300.0, help="contact stiffness, kPa per um")
    parser.add_argument("--increment", type=float, default=0.02, help="first increment, of the whole load")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        inner, unknowns = write(folder / "block.inp", args.size, args.bulk, args.penalty, args.increment)
        log = subprocess.run(["ccx", "block"], cwd=folder, capture_output=True, text=True).stdout
        if "Job finished" not in log:
            raise SystemExit("ccx did not get through:\n" + "\n".join(log.splitlines()[-14:]))
        force, moved = read(folder / "block.dat", inner)
    tell("footprint", 0.1, unknowns, log.count(" iteration "), 4e-6 * force, 50 + 2 * moved)
