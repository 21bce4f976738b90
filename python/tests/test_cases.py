"""Cases and what is changed in them."""

import pickle

import numpy as np
import pytest

import elastocap

TWO = """
format = 1
[surroundings]
boundary = "open"
[[conductor]]
name = "a"
box = { min = ["0 m", "0 m", "0 m"], max = ["1 m", "1 m", "1 m"] }
[[conductor]]
name = "b"
box = { min = ["2 m", "0 m", "0 m"], max = ["3 m", "1 m", "1 m"] }
"""


@pytest.fixture
def pair():
    return elastocap.load("cases/in-plane-pair.toml")


def test_a_short_name_stands_for_the_only_key_that_ends_with_it(pair):
    changed = pair.with_(gap="40 um", height="200 um")
    assert changed.parameters["electrodes.in_plane_pair.gap"] == "40 um"
    assert changed.parameters["electrodes.in_plane_pair.height"] == "200 um"
    assert pair.parameters["electrodes.in_plane_pair.gap"] == "50 um", "the first case is as it was"


def test_a_short_name_of_several_keys_is_refused_with_their_paths(pair):
    with pytest.raises(elastocap.CaseError) as caught:
        pair.with_(thickness="1 um")
    assert "`layer.thickness`, `electrodes.in_plane_pair.thickness`" in str(caught.value)


def test_a_short_name_of_no_key_is_refused(pair):
    with pytest.raises(elastocap.CaseError, match="the case has no key `gapp`"):
        pair.with_(gapp="1 um")


def test_a_path_sets_any_key_and_keeps_comments(pair):
    changed = pair.with_({"layer.thickness": "400 um", "electrostatics.bounds": False})
    assert changed.parameters["layer.thickness"] == "400 um"
    assert changed.parameters["electrostatics.bounds"] is False
    assert changed.text.count("#") == pair.text.count("#") > 0


def test_entries_of_arrays_are_counted_from_zero():
    moved = elastocap.loads(TWO).with_({"conductor[1].box.max[0]": "4 m"})
    assert moved.parameters["conductor[1].box.max"] == ["4 m", "1 m", "1 m"]
    assert moved.parameters["conductor[0].name"] == "a"


def test_a_whole_table_has_a_short_name_too(pair):
    changed = pair.with_(material={"mooney_rivlin": {"c10": "40 kPa", "c01": "5 kPa"}})
    assert changed.parameters["layer.material.mooney_rivlin.c10"] == "40 kPa"


@pytest.mark.parametrize(
    "value",
    [np.float64(1e-2), 1e-2, np.float32(0.5), 1e-05, 0.1 + 0.2],
)
def test_numbers_arrive_as_they_were(pair, value):
    assert pair.with_(relative_tolerance=value).parameters["electrostatics.relative_tolerance"] == float(value)


def test_arrays_of_numpy_become_lists(pair):
    assert pair.with_(compression=np.linspace(0, 0.2, 3)).steps == 3


def test_texts_with_quotes_and_controls_arrive_as_they_were(pair):
    title = 'a "quoted" \\ title, \u00b5m \U0001f600'
    assert pair.with_(title=title).title == title


def test_what_toml_does_not_have_is_refused_in_words(pair):
    with pytest.raises(TypeError, match="quantities are texts with a unit"):
        pair.with_(gap=object())


def test_a_value_that_makes_no_case_is_refused_and_its_line_shown(pair):
    with pytest.raises(elastocap.CaseError, match=r"(?s)toml:15:17.*negative"):
        pair.with_(gap="-40 um")


def test_a_case_can_be_sent_to_another_process(pair):
    again = pickle.loads(pickle.dumps(pair.with_(gap="40 um")))
    assert again == pair.with_(gap="40 um") != pair
    assert hash(again) == hash(pair.with_(gap="40 um"))
    assert again.path == pair.path


def test_paths_in_a_changed_case_are_still_relative_to_its_file():
    case = elastocap.load("cases/dome-from-gmsh.toml")
    assert case.with_(title="another").path == case.path


def test_a_case_is_made_by_reading_only():
    with pytest.raises(TypeError, match="elastocap.load"):
        elastocap.Case()
