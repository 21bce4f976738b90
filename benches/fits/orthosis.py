#!/usr/bin/env python3
"""The orthosis sensor fitted to its run 2 and compared with run 3, beside the formula C = A/(d + B) + C_b: tables of docs/fits.md.

    cargo build --release
    python3 benches/fits/orthosis.py target/release/elastocap

Ends with an error if the residuals of the fitted case are not below those of the formula.
"""

import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FREE = [
    "layer.foam.solid_permittivity=1.2..12",
    "layer.foam.solid_fraction=0.05..0.9",
    "parasitic",
    "offset=0mm..4mm@2.4mm",
]


def measured():
    with (ROOT / "docs/data/orthosis-v3.2.csv").open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {
        (run, branch): [(float(r["displacement_mm"]), float(r[f"c1_{run}_pf"])) for r in rows if r["branch"] == branch]
        for run in ["run2", "run3"]
        for branch in ["loading", "unloading"]
    }


def line_through(xy):
    """A and C_b of the least squares of y = A x + C_b, and the sum of squares."""
    n = len(xy)
    mx, my = sum(x for x, _ in xy) / n, sum(y for _, y in xy) / n
    a = sum((x - mx) * (y - my) for x, y in xy) / sum((x - mx) ** 2 for x, _ in xy)
    c = my - a * mx
    return a, c, sum((y - a * x - c) ** 2 for x, y in xy)


def formula(points):
    """C = A/(d + B) + C_b with d = 6 mm - displacement, by least squares over all three."""
    largest = max(u for u, _ in points)

    def squares(b):
        return line_through([(1 / (6 - u + b), c) for u, c in points])[2]

    low, high = math.log(1e-3), math.log(1e3)  # of d + B at the largest displacement
    for _ in range(200):
        left, right = low + (high - low) * 0.382, low + (high - low) * 0.618
        if squares(math.exp(left) + largest - 6) < squares(math.exp(right) + largest - 6):
            high = right
        else:
            low = left
    b = math.exp(low) + largest - 6
    a, c_b, _ = line_through([(1 / (6 - u + b), c) for u, c in points])
    return a, b, c_b


def rms(values):
    values = list(values)
    return math.sqrt(sum(v * v for v in values) / len(values))


def residuals(binary, text, folder, run, branch):
    """Measured less computed, pF, by displacement in mm as measured."""
    changed = text.replace("c1_run2_pf", f"c1_{run}_pf").replace('equals = "loading"', f'equals = "{branch}"')
    (folder / "case.toml").write_text(changed)
    command = [binary, "run", "case.toml", "-o", "out", "--quiet", "--no-fields", "--no-scene"]
    subprocess.run(command, check=True, cwd=folder, stderr=subprocess.DEVNULL)
    found = json.loads((folder / "out/result.json").read_text())["measured_points"]
    assert found["beyond_curve"] == 0, found["beyond_curve"]
    return [1e12 * point["residual_f"] for point in found["points"]]


def main():
    binary = str(pathlib.Path(sys.argv[1]).resolve()) if len(sys.argv) > 1 else "elastocap"
    data = measured()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        command = [binary, "fit", str(ROOT / "cases/fits/orthosis.toml"), "-o", str(folder / "fitted.toml")]
        for free in FREE:
            command += ["--free", free]
        print(subprocess.run(command, check=True, cwd=folder, capture_output=True, text=True).stdout)
        text = (folder / "fitted.toml").read_text()
        case = {key: residuals(binary, text, folder, *key) for key in data}
    a, b, c_b = formula(data["run2", "loading"])
    print(f"C = A/(d + B) + C_b: A = {a:.4f} pF mm, B = {b:.4f} mm, C_b = {c_b:.4f} pF\n")
    simple = {key: [c - a / (6 - u + b) - c_b for u, c in points] for key, points in data.items()}
    print("| points | fitted case, pF | formula, pF |")
    print("|---|---|---|")
    for run, branch in data:
        shown = f"{run[:3]} {run[3:]}, {branch}"
        print(f"| {shown} | {rms(case[run, branch]):.4f} | {rms(simple[run, branch]):.4f} |")
    between = [c2 - c3 for (_, c2), (_, c3) in zip(data["run2", "loading"], data["run3", "loading"])]
    print(f"\nrun 2 less run 3, loading: {rms(between):.4f} pF root mean square")
    loading, unloading = dict(data["run2", "loading"]), dict(data["run2", "unloading"])
    loops = [unloading[u] - loading[u] for u in unloading if u in loading]
    print(f"run 2, unloading less loading: {rms(loops):.4f} pF root mean square, {max(loops):.3f} pF at most")
    worse = [key for key in [("run2", "loading"), ("run3", "loading")] if rms(case[key]) >= rms(simple[key])]
    sys.exit(f"the formula has smaller residuals for {worse}" if worse else 0)


if __name__ == "__main__":
    main()
