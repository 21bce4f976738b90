#!/usr/bin/env python3
"""Runs what the book shows: its cases, its commands, and the numbers that they print.

    python3 tests/book/examples.py BINARY                   checks every whole case, and runs the commands of the tutorial pages
    python3 tests/book/examples.py BINARY --outputs DIR     also holds the shown outputs of shipped cases against DIR/NAME.txt
    python3 tests/book/examples.py BINARY --outputs DIR --write     puts cases and outputs into the pages
    python3 tests/book/examples.py BINARY --write           puts what the commands of the tutorial pages print into these pages

A whole case is a block marked `toml` with a line `format = 1`; it goes through `elastocap check`. On the pages of RUN the blocks
marked `sh` are run one after another in a temporary folder, and a block marked `text` after one is what it prints: its numbers to three
parts in 100,000, since another processor may take another step, and its errors (2.9e-4) to a factor of two. A quantity with two or more
decimals in the words of such a page is one of these numbers, rounded, or the difference of two of them, or stands in a command. Elsewhere,
`<!-- case cases/x.toml -->` stands before the text of that case and `<!-- output cases/x.toml -->` before what a run of it prints: numbers to one
part in a thousand, errors to a factor of ten. Times are not compared, and names of folders only by their last part.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
RUN = [DOCS / "tutorial.md", DOCS / "materials.md", DOCS / "kinds" / "array.md"]

BLOCK = re.compile(r"^```([a-z]*)\n(.*?)^```$", re.M | re.S)
MARK = re.compile(r"^<!-- (case|output) (\S+) -->\n\n```[a-z]*\n(.*?)^```$", re.M | re.S)
TIME = re.compile(r"(?:in +)?\b(?:[0-9.,]+ (?:h|min) )?[0-9.,]+ (?:ms|us|ns|s|min)\b")
NUMBER = re.compile(r"[-+]?[0-9]+\.?[0-9]*(?:e[-+]?[0-9]+)?")


def pages():
    return [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]


def line_of(text, position):
    return text.count("\n", 0, position) + 1


def is_value(word):
    return NUMBER.fullmatch(word) is not None


def same(shown, printed, values=1e-3, errors=10.0):
    """None, or how what was printed differs from what the page shows."""
    left, right = [[TIME.sub("TIME", line).split() for line in text.strip().splitlines()] for text in (shown, printed)]
    left, right = [[words for words in lines if words] for lines in (left, right)]
    if len(left) != len(right):
        return f"{len(left)} lines are shown, {len(right)} printed"
    for one, other in zip(left, right):
        if len(one) != len(other):
            return f"{' '.join(one)} <> {' '.join(other)}"
        for a, b in zip(one, other):
            if is_value(a) and is_value(b):
                # A spread (2.9e-4) is only known in its size: another processor may take another step.
                factor = errors if "e-" in a else 1 + values
                x, y = float(a), float(b)
                if not (x == y or (x * y > 0 and max(x / y, y / x) <= factor)):
                    return f"{a} <> {b} in: {' '.join(one)}"
            elif a != b and a.rsplit("/", 1)[-1] != b.rsplit("/", 1)[-1]:
                return f"{a} <> {b} in: {' '.join(one)}"
    return None


def check_cases(binary):
    faults, count = [], 0
    for page in pages():
        text = page.read_text(encoding="utf-8")
        for block in BLOCK.finditer(text):
            kind, body = block.groups()
            if kind != "toml" or not re.search(r"^format *= *1$", body, re.M):
                continue
            count += 1
            # The files that a shipped case names lie beside it.
            said = subprocess.run([binary, "check", "--quiet", "-"], input=body, cwd=ROOT / "cases", capture_output=True, text=True)
            if said.returncode != 0:
                faults.append(f"{page.relative_to(ROOT)}:{line_of(text, block.start())}: {said.stderr.strip()}")
    print(f"{count} whole cases on {len(pages())} pages went through `elastocap check`")
    return faults


QUANTITY = re.compile(r"\b([0-9]+(?:\.[0-9]+)?) ?(fF|pF|aF|mN|N)\b")


def unsaid(text, outputs):
    """Quantities with two decimals or more in the words of a page that no command of the page holds or prints."""
    printed = {}
    for number, unit in QUANTITY.findall("\n".join(outputs)):
        printed.setdefault(unit, set()).add(float(number))
    words = BLOCK.sub("", text)
    # "42.82 instead of 44.24 fF" and "42.82 and 44.24 fF" name the unit once.
    words = re.sub(r"\b([0-9]+\.[0-9]+) (instead of|and|to) ([0-9]+\.[0-9]+) (fF|pF|aF|mN|N)\b", r"\1 \4 \2 \3 \4", words)
    for number, unit in QUANTITY.findall(words):
        places = len(number.partition(".")[2])
        if places < 2:
            continue
        known = printed.get(unit, set())
        values = known | {abs(a - b) for a in known for b in known}
        if not any(abs(value - float(number)) <= 0.51 * 10.0**-places for value in values):
            yield f"{number} {unit}"


def run_pages(binary, write):
    faults = []
    for page in RUN:
        text = page.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as folder:
            os.symlink(ROOT / "cases", Path(folder) / "cases")
            os.symlink(binary, Path(folder) / "elastocap")
            path = f"{folder}:{os.environ['PATH']}"
            blocks, printed, count = list(BLOCK.finditer(text)), None, 0
            outputs, changed = [], text
            for block in blocks:
                kind, body = block.groups()
                where = f"{page.relative_to(ROOT)}:{line_of(text, block.start())}"
                if kind == "sh":
                    outputs.append(body)
                    said = subprocess.run(["bash", "-euc", body], cwd=folder, env=os.environ | {"PATH": path}, capture_output=True, text=True)
                    count += 1
                    printed = said.stdout
                    if said.returncode != 0:
                        faults.append(f"{where}: exit status {said.returncode}: {said.stderr.strip()}")
                elif kind == "text" and printed is not None:
                    outputs.append(printed)
                    if write and same(body, printed, 0.0, 1.0):
                        changed = changed.replace(f"```text\n{body}```", f"```text\n{printed.strip()}\n```", 1)
                    elif difference := same(body, printed, 3e-5, 2.0):
                        faults.append(f"{where}: {difference}\n--- printed\n{printed}")
                    printed = None
            # What stands in the words is the author's: it is told, and not changed.
            faults += [f"{page.relative_to(ROOT)}: no command prints {quantity}" for quantity in unsaid(text, outputs)]
        if changed != text:
            page.write_text(changed, encoding="utf-8")
        print(f"{page.relative_to(ROOT)}: {count} blocks of commands were run")
    return faults


def marked(outputs, write):
    faults, count = [], 0
    for page in pages():
        text = page.read_text(encoding="utf-8")

        def one(match):
            nonlocal count
            kind, name, shown = match.groups()
            where = f"{page.relative_to(ROOT)}:{line_of(text, match.start())}"
            if kind == "case":
                true, language = (ROOT / name).read_text(encoding="utf-8"), "toml"
                if true != shown and not write:
                    faults.append(f"{where}: is not the text of {name}")
            else:
                if outputs is None:
                    return match.group(0)
                true, language = (outputs / (Path(name).stem + ".txt")).read_text(encoding="utf-8"), "text"
                difference = same(shown, true)
                if difference and not write:
                    faults.append(f"{where}: {name}: {difference}")
            count += 1
            return f"<!-- {kind} {name} -->\n\n```{language}\n{true.strip() if kind == 'output' else true.rstrip()}\n```"

        changed = MARK.sub(one, text)
        if write and changed != text:
            page.write_text(changed, encoding="utf-8")
    print(f"{count} shown cases and outputs are those of the files")
    return faults


def main():
    binary = str(Path(sys.argv[1]).resolve())
    arguments = sys.argv[2:]
    outputs = Path(arguments[arguments.index("--outputs") + 1]) if "--outputs" in arguments else None
    write = "--write" in arguments
    faults = marked(outputs, write)
    if not write:
        faults += check_cases(binary)
    if not (write and outputs):
        faults += run_pages(binary, write)
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
