"""What pycolmap, OpenCV and users give is taken, or refused with the remedy. The classes here stand for theirs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, List

import numpy as np
import pytest

import posescope
from conftest import surf_matches


class Model(Enum):
    PINHOLE = 1
    SIMPLE_PINHOLE = 0
    SIMPLE_RADIAL = 2
    OPENCV = 4


@dataclass
class ColmapCamera:
    """As pycolmap.Camera."""

    model: Any
    width: int
    height: int
    params: Any


@dataclass
class Rigid3d:
    """As pycolmap.Rigid3d."""

    rotation: Any
    translation: Any

    def matrix(self) -> np.ndarray:
        return np.hstack([self.rotation, np.reshape(self.translation, (3, 1))])


@dataclass
class ColmapImage:
    """As pycolmap.Image."""

    pose: Rigid3d

    def cam_from_world(self) -> Rigid3d:
        return self.pose


@dataclass
class KeyPoint:
    """As cv2.KeyPoint."""

    pt: Any


@dataclass
class DMatch:
    """As cv2.DMatch."""

    queryIdx: int
    trainIdx: int
    distance: float


def test_a_camera_of_pycolmap_is_a_camera(street: posescope.Scene) -> None:
    photo = np.zeros((48, 64), np.uint8)
    ours = posescope.Camera(50, 50, 31.5, 23.5, 64, 48)
    for camera in (
        ColmapCamera(Model.PINHOLE, 64, 48, [50.0, 50.0, 32.0, 24.0]),
        ColmapCamera(Model.SIMPLE_PINHOLE, 64, 48, np.array([50.0, 32.0, 24.0])),
        ColmapCamera("OPENCV", 64, 48, [50.0, 50.0, 32.0, 24.0, 0, 0, 0, 0]),
        {"model": "SIMPLE_RADIAL", "width": 64, "height": 48, "params": [50.0, 32.0, 24.0, 0.0]},
    ):
        assert posescope.Query(photo, camera).camera == ours
        assert posescope.Reference(photo, camera, np.eye(4), np.ones((1, 3))).camera == ours
    radial = ColmapCamera(Model.SIMPLE_RADIAL, 64, 48, [50.0, 32.0, 24.0, 0.01])
    with pytest.raises(ValueError, match=r"SIMPLE_RADIAL with \[0.01\] given; undistort"):
        posescope.Query(photo, radial)
    with pytest.raises(ValueError, match="THIN_PRISM_FISHEYE with 12 parameters"):
        posescope.Query(photo, ColmapCamera("THIN_PRISM_FISHEYE", 64, 48, [1.0] * 12))
    with pytest.raises(ValueError, match="SIMPLE_RADIAL; give the pycolmap.Camera itself"):
        posescope.Camera(*radial.params, radial.width, radial.height)  # type: ignore[misc]

    class Camera:
        pass

    with pytest.raises(TypeError, match=r"posescope.Camera or pycolmap.Camera expected, .*Camera given"):
        posescope.Query(photo, Camera())


def test_poses_of_pycolmap_are_poses(street: posescope.Scene) -> None:
    query, reference = street.query(70), street.reference(62)
    truth = np.array(query.truth)
    inverse = np.linalg.inv(truth)
    camera_from_world = Rigid3d(inverse[:3, :3], inverse[:3, 3])
    given: List[Any] = [
        Rigid3d(truth[:3, :3], truth[:3, 3]),
        ColmapImage(camera_from_world),
        {"cam_from_world": camera_from_world, "num_inliers": 7},
    ]
    for pose in given:
        result = posescope.diagnose(query, reference, pose)
        assert result.error is not None and result.error.translation_m < 1e-6
        assert result.to_json() and result.grade == "right"
    by_image = posescope.Reference(
        reference.photo, reference.camera, ColmapImage(camera_from_world), reference.cloud
    )
    assert np.allclose(by_image.world_from_camera, truth)


def test_a_reconstruction_of_pycolmap_is_a_scene(tmp_path: Path) -> None:
    assert posescope.main(["synth", str(tmp_path), "--layout", "colmap", "--size", "half", "--every", "80", "-q"]) == 0
    place = next(path.parent for path in tmp_path.rglob("images") if path.is_dir())
    model = next(path.parent for path in place.rglob("cameras.txt"))

    class Reconstruction:
        def write_text(self, path: str) -> None:
            for file in model.glob("*.txt"):
                (Path(path) / file.name).write_bytes(file.read_bytes())

    scene = posescope.Scene.open(Reconstruction(), images=place / "images")
    assert scene.frames == posescope.Scene.open(place).frames and len(scene) > 1
    assert scene.reference(scene.frames[0]).cloud.shape[1] == 3
    with pytest.raises(ValueError, match="images: "):
        posescope.Scene.open(Reconstruction())


def test_keypoints_and_matches_of_opencv_are_matches(street: posescope.Scene) -> None:
    query, reference = street.query("70"), street.reference("62")
    points, others = surf_matches(query, reference)
    plain = posescope.localize(query, reference, matches=(points, others))
    # All keypoints, in another order, with matches among them.
    order = np.arange(len(points))[::-1]
    keypoints = [KeyPoint(tuple(point)) for point in points.tolist()]
    matches = [DMatch(int(at), int(len(order) - 1 - at), 0.5) for at in range(len(points))]
    shuffled = [KeyPoint(tuple(point)) for point in others[order].tolist()]
    for given in (
        (keypoints, shuffled, matches),
        (keypoints, shuffled, [(match, DMatch(0, 0, 9.0)) for match in matches]),
        (points, others[order], np.stack([np.arange(len(points)), order], axis=1)),
    ):
        result = posescope.localize(query, reference, matches=given)
        assert result.to_json() == plain.to_json()
    none = posescope.localize(query, reference, matches=(keypoints, shuffled, []))
    assert none.pose is None and none.failure is not None
    with pytest.raises(ValueError, match=r"matches\[2\]: positions below"):
        posescope.localize(query, reference, matches=(keypoints, shuffled, [DMatch(0, 9999, 0.1)]))


def test_the_inlier_mask_is_in_the_order_of_the_given_matches(street: posescope.Scene) -> None:
    query, references = street.query("70"), [street.reference("62"), street.reference("66")]
    points, others = surf_matches(query, references[0])
    random = np.random.default_rng(0)
    order = random.permutation(len(points) + 5)
    # Five false matches among the true ones; better scores come last.
    all_points = np.vstack([points, random.uniform(0, 90, (5, 2))])[order]
    all_others = np.vstack([others, random.uniform(0, 90, (5, 2))])[order]
    scores = np.linspace(0, 1, len(order))
    result = posescope.localize(query, references[0], matches=(all_points, all_others, scores))
    mask = result.inlier_mask()
    assert isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (len(order),)
    assert result.counts is not None and mask.sum() == result.counts["inliers"]
    assert not mask[order >= len(points)].any()
    fused = posescope.localize(
        query, references, matches=[(all_points, all_others, scores), surf_matches(query, references[1])]
    )
    masks = fused.inlier_mask()
    assert isinstance(masks, list) and np.array_equal(masks[0], mask)
    assert fused.counts is not None and fused.counts["inliers"] == sum(int(one.sum()) for one in masks)
    assert posescope.localize(query, references[0], method="fb").inlier_mask() is None


def test_clouds_may_have_a_fourth_column(street: posescope.Scene) -> None:
    known = street.reference("62")
    cloud = np.hstack([known.cloud, np.full((len(known.cloud), 1), 0.5, np.float32)])
    for one in (cloud, cloud.astype(np.float64), np.asfortranarray(cloud)):
        reference = posescope.Reference(known.photo, known.camera, known.world_from_camera, one)
        assert np.array_equal(reference.cloud, known.cloud)
    in_world = known.cloud @ known.world_from_camera[:3, :3].T + known.world_from_camera[:3, 3]
    homogeneous = np.hstack([in_world, np.ones((len(in_world), 1))])
    reference = posescope.Reference(
        known.photo, known.camera, known.world_from_camera, homogeneous, cloud_frame="world"
    )
    assert np.allclose(reference.cloud, known.cloud, atol=1e-4)


@pytest.mark.parametrize(
    ("photo", "words"),
    [
        (None, "None given; cv2.imread returns None where it finds no photo"),
        (Path("a.png"), "a path given; read the file first"),
        ("a.png", "a path given; read the file first"),
        (np.zeros((48, 64), np.float32), r"\(255 \* photo\).round\(\).astype\(numpy.uint8\)"),
        (np.zeros((48, 64, 4), np.uint8), r"photo\[..., :3\]"),
        (np.zeros((48, 64, 1), np.uint8), r"photo\[..., 0\]"),
    ],
)
def test_a_wrong_photo_is_refused_with_the_remedy(photo: Any, words: str, camera: posescope.Camera) -> None:
    with pytest.raises(ValueError, match=words):
        posescope.Query(photo, camera)


def test_frames_are_found_by_name_number_and_frame(street: posescope.Scene) -> None:
    names = [street.query(one).name for one in ("70", 70, np.int64(70), Path("000070"), street.reference(70))]
    assert names == ["000070"] * 5
    for wrong in (True, 7.0, None, [70]):
        with pytest.raises(TypeError, match="name: the name of a frame or its number expected"):
            street.query(wrong)
    with pytest.raises(posescope.InputError, match="999999"):
        street.reference(999999)


def test_right_radius_and_explain_are_those_of_the_command(street: posescope.Scene, tmp_path: Path) -> None:
    query, reference = street.query("70"), street.reference("62")
    moved = np.array(query.truth)
    moved[0, 3] += 0.5
    for right in ((0.25, 2.0), "0.25m,2deg"):
        assert posescope.diagnose(query, reference, moved, right=right).grade == "wrong"
        exact = posescope.localize(query, reference, method="fb", right=(1e-6, 1e-6))
        assert exact.grade == "wrong" and exact.explanation is None
    assert posescope.diagnose(query, reference, moved).grade == "right"
    near = posescope.localize(query, reference, method="mi", radius=2.0, explain=2)
    assert near.grade == "wrong" and near.explanation is not None
    assert near.explanation["runs"] == 2 and "helped" in near.explanation
    out = tmp_path / "near.jsonl"
    words = "run street --query 70 --reference 62 --method mi --radius 2 --explain 2 --quiet".split()
    assert posescope.main([*words, "--json", str(out)]) == 0
    assert near.to_json() + "\n" == out.read_text()
    assert posescope.diagnose(query, reference, query.truth, radius=2.0).grade == "right"
    for wrong, kind in (({"right": "near"}, ValueError), ({"right": 1.0}, TypeError), ({"radius": 0}, ValueError)):
        with pytest.raises(kind, match=next(iter(wrong))):
            posescope.diagnose(query, reference, moved, **wrong)  # type: ignore[arg-type]
