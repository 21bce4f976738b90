"""Whatever the documents and docstrings show as Python is executed, in their order."""

import doctest
import importlib
import pkgutil
import re

import pytest

import elastocap
from conftest import ROOT

pytestmark = pytest.mark.filterwarnings("ignore::elastocap.ElastocapWarning")
MODULES = [f"elastocap.{module.name}" for module in pkgutil.iter_modules(elastocap.__path__) if module.name != "_core"]


@pytest.mark.parametrize("name", ["elastocap", *MODULES])
def test_docstrings_say_what_happens(name):
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    assert doctest.testmod(importlib.import_module(name), optionflags=flags).failed == 0


def test_there_are_docstrings_to_execute():
    finder = doctest.DocTestFinder(exclude_empty=True)
    modules = [importlib.import_module(name) for name in ["elastocap", *MODULES]]
    assert sum(len(test.examples) > 0 for module in modules for test in finder.find(module)) >= 7


@pytest.mark.parametrize("page", ["docs/python.md", "python/README.md"])
def test_the_examples_of_a_page_run_and_print_what_it_says(page, capsys):
    blocks = re.findall(r"^```(python|text)\n(.*?)^```", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)
    assert blocks and blocks[0][0] == "python"
    names = {"__name__": page}
    for kind, block in blocks:
        if kind == "python":
            capsys.readouterr()
            exec(compile(block, page, "exec"), names)
        else:
            assert capsys.readouterr().out == block


def test_everything_public_has_a_docstring():
    for name in elastocap.__all__:
        thing = getattr(elastocap, name)
        if isinstance(thing, str):
            continue
        assert thing.__doc__, name
        for member, value in vars(thing).items() if isinstance(thing, type) else ():
            if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                assert value.__doc__, f"{name}.{member}"
