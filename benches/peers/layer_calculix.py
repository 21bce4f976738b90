"""A soft layer with a pair of stiff electrodes under a plate, in plane strain at large strain, by CalculiX.

The scene is `pair` of layer_ngsolve.py: 450 um of Mooney-Rivlin rubber bonded to a substrate, half of it, 1 mm long, pressed
by a smooth plate over its whole top to 10, 20 and 30 %. Its end is free and may come down on the substrate. Install and run:

    apt-get install calculix-ccx
    OMP_NUM_THREADS=1 python benches/peers/layer_calculix.py --size 2 --bulk 1e3

The script writes an input file, runs ccx and reads its .dat file. CalculiX has no hyperelastic element with a pressure of
its own: incompressibility is by the bulk modulus (--bulk, over the shear modulus) and reduced integration. It makes the
plane-strain elements into bricks of one element's thickness itself. The substrate under the bulging end is a strip of
fixed elements with node-to-surface contact. Seconds are processor time of this script and of ccx together.
Lengths in um, stresses in kPa.

What gets through to 30 %: --size 2 --bulk 1e3 and --size 1.4 --bulk 500. Finer grids and stiffer rubber end with "too many
cutbacks" between 10 and 30 %; fully integrated elements (CPE8) get through but are much too stiff.
"""

import argparse
import pathlib
import subprocess
import tempfile

import numpy as np

from layer_scene import C01, C10, H, KNOWN, STIFF, WIDTH, pair_lines, tell

ROUND = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]  # the nodes of an element, in half elements


def listing(keyword, name, members):
    return [f"*{keyword}, {keyword}={name}"] + [f"{n}," for n in members]


def substrate(first_node, first_element, element):
    """A fixed strip below x2 = 0, with its nodes and elements numbered after those of the layer."""
    text, nodes = ["*NODE, NSET=STRIP"], {}
    for i in range(17):
        for j in range(3):
            if i % 2 == 0 or j % 2 == 0:
                nodes[i, j] = first_node + len(nodes)
                text.append(f"{nodes[i, j]}, {900 + 100 * i}, {10 * j - 20}, 0")
    text.append(f"*ELEMENT, TYPE={element}, ELSET=STRIP")
    for k in range(8):
        text.append(", ".join(map(str, [first_element + k, *(nodes[2 * k + a, b] for a, b in ROUND)])))
    text += ["*MATERIAL, NAME=STRIP", "*ELASTIC", "1e5, 0.3", "*SOLID SECTION, ELSET=STRIP, MATERIAL=STRIP", "1."]
    return text + ["*BOUNDARY", "STRIP, 1, 2", "*SURFACE, NAME=GROUND, TYPE=ELEMENT", "STRIP, S3"]


def write(path, size, element, bulk, increment):
    """The input file; returns the height of each node of the inner face, and the number of unknowns in the plane."""
    xs, ys = (np.interp(np.arange(0, len(p) - 0.75, 0.5), np.arange(len(p)), p) for p in pair_lines(size))
    at, elements, stiff = {}, [], []
    for i in range(0, len(xs) - 1, 2):
        for j in range(0, len(ys) - 1, 2):
            elements.append([1 + (i + a) * len(ys) + j + b for a, b in ROUND])
            at.update({n: (xs[i + a], ys[j + b]) for n, (a, b) in zip(elements[-1], ROUND)})
            if 25 < xs[i + 1] < 325 and 215 < ys[j + 1] < 235:
                stiff.append(len(elements))
    inner = {n: y for n, (x, y) in at.items() if abs(x - 25) < 1e-6 and 215 - 1e-6 < y < 235 + 1e-6}
    text = ["*NODE"] + [f"{n}, {x:.9g}, {y:.9g}, 0" for n, (x, y) in at.items()]
    text += [f"*ELEMENT, TYPE={element}, ELSET=ALL"]
    text += [", ".join(map(str, [e, *nodes])) for e, nodes in enumerate(elements, 1)]
    text += listing("NSET", "BOTTOM", [n for n, (x, y) in at.items() if y == 0])
    text += listing("NSET", "TOP", [n for n, (x, y) in at.items() if y == H])
    text += listing("NSET", "AXIS", [n for n, (x, y) in at.items() if x == 0]) + listing("NSET", "INNER", inner)
    text += listing("ELSET", "STIFF", stiff)
    text += listing("ELSET", "RUBBER", sorted(set(range(1, len(elements) + 1)) - set(stiff)))
    for name, c10, c01 in (("RUBBER", C10, C01), ("STIFF", STIFF / 2, 0.0)):
        text += [f"*MATERIAL, NAME={name}", "*HYPERELASTIC, MOONEY-RIVLIN", f"{c10}, {c01}, {1 / (bulk * (c10 + c01)):.9g}"]
        text += [f"*SOLID SECTION, ELSET={name}, MATERIAL={name}", "1."]
    text += substrate(len(xs) * len(ys) + 1, len(elements) + 1, element)
    text += ["*SURFACE, NAME=END, TYPE=ELEMENT"] + [f"{len(elements) - k}, S2" for k in range(len(ys) // 2)]
    text += ["*SURFACE INTERACTION, NAME=TOUCH", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", "1e3, 1e-3, 1e-3"]
    text += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=NODE TO SURFACE", "END, GROUND"]
    text += ["*BOUNDARY", "BOTTOM, 1, 2", "AXIS, 1, 1"]
    for compression in KNOWN["pair"]:
        text += ["*STEP, NLGEOM, INC=500", "*STATIC", f"{increment / 0.1:.9g}, 1., 1e-5"]
        text += ["*BOUNDARY", f"TOP, 2, 2, {-compression * H:.9g}"]
        text += ["*NODE PRINT, NSET=TOP, TOTALS=ONLY, FREQUENCY=1000", "RF"]
        text += ["*NODE PRINT, NSET=INNER, FREQUENCY=1000", "U", "*END STEP"]
    path.write_text("\n".join(text) + "\n")
    return inner, 2 * len(at)


def read(path, heights):
    """Force in kPa um and mean of u1 over the inner face, for each load that ccx came to."""
    result, lines = [], path.read_text().splitlines() if path.exists() else []
    for place, text in enumerate(lines):
        if text.startswith(" total force"):
            force = abs(float(lines[place + 2].split()[1]))
        if text.startswith(" displacements"):
            rows = [row.split() for row in lines[place + 2 : place + 2 + len(heights)]]
            y, u = np.array(sorted((heights[int(row[0])], float(row[1])) for row in rows)).T
            result.append((force, np.trapezoid(u, y) / 20))
    return result


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=float, default=2.0, help="factor on the sizes of the elements")
    parser.add_argument("--element", choices=["CPE8R", "CPE8"], default="CPE8R")
    parser.add_argument("--bulk", type=float, default=1e3, help="bulk modulus over shear modulus")
    parser.add_argument("--increment", type=float, default=0.1, help="first increment of compression")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        heights, unknowns = write(folder / "layer.inp", args.size, args.element, args.bulk, args.increment)
        log = subprocess.run(["ccx", "layer"], cwd=folder, capture_output=True, text=True).stdout
        found = read(folder / "layer.dat", heights)
    print("The Newton steps and the seconds are those of all loads together.")
    for compression, (force, moved) in zip(KNOWN["pair"], found):
        tell("pair", compression, unknowns, log.count(" iteration "), 2e-6 * WIDTH * force, 50 + 2 * moved)
    if len(found) < len(KNOWN["pair"]):
        print(f"ccx came to {len(found)} of the loads; the end of what it said:")
        print("\n".join(line for line in log.splitlines()[-14:] if line.strip()))
