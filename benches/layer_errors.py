#!/usr/bin/env python3
"""How often the stated errors of layers by finite elements cover the truth: drawn layers, each solved as asked and four times more sharply.

    benches/layer_errors.py [--plane] [--binary target/release/elastocap] [--count 200] [--seed 1] [--sharper 4] [--seconds 120]

Pairs, stacked pairs and combs in soft layers under plates, rounded blocks, cylinders, balls, held and bonded punches are drawn by lot, in
space or, with `--plane`, in plane strain. The
difference between the two solutions of a layer is compared with what the first one states of its force, of the gap of its pair and of its
parallel-plate capacitance. A statement of the sharper solution is not small compared with that of the first, so that the difference
may be larger than the statement by as much. Layers of which the sharp solution is not reached within `--seconds` say nothing and are counted.
"""

import argparse
import json
import pathlib
import random
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent


def drawn(lot, plane):
    """A layer in space, or in the `plane`, as a dictionary of the tables of a case file, but for its tolerances, and what kind it is."""
    height = lot.choice([200, 450, 1000])
    um = lambda x: f"{x:.4g} um"
    layer = {"thickness": um(height), "half_length": um(height * lot.uniform(2.2, 4.0)), "relative_permittivity": 2.8}
    half_length = float(layer["half_length"].split()[0])
    half_width = height * lot.uniform(1.2, 3.0)
    law = lot.choice(["neo_hookean", "mooney_rivlin", "yeoh"])
    material = {
        "neo_hookean": {"shear_modulus": "100 kPa"},
        "mooney_rivlin": {"c10": "5 kPa", "c01": "40 kPa"},
        "yeoh": {"c10": "50 kPa", "c20": "-2 kPa", "c30": "0.5 kPa"},
    }[law]
    room = [half_length - height, 0.4 * half_width]
    stiffness = lot.choice(['"rigid"', '"1 MPa"', '"100 MPa"'])
    length, width = room[0] * lot.uniform(0.2, 0.6), 2 * room[1] * lot.uniform(0.3, 0.9)
    thickness, gap = height * lot.uniform(0.02, 0.08), height * lot.uniform(0.1, 0.4)
    kind = lot.choice(["in_plane_pair", "stacked_pair", "comb"])
    if kind == "in_plane_pair":
        pair = {"gap": um(gap), "length": um(length), "thickness": um(thickness), "width": um(width), "height": um(height * lot.uniform(0.25, 0.7)), "shear_modulus": stiffness}
    elif kind == "stacked_pair":
        pair = {"gap": um(gap), "length": um(2 * length), "thickness": um(thickness), "width": um(width), "height": um(height * lot.uniform(0.4, 0.6)), "shear_modulus": stiffness}
    else:
        finger = min(length, 0.8 * room[0]) / 4
        pair = {"fingers": 4, "finger_width": um(0.5 * finger), "gap": um(0.5 * finger), "overlap": um(0.8 * room[1]), "end_gap": um(0.1 * room[1]), "bus_width": um(0.1 * room[1]), "thickness": um(thickness), "height": um(height * lot.uniform(0.25, 0.7))}
    in_space = ["whole-top", "block", "punch", "cylinder", "sphere", "held", "bonded"]
    in_plane = ["whole-top", "punch", "punch", "cylinder", "held", "bonded"]
    press = lot.choice(in_plane if plane else in_space)
    reach = lambda of: of * lot.uniform(0.2, 0.6)
    radius = height * lot.uniform(0.1, 0.4)
    indenter = {
        "whole-top": '"whole-top"',
        "block": f'{{ flat_punch = {{ half_width = "{um(reach(half_length))}", half_depth = "{um(reach(half_width))}", corner_radius = "{um(radius)}" }} }}',
        "punch": f'{{ flat_punch = {{ half_width = "{um(reach(half_length))}", corner_radius = "{um(radius)}" }} }}',
        "cylinder": f'{{ cylinder = {{ radius = "{um(height * lot.uniform(0.8, 4.0))}" }} }}',
        "sphere": f'{{ sphere = {{ radius = "{um(height * lot.uniform(0.8, 4.0))}" }} }}',
        "held": f'{{ flat_punch = {{ half_width = "{um(reach(half_length - height))}", contact = "held" }} }}',
        "bonded": f'{{ flat_punch = {{ half_width = "{um(reach(half_length - height))}", contact = "bonded" }} }}',
    }[press]
    solid = {"width": um(2 * half_width), "end": lot.choice(["free", "free-on-substrate", "far"]) if press != "whole-top" or not plane else "free-on-substrate", "side": lot.choice(["free", "symmetric"])}
    if plane:
        del solid["side"]
    depth = lot.choice([0.02, 0.05, 0.1, 0.15, 0.2, 0.3] if plane else [0.02, 0.05, 0.1, 0.15, 0.2])
    return [kind, press], layer, [law, material], pair, solid, indenter, depth, height


def text(layer, tolerances):
    kind, table, (law, material), pair, solid, indenter, depth, height = layer
    of_force, of_field = tolerances
    value = lambda x: x if isinstance(x, str) and x.startswith('"') else json.dumps(x)
    lines = ["format = 1", f'title = "{" under ".join(kind)}"', "[layer]", *(f"{k} = {value(v)}" for k, v in table.items())]
    lines += [f"[layer.material.{law}]", *(f"{k} = {value(v)}" for k, v in material.items())]
    lines += [f"[electrodes.{kind[0]}]", *(f"{k} = {value(v)}" for k, v in pair.items())]
    mechanics = "solid" if "side" in solid else "plane_strain"
    lines += [f"[mechanics.{mechanics}]", *(f"{k} = {value(v)}" for k, v in solid.items()), f"indenter = {indenter}", f"relative_tolerance = {of_force:g}"]
    lines += ["[load]", f"compression = [{depth}]", "[surroundings]", 'boundary = "insulated"', 'side_margin = "1 mm"', 'below = "insulated"']
    lines += ['above = { relative_permittivity = 1.0, thickness = "1 mm" }', "[electrostatics]", f"relative_tolerance = {of_field:g}"]
    return "\n".join(lines) + "\n"


def solved(binary, case, folder, seconds):
    """The loaded step and the meshes of a run, and its processor time; `None` where it has no step with a layer."""
    out = folder / case.stem
    ran = subprocess.run([binary, "run", str(case), "-o", str(out), "--quiet", "--only", "json", "--max-time", f"{seconds}s"], capture_output=True, text=True)
    result = out / "result.json"
    if not result.exists():
        return None, ran.stderr.strip()
    found = json.loads(result.read_text())
    step = found["steps"][-1]
    if not step.get("layer"):
        return None, (step.get("reason") or ran.stderr.strip())
    return (step, found["layer_meshes"], found["layer_seconds"]), None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plane", action="store_true", help="layers in plane strain")
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sharper", type=float, default=4.0)
    parser.add_argument("--seconds", type=int, default=120)
    parser.add_argument("--write", help="a folder for the case files")
    asked = parser.parse_args()
    lot = random.Random(asked.seed)
    ratios = {"force": [], "gap": [], "plates": []}
    without = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(asked.write or folder)
        folder.mkdir(parents=True, exist_ok=True)
        for number in range(asked.count):
            layer = drawn(lot, asked.plane)
            tolerances = lot.choice([0.1, 0.05, 0.03]), lot.choice([5e-2, 2e-2, 1e-2])
            runs = []
            for name, part in [("coarse", 1.0), ("sharp", 1.0 / asked.sharper)]:
                case = folder / f"{number:03d}-{name}.toml"
                case.write_text(text(layer, [part * t for t in tolerances]))
                runs.append(solved(asked.binary, case, folder, asked.seconds))
                if runs[-1][0] is None:
                    break
            label = " under ".join(layer[0])
            if runs[-1][0] is None:
                without[runs[-1][1][:60]] = without.get(runs[-1][1][:60], 0) + 1
                print(f"{number:3d} {label:32s} without: {['coarse', 'sharp'][len(runs) - 1]} {runs[-1][1][:150]}", flush=True)
                continue
            (coarse, coarse_meshes, coarse_seconds), (sharp, sharp_meshes, sharp_seconds) = runs[0][0], runs[1][0]
            line = []
            of_force = coarse["layer"]["relative_error_estimate"]
            if of_force and len(sharp_meshes) > len(coarse_meshes):
                ratio = abs(coarse["force_n"] / sharp["force_n"] - 1) / of_force
                ratios["force"].append((ratio, number))
                line.append(f"force {ratio:.2f} of {of_force:.1e}")
            of_places = coarse.get("mechanics_error_estimate")
            for name, key in [("gap", "gap_m"), ("plates", "parallel_plate_f")]:
                if of_places and coarse.get(key) and sharp.get(key) and len(sharp_meshes) > len(coarse_meshes):
                    ratio = abs(coarse[key] / sharp[key] - 1) / of_places
                    ratios[name].append((ratio, number))
                    line.append(f"{name} {ratio:.2f} of {of_places:.1e}")
            sizes = f"{coarse_meshes[-1]['unknowns']} {sharp_meshes[-1]['unknowns']} in {coarse_seconds:.1f} {sharp_seconds:.1f} s"
            print(f"{number:3d} {label:32s} {layer[4]['end']:18s} {layer[6]:.2f} {'; '.join(line)}; {sizes}", flush=True)
    for name, all_ in ratios.items():
        if all_:
            ordered = sorted(r for r, _ in all_)
            covered = sum(r <= 1.0 for r in ordered)
            worst = sorted(all_, reverse=True)[:5]
            print(f"{name}: {covered} of {len(ordered)} covered, median of difference over statement {ordered[len(ordered) // 2]:.2f}, worst {', '.join(f'{r:.2f} (case {n})' for r, n in worst)}")
    for reason, count in without.items():
        print(f"{count} without a sharp solution: {reason}")


if __name__ == "__main__":
    sys.exit(main())
