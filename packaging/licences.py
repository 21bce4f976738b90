#!/usr/bin/env python3
"""The licence texts of all crates and other files that are in the program, from the sources that cargo has fetched and from our own.

    python3 packaging/licences.py TARGET > THIRD-PARTY-LICENCES.txt

Only what is linked into the program counts: build scripts, procedural macros and tests are not in it. A crate without a licence text of its
own (some leave it to their repository) gets the common text of its licence, Apache-2.0 or MIT, with the authors that its manifest names. Ends
with status 1 if a crate has neither a text nor one of these licences.
"""

import json
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NAMES = re.compile(r"^(licen[cs]e|copying|notice|copyright|unlicense)", re.I)
# What the program contains that is no crate, and the file in the repository that has its licence; of a C header the comment that has it.
FILES = [
    ("three.js (MIT), which the program writes into report.html", "crates/results/src/report/three/LICENSE"),
    ("headers of FMI 3.0 (BSD-2-Clause), which the program writes into an FMU", "crates/circuits/src/fmu/c/fmi3PlatformTypes.h"),
]
# https://opensource.org/license/mit, without its first lines, which name the holder.
MIT = """Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated documentation files (the "Software"), to deal in
the Software without restriction, including without limitation the rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of
the Software, and to permit persons to whom the Software is furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS
FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN
AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE."""


def in_program(metadata):
    """The crates that are linked, those of the workspace left out."""
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    packages = {package["id"]: package for package in metadata["packages"]}
    root = next(p["id"] for p in packages.values() if p["name"] == "elastocap" and p["id"] in metadata["workspace_members"])
    seen, waiting = set(), [root]
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        for dependency in nodes[name]["deps"]:
            kinds = {kind["kind"] for kind in dependency["dep_kinds"]}
            macro = any("proc-macro" in target["kind"] for target in packages[dependency["pkg"]]["targets"])
            if None in kinds and not macro:
                waiting.append(dependency["pkg"])
    members = set(metadata["workspace_members"])
    return sorted((packages[name] for name in seen - members), key=lambda p: (p["name"], p["version"]))


def texts_of(package):
    folder = Path(package["manifest_path"]).parent
    files = sorted(f for f in folder.iterdir() if f.is_file() and NAMES.match(f.name))
    return [f.read_text(encoding="utf-8", errors="replace").replace("\r\n", "\n").strip() for f in files]


def text_of(file):
    text = (ROOT / file).read_text(encoding="utf-8").strip()
    if file.endswith(".h"):
        text = next(comment for comment in re.findall(r"/\*(.*?)\*/", text, re.S) if "Copyright" in comment).strip()
    return text


def main():
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", sys.argv[1]]
    metadata = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    crates = in_program(metadata)
    texts = {p["id"]: texts_of(p) for p in crates}
    apache = next(t for all_texts in texts.values() for t in all_texts if "Apache License" in t and "TERMS AND CONDITIONS" in t)
    without = []
    users = defaultdict(list)
    for package in crates:
        label = f"{package['name']} {package['version']} ({package['license']})"
        if texts[package["id"]]:
            for text in texts[package["id"]]:
                users[text].append(label)
        elif "Apache-2.0" in (package["license"] or ""):
            users[apache].append(label + ", which has no text of its own")
        elif "MIT" in (package["license"] or ""):
            holders = ", ".join(package["authors"]) or f"the authors of {package['name']}"
            users[f"Copyright (c) {holders}\n\n{MIT}"].append(label + ", which has no text of its own")
        else:
            without.append(label)
    # It is no crate of the lock file. Of its two licences, Apache-2.0 is here already.
    users[apache].append("the standard library of Rust (MIT OR Apache-2.0)")
    for label, file in FILES:
        users[text_of(file)].append(label)
    print("elastocap contains the crates below, each under the licence that is named beside it. Their texts follow, each once,\n"
          "with the crates that it belongs to, and those of other files in the program. The authors of a crate without a text of its own are named here.\n")
    for package in crates:
        authors = ", ".join(package["authors"]) or "its contributors"
        where = package["repository"] or "crates.io"
        print(f"  {package['name']} {package['version']}: {package['license']}; {authors}; {where}")
    for text, labels in sorted(users.items(), key=lambda item: item[1][0]):
        print("\n" + "=" * 100)
        print("\n".join(labels))
        print("-" * 100)
        print(text)
    for label in without:
        print(f"{label} has no licence text", file=sys.stderr)
    print(f"{len(crates)} crates, {len(users)} texts", file=sys.stderr)
    return 1 if without else 0


if __name__ == "__main__":
    sys.exit(main())
