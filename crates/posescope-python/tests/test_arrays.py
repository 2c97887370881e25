"""Arrays in: any strides, and errors that name shape and dtype."""

from __future__ import annotations

import numpy as np
import pytest

import posescope

PHOTO = np.arange(48 * 64, dtype=np.uint8).reshape(48, 64)


@pytest.mark.parametrize(
    "photo",
    [
        PHOTO,
        np.asfortranarray(PHOTO),
        np.repeat(np.repeat(PHOTO, 2, 0), 2, 1)[::2, ::2],
        PHOTO[::-1, ::-1][::-1, ::-1],
        PHOTO.tolist() and np.array(PHOTO.tolist(), np.uint8),
    ],
)
def test_a_photo_may_have_any_strides(photo: np.ndarray, camera: posescope.Camera) -> None:
    assert np.array_equal(posescope.Query(photo, camera).photo, PHOTO)


def test_colours_keep_their_order(camera: posescope.Camera) -> None:
    photo = np.zeros((48, 64, 3), np.uint8)
    photo[..., 0] = 200
    query = posescope.Query(photo[:, ::-1], camera)
    assert np.array_equal(query.photo, photo)
    read_only = photo.copy()
    read_only.flags.writeable = False
    assert posescope.Query(read_only, camera).photo.shape == (48, 64, 3)


def test_the_centre_of_a_pixel_is_where_it_is_said_to_be() -> None:
    ours = posescope.Camera(50, 50, 31.5, 23.5, 64, 48)
    colmap = posescope.Camera(50, 50, 32.0, 24.0, 64, 48, pixel_center=0.5)
    photo = np.zeros((48, 64), np.uint8)
    assert (colmap.cx, colmap.cy) == (32.0, 24.0)
    assert posescope.Query(photo, colmap).camera == ours


@pytest.mark.parametrize(
    ("photo", "words"),
    [
        (PHOTO.astype(np.float32), "photo: uint8 of shape (H, W) or (H, W, 3) expected, float32 of shape (48, 64)"),
        (np.zeros((48, 64, 4), np.uint8), "uint8 of shape (48, 64, 4) given"),
        (np.zeros(48 * 64, np.uint8), "uint8 of shape (3072) given"),
        (np.zeros((47, 64), np.uint8), "64x47 px, its camera 64x48"),
        (np.zeros((0, 64), np.uint8), "64x0 px"),
        (np.broadcast_to(np.uint8(0), (1 << 20, 1 << 20)), "shape (1048576, 1048576)"),
        ("a photo", "photo: uint8"),
        (None, "photo: uint8"),
    ],
)
def test_a_wrong_photo_is_named_with_dtype_and_shape(
    photo: object, words: str, camera: posescope.Camera
) -> None:
    with pytest.raises(ValueError) as raised:
        posescope.Query(photo, camera)  # type: ignore[arg-type]
    assert words in str(raised.value)


@pytest.mark.parametrize(
    "cloud",
    [
        np.ones((7, 3), np.float32),
        np.ones((7, 3), np.float64),
        np.asfortranarray(np.ones((7, 3))),
        np.ones((7, 6))[:, ::-2],
        np.ones((7, 3), ">f8"),
    ],
)
def test_a_cloud_is_float32_or_float64(cloud: np.ndarray, camera: posescope.Camera) -> None:
    reference = posescope.Reference(PHOTO, camera, np.eye(4), cloud)
    assert np.array_equal(reference.cloud, np.ones((7, 3), np.float32))


def test_points_that_are_not_finite_are_left_out(camera: posescope.Camera) -> None:
    cloud = np.array([[0, 0, 1], [np.nan, 0, 1], [np.inf, 0, 1], [0, 0, 1e300], [0, 0, 2]])
    reference = posescope.Reference(PHOTO, camera, np.eye(4), cloud)
    assert np.array_equal(reference.cloud, np.array([[0, 0, 1], [0, 0, 2]], np.float32))
    empty = posescope.Reference(PHOTO, camera, np.eye(4), np.zeros((0, 3)))
    assert empty.cloud.shape == (0, 3)


def test_a_cloud_may_be_in_the_world(camera: posescope.Camera) -> None:
    pose = np.eye(4)
    pose[:3, 3] = [4.0e5, 5.0e6, 100.0]
    cloud = np.array([[4.0e5 + 0.25, 5.0e6, 109.0]])
    reference = posescope.Reference(PHOTO, camera, pose, cloud, cloud_frame="world")
    assert np.array_equal(reference.cloud, np.array([[0.25, 0.0, 9.0]], np.float32))
    with pytest.raises(ValueError, match="`camera` or `world` expected, `map` given"):
        posescope.Reference(PHOTO, camera, pose, cloud, cloud_frame="map")


@pytest.mark.parametrize(
    ("cloud", "words"),
    [
        (np.ones((3, 7)), "cloud: float32 or float64 of shape (N, 3) or (N, 4) expected, float64 of shape (3, 7) given"),
        (np.ones((7, 3), np.int32), "int32 of shape (7, 3) given"),
        (np.ones((7, 3), np.float16), "float16 of shape (7, 3) given"),
        (np.ones((7, 3), complex), "complex128 of shape (7, 3) given"),
        (np.ones((7, 3), object), "object of shape (7, 3) given"),
    ],
)
def test_a_wrong_cloud_is_named_with_dtype_and_shape(
    cloud: np.ndarray, words: str, camera: posescope.Camera
) -> None:
    with pytest.raises(ValueError) as raised:
        posescope.Reference(PHOTO, camera, np.eye(4), cloud)
    assert words in str(raised.value)


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        (np.eye(3), "world_from_camera: numbers of shape (4, 4)"),
        (2 * np.eye(4), "the last row 0 0 0 1 expected"),
        (np.diag([1.0, 1.0, 2.0, 1.0]), "not a rotation"),
        (np.full((4, 4), np.nan), "the last row"),
        (np.diag([np.nan, 1.0, 1.0, 1.0]), "not a finite number"),
        (np.eye(4, dtype=complex), "complex128 of shape (4, 4) given"),
    ],
)
def test_what_is_no_pose_is_refused(pose: np.ndarray, words: str, camera: posescope.Camera) -> None:
    with pytest.raises(ValueError) as raised:
        posescope.Reference(PHOTO, camera, pose, np.zeros((0, 3)))
    assert words in str(raised.value)


@pytest.mark.parametrize("wrong", [{"fx": 0}, {"fy": np.nan}, {"cx": np.inf}, {"width": 0}])
def test_no_camera_is_like_that(wrong: dict) -> None:
    with pytest.raises(ValueError, match="Camera: "):
        posescope.Camera(**{**dict(fx=1, fy=1, cx=0, cy=0, width=2, height=2), **wrong})
