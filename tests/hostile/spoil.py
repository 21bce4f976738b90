"""A drawn case spoilt in one place: nearly valid."""

import copy
import re

from .schema import alternatives

EXTREMES = ["0", "-1", "1e-9", "1e9", "1e-30", "1e300", "nan", "1e-6", "1000000"]


def places(value, path=()):
    """The paths of all values of a tree."""
    entries = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, below in entries:
        yield path + (key,)
        yield from places(below, path + (key,))


def at(tree, path):
    for key in path:
        tree = tree[key]
    return tree


def spoil(rng, case, schema):
    case = copy.deepcopy(case)
    path = rng.choice(list(places(case)))
    holder, key = at(case, path[:-1]), path[-1]
    value = holder[key]
    kind = rng.choice(["drop", "extreme", "factor", "factor", "type", "key", "double", "name", "swap"])
    if kind == "drop":
        del holder[key]
    elif kind in ("extreme", "factor") and isinstance(value, str) and re.match(r"-?[0-9]", value):
        number, _, unit = value.partition(" ")
        scaled = rng.choice(EXTREMES) if kind == "extreme" else f"{float(number) * rng.choice([-1, 0, 0.1, 0.5, 0.999999999, 1.000001, 2, 10, 100]):.12g}"
        holder[key] = f"{scaled} {unit}"
    elif kind in ("extreme", "factor") and isinstance(value, (int, float)) and not isinstance(value, bool):
        holder[key] = rng.choice([0, -1, 1e-9, 1e9, 1e300, 65536]) if kind == "extreme" else value * rng.choice([-1, 0, 2, 10, 0.1])
    elif kind == "type":
        holder[key] = rng.choice([True, [], {}, "text", 1, -0.5, [[]], [1, 2, 3], ["1 mm", "2 mm"], "1 kPa", "5 pF"])
    elif kind == "key" and isinstance(value, dict):
        tables = [schema["properties"][name] for name in schema["properties"]]
        words = [word for table in tables for choice in alternatives(table) for word in choice.get("properties", {})]
        value[rng.choice(words)] = rng.choice(["1 mm", 1, "grounded", True])
    elif kind == "double" and isinstance(value, list) and value:
        value.append(copy.deepcopy(rng.choice(value)))
    elif kind == "name" and isinstance(value, str):
        holder[key] = rng.choice(["", "c1", "comb-1", "nowhere", "x" * 300, "\u202e", "'; DROP", "0"])
    elif kind == "swap":
        other = rng.choice(list(places(case)))
        if path[: len(other)] != other and other[: len(path)] != path:
            place = at(case, other[:-1])
            holder[key], place[other[-1]] = copy.deepcopy(place[other[-1]]), copy.deepcopy(value)
    return case
