#!/usr/bin/env python3
"""How time and unknowns of a layer grow as it is asked for more exactly: runs, a table, and docs/pictures/layer-growth.svg.

    pip install matplotlib
    cargo build --release
    python3 benches/layer_growth.py [--binary target/release/elastocap]

In the plane the pair of cases/in-plane-pair.toml under a plate at 10, 20 and 30 %, in space tests/acceptance/pair-own-footprint.toml, each
to several tolerances of the force and of the capacitance. Seconds are of the processor, for the whole command.
"""

import argparse
import json
import pathlib
import re
import resource
import subprocess
import tempfile

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot as plt

ROOT = pathlib.Path(__file__).resolve().parent.parent
PLANE = """[mechanics.plane_strain]
indenter = "whole-top"
end = "free-on-substrate"
width = "500 um"
relative_tolerance = {}
"""


def in_the_plane(tolerance, of_field):
    text = (ROOT / "cases/in-plane-pair.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?ms)^\[mechanics[^\n]*\n.*?(?=^\[(?!mechanics))", PLANE.format(tolerance), text, count=1)
    text = re.sub(r"(?m)^half_length.*\n", "", text)
    text = text.replace("[layer]\n", '[layer]\nhalf_length = "1 mm"\n', 1)
    text = re.sub(r"(?m)^compression *=.*$", "compression = [0.1, 0.2, 0.3]", text)
    return re.sub(r"(?ms)(^\[electrostatics\].*?^relative_tolerance *= *)\S+", rf"\g<1>{of_field}", text)


def in_space(tolerance, of_field):
    text = (ROOT / "tests/acceptance/found3/pair-own-footprint.toml").read_text(encoding="utf-8")
    text = text.replace("relative_tolerance = 1e-2", f"relative_tolerance = {of_field}")
    return text.replace("relative_tolerance = 5e-2", f"relative_tolerance = {tolerance}")


def run(binary, text):
    """Unknowns, processor seconds, seconds of the layer by the clock, and the largest error that is stated of a force."""
    with tempfile.TemporaryDirectory() as folder:
        case = pathlib.Path(folder) / "case.toml"
        case.write_text(text, encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([binary, "run", case, "-o", f"{folder}/out", "--quiet", "--only", "json"], check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        result = json.loads(pathlib.Path(f"{folder}/out/result.json").read_text(encoding="utf-8"))
    stated = max((step.get("layer") or {}).get("relative_error_estimate") or 0.0 for step in result["steps"])
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return result["layer_meshes"][-1]["unknowns"], seconds, result["layer_seconds"], stated


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    binary = parser.parse_args().binary
    kinds = {
        "plane strain": (in_the_plane, [(1e-1, 3e-2), (3e-2, 3e-2), (1e-2, 1e-2), (3e-3, 3e-3), (1e-3, 1e-3)]),
        "space": (in_space, [(1e-1, 1e-1), (5e-2, 1e-2), (3e-2, 1e-2), (1e-2, 5e-3)]),
    }
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), constrained_layout=True)
    print("| | asked of force, of C | unknowns | stated of the force | layer | processor time |\n|---|---|---|---|---|---|")
    for name, (text, tolerances) in kinds.items():
        rows = [(asked, *run(binary, text(*asked))) for asked in tolerances]
        for asked, unknowns, seconds, layer, stated in rows:
            print(f"| {name} | {asked[0]:g}, {asked[1]:g} | {unknowns:,} | {stated:.1e} | {layer:.2f} s | {seconds:.2f} s |")
        for axis, values, label in [(axes[0], [r[1] for r in rows], "unknowns"), (axes[1], [r[2] for r in rows], "processor time, s")]:
            axis.loglog([r[0][0] for r in rows], values, "o-", label=name)
            axis.set(xlabel="relative error asked of the force", ylabel=label)
            axis.grid(alpha=0.3)
    for axis in axes:
        axis.invert_xaxis()
        axis.legend()
    figure.savefig(ROOT / "docs/pictures/layer-growth.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
