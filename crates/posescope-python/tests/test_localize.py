"""Localising: results, failures, wrong arguments."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import posescope


@pytest.fixture(scope="module")
def right(street: posescope.Scene) -> posescope.Result:
    return posescope.localize(street.query("70"), street.reference("62"), method="fb")


def test_a_result_has_a_pose_that_is_graded(right: posescope.Result, street: posescope.Scene) -> None:
    truth = street.query("70").truth
    assert right.pose is not None and truth is not None and right.error is not None
    distance = np.linalg.norm(right.pose[:3, 3] - truth[:3, 3])
    assert right.grade == "right" and right.failure is None
    assert distance == pytest.approx(right.error.translation_m)
    assert right.confidence is not None and 0.0 < float(right.confidence) <= 1.0
    assert right.counts is not None and right.counts["inliers"] > 10
    assert (right.query, right.references, right.method) == ("000070", ["000062"], "fb")


def test_a_confidence_says_what_lowers_it(right: posescope.Result, street: posescope.Scene) -> None:
    assert right.confidence is not None and right.confidence.lowered_by == []
    far = posescope.localize(street.query("70"), street.reference("62"), method="fb", radius=40.0).confidence
    assert far is not None and [one["why"] for one in far.lowered_by] == ["radius"]
    assert far.lowered_by[0]["searched_m"] == 40.0 and float(far) < float(right.confidence)


def moved(pose: np.ndarray, freedom: int, by: float) -> np.ndarray:
    """The pose with one small error: about the camera's axes, or along them."""
    error = np.zeros(6)
    error[freedom] = by
    x, y, z = error[:3]
    small = np.eye(4)
    small[:3, :3] += [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    small[:3, 3] = error[3:]
    return pose @ small


def test_a_covariance_can_be_that_of_pycolmaps_pose(right: posescope.Result) -> None:
    assert right.pose is not None and right.confidence is not None
    own = right.covariance()
    assert own is not None and np.array_equal(own, right.confidence.covariance)
    # What each freedom does to cam_from_world: a rotation that is applied last, and what is added to the translation.
    stated, by = np.linalg.inv(right.pose), 1e-6
    columns = []
    for freedom in range(6):
        cam_from_world = np.linalg.inv(moved(right.pose, freedom, by))
        turn = cam_from_world[:3, :3] @ stated[:3, :3].T
        turned = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
        columns.append([*np.array(turned) / 2, *(cam_from_world[:3, 3] - stated[:3, 3])])
    moves = np.array(columns).T / by
    expected = moves @ own @ moves.T
    found = right.covariance(of="cam_from_world")
    assert found is not None
    assert np.allclose(found, expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())
    with pytest.raises(ValueError, match="cam_from_world expected"):
        right.covariance(of="map")


def test_no_pose_is_a_failure_and_no_exception(
    query: posescope.Query, reference: posescope.Reference
) -> None:
    result = posescope.localize(query, reference, method="fb")
    assert result.pose is None and result.confidence is None and result.grade == "no pose"
    assert result.covariance() is None
    assert result.failure is not None and result.failure.code == "R2"
    assert result.failure.numbers["query_keypoints"] == 0
    assert result.verdicts[0].code == "R2"


def test_two_black_photos_have_no_pose_by_any_method(
    query: posescope.Query, reference: posescope.Reference
) -> None:
    for method in posescope.methods():
        result = posescope.localize(query, reference, method=method, radius=2.0)
        assert result.method == method and result.grade in ("no pose", "unmeasured")


def test_parameters_are_those_of_the_command(street: posescope.Scene, right: posescope.Result) -> None:
    query, reference = street.query("70"), street.reference("62")
    other = posescope.localize(query, reference, method="fb", params={"fb.ratio": 0.7})
    assert other.counts != right.counts
    for wrong, words in [({"fb.rat": 1}, "fb.rat"), ({"fb.ratio": "x"}, "fb.ratio")]:
        with pytest.raises(ValueError, match=words):
            posescope.localize(query, reference, params=wrong)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"method": "sift"}, "sift"),
        ({"radius": 0.0}, "radius: a finite number above 0"),
        ({"radius": float("nan")}, "radius"),
        ({"threads": 0}, "threads"),
        ({"threads": 1 << 40}, "threads"),
        ({"fusion": "mean"}, "mean"),
    ],
)
def test_a_wrong_argument_is_named(
    wrong: dict, words: str, query: posescope.Query, reference: posescope.Reference
) -> None:
    with pytest.raises(ValueError, match=words):
        posescope.localize(query, reference, **wrong)


def test_a_seed_is_not_negative(query: posescope.Query, reference: posescope.Reference) -> None:
    with pytest.raises((ValueError, OverflowError)):
        posescope.localize(query, reference, seed=-1)
    with pytest.raises(ValueError, match="at least one expected"):
        posescope.localize(query, [])
    with pytest.raises(TypeError):
        posescope.localize(query, "62")  # type: ignore[arg-type]


def test_several_references_are_fused(street: posescope.Scene) -> None:
    references = [street.reference(name) for name in ("62", "64")]
    result = posescope.localize(street.query("70"), references, method="fb")
    assert result.to_dict()["fusion"] == "r-wavg"
    assert [one["references"] for one in result.per_reference] == [["000062"], ["000064"]]


def test_arrays_give_the_pose_of_the_scene(street: posescope.Scene, right: posescope.Result) -> None:
    query, reference = street.query("70"), street.reference("62")
    again = posescope.localize(
        posescope.Query(query.photo, query.camera, name=query.name, truth=query.truth),
        posescope.Reference(
            reference.photo,
            reference.camera,
            reference.world_from_camera,
            reference.cloud,
            name=reference.name,
        ),
        method="fb",
    )
    assert right.pose is not None and again.pose is not None
    assert np.allclose(again.pose, right.pose, atol=1e-9)
    assert again.grade == "right"


def test_references_of_the_same_name_are_told_apart(
    query: posescope.Query, reference: posescope.Reference
) -> None:
    result = posescope.localize(query, [reference, reference], method="fb")
    alone = [one["references"][0] for one in result.per_reference]
    assert alone == ["reference", "reference-2"]


def test_events_are_dicts_in_order(right: posescope.Result) -> None:
    events = right.events()
    assert [event["index"] for event in events] == list(range(len(events)))
    kinds = {event["kind"] for event in events}
    assert {"StageStarted", "FeaturesDetected", "PoseRefined"} <= kinds
    assert events[0]["query"] == "000070" and events[0]["method"] == "fb"


def test_a_recording_is_saved(right: posescope.Result, tmp_path: Path) -> None:
    right.save(tmp_path / "pair.rrd")
    assert (tmp_path / "pair.rrd").read_bytes()[:4] == b"RRF2"
    with pytest.raises(OSError, match="nowhere"):
        right.save(tmp_path / "nowhere" / "pair.rrd")


def test_a_result_shows_itself(right: posescope.Result) -> None:
    shown = right._repr_html_()
    assert "000070 fb" in shown and "data:image/jpeg;base64," in shown
    assert repr(right).startswith("<Result 000070 fb, ")
    assert json.loads(right.to_json()) == right.to_dict()


def test_files_that_are_missing_are_named(tmp_path: Path, street: posescope.Scene) -> None:
    missing = tmp_path / "missing"
    with pytest.raises(posescope.InputError) as raised:
        posescope.Scene.open(missing)
    assert raised.value.file == str(missing) and "no such file" in raised.value.expected
    with pytest.raises(posescope.InputError) as raised:
        street.query("999999")
    assert (raised.value.file, raised.value.place) == ("street:overcast", "frame 999999")
    with pytest.raises(posescope.InputError, match="night"):
        posescope.Scene.street("nonsense")


def test_nothing_prints_and_no_driver_is_loaded() -> None:
    code = """
import time, sys
start = time.perf_counter()
import posescope
took = time.perf_counter() - start
street = posescope.Scene.street()
posescope.localize(street.query("70"), street.reference("62"), method="fb")
maps = open("/proc/self/maps").read() if sys.platform == "linux" else ""
drivers = [name for name in ("vulkan", "libGL", "libEGL", "swrast", "gallium") if name in maps]
assert not drivers, drivers
"""
    environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    run = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert (run.stdout, run.stderr) == ("", "")


def test_the_viewer_of_notebooks_opens_or_says_how_to_install_it(right: posescope.Result) -> None:
    if importlib.util.find_spec("rerun_notebook"):
        assert right.show() is not None
    else:
        with pytest.raises(ImportError, match="pip install"):
            right.show()
