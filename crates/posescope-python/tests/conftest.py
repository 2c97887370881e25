"""Small worlds for the tests."""

from __future__ import annotations

from typing import Any, Tuple

import numpy as np
import pytest

import posescope


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "slow: takes minutes; run it with -m slow")


def pytest_collection_modifyitems(config: pytest.Config, items: "list[pytest.Item]") -> None:
    if not config.getoption("-m"):
        skip = pytest.mark.skip(reason="slow: run it with -m slow")
        for item in items:
            if item.get_closest_marker("slow"):
                item.add_marker(skip)


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


def surf_matches(query: posescope.Query, reference: posescope.Reference) -> Tuple[np.ndarray, np.ndarray]:
    """The accepted matches of SURF: points of the query, and of the reference."""
    events = posescope.localize(query, reference, method="fb").events()
    detected = {event["side"]: event for event in events if event["kind"] == "FeaturesDetected"}
    decided = next(event for event in events if event["kind"] == "MatchesDecided")
    points = {
        side: np.array([event["keypoints"]["x_px"], event["keypoints"]["y_px"]]).T
        if "keypoints" in event
        else np.array([event["x_px"], event["y_px"]]).T
        for side, event in detected.items()
    }
    matches: Any = decided.get("matches", decided)
    kept = [at for at, verdict in enumerate(matches["verdict"]) if "candidate" in str(verdict).lower()]
    of_query = np.array(matches["query_keypoint"])[kept]
    of_reference = np.array(matches["reference_keypoint"])[kept]
    return points["query"][of_query], points["reference"][of_reference]
