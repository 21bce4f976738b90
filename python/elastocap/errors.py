"""The exceptions of elastocap. Their texts are the messages of the command."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

__all__ = ["CaseError", "ElastocapError", "ElastocapWarning", "OutputError", "Problem"]


class ElastocapError(Exception):
    """Whatever goes wrong in elastocap; the other exceptions are kinds of it."""


class Problem(NamedTuple):
    """One thing that is wrong in a case file."""

    message: str
    """What is wrong, in one line."""
    line: int | None
    """Where it begins, counted from 1; None where the file as a whole is at fault."""
    column: int | None
    """The character of the line, counted from 1."""
    help: str | None
    """What would be right."""


class CaseError(ElastocapError, ValueError):
    """A case that cannot be run: its text shows each problem with its line, what is wrong and what would be right.

    >>> import elastocap
    >>> try:
    ...     elastocap.loads('format = 1\\ntitel = "A sensor"')
    ... except elastocap.CaseError as error:
    ...     print(error.problems[0].line, error.problems[0].message)
    2 unknown key `titel` at the top level
    """

    def __init__(
        self, message: str, problems: Iterable[tuple[str, int | None, int | None, str | None]] = ()
    ) -> None:
        super().__init__(message)
        self.problems: tuple[Problem, ...] = tuple(Problem(*problem) for problem in problems)
        """Each problem by itself, in the order of the file."""


class OutputError(ElastocapError, OSError):
    """Results that cannot be written. The folder is then as it was before."""


class ElastocapWarning(UserWarning):
    """What the command warns of: a force that is not to be trusted, a step that missed its tolerance."""
