"""Values travel: between processes, into files, and as copies."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
from pathlib import Path
from typing import Any, Callable, List

import numpy as np
import pytest
from conftest import surf_matches

import posescope

WAYS: List[Callable[[Any], Any]] = [copy.copy, copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))]


@pytest.fixture(params=WAYS, ids=["copy", "deepcopy", "pickle"])
def travelled(request: pytest.FixtureRequest) -> Callable[[Any], Any]:
    way: Callable[[Any], Any] = request.param
    return way


def test_cameras_are_equal_and_in_sets(travelled: Callable[[Any], Any]) -> None:
    for center in (0.0, 0.5):
        camera = posescope.Camera(500.1, 499.7, 320.3, 240.9, 640, 480, center)
        there = travelled(camera)
        assert there == camera and hash(there) == hash(camera) and repr(there) == repr(camera)
        assert len({camera, there}) == 1
    assert posescope.Camera(1, 1, 0.0, 0, 9, 9) == posescope.Camera(1, 1, -0.0, 0, 9, 9)
    assert hash(posescope.Camera(1, 1, 0.0, 0, 9, 9)) == hash(posescope.Camera(1, 1, -0.0, 0, 9, 9))


def test_queries_and_references_of_arrays_keep_every_number(
    street: posescope.Scene, travelled: Callable[[Any], Any]
) -> None:
    known = street.query("70")
    query = posescope.Query(known.photo, known.camera, "mine", known.truth)
    of_scene = street.reference("62")
    world_from_camera = of_scene.world_from_camera
    reference = posescope.Reference(
        of_scene.photo, of_scene.camera, world_from_camera, of_scene.cloud, name="yours"
    )
    for value, names in (
        (query, ("name", "camera", "photo", "truth")),
        (reference, ("name", "camera", "photo", "world_from_camera", "cloud")),
    ):
        there = travelled(value)
        assert repr(there) == repr(value)
        for name in names:
            ours, theirs = getattr(value, name), getattr(there, name)
            assert np.array_equal(ours, theirs) if isinstance(ours, np.ndarray) else ours == theirs, name
    unknown = travelled(posescope.Query(known.photo, known.camera))
    assert unknown.truth is None


def test_frames_of_a_scene_come_back_as_frames_of_one_scene(
    street: posescope.Scene, travelled: Callable[[Any], Any]
) -> None:
    assert travelled(street).path == street.path and travelled(street).frames == street.frames
    query, references = street.query("70"), [street.reference("62"), street.reference("78")]
    asked = travelled((query, references))
    ours = posescope.localize(query, references, method="fb")
    theirs = posescope.localize(*asked, method="fb")
    assert theirs.to_json() == ours.to_json()
    assert len(pickle.dumps(query)) < 1000


def test_a_result_is_the_same_there(street: posescope.Scene, travelled: Callable[[Any], Any]) -> None:
    query, reference = street.query("70"), street.reference("62")
    matches = surf_matches(query, reference)
    wrong = np.array(query.truth)
    wrong[0, 3] += 5.0
    for result in (
        posescope.localize(query, reference, method="mi", params={"mi.bins": 16}, seed=3),
        posescope.localize(query, reference, matches=matches),
        posescope.diagnose(query, reference, wrong, matches=matches, name="mine"),
    ):
        there = travelled(result)
        assert there.to_json() == result.to_json() and there.seconds == result.seconds
        assert (there.headline, there.paragraphs) == (result.headline, result.paragraphs)
        assert there.proof() == result.proof()
        assert there.events() == result.events()
        assert (there.from_matches is None) == (result.from_matches is None)
        if there.from_matches is not None and result.from_matches is not None:
            assert there.from_matches.to_json() == result.from_matches.to_json()


def test_what_the_caller_changes_later_changes_no_result(street: posescope.Scene) -> None:
    query, reference = street.query("70"), street.reference("62")
    matches = surf_matches(query, reference)
    result = posescope.localize(query, reference, matches=matches)
    matches[0][:] = 0.0
    there = pickle.loads(pickle.dumps(result))
    assert there.events() == result.events()


def test_small_values_travel(street: posescope.Scene, travelled: Callable[[Any], Any]) -> None:
    result = posescope.localize(street.query("70"), street.reference("62"), method="fb")
    for value in (result.error, result.confidence, *result.verdicts):
        assert travelled(value) == value
    for error in (posescope.InputError("a", "line 3", "b"), posescope.InternalError("c")):
        there = travelled(error)
        assert (type(there), str(there), there.args) == (type(error), str(error), error.args)


def _localized(name: str) -> posescope.Result:
    street = posescope.Scene.street()
    return posescope.localize(street.query(name), street.reference("62"), method="fb")


def _fails(folder: str) -> posescope.Run:
    return posescope.evaluate(
        "street", folder, limit=1, method="fb", gate=["right@fb > 1"], progress=False
    )


def test_a_pool_returns_results_and_raises_gates(street: posescope.Scene, tmp_path: Path) -> None:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply_async(_localized, ("70",)).get(120)
        here = posescope.localize(street.query("70"), street.reference("62"), method="fb")
        assert there.to_json() == here.to_json()
        with pytest.raises(posescope.GateError) as raised:
            pool.apply_async(_fails, (str(tmp_path / "run"),)).get(120)
    assert raised.value.run.path == tmp_path / "run" and str(raised.value)
