"""The command and the package give the same digits and the same files."""

import csv

import numpy as np
import pytest

import elastocap

pytestmark = pytest.mark.filterwarnings("ignore::elastocap.ElastocapWarning")

CASES = {
    "closed form": ("cases/in-plane-pair.toml", {}),
    "floating": ("cases/floating-plate.toml", {"relative_tolerance": 1e-2}),
    "finite elements": ("cases/stacked-pair.toml", {"relative_tolerance": 1e-2}),
    "tetrahedra": ("cases/dome-from-gmsh.toml", {"electrostatics.relative_tolerance": 0.2}),
}


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def bits(cells):
    return np.array([float(cell) if cell else np.nan for cell in cells]).view(np.uint64)


def written(case, changes):
    """The case with changes, beside the file that it is from, so that its paths keep their meaning."""
    changed = elastocap.load(case).with_(changes)
    path = changed.path.resolve().with_name(f".python-test-{changed.path.name}")
    path.write_text(changed.text)
    return changed, path


@pytest.mark.parametrize("name", CASES)
def test_arrays_and_tables_are_the_same_to_the_last_bit(name, command, workspace):
    case, path = written(*CASES[name])
    try:
        command("run", path, "-o", "command", "--quiet", "--no-fields", "--no-scene", "--threads", 2)
    finally:
        path.unlink()
    result = elastocap.run(case, threads=1)
    if (workspace / "command/curve.csv").exists():
        rows = read("command/curve.csv")
        assert list(rows[0]) == list(result.columns())
        for column in result.columns()[:-2]:
            expected = bits(row[column] for row in rows)
            # The file has no negative zero.
            assert np.array_equal(expected, (result[column] + 0.0).view(np.uint64)), column
        assert [row["unknowns"] for row in rows] == ["" if n is None else str(n) for n in result["unknowns"]]
        assert [row["status"] for row in rows] == list(result.status)
    matrices = {"value_f": result.maxwell, "lower_f": result.maxwell_lower, "upper_f": result.maxwell_upper}
    entries = [row for row in read("command/capacitance.csv") if row["quantity"] == "maxwell"]
    assert len(entries) == result.maxwell.size > 0
    for column, matrix in matrices.items():
        expected = bits(row[column] for row in entries)
        assert np.array_equal(expected, (matrix.ravel() + 0.0).view(np.uint64)), column


def test_a_different_number_would_be_seen(command):
    case = elastocap.load("cases/in-plane-pair.toml")
    nudged = elastocap.run(case.with_(gap="50.000001 um"))
    assert not np.array_equal(elastocap.run(case).capacitance, nudged.capacitance)


@pytest.mark.parametrize("case", ["in-plane-pair", "stacked-pair"])
def test_saved_files_are_those_of_the_command(case, command, workspace):
    path = f"cases/{case}.toml"
    command("run", path, "-o", "command", "--quiet")
    saved = elastocap.run(elastocap.load(path), fields=True).save("python")
    assert saved.folder.name == "python"
    names = sorted(file.name for file in (workspace / "command").iterdir())
    assert [file.name for file in saved.files] == names
    assert any(name.endswith(".vtu") for name in names)
    for name in names:
        if name in ("result.json", "report.html"):  # have times
            continue
        same = (workspace / "command" / name).read_bytes() == (workspace / "python" / name).read_bytes()
        assert same, name


def test_without_fields_the_files_are_those_of_no_fields(command, workspace):
    command("run", "cases/in-plane-pair.toml", "-o", "command", "--quiet", "--no-fields", "--no-scene")
    saved = elastocap.run(elastocap.load("cases/in-plane-pair.toml")).save("python", scene=False)
    assert {file.name for file in saved.files} == {file.name for file in (workspace / "command").iterdir()}
