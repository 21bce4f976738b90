#!/usr/bin/env python3
"""A sweep that is killed again and again, beside the same sweep in one go.

    python3 benches/sweep_kills.py PROGRAM [--cases N] [--kills N]

Random tolerances of cases/in-plane-pair.toml are solved in one go. Then the same sweep is begun in another folder and killed (SIGKILL), and
the same command goes on and is killed again, each time a little later after its start; the last one is left to finish. Prints how many
cases were finished at each kill. The exit status is 1 if the tables of the two differ by a byte, or if the record of a finished case was
written a second time.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile
import time

CASE = pathlib.Path(__file__).resolve().parent.parent / "cases/in-plane-pair.toml"


def records(folder):
    """When each record of a finished case was written, in nanoseconds."""
    cases = folder / "cases"
    found = cases.iterdir() if cases.is_dir() else []
    return {record.name: record.stat().st_mtime_ns for record in found if not record.name.startswith(".")}


def written_again(before, now):
    """The records that are not as they were."""
    return sorted(name for name, when in before.items() if now.get(name) != when)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--kills", type=int, default=20)
    arguments = parser.parse_args()
    program = arguments.program.resolve()
    faults = []
    with tempfile.TemporaryDirectory() as temporary:
        whole, killed = pathlib.Path(temporary, "whole"), pathlib.Path(temporary, "killed")

        def sweep(folder):
            return [program, "sweep", CASE, "-o", folder, "--quiet", "--random", str(arguments.cases),
                    "--set", "electrodes.in_plane_pair.gap=normal(50um, 2um)", "--set", "layer.thickness=uniform(440um, 460um)"]

        begun = time.monotonic()
        subprocess.run(sweep(whole), check=True, stdout=subprocess.DEVNULL)
        took = time.monotonic() - begun
        print(f"in one go: {len(records(whole))} cases in {took:.1f} s", flush=True)
        known = {}
        begun = time.monotonic()
        for kill in range(1, arguments.kills + 1):
            process = subprocess.Popen(sweep(killed), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            # From earlier to later after the start, and all of them together about as long as the sweep.
            time.sleep(took * 2 * kill / (arguments.kills * (arguments.kills + 1)))
            process.kill()
            process.wait()
            now = records(killed)
            print(f"kill {kill}: {len(now)} cases finished", flush=True)
            faults += [f"{name} was written again before kill {kill}" for name in written_again(known, now)]
            known = now
        subprocess.run(sweep(killed), check=True, stdout=subprocess.DEVNULL)
        print(f"killed {arguments.kills} times and finished: {time.monotonic() - begun:.1f} s", flush=True)
        now = records(killed)
        faults += [f"{name} was written again after the last kill" for name in written_again(known, now)]
        if len(now) != arguments.cases:
            faults.append(f"{len(now)} records in place of {arguments.cases}")
        if (killed / "sweep.csv").read_bytes() != (whole / "sweep.csv").read_bytes():
            faults.append("the tables differ")
    for fault in faults:
        print(f"FAULT: {fault}")
    if not faults:
        print("the tables are the same to the byte, and no finished case was written again")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
