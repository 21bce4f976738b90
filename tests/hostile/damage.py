"""Files with damage: those of cases/ and tests/acceptance with extreme numbers, other units, wrong types, control characters and cuts,
and classes made by hand (many bodies, deep nesting, wild geometry)."""

import math
import pathlib
import random
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
# A word that no message may show: it stands in files that are not case files.
SECRET = "hunter2-correct-horse"
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

    def __init__(self):
        self.cases = texts("*.toml", "cases") + texts("*.toml", "tests/acceptance") + texts("*.toml", "tests/acceptance/found")
        data = [ROOT / "tests/acceptance/cube.obj", ROOT / "cases/dome-from-gmsh.msh"]
        self.beside = data[:2]
        data += sorted((ROOT / "crates/geometry/tests/data").glob("*.msh"))
        self.meshes = [(path, path.read_bytes()) for path in data]
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
