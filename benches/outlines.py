#!/usr/bin/env python3
"""Times of scenes of outlines and boxes against the targets that were set for them; docs/extruded.md has some of the rows.

    benches/outlines.py [--binary target/release/elastocap] [--times 3] [--keep FOLDER] [NAME ...]

Each row is a case file that is run as a whole command, so often, and shown with its shortest and longest time; NAME picks rows by a part
of their name. `--keep` writes the case files that are made here into a folder, to be run by hand; those of the project are listed
with what is changed in them.
"""

import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent


def scene(bodies, tolerance):
    """A case of conductors in open space; `bodies` are their names with their shapes."""
    parts = ["format = 1\n"]
    parts += [f'[[conductor]]\nname = "{name}"\n{shape}\n' for name, shape in bodies]
    parts += [f'[surroundings]\nboundary = "open"\n\n[electrostatics]\nrelative_tolerance = {tolerance}\n']
    return "\n".join(parts)


def box(low, high, unit):
    corner = lambda x: "[" + ", ".join(f'"{value} {unit}"' for value in x) + "]"
    return f"box = {{ min = {corner(low)}, max = {corner(high)} }}"


def bus(n):
    """FastCap's bus crossing: n bars of 1 m x 1 m above n others."""
    long = 2 * n + 1
    below = [(f"a{k}", box([2 * k + 1, 0, 0], [2 * k + 2, 1, long], "m")) for k in range(n)]
    above = [(f"b{k}", box([0, 2, 2 * k + 1], [long, 3, 2 * k + 2], "m")) for k in range(n)]
    return scene(below + above, "1e-3")


def pads():
    """3 x 3 pads of 35 um under a common plate."""
    bodies = [
        (f"pad{i}{k}", box([1000 * i, 0, 1000 * k], [1000 * i + 800, 35, 1000 * k + 800], "um"))
        for i in range(3) for k in range(3)
    ]
    return scene(bodies + [("plate", box([-500, 335, -500], [3300, 370, 3300], "um"))], "1e-2")


def discs(distance):
    """Two coaxial discs of 3 mm without thickness, at a distance over the radius."""
    disc = lambda y: f'cylinder = {{ axis = "x2", base = ["0 mm", "{y} mm", "0 mm"], radius = "3 mm", height = "0 mm" }}'
    return scene([("a", disc(0)), ("b", disc(3 * distance))], "1e-4")


def changed(path, tolerance=None, solver=None, compression=None):
    """A case file of the project with other settings; paths in it are made absolute."""
    path = ROOT / path
    text = path.read_text()
    folder = path.parent.as_posix()
    text = re.sub(r'(file\s*=\s*")([^/"])', rf"\1{folder}/\2", text)
    head, field = text.split("[electrostatics]", 1)
    if tolerance:
        field = re.sub(r"relative_tolerance\s*=\s*\S+", f"relative_tolerance = {tolerance}", field)
    if solver:
        field = f'\nsolver = "{solver}"' + re.sub(r"\nsolver\s*=[^\n]*", "", field)
    if compression:
        head = re.sub(r"compression\s*=\s*\[[^\]]*\]", f"compression = {compression}", head)
    return head + "[electrostatics]" + field


PAIR = "cases/in-plane-pair.toml"
IMPORTED = "benches/peers/cases/in-plane-pair-imported.toml"
PATTERN = "tests/acceptance/rounded-pattern.toml"
MEMS = "tests/acceptance/found/mems-plates.toml"
PUNCH = "tests/acceptance/flat-punch.toml"

# Name, what the case is, its text, and the target in seconds where one was set.
ROWS = [
    ("imported-pair", f"{IMPORTED}, 1e-3", lambda: changed(IMPORTED, "1e-3"), 0.1),
    *[
        (f"pair-{tolerance}", f"{PAIR} at rest, {tolerance}, extruded",
         lambda tolerance=tolerance: changed(PAIR, tolerance, "extruded", "[0.0]"), target)
        for tolerance, target in [("1e-3", 0.3), ("1e-4", 1), ("1e-5", 4)]
    ],
    ("pair-steps", f"{PAIR}, six steps, 1e-4, extruded", lambda: changed(PAIR, "1e-4", "extruded"), None),
    ("discs-0.02", "two discs, d = 0.02 R, 1e-4", lambda: discs(0.02), 2),
    ("discs-0.1", "two discs, d = 0.1 R, 1e-4", lambda: discs(0.1), 2),
    ("pattern-1e-2", f"{PATTERN}, 1e-2", lambda: changed(PATTERN, "1e-2"), None),
    ("pattern-1e-3", f"{PATTERN}, 1e-3", lambda: changed(PATTERN, "1e-3"), 5),
    ("guarded-disc", "cases/discs.toml", lambda: changed("cases/discs.toml"), None),
    ("guarded-disc-2e-2", "cases/discs.toml, 2e-2", lambda: changed("cases/discs.toml", "2e-2"), None),
    ("mems", MEMS + ", 1e-3", lambda: changed(MEMS, "1e-3"), 3),
    ("bus-1x1", "bus crossing 1 x 1, 1e-3", lambda: bus(1), 3),
    ("bus-2x2", "bus crossing 2 x 2, 1e-3", lambda: bus(2), 3),
    ("pads", "3 x 3 pads under a plate, 1e-2", pads, 5),
    ("floating-plate", "cases/floating-plate.toml", lambda: changed("cases/floating-plate.toml"), None),
    ("punched-pair", "cases/punched-pair.toml", lambda: changed("cases/punched-pair.toml"), 3),
    ("punch", PUNCH, lambda: changed(PUNCH), 30),
    ("comb-1e-2", "cases/comb.toml, 1e-2", lambda: changed("cases/comb.toml", "1e-2"), 5),
    ("comb-1e-3", "cases/comb.toml, 1e-3", lambda: changed("cases/comb.toml", "1e-3"), 20),
    ("spiral-1e-2", "cases/spiral.toml, 1e-2, extruded", lambda: changed("cases/spiral.toml", "1e-2", "extruded"), None),
    ("spiral-1e-3", "cases/spiral.toml, 1e-3, extruded", lambda: changed("cases/spiral.toml", "1e-3", "extruded"), 5),
]


def measured(binary, case, folder):
    """Seconds of a run, its exit status and its result."""
    null = os.open(os.devnull, os.O_RDWR)
    begin = time.monotonic()
    status = subprocess.run([binary, "run", case, "-o", folder, "--quiet"], stdin=null, stdout=null, stderr=null).returncode
    seconds = time.monotonic() - begin
    os.close(null)
    return seconds, status, json.loads((pathlib.Path(folder) / "result.json").read_text())


def row(binary, name, what, text, target, times, kept):
    case = kept / f"{name}.toml"
    case.write_text(text())
    runs = []
    for _ in range(times):
        with tempfile.TemporaryDirectory() as folder:
            seconds, status, result = measured(binary, case, pathlib.Path(folder) / "result")
            runs.append(seconds)
    steps = result.get("steps") or [result]
    unknowns = max(step.get("unknowns") or 0 for step in steps)
    iterations = max((step.get("solver") or {}).get("iterations") or 0 for step in steps)
    wanted = "" if target is None else f"{target} s"
    met = "" if target is None else ("met" if min(runs) <= target else "missed")
    note = "" if status == 0 else f" exit status {status}"
    print(f"| {what} | {min(runs):.2f} to {max(runs):.2f} s | {wanted} | {met} | {unknowns:,} | {iterations} |{note}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        kept = arguments.keep or pathlib.Path(folder)
        kept.mkdir(parents=True, exist_ok=True)
        print("| case | time | target | | unknowns | iterations |\n|---|---|---|---|---|---|")
        for name, what, text, target in ROWS:
            if not arguments.names or any(part in name for part in arguments.names):
                row(arguments.binary, name, what, text, target, arguments.times, kept)


if __name__ == "__main__":
    sys.exit(main())
