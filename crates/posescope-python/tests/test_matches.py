"""Somebody else's matches, and somebody else's pose."""

from __future__ import annotations

from typing import Any, Tuple

import numpy as np
import pytest

import posescope
from conftest import surf_matches


@pytest.fixture(scope="module")
def pair(street: posescope.Scene) -> Tuple[posescope.Query, posescope.Reference]:
    return street.query("70"), street.reference("62")


@pytest.fixture(scope="module")
def surf(pair: Tuple[posescope.Query, posescope.Reference]) -> Tuple[np.ndarray, np.ndarray]:
    return surf_matches(*pair)


def test_the_matches_of_surf_give_the_pose_of_surf(
    pair: Tuple[posescope.Query, posescope.Reference], surf: Tuple[np.ndarray, np.ndarray]
) -> None:
    own = posescope.localize(*pair, method="fb")
    given = posescope.localize(*pair, matches=surf)
    assert given.method == "fb" and own.pose is not None
    assert given.pose is not None and np.allclose(given.pose, own.pose)


def test_a_callable_gets_both_photos(
    pair: Tuple[posescope.Query, posescope.Reference], surf: Tuple[np.ndarray, np.ndarray]
) -> None:
    seen = []

    def matcher(query: np.ndarray, reference: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        seen.append((query, reference))
        return (*surf, np.ones(len(surf[0])))

    result = posescope.localize(*pair, method="fb", matches=matcher)
    assert result.grade == "right"
    assert np.array_equal(seen[0][0], pair[0].photo) and np.array_equal(seen[0][1], pair[1].photo)

    def fails(query: np.ndarray, reference: np.ndarray) -> Any:
        raise LookupError("no weights")

    with pytest.raises(LookupError, match="no weights"):
        posescope.localize(*pair, matches=fails)


def test_a_point_that_two_matches_claim_goes_to_the_better_score(
    pair: Tuple[posescope.Query, posescope.Reference], surf: Tuple[np.ndarray, np.ndarray]
) -> None:
    query, reference = surf
    true, false = np.full(len(query), 0.9), np.full(len(query), 0.5)
    both = np.vstack([query, query]), np.vstack([reference, np.roll(reference, len(reference) // 2, axis=0)])
    alone = posescope.localize(*pair, matches=surf)
    better = posescope.localize(*pair, matches=(*both, np.concatenate([true, false])))
    worse = posescope.localize(*pair, matches=(*both, np.concatenate([false, true])))
    assert alone.counts is not None and worse.counts is not None
    assert better.counts == alone.counts and better.grade == "right"
    assert worse.counts["unique"] <= alone.counts["unique"] and worse.grade != "right"


@pytest.mark.parametrize(
    ("matches", "words"),
    [
        ((np.zeros((3, 2)), np.zeros((4, 2))), "as many query points as reference points"),
        ((np.zeros((3, 3)), np.zeros((3, 2))), "matches[0]: numbers of shape (N, 2) expected, float64 of shape (3, 3)"),
        ((np.zeros((3, 2)), np.full((3, 2), np.nan)), "matches[1]: finite numbers"),
        ((np.zeros((3, 2)), np.zeros((3, 2)), np.zeros(2)), "matches[2]: numbers of shape (3,)"),
        ((np.zeros((3, 2)),), "1 parts given"),
        ([(np.zeros((3, 2)), np.zeros((3, 2)))] * 2, "parts|entry|shape"),
    ],
)
def test_wrong_matches_are_named(
    matches: Any, words: str, pair: Tuple[posescope.Query, posescope.Reference]
) -> None:
    with pytest.raises(ValueError) as raised:
        posescope.localize(*pair, matches=matches)
    assert any(word in str(raised.value) for word in words.split("|"))


def test_methods_without_matches_refuse_them(
    pair: Tuple[posescope.Query, posescope.Reference], surf: Tuple[np.ndarray, np.ndarray]
) -> None:
    with pytest.raises(ValueError, match="fb and hy"):
        posescope.localize(*pair, method="robust", matches=surf)


def test_no_matches_are_a_failure(pair: Tuple[posescope.Query, posescope.Reference]) -> None:
    result = posescope.localize(*pair, matches=(np.zeros((0, 2)), np.zeros((0, 2))))
    assert result.failure is not None and result.pose is None


def test_somebody_elses_pose_gets_verdicts(
    pair: Tuple[posescope.Query, posescope.Reference], surf: Tuple[np.ndarray, np.ndarray]
) -> None:
    query, reference = pair
    truth = query.truth
    assert truth is not None
    right = posescope.diagnose(query, reference, truth)
    assert right.grade == "right" and right.method == "pose" and right.pose is not None
    assert np.allclose(right.pose, truth)
    moved = truth.copy()
    moved[:3, 3] += [6.0, 0.0, 0.0]
    wrong = posescope.diagnose(query, reference, moved, matches=surf, name="mine")
    assert wrong.grade == "wrong" and wrong.verdicts and wrong.method == "mine"
    assert wrong.error is not None and wrong.error.translation_m == pytest.approx(6.0)
    assert right.from_matches is None and wrong.from_matches is not None
    assert wrong.from_matches.method == "fb" and wrong.from_matches.grade == "right"
    unknown = posescope.Query(query.photo, query.camera)
    given = posescope.diagnose(unknown, reference, moved, truth=truth, matches=surf)
    assert given.from_matches is not None and given.from_matches.grade == "right"
    assert posescope.diagnose(unknown, reference, moved).grade == "unmeasured"
    assert posescope.diagnose(unknown, reference, moved, truth=truth).grade == "wrong"
    with pytest.raises(ValueError, match="method of posescope"):
        posescope.diagnose(query, reference, truth, name="mi")
