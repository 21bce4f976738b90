"""How a run behaves in the program that calls it: threads, Python's lock, Ctrl-C, progress."""

import io
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import elastocap

pytestmark = pytest.mark.filterwarnings("ignore::elastocap.ElastocapWarning")


@pytest.fixture
def quick():
    return elastocap.load("cases/in-plane-pair.toml").with_(relative_tolerance=1e-2)


@pytest.fixture
def long():
    """Takes minutes."""
    return elastocap.load("cases/in-plane-pair.toml").with_(
        compression=np.linspace(0, 0.4, 400), relative_tolerance=2e-5
    )


def test_the_numbers_do_not_depend_on_the_threads(quick):
    one, three = elastocap.run(quick, threads=1), elastocap.run(quick, threads=3)
    assert (one.threads, three.threads) == (1, 3)
    assert one.maxwell_lower.tobytes() == three.maxwell_lower.tobytes()
    assert one.to_pandas().equals(three.to_pandas())


def test_leaving_nothing_out_gives_the_same_bounds_within_the_tolerance(quick):
    whole, pruned = elastocap.run(quick, prune=False), elastocap.run(quick)
    assert np.all(whole.lower <= pruned.upper) and np.all(pruned.lower <= whole.upper)


def test_other_threads_go_on_while_it_computes(long):
    counted = 0
    stop = threading.Event()

    def count():
        nonlocal counted
        while not stop.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    elastocap.run(long, max_time=1.0)
    stop.set()
    thread.join()
    # With the lock held there would be next to none. Sleeping takes longer on a busy machine.
    assert counted > 50


def test_runs_in_several_threads_give_what_they_give_alone(quick):
    alone = elastocap.run(quick).lower.tobytes()
    found = []
    threads = [threading.Thread(target=lambda: found.append(elastocap.run(quick, threads=1))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [result.lower.tobytes() for result in found] == [alone] * 3


def test_a_time_limit_stops_the_run_and_keeps_what_is_finished(long, workspace):
    begun = time.monotonic()
    result = elastocap.run(long, max_time=2.0)
    assert time.monotonic() - begun < 30
    assert result.stopped and not result.complete
    assert len(result) == 400 and "not run" in result.status
    with pytest.warns(elastocap.ElastocapWarning, match="what this run has found is in"):
        saved = result.save("stopped")
    assert saved.folder.name == "stopped.partial" and not (workspace / "stopped").exists()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_stops_the_run_soon_and_in_order():
    program = """
import time, sys, elastocap, numpy as np
case = elastocap.load("cases/in-plane-pair.toml").with_(compression=np.linspace(0, 0.4, 400), relative_tolerance=2e-5)
try:
    elastocap.run(case, progress=lambda p: print(p.done, flush=True))
except KeyboardInterrupt as stop:
    print("stopped", stop.result.stopped, sum(s.startswith("ok") for s in stop.result.status), len(stop.result))
"""
    with subprocess.Popen([sys.executable, "-W", "ignore", "-c", program], stdout=subprocess.PIPE, text=True) as child:
        try:
            while int(child.stdout.readline()) < 1:
                pass
            pressed = time.monotonic()
            child.send_signal(signal.SIGINT)
            last = child.communicate(timeout=60)[0].splitlines()[-1].split()
            taken = time.monotonic() - pressed
        finally:
            child.kill()
    assert child.returncode == 0
    assert last[:2] == ["stopped", "True"] and int(last[2]) >= 1 and last[3] == "400"
    # Measured: 0.6 s, the end of Python included, on a machine that had eight times too much to do.
    assert taken < 10


def test_progress_is_told_by_the_calling_thread_and_ends_with_all_steps(quick):
    told = []
    elastocap.run(quick, progress=lambda progress: told.append((progress, threading.get_ident())))
    assert {thread for _, thread in told} == {threading.get_ident()}
    steps = [progress.done for progress, _ in told]
    assert steps == sorted(steps) and steps[-1] == told[-1][0].total == 6
    assert told[0][0].remaining is None and told[-1][0].remaining == 0


def test_an_exception_of_the_progress_function_stops_the_run(long):
    def fail(progress):
        if progress.done:
            raise RuntimeError("enough")

    begun = time.monotonic()
    with pytest.raises(RuntimeError, match="enough") as caught:
        elastocap.run(long, progress=fail)
    assert caught.value.result.stopped and time.monotonic() - begun < 60


def test_true_shows_a_bar_and_wipes_it_out(quick, monkeypatch):
    shown = io.StringIO()
    monkeypatch.setattr(sys, "stderr", shown)
    elastocap.run(quick, progress=True)
    text = shown.getvalue()
    assert "6/6 steps" in text and "#" * 30 in text
    assert text.endswith(" \r") and "\n" not in text


def test_a_result_has_the_same_numbers_in_every_form(quick):
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    result = elastocap.run(quick)
    table, data = result.to_pandas(), result.to_xarray()
    assert list(table.columns) == list(result.columns()) and len(table) == len(result) == 6
    named = {
        "compression": result.compression,
        "force_n": result.force,
        "capacitance_f": result.capacitance,
        "capacitance_lower_f": result.lower,
        "capacitance_upper_f": result.upper,
        "change_f": result.change,
        "change_lower_f": result.change_lower,
        "change_upper_f": result.change_upper,
    }
    for column, array in named.items():
        assert table[column].to_numpy().tobytes() == array.tobytes() == data[column].to_numpy().tobytes(), column
    assert table["unknowns"].dtype == "Int64"
    assert data["maxwell_f"].dims == ("step", "row", "column") and data["maxwell_f"].attrs["units"] == "F"
    assert data["sensitivity_f_per_n"].attrs["units"] == "F/N" and data["compression"].attrs["units"] == "1"
    assert float(data["maxwell_f"].sel(step=1, row="electrode-left", column="electrode-right")) == result.maxwell[1, 0, 1]
    for step in result:
        k = step.index
        assert (step.capacitance, step.lower, step.upper) == (result.capacitance[k], result.lower[k], result.upper[k])
        assert (step.force, step.compression, step.change) == (result.force[k], result.compression[k], result.change[k])
        assert step.maxwell.tobytes() == result.maxwell[k].tobytes() and step["status"].startswith("ok")
    document = result.to_dict()
    assert [step["force_n"] for step in document["steps"]] == result.force.tolist()
    assert result.measurement == ("two_terminal", ("electrode-left", "electrode-right"))


def test_a_result_cannot_be_written_to(quick):
    result = elastocap.run(quick)
    with pytest.raises(ValueError, match="read-only"):
        result.capacitance[0] = 0


def test_a_column_that_does_not_exist_is_a_key_error(quick):
    with pytest.raises(KeyError, match="capacitence_f"):
        elastocap.run(quick)["capacitence_f"]
