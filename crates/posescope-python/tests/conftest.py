"""Small worlds for the tests."""

from __future__ import annotations

import numpy as np
import pytest

import posescope


@pytest.fixture(scope="session")
def street() -> posescope.Scene:
    return posescope.Scene.street()


@pytest.fixture(scope="session")
def camera() -> posescope.Camera:
    return posescope.Camera(fx=50.0, fy=50.0, cx=31.5, cy=23.5, width=64, height=48)


@pytest.fixture(scope="session")
def reference(camera: posescope.Camera) -> posescope.Reference:
    cloud = np.array([[0.0, 0.0, 9.0], [1.0, 0.0, 9.0]])
    return posescope.Reference(np.zeros((48, 64), np.uint8), camera, np.eye(4), cloud)


@pytest.fixture(scope="session")
def query(camera: posescope.Camera) -> posescope.Query:
    return posescope.Query(np.zeros((48, 64), np.uint8), camera)
