#!/usr/bin/env python3
"""Hostile and random case files for elastocap, and oracles that know what is right.

    tests/hostile.py --binary target/release/elastocap --drawn 20000 --cases 10000 --meshes 2000

Files are made from a seed, and each is checked; a share of them is run too, in little memory and for a short time:

    drawn     cases of every key, from `elastocap schema` (hostile/drawn.py), some spoilt in one place; a share of them are scenes with
              a known answer: layers in series, mirror images, two ways to write one scene, other lengths and tolerances
              (hostile/oracles.py), and commands on their results: exports, comparisons, forces, sweeps, fits (hostile/commands.py)
    cases     those of cases/ and tests/acceptance with damage, and classes made by hand (hostile/damage.py)
    meshes    OBJ and Gmsh files with damage

Found fault with, and printed with the seed of the file (hostile/faults.py says exactly what):

    abort or signal, panic, defect, undocumented exit status, contradiction of bounds, oracle
    hang              `check` takes more than 10 s of processor time
    late              a run goes on for more than 2 s of processor time after SIGTERM or --max-time, and 1 s for 100 MB of results
    lie               `check` and `run` contradict each other
    peak              the memory of a run is more than `check` says at most
    messages          more than ten errors and warnings
    content           a word of a file that is not a case file in a message
    leftovers         files of a run that failed (exit status 1 or 2), hidden files of any
    names             a written file cannot be read for a name in it

The exit status is 1 if any fault was found.
"""

import argparse
import collections
import concurrent.futures
import pathlib
import re
import sys
import time

from hostile import jobs, schema

ROOT = pathlib.Path(__file__).resolve().parent.parent


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    parser.add_argument("--drawn", type=int, default=300, help="number of cases drawn from the schema")
    parser.add_argument("--cases", type=int, default=160, help="number of case files with damage")
    parser.add_argument("--meshes", type=int, default=40, help="number of OBJ and Gmsh files with damage")
    parser.add_argument("--first", type=int, default=0, help="number of the first file")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--run-share", type=float, default=0.05, help="share of the files that are run too")
    parser.add_argument("--run-seconds", type=float, default=3.0, help="--max-time of a run")
    parser.add_argument("--memory", type=int, default=4_000_000_000, help="address space of a process, bytes")
    parser.add_argument("--seconds", type=float, help="begin no further file after so long")
    parser.add_argument("--keep", help="folder for the files with faults")
    parser.add_argument("--write", help="only write the drawn cases to this folder")
    parser.add_argument("--coverage", action="store_true", help="print the keys that no accepted case had")
    arguments = parser.parse_args()
    arguments.binary = str(pathlib.Path(arguments.binary).resolve())
    return jobs.write(arguments) if arguments.write else try_all(arguments)


def try_all(arguments):
    work = [(arguments, k, kind) for kind, count in (("drawn", arguments.drawn), ("case", arguments.cases), ("mesh", arguments.meshes))
            for k in range(arguments.first, arguments.first + count)]
    statuses, kinds = collections.Counter(), collections.Counter()
    slowest, tried, faulty, began, exercised = 0.0, 0, 0, time.monotonic(), collections.Counter()
    with concurrent.futures.ProcessPoolExecutor(arguments.jobs, initializer=jobs.prepare, initargs=(arguments.binary,)) as pool:
        for number, kind, report in pool.map(jobs.one, work, chunksize=4):
            for command, status in report.statuses:
                statuses[kind, command, status] += 1
            for fault in report.faults:
                print(f"{kind} {number} (seed {arguments.seed}): {fault}", flush=True)
                kinds[re.split(r": ", fault)[1]] += 1
            slowest = max(slowest, report.slowest_check)
            exercised.update(report.keys)
            tried += 1
            faulty += bool(report.faults)
            if arguments.seconds and time.monotonic() - began > arguments.seconds:
                pool.shutdown(wait=True, cancel_futures=True)
                break
    for kind, command in sorted({(kind, command) for kind, command, _ in statuses}):
        counts = [f"{'ended' if status is None else f'exit status {status}'}: {n}"
                  for (k, c, status), n in sorted(statuses.items(), key=str) if (k, c) == (kind, command)]
        print(f"{kind}, {command}: {', '.join(counts)}")
    if arguments.drawn:
        known = schema.keys(schema.read(arguments.binary))
        print(f"keys and words of the schema in accepted cases: {len(exercised)} of {len(known)}")
        if arguments.coverage:
            print("never:", *sorted(known - set(exercised)), sep="\n    ")
    print("faults:", ", ".join(f"{kind}: {n}" for kind, n in sorted(kinds.items())) or "none")
    print(f"slowest check {slowest:.1f} s of processor time; {time.monotonic() - began:.0f} s in all")
    print(f"{tried} of {len(work)} tried: {tried - faulty} passed, {faulty} failed")
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
