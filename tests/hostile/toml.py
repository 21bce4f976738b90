"""Values written as TOML."""

import json


def text(word):
    """A basic string. JSON escapes all that TOML wants escaped but DEL."""
    return json.dumps(word, ensure_ascii=False).replace("\x7f", "\\u007F")


def value(thing):
    if isinstance(thing, bool):
        return "true" if thing else "false"
    if isinstance(thing, str):
        return text(thing)
    if isinstance(thing, dict):
        return "{ " + ", ".join(f"{key} = {value(below)}" for key, below in thing.items()) + " }" if thing else "{}"
    if isinstance(thing, list):
        return "[" + ", ".join(value(entry) for entry in thing) + "]"
    return repr(thing)


def document(case):
    """A case, its keys without a table first."""
    plain = [f"{key} = {value(below)}\n" for key, below in case.items() if not is_table(below)]
    tables = []
    for key, below in case.items():
        if not is_table(below):
            continue
        head = f"\n[{key}]\n" if isinstance(below, dict) else f"\n[[{key}]]\n"
        for entry in [below] if isinstance(below, dict) else below:
            tables.append(head + "".join(f"{name} = {value(part)}\n" for name, part in entry.items()))
    return "".join(plain + tables)


def is_table(thing):
    return isinstance(thing, dict) or (isinstance(thing, list) and bool(thing) and all(isinstance(entry, dict) for entry in thing))
