#!/usr/bin/env python3
"""What `elastocap check` predicts and what `elastocap run` takes, for case files; docs/forecasts.md has some of the rows.

    benches/forecast.py [--binary target/release/elastocap] [CASE ...]
    benches/forecast.py --drawn 200 [--seed 2]   cases drawn from the schema: peak and time over forecast, worst and median

Memory is the peak of the resident memory of the process (rusage), time its processor time over all threads, so that the table can
be made on a machine that does other things too. The forecast of the time is that of two cores; on one, or in processor time, it is
about so many times longer as the row says at the head of the table.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent


def measured(line):
    """Exit status, processor seconds and peak bytes of a command."""
    null = os.open(os.devnull, os.O_RDWR)
    child = subprocess.Popen(line, stdin=null, stdout=null, stderr=null)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    os.close(null)
    return child.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def size(count):
    return f"{count * 1e-9:.2f} GB" if count >= 1e9 else f"{count * 1e-6:.0f} MB"


def row(binary, case):
    predicted = json.loads(subprocess.run([binary, "check", "--json", case], capture_output=True, check=True).stdout)
    layer = predicted.get("layer") or {}
    memory = max(predicted["memory_bytes"], layer.get("memory_bytes", 0))
    seconds = predicted["seconds"] + layer.get("seconds", 0.0)
    with tempfile.TemporaryDirectory() as folder:
        status, processor, peak = measured([binary, "run", case, "-o", folder, "--quiet"])
        found = json.loads((pathlib.Path(folder) / "result.json").read_text())
    largest = max([step.get("unknowns") or 0 for step in found.get("steps", [])] + [found.get("unknowns") or 0])
    return [pathlib.Path(case).name, predicted["unknowns"], largest, memory, peak, seconds, processor, status]


def drawn(binary, count, seed):
    """Runs cases drawn from the schema that `check` accepts, and prints how peaks and times compare with their forecasts."""
    memory, time, low, slow = [], [], [], []
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, ROOT / "tests/hostile.py", "--binary", binary, "--drawn", str(3 * count), "--seed", str(seed), "--write", folder], check=True)
        for place in sorted(pathlib.Path(folder).iterdir(), key=lambda path: int(path.name)):
            case = str(place / "case.toml")
            said = subprocess.run([binary, "check", "--json", case], capture_output=True)
            if said.returncode not in (0, 3) or len(memory) >= count:
                continue
            plan = json.loads(said.stdout)
            layer = plan.get("layer") or {}
            status, seconds, peak = measured([binary, "run", case, "-o", str(place / "out"), "--quiet", "--max-time", "60s"])
            foretold = max(plan["memory_bytes"], layer.get("memory_bytes", 0))
            expected = plan["seconds"] + layer.get("seconds", 0.0)
            if foretold:
                memory.append(peak / foretold)
                low += [place.name] if peak > foretold else []
            if expected and status == 0 and seconds > 1.0:
                time.append(seconds / expected)
                # The forecast is that of two cores.
                slow += [place.name] if not 1 / 3 < seconds / expected < 6 else []
    for name, found in (("peak over memory foretold", memory), ("processor time over time foretold, from 1 s on", time)):
        found.sort()
        if found:
            print(f"| {name} | {len(found)} | {found[0]:.2f} | {found[len(found) // 2]:.2f} | {found[-1]:.2f} |")
    print(f"too low in memory: {', '.join(low) or 'none'}; far off in time: {', '.join(slow) or 'none'}", file=sys.stderr)
    return 1 if low else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    parser.add_argument("cases", nargs="*", default=[str(path) for path in sorted((ROOT / "cases").glob("*.toml"))])
    parser.add_argument("--drawn", type=int, help="number of cases drawn from the schema")
    parser.add_argument("--seed", type=int, default=1, help="of the drawn cases")
    arguments = parser.parse_args()
    if arguments.drawn:
        print("| | cases | least | median | most |")
        print("|---|---|---|---|---|")
        return drawn(arguments.binary, arguments.drawn, arguments.seed)
    print("| case | unknowns predicted | needed | ratio | memory predicted | peak | ratio | time predicted | processor time | ratio |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    low = False
    for case in arguments.cases:
        name, wanted, largest, memory, peak, seconds, processor, status = row(arguments.binary, case)
        ratio = lambda a, b: f"{a / b:.2f}" if b else "-"
        print(f"| {name} | {wanted:,} | {largest:,} | {ratio(wanted, largest)} | {size(memory)} | {size(peak)} | {ratio(memory, peak)} "
              f"| {seconds:.2f} s | {processor:.2f} s | {ratio(seconds, processor)} |" + ("" if status == 0 else f" exit status {status}"), flush=True)
        low |= memory < peak
    if low:
        print("\na memory was predicted too low", file=sys.stderr)
    return 1 if low else 0


if __name__ == "__main__":
    sys.exit(main())
