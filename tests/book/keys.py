#!/usr/bin/env python3
"""The reference of all keys of a case file, from the JSON Schema that the program prints.

    python3 tests/book/keys.py target/release/elastocap            says whether docs/keys.md is up to date
    python3 tests/book/keys.py target/release/elastocap --write    makes it anew
"""

import json
import subprocess
import sys
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "keys.md"

HEAD = """# Reference of all keys

Each table below is one table of a case file, with all its keys. The texts are those of the JSON Schema that `elastocap schema` prints,
and of which this page is made (`python3 tests/book/keys.py target/release/elastocap --write`). [Case files](case-files.md) says how the
tables go together.

- Every quantity with a dimension is a string with a unit; what stands under *value* is an example of it. Numbers without a dimension are bare.
- A key in **bold** must be given where its table is.
- `[a.b]` may also be written as `b = { .. }` in `[a]`, and `[[a]]` as `a = [{ .. }, ..]`.
"""


def code(value):
    return f"`{json.dumps(value, ensure_ascii=False)}`"


def form(schema):
    """What may stand for a value, in words; tables and lists of tables are described by themselves."""
    if "enum" in schema:
        return " or ".join(code(value) for value in schema["enum"])
    if "const" in schema:
        return code(schema["const"])
    if "anyOf" in schema:
        return ", or ".join(form(entry) for entry in schema["anyOf"])
    kind = schema.get("type")
    if kind == "object":
        return "a table" if schema.get("properties") else "a table of names"
    if kind == "array":
        items = schema.get("items", {})
        if items.get("type") == "object":
            return "a list of tables"
        count = schema.get("minItems")
        few = f"{count} of " if count and count == schema.get("maxItems") else "a list of "
        return few + form(items)
    if schema.get("examples"):
        return code(schema["examples"][0])
    return {"number": "a number", "integer": "a whole number", "boolean": "`true` or `false`", "string": "text"}.get(kind, "")


def tables_in(schema):
    """The tables that may stand for a value, and whether as a list."""
    found = []
    for entry in schema.get("anyOf", [schema]):
        if entry.get("type") == "object" and entry.get("properties"):
            found.append((entry, False))
        elif entry.get("type") == "array":
            found += [(table, True) for table, _ in tables_in(entry.get("items", {}))]
    return found


def cell(text):
    return text.replace("|", "\\|").replace("\n", " ")


def title(path):
    name = ".".join(key for key, _ in path)
    return f"[[{name}]]" if path[-1][1] else f"[{name}]"


def describe(table, path, out):
    if path:
        out.append(f"\n{'#' * min(len(path) + 1, 5)} `{title(path)}`\n")
        if table.get("description"):
            out.append(table["description"] + "\n")
    required = set(table.get("required", []))
    choice = [names for entry in table.get("oneOf", []) if (names := entry.get("required"))]
    if choice:
        out.append("Exactly one of " + ", ".join(" with ".join(f"`{n}`" for n in names) for names in choice) + ".\n")
    out.append("| key | value | meaning |\n|---|---|---|")
    for key, schema in sorted(table["properties"].items()):
        shown = f"**`{key}`**" if key in required else f"`{key}`"
        out.append(f"| {shown} | {cell(form(schema))} | {cell(schema.get('description', ''))} |")
    for key, schema in sorted(table["properties"].items()):
        seen = []
        for inner, many in tables_in(schema):
            # A table or a list of such tables: described once.
            if inner["properties"] not in seen:
                seen.append(inner["properties"])
                describe(inner, [*path, (key, many)], out)


def page(schema):
    out = [HEAD, "\n## At the top\n"]
    describe(schema, [], out)
    return "\n".join(out) + "\n"


def main():
    binary, write = sys.argv[1], "--write" in sys.argv[2:]
    schema = json.loads(subprocess.run([binary, "schema"], check=True, capture_output=True, text=True).stdout)
    text = page(schema)
    if write:
        PAGE.write_text(text, encoding="utf-8")
        return 0
    if not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
        print(f"{PAGE} is not what the schema says: run python3 tests/book/keys.py {binary} --write")
        return 1
    print(f"docs/keys.md has all keys: {text.count(chr(10) + '| ')} rows")
    return 0


if __name__ == "__main__":
    sys.exit(main())
