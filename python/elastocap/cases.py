"""Cases: read, written down anew with other values, and told apart."""

from __future__ import annotations

import json
import math
import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from . import _core
from .errors import CaseError

__all__ = ["Case", "load", "loads"]


class Case:
    """A valid case. It does not change: :meth:`with_` makes another one.

    A case is made by :func:`load` or :func:`loads`. It can be pickled, so that other processes can run it.
    """

    __slots__ = ("_core", "__weakref__")
    _core: _core.Case

    def __init__(self) -> None:
        raise TypeError("a case is read by elastocap.load or elastocap.loads")

    @property
    def title(self) -> str:
        """One line that says what the case is."""
        return self._core.title

    @property
    def text(self) -> str:
        """The case in TOML, as a file would have it."""
        return self._core.text

    @property
    def path(self) -> Path:
        """The file that the case is from. Paths in the case (of meshes and surfaces) are relative to its folder."""
        return Path(self._core.origin)

    @property
    def steps(self) -> int:
        """How many load steps a run has; 1 without a load."""
        return self._core.count_steps()

    @property
    def parameters(self) -> dict[str, Any]:
        """Every value that the case has, by the path of its key, as TOML has it: quantities are texts with a unit.

        >>> import elastocap
        >>> case = elastocap.load("cases/in-plane-pair.toml")
        >>> case.parameters["layer.thickness"]
        '450 um'
        """
        return dict(_leaves(tomllib.loads(self.text)))

    def with_(self, values: Mapping[str, Any] | None = None, /, **short: Any) -> Case:
        """This case with other values.

        Keys are paths, such as ``"layer.thickness"`` or ``"conductor[0].box.min"``, and may be new to the case. The last part alone will do
        where only one key of the case ends with it; so it can be the name of an argument. Values are what TOML would have: texts for
        quantities, numbers, booleans, lists, dictionaries.

        Raises :class:`CaseError` if a name fits no key or several, or if the result is not a valid case.

        >>> import elastocap
        >>> case = elastocap.load("cases/in-plane-pair.toml")
        >>> narrow = case.with_(gap="40 um", relative_tolerance=1e-2)
        >>> narrow.parameters["electrodes.in_plane_pair.gap"]
        '40 um'
        >>> case.with_({"layer.thickness": "400 um", "load.compression": [0.0, 0.1]}).steps
        2
        """
        text = self.text
        for name, value in {**(values or {}), **short}.items():
            text = _core.with_value(text, _resolved(text, name), _toml(value, name))
        return _case(_core.parse(text, os.fspath(self.path)))

    def __repr__(self) -> str:
        return f"<elastocap.Case {self.title!r}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Case):
            return NotImplemented
        return self.text == other.text and self.path == other.path

    def __hash__(self) -> int:
        return hash((self.text, self.path))

    def __reduce__(self) -> tuple[Any, ...]:
        return loads, (self.text, os.fspath(self.path))


def load(path: str | os.PathLike[str]) -> Case:
    """Reads a case file.

    Raises :class:`CaseError`, with the message that the command prints, if the file cannot be read or is not a valid case.

    >>> import elastocap
    >>> elastocap.load("cases/in-plane-pair.toml")
    <elastocap.Case 'In-plane electrode pair, 50 um gap, 450 um layer'>
    """
    return _case(_core.load(os.fspath(path)))


def loads(text: str, path: str | os.PathLike[str] = "case.toml") -> Case:
    """Reads a case from a text in TOML.

    ``path`` is the file that it stands for: messages name it, and paths in the case are relative to its folder. It need not exist.

    Raises :class:`CaseError` if the text is not a valid case.

    >>> import elastocap
    >>> case = elastocap.loads('''
    ... format = 1
    ...
    ... [[conductor]]
    ... name = "cube"
    ... box = { min = ["-0.5 m", "-0.5 m", "-0.5 m"], max = ["0.5 m", "0.5 m", "0.5 m"] }
    ...
    ... [surroundings]
    ... boundary = "open"
    ...
    ... [electrostatics]
    ... relative_tolerance = 1e-2
    ... ''')
    >>> result = elastocap.run(case)
    >>> bool(result.lower[0] <= 73.51e-12 <= result.upper[0])    # F, the known capacitance of a cube of one metre
    True
    """
    return _case(_core.parse(text, os.fspath(path)))


def _case(core: _core.Case) -> Case:
    case = object.__new__(Case)
    object.__setattr__(case, "_core", core)
    return case


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Each value that is no table, nor an array of tables, by its path."""
    if isinstance(value, dict):
        for key, inner in value.items():
            part = key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key, ensure_ascii=False)
            yield from _leaves(inner, f"{path}.{part}" if path else part)
    elif isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value):
        for index, entry in enumerate(value):
            yield from _leaves(entry, f"{path}[{index}]")
    else:
        yield path, value


def _tables(value: Any, path: str = "") -> Iterator[str]:
    """The paths of all tables and arrays of tables."""
    if isinstance(value, dict):
        for key, inner in value.items():
            here = f"{path}.{key}" if path else key
            if isinstance(inner, dict) or (isinstance(inner, list) and any(isinstance(e, dict) for e in inner)):
                yield here
            yield from _tables(inner, here)
    elif isinstance(value, list):
        for index, entry in enumerate(value):
            yield from _tables(entry, f"{path}[{index}]")


def _resolved(text: str, name: str) -> str:
    """The path of a key that is given by its path, or by its last part if only one key of the case has it."""
    if "." in name or "[" in name:
        return name
    document = tomllib.loads(text)
    if name in document:
        return name
    found = [path for path, _ in _leaves(document) if path.rpartition(".")[2] == name]
    found += [path for path in _tables(document) if path.rpartition(".")[2] == name]
    if len(found) == 1:
        return found[0]
    if found:
        one_of = ", ".join(f"`{path}`" for path in found)
        raise CaseError(f"error: `{name}` is the name of several keys of the case; give the path of one of them: {one_of}")
    raise CaseError(
        f"error: the case has no key `{name}`; to add one, give its path with the tables that it is in,"
        ' as in case.with_({"electrostatics.relative_tolerance": 1e-3})'
    )


def _toml(value: Any, name: str) -> str:
    """A value as it stands in a TOML file."""
    # Numbers and arrays of NumPy become those of Python.
    to_list = getattr(value, "tolist", None)
    if callable(to_list):
        value = to_list()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, str):
        # A text of JSON is one of TOML but for one character.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, Mapping):
        pairs = (f"{json.dumps(str(key))} = {_toml(inner, name)}" for key, inner in value.items())
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(entry, name) for entry in value) + "]"
    raise TypeError(
        f"`{name}` cannot be a {type(value).__name__}: a case has texts, numbers, booleans, lists and dictionaries;"
        ' quantities are texts with a unit, such as "40 um"'
    )
