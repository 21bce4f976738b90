#!/usr/bin/env python3
"""The closed form and finite elements side by side: every case of `cases/` and of `elastocap new` that is pressed, as it stands and by the other.

    benches/models_side_by_side.py [--binary target/release/elastocap] [--seconds 300] [--into docs/trust.md]

A closed form is compared with `[mechanics.auto]`: a block with rounded edges of the size of its contact on a layer that goes on, or, where
bodies ride on the top, a plate over a layer as large as the contact. A case of finite elements is compared with the closed form of a contact
of the same size, where it has a flat or a whole top and its material has one. The table has the last step: capacitance and change with
what is stated, and the force. A closed form whose statement does not reach the other's capacitance is marked.
"""

import argparse
import json
import pathlib
import re
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
BEGIN, END = "<!-- side by side -->\n", "<!-- end of side by side -->\n"
UNITS = {"um": 1e-6, "mm": 1e-3, "m": 1.0}


def length(text, key):
    """The length of a key in SI units; `None` where it is not there."""
    found = re.search(rf'^\s*{key}\s*=\s*"([\d.e+-]+) (um|mm|m)"', text, re.M)
    return float(found[1]) * UNITS[found[2]] if found else None


def without(text, table):
    """The text of a case without a table and its subtables."""
    return re.sub(rf"^\[{re.escape(table)}[.\]].*?(?=^\[(?!{re.escape(table)}\.)|\Z)", "", text, flags=re.M | re.S)


def by_finite_elements(text):
    """The case of a closed form by finite elements."""
    half, width = length(text, "contact_half_length"), length(text, "contact_width")
    thickness = length(text, "thickness")
    rest = without(text, "mechanics")
    um = lambda x: f'"{1e6 * x:.6g} um"'
    if 'attached = "layer-top"' in text or "common_plate" in text:
        auto = f'[mechanics.auto]\nindenter = "whole-top"\nwidth = {um(width)}\nside = "free"\n'
        rest = rest.replace("[layer]\n", f"[layer]\nhalf_length = {um(half)}\n", 1) if length(rest, "half_length") is None else rest
    else:
        corner = min(0.1 * thickness, 0.4 * half)
        auto = f"[mechanics.auto]\nindenter = {{ flat_punch = {{ half_width = {um(half)}, half_depth = {um(0.5 * width)}, corner_radius = {um(corner)} }} }}\n"
    return rest + "\n" + auto


def by_closed_form(text):
    """The case of finite elements by the closed form; `None` where that does not fit."""
    if not re.search(r"neo_hookean|mooney_rivlin", text) or "bulk_modulus" in text or re.search(r"cylinder|sphere", text.split("[mechanics", 1)[1].split("[load]")[0]):
        return None
    mechanics = "[mechanics" + text.split("[mechanics", 1)[1].split("[load]")[0]
    half = length(mechanics, "half_width") or length(text, "half_length")
    found = re.search(r'half_width\s*=\s*"([\d.e+-]+) (um|mm|m)"', mechanics)
    half = float(found[1]) * UNITS[found[2]] if found else half
    width = length(mechanics, "width")
    if half is None or width is None:
        return None
    um = lambda x: f'"{1e6 * x:.6g} um"'
    closed = f"[mechanics.closed_form]\ncontact_half_length = {um(half)}\ncontact_width = {um(width)}\nshear_length = {um(half)}\n"
    return without(text, "mechanics") + "\n" + closed


def last_steps(binary, text, folder, seconds):
    """First and last step of a run of this case, from result.json, or why there are none."""
    case, out = folder / "case.toml", folder / "out"
    case.write_text(text)
    subprocess.run(["rm", "-rf", out], check=True)
    run = [binary, "run", case, "--output", out, "--no-fields", "--max-time", f"{seconds}s", "--quiet"]
    ended = subprocess.run(run, capture_output=True, text=True)
    result = out / "result.json"
    if not result.exists():
        said = [line for line in ended.stderr.splitlines() if line.startswith("error")]
        return None, said[0][:110] if said else "no result"
    steps = json.loads(result.read_text())["steps"]
    if steps[-1].get("capacitance_f") is None:
        return None, (steps[-1].get("reason") or "no capacitance")[:110]
    return steps, None


def row(name, steps, other):
    first, last = steps[0], steps[-1]
    value, total = last["capacitance_f"], last["total_error_estimate"]
    change, of_change = last.get("change_f"), last.get("change_total_error_f")
    covered = other is None or abs(value - other[-1]["capacitance_f"]) <= value * total + other[-1]["capacitance_f"] * other[-1]["total_error_estimate"]
    share = f"{100 * change / first['capacitance_f']:+.2f} ± {100 * of_change / first['capacitance_f']:.2g} %" if change is not None and of_change is not None else "-"
    force = f"{last['force_n']:.4g} N" if last.get("force_n") is not None else "-"
    return f"| {name} | {1e12 * value:.5g} pF | {100 * total:.2g} % | {share} | {force} | {'yes' if covered else '**no**'} |", covered


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    parser.add_argument("--seconds", type=int, default=300)
    parser.add_argument("--into", help="the page whose table is replaced")
    asked = parser.parse_args()
    cases = {path.stem: path.read_text() for path in sorted((ROOT / "cases").glob("*.toml"))}
    templates = re.findall(r"\w+", "pair stack comb array quadrants finger")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for template in templates:
            path = folder / f"{template}.toml"
            subprocess.run([asked.binary, "new", template, path], check=True, capture_output=True)
            cases[f"new {template}"] = path.read_text()
        lines = ["| case, last step | C | stated | change | force | covers the other |", "|---|---|---|---|---|---|"]
        outside = 0
        for name, text in cases.items():
            if "[mechanics" not in text or "[load]" not in text or "[surroundings]" not in text:
                continue
            closed = "[mechanics.closed_form]" in text
            other = by_finite_elements(text) if closed else by_closed_form(text)
            names = ["closed form", "finite elements"] if closed else ["finite elements", "closed form"]
            own, why = last_steps(asked.binary, text, folder, asked.seconds)
            found, why_other = last_steps(asked.binary, other, folder, asked.seconds) if other else (None, "no closed form of this scene")
            for label, steps, against, reason in [(names[0], own, found, why), (names[1], found, own, why_other)]:
                if steps is None:
                    lines.append(f"| {name}, {label} | - | | {reason} | | |")
                else:
                    line, covered = row(f"{name}, {label}", steps, against)
                    outside += not covered
                    lines.append(line)
                print(lines[-1], flush=True)
    print(f"{outside} outside of what is stated")
    if asked.into:
        page = pathlib.Path(asked.into)
        before, rest = page.read_text().split(BEGIN)
        page.write_text(before + BEGIN + "\n" + "\n".join(lines) + "\n\n" + END + rest.split(END)[1])


if __name__ == "__main__":
    main()
