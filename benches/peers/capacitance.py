"""Error against time: elastocap, NGSolve and FastCap2 on the same scenes, as one Markdown table.

    python benches/peers/capacitance.py --elastocap target/release/elastocap --into benches/peers/measured.md

Without --into the table is printed only. README.md says what is needed. A peer that is not installed is left out with a
message; a run past its time limit is ended, and keeps the answers it had given. Nothing else should run on the machine.
"""

import argparse
import datetime
import importlib.metadata
import importlib.util
import json
import os
import platform
import re
import resource
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from scenes import SCENES

HERE = Path(__file__).resolve().parent
BEGIN, END = "<!-- measured -->\n", "<!-- end -->\n"

# Program, module it needs, command after the name of the scene, scenes it cannot do and why.
PEERS = [
    ("NGSolve P2 adaptive", "ngsolve", ["ngsolve_fem.py", "--method", "adaptive"], {}),
    ("NGSolve hp", "ngsolve", ["ngsolve_fem.py", "--method", "hp"], {}),
    (
        "NGSolve BEM",
        "ngsolve",
        ["ngsolve_bem.py"],
        {"layered-spheres": "one permittivity only", "in-plane-pair": "one permittivity, no insulated walls"},
    ),
    ("FastCap2", "fastcap2", ["fastcap_panels.py"], {"in-plane-pair": "no insulated walls"}),
]

# Tolerance, and whether bounds are proved.
SETTINGS = [(1e-2, True), (1e-3, True), (1e-4, True), (1e-3, False), (1e-4, False)]


def say(*words):
    print(*words, file=sys.stderr, flush=True)


def ended_in_time(command, seconds):
    """Standard output, and whether the process ended by itself, within the limit and with status 0."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=HERE)
    try:
        out, err = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        out, _ = process.communicate()
        return out, f"over {seconds:g} s"
    if process.returncode != 0:
        lines = err.strip().splitlines() or [f"exit status {process.returncode}"]
        return out, re.sub(r"^(warning|error): (step 0 failed: )?", "", lines[-1]).split(":")[0][:100]
    return out, None


def rows_of_peer(name, scene, command, options):
    threads = [] if command[0] == "fastcap_panels.py" else ["--threads", str(options.threads)]
    call = [sys.executable, command[0], scene, *command[1:], *threads, "--seconds", str(options.seconds - 10)]
    out, trouble = ended_in_time(call, options.seconds)
    for text in out.splitlines():
        # FastCap prints its warnings between the lines of JSON.
        if text.startswith("{"):
            line = json.loads(text)
            error = SCENES[scene].error(line["entries"])
            yield dict(program=name, setting=line["setting"], error=error, stated=line["stated"], seconds=line["seconds"],
                       cpu=line["cpu_seconds"])
    if trouble:
        yield dict(program=name, setting="the next", note=trouble)


def entries_of(step, suffix):
    """Entries as in scenes.py; suffix is "" for the values, "_lower" or "_upper" for their bounds."""
    matrix = step.get(f"maxwell_matrix{suffix}_f")
    terminal = "two_terminal_capacitance_f" if suffix == "" else f"capacitance{suffix}_f"
    entries = {"C": step.get(terminal)}
    if matrix:
        entries["C11"] = matrix[0][0]
        if len(matrix) > 1:
            entries["C22"], entries["C12"] = matrix[1][1], matrix[0][1]
    return entries


def rows_of_ours(scene, case, options):
    imported = "imported" in case
    past_limit = set()
    for tolerance, bounds in SETTINGS:
        if bounds in past_limit:
            continue  # a looser tolerance took too long already
        setting = ("from OBJ, " if imported else "") + f"{tolerance:.0e}".replace("e-0", "e-") + ("" if bounds else ", no bounds")
        with tempfile.TemporaryDirectory() as folder:
            for file in (HERE / "cases").iterdir():
                shutil.copy(file, folder)
            text = (HERE / "cases" / case).read_text()
            text = re.sub(r"relative_tolerance = \S+", f"relative_tolerance = {tolerance:g}", text)
            if not bounds:
                text = text.rstrip() + "\nbounds = false\n"
            path, results = Path(folder) / "case.toml", Path(folder) / "results"
            path.write_text(text)
            call = [options.elastocap, "run", str(path), "--output", str(results), "--threads", str(options.threads), "--quiet",
                    "--no-fields", "--no-scene"]
            before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
            _, trouble = ended_in_time(call, options.seconds)
            seconds, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
            if trouble:
                yield dict(program="elastocap", setting=setting, note=trouble)
                if trouble.startswith("over"):
                    past_limit.add(bounds)
                continue
            result = json.loads((results / "result.json").read_text())
        step = result["steps"][0]
        solver = step["route"]
        value, lower, upper = (entries_of(step, suffix) for suffix in ("", "_lower", "_upper"))
        known = SCENES[scene].known
        stated, holds = step["relative_error_estimate"], None
        if bounds and all(lower.get(name) is not None for name in known):
            stated = max((upper[name] - lower[name]) / 2 / abs(value[name]) for name in known)
            holds = all(lower[name] <= truth <= upper[name] for name, truth in known.items())
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        yield dict(program=f"elastocap, {solver}", setting=setting, error=SCENES[scene].error(value), stated=stated, seconds=seconds,
                   cpu=cpu, holds=holds)


def number(value):
    return "" if value is None else f"{value:.1e}".replace("e-0", "e-").replace("e+00", "")


def duration(seconds):
    return f"{seconds:.0f} s" if seconds >= 9.95 else f"{seconds:.2g} s"


def line_of(scene, row):
    first = f"| {SCENES[scene].title} | {row['program']} | {row['setting']} "
    if "note" in row:
        return first + f"| | | {row['note']} | |"
    holds = {None: "", True: ", holds", False: ", DOES NOT HOLD"}[row.get("holds")]
    return first + f"| {number(row['error'])} | {number(row['stated'])}{holds} | {duration(row['seconds'])} | {duration(row['cpu'])} |"


def version(module):
    try:
        return importlib.metadata.version(module)
    except importlib.metadata.PackageNotFoundError:
        return None


def version_of_ours(path):
    return subprocess.run([path, "--version"], capture_output=True, text=True, check=True).stdout.strip()


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--elastocap", default=str(HERE.parents[1] / "target/release/elastocap"), help="the program")
    options.add_argument("--threads", type=int, default=2)
    options.add_argument("--seconds", type=float, default=60, help="limit of each run")
    options.add_argument("--scene", action="append", choices=SCENES, help="only this one; may be given again")
    options.add_argument("--only", choices=("elastocap", "peers"), help="leave the others out")
    options.add_argument("--into", type=Path, help="file in which the table replaces what stands between the marks")
    chosen = options.parse_args()
    if chosen.only != "peers":
        chosen.elastocap = str(Path(chosen.elastocap).resolve())
        if not os.access(chosen.elastocap, os.X_OK):
            sys.exit(f"{chosen.elastocap} is not there: build it with `cargo build --release`, or give --elastocap")

    table, sources = [], []
    load = [os.getloadavg()[0]]
    for scene in chosen.scene or SCENES:
        sources.append(f"- {SCENES[scene].title}: {SCENES[scene].source}")
        runs = []
        if chosen.only != "peers":
            runs += [("elastocap", rows_of_ours(scene, case, chosen)) for case in SCENES[scene].cases]
        for name, module, command, cannot in PEERS if chosen.only != "elastocap" else []:
            if importlib.util.find_spec(module) is None:
                say(f"{name} is left out: {module} is not installed (pip install -r benches/peers/requirements.txt)")
            elif scene in cannot:
                runs.append((name, [dict(program=name, setting="", note=f"cannot: {cannot[scene]}")]))
            else:
                runs.append((name, rows_of_peer(name, scene, command, chosen)))
        for name, rows in runs:
            say(f"{scene}: {name}")
            for row in rows:
                table.append(line_of(scene, row))
                say("  " + table[-1])
        load.append(os.getloadavg()[0])

    versions = [f"{m} {version(m)}" for m in ("ngsolve", "fastcap2") if version(m)]
    if chosen.only != "peers":
        versions.insert(0, version_of_ours(chosen.elastocap))
    text = "\n".join(
        [
            f"    {shlex.join(['python', 'benches/peers/capacitance.py', *sys.argv[1:]])}",
            "",
            f"{datetime.date.today().isoformat()}; {', '.join(versions)}; Python {platform.python_version()}; threads: {chosen.threads}, "
            f"cores: {os.cpu_count()}; load of the machine {min(load):.1f} to {max(load):.1f}, of which this is up to "
            f"{chosen.threads}.",
            "",
            "Known values:",
            "",
            *sources,
            "",
            "| scene | program | setting | true error | stated error | time | processor time |",
            "|---|---|---|---|---|---|---|",
            *table,
            "",
        ]
    )
    print(text)
    if chosen.into:
        whole = chosen.into.read_text()
        head, _, rest = whole.partition(BEGIN)
        _, found, tail = rest.partition(END)
        if not found:
            sys.exit(f"{chosen.into} does not have the marks {BEGIN.strip()} and {END.strip()}")
        chosen.into.write_text(head + BEGIN + "\n" + text + "\n" + END + tail)


if __name__ == "__main__":
    main()
