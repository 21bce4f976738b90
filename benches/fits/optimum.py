#!/usr/bin/env python3
"""Gap and width of the in-plane pair for the largest sensitivity, by `elastocap optimise` and by a grid of runs: tables of docs/design.md.

    cargo build --release
    python3 benches/fits/optimum.py target/release/elastocap

Ends with an error if a place on the grid within the limits has more than the optimum, beyond what the bounds leave open.
"""

import csv
import itertools
import json
import pathlib
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
CASE = ROOT / "cases/in-plane-pair.toml"
GAPS = [20, 40, 60, 90, 120, 160, 200]  # um
WIDTHS = [200, 300, 400, 500, 600, 700, 800]  # um
FORCE, SHARE = 0.1, 0.15  # N, and the share below and above between which the sensitivity is a difference
SEARCHES = [("C0 > 30fF", lambda c0: c0 > 30e-15), ("C0 < 40fF", lambda c0: c0 < 40e-15)]


def sensitivity(binary, folder, gap, width):
    """|dC/dF| in F/N and C0 in F at one place of the grid."""
    text = CASE.read_text()
    loads = [0.0, FORCE * (1 - SHARE), FORCE * (1 + SHARE)]
    changes = [
        ('gap           = "50 um"', f'gap = "{gap} um"'),
        ('width         = "500 um"', f'width = "{width} um"'),
        ("compression = [0.0, 0.05, 0.1, 0.2, 0.3, 0.4]", "force = [" + ", ".join(f'"{load} N"' for load in loads) + "]"),
    ]
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "grid.toml").write_text(text)
    run = [binary, "run", "grid.toml", "-o", "out", "--quiet", "--no-fields", "--no-scene"]
    subprocess.run(run, check=True, cwd=folder, stderr=subprocess.DEVNULL)
    with (folder / "out/curve.csv").open() as file:
        c = [float(row["capacitance_f"]) for row in csv.DictReader(file)]
    return abs(c[2] - c[1]) / (loads[2] - loads[1]), c[0]


def search(binary, limit):
    begin = time.monotonic()
    command = [binary, "optimise", str(CASE), "--quiet", "--json", "--maximise", f"sensitivity at {FORCE} N", "--subject", limit]
    for key, low, high in [("gap", GAPS[0], GAPS[-1]), ("width", WIDTHS[0], WIDTHS[-1])]:
        command += ["--vary", f"electrodes.in_plane_pair.{key}={low}um..{high}um"]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return found, time.monotonic() - begin


def main():
    binary = str(pathlib.Path(sys.argv[1]).resolve()) if len(sys.argv) > 1 else "elastocap"
    with tempfile.TemporaryDirectory() as name:
        grid = {place: sensitivity(binary, pathlib.Path(name), *place) for place in itertools.product(GAPS, WIDTHS)}
    print("sensitivity at 0.1 N in fF/N, and C0 in fF, by gap (down) and width (across) in um")
    print("| |" + "|".join(f" {width} " for width in WIDTHS) + "|")
    print("|---|" + "---|" * len(WIDTHS))
    for gap in GAPS:
        cells = [f"{1e15 * grid[gap, w][0]:.2f}, {1e15 * grid[gap, w][1]:.1f}" for w in WIDTHS]
        print(f"| {gap} | " + " | ".join(cells) + " |")
    print()
    print("| limit | gap, um | width, um | sensitivity, fF/N | C0, fF | evaluations | time | best of the grid, fF/N | at gap, width |")
    print("|---|---|---|---|---|---|---|---|---|")
    missed = False
    for limit, is_allowed in SEARCHES:
        found, taken = search(binary, limit)
        gap, width = (1e6 * value for value in found["best"].values())
        allowed = {place: s for place, (s, c0) in grid.items() if is_allowed(c0)}
        place = max(allowed, key=allowed.get)
        evaluations = found["search"]["evaluations"]
        best = evaluations[found["search"]["best"]]
        print(
            f"| {limit} | {gap:.1f} | {width:.1f} | {1e15 * best['objective']:.2f} | {1e15 * best['limited'][0]:.2f} | {len(evaluations)} "
            f"| {taken:.1f} s | {1e15 * allowed[place]:.2f} | {place[0]}, {place[1]} |"
        )
        missed |= allowed[place] > best["objective"] * (1 + 1e-3)
    sys.exit("a place on the grid has more than the optimum" if missed else 0)


if __name__ == "__main__":
    main()
