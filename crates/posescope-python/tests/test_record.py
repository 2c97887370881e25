"""Recording from inside a running localiser."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import posescope


def test_a_recording_is_a_run_with_verdicts(street: posescope.Scene, tmp_path: Path) -> None:
    slowest = 0.0
    with posescope.record(tmp_path / "live", street, keep=1) as log:
        for name in ("70", "72", "74"):
            query = street.query(name)
            pose = query.truth
            assert pose is not None
            if name == "74":
                pose = pose.copy()
                pose[0, 3] += 5.0
            start = time.perf_counter()
            log.query(query.photo, query.camera, pose, truth=query.truth, name=query.name)
            slowest = max(slowest, time.perf_counter() - start)
        log.query(query.photo, query.camera, None, name="lost")
    # 2 ms on an idle machine; tests share theirs.
    assert slowest < 0.1
    run = posescope.Run.open(tmp_path / "live")
    assert [row["query"] for row in run.rows()] == ["000070", "000072", "000074", "lost"]
    assert [row["grade"] for row in run.rows()] == ["right", "right", "wrong", "no pose"]
    assert run.rows()[2]["diagnosis"] and run.rows()[0]["references"] == ["000070"]
    assert [file.name for file in (run.path / "failures").iterdir()] == ["000074-live.rrd"]
    assert len(list((run.path / "queries" / "photos").iterdir())) == 4
    photos = posescope.Scene.open(run.path / "queries")
    assert np.array_equal(photos.query("000070").photo, street.query("70").photo)
    assert (run.path / "report.html").stat().st_size > 10_000
    with pytest.raises(FileExistsError):
        posescope.record(tmp_path / "live", street)


def test_a_full_queue_skips_the_verdict_and_keeps_the_pose(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    with posescope.record(tmp_path / "live", street, waiting=1, keep=0) as log:
        for _ in range(5):
            log.query(query.photo, query.camera, query.truth)
    rows = posescope.Run.open(tmp_path / "live").rows()
    assert log.skipped >= 1 and len(rows) == 5
    assert all(row["pose"] is not None for row in rows)
    assert len(list((tmp_path / "live" / "queries" / "photos").iterdir())) == 5
    assert len((tmp_path / "live" / "poses.txt").read_text().splitlines()) == 6


def test_an_exception_of_the_caller_loses_nothing(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    with pytest.raises(LookupError, match="mine"):
        with posescope.record(tmp_path / "live", street, keep=0) as log:
            log.query(query.photo, query.camera, query.truth)
            raise LookupError("mine")
    rows = posescope.Run.open(tmp_path / "live").rows()
    assert len(rows) == 1 and rows[0]["references"] == ["000070"]


def test_wrong_arguments_are_named_at_once(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    with posescope.record(tmp_path / "live", street, keep=0) as log:
        with pytest.raises(ValueError, match="photo: "):
            log.query(np.zeros((4, 4)), query.camera, query.truth)
        with pytest.raises(ValueError, match="world_from_camera"):
            log.query(query.photo, query.camera, np.eye(3))
        with pytest.raises(ValueError, match="reference"):
            log.query(query.photo, query.camera, query.truth, matches=(np.zeros((0, 2)),) * 2)
        with pytest.raises(ValueError, match="name"):
            log.query(query.photo, query.camera, query.truth, name="a/b")
        points = np.zeros((3, 2))
        log.query(
            query.photo,
            query.camera,
            query.truth,
            matches=(points, points),
            inliers=[True, False, True],
            reference="62",
            name="a",
        )
        with pytest.raises(ValueError, match="new name"):
            log.query(query.photo, query.camera, query.truth, name="a")
    with pytest.raises(RuntimeError, match="closed"):
        log.query(query.photo, query.camera, query.truth)
    with pytest.raises(ValueError, match="method of posescope"):
        posescope.record(tmp_path / "other", street, name="fb")
