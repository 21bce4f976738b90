#!/usr/bin/env python3
"""How often the total error of a capacitance covers the truth: drawn cases of all kinds, solved as asked and four times more sharply.

    benches/total_errors.py [--binary target/release/elastocap] [--count 300] [--seed 1] [--sharper 4] [--seconds 60]

A case is drawn by lot in one of four kinds. Three are layers under load with a pair or a comb inside (those of benches/layer_errors.py): in
closed form, in plane strain and in three dimensions. The sharp solution of all of them is in three dimensions, so that it is sharper in
the model of the layer too. The fourth kind is two or three boxes in open space or within grounded walls, without a layer. The difference of
the capacitances and of their changes is compared with what the first solution states: `total_error_estimate` and
`change_total_error_f`. Cases whose sharp solution is not reached within `--seconds`, or states more than a fraction (1.5 over `--sharper`) of the
error of the first one, say nothing and are counted.
"""

import argparse
import json
import pathlib
import random
import re
import subprocess
import sys
import tempfile

from layer_errors import ROOT, drawn, text

KINDS = ["closed form", "plane strain", "space", "boxes"]


def um(length):
    return f'"{length:.4g} um"'


def in_three_dimensions(layer, tolerances):
    """The text of a drawn layer in three dimensions, with a step at rest before the load."""
    return re.sub(r"compression = \[", "compression = [0.0, ", text(layer, tolerances))


def mechanics_of(case, tables):
    """The text of a case with other tables of mechanics."""
    return re.sub(r"\[mechanics\..*?(?=\[load\])", tables, case, flags=re.S)


def extent(layer):
    """Half-length and width, um, of what presses a drawn layer; `None` where a closed form has no such contact."""
    solid, indenter = layer[4], layer[5]
    width = float(solid["width"].split()[0])
    if indenter == '"whole-top"':
        return float(layer[1]["half_length"].split()[0]), width
    half_width = re.search(r'half_width = "([\d.e+-]+) um"', indenter)
    depth = re.search(r'half_depth = "([\d.e+-]+) um"', indenter)
    return half_width and (float(half_width[1]), 2 * float(depth[1]) if depth else width)


def layer_case(lot, kind):
    """Text of a layer as asked and in three dimensions, as functions of the tolerances of mechanics and field."""
    while True:
        layer = drawn(lot, False)
        contact = extent(layer)
        if layer[0][1] == "whole-top" and layer[4]["end"] == "far":
            continue
        if kind == "closed form" and (contact is None or layer[2][0] == "yeoh"):
            continue
        if kind == "plane strain" and layer[0][1] not in ("whole-top", "punch", "cylinder"):
            continue
        break
    solid = lambda tolerances: in_three_dimensions(layer, tolerances)
    if kind == "space":
        return " under ".join(layer[0]), solid, solid
    if kind == "closed form":
        half_length, width = contact
        tables = f"[mechanics.closed_form]\ncontact_half_length = {um(half_length)}\ncontact_width = {um(width)}\nshear_length = {um(half_length)}\n"
        return " under ".join(layer[0]), lambda tolerances: mechanics_of(solid(tolerances), tables), solid
    end = "free-on-substrate" if layer[0][1] == "whole-top" else layer[4]["end"]
    plane = lambda of_force: f'[mechanics.plane_strain]\nend = "{end}"\nwidth = "{layer[4]["width"]}"\nindenter = {layer[5]}\nrelative_tolerance = {of_force:g}\n'
    return " under ".join(layer[0]), lambda tolerances: mechanics_of(solid(tolerances), plane(tolerances[0])), solid


def boxes_case(lot):
    """Text of boxes without a layer, as a function of the tolerances."""
    count = lot.choice([2, 3])
    lines = ["format = 1"]
    for k in range(count):
        low = [4.0 * k * (axis == 0) + lot.uniform(0, 1) for axis in range(3)]
        high = [x + lot.uniform(0.2, 2.5) for x in low]
        point = lambda place: "[" + ", ".join(f'"{x:.3f} mm"' for x in place) + "]"
        lines += ["[[conductor]]", f'name = "box-{k}"', f"box = {{ min = {point(low)}, max = {point(high)} }}"]
    walls = 'boundary = "grounded"\nwalls = { min = ["-4 mm", "-4 mm", "-4 mm"], max = ["16 mm", "8 mm", "8 mm"] }'
    lines += ["[measure]", 'capacitance = ["box-0", "box-1"]', "[surroundings]", lot.choice(['boundary = "open"', walls])]
    make = lambda tolerances: "\n".join([*lines, "[electrostatics]", f"relative_tolerance = {tolerances[1]:g}"]) + "\n"
    return f"{count} boxes", make, make


def last_step(binary, case, folder, seconds):
    """The last step of a run, or why there is none. A run that was stopped has what it had found by then."""
    out = folder / case.stem
    run = [binary, "run", str(case), "-o", str(out), "--quiet", "--only", "json", "--max-time", f"{seconds}s"]
    ran = subprocess.run(run, capture_output=True, text=True)
    places = [out / "result.json", folder / f"{case.stem}.partial" / "result.json"]
    result = next((place for place in places if place.exists()), None)
    if result is None:
        said = [line for line in ran.stderr.splitlines() if line.startswith("error")]
        return None, said[0] if said else "not reached in time"
    found = json.loads(result.read_text())
    step = found["steps"][-1] if found.get("steps") else found
    if step.get("capacitance_f") is None:
        return None, "not reached in time" if step.get("status") == "not run" else step.get("reason") or "no capacitance"
    return step, None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sharper", type=float, default=4.0)
    parser.add_argument("--seconds", type=int, default=60)
    asked = parser.parse_args()
    lot = random.Random(asked.seed)
    ratios = {(kind, of): [] for kind in KINDS for of in ("C", "change")}
    without = dict.fromkeys(KINDS, 0)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for number in range(asked.count):
            kind = lot.choice(KINDS)
            label, coarse_text, sharp_text = boxes_case(lot) if kind == "boxes" else layer_case(lot, kind)
            tolerances = lot.choice([0.1, 0.05, 0.03]), lot.choice([5e-2, 2e-2, 1e-2])
            runs = []
            for name, make, part in [("coarse", coarse_text, 1.0), ("sharp", sharp_text, 1.0 / asked.sharper)]:
                case = folder / f"{number:03d}-{name}.toml"
                case.write_text(make([part * t for t in tolerances]))
                runs.append(last_step(asked.binary, case, folder, asked.seconds))
                if runs[-1][0] is None:
                    break
            if runs[-1][0] and asked.sharper * runs[-1][0]["total_error_estimate"] > 1.5 * runs[0][0]["total_error_estimate"]:
                runs[-1] = None, "not sharper"
            if runs[-1][0] is None:
                without[kind] += 1
                print(f"{number:3d} {kind:12s} {label:30s} without {['coarse', 'sharp'][len(runs) - 1]}: {runs[-1][1][:110]}", flush=True)
                continue
            coarse, sharp = runs[0][0], runs[1][0]
            value, total = coarse["capacitance_f"], coarse["total_error_estimate"]
            ratio = abs(value - sharp["capacitance_f"]) / (total * abs(value))
            ratios[kind, "C"].append((ratio, number))
            line = f"C {ratio:.2f} of {total:.1e}"
            changes = [step.get("change_f") for step in (coarse, sharp)]
            stated = coarse.get("change_total_error_f")
            if None not in changes and stated:
                ratio = abs(changes[0] - changes[1]) / stated
                ratios[kind, "change"].append((ratio, number))
                line += f"; change {ratio:.2f} of {stated / abs(changes[0]) if changes[0] else float('inf'):.1e}"
            print(f"{number:3d} {kind:12s} {label:30s} {line}", flush=True)
    for (kind, of), found in ratios.items():
        if found:
            ordered = sorted(ratio for ratio, _ in found)
            worst = ", ".join(f"{ratio:.2f} (case {number})" for ratio, number in sorted(found, reverse=True)[:3])
            print(f"{kind}, {of}: {sum(r <= 1 for r in ordered)} of {len(ordered)} covered, median {ordered[len(ordered) // 2]:.2f}, worst {worst}")
    covered = [ratio <= 1 for found in ratios.values() for ratio, _ in found]
    print(f"{sum(covered)} of {len(covered)} statements cover; without a sharp solution: {without}")


if __name__ == "__main__":
    sys.exit(main())
