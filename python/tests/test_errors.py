"""Exceptions have the words of the command."""

import pickle

import pytest

import elastocap

BAD = {
    "unknown key": '[layer]\nthicknes = "450 um"\n',
    "unit": '[layer]\nthickness = "450 furlong"\n',
    "syntax": "[layer\n",
    "number": "[layer]\nthickness = 450\n",
}


@pytest.mark.parametrize("name", BAD)
def test_a_case_that_is_refused_has_the_message_of_the_command(name, command, workspace):
    path = workspace / "bad.toml"
    path.write_text("format = 1\n" + BAD[name])
    told = command("run", "bad.toml", status=2).stderr
    with pytest.raises(elastocap.CaseError) as caught:
        elastocap.load("bad.toml")
    assert str(caught.value) == told.rstrip("\n")
    assert isinstance(caught.value, (elastocap.ElastocapError, ValueError))
    problem = caught.value.problems[0]
    assert problem.message in told and problem.line in (2, 3)


def test_a_file_that_is_not_there_is_told_as_by_the_command(command):
    told = command("run", "nothing.toml", status=2).stderr
    with pytest.raises(elastocap.CaseError, match="there is no case file") as caught:
        elastocap.load("nothing.toml")
    assert str(caught.value) == told.rstrip("\n")
    assert caught.value.problems[0].line is None


def test_files_of_somebody_else_are_not_replaced(command, workspace):
    (workspace / "mine").mkdir()
    (workspace / "mine/curve.csv").write_text("my own\n")
    told = command("run", "cases/cube-in-cube.toml", "-o", "mine", status=1).stderr
    result = elastocap.run(elastocap.load("cases/cube-in-cube.toml").with_(relative_tolerance=1e-2))
    with pytest.raises(elastocap.OutputError) as caught:
        result.save("mine")
    assert str(caught.value) == told.rstrip("\n")
    assert isinstance(caught.value, OSError)
    assert [file.name for file in (workspace / "mine").iterdir()] == ["curve.csv"]


def test_an_exception_can_be_sent_to_another_process():
    with pytest.raises(elastocap.CaseError) as caught:
        elastocap.loads("format = 1\nnothing = 1\n")
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value) and again.problems == caught.value.problems


def test_a_step_that_fails_is_no_exception_but_a_warning():
    case = elastocap.load("cases/in-plane-pair-by-force.toml").with_(force=["0 N", "1 kN"], relative_tolerance=1e-2)
    with pytest.warns(elastocap.ElastocapWarning) as told:
        result = elastocap.run(case)
    assert not result.complete and not result.stopped
    assert result[0].ok and not result[1].ok
    assert result[1].status == f"failed: {result[1].reason}"
    assert [str(warning.message) for warning in told] == list(result.warnings) == [f"step 1 {result[1].status}"]


@pytest.mark.parametrize("threads", [0, -1, 2000])
def test_a_number_of_threads_that_makes_no_sense_is_refused(threads):
    with pytest.raises(ValueError, match="between 1 and 1024"):
        elastocap.run(elastocap.load("cases/cube-in-cube.toml"), threads=threads)


def test_only_a_case_can_be_run():
    with pytest.raises(TypeError, match="from elastocap.load"):
        elastocap.run("cases/cube-in-cube.toml")
