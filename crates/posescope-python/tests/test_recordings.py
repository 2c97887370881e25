"""Recordings survive: wrong arguments, queries that cannot be judged, kills, resuming, cameras, folders, arrays."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import Any, List

import numpy as np
import pytest

import posescope
from conftest import surf_matches

PUBLISHED = {"summary.json", "report.html", "junit.xml", "run.toml", "results.jsonl"}


def rows_of(folder: Path) -> List[dict]:
    return posescope.Run.open(folder).rows()


def command(*arguments: str) -> int:
    return posescope.main(["results", *arguments, "--as", "csv", "--out", os.devnull, "--quiet"])


def test_a_wrong_argument_raises_at_once_and_costs_nothing(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    night = posescope.Scene.street("night")
    bare = posescope.Query(query.photo, query.camera)
    camera, truth = query.camera, query.truth
    wrong: List[Any] = [
        ((query.photo, camera, truth), {"reference": []}, TypeError, "name of a frame"),
        ((query.photo, camera, truth), {"reference": True}, TypeError, "name of a frame"),
        ((query.photo, camera, truth), {"reference": 9999}, posescope.InputError, "9999"),
        ((query.photo, camera, truth), {"reference": night.reference("450")}, ValueError, "reference: "),
        ((query.photo, camera, truth), {"reference": bare.photo}, TypeError, "name of a frame"),
        ((query.photo, "camera", truth), {}, TypeError, "camera: "),
        ((query.photo, camera, "pose"), {}, ValueError, "world_from_camera: "),
        ((query.photo, camera, truth), {"truth": np.eye(3)}, ValueError, "truth: "),
        ((query.photo, camera, truth), {"time": float("nan")}, ValueError, "time: "),
        ((query.photo, camera, truth), {"time": "now"}, TypeError, "real number"),
        ((query.photo, camera, truth), {"name": 7}, TypeError, "name: "),
        ((query.photo, camera, truth), {"name": "../up"}, ValueError, "name: "),
        ((query.photo, camera, truth), {"name": "a b"}, ValueError, "name: "),
        ((query.photo, camera, truth), {"matches": 3, "reference": 62}, TypeError, "len"),
        ((None, camera, truth), {}, ValueError, "photo: "),
    ]
    with posescope.record(tmp_path / "live", street, keep=0) as log:
        log.query(query.photo, camera, truth, reference=62, name="before")
        for arguments, named, kind, words in wrong:
            with pytest.raises(kind, match=words):
                log.query(*arguments, **named)
        log.query(query.photo, camera, truth, reference=street.reference(62), name="after")
    assert PUBLISHED <= {file.name for file in (tmp_path / "live").iterdir()}
    rows = rows_of(tmp_path / "live")
    assert [(row["query"], row["references"]) for row in rows] == [("before", ["000062"]), ("after", ["000062"])]
    assert command(str(tmp_path / "live")) == 0


@pytest.mark.parametrize(
    "wrong",
    [
        {"name": "fb"},
        {"name": "Two Words"},
        {"keep": -1},
        {"waiting": 1.5},
        {"memory_mb": 0},
        {"radius": -1.0},
        {"right": "near"},
        {"right": (1.0,)},
        {"explain": -1},
    ],
)
def test_a_recording_refuses_at_once_what_it_cannot_do(wrong: dict, street: posescope.Scene, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        posescope.record(tmp_path / "live", street, **wrong)
    assert not (tmp_path / "live").exists()


def test_a_recording_without_queries_is_a_run(street: posescope.Scene, tmp_path: Path) -> None:
    with posescope.record(tmp_path / "live", street):
        pass
    run = posescope.Run.open(tmp_path / "live")
    assert run.rows() == [] and run.grades() == {} and run.results("list") == []
    assert PUBLISHED <= {file.name for file in run.path.iterdir()}


def test_a_query_that_cannot_be_judged_is_a_result(street: posescope.Scene, tmp_path: Path) -> None:
    command = ["synth", str(tmp_path), "--size", "half", "--every", "60", "--condition", "overcast", "-q"]
    assert posescope.main(command) == 0
    place = tmp_path / "sequences" / "overcast"
    scene = posescope.Scene.open(place)
    names = scene.frames
    queries = [scene.query(name) for name in names[:3]]
    # The scan of the second frame gets lost while the localiser runs.
    next((place / "velodyne").glob(f"{names[1]}*")).write_bytes(b"no scan")
    with posescope.record(tmp_path / "live", scene, keep=1) as log:
        for query in queries:
            log.query(query.photo, query.camera, query.truth, truth=query.truth, reference=query.name)
    rows = rows_of(tmp_path / "live")
    assert [row["grade"] for row in rows] == ["right"] * 3
    assert [one["code"] for one in rows[1]["diagnosis"]] == ["I1"] and "velodyne" in rows[1]["diagnosis"][0]["text"]
    assert rows[0]["diagnosis"] == [] and rows[2]["references"] == [names[2]]
    assert PUBLISHED <= {file.name for file in (tmp_path / "live").iterdir()}


def test_matches_of_some_queries_alone_are_a_run_too(street: posescope.Scene, tmp_path: Path) -> None:
    query, reference = street.query("70"), street.reference("62")
    matches = surf_matches(query, reference)
    with posescope.record(tmp_path / "live", street, keep=1) as log:
        for given in (None, matches, None):
            log.query(
                query.photo, query.camera, query.truth, matches=given, reference=reference, truth=query.truth
            )
    rows = rows_of(tmp_path / "live")
    assert [(row["query"], row["method"], row["grade"]) for row in rows] == [
        ("000000", "live", "right"),
        ("000000", "fb", "no pose"),
        ("000001", "live", "right"),
        ("000001", "fb", "right"),
        ("000002", "live", "right"),
        ("000002", "fb", "no pose"),
    ]
    assert "no matches of 000000" in rows[1]["reason"]["text"]
    assert command(str(tmp_path / "live")) == 0
    assert "live is right for 3 of 3 queries." in (tmp_path / "live" / "report.html").read_text()


@pytest.mark.filterwarnings("error")
def test_a_localiser_that_finds_nothing_is_recorded_like_any_other(
    street: posescope.Scene, tmp_path: Path
) -> None:
    query, none = street.query("70"), np.empty((0, 2), np.float32)
    with posescope.record(tmp_path / "live", street, name="mine") as log:
        log.query(
            query.photo, query.camera, None, matches=(none, none), reference="62", truth=query.truth, name="cam0/70"
        )
        with pytest.raises(ValueError, match="`cam0/70` is recorded already"):
            log.query(query.photo, query.camera, None, name="cam0/70")
    assert {row["method"]: row["grade"] for row in rows_of(tmp_path / "live")} == {"mine": "no pose", "fb": "no pose"}
    with pytest.raises(FileExistsError, match="resume=True"):
        posescope.record(tmp_path / "live", street, name="mine")


def test_cameras_folders_times_and_truth_are_stored(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    half = posescope.Camera(
        query.camera.fx, query.camera.fy, query.camera.cx - 100, query.camera.cy, query.camera.width - 100,
        query.camera.height,
    )
    folder = tmp_path / "live"
    with posescope.record(folder, street, name="mine", keep=2) as log:
        for camera, photo, at in ((query.camera, query.photo, 1.5), (half, query.photo[:, 100:], 2.25)):
            name = f"cam{int(at) - 1}/000070.jpg"
            log.query(photo, camera, query.truth, truth=query.truth, name=name, time=at, reference="62")
    run = posescope.Run.open(folder)
    rows = run.results("list")
    assert [row["query"] for row in rows] == ["cam0/000070.jpg", "cam1/000070.jpg"]
    assert [row["time_s"] for row in rows] == [1.5, 2.25]
    assert all(row["grade"] == "right" and row["error.forward_m"] == pytest.approx(0, abs=1e-9) for row in rows)
    tum = run.to_tum(tmp_path / "poses.tum").read_text().splitlines()
    assert [line.split()[0] for line in tum if not line.startswith("#")] == ["1.5", "2.25"]
    vloc = run.to_vloc(tmp_path / "poses.txt").read_text()
    assert vloc.startswith("cam0/000070.jpg ")
    images = (run.to_colmap(tmp_path / "model") / "images.txt").read_text()
    assert "cam1/000070.jpg" in images
    assert len(list((folder / "failures").iterdir())) == 2
    # The photos are a scene with all of it.
    photos = posescope.Scene.open(folder / "queries")
    saved = photos.query("cam1/000070.jpg")
    assert (saved.camera.width, saved.camera.cx) == (half.width, pytest.approx(half.cx))
    assert saved.truth is not None and np.allclose(saved.truth, query.truth, atol=1e-9)
    assert np.array_equal(saved.photo, query.photo[:, 100:])
    again = posescope.diagnose(saved, street.reference("62"), query.truth, name="mine")
    assert again.grade == "right" and again.to_dict()["query_scene"] == "photo"


def test_references_may_be_arrays(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    references = []
    for name in ("62", "78"):
        known = street.reference(name)
        references.append(
            posescope.Reference(
                known.photo, known.camera, known.world_from_camera, known.cloud, name=f"map/{name}"
            )
        )
    folder = tmp_path / "live"
    moved = np.array(query.truth)
    moved[:3, 3] += 5.0
    with posescope.record(folder, keep=1) as log:
        for reference, pose in ((references[0], query.truth), (references[1], moved), (references[0], query.truth)):
            log.query(query.photo, query.camera, pose, truth=query.truth, reference=reference)
        log.query(query.photo, query.camera, query.truth, truth=query.truth)
        log.query(query.photo, query.camera, query.truth, reference=street.reference("62"))
        with pytest.raises(TypeError, match="no scene"):
            log.query(query.photo, query.camera, query.truth, reference="62")
        other = posescope.Reference(query.photo, query.camera, np.eye(4), np.ones((9, 3)), name="map/62")
        with pytest.raises(ValueError, match="a name of its own"):
            log.query(query.photo, query.camera, query.truth, reference=other)
    rows = rows_of(folder)
    assert [row["references"] for row in rows] == [["map/62"], ["map/78"], ["map/62"], [], ["000062"]]
    assert [row["grade"] for row in rows] == ["right", "wrong", "right", "right", "unmeasured"]
    assert {row["scene"] for row in rows} == {"arrays"}
    assert [file.name for file in (folder / "failures").iterdir()] == ["000001-live.rrd"]
    saved = posescope.Scene.open(folder / "references")
    assert saved.frames == ["map/62", "map/78", "000062"]
    assert np.allclose(saved.reference("map/62").cloud, references[0].cloud, atol=1e-6)
    # As if the process had been killed before the last verdicts: they are made of what was saved.
    lines = (folder / "results.jsonl").read_text().splitlines(keepends=True)
    (folder / "results.jsonl").write_text("".join(lines[:1]))
    posescope.record(folder, resume=True).close()
    assert (folder / "results.jsonl").read_text().splitlines(keepends=True) == lines
    assert command(str(folder)) == 0
    assert (folder / "report.html").read_text().count("data:image/jpeg") > 4


def test_a_full_memory_drops_photos_and_keeps_poses(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    with posescope.record(tmp_path / "live", street, keep=0, memory_mb=1.5 * query.photo.nbytes / 1e6) as log:
        for _ in range(6):
            log.query(query.photo, query.camera, query.truth)
    rows = rows_of(tmp_path / "live")
    photos = list((tmp_path / "live" / "queries" / "photos").iterdir())
    assert len(rows) == 6 and all(row["pose"] is not None for row in rows)
    assert log.skipped == 6 - len(photos) > 0
    assert command(str(tmp_path / "live")) == 0


def test_a_recording_is_resumed_to_the_same_bytes(street: posescope.Scene, tmp_path: Path) -> None:
    query, reference = street.query("70"), street.reference("62")
    matches = surf_matches(query, reference)

    def log_all(log: posescope.Recording, first: int, last: int) -> None:
        for number in range(first, last):
            moved = np.array(query.truth)
            moved[0, 3] += 0.5 * number
            given = matches if number % 2 else None
            log.query(
                query.photo, query.camera, moved, truth=query.truth, matches=given, reference=62, time=number
            )

    with posescope.record(tmp_path / "whole", street, name="mine") as log:
        log_all(log, 0, 6)
    with posescope.record(tmp_path / "parts", street, name="mine") as log:
        log_all(log, 0, 3)
    # As if the process had been killed: the last result is torn, and nothing is published.
    results = tmp_path / "parts" / "results.jsonl"
    results.write_bytes(results.read_bytes()[:-30])
    for name in ("summary.json", "report.html", "junit.xml"):
        (tmp_path / "parts" / name).unlink()
    assert len(rows_of(tmp_path / "parts")) == 5
    for wrong in ({"name": "other"}, {"right": "9m,9deg"}, {"scene": posescope.Scene.street("night")}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            posescope.record(tmp_path / "parts", resume=True, **wrong)  # type: ignore[arg-type]
    with posescope.record(tmp_path / "parts", resume=True) as log:
        log_all(log, 3, 6)
    for name in ("results.jsonl", "poses.txt", "junit.xml", "queries/frames.jsonl"):
        whole, parts = (tmp_path / folder / name for folder in ("whole", "parts"))
        assert parts.read_bytes() == whole.read_bytes(), name
    failures = {file.name for file in (tmp_path / "whole" / "failures").iterdir()}
    assert {file.name for file in (tmp_path / "parts" / "failures").iterdir()} == failures


LOOP = """
import sys, time
import numpy as np
import posescope

street = posescope.Scene.street()
query, reference = street.query("70"), street.reference("62")
small = posescope.Camera(50, 50, 31.5, 23.5, 64, 48)
random = np.random.default_rng(0)
log = posescope.record(sys.argv[1], street, resume=True, keep=0)
print("recording", flush=True)
while True:
    log.query(random.integers(0, 256, (48, 64), np.uint8), small, query.truth, reference="62", truth=query.truth)
    time.sleep(0.002)
"""


def lines_of(file: Path) -> List[bytes]:
    content = file.read_bytes() if file.exists() else b""
    return content[: content.rfind(b"\n") + 1].splitlines()


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL")
@pytest.mark.parametrize("rounds", [3, pytest.param(10, marks=pytest.mark.slow)])
def test_after_a_kill_no_result_is_lost(rounds: int, tmp_path: Path) -> None:
    folder = tmp_path / "live"
    before: List[bytes] = []
    chance = random.Random(0)
    for _ in range(rounds):
        process = subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(LOOP), str(folder)], stdout=subprocess.PIPE
        )
        assert process.stdout is not None and process.stdout.readline() == b"recording\n"
        # A slow machine takes long to judge a query: the kill comes some time after a result was made.
        ends = time.monotonic() + 300.0
        while len(lines_of(folder / "results.jsonl")) <= len(before):
            assert process.poll() is None and time.monotonic() < ends, "no result is made"
            time.sleep(0.05)
        time.sleep(chance.uniform(0.0, 1.5))
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        results = lines_of(folder / "results.jsonl")
        # What was there is there, and the command reads the run as it is.
        assert results[: len(before)] == before and len(results) > len(before)
        assert len(posescope.Run.open(folder).rows()) == len(results)
        assert command(str(folder)) == 0
        before = results
    frames = [json.loads(line)["name"] for line in lines_of(folder / "queries" / "frames.jsonl")[1:]]
    run = posescope.record(folder, resume=True, keep=0).close()
    rows = run.rows()
    assert lines_of(folder / "results.jsonl")[: len(before)] == before
    assert [row["query"] for row in rows] == frames and len(rows) >= len(before)
    assert run.summary()["groups"] and PUBLISHED <= {file.name for file in folder.iterdir()}


def test_a_recording_can_be_evaluated_again(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    with posescope.record(tmp_path / "live", street, name="mine", keep=0) as log:
        for name in ("cam0/1", "cam1/1"):
            log.query(query.photo, query.camera, query.truth, truth=query.truth, reference=62, name=name)
    again = posescope.evaluate(
        street,
        tmp_path / "again",
        query_scene=tmp_path / "live" / "queries",
        estimates=f"mine={tmp_path / 'live' / 'poses.txt'}",
        method=["mine", "fb"],
        references=[62],
        keep_failures=0,
    )
    rows = [(row["query"], row["method"], row["grade"], row["references"]) for row in again.rows()]
    assert rows == [
        (query, method, "right", ["000062"]) for query in ("cam0/1", "cam1/1") for method in ("fb", "mine")
    ]


def test_two_processes_do_not_record_into_one_folder(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    with posescope.record(tmp_path / "live", street, keep=0) as log:
        log.query(query.photo, query.camera, query.truth)
        with pytest.raises(FileExistsError):
            posescope.record(tmp_path / "live", street)
        with pytest.raises(FileExistsError, match="another process"):
            posescope.record(tmp_path / "live", street, resume=True)
    assert len(rows_of(tmp_path / "live")) == 1


def test_what_is_right_is_the_users_to_say(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    moved = np.array(query.truth)
    moved[0, 3] += 0.5
    grades = {}
    for right in (None, (0.25, 2.0)):
        folder = tmp_path / str(right)
        with posescope.record(folder, street, keep=0, right=right, radius=10) as log:
            log.query(query.photo, query.camera, moved, truth=query.truth)
        grades[right] = rows_of(folder)[0]["grade"]
        assert "radius = [10.0]" in (folder / "run.toml").read_text()
    assert grades == {None: "right", (0.25, 2.0): "wrong"}


def test_gates_hold_for_recorded_runs(street: posescope.Scene, tmp_path: Path) -> None:
    query = street.query("70")
    with posescope.record(tmp_path / "live", street, name="mine", keep=0) as log:
        log.query(query.photo, query.camera, query.truth, truth=query.truth)
        log.query(query.photo, query.camera, None, truth=query.truth)
    run = posescope.Run.open(tmp_path / "live")
    run.gate("right@mine >= 0.5")
    with pytest.raises(posescope.GateError, match="right@mine") as raised:
        run.gate("right@mine >= 0.9", "median_m@mine <= 1")
    assert raised.value.run.path == run.path
    assert [one["passed"] for one in run.summary()["gates"]] == [False, True]
    with pytest.raises(ValueError, match="from 0 to 1"):
        run.gate("right@mine >= 2")
