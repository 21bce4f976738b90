#!/usr/bin/env python3
"""How far the closed form is from plane strain, and plane strain from three dimensions: one pair, over its length along x3 and its stiffness.

    benches/model_errors.py [--binary target/release/elastocap] [--lengths 1 2 4 8 16] [--json FILE]

An in-plane pair (half a thickness of the layer and more along x1, gap of a ninth) lies at half the height of a layer of 450 um, of the
Mooney-Rivlin rubber of the README. What presses is a block with rounded edges, as long along x3 as the pair, on a layer that goes on; or a
plate over a layer that ends there, 1.1 thicknesses beyond the pair. Both are pressed by 10 %. The table has the changes of capacitance and gap and the force of the simpler
model over those of the better one, less 1.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
THICKNESS = 450.0  # um

CASE = """
format = 1
[layer]
thickness             = "450 um"
half_length           = "{half_length} um"
relative_permittivity = 2.8
[layer.material.mooney_rivlin]
c10 = "682.15 Pa"
c01 = "43931.9 Pa"
[electrodes.in_plane_pair]
gap           = "50 um"
length        = "300 um"
thickness     = "20 um"
width         = "{width} um"
height        = "225 um"
shear_modulus = "{stiffness}"
{mechanics}
[load]
compression = [0.0, {compression}]
[surroundings]
boundary    = "insulated"
side_margin = "1 mm"
below       = "insulated"
above       = {{ relative_permittivity = 1.0, thickness = "1 mm" }}
[electrostatics]
relative_tolerance = {tolerance}
"""


def rows(binary, folder, seconds, **values):
    """The load steps of a case, from result.json; `None` where the loaded one has no capacitance."""
    case, out = folder / "case.toml", folder / "out"
    case.write_text(CASE.format(**values))
    subprocess.run(["rm", "-rf", out], check=True)
    run = [binary, "run", case, "--output", out, "--no-fields", "--max-time", f"{seconds}s", "--quiet"]
    ended = subprocess.run(run, capture_output=True, text=True)
    if not (out / "result.json").exists():
        print(ended.stderr[-500:], file=sys.stderr)
        return None
    steps = json.loads((out / "result.json").read_text())["steps"]
    return steps if steps[-1].get("capacitance_f") else None


def compared(simple, better):
    """Changes of capacitance and gap and the force of the simpler model over those of the better one, less 1."""
    change = lambda steps, key: steps[-1][key] / steps[0][key] - 1.0
    numbers = lambda steps: [change(steps, "capacitance_f"), change(steps, "gap_m"), steps[-1]["force_n"]]
    return [a / b - 1.0 for a, b in zip(numbers(simple), numbers(better))]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    parser.add_argument("--lengths", type=float, nargs="+", default=[1, 2, 4, 8, 16])
    parser.add_argument("--stiffnesses", nargs="+", default=["90 kPa", "1 MPa", "rigid"])
    parser.add_argument("--compression", type=float, default=0.1)
    parser.add_argument("--tolerance", type=float, default=1e-2)
    parser.add_argument("--seconds", type=int, default=120)
    parser.add_argument("--json", help="a file for all numbers")
    asked = parser.parse_args()
    found = []
    print("| what presses | length along x3 | electrodes | closed form: change of C, gap, force | plane strain: change of C, gap, force | change of C in space |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for presses in ["block", "plate"]:
            for stiffness in asked.stiffnesses:
                for length in asked.lengths:
                    width = length * THICKNESS
                    ends = dict(plate="free-on-substrate", block="far")[presses]
                    punch = 'flat_punch = {{ half_width = "500 um", {depth}corner_radius = "45 um" }}'
                    plane = dict(plate='"whole-top"', block="{ " + punch.format(depth="") + " }")[presses]
                    depth = f'half_depth = "{0.5 * width} um", '
                    space = dict(plate='"whole-top"', block="{ " + punch.format(depth=depth) + " }")[presses]
                    beyond = width + dict(plate=2.2, block=8)[presses] * THICKNESS
                    side = "symmetric" if presses == "block" else "free"
                    models = {
                        "closed form": f'[mechanics.closed_form]\ncontact_half_length = "{dict(plate=1000, block=500)[presses]} um"\ncontact_width = "{beyond if presses == "plate" else width} um"\nshear_length = "500 um"',
                        "plane strain": f'[mechanics.plane_strain]\nindenter = {plane}\nend = "{ends}"\nwidth = "{beyond if presses == "plate" else width} um"\nrelative_tolerance = {asked.tolerance}',
                        "space": f'[mechanics.solid]\nindenter = {space}\nend = "{ends}"\nwidth = "{beyond} um"\nside = "{side}"\nrelative_tolerance = {asked.tolerance}',
                    }
                    half_length = dict(plate=1000, block=500 + 4 * THICKNESS)[presses]
                    values = dict(half_length=half_length, width=width, stiffness=stiffness, compression=asked.compression, tolerance=asked.tolerance)
                    all_rows = {name: rows(asked.binary, folder, asked.seconds, mechanics=text, **values) for name, text in models.items()}
                    closed, flat, solid = all_rows.values()
                    shown = lambda a, b: ", ".join(f"{100 * x:+.0f} %" for x in compared(a, b)) if a and b else "-"
                    total = f"{100 * (solid[-1]['capacitance_f'] / solid[0]['capacitance_f'] - 1):.2f} %" if solid else "-"
                    print(f"| {presses} | {length:g} H | {stiffness} | {shown(closed, flat)} | {shown(flat, solid)} | {total} |", flush=True)
                    found.append(dict(presses=presses, stiffness=stiffness, length=length, rows=all_rows))
    if asked.json:
        pathlib.Path(asked.json).write_text(json.dumps(found))


if __name__ == "__main__":
    main()
