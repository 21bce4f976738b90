"""What writing report.html adds to a run: processor time and wall time of a run of cases/in-plane-pair.toml, with and without it.

    python3 tests/report/bench.py [--runs 40] [--against OTHER_BINARY]

The runs with and without take turns, so that whatever else the machine does meets both. `--against` adds another elastocap, an older one
for instance, with all files that it writes.
"""

import argparse
import resource
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ALL_BUT_REPORT = "curve,capacitance,scene,fields,sections,mechanics,layer"


def once(command):
    """Processor and wall seconds of a command."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=ROOT)
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--against", type=Path)
    options = parser.parse_args()
    binary = str(ROOT / "target/release/elastocap")
    with tempfile.TemporaryDirectory() as folder:
        run = ["run", "cases/in-plane-pair.toml", "--quiet", "-o"]
        commands = {
            "all files": [binary, *run, f"{folder}/all"],
            "all but report.html": [binary, *run, f"{folder}/but", "--only", ALL_BUT_REPORT],
            "curve alone": [binary, *run, f"{folder}/curve", "--only", "curve"],
        }
        if options.against:
            commands["the other binary"] = [str(options.against), *run, f"{folder}/other"]
        seconds = {name: [] for name in commands}
        for _ in range(options.runs):
            for name, command in commands.items():
                seconds[name].append(once(command))
        for name, all_of in seconds.items():
            processor, wall = ([1e3 * own[k] for own in all_of] for k in (0, 1))
            print(
                f"{name:20} processor {statistics.median(processor):6.1f} ms (least {min(processor):6.1f})"
                f"   wall {statistics.median(wall):6.1f} ms (least {min(wall):6.1f})"
            )


main()
