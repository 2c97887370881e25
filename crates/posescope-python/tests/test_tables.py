"""The table of results: its columns and types do not depend on the run."""

from __future__ import annotations

import importlib
import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import posescope

LIBRARIES = ["list", "polars", "pandas", "pyarrow"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, street: posescope.Scene) -> "dict[str, posescope.Run]":
    """An evaluation, and recordings with truth, without, and without queries."""
    root = tmp_path_factory.mktemp("runs")
    made = {"evaluated": posescope.evaluate(street, root / "evaluated", limit=2, method="fb,mi", keep_failures=0)}
    query = street.query("70")
    moved = np.array(query.truth)
    moved[:3, 3] += moved[:3, :3] @ [1.0, -0.5, 2.0]
    for name, truth in (("truth", query.truth), ("blind", None)):
        with posescope.record(root / name, street, keep=0, waiting=9) as log:
            log.query(query.photo, query.camera, moved, truth=truth)
            log.query(query.photo, query.camera, None, truth=truth)
        made[name] = posescope.Run.open(root / name)
    with posescope.record(root / "empty", street):
        pass
    made["empty"] = posescope.Run.open(root / "empty")
    return made


def names_and_types(table: Any) -> Any:
    if isinstance(table, list):
        return sorted({tuple(row) for row in table}) or None
    if hasattr(table, "schema"):
        return str(table.schema)
    return str(table.dtypes.to_dict())


@pytest.mark.parametrize("library", LIBRARIES)
def test_columns_are_the_same_whatever_the_run_holds(library: str, runs: "dict[str, posescope.Run]") -> None:
    if library != "list" and not importlib.util.find_spec(library):
        pytest.skip(f"no {library}")
    shapes = {name: names_and_types(run.results(library)) for name, run in runs.items()}
    # A list without rows has no columns.
    assert len({str(shape) for shape in shapes.values() if shape is not None}) == 1, shapes
    assert len(runs["evaluated"].results(library)) == 4 and len(runs["empty"].results(library)) == 0


def test_positions_errors_and_codes_are_columns(runs: "dict[str, posescope.Run]") -> None:
    with_truth, without = (runs[name].results("list") for name in ("truth", "blind"))
    row = with_truth[0]
    assert [row[f"error.{axis}_m"] for axis in ("right", "down", "forward")] == pytest.approx([1.0, -0.5, 2.0])
    assert row["error.translation_m"] == pytest.approx(np.linalg.norm([1.0, 0.5, 2.0]))
    assert row["codes"][0] == row["code"] and row["verdict"].count(" ") > 5
    assert row["position.x_m"] is not None and row["quaternion.w"] >= 0.0
    assert without[0]["error.translation_m"] is None and without[0]["grade"] == "unmeasured"
    assert with_truth[1]["position.x_m"] is None and with_truth[1]["code"] == "E1"
    features = [row for row in runs["evaluated"].results("list") if row["method"] == "fb"]
    assert all(row["counts.inliers"] > 0 and row["error.right_m"] is not None for row in features)
    length = np.linalg.norm([features[0][f"error.{axis}_m"] for axis in ("right", "down", "forward")])
    assert length == pytest.approx(features[0]["error.translation_m"])


def test_results_are_filtered_by_method_and_grade(runs: "dict[str, posescope.Run]") -> None:
    run = runs["evaluated"]
    assert {row["method"] for row in run.results("list", method="mi")} == {"mi"}
    assert [row["grade"] for row in runs["truth"].results("list", grade="no pose")] == ["no pose"]
    assert run.results("list", method="nothing") == []
    with pytest.raises(ValueError, match="grade: right, wrong"):
        run.results("list", grade="good")
    with pytest.raises(ValueError, match="parquet"):
        run.results("parquet")


def test_an_evaluation_takes_named_references_and_pairs(street: posescope.Scene, tmp_path: Path) -> None:
    pairs = tmp_path / "pairs.txt"
    pairs.write_text("70.png 62.png\n70.png 78.png\n\n74.png 78.png\n")
    of_file = posescope.evaluate(street, tmp_path / "file", pairs=pairs, method="fb", keep_failures=0)
    of_dict = posescope.evaluate(
        street,
        tmp_path / "dict",
        pairs={street.query(70): [62, 78], "74": [street.reference(78)]},
        method="fb",
        keep_failures=0,
    )
    rows = of_file.rows()
    assert rows == of_dict.rows()
    assert [(row["query"], row["references"]) for row in rows] == [
        ("000070", ["000062", "000078"]),
        ("000074", ["000078"]),
    ]
    named = posescope.evaluate(
        street, tmp_path / "named", references=[62], query=["70", "72"], method="fb", keep_failures=0
    )
    assert [(row["query"], row["references"]) for row in named.rows()] == [
        ("000070", ["000062"]),
        ("000072", ["000062"]),
    ]
    with pytest.raises(posescope.InputError, match="line 1"):
        (tmp_path / "wrong.txt").write_text("a b c\n")
        posescope.evaluate(street, tmp_path / "x", pairs=tmp_path / "wrong.txt")
    with pytest.raises(posescope.InputError, match="9999"):
        posescope.evaluate(street, tmp_path / "x", pairs=[("70", "9999")], method="fb")
    with pytest.raises(ValueError, match="references: either"):
        posescope.evaluate(street, tmp_path / "x", pairs=[("70", "62")], references=["62"])
    assert not (tmp_path / "x").exists()
