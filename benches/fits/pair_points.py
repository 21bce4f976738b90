#!/usr/bin/env python3
"""The points of cases/fits/pair.csv: a computed curve, moved and with noise, to fit to.

    cargo build --release
    python3 benches/fits/pair_points.py target/release/elastocap > cases/fits/pair.csv
"""

import csv
import pathlib
import random
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
OFFSET_N, PARASITIC_F, NOISE_F = 4e-3, 12e-15, 0.1e-15


def curve(binary):
    """Forces and capacitances of the pair with a shear modulus of 60 kPa, at many steps."""
    text = (ROOT / "cases/fits/pair.toml").read_text().split("[measurement]")[0]
    text = text.replace('"90 kPa"', '"60 kPa"').replace("points = 9", "points = 33")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "pair.toml").write_text(text)
        run = [binary, "run", "pair.toml", "-o", "out", "--quiet", "--no-fields", "--no-scene"]
        subprocess.run(run, check=True, cwd=folder, stderr=subprocess.DEVNULL)
        with (folder / "out/curve.csv").open() as file:
            return [(float(row["force_n"]), float(row["capacitance_f"])) for row in csv.DictReader(file)]


def main():
    binary = str(pathlib.Path(sys.argv[1]).resolve()) if len(sys.argv) > 1 else "elastocap"
    steps = curve(binary)
    noise = random.Random(16)
    print("# Not measured: made by benches/fits/pair_points.py")
    print("force_mn,capacitance_ff")
    for k in range(24):
        force = 0.009 * k
        on_layer = max(force - OFFSET_N, 0.0)
        (f1, c1), (f2, c2) = next((a, b) for a, b in zip(steps, steps[1:]) if b[0] >= on_layer)
        c = c1 + (c2 - c1) * (on_layer - f1) / (f2 - f1)
        print(f"{1e3 * force:.1f},{1e15 * (c + PARASITIC_F + noise.gauss(0.0, NOISE_F)):.3f}")


if __name__ == "__main__":
    main()
