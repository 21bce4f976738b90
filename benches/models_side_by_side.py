#!/usr/bin/env python3
"""The closed form and finite elements side by side: every case of `cases/` and of `elastocap new` that is pressed, as it stands and by the other.

    benches/models_side_by_side.py [--binary target/release/elastocap] [--seconds 300] [--into docs/trust.md]

A closed form is compared with `[mechanics.auto]`: a block with rounded edges of the size of its contact on a layer that goes on, or, where
bodies ride on the top, a plate over a layer as large as the contact, which both have then. A case of finite elements is compared with the closed form of a contact
of the same size, where it has a flat or a whole top and its material has one. The table has the last step that both have: capacitance, change and force
with what is stated of each. What is farther apart than the two statements together is marked.
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


def has_riders(text):
    """Whether bodies ride on the top of the layer."""
    return 'attached = "layer-top"' in text or "common_plate" in text


def by_finite_elements(text):
    """The case of a closed form by finite elements."""
    half, width = length(text, "contact_half_length"), length(text, "contact_width")
    thickness = length(text, "thickness")
    rest = without(text, "mechanics")
    um = lambda x: f'"{1e6 * x:.6g} um"'
    if has_riders(text):
        auto = f'[mechanics.auto]\nindenter = "whole-top"\nwidth = {um(width)}\nside = "free"\n'
        rest = rest if length(rest, "half_length") is not None else rest.replace("[layer]\n", f"[layer]\nhalf_length = {um(half)}\n", 1)
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


def as_large_as_the_contact(text):
    """The text of a closed form whose layer ends where its contact does, as that of finite elements does."""
    if length(text, "half_length") is not None:
        return text
    return text.replace("[layer]\n", f'[layer]\nhalf_length = "{1e6 * length(text, "contact_half_length"):.6g} um"\n', 1)


def solved_steps(binary, text, folder, seconds):
    """The steps of a run of this case, from result.json, and why there is no capacitance under load, if there is none."""
    case, out = folder / "case.toml", folder / "out"
    partial = folder / "out.partial"
    case.write_text(text)
    subprocess.run(["rm", "-rf", out, partial], check=True)
    run = [binary, "run", case, "--output", out, "--no-fields", "--max-time", f"{seconds}s", "--quiet"]
    ended = subprocess.run(run, capture_output=True, text=True)
    result = next((place / "result.json" for place in (out, partial) if (place / "result.json").exists()), None)
    if result is None:
        said = [line for line in ended.stderr.splitlines() if line.startswith("error")]
        return [], said[0].removeprefix("error: ")[:110] if said else "no result"
    steps = json.loads(result.read_text())["steps"]
    if all(step.get("capacitance_f") is None for step in steps[1:]):
        return steps, f"not reached in {seconds} s" if steps[-1]["status"] == "not run" else (steps[-1].get("reason") or "no capacitance")[:110]
    return steps, None


def quantities(steps, k):
    """Value and stated error of a step, in SI units, of the capacitance, its change and the force; `None` where one is not known."""
    step = steps[k]
    value = step["capacitance_f"]
    force, of_force = step.get("force_n"), step.get("force_error_estimate")
    change, of_change = step.get("change_f"), step.get("change_total_error_f")
    return [
        (value, value * step["total_error_estimate"]),
        (change, of_change) if change is not None and of_change is not None else None,
        (force, force * of_force) if force is not None and of_force is not None else None,
    ]


def percent(share):
    """A share in per cent to two digits: `0.57 %`, `130 %`."""
    return f"{100 * share:.2g} %" if share < 0.995 else f"{round(100 * share, -1):.0f} %"


def row(name, steps, k, other):
    """The line of the table of a step, and how many of its quantities lie outside of what both state; `other` has the same step, or is empty."""
    own = quantities(steps, k)
    against = quantities(other, k) if other else [None] * 3
    outside = [
        what
        for what, one, two in zip(["C", "change", "force"], own, against)
        if one and two and abs(one[0] - two[0]) > one[1] + two[1]
    ]
    rest = steps[0]["capacitance_f"]
    share = f"{100 * own[1][0] / rest:+.2f} ± {percent(own[1][1] / rest)}" if own[1] else "-"
    force = steps[k].get("force_n")
    of_force = f" ± {percent(own[2][1] / own[2][0])}" if own[2] and own[2][0] else ""
    force = f"{force:.4g} N{of_force}" if force is not None else "-"
    at = f"{steps[k]['compression']:.3f}" if steps[k].get("compression") is not None else "-"
    capacitance = f"{1e12 * own[0][0]:.5g} pF ± {percent(own[0][1] / own[0][0])}"
    verdict = "-" if not other else "**no**: " + ", ".join(outside) if outside else "yes"
    return f"| {name} | {at} | {capacitance} | {share} | {force} | {verdict} |", len(outside)


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
        lines = ["| case and model | U/H | C | change | force | agree within what they state |", "|---|---|---|---|---|---|"]
        outside = 0
        for name, text in cases.items():
            if "[mechanics" not in text or "[load]" not in text or "[surroundings]" not in text:
                continue
            closed = "[mechanics.closed_form]" in text
            other = by_finite_elements(text) if closed else by_closed_form(text)
            names = ["closed form", "finite elements"] if closed else ["finite elements", "closed form"]
            own = as_large_as_the_contact(text) if closed and has_riders(text) else text
            pairs = [solved_steps(asked.binary, own, folder, asked.seconds)]
            pairs.append(solved_steps(asked.binary, other, folder, asked.seconds) if other else ([], "no closed form of this scene"))
            (one, _), (two, _) = pairs
            known = [k for k in range(1, max(len(one), len(two))) if all(k < len(steps) and steps[k].get("capacitance_f") is not None for steps in (one, two))]
            for label, (steps, why), against in zip(names, pairs, [two, one]):
                last = known[-1] if known else next((k for k in reversed(range(1, len(steps))) if steps[k].get("capacitance_f") is not None), None)
                if last is None:
                    lines.append(f"| {name}, {label} | - | {why} | | | |")
                else:
                    line, missed = row(f"{name}, {label}", steps, last, against if known else [])
                    outside += missed
                    lines.append(line)
                print(lines[-1], flush=True)
    print(f"{outside} outside of what is stated")
    if asked.into:
        page = pathlib.Path(asked.into)
        before, rest = page.read_text().split(BEGIN)
        page.write_text(before + BEGIN + "\n" + "\n".join(lines) + "\n\n" + END + rest.split(END)[1])


if __name__ == "__main__":
    main()
