"""What the peers of the layer have in common: the material, the places of the grid lines and the known values.

Lengths in um, stresses in kPa. The rubber is of Mooney and Rivlin, W = C10 (I1 - 3) + C01 (I2 - 3), the electrodes are
neo-Hookean with the shear modulus STIFF, and both are incompressible or, where a program cannot do that, nearly so.
"""

import os

import numpy as np

H, C10, C01, STIFF, WIDTH = 450.0, 0.68215, 43.9319, 1000.0, 500.0
SHEAR = 2 * (C10 + C01)
KNOWN = {  # compression: force in mN, gap between the electrodes in um
    "pair": {0.1: (98.975, 69.827), 0.2: (254.46, 98.278), 0.3: (535.23, 137.22)},
    "footprint": {0.1: (34.384, 57.221)},  # layer_ngsolve.py itself, --size 1.4 --order 3; nothing independent is at hand
    "footprint, neo-Hooke": {0.1: (31.92, 58.12)},  # tetrahedra, still moving
}


def line(stops, size, growth=0.35):
    """Points through the stops (place, distance of the points there); the distance grows by `growth` per length between."""
    points = [stops[0][0]]
    for (a, ha), (b, hb) in zip(stops, stops[1:]):
        t = np.linspace(a, b, 801)
        middle = (t[1:] + t[:-1]) / 2
        wanted = size * np.minimum(ha + growth * (middle - a), hb + growth * (b - middle))
        count = np.concatenate([[0], np.cumsum((t[1] - t[0]) / wanted)])
        n = max(1, round(count[-1]))
        points += list(np.interp(np.arange(1, n + 1) * count[-1] / n, count, t))
    return np.array(points)


def pair_lines(size):
    """Grid lines along x1 and x2 of half the pair."""
    return line([(0, 20), (25, 5), (325, 5), (1000, 20)], size), line([(0, 20), (215, 5), (235, 5), (H, 40)], size)


def footprint_lines(size):
    """Grid lines along x1, x2 and x3 of a quarter of the pair under the block."""
    xs = line([(0, 20), (25, 14), (325, 25), (410, 45), (500, 22), (1400, 400)], size, 0.5)
    ys = line([(0, 70), (215, 20), (235, 20), (H, 30)], size, 0.5)
    return xs, ys, line([(0, 100), (160, 45), (250, 22), (800, 250)], size, 0.5)


def tell(scene, compression, unknowns, steps, force, gap):
    off = [100 * (value / known - 1) for value, known in zip((force, gap), KNOWN[scene][compression])]
    seconds = sum(os.times()[:4])
    print(
        f"{compression:.0%} | {unknowns} unknowns | {steps} Newton steps | force {force:.3f} mN, {off[0]:+.3f} % | "
        f"gap {gap:.3f} um, {off[1]:+.3f} % | {seconds:.2f} s",
        flush=True,
    )
