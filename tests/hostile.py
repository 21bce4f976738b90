#!/usr/bin/env python3
"""Hostile case files, OBJ and Gmsh files for `elastocap check` and `elastocap run`.

    tests/hostile.py --binary target/release/elastocap --cases 10000 --meshes 2000

Files are made from a seed: those of cases/ and tests/acceptance with damage (extreme numbers, other units, wrong types, control
characters, cut off), and classes made by hand (many bodies, deep nesting, wild geometry). Every one is checked, and a share of them
is run too, in little memory and for a short time. Found fault with, and printed with the seed of the file:

    abort or signal   the process was ended by a signal
    hang              no answer of `check` within the limit
    panic             the word in what it says
    status            an exit status that `elastocap --help` does not list
    content           a word of a file that is not a case file in a message
    messages          more than ten errors and warnings
    leftovers         files of a run that failed (exit status 1 or 2)

`run` is ended after its time: long runs are no fault. The exit status is 1 if any fault was found.
"""

import argparse
import collections
import concurrent.futures
import os
import pathlib
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# A word that no message may show: it stands in files that are not case files.
SECRET = "hunter2-correct-horse"
MESSAGES = 10

NUMBERS = ["0", "-0", "1", "-1", "1e-300", "1e-320", "-1e-30", "1e-21", "1e-15", "1e-9", "1e-6", "0.1", "0.999999999999", "1e3", "1e6",
           "1e9", "1e12", "1e15", "1e30", "1e300", "1.7976931348623157e308", "1e309", "nan", "inf", "-inf", "9223372036854775807",
           "9223372036854775808", "-9223372036854775808", "0x7f", "1_000", "1e", ".", "1e+", "--1", "0.3e-3", "2.5", "100000",
           "1000000000", "4294967296", "65536"]
UNITS = ["m", "mm", "um", "nm", "pm", "km", "Pa", "kPa", "GPa", "N", "mN", "kN", "C", "pC", "", "m2", "mm ", "\u00b5m", "\u03bcm", "inch",
         "M", "MM", "%", "um um", "F", "V"]
CHARACTERS = ["\x00", "\x01", "\x1b[31m", "\x7f", "\u202e", "\u2066", "\u200b", "\ufeff", "\u0000", "\U0001f600", "\u0301", "\r", "\t", "\\u202E",
              "=cmd()", "\"", "'", "\n", "\u2028", "a" * 300]
WRONG = ["true", "false", "[]", "{}", "\"\"", "1979-05-27", "[[]]", "{ a = 1 }", "\"text\"", "-1", "0.5", "[1, 2, 3]", "[\"1 mm\"]", "nan", "inf"]


def texts(pattern, folder):
    return [(path, path.read_text()) for path in sorted((ROOT / folder).glob(pattern))]


class Maker:
    """Makes the files of one number."""

    def __init__(self, cases, meshes):
        self.cases = cases
        self.meshes = meshes
        self.by_hand = [getattr(self, name) for name in sorted(dir(self)) if name.startswith("class_")]

    # --- damage -----------------------------------------------------------------------------------------------------------------

    def number(self, rng):
        if rng.random() < 0.7:
            return rng.choice(NUMBERS)
        return f"{rng.choice([1, -1]) * rng.uniform(1, 10):.6g}e{rng.randint(-40, 40)}"

    def damage(self, rng, text):
        kind = rng.choice(["quantity"] * 6 + ["bare"] * 4 + ["unit", "delete", "double", "cut", "character", "key", "value", "swap", "bytes",
                          "name", "list", "file"])
        lines = text.split("\n")
        k = rng.randrange(len(lines))
        quantities = [m for m in re.finditer(r'"(-?[0-9.][0-9.eE+-]*) ?([A-Za-z]+[0-9]?)"', text)]
        bare = [m for m in re.finditer(r'(?<=[=\[, ])-?[0-9][0-9.eE+-]*(?=[,\]\s}])', text)]
        if kind == "quantity" and quantities:
            m = rng.choice(quantities)
            scaled = f"{rng.choice([0.5, 0.9, 1.1, 2, 10, 0.1, -1])} " if rng.random() < 0.2 else self.number(rng) + " "
            return text[: m.start(1)] + scaled + text[m.end(1):].lstrip(" ")
        if kind == "bare" and bare:
            m = rng.choice(bare)
            return text[: m.start()] + self.number(rng) + text[m.end():]
        if kind == "unit" and quantities:
            m = rng.choice(quantities)
            return text[: m.start(2)] + rng.choice(UNITS) + text[m.end(2):]
        if kind == "delete":
            return "\n".join(lines[:k] + lines[k + 1:])
        if kind == "double":
            end = min(len(lines), k + rng.randint(1, 6))
            return "\n".join(lines[:end] + lines[k:end] * rng.choice([1, 1, 3, 50]) + lines[end:])
        if kind == "cut":
            return text[: rng.randrange(len(text) + 1)]
        if kind == "character":
            at = rng.randrange(len(text) + 1)
            return text[:at] + rng.choice(CHARACTERS) + text[at:]
        if kind == "key":
            keys = list(re.finditer(r"(?m)^\s*([A-Za-z_.]+)\s*=", text))
            if keys:
                m, n = rng.choice(keys), rng.choice(keys)
                return text[: m.start(1)] + n.group(1) + text[m.end(1):]
        if kind == "value":
            values = list(re.finditer(r"(?m)=\s*([^#\n]+)", text))
            if values:
                m = rng.choice(values)
                return text[: m.start(1)] + rng.choice(WRONG) + "\n" + text[m.end(1):]
        if kind == "swap":
            j = rng.randrange(len(lines))
            lines[k], lines[j] = lines[j], lines[k]
            return "\n".join(lines)
        if kind == "bytes":
            data = list(text)
            for _ in range(rng.randint(1, 5)):
                data[rng.randrange(len(data))] = chr(rng.randrange(256))
            return "".join(data)
        if kind == "name":
            names = list(re.finditer(r'(?:name|title)\s*=\s*"([^"]*)"', text))
            if names:
                m = rng.choice(names)
                return text[: m.start(1)] + rng.choice(CHARACTERS).replace('"', '\\"') + text[m.end(1):]
        if kind == "list":
            lists = list(re.finditer(r"\[([^\[\]]+)\]", text))
            if lists:
                m = rng.choice(lists)
                return text[: m.start(1)] + ", ".join([m.group(1)] * rng.choice([2, 3, 10, 200])) + text[m.end(1):]
        if kind == "file":
            files = list(re.finditer(r'file\s*=\s*"([^"]*)"', text))
            if files:
                m = rng.choice(files)
                other = rng.choice(["/dev/zero", "/dev/stdin", "/etc/passwd", ".", "", "nowhere", "a\x00b", "/proc/self/mem", "/proc/self/environ"])
                return text[: m.start(1)] + other + text[m.end(1):]
        return text

    # --- by hand ----------------------------------------------------------------------------------------------------------------

    def length(self, rng):
        return f'"{rng.choice(["0", "1", "2", "-1", "3", "0.5", "1e-9", "1e9", "1e-15", "7", "1e-3"])} {rng.choice(["mm", "um", "m"])}"'

    def scene(self, rng, bodies, wall=None):
        wall = wall or rng.choice(["open", "grounded", "insulated"])
        tolerance = rng.choice(["0.1", "0.3", "0.05", "1e-3", "1e-14"])
        text = f'format = 1\n{bodies}[surroundings]\nboundary = "{wall}"\n'
        if wall != "open":
            text += 'walls = { min = ["-20 mm", "-20 mm", "-20 mm"], max = ["20 mm", "20 mm", "20 mm"] }\n'
        return text + f"[electrostatics]\nrelative_tolerance = {tolerance}\n"

    def corner(self, rng, scale):
        return [rng.choice([0, 1, 2, 3, rng.uniform(0, 4)]) * scale for _ in range(3)]

    def class_wild_geometry(self, rng):
        """Bodies of all shapes that touch, cross, nest, or differ much in size."""
        bodies = ""
        for k in range(rng.choice([1, 2, 3, 5, 10])):
            scale = rng.choice([1.0, 1.0, 1.0, 1e-3, 1e-6, 1e-12, 1e3])
            a, b = self.corner(rng, scale), self.corner(rng, scale)
            low = [min(x, y) for x, y in zip(a, b)]
            high = [max(x, y) for x, y in zip(a, b)]
            at = lambda p: "[" + ", ".join(f'"{x:.17g} mm"' for x in p) + "]"
            size = rng.choice([1, 0.5, 1e-6, 2, 1e-12]) * scale
            axis = rng.choice(["x1", "x2", "x3"])
            outline = [[rng.uniform(-2, 2), rng.uniform(-2, 2)] for _ in range(rng.choice([3, 4, 5, 12]))]
            if rng.random() < 0.5:
                n = rng.choice([3, 4, 7, 40])
                spin = rng.random()
                import math
                outline = [[(1 + rng.choice([0, 0, 1e-9, 0.3])) * math.cos(6.283185307 * (i + spin) / n),
                            math.sin(6.283185307 * (i + spin) / n)] for i in range(n)]
            corners = "[" + ", ".join(f'["{x * scale:.17g} mm", "{y * scale:.17g} mm"]' for x, y in outline) + "]"
            shape = rng.choice([
                f"box = {{ min = {at(low)}, max = {at(high)} }}",
                f"sphere = {{ center = {at(a)}, radius = \"{size:.17g} mm\" }}",
                f"cylinder = {{ axis = \"{axis}\", base = {at(a)}, radius = \"{size:.17g} mm\", height = \"{rng.choice([1, 1e-6, 3]) * scale:.17g} mm\" }}",
                f"extrusion = {{ axis = \"{axis}\", from = \"{a[0]:.17g} mm\", to = \"{a[0] + size:.17g} mm\", outline = {corners} }}",
                f"shell = {{ center = {at(a)}, radius = \"{10 * size:.17g} mm\" }}",
            ])
            if rng.random() < 0.3 and not shape.startswith("shell"):
                bodies += f'[[dielectric]]\nname = "b{k}"\nrelative_permittivity = {rng.choice(["2", "1", "1e6", "1e-6", "80"])}\n{shape}\n'
            else:
                floating = rng.choice(["", "", "", 'floating_charge = "0 C"\n'])
                bodies += f'[[conductor]]\nname = "b{k}"\n{floating}{shape}\n'
        return self.scene(rng, bodies)

    def class_many_bodies(self, rng):
        n = rng.choice([10, 50, 200, 1000, 1001, 6000])
        bodies = []
        for k in range(n):
            p = [2 * (k % 10), 2 * (k // 10 % 10), 2 * (k // 100)]
            if rng.random() < 0.3:
                p = [x + rng.uniform(0, 0.5) for x in p]
            at = lambda d: "[" + ", ".join(f'"{x + d:.9g} mm"' for x in p) + "]"
            shape = f"box = {{ min = {at(0)}, max = {at(1)} }}" if n > 10 or rng.random() < 0.5 else f'sphere = {{ center = {at(0)}, radius = "0.5 mm" }}'
            bodies.append(f'[[conductor]]\nname = "c{k}"\n{shape}\n')
        return self.scene(rng, "".join(bodies), "open")

    def class_many_slabs(self, rng):
        n = rng.choice([10, 100, 1000, 5000, 5001])
        slabs = "".join(f'[[dielectric]]\nname = "d{k}"\nrelative_permittivity = {1 + k % 5}\nslab = {{ axis = "x2", from = "{k} um", to = "{k + 1} um" }}\n' for k in range(n))
        shape = rng.choice(['box = { min = ["0 mm", "-2 mm", "0 mm"], max = ["1 mm", "-1 mm", "1 mm"] }', 'sphere = { center = ["0 mm", "-3 mm", "0 mm"], radius = "1 mm" }'])
        return self.scene(rng, f'[[conductor]]\nname = "a"\n{shape}\n{slabs}', "open")

    def class_long_outline(self, rng):
        import math
        n = rng.choice([3, 100, 1000, 10000, 20000, 20001])
        kind = rng.choice(["disc", "comb", "line", "noise", "star"])
        point = {
            "disc": lambda i: (math.cos(6.283185307179586 * i / n), math.sin(6.283185307179586 * i / n)),
            "comb": lambda i: (i / n, i % 2),
            "line": lambda i: (i / n, 0),
            "noise": lambda i: (rng.random(), rng.random()),
            "star": lambda i: ((1 + i % 2) * math.cos(6.283185307179586 * i / n), (1 + i % 2) * math.sin(6.283185307179586 * i / n)),
        }[kind]
        outline = ", ".join('["%.12g mm", "%.12g mm"]' % point(i) for i in range(n))
        return self.scene(rng, f'[[conductor]]\nname = "o"\nextrusion = {{ axis = "x2", from = "0 mm", to = "{rng.choice(["1", "1e-6", "0"])} mm", outline = [{outline}] }}\n')

    def class_round_outline(self, rng):
        """Pads with arcs and rounded corners, some impossible, some that touch, cross or hold one another."""
        bodies = ""
        for k in range(rng.choice([1, 1, 2, 3])):
            w, h, r = rng.choice([1, 2, 1e-3]), rng.choice([1, 0.5]), rng.choice([0.1, 0.25, 0.5, 1e-6, 0.6, 0])
            x, y = rng.choice([0, 0, 1, 0.5, rng.random()]), rng.choice([0, 0, rng.random()])
            at = lambda p, q: f'["{x + p:.12g} mm", "{y + q:.12g} mm"]'
            near = rng.choice([0, 0, 1e-9, 1e-5, rng.uniform(-1, 1)])
            kinds = [
                [f'{{ corner = {at(p, q)}, radius = "{r} mm" }}' for p, q in [(0, 0), (w, 0), (w, h), (0, h)]],
                [at(0, 0), at(w, 0), f'{{ through = {at(w + h / 2 + near, h / 2)}, to = {at(w, h)} }}', at(0, h)],
                [f'{{ through = {at(1, near)}, to = {at(0, 1)} }}', f'{{ through = {at(-1, near)}, to = {at(0, -1)} }}'],
                [f'{{ through = {at(rng.uniform(-1, 1), rng.uniform(-1, 1))}, to = {at(rng.uniform(-1, 1), rng.uniform(-1, 1))} }}'
                 for _ in range(rng.choice([1, 2, 3, 6]))],
                [at(0, 0), f'{{ corner = {at(w, near)}, radius = "{r} mm" }}', at(2 * w, 0), at(w, h)],
            ]
            thickness = rng.choice([0, 0.1, 1e-6])
            level = rng.choice([0, 0, 0.2])
            bodies += f'[[conductor]]\nname = "o{k}"\nextrusion = {{ axis = "x2", from = "{level} mm", to = "{level + thickness} mm", outline = [{", ".join(rng.choice(kinds))}] }}\n'
        return self.scene(rng, bodies)

    def class_many_steps(self, rng):
        path, text = rng.choice([c for c in self.cases if "compression = [" in c[1]])
        n = rng.choice([10, 1000, 100000, 1000000])
        steps = ", ".join(str(round(rng.random() * 0.5, rng.choice([1, 6]))) for _ in range(min(n, 100000)))
        wide = f"{{ from = {rng.choice(['0', '0.1', '-1'])}, to = {rng.choice(['0.4', '1', '0.05', '1e300'])}, points = {n} }}"
        return re.sub(r"compression\s*=\s*\[[^\]]*\]", "compression = " + rng.choice([f"[{steps}]", wide]), text, count=1)

    def class_deep_nesting(self, rng):
        n = rng.choice([10, 100, 10000, 200000])
        return rng.choice([
            "format = 1\na = " + "[" * n + "]" * n,
            "format = 1\na = " + "{ a = " * n + "1" + " }" * n,
            "format = 1\n" + "a." * n + "a = 1",
            "format = 1\n[" + ".".join(["a"] * n) + "]",
            "format = 1\n" + "[[conductor]]\n" * min(n, 10000),
            "format = 1\ntitle = \"" + "x" * n * 10 + "\"",
        ])

    def class_no_case(self, rng):
        return rng.choice([
            f"root:{SECRET}:0:0\n", SECRET, f"{{\"key\": \"{SECRET}\"}}", f"-----BEGIN PRIVATE KEY-----\n{SECRET}\n", f"\x00\x01{SECRET}",
            f"export PASSWORD={SECRET}\n", f"<html>{SECRET}</html>", f"[{SECRET}\n", f"'{SECRET}", "", "\n" * 100, "\ufeff", "\xff\xfe",
        ])

    def class_names(self, rng):
        name = "".join(rng.choice(CHARACTERS + ["a", "b"]) for _ in range(rng.randint(1, 3)))
        name = name.replace("\\", "\\\\").replace('"', '\\"')
        name = "".join(f"\\u{ord(c):04X}" if ord(c) < 32 or ord(c) == 127 else c for c in name)
        return self.scene(rng, f'[[conductor]]\nname = "{name}"\nbox = {{ min = ["0 mm", "0 mm", "0 mm"], max = ["1 mm", "1 mm", "1 mm"] }}\n', "open")

    def class_layer(self, rng):
        """A layer by finite elements of any proportions."""
        length = lambda low, high: f'"{10 ** rng.uniform(low, high):.3g} mm"'
        indenter = rng.choice([
            'indenter = "whole-top"', f"indenter.cylinder = {{ radius = {length(-6, 6)} }}",
            f"indenter.flat_punch = {{ half_width = {length(-4, 4)}, corner_radius = {length(-9, 2)}, contact = \"smooth\" }}",
            f"indenter.flat_punch = {{ half_width = {length(-4, 4)}, contact = \"{rng.choice(['smooth', 'bonded'])}\" }}",
        ])
        kind = rng.choice(["plane_strain", "solid"])
        if kind == "solid":
            indenter = rng.choice([indenter, f"indenter.sphere = {{ radius = {length(-6, 6)} }}"])
        end = rng.choice(["free", "far", "free-on-substrate"])
        load = rng.choice(["compression = [0.1]", f'force = ["{10 ** rng.uniform(-9, 9):.3g} N"]', "compression = [0.9, 0.99]", "compression = [1e-12]"])
        return (f'format = 1\n[layer]\nthickness = {length(-6, 3)}\nhalf_length = {length(-3, 9)}\n[layer.material.neo_hookean]\nshear_modulus = "1 kPa"\n'
                f'[mechanics.{kind}]\n{indenter}\nend = "{end}"\nwidth = {length(-3, 6)}\nrelative_tolerance = {rng.choice(["0.1", "1e-2", "1e-12"])}\n[load]\n{load}\n')

    # --- files of meshes --------------------------------------------------------------------------------------------------------

    def mesh(self, rng):
        path, data = rng.choice(self.meshes)
        data = bytearray(data)
        secret = rng.random() < 0.3
        if secret:
            lines = bytes(data).split(b"\n")
            lines.insert(rng.randrange(len(lines) + 1), rng.choice([b"", b"v ", b"f ", b"1 "]) + SECRET.encode())
            data = bytearray(b"\n".join(lines))
        for _ in range(rng.choice([0, 1, 1, 1, 2, 5])):
            kind = rng.choice(["byte", "number", "cut", "line", "double", "swap", "huge", "negative"])
            at = rng.randrange(len(data) + 1)
            numbers = list(re.finditer(rb"-?[0-9][0-9.eE+-]*", bytes(data[: 200_000])))
            lines = bytes(data).split(b"\n")
            if kind == "byte" and data:
                data[min(at, len(data) - 1)] = rng.randrange(256)
            elif kind == "number" and numbers:
                m = rng.choice(numbers)
                data[m.start(): m.end()] = rng.choice(NUMBERS).encode()
            elif kind == "cut":
                del data[at:]
            elif kind == "line":
                del lines[rng.randrange(len(lines))]
                data = bytearray(b"\n".join(lines))
            elif kind == "double":
                k = rng.randrange(len(lines))
                data = bytearray(b"\n".join(lines[:k] + lines[k: k + 3] * rng.choice([2, 100]) + lines[k:]))
            elif kind == "swap" and numbers:
                m, n = rng.choice(numbers), rng.choice(numbers)
                data[m.start(): m.end()] = n.group()
            elif kind == "huge" and numbers:
                m = rng.choice(numbers)
                data[m.start(): m.end()] = rng.choice([b"1e300", b"4294967297", b"18446744073709551615", b"99999999999999999999", b"1e-300"])
            elif kind == "negative" and numbers:
                m = rng.choice(numbers)
                data[m.start(): m.end()] = b"-" + m.group()
        unit = rng.choice(["mm", "m", "1e-300 m", "1e300 m"]) if rng.random() < 0.1 else "mm"
        if path.suffix == ".obj":
            body = f'[[conductor]]\nname = "a"\nsurface = {{ file = "hostile.obj", unit = "{unit}" }}\n'
            return self.scene(rng, body, "open"), "hostile.obj", bytes(data)
        names = re.findall(rb'"([^"\n]{1,40})"', bytes(data))
        text = [n.decode("latin-1").replace("\\", "\\\\") for n in names] or ["a"]
        bodies = "".join(f'[[conductor]]\nname = "c{k}"\nphysical = "{name}"\n' for k, name in enumerate(text[: rng.randint(1, 3)]))
        return f'format = 1\n[mesh]\nfile = "hostile.msh"\nunit = "{unit}"\n[surroundings]\nboundary = "{rng.choice(["open", "grounded"])}"\n[electrostatics]\nrelative_tolerance = 0.3\n{bodies}', "hostile.msh", bytes(data)

    def make(self, seed, number, is_mesh):
        rng = random.Random(f"{seed}-{number}-{is_mesh}")
        if is_mesh:
            return self.mesh(rng)
        if rng.random() < 0.08:
            return rng.choice(self.by_hand)(rng), None, None
        text = rng.choice(self.cases)[1]
        for _ in range(rng.choice([1, 1, 1, 2, 2, 3, 6])):
            text = self.damage(rng, text) or "\n"
        return text, None, None


def limits(memory, seconds):
    def apply():
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        # The processor time of a process that nothing else ends.
        resource.setrlimit(resource.RLIMIT_CPU, (4 * seconds + 60, 4 * seconds + 60))
    return apply


def judge(command, folder, arguments, text, is_case):
    """The faults of one command, and its exit status: `None` if it was ended."""
    run = command == "run"
    seconds = arguments.run_seconds if run else arguments.check_seconds
    line = [arguments.binary, command, "case.toml"] + (["-o", "out"] if run else [])
    begin = time.monotonic()
    try:
        done = subprocess.run(line, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=seconds,
                              preexec_fn=limits(arguments.memory, seconds), env={**os.environ, "RUST_BACKTRACE": "0"})
    except subprocess.TimeoutExpired:
        return ([] if run else [f"hang: no answer within {seconds} s"]), None, float(seconds)
    took = time.monotonic() - begin
    said = (done.stdout + b"\n" + done.stderr).decode("utf-8", "replace")
    faults = []
    if done.returncode < 0 or done.returncode >= 128:
        faults.append(f"abort or signal: status {done.returncode}: {done.stderr[-300:]!r}")
    elif done.returncode not in (0, 1, 2, 3):
        faults.append(f"status {done.returncode}")
    if "panicked" in said or "a defect of elastocap" in said:
        faults.append("panic: " + next(line for line in said.split("\n") if "panicked" in line or "a defect" in line)[:300])
    if SECRET in said and not is_case:
        faults.append("content: a file's text is in a message")
    messages = len(re.findall(r"(?m)^(?:error|warning)\b", said))
    if messages > MESSAGES:
        faults.append(f"messages: {messages}")
    if run and done.returncode in (1, 2) and any((folder / "out").glob("**/*")):
        faults.append("leftovers: " + ", ".join(p.name for p in (folder / "out").glob("**/*")))
    return faults, done.returncode, took


def one(job):
    maker, arguments, number, is_mesh = job
    text, name, data = maker.make(arguments.seed, number, is_mesh)
    folder = pathlib.Path(tempfile.mkdtemp(prefix="hostile-"))
    try:
        (folder / "case.toml").write_bytes(text.encode("utf-8", "surrogatepass"))
        for path in maker.beside:
            shutil.copy(path, folder)
        if name:
            (folder / name).write_bytes(data)
        is_case = re.search(r"(?m)^\s*format\s*=", text) is not None and name is None
        results = {"check": judge("check", folder, arguments, text, is_case)}
        if random.Random(f"run-{number}-{is_mesh}").random() < arguments.run_share:
            results["run"] = judge("run", folder, arguments, text, is_case)
        if arguments.keep and any(faults for faults, _, _ in results.values()):
            shutil.copytree(folder, pathlib.Path(arguments.keep) / f"{'mesh' if is_mesh else 'case'}-{number}", dirs_exist_ok=True)
        return number, is_mesh, results
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default=str(ROOT / "target/release/elastocap"))
    parser.add_argument("--cases", type=int, default=160, help="number of case files")
    parser.add_argument("--meshes", type=int, default=40, help="number of OBJ and Gmsh files")
    parser.add_argument("--first", type=int, default=0, help="number of the first file")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--run-share", type=float, default=0.05, help="share of the files that are run too")
    parser.add_argument("--check-seconds", type=int, default=10, help="limit for `check`")
    parser.add_argument("--run-seconds", type=int, default=10, help="`run` is ended after so long")
    parser.add_argument("--memory", type=int, default=4_000_000_000, help="address space of a process, bytes")
    parser.add_argument("--keep", help="folder for the files with faults")
    arguments = parser.parse_args()
    arguments.binary = str(pathlib.Path(arguments.binary).resolve())

    cases = texts("*.toml", "cases") + texts("*.toml", "tests/acceptance") + texts("*.toml", "tests/acceptance/found")
    data = [ROOT / "tests/acceptance/cube.obj", ROOT / "cases/dome-from-gmsh.msh"]
    data += sorted((ROOT / "crates/geometry/tests/data").glob("*.msh"))
    maker = Maker(cases, [(path, path.read_bytes()) for path in data])
    maker.beside = data[:2]

    jobs = [(maker, arguments, k, False) for k in range(arguments.first, arguments.first + arguments.cases)]
    jobs += [(maker, arguments, k, True) for k in range(arguments.first, arguments.first + arguments.meshes)]
    statuses = collections.Counter()
    slowest, faulty, began = 0.0, 0, time.monotonic()
    with concurrent.futures.ProcessPoolExecutor(arguments.jobs) as pool:
        for number, is_mesh, results in pool.map(one, jobs, chunksize=4):
            for command, (faults, status, took) in results.items():
                statuses[command, status] += 1
                slowest = max(slowest, took if command == "check" else 0.0)
                for fault in faults:
                    print(f"{'mesh' if is_mesh else 'case'} {number} (seed {arguments.seed}), {command}: {fault}", flush=True)
            faulty += any(faults for faults, _, _ in results.values())
    for command in ("check", "run"):
        counts = [f"{'ended' if status is None else f'exit status {status}'}: {n}" for (c, status), n in sorted(statuses.items(), key=str) if c == command]
        print(f"{command}: {', '.join(counts)}")
    print(f"slowest check {slowest:.1f} s; {time.monotonic() - began:.0f} s in all")
    print(f"{len(jobs) - faulty} passed, {faulty} failed")
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
