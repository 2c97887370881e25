"""A thousand random arguments: nothing crashes, and only documented exceptions are raised."""

from __future__ import annotations

import collections
from pathlib import Path
from typing import Any, Callable, List

import numpy as np

import posescope

DOCUMENTED = (ValueError, TypeError, OverflowError, posescope.InputError)
SIZE = (24, 32)


class Draw:
    """Draws arguments, right and wrong ones."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)

    def of(self, choices: List[Callable[[], Any]]) -> Any:
        return choices[self.random.integers(len(choices))]()

    def mostly(self, choices: List[Callable[[], Any]]) -> Any:
        """Mostly what is right."""
        return self.of(choices) if self.random.random() < 0.9 else self.garbage()

    def strided(self, array: np.ndarray) -> np.ndarray:
        """The same elements in another order in memory."""
        flipped = array[::-1]
        wide = np.repeat(array, 2, axis=0)[::2]
        frozen = array.copy()
        frozen.flags.writeable = False
        return self.of(
            [lambda: array, lambda: np.asfortranarray(array), lambda: flipped, lambda: wide, lambda: frozen]
        )

    def garbage(self) -> Any:
        random = self.random
        shape = tuple(int(side) for side in random.integers(0, 5, random.integers(0, 4)))
        dtypes = ["u1", "i8", "f2", "f4", "f8", ">f8", "c16", "b1", "O", "U3", "M8[s]"]
        return self.of(
            [
                lambda: None,
                lambda: "text",
                lambda: {},
                lambda: -1,
                lambda: float("nan"),
                lambda: [[1, 2], [3]],
                lambda: np.zeros(shape, dtypes[random.integers(len(dtypes))]),
                lambda: np.full(shape, np.nan),
                lambda: np.broadcast_to(np.uint8(1), (1 << 20, 1 << 20)),
                lambda: np.broadcast_to(np.float32(1), (1 << 40, 3)),
            ]
        )

    def photo(self) -> Any:
        pixels = self.random.integers(0, 256, (*SIZE, 3), np.uint8)
        return self.mostly([lambda: self.strided(pixels), lambda: self.strided(pixels[..., 0])])

    def cloud(self) -> Any:
        points = self.random.normal(0, 5, (40, 3)) + [0, 0, 9]
        holes = np.where(self.random.random((40, 3)) < 0.1, np.nan, points)
        return self.mostly(
            [
                lambda: self.strided(points),
                lambda: self.strided(holes.astype(np.float32)),
                lambda: np.zeros((0, 3)),
                lambda: points * 1e300,
            ]
        )

    def pose(self) -> Any:
        angle = self.random.normal()
        pose = np.eye(4)
        pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        pose[:3, 3] = self.random.normal(0, 3, 3)
        return self.mostly([lambda: pose, lambda: np.asfortranarray(pose), lambda: pose[:3]])

    def matches(self) -> Any:
        count = int(self.random.integers(0, 9))
        points = self.random.uniform(-5, 40, (2, count, 2))
        return self.of(
            [
                lambda: None,
                lambda: (points[0], points[1]),
                lambda: (points[0], points[1], self.random.random(count)),
                lambda: (points[0], points[1][1:]),
                lambda: (self.garbage(), self.garbage()),
                lambda: (lambda query, reference: (points[0], points[1])),
                self.garbage,
            ]
        )


def attempt(draw: Draw) -> str:
    number = lambda right: right if draw.random.random() < 0.97 else draw.garbage()  # noqa: E731
    camera = posescope.Camera(number(30.0), number(30.0), 15.5, 11.5, number(SIZE[1]), number(SIZE[0]))
    query = posescope.Query(draw.photo(), camera, truth=draw.mostly([lambda: None, draw.pose]))
    frame = draw.mostly([lambda: "camera", lambda: "world"])
    reference = posescope.Reference(draw.photo(), camera, draw.pose(), draw.cloud(), cloud_frame=frame)
    matches = draw.matches()
    if draw.random.random() < 0.3:
        return posescope.diagnose(query, reference, draw.pose(), truth=None, matches=matches).grade
    method = draw.mostly([lambda: None, lambda: "fb", lambda: "hy", lambda: "mi"])
    radius = draw.mostly([lambda: 2.0, lambda: 1.0])
    return posescope.localize(query, reference, method, radius=radius, matches=matches, threads=1).grade


def test_a_thousand_random_arguments_crash_nothing() -> None:
    seen: "collections.Counter[str]" = collections.Counter()
    for seed in range(1000):
        try:
            seen[attempt(Draw(seed))] += 1
        except DOCUMENTED as error:
            seen[type(error).__name__] += 1
    # Some of each went through, or the test tests nothing.
    assert seen["ValueError"] > 100
    assert seen["no pose"] + seen["unmeasured"] + seen["wrong"] + seen["right"] > 100, seen


def test_a_thousand_random_queries_cost_a_recording_nothing(tmp_path: Path) -> None:
    camera = posescope.Camera(30.0, 30.0, 15.5, 11.5, SIZE[1], SIZE[0])
    pixels = np.random.default_rng(0).integers(0, 256, SIZE, np.uint8)
    cloud = np.random.default_rng(1).normal(0, 5, (40, 3)) + [0, 0, 9]
    reference = posescope.Reference(pixels, camera, np.eye(4), cloud)
    seen: "collections.Counter[str]" = collections.Counter()
    with posescope.record(tmp_path / "live", keep=2, waiting=2) as log:
        for seed in range(1000):
            draw = Draw(seed)
            matches = draw.matches()
            inliers = draw.of([lambda: None, lambda: [0], lambda: np.ones(3, bool), draw.garbage])
            named = {
                "matches": None if callable(matches) else matches,
                "inliers": inliers if matches is not None else None,
                "reference": draw.mostly([lambda: reference, lambda: None]),
                "truth": draw.mostly([lambda: None, draw.pose]),
                "name": draw.mostly([lambda: None, lambda: f"a/{seed}", lambda: "twice"]),
                "time": draw.mostly([lambda: None, lambda: float(seed)]),
            }
            try:
                log.query(draw.photo(), draw.mostly([lambda: camera]), draw.pose(), **named)
                seen["taken"] += 1
            except DOCUMENTED as error:
                seen[type(error).__name__] += 1
    assert seen["taken"] > 50 and seen["ValueError"] > 200, seen
    run = posescope.Run.open(tmp_path / "live")
    assert len({row["query"] for row in run.rows()}) == seen["taken"]
    assert run.summary()["groups"] and run.report().stat().st_size > 10_000
