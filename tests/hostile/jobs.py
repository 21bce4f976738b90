"""One file: made, checked, run, and judged."""

import dataclasses
import json
import os
import pathlib
import random
import re
import shutil
import tempfile

from . import commands, damage, drawn, faults, oracles, process, schema, spoil, toml

SECONDS_OF_WALL = 600.0


@dataclasses.dataclass
class Report:
    """What came of one file."""

    faults: list = dataclasses.field(default_factory=list)
    statuses: list = dataclasses.field(default_factory=list)
    slowest_check: float = 0.0
    keys: set = dataclasses.field(default_factory=set)

    def note(self, command, found):
        self.faults += [f"{command}: {fault}" for fault in found]


class Kept:
    """What is the same for all files of a process."""

    schema = keys = maker = None


def prepare(binary):
    Kept.schema = schema.read(binary)
    Kept.keys = schema.keys(Kept.schema)
    Kept.maker = damage.Maker()


def one(job):
    arguments, number, kind = job
    report = Report()
    folder = pathlib.Path(tempfile.mkdtemp(prefix="hostile-"))
    try:
        rng = random.Random(f"{arguments.seed}-{number}-{kind}")
        Trial(arguments, folder, report, rng).of(kind, number)
        if arguments.keep and report.faults:
            shutil.copytree(folder, pathlib.Path(arguments.keep) / f"{kind}-{number}", dirs_exist_ok=True, symlinks=True)
        return number, kind, report
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def write(arguments):
    """Writes the drawn cases that are no oracle's, each into a folder of its own."""
    prepare(arguments.binary)
    for number in range(arguments.first, arguments.first + arguments.drawn):
        rng = random.Random(f"{arguments.seed}-{number}-drawn")
        folder = pathlib.Path(arguments.write) / str(number)
        folder.mkdir(parents=True, exist_ok=True)
        write_case(folder, *draw(rng))
    return 0


def draw(rng, cheap=False):
    scene = drawn.Scene(rng, Kept.schema, cheap)
    return scene.draw(), scene.files


def write_case(folder, case, files, name="case.toml"):
    (folder / name).write_text(toml.document(case))
    for file, data in files.items():
        (folder / file).write_bytes(data)


class Trial:
    """The trial of one file in its folder."""

    def __init__(self, arguments, folder, report, rng):
        self.arguments = arguments
        self.folder = folder
        self.report = report
        self.rng = rng

    def of(self, kind, number):
        # What is drawn for the trial does not change what is drawn for the case.
        self.how = random.Random(f"run-{number}-{kind}")
        if kind != "drawn":
            return self.damaged(number, kind == "mesh")
        part = self.how.random()
        if part < 0.03:
            oracles.try_one(self)
        elif part < 0.035:
            commands.try_one(self)
        else:
            self.drawn()

    def damaged(self, number, is_mesh):
        text, name, data = Kept.maker.make(self.arguments.seed, number, is_mesh)
        (self.folder / "case.toml").write_bytes(text.encode("utf-8", "surrogatepass"))
        for path in Kept.maker.beside:
            shutil.copy(path, self.folder)
        if name:
            (self.folder / name).write_bytes(data)
        is_case = re.search(r"(?m)^\s*format\s*=", text) is not None and name is None
        check = self.check(is_case=is_case)
        if self.how.random() < self.arguments.run_share:
            self.run_beside(check, is_case=is_case)

    def drawn(self):
        case, files = draw(self.rng)
        if self.how.random() < 0.2:
            case = spoil.spoil(self.how, case, Kept.schema)
        write_case(self.folder, case, files)
        check = self.check()
        if check.status == 0:
            self.report.keys |= schema.used(case, Kept.keys)
        if self.how.random() < self.arguments.run_share:
            self.run_beside(check)

    # --- commands ---------------------------------------------------------------------------------------------------------------

    def command(self, words, stop_after=None, terminate=False, processor=60.0):
        done = process.run([self.arguments.binary, *words], self.folder, self.arguments.memory, processor, SECONDS_OF_WALL, stop_after, terminate)
        self.report.statuses.append((words[0], done.status))
        return done

    def check(self, name="case.toml", is_case=True):
        done = self.command(["check", "--json", name], processor=2 * faults.CHECK_SECONDS)
        self.report.note("check", faults.of_check(done, is_case))
        self.report.slowest_check = max(self.report.slowest_check, done.processor)
        return done

    def run(self, name="case.toml", out="out", is_case=True, options=("--only", "json"), seconds=None):
        """Runs a case, for a while; gives how it ended and its result, `None` where it has none."""
        seconds = seconds or self.arguments.run_seconds
        line = ["run", name, "-o", out, "--threads", "1", *options]
        terminate = self.how.random() < 0.2
        if terminate:
            seconds *= self.how.random()
        else:
            line += ["--max-time", f"{seconds:g}s"]
        done = self.command(line, seconds, terminate, processor=seconds + 20)
        self.report.note("run", faults.of_run(done, self.folder, seconds, terminate, is_case))
        return done, self.result(out)

    def run_beside(self, check, is_case=True):
        options = ("--only", "json") if self.how.random() < 0.8 else ()
        done, result = self.run(is_case=is_case, options=options)
        self.report.note("both", faults.of_both(check, done, result))
        return done, result

    def result(self, out):
        for name in (out, out + ".partial"):
            try:
                return json.loads((self.folder / name / "result.json").read_text())
            except (OSError, ValueError):
                continue
        return None
