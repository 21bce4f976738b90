"""Scenes with a known answer: layers in series, and one scene in two forms, of which the bounds must overlap."""

import copy
import re

from . import drawn, faults, jobs, toml

EPSILON_0 = 8.8541878188e-12
# What rounding may leave of equal numbers.
ROUNDING = 1e-9
LENGTH = re.compile(r"(-?)([0-9][0-9.eE+-]*) (nm|um|mm|m)")


def try_one(trial):
    trial.how.choices([layers_in_series, two_forms], [2, 3])[0](trial)


# --- layers in series -------------------------------------------------------------------------------------------------------------


def layers_in_series(trial):
    """Layers between plates, with insulated walls at the edges of the plates: C = epsilon_0 A / sum(t / epsilon)."""
    rng = trial.rng
    scale = 10 ** rng.uniform(-6, -2)
    thicknesses = [float(f"{scale * 10 ** rng.uniform(-2, 0):.4g}") for _ in range(rng.choice([1, 2, 3, 5, 8]))]
    # To a contrast of 1e18, of permittivities above and below one.
    decades = rng.choice([1, 4, 8, 10, 12, 18])
    permittivities = [float(f"{10 ** (decades * rng.uniform(-0.5, 0.5)):.4g}") for _ in thicknesses]
    sides = [float(f"{scale * 10 ** rng.uniform(-1, 1):.4g}") for _ in range(2)]
    levels = [0.0]
    for thickness in thicknesses:
        levels.append(levels[-1] + thickness)
    length = lambda x: f"{x:.17g} m"
    point = lambda x, y, z: [length(x), length(y), length(z)]
    top = levels[-1]
    # Sheets with nothing but insulated space behind them, or boxes up to the walls.
    sheets, below, above = rng.random() < 0.6, scale * rng.uniform(0.01, 1), scale * rng.uniform(0.01, 1)
    case = {"format": 1, "conductor": [], "dielectric": []}
    for name, at, low, high in (("bottom", 0.0, -below, 0.0), ("top", top, top, top + above)):
        sheet = {"sheet": {"normal": "x2", "at": length(at), "min": [length(0), length(0)], "max": [length(side) for side in sides]}}
        box = {"box": {"min": point(0, low, 0), "max": point(sides[0], high, sides[1])}}
        case["conductor"].append({"name": name, **(sheet if sheets else box)})
    for k, permittivity in enumerate(permittivities):
        slab = {"slab": {"axis": "x2", "from": length(levels[k]), "to": length(levels[k + 1])}}
        box = {"box": {"min": point(0, levels[k], 0), "max": point(sides[0], levels[k + 1], sides[1])}}
        case["dielectric"].append({"name": f"d{k}", "relative_permittivity": permittivity, **(slab if rng.random() < 0.7 else box)})
    walls = {"min": point(0, -below, 0), "max": point(sides[0], top + above, sides[1])}
    case["surroundings"] = {"boundary": "insulated", "walls": walls}
    case["electrostatics"] = {"relative_tolerance": rng.choice([0.3, 0.1, 1e-2, 1e-3])}
    if rng.random() < 0.2:
        case["electrostatics"]["solver"] = "tetrahedra"
    case["measure"] = {"capacitance": ["bottom", "top"]}
    jobs.write_case(trial.folder, case, {})
    result = trial.run_beside(trial.check())[1]
    gaps = [b - a for a, b in zip(levels, levels[1:])]
    exact = EPSILON_0 * sides[0] * sides[1] / sum(gap / permittivity for gap, permittivity in zip(gaps, permittivities))
    for step in (result or {}).get("steps", []):
        lower, upper = step.get("capacitance_lower_f"), step.get("capacitance_upper_f")
        if lower is not None and upper is not None and not lower * (1 - ROUNDING) <= exact <= upper * (1 + ROUNDING):
            trial.report.note("run", [f"oracle: layers in series have {exact:.12g} F, outside {lower:.12g} to {upper:.12g} ({step.get('status')})"])


# --- two forms of one scene -------------------------------------------------------------------------------------------------------


def negative(quantity):
    return quantity[1:] if quantity.startswith("-") else "-" + quantity


def metres(quantity):
    number, unit = quantity.split(" ")
    return float(number) * drawn.UNITS[unit]


def mirrored(case, rng):
    """The mirror image across x1 = 0 or x3 = 0; `None` where a form is not known here."""
    axis = rng.choice([0, 2])
    case = copy.deepcopy(case)

    def ends(table, k):
        table["min"][k], table["max"][k] = negative(table["max"][k]), negative(table["min"][k])

    def corners(outline, k):
        for entry in outline:
            for point in [entry] if isinstance(entry, list) else [p for key in ("through", "to", "corner") for p in [entry.get(key)] if p] + entry.get("spline", []):
                point[k] = negative(point[k])

    for body in case.get("conductor", []) + case.get("dielectric", []):
        for shape in [body.get("box")] + body.get("boxes", []):
            if shape:
                ends(shape, axis)
        if "sheet" in body:
            normal = int(body["sheet"]["normal"][1]) - 1
            if normal == axis:
                body["sheet"]["at"] = negative(body["sheet"]["at"])
            else:
                ends(body["sheet"], [k for k in range(3) if k != normal].index(axis))
        for shape, keys in (("sphere", ["center"]), ("shell", ["center"]), ("capsule", ["from", "to"])):
            for key in keys if shape in body else []:
                body[shape][key][axis] = negative(body[shape][key][axis])
        if "cylinder" in body:
            if body["cylinder"]["axis"] == f"x{axis + 1}":
                return None
            body["cylinder"]["base"][axis] = negative(body["cylinder"]["base"][axis])
        for shape in ("slab", "extrusion"):
            if shape in body and body[shape]["axis"] == f"x{axis + 1}":
                body[shape]["from"], body[shape]["to"] = negative(body[shape]["to"]), negative(body[shape]["from"])
            elif "extrusion" in body and shape == "extrusion":
                place = [k for k in range(3) if f"x{k + 1}" != body[shape]["axis"]].index(axis)
                for outline in [body[shape]["outline"]] + body[shape].get("holes", []):
                    corners(outline, place)
        if "surface" in body:
            return None
    if "walls" in case.get("surroundings", {}):
        ends(case["surroundings"]["walls"], axis)
    electrodes = case.get("electrodes", {})
    if set(electrodes) - {"in_plane_pair", "stacked_pair"} or any("tilt" in step or "shift" in step for step in case.get("load", {}).get("steps", [])):
        return None
    if "position" in str(case.get("mechanics")):
        return None
    return case


def in_other_units(case, rng):
    """The same lengths in other units."""
    def other(match):
        sign, number, unit = match.groups()
        new = rng.choice(list(drawn.UNITS))
        power = round(-3 * "m mm um nm".split().index(unit) + 3 * "m mm um nm".split().index(new))
        mantissa, _, exponent = number.lower().partition("e")
        return f'"{sign}{mantissa}e{int(exponent or 0) + power} {new}"'
    return re.sub(f'"{LENGTH.pattern}"', other, toml.document(case))


def halved(case, rng):
    """Boxes made of two halves: as `boxes`, or as two conductors on one terminal."""
    case = copy.deepcopy(case)
    boxes = [body for body in case.get("conductor", []) if "box" in body and "charge" not in body]
    taken = {name for wire in case.get("terminal", []) for name in wire["conductors"]}
    boxes = [body for body in boxes if body["name"] not in taken]
    if not boxes:
        return None
    body = rng.choice(boxes)
    box, axis = body.pop("box"), rng.randrange(3)
    low, high = metres(box["min"][axis]), metres(box["max"][axis])
    at = f"{low + (high - low) * rng.choice([0.5, 0.25]):.12g} m"
    first, second = copy.deepcopy(box), copy.deepcopy(box)
    first["max"][axis] = second["min"][axis] = at
    if rng.random() < 0.5:
        body["boxes"] = [first, second]
    else:
        name = body["name"]
        case["conductor"].insert(case["conductor"].index(body) + 1, {**body, "name": name + "b", "box": second})
        body["name"], body["box"] = name + "a", first
        case.setdefault("terminal", []).append({"name": name, "conductors": [name + "a", name + "b"]})
    return case


def at_another_tolerance(case, rng):
    case = copy.deepcopy(case)
    table = case["electrostatics"]
    table["relative_tolerance"] = round(table.get("relative_tolerance", 1e-3) / rng.choice([2, 3, 5]), 6)
    return case


def thousandfold(case, rng):
    """All lengths a thousand times as large: so are the capacitances."""
    text = toml.document(case)
    if any(word in text for word in (" N\"", "C\"", "surface", "physical", " m\"", "measurement")):
        return None
    larger = {"nm": "um", "um": "mm", "mm": "m"}
    return re.sub(f'"{LENGTH.pattern}"', lambda m: f'"{m[1]}{m[2]} {larger[m[3]]}"', text)




FORMS = {mirrored: 1.0, in_other_units: 1.0, halved: 1.0, at_another_tolerance: 1.0, thousandfold: 1000.0}


def two_forms(trial):
    rng = trial.rng
    for _ in range(20):
        case, files = jobs.draw(rng, cheap=True)
        form = rng.choice(list(FORMS))
        case["electrostatics"] = {"relative_tolerance": case["electrostatics"].get("relative_tolerance", 0.2)}
        other = form(case, rng)
        if other is not None:
            break
    else:
        return
    jobs.write_case(trial.folder, case, files)
    (trial.folder / "other.toml").write_text(other if isinstance(other, str) else toml.document(other))
    checks = [trial.check(), trial.check("other.toml")]
    if form is not at_another_tolerance and {check.status for check in checks} == {0, 2}:
        trial.report.note("check", [f"oracle: {form.__name__}: exit status {checks[0].status}, of the other form {checks[1].status}: "
                                    f"{faults.first(checks[0].err + checks[1].err)}"])
    if {check.status for check in checks} != {0}:
        return
    results = []
    for name, out, check in (("case.toml", "out", checks[0]), ("other.toml", "out-other", checks[1])):
        done, result = trial.run(name, out, seconds=2 * trial.arguments.run_seconds)
        trial.report.note("both", faults.of_both(check, done, result))
        results.append(result)
    if all(results):
        trial.report.note("run", [f"oracle: {form.__name__}: {fault}" for fault in apart(*results, FORMS[form])])


def apart(first, second, factor):
    """The entries of two results of which the bounds do not overlap."""
    found = []
    names = first.get("conductors")
    order = [second["conductors"].index(name) for name in names] if set(names or []) == set(second.get("conductors") or []) else None
    if order is None:
        return [f"conductors {names} and {second.get('conductors')}"]
    for one, two in zip(first["steps"], second["steps"]):
        slack = ROUNDING + sum(step.get(key) or 0.0 for step in (one, two) for key in ("geometry_error_estimate", "mechanics_error_estimate"))
        matrices = [step.get(f"maxwell_matrix_{bound}_f") for step in (one, two) for bound in ("lower", "upper")]
        if None in matrices:
            continue
        for i in range(len(names)):
            for j in range(len(names)):
                a, b = matrices[0][i][j], matrices[1][i][j]
                c, d = matrices[2][order[i]][order[j]], matrices[3][order[i]][order[j]]
                if None in (a, b, c, d):
                    continue
                a, b = a * factor, b * factor
                room = slack * max(map(abs, (a, b, c, d)))
                if a > d + room or c > b + room:
                    found.append(f"step {one['index']}, {names[i]} and {names[j]}: {a:.9g} to {b:.9g} F and {c:.9g} to {d:.9g} F")
    return found[:2]
