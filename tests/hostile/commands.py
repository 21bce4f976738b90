"""Commands on results, and names that mean something to the readers of written files."""

import csv
import html.parser
import json
import re
import tomllib
import xml.etree.ElementTree
import zipfile

from . import faults, jobs, toml

# Parts of names: what ends a text, a line, a tag or a comment of one of the formats, a directive, a path, or what changes the direction of
# a text. The marker that follows shows whether one came out of its text.
PARTS = ["\"", "'", "\\", "</script>", "<img src=x>", "-->", "]]>", "&amp;", "&", "%", "{{", "`", "*", "//", "/*", "*/", "`include \"x\"",
         "$(x)", ";", ",", "=1+1", "@x", "../x", "\u200b", "\u0301", "\U0001f600", "\u00e9", "#", "*)", "$$", "<!--", "|", ".end", "endmodule"]
# Those that a case may not have in a name.
REFUSED = ["\n", "\r\n", "\t", "\n.include x\n", "\n.control\nshell x\n.endc", "\nendmodule\n", "\u202e", "\u2066", "\u2028", "\x7f", "\ufeff", "\x85", "\x1b[31m"]
DANGEROUS = re.compile("[\u202a-\u202e\u2066-\u2069]")


def name(rng):
    parts = PARTS if rng.random() < 0.9 else PARTS + REFUSED
    return "a" + "".join(rng.choice(parts) + rng.choice(["", "b", " "]) for _ in range(rng.choice([1, 1, 2, 3]))) + "z"


def pair(rng, first, second):
    """A cheap case with a curve: two plates, of which one rides on a layer."""
    height = 400 + rng.randrange(100)
    point = lambda x, y, z: [f"{x} um", f"{y} um", f"{z} um"]
    return {
        "format": 1, "title": name(rng),
        "layer": {"thickness": f"{height} um", "relative_permittivity": 2.8, "material": {"neo_hookean": {"shear_modulus": "90 kPa"}}},
        "conductor": [{"name": first, "box": {"min": point(-500, -10, -500), "max": point(500, 0, 500)}},
                      {"name": second, "box": {"min": point(-500, height, -500), "max": point(500, height + 20, 500)}, "attached": "layer-top"}],
        "mechanics": {"closed_form": {"contact_half_length": "1 mm", "contact_width": "2 mm", "shear_length": "1 mm"}},
        "load": {"compression": [0.0, 0.1, 0.2]},
        "surroundings": {"boundary": "open"},
        "electrostatics": {"relative_tolerance": 0.1},
        "measure": {"capacitance": [first, second]},
    }


def try_one(trial):
    rng = trial.rng
    first, second = name(rng), name(rng) + "2"
    case = pair(rng, first, second)
    jobs.write_case(trial.folder, case, {})
    # The same case without its names is what the commands other than `run` are tried on where the names are refused.
    if trial.check().status != 0:
        plain = {**case, "title": "A title", "measure": {"capacitance": ["a", "b"]}}
        for body, word in zip(plain["conductor"], "ab"):
            body["name"] = word
        jobs.write_case(trial.folder, plain, {})
        first, second = "a", "b"
    done, result = trial.run(options=(), seconds=20)
    if done.status != 0 or not result:
        return
    trial.command(["run", "case.toml", "-o", "second", "--only", "curve", "--threads", "1", "--max-time", "20s"])
    capacitances = [step["capacitance_f"] for step in result["steps"]]
    measured = f"{(capacitances[0] + capacitances[1]) / 2:.6g} F"
    lines = [["compare", "out", "second", "--html", "compare.html"], ["force", "out", "--capacitance", measured], ["mesh", "case.toml", "-o", "mesh"],
             ["export", "spice", "out", "-o", "x.lib"], ["export", "verilog-a", "out", "-o", "x.va"],
             ["export", "table", "out", "-o", "x.csv"], ["export", "table", "out", "-o", "x.json"], ["export", "fmu", "out", "-o", "x.fmu", "--no-binary"],
             ["export", "spice", "out", "-o", "y.lib", "--matrix", "--name", name(rng)],
             ["sweep", "case.toml", "--set", "layer.relative_permittivity=2,3", "-o", "swept", "--max-time", "20s"],
             ["optimise", "case.toml", "--vary", "layer.relative_permittivity=2..4", "--maximise", "C0", "--max-evaluations", "3", "-o", "best.toml"]]
    for line in lines:
        said = trial.command(line)
        found = faults.of_answer(said)
        if said.status == 1:
            found.append(f"failed: {faults.first(said.err)}")
        if said.status == 2 and "--name" not in line:
            found.append(f"refused: {faults.first(said.err)}")
        trial.report.note(" ".join(line[:2]), found)
    points = "x,c\n" + "".join(f"{step['compression']},{step['capacitance_f'] * 1e15:.6g}\n" for step in result["steps"])
    (trial.folder / "points.csv").write_text(points)
    fitted = {**case, "measurement": {"file": "points.csv", "columns": {"compression": {"name": "x"}, "capacitance": {"name": "c", "unit": "fF"}}}}
    (trial.folder / "fit.toml").write_text(toml.document(fitted))
    said = trial.command(["fit", "fit.toml", "--free", "layer.relative_permittivity=1..9", "-o", "fitted.toml"])
    trial.report.note("fit", faults.of_answer(said))
    trial.report.note("files", unreadable(trial.folder, case, {first, second}))


class Tags(html.parser.HTMLParser):
    """The elements of a page that a name could have made, and whether its scripts are as many as they end."""

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.images = 0
        self.depth = []

    def handle_starttag(self, tag, attributes):
        self.images += tag == "img" and ("src", "x") in attributes


def unreadable(folder, case, names):
    """What is wrong with the written files."""
    found = []
    title = case["title"]
    for path in sorted(folder.rglob("*")):
        if not path.is_file() or path.name in ("case.toml", "fit.toml"):
            continue
        try:
            found += [f"names: {path.name}: {fault}" for fault in of_file(path, path.read_bytes(), title, names)]
        except (ValueError, KeyError, xml.etree.ElementTree.ParseError, zipfile.BadZipFile) as error:
            found.append(f"names: {path.name} cannot be read: {error}")
    return found


def of_file(path, data, title, names):
    kind = path.suffix
    if kind == ".json":
        document = json.loads(data)
        if path.name == "result.json" and path.parent.name == "out" and set(document["conductors"]) != names:
            yield f"its conductors are {document['conductors']}, not {sorted(names)}"
    elif kind == ".jsonl":
        for line in data.decode().splitlines():
            json.loads(line)
    elif kind == ".csv":
        lines = [line for line in data.decode().split("\n") if not line.startswith("#")]
        rows = list(csv.reader("\n".join(lines).splitlines(keepends=True), strict=True))
        if len({len(row) for row in rows if row}) > 1:
            yield "its rows are not equally long"
        if any(cell[:1] in "=@" for row in rows for cell in row if cell):
            yield "a cell is a formula"
    elif kind in (".svg", ".vtu", ".pvd", ".xml"):
        text = data
        if kind == ".vtu" and b"<AppendedData" in data:
            text = data[: data.index(b"<AppendedData")] + b"</VTKFile>"
        xml.etree.ElementTree.fromstring(text)
    elif kind == ".html":
        tags = Tags()
        text = data.decode()
        tags.feed(text)
        if tags.images:
            yield "a name is an element"
        if len(re.findall(r"(?i)<script[\s>]", text)) != len(re.findall(r"(?i)</script\s*>", text)):
            yield "a script ends in a name"
    elif kind == ".fmu":
        with zipfile.ZipFile(path) as archive:
            for member in archive.namelist():
                if member.startswith("/") or ".." in member.split("/"):
                    yield f"a member is named {member!r}"
                if member.endswith((".xml", ".json")):
                    list(of_file(path.with_suffix("." + member.rsplit(".", 1)[1]), archive.read(member), title, set()))
    elif kind == ".lib":
        text = data.decode()
        for line in text.splitlines():
            word = line.split()[0].lower() if line.split() else "*"
            if word.startswith(".") and word not in (".subckt", ".ends", ".param", ".func", ".model"):
                yield f"a directive: {line[:80]!r}"
    elif kind == ".va":
        text = data.decode()
        directives = set(re.findall(r"(?m)^\s*`(\w+)", text)) - {"include", "define", "ifdef", "ifndef", "else", "endif", "undef"}
        if directives or len(re.findall(r"(?m)^endmodule", text)) != 1 or re.search(r'(?m)^\s*`include "x"', text):
            yield "a name is a directive"
    elif kind == ".toml":
        tomllib.loads(data.decode())
        return
    if kind in (".svg", ".html", ".lib", ".va", ".csv") and DANGEROUS.search(data.decode("utf-8", "replace")):
        yield "a character that changes the direction of the text"
