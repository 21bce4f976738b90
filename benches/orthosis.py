#!/usr/bin/env python3
"""C1 of the orthosis sensor over the displacement of its upper conductor, beside what was measured: the tables of docs/orthosis.md.

    cargo build --release
    python3 benches/orthosis.py target/release/elastocap
"""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
CASES = ["orthosis", "orthosis-shielded"]
GAP_AT_REST = 6.0
CLOSED = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5]


def computed(binary, case, displacement, folder):
    """C1 and its bounds in pF with the upper conductor lower by `displacement` mm."""
    text = (ROOT / "cases" / f"{case}.toml").read_text()
    at_rest = 'box  = { min = ["12 mm", "21 mm", "0 mm"], max = ["23 mm", "23 mm", "23 mm"] }'
    assert text.count(at_rest) == 1, case
    moved = at_rest.replace('"21 mm"', f'"{21 - displacement} mm"').replace('"23 mm", "23 mm", ', f'"23 mm", "{23 - displacement} mm", ')
    path = folder / f"{case}.toml"
    path.write_text(text.replace(at_rest, moved))
    run = [binary, "run", str(path), "-o", str(folder / case), "--json", "--quiet", "--no-fields", "--no-scene"]
    found = json.loads(subprocess.run(run, check=True, capture_output=True, text=True).stdout)
    return [1e12 * found[key] for key in ("capacitance_f", "capacitance_lower_f", "capacitance_upper_f")]


def closing(curve, ratio):
    """By how many mm the gap closes until the computed C1 is `ratio` times that at rest, linear in 1/C1 between neighbours."""
    inverse = [curve[0] / c for c in curve]
    for k in range(len(CLOSED) - 1):
        if inverse[k] >= 1 / ratio >= inverse[k + 1]:
            share = (inverse[k] - 1 / ratio) / (inverse[k] - inverse[k + 1])
            return CLOSED[k] + share * (CLOSED[k + 1] - CLOSED[k])
    return None


def main():
    binary = sys.argv[1] if len(sys.argv) > 1 else "elastocap"
    with (ROOT / "docs/data/orthosis-v3.2.csv").open() as file:
        measured = list(csv.DictReader(line for line in file if not line.startswith("#")))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        curves = {case: [computed(binary, case, d, folder) for d in CLOSED] for case in CASES}
    loading = {float(row["displacement_mm"]): row for row in measured if row["branch"] == "loading"}
    print("| displacement, mm | gap, mm | alone, pF | bounds, pF | in the shield, pF | bounds, pF | run 2, pF | run 3, pF |")
    print("|---|---|---|---|---|---|---|---|")
    for k, d in enumerate(CLOSED):
        cells = [f"{d:.1f}", f"{GAP_AT_REST - d:.1f}"]
        for case in CASES:
            value, lower, upper = curves[case][k]
            cells += [f"{value:.4f}", f"{lower:.4f} to {upper:.4f}"]
        cells += [loading[d]["c1_run2_pf"], loading[d]["c1_run3_pf"]]
        print("| " + " | ".join(cells) + " |")
    print()
    print("| branch | displacement, mm | run 2: C1 over that at rest | closing alone, mm | in the shield, mm |")
    print("|---|---|---|---|---|")
    rest = float(measured[0]["c1_run2_pf"])
    for row in measured:
        d = float(row["displacement_mm"])
        if d % 1.0 and d != 7.5:
            continue
        ratio = float(row["c1_run2_pf"]) / rest
        found = [closing([c[0] for c in curves[case]], ratio) for case in CASES]
        shown = [f"{f:.2f}" if f is not None else "" for f in found]
        print(f"| {row['branch']} | {d:.1f} | {ratio:.3f} | {shown[0]} | {shown[1]} |")


if __name__ == "__main__":
    main()
