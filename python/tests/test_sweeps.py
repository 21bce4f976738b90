"""Sweeps: the same table whatever solves the cases, and whatever becomes of it."""

import _thread
import os
import signal
import threading
import time

import numpy as np
import pytest

import elastocap

pytestmark = pytest.mark.filterwarnings("ignore::elastocap.ElastocapWarning")
GAPS = [f"{gap} um" for gap in range(40, 64, 2)]


@pytest.fixture
def case():
    return elastocap.load("cases/in-plane-pair.toml").with_(compression=[0.0, 0.2], relative_tolerance=1e-2)


def same(one, other):
    assert list(one.columns) == list(other.columns)
    for name in one.columns:
        if one[name].dtype == np.float64:
            assert one[name].to_numpy().tobytes() == other[name].to_numpy().tobytes(), name
        else:
            assert one[name].astype(object).where(one[name].notna(), None).tolist() == other[name].astype(
                object
            ).where(other[name].notna(), None).tolist(), name


def test_every_value_is_combined_with_every_other_and_solved_as_by_itself(case):
    told = []
    grid = {"gap": ["40 um", "50 um"], "layer.thickness": ["400 um", "450 um"]}
    table = elastocap.sweep(case, grid, progress=told.append)
    keys = ["electrodes.in_plane_pair.gap", "layer.thickness"]
    assert list(table.columns) == ["case", *keys, "step", *elastocap.Result.columns(), "message"]
    assert table["case"].tolist() == [0, 0, 1, 1, 2, 2, 3, 3] and table["step"].tolist() == [0, 1] * 4
    firsts = table[table["step"] == 0][keys].to_numpy().tolist()
    assert firsts == [[40e-6, 400e-6], [40e-6, 450e-6], [50e-6, 400e-6], [50e-6, 450e-6]]
    alone = elastocap.run(case.with_(gap="50 um").with_({"layer.thickness": "400 um"})).to_pandas()
    third = table[table["case"] == 2].reset_index(drop=True)
    # What the model of the layer adds is computed in a run, and estimated in a sweep.
    of_model = {"model_error_estimate", "total_error_estimate", "change_total_error_f"}
    of_model |= {"sensitivity_f_per_n", "sensitivity_error_f_per_n"}
    for column in (name for name in elastocap.Result.columns()[:-2] if name not in of_model):
        assert third[column].to_numpy().tobytes() == alone[column].to_numpy().tobytes(), column
    assert [progress.done for progress in told] == [0, 1, 2, 3, 4] and told[-1].total == 4


def test_the_table_is_that_of_the_command(case, command, workspace):
    import pandas

    path = workspace / "case.toml"
    path.write_text(case.text)
    # The last height is above the layer: refused.
    grid = {"gap": "40um..50um:2", "electrodes.in_plane_pair.height": "200um, 1mm"}
    sets = ["--set", "electrodes.in_plane_pair.gap=40um..50um:2", "--set", "electrodes.in_plane_pair.height=200um, 1mm"]
    command("sweep", "case.toml", *sets, "-o", "command", "--quiet", status=3)
    table = elastocap.sweep(elastocap.load("case.toml"), grid)
    written = pandas.read_csv(
        "command/sweep.csv",
        keep_default_na=False,
        na_values={name: [""] for name in table.columns if name not in ("status", "message")},
    )
    assert table["status"].tolist() == ["ok", "ok: but for the model of the layer", "refused"] * 2
    same(table, written.astype(table.dtypes.to_dict()))


def test_a_text_of_values_is_read_as_by_the_command(case):
    table = elastocap.sweep(case.with_(compression=[0.0]), {"gap": "40um..60um:3, 70 um"})
    assert table["electrodes.in_plane_pair.gap"].tolist() == [40e-6, 50e-6, 60e-6, 70e-6]
    with pytest.raises(elastocap.CaseError, match="does not say how many values"):
        elastocap.sweep(case, {"gap": "40um..60um"})
    with pytest.raises(elastocap.CaseError, match="is a distribution"):
        elastocap.sweep(case, {"gap": "normal(50um, 2um)"})


def test_cases_may_be_listed_and_lack_values(case):
    table = elastocap.sweep(case, [{"gap": "40 um"}, {}, {"height": "200 um"}], workers=1)
    gap, height = table["electrodes.in_plane_pair.gap"], table["electrodes.in_plane_pair.height"]
    assert gap[table["step"] == 0].tolist() == [40e-6, 50e-6, 50e-6]
    assert height[table["step"] == 0].tolist() == [225e-6, 225e-6, 200e-6]


def test_a_case_that_is_refused_has_a_row_and_the_others_are_solved(case):
    with pytest.warns(elastocap.ElastocapWarning, match="1 of 2 cases"):
        table = elastocap.sweep(case, {"height": ["1 mm", "200 um"]})
    assert table["status"].tolist() == ["refused", "ok", "ok: but for the model of the layer"]
    assert table["message"][0] and "\n" not in table["message"][0]
    assert np.isnan(table["capacitance_f"][0]) and table["capacitance_f"][1] > 0


def test_mistakes_of_the_whole_sweep_are_exceptions(case):
    with pytest.raises(elastocap.CaseError, match="no key `gapp`"):
        elastocap.sweep(case, {"gapp": ["40 um"]})
    with pytest.raises(elastocap.CaseError, match="varied twice"):
        elastocap.sweep(case, {"gap": ["40 um"], "electrodes.in_plane_pair.gap": ["50 um"]})
    with pytest.raises(ValueError, match="there are no cases"):
        elastocap.sweep(case, {"gap": []})
    with pytest.raises(TypeError, match="a list"):
        elastocap.sweep(case, {"gap": 40e-6})


def test_ctrl_c_ends_a_sweep_soon(case):
    threading.Timer(1.0, _thread.interrupt_main).start()
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        elastocap.sweep(case.with_(relative_tolerance=2e-5), {"gap": GAPS * 100})
    assert time.monotonic() - begun < 30


def test_a_table_is_the_same_from_parquet(case, workspace):
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    table = elastocap.sweep(case, {"gap": ["40 um", "50 um"]})
    table.to_parquet("sweep.parquet")
    same(table, pandas.read_parquet("sweep.parquet"))


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_worker_of_dask_may_be_killed_half_way(case):
    distributed = pytest.importorskip("distributed")
    here = elastocap.sweep(case, {"gap": GAPS})
    killed = []

    def kill(progress):
        if progress.done >= 4 and not killed:
            pid = next(iter(client.run(os.getpid).values()))
            os.kill(pid, signal.SIGKILL)
            killed.append((pid, progress.done))

    # Cases that take long enough for the worker to die in the middle of some.
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        there = elastocap.sweep(case, {"gap": GAPS}, client=client, progress=kill)
    assert killed and 4 <= killed[0][1] < len(GAPS)
    same(here, there)
