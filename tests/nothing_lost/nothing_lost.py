"""Breaks runs of elastocap in every way that is known, and looks at what is left of their files.

    cargo build --release
    python3 tests/nothing_lost/nothing_lost.py            # everything; docs/reliability.md has some of the rows that it prints
    python3 tests/nothing_lost/nothing_lost.py --quick    # a part of it, for .ci/run

Parts can be named: faults, kill, terminate, interrupt, resume. Needs a C compiler (cc) and Linux. Exits with 1 if something is lost.
"""

import argparse
import errno
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# An earlier run with other files than the later one has: both are solved in no time.
FIRST, SECOND = HERE / "stale-first.toml", HERE / "stale-second.toml"
LONGER = ROOT / "cases/in-plane-pair.toml"
OWN = {"notes.txt": b"the user's own\n"}


class Lost(Exception):
    """What should not have happened."""


def content(folder):
    """The files of a folder, by their paths in it; None if there is no folder."""
    if not folder.is_dir():
        return None
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def is_result_of(files, case_name, own):
    """Whether this is one whole result of a case, beside the user's own files."""
    files = {name: text for name, text in files.items() if not name.startswith(".elastocap-")}
    for name, text in own.items():
        if files.pop(name, None) != text:
            raise Lost(f"the user's {name} is gone or changed")
    if "result.json" not in files:
        return False
    index = json.loads(files["result.json"])
    if Path(index["case"]).name != case_name:
        return False
    if sorted(index["files"]) != sorted(files):
        raise Lost(f"a mixture: {sorted(files)} where result.json lists {sorted(index['files'])}")
    for name in index["files"]:
        if not files[name] and name.endswith((".csv", ".json", ".vtu", ".glb", ".html")):
            raise Lost(f"{name} is empty")
    return True


class Bench:
    """A folder in which runs are broken."""

    def __init__(self, binary, place):
        self.binary, self.place = binary, place
        self.stage = place / "stage"
        self.out = self.stage / "out"
        self.cases = place / "cases"
        self.cases.mkdir()
        for case in (FIRST, SECOND, LONGER):
            shutil.copy(case, self.cases)
        self.shim = place / "faults.so"
        subprocess.run(
            ["cc", "-shared", "-fPIC", "-O1", "-o", self.shim, HERE / "faults.c", "-ldl"], check=True
        )
        self.earlier = {}

    def command(self, case, *more):
        return [self.binary, "run", self.cases / case.name, "-o", self.out, "--quiet", "--threads", "2", *more]

    def run(self, case, *more, **environment):
        return subprocess.run(
            self.command(case, *more),
            env={**os.environ, **{key: str(value) for key, value in environment.items()}},
            capture_output=True,
            text=True,
        )

    def fresh(self, earlier, own):
        """The stage with the result of an earlier case, and files of the user beside it."""
        shutil.rmtree(self.stage, ignore_errors=True)
        self.stage.mkdir()
        if earlier is not None:
            if earlier not in self.earlier:
                done = self.run(earlier)
                if done.returncode != 0:
                    raise Lost(f"{earlier.name} does not run: {done.stderr}")
                self.earlier[earlier] = self.place / f"earlier-{earlier.stem}"
                shutil.copytree(self.out, self.earlier[earlier])
                shutil.rmtree(self.out)
            shutil.copytree(self.earlier[earlier], self.out)
        for name, text in own.items():
            file = self.out / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(text)

    def seen(self, earlier, later, own):
        """`old` or `new`, or `none` where no result stands in the output folder."""
        files = content(self.out)
        if files is None:
            # Without an exchange of names there is a moment between two renamings.
            if own and not any(".old" in name for name in self.leftovers()):
                raise Lost("the folder with the user's files is gone")
            return "none"
        if is_result_of(files, later.name, own):
            return "new"
        if earlier is not None and is_result_of(files, earlier.name, own):
            for name, text in content(self.earlier[earlier]).items():
                if files[name] != text:
                    raise Lost(f"{name} of the earlier result is changed")
            return "old"
        return "none"

    def leftovers(self):
        """Names beside the output folder and its `.partial`, and hidden ones in them."""
        names = [str(path.relative_to(self.stage)) for path in self.stage.rglob("*")]
        usual = ("out", "out.partial")
        return [n for n in names if Path(n).parts[0] not in usual or Path(n).name.startswith(".")]

    def next_run_is_well(self, later, own, what):
        """Whatever came before, the next run puts its result in place, and nothing else is left."""
        done = self.run(later)
        if done.returncode != 0:
            raise Lost(f"the run after {what} fails: {done.stderr}")
        if self.seen(None, later, own) != "new" or self.leftovers():
            raise Lost(f"the run after {what} leaves {self.leftovers()}")


def scenarios():
    """Name, earlier case, the user's files, variables of the shim."""
    inside = {"plots/mine.txt": b"own\n", **OWN}
    return [
        ("new folder", None, {}, {}),
        ("result of another case", FIRST, {}, {}),
        ("with a file of the user", FIRST, OWN, {}),
        ("no exchange of folders", FIRST, OWN, {"FAULT_NO_EXCHANGE": 1}),
        ("with a folder of the user", FIRST, inside, {}),
    ]


def faults(bench, every):
    """One fault at each system call that changes files; also the process killed there."""
    rows = []
    for name, earlier, own, shim in scenarios():
        bench.fresh(earlier, own)
        log = bench.place / "calls"
        log.unlink(missing_ok=True)
        base = {"LD_PRELOAD": bench.shim, "FAULT_ROOT": bench.stage, **shim}
        done = bench.run(SECOND, FAULT_LOG=log, **base)
        if done.returncode != 0:
            raise Lost(f"{name}: a run without a fault fails: {done.stderr}")
        calls = len(log.read_text().splitlines())
        # A call or two more: threads share their work in another way each time.
        numbers = range(1, calls + 3, every)
        for kind, settings in [
            ("no space left", {"FAULT_ERRNO": errno.ENOSPC}),
            ("input/output error", {"FAULT_ERRNO": errno.EIO}),
            ("killed", {"FAULT_KILL": 1}),
        ]:
            count = {"old": 0, "new": 0, "none": 0}
            for number in numbers:
                what = f"{name}, {kind} at call {number} of {calls}"
                bench.fresh(earlier, own)
                done = bench.run(SECOND, FAULT_AT=number, **settings, **base)
                try:
                    seen = bench.seen(earlier, SECOND, own)
                    count[seen] += 1
                    if kind != "killed":
                        judge_fault(done, seen, earlier, what)
                    if kind == "killed" and earlier is not None and seen == "none":
                        in_between(bench, what)
                    bench.next_run_is_well(SECOND, own, what)
                except Lost as lost:
                    raise Lost(f"{what}: {lost}\n{done.stderr}") from lost
            rows.append((f"{name}: {kind}", len(numbers), count))
    return rows


def aside(bench, every):
    """The same for a run with failed steps, whose files go beside a complete result: that one stays, whatever happens."""
    rows = []
    later = bench.cases / "failed-steps.toml"
    text = SECOND.read_text().replace("compression = [0.0, 0.1]", "compression = [0.0, 0.97]")
    later.write_text(text)
    partial = bench.stage / "out.partial"

    def fresh():
        bench.fresh(SECOND, OWN)
        # An unfinished result of another kind, which is replaced, and a file of the user in it.
        shutil.copytree(bench.place / "earlier-unfinished", partial)

    bench.fresh(SECOND, OWN)
    if bench.run(later).returncode != 3 or not partial.is_dir():
        raise Lost("a run with failed steps does not go beside the complete one")
    (partial / "notes.txt").write_bytes(OWN["notes.txt"])
    shutil.copytree(partial, bench.place / "earlier-unfinished")
    base = {"LD_PRELOAD": bench.shim, "FAULT_ROOT": bench.stage}
    log = bench.place / "calls"
    log.unlink(missing_ok=True)
    fresh()
    bench.run(later, FAULT_LOG=log, **base)
    calls = len(log.read_text().splitlines())
    numbers = range(1, calls + 3, every)
    for kind, settings in [
        ("input/output error", {"FAULT_ERRNO": errno.EIO}),
        ("killed", {"FAULT_KILL": 1}),
        ("killed, no exchange of folders", {"FAULT_KILL": 1, "FAULT_NO_EXCHANGE": 1}),
    ]:
        count = {"old": 0, "new": 0, "none": 0}
        for number in numbers:
            what = f"failed steps, {kind} at call {number} of {calls}"
            fresh()
            done = bench.run(later, FAULT_AT=number, **settings, **base)
            try:
                if bench.seen(SECOND, SECOND, OWN) != "new":
                    raise Lost("the complete result is gone")
                there = content(partial)
                if there is None and "FAULT_NO_EXCHANGE" in settings:
                    count["none"] += 1
                elif there is not None and is_result_of(there, later.name, OWN):
                    count["new" if done.returncode == 3 else "old"] += 1
                else:
                    raise Lost("the unfinished result is gone")
                if bench.run(later).returncode != 3 or bench.leftovers():
                    raise Lost(f"the next run leaves {bench.leftovers()}")
                if not is_result_of(content(partial), later.name, OWN):
                    raise Lost("the next run does not replace the unfinished result")
            except Lost as lost:
                raise Lost(f"{what}: {lost}\n{done.stderr}") from lost
        rows.append((f"failed steps, beside a complete result: {kind}", len(numbers), count))
    return rows


def judge_fault(done, seen, earlier, what):
    if done.returncode not in (0, 1):
        raise Lost(f"exit status {done.returncode}")
    if "panicked" in done.stderr:
        raise Lost("it panics")
    if done.returncode == 0 and seen != "new":
        raise Lost(f"exit status 0, and the {seen} result is in place")
    if done.returncode == 1 and "error: " not in done.stderr:
        raise Lost("it fails without saying so")
    if earlier is not None and seen == "none":
        raise Lost("there is no result any more")


def in_between(bench, what):
    """Killed between two renamings: what was there must be beside it or inside it."""
    left = bench.leftovers()
    if not any(".old" in name or ".elastocap-commit" in name for name in left):
        raise Lost(f"no result, and nothing to recover one from: {left}")


def spoilt(bench, number, how, later, check):
    """Runs sent a signal at random times of their lives, in the folder of a complete result."""
    count = {"old": 0, "new": 0, "none": 0}
    longest = 0.0
    bench.fresh(SECOND, OWN)
    begin = time.monotonic()
    bench.run(later)
    usual = time.monotonic() - begin
    chance = random.Random(1)
    for attempt in range(number):
        bench.fresh(SECOND, OWN)
        process = subprocess.Popen(bench.command(later), stderr=subprocess.PIPE, text=True)
        time.sleep(chance.uniform(0.0, 1.1 * usual))
        sent = time.monotonic()
        process.send_signal(how)
        said = process.communicate()[1]
        longest = max(longest, time.monotonic() - sent)
        try:
            seen = bench.seen(SECOND, later, OWN)
            count[seen] += 1
            check(bench, process.returncode, seen, said)
            bench.next_run_is_well(later, OWN, f"{how.name} number {attempt}")
        except Lost as lost:
            raise Lost(f"{how.name} number {attempt}: {lost}\n{said}") from lost
    return number, count, longest


def after_kill(bench, status, seen, said):
    if seen == "none":
        raise Lost("there is no result any more")


def after_request(bench, status, seen, said):
    """A run asked to stop: done, or stopped with what is finished in `.partial`, or too young to know of signals."""
    too_young = status in (-signal.SIGTERM, -signal.SIGINT, -signal.SIGHUP)
    if seen == "none" or status not in (0, 3) and not too_young:
        raise Lost(f"{seen}, exit status {status}")
    if status == 0 and seen != "new" or status == 3 and seen != "old":
        raise Lost(f"exit status {status} and the {seen} result")
    if status == 3:
        partial = content(bench.stage / "out.partial")
        if partial is None or not is_result_of(partial, LONGER.name, {}):
            raise Lost("nothing in out.partial")
        if json.loads(partial["result.json"])["status"] != "stopped" or "out.partial" not in said:
            raise Lost("it does not say that it was stopped and where its files are")
    if not too_young and bench.leftovers():
        raise Lost(f"left over: {bench.leftovers()}")


def resumed(bench, number):
    """Runs stopped at random times and gone on with, until they are done: the table is that of a run that was let alone."""
    bench.fresh(None, {})
    begin = time.monotonic()
    if bench.run(LONGER).returncode != 0:
        raise Lost("the case does not run")
    usual = time.monotonic() - begin
    files = content(bench.out)
    chance = random.Random(2)
    stops = 0
    for attempt in range(number):
        bench.fresh(None, {})
        going_on = []
        # Each time a little longer, so that it comes to an end.
        for more in range(100):
            process = subprocess.Popen(bench.command(LONGER, *going_on), stderr=subprocess.PIPE, text=True)
            time.sleep(chance.uniform(0.3, 0.9 + 0.1 * more) * usual)
            process.send_signal(signal.SIGTERM)
            said = process.communicate()[1]
            if process.returncode == 0:
                break
            if process.returncode == 3:
                stops += 1
                going_on = ["--resume"]
            elif process.returncode != -signal.SIGTERM:
                raise Lost(f"a run that goes on ends with {process.returncode}: {said}")
        found = content(bench.out)
        if found is None or set(found) != set(files):
            raise Lost(f"a run that was gone on with {attempt} has other files: {found and sorted(found)}")
        for name, text in files.items():
            if name not in ("result.json", "report.html") and found[name] != text:
                raise Lost(f"{name} of a run that was gone on with differs from that of one that was let alone")
        if bench.leftovers() or (bench.stage / "out.partial").exists():
            raise Lost("something is left over")
    return number, stops


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("parts", nargs="*", help="faults, kill, terminate, interrupt, resume; all of them by default")
    parser.add_argument("--quick", action="store_true", help="every seventh fault and five signals of each kind")
    parser.add_argument("--binary", type=Path, default=ROOT / "target/release/elastocap")
    options = parser.parse_args()
    wanted = lambda part: not options.parts or part in options.parts
    number = 5 if options.quick else 50
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(options.binary.resolve(), Path(folder).resolve())
        if wanted("faults"):
            rows += faults(bench, 7 if options.quick else 1)
            rows += aside(bench, 7 if options.quick else 1)
        for part, how, check in [
            ("kill", signal.SIGKILL, after_kill),
            ("terminate", signal.SIGTERM, after_request),
            ("interrupt", signal.SIGINT, after_request),
        ]:
            if wanted(part):
                times, count, longest = spoilt(bench, number, how, LONGER, check)
                rows.append((f"{how.name} at any time of a rerun; ended after {longest:.2f} s at most", times, count))
        if wanted("resume"):
            times, stops = resumed(bench, number)
            rows.append((f"stopped {stops} times in all, gone on with --resume: the same files but for times", times, {"old": 0, "new": times, "none": 0}))
    print("| what | times | old result | new result | recovered by the next run |")
    print("|---|---:|---:|---:|---:|")
    for what, times, count in rows:
        print(f"| {what} | {times} | {count['old']} | {count['new']} | {count['none']} |")


if __name__ == "__main__":
    try:
        main()
    except Lost as lost:
        print(f"LOST: {lost}", file=sys.stderr)
        sys.exit(1)
