#!/usr/bin/env python3
"""Capacitances of the surfaces in CGAL's demo data: every closed one must be meshed and solved, every other one refused.

    apt-get install libcgal-demo
    tests/surface_models.py --binary target/release/elastocap

Each .off file becomes an OBJ file and the only conductor of a case in open space. Printed is a row of a table in Markdown for each:
the number of its triangles, the capacitance, half the distance of its bounds, and the time of the whole command. A surface that
`elastocap check` accepts and `elastocap run` does not solve is a fault, and so is a refusal without a reason or one that takes
longer than `--refusal` seconds. The exit status is 1 if any fault was found, and 0 if the data are not installed.
"""

import argparse
import csv
import pathlib
import subprocess
import sys
import tarfile
import tempfile
import time

DATA = "/usr/share/doc/libcgal-dev/data.tar.gz"
CASE = """format = 1

[electrostatics]
relative_tolerance = {tolerance}

[[conductor]]
name    = "body"
surface = {{ file = "{name}.obj", unit = "mm" }}

[surroundings]
boundary = "open"
"""


def read_off(text):
    """Points and faces of a file in the Object File Format, or None for one of another kind."""
    lines = [line.split("#")[0].split() for line in text.splitlines()]
    lines = [line for line in lines if line]
    if not lines or not lines[0][0].endswith("OFF"):
        return None
    counts, body = (lines[0][1:], lines[1:]) if len(lines[0]) > 1 else (lines[1], lines[2:])
    points, faces = int(counts[0]), int(counts[1])
    corners = [[float(x) for x in line[:3]] for line in body[:points]]
    return corners, [[int(k) + 1 for k in line[1:1 + int(line[0])]] for line in body[points:points + faces]]


def obj(points, faces):
    rows = ["v %r %r %r" % tuple(p) for p in points] + ["f " + " ".join(map(str, face)) for face in faces]
    return "\n".join(rows) + "\n"


def answer(binary, folder, name, options):
    """The exit status of `run`, what it said, and its time in seconds."""
    start = time.monotonic()
    command = [binary, "run", f"{name}.toml", "-o", f"out/{name}"]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=options.limit)
    except subprocess.TimeoutExpired:
        return None, "", options.limit
    return done.returncode, done.stderr, time.monotonic() - start


def row(binary, folder, name, model, options):
    """A row of the table, and whether it is a fault."""
    points, faces = model
    (folder / f"{name}.obj").write_text(obj(points, faces))
    (folder / f"{name}.toml").write_text(CASE.format(name=name, tolerance=options.tolerance))
    status, said, seconds = answer(binary, folder, name, options)
    triangles = sum(len(face) - 2 for face in faces)
    if status in (0, 3):
        with open(folder / "out" / name / "capacitance.csv", newline="") as file:
            first = next(csv.DictReader(file))
        value, lower, upper = (float(first[key]) for key in ("value_f", "lower_f", "upper_f"))
        spread = 0.5 * (upper - lower) / abs(value)
        missed = " (tolerance not reached)" if status == 3 else ""
        return f"| {name} | {triangles} | {value * 1e15:.4g} fF | {spread:.1e}{missed} | {seconds:.1f} s |", False
    if status is None:
        return f"| {name} | {triangles} | no answer | | {seconds:.0f} s |", True
    reason = next((line for line in said.splitlines() if line.startswith("error")), "")
    fault = status != 2 or not reason or seconds > options.refusal
    return f"| {name} | {triangles} | {'FAULT' if fault else 'refused'} | {reason[7:90]} | {seconds:.1f} s |", fault


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default="target/release/elastocap")
    parser.add_argument("--data", default=DATA, help="data.tar.gz of the package libcgal-demo")
    parser.add_argument("--only", nargs="*", help="names of models, without .off")
    parser.add_argument("--closed", action="store_true", help="print only those that are solved, and faults")
    parser.add_argument("--tolerance", default="2e-1")
    parser.add_argument("--limit", type=float, default=300.0, help="longest time of a run, s")
    parser.add_argument("--refusal", type=float, default=5.0, help="longest time of a refusal, s")
    options = parser.parse_args()
    if not pathlib.Path(options.data).is_file():
        print(f"{options.data} is not there: install libcgal-demo")
        return 0
    binary = str(pathlib.Path(options.binary).resolve())
    faults = 0
    print("| model | triangles | capacitance | half the spread, or why refused | time |\n|---|---|---|---|---|", flush=True)
    with tarfile.open(options.data) as archive, tempfile.TemporaryDirectory() as temporary:
        members = sorted((m for m in archive if m.name.endswith(".off")), key=lambda m: m.name)
        for member in members:
            name = pathlib.Path(member.name).stem
            if options.only and name not in options.only:
                continue
            model = read_off(archive.extractfile(member).read().decode(errors="replace"))
            if model is None:
                continue
            line, fault = row(binary, pathlib.Path(temporary), name, model, options)
            faults += fault
            if fault or not options.closed or "refused" not in line:
                print(line, flush=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
