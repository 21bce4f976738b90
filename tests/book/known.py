#!/usr/bin/env python3
"""Runs of shipped cases against values that are known from elsewhere: the table of docs/trust.md.

    python3 tests/book/known.py RESULTS            RESULTS has a folder for each case, as `elastocap run cases/NAME.toml -o RESULTS/NAME` makes it
    python3 tests/book/known.py RESULTS --write    puts the table into the page

The known values are those of tests/acceptance/expected.json, whose cases are the same. Ends with status 1 if bounds do not hold a known value (by more
than the known value's own tolerance), or if the page does not have the table.
"""

import csv
import json
import re
import sys
from pathlib import Path

from examples import same

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "trust.md"
PLACE = re.compile(r"<!-- known -->\n.*?<!-- end of known -->", re.S)

# A case, the key of its value, and where that comes from.
CASES = [
    ("cube-in-cube", "maxwell_matrix_f", "boundary elements graded towards the edges"),
    ("isolated-cube", "maxwell_matrix_f", "Helsing and Perfekt 2013, 0.66067815409957 x 4 pi eps0 a"),
    ("square-plates", "two_terminal_capacitance_f", "boundary elements graded towards the edges"),
    ("in-plane-pair", "two_terminal_capacitance_f", "graded hexahedra of order 7 to 9"),
]
SHORT = {"maxwell_matrix_f": "maxwell", "two_terminal_capacitance_f": "two_terminal"}


def rows(results, expected):
    for name, key, source in CASES:
        known = expected[f"{name}.toml"][key]
        values = known["value"]
        while isinstance(values, list) and isinstance(values[0], list):
            values = values[0]
        values = values if isinstance(values, list) else [values]
        with open(results / name / "capacitance.csv", encoding="utf-8") as file:
            found = [row for row in csv.DictReader(file) if row["quantity"] == SHORT[key]]
        for step, value in enumerate(values):
            row = next(row for row in found if int(row["step"]) == step)
            yield name, step, len(values), value, known["tolerance"], row, source


def table(results, expected):
    lines, faults = ["| case | known, pF | lower bound | upper bound | value off by | spread of the bounds | known from |", "|---|---|---|---|---|---|---|"], []
    for name, step, steps, value, tolerance, row, source in rows(results, expected):
        found, lower, upper = (float(row[key]) for key in ("value_f", "lower_f", "upper_f"))
        where = f"{name}, step {step}" if steps > 1 else name
        if not lower * (1 - tolerance) <= value <= upper * (1 + tolerance):
            faults.append(f"{where}: {value} is not between {lower} and {upper}")
        pico = [f"{1e12 * x:.9g}" for x in (value, lower, upper)]
        lines.append(f"| {where} | {' | '.join(pico)} | {abs(found / value - 1):.1e} | {(upper - lower) / found:.1e} | {source} |")
    return "\n".join(lines), faults


def main():
    results, write = Path(sys.argv[1]), "--write" in sys.argv[2:]
    expected = json.loads((ROOT / "tests" / "acceptance" / "expected.json").read_text(encoding="utf-8"))
    text, faults = table(results, expected)
    page = PAGE.read_text(encoding="utf-8")
    shown = PLACE.search(page)
    if shown is None:
        faults.append("docs/trust.md has no place for the table: <!-- known --> ... <!-- end of known -->")
    elif write:
        PAGE.write_text(PLACE.sub(lambda _: f"<!-- known -->\n\n{text}\n\n<!-- end of known -->", page), encoding="utf-8")
    else:
        difference = same("\n".join(shown.group(0).splitlines()[1:-1]), text)
        if difference:
            faults.append(f"docs/trust.md: {difference}")
    print(f"{text.count(chr(10)) - 1} known values were held against proved bounds")
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
