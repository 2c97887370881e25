"""Recording from inside a running localiser."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest

import posescope
from conftest import surf_matches


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


def test_matches_give_verdicts_of_their_own_and_are_stored(street: posescope.Scene, tmp_path: Path) -> None:
    query, reference = street.query("70"), street.reference("62")
    right = surf_matches(query, reference)
    # Each point of the query with another one's partner.
    wrong = right[0], np.roll(right[1], len(right[1]) // 2, axis=0)
    truth = query.truth
    assert truth is not None
    moved = truth.copy()
    moved[0, 3] += 5.0
    folder = tmp_path / "live"
    with posescope.record(folder, street, keep=1) as log:
        for name, pose, matches in (("good", truth, right), ("none", None, right), ("bad", moved, wrong)):
            log.query(
                query.photo,
                query.camera,
                pose,
                matches=matches,
                inliers=np.arange(8),
                reference="62",
                truth=truth,
                name=name,
            )
        log.query(query.photo, query.camera, truth, truth=truth, name="without")
    run = posescope.Run.open(folder)
    rows = [(row["query"], row["method"], row["grade"]) for row in run.rows()]
    assert rows[:4] == [
        ("good", "live", "right"),
        ("good", "fb", "right"),
        ("none", "live", "no pose"),
        ("none", "fb", "right"),
    ]
    assert [row[:2] for row in rows[4:]] == [
        ("bad", "live"),
        ("bad", "fb"),
        ("without", "live"),
        ("without", "fb"),
    ]
    assert rows[4][2] == "wrong" and rows[5][2] != "right"
    assert run.rows()[5]["diagnosis"][0]["code"].startswith("R")
    assert sorted(file.name for file in (folder / "failures").iterdir()) == ["bad-fb.rrd", "bad-live.rrd"]
    # The command reads the same matches from the folder.
    stored = np.loadtxt(folder / "matches" / "good_000062_matches.txt", np.float32)
    assert np.array_equal(stored, np.hstack(right).astype(np.float32))
    inliers = np.loadtxt(folder / "inliers" / "good_000062_matches.txt", np.float32)
    assert np.array_equal(inliers, stored[:8])
    text = (folder / "run.toml").read_text()
    assert 'method = ["live", "fb"]' in text and f'matches = "{folder / "matches"}"' in text
    again = tmp_path / "again.jsonl"
    code = posescope.main(
        ["run", "street", "--query-scene", str(folder / "queries"), "--query", "good", "--reference", "62"]
        + ["--method", "fb", "--matches", str(folder / "matches"), "--json", str(again)]
    )
    assert code == 0
    assert json.loads(again.read_text())["pose"] == run.rows()[1]["pose"]


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
            log.query(query.photo, query.camera, query.truth, name="a\\b")
        with pytest.raises(posescope.InputError, match="900"):
            log.query(query.photo, query.camera, query.truth, reference="900")
        points = np.zeros((3, 2))
        for matches, inliers, words in (
            ((points, points[:2]), None, "as many query points"),
            ((points,), None, "1 parts given"),
            ((points, points), [9], "inliers: "),
            ((points, points), [0.5], "inliers: booleans or positions"),
            (None, [True], "matches: "),
        ):
            with pytest.raises(ValueError, match=words):
                log.query(
                    query.photo, query.camera, query.truth, matches=matches, inliers=inliers, reference="62"
                )
        log.query(query.photo, query.camera, query.truth, name="a")
        with pytest.raises(ValueError, match="new name"):
            log.query(query.photo, query.camera, query.truth, name="a")
    with pytest.raises(RuntimeError, match="closed"):
        log.query(query.photo, query.camera, query.truth)
    with pytest.raises(ValueError, match="method of posescope"):
        posescope.record(tmp_path / "other", street, name="fb")
