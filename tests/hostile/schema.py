"""The JSON Schema of case files: its keys, and a walk that draws a value for any of them."""

import json
import re
import subprocess

# How far a number goes where the schema gives no limit.
NUMBERS = (0.1, 10.0)


def read(binary):
    """The schema that a binary prints."""
    return json.loads(subprocess.run([binary, "schema"], capture_output=True, check=True, text=True).stdout)


def alternatives(node):
    return node.get("anyOf", [node])


def keys(node, path=""):
    """The paths of all keys below a node; entries of arrays have the path of the array, words that may be chosen one of their own."""
    found = set()
    for choice in alternatives(node):
        if "enum" in choice and path:
            found |= {f"{path} = {json.dumps(word)}" for word in choice["enum"]}
        if choice.get("type") == "array" and isinstance(choice.get("items"), dict):
            found |= keys(choice["items"], path)
        for key, below in choice.get("properties", {}).items():
            name = f"{path}.{key}" if path else key
            found |= {name} | keys(below, name)
    return found


def used(value, known, path=""):
    """The paths among `known` of what a value holds."""
    if isinstance(value, dict):
        found = set()
        for key, below in value.items():
            name = f"{path}.{key}" if path else key
            found |= ({name} & known) | used(below, known, name)
        return found
    if isinstance(value, list):
        return set().union(*[used(entry, known, path) for entry in value])
    return {f"{path} = {json.dumps(value)}"} & known if isinstance(value, str) else set()


class Walk:
    """Draws values that have the types of the schema. What fits together is for a subclass: `fitting` is asked before, `chances` has
    the chance of an optional key, and `weights` those of keys of which one must be."""

    chances = {}
    weights = {}

    def __init__(self, rng):
        self.rng = rng

    def fitting(self, path, node):
        """A value for the path, or `None` if any of its type will do."""
        return None

    def value(self, path, node):
        fitting = self.fitting(path, node)
        return self.any_value(path, node) if fitting is None else fitting

    def any_value(self, path, node):
        node = self.rng.choice(alternatives(node))
        if "const" in node:
            return node["const"]
        if "enum" in node:
            return self.rng.choice(node["enum"])
        kind = node.get("type")
        if kind == "object":
            return self.table(path, node)
        if kind == "array":
            least = node.get("minItems", 1)
            count = self.rng.randint(least, min(node.get("maxItems", least + 2), least + 2))
            return [self.value(path, node["items"]) for _ in range(count)]
        if kind == "boolean":
            return self.rng.random() < 0.5
        if kind == "integer":
            return self.rng.randint(node.get("minimum", 1), min(node.get("maximum", 4), node.get("minimum", 1) + 3))
        if kind == "number":
            low = node.get("minimum", node.get("exclusiveMinimum", NUMBERS[0]))
            high = node.get("maximum", node.get("exclusiveMaximum", NUMBERS[1]))
            return float(f"{self.rng.uniform(low, high):.3g}")
        if kind == "string" and "examples" in node:
            return self.quantity(node["examples"][0])
        return f"text{self.rng.randrange(10)}"

    def quantity(self, example):
        """A quantity within a factor of ten of the example of the schema."""
        match = re.fullmatch(r"([0-9.eE+-]+)\s+(.+)", example)
        if not match:
            return example
        return f"{(float(match[1]) or 1.0) * 10 ** self.rng.uniform(-1, 1):.3g} {match[2]}"

    def choose(self, path, words):
        """One of several words, by their weights below the path."""
        weights = [self.weights.get(f"{path}.{word}", 1.0) for word in words]
        return self.rng.choices(words, weights)[0] if sum(weights) > 0 else self.rng.choice(words)

    def table(self, path, node):
        """A table with all keys that must be, one of those of which one must be, and some of the others."""
        one_of = [choice["required"][0] for choice in node.get("oneOf", [])]
        wanted = set(node.get("required", []))
        if one_of:
            wanted.add(self.choose(path, one_of))
        made = {}
        for key, below in node["properties"].items():
            name = f"{path}.{key}" if path else key
            if key in wanted or (key not in one_of and self.rng.random() < self.chance(name)):
                made[key] = self.value(name, below)
        return made

    def chance(self, path):
        return self.chances.get(path, 0.15)
