#!/usr/bin/env python3
"""By how much forces in plane strain are larger than in three dimensions, under plates over the whole top and punches of several sizes.

    benches/forces_in_space.py [--binary target/release/elastocap] [--seconds 120]

An empty layer of 1 mm of rubber is pressed by 5 % in both models. Each line has half the width along x1 and half the length along x3 of what
presses, in thicknesses, the two forces over mu U w, and the share that the program states as the error of plane strain (docs/trust.md).
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
PLATES = [(1, 1), (2, 1), (2, 2), (2, 4), (4, 2), (4, 4), (4, 8), (8, 5.5), (8, 8)]
PUNCHES = [(2, 1), (2, 2), (6, 6)]
BEYOND = 3  # thicknesses of the layer on each side of a punch


def case(mechanics, punch, half_width, half_length):
    """The text of a layer under a plate or a punch, in thicknesses of 1 mm."""
    beyond = BEYOND if punch else 0
    width = 2 * (half_length + (beyond if mechanics == "solid" else 0))
    depth = f', half_depth = "{half_length} mm"' if mechanics == "solid" else ""
    indenter = f'{{ flat_punch = {{ half_width = "{half_width} mm"{depth}, corner_radius = "100 um" }} }}' if punch else '"whole-top"'
    side = 'side = "free"\n' if mechanics == "solid" else ""
    return f"""format = 1
[layer]
thickness = "1 mm"
half_length = "{half_width + beyond} mm"
relative_permittivity = 2.8
[layer.material.neo_hookean]
shear_modulus = "100 kPa"
[mechanics.{mechanics}]
indenter = {indenter}
end = "free-on-substrate"
{side}width = "{width} mm"
relative_tolerance = 5e-2
[load]
compression = [0.05]
"""


def step(binary, text, folder, seconds):
    """The only step of a run; `None` where it was not reached."""
    path, out = folder / "case.toml", folder / "out"
    path.write_text(text)
    subprocess.run(["rm", "-rf", out], check=True)
    subprocess.run([binary, "run", path, "-o", out, "--quiet", "--no-fields", "--max-time", f"{seconds}s"], capture_output=True)
    result = out / "result.json"
    return json.loads(result.read_text())["steps"][0] if result.exists() else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    parser.add_argument("--seconds", type=int, default=120)
    asked = parser.parse_args()
    print("| what presses | half-width | half-length | plane strain | three dimensions | larger by | stated |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for punch, sizes in [(False, PLATES), (True, PUNCHES)]:
            for half_width, half_length in sizes:
                plane, space = (
                    step(asked.binary, case(mechanics, punch, half_width, half_length), pathlib.Path(folder), asked.seconds)
                    for mechanics in ("plane_strain", "solid")
                )
                unit = 0.1 * 1e6 * 0.05e-3 * 2e-3 * half_length
                name = "punch" if punch else "plate"
                if not plane or not space or not space.get("force_n"):
                    print(f"| {name} | {half_width} H | {half_length} H | | not reached | | |", flush=True)
                    continue
                larger = plane["force_n"] / space["force_n"] - 1
                # The error is relative to the force in plane strain, and has the share of its finite elements.
                stated = plane["force_error_estimate"] - (plane["layer"]["relative_error_estimate"] or 0)
                numbers = f"{plane['force_n'] / unit:.1f} | {space['force_n'] / unit:.1f} | {100 * larger:.0f} % | {100 * (1 / (1 - stated) - 1):.0f} %"
                print(f"| {name} | {half_width} H | {half_length} H | {numbers} |", flush=True)


if __name__ == "__main__":
    main()
