#!/usr/bin/env python3
"""An architectural change must not change a number: this script shows whether it did.

It keeps what one build of elastocap says about every case file of the repository, and compares another build with that:
the CSV files byte by byte, the matrices, bounds and potentials of result.json exactly, the exit statuses. Messages may be
reworded on purpose, so words that changed are reported apart from numbers. Only the standard library is used.
"""

import argparse
import concurrent.futures
import csv
import difflib
import hashlib
import io
import json
import math
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# The tables of a run, compared byte by byte. None of them has a column of wall-clock time.
TABLES = ("curve.csv", "capacitance.csv", "mechanics.csv")

# Keys of result.json that are not kept, wherever they stand: wall-clock times, forecasts of time, and what depends on the
# machine, the build or the place of the case file rather than on the case.
TIMES = ("seconds", "layer_seconds", "saving", "saved_seconds")
SURROUNDINGS = ("threads", "versions", "case", "at_once", "memory_bytes")
NOT_KEPT = frozenset(TIMES + SURROUNDINGS)

# The largest relative difference of numbers that --close lets pass.
CLOSE = 1e-12

# The numbers of the shipped cases that lie in the project, and how far another machine may be from them: of the largest number in the
# column, since its order of additions is another one.
KEPT = "tests/kept_numbers"
OTHER_MACHINE = 1e-6
# The same for the columns of errors, which are differences of nearly equal numbers. What a linear solver leaves is rounding alone.
OTHER_MACHINE_ERRORS = 1e-3
ROUNDING_ALONE = "residual"

# Beyond this, a report of one case is cut short.
MOST_LINES = 8

TIMED_OUT = "out of time"

HELP = f"""
examples:
  keep what the present build says, cheap cases first
    tests/same_numbers.py keep /tmp/kept --program target/release/elastocap --skip punch --skip comb
    tests/same_numbers.py keep /tmp/kept --program target/release/elastocap
  compare a changed build with it; quickly, with the cases that took at most 5 s when they were kept
    tests/same_numbers.py compare /tmp/kept --program target/release/elastocap --at-most 5
    tests/same_numbers.py compare /tmp/kept --program target/release/elastocap
  let differences up to {CLOSE:g} pass, and leave a column of pure rounding out
    tests/same_numbers.py compare /tmp/kept --program target/release/elastocap --close --ignore-columns residual
  compare two folders that were kept, without running anything
    tests/same_numbers.py compare /tmp/kept --with /tmp/kept-again
  see whether the numbers depend on the number of threads
    tests/same_numbers.py threads --program target/release/elastocap --threads 1,2,3 --only pair

  compare what was just written for the cases of cases/ with the numbers that lie in the project; --write keeps them anew
    tests/same_numbers.py examples results

exit status:
  0  all numbers are the same
  1  some are not, or a case could not be compared
  2  the command line is wrong
"""


# --- cases ---


def repository():
    """The root of the repository, from the place of this script in it."""
    return Path(__file__).resolve().parent.parent


def name_of(case):
    """A case's name among all: cases/in-plane-pair, acceptance/in-plane-pair."""
    return f"{case.resolve().parent.name}/{case.stem}"


def find_cases(arguments, folders):
    """The chosen case files by name: those of --cases (files, or folders of them), or else of the repository's folders."""
    places = arguments.cases or [repository() / folder for folder in folders]
    found = {}
    for place in places:
        files = sorted(place.glob("*.toml")) if place.is_dir() else [place]
        if not files or not files[0].is_file():
            fail(f"no case files at {place}: name them with --cases")
        for file in files:
            if found.setdefault(name_of(file), file) != file:
                fail(f"two case files would both be kept as {name_of(file)}")
    chosen = {name: file for name, file in found.items() if is_chosen(name, arguments)}
    if not chosen:
        fail("no case is left to run: look at --only and --skip")
    return chosen


def is_chosen(name, arguments):
    only, skip = arguments.only, arguments.skip
    return (not only or any(word in name for word in only)) and not any(word in name for word in skip)


def fail(message):
    print(f"same_numbers.py: {message}", file=sys.stderr)
    sys.exit(2)


# --- running and keeping ---


def run_case(arguments, case, threads, place):
    """Runs one case and writes what is worth keeping of it to the folder `place`, all at once when it is done."""
    place.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".running-", dir=place.parent) as scratch:
        output, fresh = Path(scratch) / "output", Path(scratch) / "kept"
        fresh.mkdir()
        command = [arguments.program, "run", case.resolve(), "--output", output, "--quiet"]
        command += ["--threads", str(threads)] if threads else []
        begin = time.monotonic()
        try:
            done = subprocess.run(command, capture_output=True, timeout=arguments.limit, check=False)
            status, stderr = done.returncode, done.stderr
        except subprocess.TimeoutExpired as expired:
            status, stderr = TIMED_OUT, expired.stderr or b""
        seconds = time.monotonic() - begin

        for table in TABLES:
            if (output / table).is_file():
                shutil.copyfile(output / table, fresh / table)
        if (output / "result.json").is_file():
            result = without_times(json.loads((output / "result.json").read_text()))
            write_json(fresh / "result.json", result)
        said = stderr.decode(errors="replace")
        for path, word in ((output, "OUTPUT"), (case.resolve(), "CASE"), (case.resolve().parent, "FOLDER")):
            said = said.replace(str(path), word)
        (fresh / "stderr.txt").write_text(said)
        shutil.copyfile(case, fresh / "case.toml")
        run = {"exit_status": status, "threads": threads, "wall_seconds": round(seconds, 2), "other_files": others(output)}
        write_json(fresh / "run.json", run)

        if place.exists():
            shutil.rmtree(place)
        fresh.rename(place)
    return run


def without_times(value):
    """A part of result.json without the keys that are not kept."""
    if isinstance(value, dict):
        return {key: without_times(inner) for key, inner in value.items() if key not in NOT_KEPT}
    if isinstance(value, list):
        return [without_times(inner) for inner in value]
    return value


def others(output):
    """Sums of the files that are not kept: fields, scenes, figures, profiles."""
    files = sorted(output.rglob("*")) if output.is_dir() else []
    names = ((str(file.relative_to(output)), file) for file in files if file.is_file())
    kept = TABLES + ("result.json",)
    return {name: hashlib.sha256(file.read_bytes()).hexdigest() for name, file in names if name not in kept}


def write_json(path, value):
    path.write_text(json.dumps(value, indent=1) + "\n")


def kept_run(place):
    """What is known of the run kept at `place`; nothing if none is kept there."""
    file = place / "run.json"
    return json.loads(file.read_text()) if file.is_file() else None


def is_done(run):
    """Whether a kept run came to its end."""
    return run is not None and run["exit_status"] != TIMED_OUT


def side_by_side(jobs, work, items):
    """`(item, work(item))` in order, `jobs` of them at a time; the rest is called off where one goes wrong."""
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        futures = [(item, pool.submit(work, item)) for item in items]
        try:
            for item, future in futures:
                yield item, future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


# --- comparing ---


class Findings:
    """What differs between two runs of one case."""

    def __init__(self):
        self.faults = []  # never let pass: numbers that came or went, exit statuses
        self.words = []
        self.notes = []
        self.numbers = 0  # how many are not the same to the byte
        self.largest = 0.0  # relative difference among them
        self.where = ""

    def number(self, where, old, new):
        self.numbers += 1
        difference = relative_difference(old, new)
        if difference > self.largest or not self.where:
            self.largest, self.where = difference, f"{where}: {old!r} is now {new!r}"

    def values(self, where, old, new):
        """Compares two values: numbers, words, truth values, or none."""
        if repr(old) == repr(new):
            return
        if is_number(old) and is_number(new):
            self.number(where, old, new)
        elif isinstance(old, str) and isinstance(new, str):
            self.words.append(f"{where}\n  - {old}\n  + {new}")
        elif is_word(old) and is_word(new):
            self.words.append(f"{where}: {old!r} is now {new!r}")
        else:
            self.faults.append(f"{where}: {old!r} is now {new!r}")

    def is_same(self, close):
        """Whether all numbers are equal: to the byte, or else closely."""
        return not self.faults and (not self.numbers or (close and self.largest <= CLOSE))


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def is_word(value):
    """A text, or none where there might be one."""
    return value is None or isinstance(value, str)


def relative_difference(old, new):
    if old == new or (math.isnan(old) and math.isnan(new)):
        return 0.0
    difference = abs(old - new) / max(abs(old), abs(new))
    return math.inf if math.isnan(difference) else difference


def compare_places(old, new, ignored):
    """Compares the runs that are kept in two folders."""
    found = Findings()
    before, after = kept_run(old), kept_run(new)
    if before["exit_status"] != after["exit_status"]:
        found.faults.append(f"exit status {before['exit_status']} is now {after['exit_status']}")
    if not (is_done(before) and is_done(after)):
        found.faults.append("a run was ended by its time limit: --limit")
    for table in TABLES:
        compare_files(found, table, old, new, lambda *texts, table=table: compare_tables(found, table, texts, ignored))
    compare_files(found, "result.json", old, new, lambda *texts: compare_results(found, texts, ignored))
    compare_files(found, "stderr.txt", old, new, lambda *texts: compare_messages(found, texts))
    if (old / "case.toml").read_bytes() != (new / "case.toml").read_bytes():
        found.notes.append("the case file itself has changed")
    if before["threads"] != after["threads"]:
        found.notes.append(f"{before['threads']} threads then, {after['threads']} now")
    sums = before["other_files"], after["other_files"]
    changed = sorted(name for name in sums[0].keys() | sums[1].keys() if sums[0].get(name) != sums[1].get(name))
    if changed:
        more = f" and {len(changed) - 4} more" if len(changed) > 4 else ""
        found.notes.append(f"other files with other bytes: {', '.join(changed[:4])}{more}")
    return found


def compare_files(found, name, old, new, compare):
    files = old / name, new / name
    there = [file.is_file() for file in files]
    if there[0] != there[1]:
        found.faults.append(f"{name} is {'missing' if there[0] else 'new'}")
    elif all(there):
        texts = [file.read_bytes() for file in files]
        if texts[0] != texts[1]:
            compare(*(text.decode(errors="replace") for text in texts))


def compare_tables(found, table, texts, ignored):
    """Compares two CSV files cell by cell, columns by their names."""
    before = [find_rows(text) for text in texts]
    (old_columns, old_rows), (new_columns, new_rows) = before
    for column in old_columns:
        if column not in new_columns and column not in ignored:
            found.faults.append(f"{table}: the column {column} is missing")
    new_ones = [column for column in new_columns if column not in old_columns and column not in ignored]
    if new_ones:
        found.notes.append(f"{table} has new columns: {', '.join(new_ones)}")
    if len(old_rows) != len(new_rows):
        found.faults.append(f"{table}: {len(old_rows)} lines are now {len(new_rows)}")
    for line, (old, new) in enumerate(zip(old_rows, new_rows), 2):
        for column in old_columns:
            old_cell, new_cell = old.get(column), new.get(column)
            if column in new_columns and column not in ignored and old_cell != new_cell:
                where = f"{table} line {line} {column}"
                values = [as_value(cell) for cell in (old_cell, new_cell)]
                if repr(values[0]) == repr(values[1]):
                    found.number(f"{where}, as {old_cell} and {new_cell}", *values)
                else:
                    found.values(where, *values)
    if not (found.numbers or found.words or found.faults or found.notes):
        # Only in an ignored column, or in order, quotes, line ends.
        same = [[[row.get(c) for c in old_columns if c not in ignored] for row in rows] for _, rows in before]
        if same[0] != same[1] or not ignored.intersection(old_columns):
            found.faults.append(f"{table}: not the same bytes, though the same cells")


def find_rows(text):
    rows = csv.DictReader(io.StringIO(text))
    return rows.fieldnames or [], list(rows)


def as_value(cell):
    """A cell of a CSV file as the number it is, or else as its words."""
    try:
        return float(cell)
    except (TypeError, ValueError):
        return cell


def compare_results(found, texts, ignored):
    """Compares what is kept of two result.json, key by key."""
    old, new = (dict(leaves(json.loads(text), ignored)) for text in texts)
    for key, value in old.items():
        if key in new:
            found.values(f"result.json {key}", value, new[key])
        elif is_word(value):
            found.words.append(f"result.json {key} is gone: {value!r}")
        else:
            found.faults.append(f"result.json {key} is gone: {value!r}")
    lists = {key.rpartition("[")[0] for key in old if key.endswith("]")}
    added = []
    for key, value in new.items():
        if key in old:
            continue
        if is_word(value):
            found.words.append(f"result.json {key} is new: {value!r}")
        elif key.endswith("]") and key.rpartition("[")[0] in lists:
            found.faults.append(f"result.json {key} is new: {value!r}")
        else:
            added.append(f"{key} {value!r}")
    if added:
        more = f" and {len(added) - 4} more" if len(added) > 4 else ""
        found.notes.append(f"new in result.json: {'; '.join(added[:4])}{more}")


def leaves(value, ignored, path=""):
    """The single values in a JSON document with the way to each: `steps[2].force_n`."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in ignored:
                yield from leaves(inner, ignored, f"{path}.{key}" if path else key)
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            yield from leaves(inner, ignored, f"{path}[{index}]")
    else:
        yield path, value


def compare_messages(found, texts):
    lines = difflib.unified_diff(*(text.splitlines() for text in texts), lineterm="", n=0)
    shown = [f"  {line}" for line in lines if not line.startswith(("---", "+++", "@@"))]
    found.words.append("\n".join(["stderr", *shown]))


def report(name, found, close, aside=""):
    """Prints what was found about one case."""
    exact = not (found.numbers or found.faults)
    verdict = "same" if exact else "close" if found.is_same(close=True) else "DIFFERS"
    words = ", words changed" if found.words else ""
    print(f"{verdict:8} {name}{words}{aside}")
    if found.numbers:
        judged = f"at most {CLOSE:g}" if found.largest <= CLOSE else f"MORE than {CLOSE:g}"
        print(f"           {found.numbers} numbers; largest relative difference {found.largest:.2g}, {judged}")
        print(f"           {found.where}")
    for fault in shortened(found.faults):
        print(f"           {fault}")
    for note in found.notes:
        print(f"           note: {note}")
    if found.words:
        print("           words changed:")
        for line in shortened([line for words in found.words for line in words.splitlines()]):
            print(f"             {line}")
    sys.stdout.flush()
    return found.is_same(close)


def shortened(lines):
    return lines if len(lines) <= MOST_LINES else [*lines[:MOST_LINES], f"... and {len(lines) - MOST_LINES} lines more"]


# --- subcommands ---


def keep(arguments):
    cases = find_cases(arguments, ("cases", "tests/acceptance"))
    there = [name for name in cases if not arguments.again and is_done(kept_run(arguments.folder / name))]
    if there:
        print(f"{len(there)} cases are kept already, and stay as they are; --again runs them again")
    left = [name for name in cases if name not in there]

    def work(name):
        return run_case(arguments, cases[name], arguments.threads, arguments.folder / name)

    for name, run in side_by_side(arguments.jobs, work, left):
        print(f"kept {name:34} exit status {run['exit_status']:>2}, {run['wall_seconds']:8.2f} s", flush=True)
    return 0


def compare(arguments):
    kept = {str(file.parent.relative_to(arguments.folder)) for file in arguments.folder.glob("*/*/run.json")}
    if not kept:
        fail(f"nothing is kept in {arguments.folder}")
    kept = {name: kept_run(arguments.folder / name) for name in kept if is_chosen(name, arguments)}
    quick = [name for name, run in kept.items() if arguments.at_most is None or run["wall_seconds"] <= arguments.at_most]
    quick.sort(key=lambda name: kept[name]["wall_seconds"])
    if arguments.other:
        there = {name for name in quick if kept_run(arguments.other / name)}
    else:
        cases = find_cases(arguments, ("cases", "tests/acceptance"))
        there = set(cases).intersection(quick)
        unknown = sorted(set(cases).difference(kept))
        if unknown:
            print(f"not kept, and not run: {', '.join(unknown)}")
    gone = [] if arguments.cases or arguments.other else sorted(set(quick).difference(there))
    for name in gone:
        print(f"GONE     {name} was kept, but has no case file")
    names = [name for name in quick if name in there]
    if not names:
        fail("no case is left to compare")

    differ = []
    with tempfile.TemporaryDirectory(prefix="same-numbers-") as fresh:
        after = arguments.other or Path(fresh)

        def work(name):
            if not arguments.other:
                run_case(arguments, cases[name], kept[name]["threads"], after / name)
            return compare_places(arguments.folder / name, after / name, arguments.ignore_columns)

        for name, found in side_by_side(arguments.jobs, work, names):
            before, now = kept[name], kept_run(after / name)
            aside = f", {before['wall_seconds']:.1f} s then, {now['wall_seconds']:.1f} s now"
            if not report(name, found, arguments.close, aside):
                differ.append(name)
    return conclude(names, differ + gone, f" or within {CLOSE:g}" if arguments.close else " to the byte")


def threads(arguments):
    cases = find_cases(arguments, ("cases",))
    differ = []
    with tempfile.TemporaryDirectory(prefix="same-numbers-") as fresh:

        def work(name):
            places = [Path(fresh) / str(count) / name for count in arguments.threads]
            for count, place in zip(arguments.threads, places):
                run_case(arguments, cases[name], count, place)
            return places

        for name, (first, *rest) in side_by_side(arguments.jobs, work, cases):
            same = True
            for count, place in zip(arguments.threads[1:], rest):
                found = compare_places(first, place, arguments.ignore_columns)
                found.notes = [note for note in found.notes if "threads" not in note]
                same &= report(f"{name} at {arguments.threads[0]} and {count} threads", found, close=False)
            if not same:
                differ.append(name)
    return conclude(list(cases), differ, " to the byte")


def examples(arguments):
    """Compares the tables of RESULTS/<case> with those kept in the project, for every case of cases/."""
    differ, names = [], [file.stem for file in sorted((repository() / "cases").glob("*.toml"))]
    for name in names:
        old, new = repository() / KEPT / name, arguments.folder / name
        tables = [table for table in TABLES if (new / table).is_file()]
        if arguments.write:
            shutil.rmtree(old, ignore_errors=True)
            old.mkdir(parents=True)
            for table in tables:
                shutil.copyfile(new / table, old / table)
            continue
        faults = [] if tables == [table for table in TABLES if (old / table).is_file()] and tables else ["other tables than those kept"]
        for table in tables if not faults else []:
            faults += far_cells(table, *((place / table).read_text() for place in (old, new)))
        for fault in shortened(faults):
            print(f"{name}: {fault}")
        if faults:
            differ.append(name)
    return 0 if arguments.write else conclude(names, differ, f" within {OTHER_MACHINE:g}")


def far_cells(table, old, new):
    """The cells of a table that are further from the kept ones than another machine may bring them."""
    (old_columns, old_rows), (new_columns, new_rows) = find_rows(old), find_rows(new)
    if old_columns != new_columns or len(old_rows) != len(new_rows):
        return [f"{table}: other columns or another number of rows"]
    faults = []
    for column in old_columns:
        if column == ROUNDING_ALONE:
            continue
        allowed = OTHER_MACHINE_ERRORS if "error" in column else OTHER_MACHINE
        values = [[as_value(row[column]) for row in rows] for rows in (old_rows, new_rows)]
        largest = max((abs(value) for value in values[0] if is_number(value)), default=0.0)
        for line, (before, after) in enumerate(zip(*values), 2):
            numbers = is_number(before) and is_number(after)
            if not (numbers and abs(before - after) <= allowed * largest or repr(before) == repr(after)):
                faults.append(f"{table} line {line} {column}: {before!r} is now {after!r}")
    return faults


def conclude(names, differ, how):
    if differ:
        print(f"\nnumbers are NOT the same in {len(differ)} of {len(names)} cases: {', '.join(differ)}")
        return 1
    print(f"\nall numbers are the same{how} in {len(names)} case{'s' * (len(names) != 1)}")
    return 0


# --- command line ---


def words(text):
    return frozenset(word.strip() for word in text.split(",") if word.strip())


def counts(text):
    found = [int(word) for word in text.split(",")]
    if len(found) < 2 or min(found) < 1:
        raise ValueError
    return found


def program(text):
    path = shutil.which(text)
    if path is None:
        raise argparse.ArgumentTypeError(f"{text} is not a program that can be run")
    return Path(path).resolve()


def natural(text):
    if int(text) < 1:
        raise ValueError
    return int(text)


def parse():
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, epilog=HELP, formatter_class=plain)
    commands = parser.add_subparsers(title="subcommands", required=True, metavar="keep | compare | threads | examples")
    about = "comma-separated columns of the CSV files, and keys of result.json with all in them, to leave out"

    def command(name, function, summary):
        made = commands.add_parser(name, help=summary, description=summary, epilog=HELP, formatter_class=plain)
        made.set_defaults(function=function)
        made.add_argument("--cases", type=Path, nargs="+", metavar="PATH", help="case files, or folders of them")
        made.add_argument("--only", action="append", default=[], metavar="WORD", help="only cases with it in their name")
        made.add_argument("--skip", action="append", default=[], metavar="WORD", help="no cases with it in their name")
        made.add_argument("--jobs", type=natural, default=1, metavar="N", help="cases to run at a time (1)")
        made.add_argument("--limit", type=float, default=900, metavar="SECONDS", help="time limit of each run (900)")
        return made

    made = command("keep", keep, "Run every case and keep what comes of it, in FOLDER/<folder>/<case>.")
    made.add_argument("folder", type=Path, metavar="FOLDER")
    made.add_argument("--program", type=program, required=True, metavar="BINARY")
    made.add_argument("--threads", type=natural, default=2, metavar="N", help="threads of each run (2)")
    made.add_argument("--again", action="store_true", help="also run the cases that are kept already")

    made = command("compare", compare, "Run the kept cases again, on as many threads, and compare; quick ones first.")
    made.add_argument("folder", type=Path, metavar="FOLDER")
    which = made.add_mutually_exclusive_group(required=True)
    which.add_argument("--program", type=program, metavar="BINARY")
    which.add_argument("--with", dest="other", type=Path, metavar="FOLDER", help="run nothing: compare two kept folders")
    made.add_argument("--close", action="store_true", help=f"let relative differences up to {CLOSE:g} pass")
    made.add_argument("--ignore-columns", type=words, default=frozenset(), metavar="A,B", help=about)
    made.add_argument("--at-most", type=float, metavar="SECONDS", help="only cases that took no longer when kept")

    made = command("threads", threads, "Run every case of cases/ at several thread counts and compare the bytes.")
    made.add_argument("--program", type=program, required=True, metavar="BINARY")
    made.add_argument("--threads", type=counts, default=[1, 2, 3], metavar="1,2,3", help="thread counts (1,2,3)")
    made.add_argument("--ignore-columns", type=words, default=frozenset(), metavar="A,B", help=about)

    summary = "Compare the tables of RESULTS/<case> with the kept numbers of the shipped cases."
    made = commands.add_parser("examples", help=summary, description=summary, epilog=HELP, formatter_class=plain)
    made.set_defaults(function=examples)
    made.add_argument("folder", type=Path, metavar="RESULTS")
    made.add_argument("--write", action="store_true", help="keep the numbers of RESULTS in the project")
    return parser.parse_args()


if __name__ == "__main__":
    chosen = parse()
    try:
        sys.exit(chosen.function(chosen))
    except KeyboardInterrupt:
        sys.exit(130)
