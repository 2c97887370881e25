"""Results: a pose, or why there is none, and what speaks for it."""

from __future__ import annotations

import html
import json
import math
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple, Union

import numpy as np

from . import _notebook, _posescope

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._posescope import Answer


@dataclass(frozen=True)
class Failure:
    """Why there is no pose."""

    code: str
    """The code of the verdict, such as ``R3``."""
    text: str
    """The reason in one sentence."""
    numbers: Dict[str, Any] = field(default_factory=dict)
    """The evidence of the verdict; without any, the counts of features. Names end in their unit."""


@dataclass(frozen=True)
class Verdict:
    """Why a pose is wrong, missing or uncertain."""

    code: str
    """The code, such as ``D3``."""
    text: str
    """The sentence with its numbers."""
    evidence: Dict[str, Any] = field(default_factory=dict)
    """The numbers that the sentence is made from. Names end in their unit."""

    def __str__(self) -> str:
        return f"{self.code} {self.text}"


@dataclass(frozen=True)
class PoseError:
    """How far a pose is from the truth."""

    translation_m: float
    """Distance of the camera centres [m]."""
    rotation_deg: float
    """Geodesic angle [degrees]."""
    max_euler_deg: float
    """The largest Euler angle [degrees], the error that the paper uses."""


@dataclass(frozen=True)
class Confidence:
    """How likely a pose is right. It needs no truth."""

    probability: float
    """Probability of being right."""
    word: str
    """``trusted`` from 0.95, ``unsure`` from 0.5, else ``low``."""
    details: Dict[str, Any] = field(default_factory=dict)
    """The further fields of ``confidence`` in a results file."""

    @property
    def within(self) -> Tuple[float, float]:
        """What counts as right: a distance [m] and an angle [degrees]."""
        return _length_and_angle(self.details["within"])

    @property
    def within_95(self) -> Optional[Tuple[float, float]]:
        """A distance [m] and an angle [degrees] that each hold the error in 95 % of cases, if the pose is right."""
        held = self.details["within_95"]
        return None if held is None else _length_and_angle(held)

    @property
    def covariance(self) -> Optional["NDArray[np.float64]"]:
        """The covariance of the pose, 6 x 6, if it is right: rotation about the camera's axes x, y, z [rad], then the
        position of its centre along them [m]."""
        numbers = self.details["covariance"]
        return None if numbers is None else np.asarray(numbers, dtype=np.float64).reshape(6, 6)

    @property
    def lowered_by(self) -> List[Dict[str, Any]]:
        """What speaks against the pose, beside what the method left behind: each with its ``why``,
        ``camera``, ``radius`` or ``freedoms``, and its numbers."""
        return list(self.details.get("lowered_by", []))

    def __float__(self) -> float:
        return self.probability

    def __str__(self) -> str:
        # Rounded down, so that a limit that was missed never reads as reached.
        percent = math.floor(100 * self.probability)
        return f"{self.word}, {f'{percent} %' if percent else 'under 1 %'} likely within {self.within[0]:g} m"


@dataclass(frozen=True)
class Opinion:
    """A second opinion on the pose of another system. It needs no truth."""

    standing: str
    """``confirmed``, ``contradicted`` or ``undecided``."""
    probability: float
    """Probability that the given pose is right."""
    because: str
    """Why, in a sentence."""
    offset_m: "Optional[NDArray[np.float64]]"
    """Where the given camera is, seen from where posescope has it: right, down, forward [m]."""
    details: Dict[str, Any] = field(default_factory=dict)
    """The further fields of ``opinion`` in a results file."""

    def __str__(self) -> str:
        return f"{self.standing}: {self.because}"


def _length_and_angle(held: Dict[str, float]) -> Tuple[float, float]:
    return held["m"], held["deg"]


class Result:
    """What one method made of one query.

    In a notebook it shows itself: the sentence, and the picture that proves it.
    """

    def __init__(
        self, answer: "Answer", asked: Tuple[str, Tuple[Any, ...]], from_matches: "Optional[Result]" = None
    ) -> None:
        self._answer = answer
        # The function of the extension that was asked, and its arguments.
        self._asked = asked
        self._from_matches = from_matches
        self._json = answer.json()
        self._row: Dict[str, Any] = json.loads(self._json)
        self._proof: Optional[Tuple[str, str]] = None
        self._has_proof = False

    @property
    def from_matches(self) -> "Optional[Result]":
        """What ``fb`` makes of the matches that :func:`diagnose` was given; None without matches."""
        return self._from_matches

    @property
    def query(self) -> str:
        """The name of the query."""
        return str(self._row["query"])

    @property
    def references(self) -> List[str]:
        """The names of the references."""
        return list(self._row["references"])

    @property
    def method(self) -> str:
        """The method."""
        return str(self._row["method"])

    @property
    def pose(self) -> Optional["NDArray[np.float64]"]:
        """``world_from_camera``, 4 x 4 [m]; None without a pose, and ``failure`` says why."""
        pose = self._row["pose"]
        if pose is None:
            return None
        matrix = np.eye(4)
        matrix[:3] = pose["world_from_camera"]
        return matrix

    @property
    def failure(self) -> Optional[Failure]:
        """Why there is no pose; None where there is one."""
        reason = self._row["reason"]
        if reason is None:
            return None
        same = (one for one in self._row["diagnosis"] if one["code"] == reason["code"])
        found: Dict[str, Any] = next(same, {})
        numbers = found.get("evidence") or self.counts or {}
        return Failure(reason["code"], reason["text"], numbers)

    @property
    def grade(self) -> str:
        """``right``, ``wrong``, ``no pose``, or ``unmeasured`` where the truth is unknown."""
        return str(self._row["grade"])

    @property
    def error(self) -> Optional[PoseError]:
        """The error of the pose, where the truth is known."""
        error = self._row["error"]
        return None if error is None else PoseError(**error)

    @property
    def confidence(self) -> Optional[Confidence]:
        """How likely the pose is right; None without a pose."""
        known = self._row["confidence"]
        if known is None:
            return None
        details = {key: value for key, value in known.items() if key not in ("probability", "word")}
        return Confidence(known["probability"], known["word"], details)

    @property
    def opinion(self) -> Optional[Opinion]:
        """What posescope thinks of a pose that another system found; None of posescope's own."""
        known = self._row.get("opinion")
        if known is None:
            return None
        details = {key: value for key, value in known.items() if key not in Opinion.__dataclass_fields__}
        offset = known["offset_m"]
        return Opinion(
            known["standing"],
            known["probability"],
            known["because"],
            None if offset is None else np.asarray(offset, dtype=np.float64),
            details,
        )

    def covariance(self, of: str = "world_from_camera") -> Optional["NDArray[np.float64]"]:
        """The covariance of the pose, 6 x 6, if it is right; None where none is known.

        Args:
            of: ``world_from_camera``: rotation about the camera's axes x, y, z [rad], then the position of its centre
                along them [m]. ``cam_from_world``: as pycolmap defines it, a small rotation that is applied after that
                of ``cam_from_world`` [rad], then what is added to its translation [m].
        """
        if of not in ("world_from_camera", "cam_from_world"):
            raise ValueError(f"of: world_from_camera or cam_from_world expected, {of!r} given")
        known, pose = self.confidence, self.pose
        own = None if known is None else known.covariance
        if own is None or pose is None or of == "world_from_camera":
            return own
        x, y, z = -pose[:3, :3].T @ pose[:3, 3]
        moves = np.eye(6)
        moves[3:, :3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        moved: "NDArray[np.float64]" = moves @ own @ moves.T
        return moved

    @property
    def verdicts(self) -> List[Verdict]:
        """Why the pose is wrong, missing or uncertain, the most likely cause first."""
        found = self._row["diagnosis"]
        return [Verdict(one["code"], one["text"], one.get("evidence") or {}) for one in found]

    @property
    def counts(self) -> Optional[Dict[str, int]]:
        """Where the features went, from ``query_keypoints`` to ``inliers``; None without features.

        Where several references were fused, the sum over all of them.
        """
        all_counts = [self._row["counts"], *(one["counts"] for one in self.per_reference)]
        known = [counts for counts in all_counts if counts is not None]
        if not known:
            return None
        return {name: sum(counts[name] for counts in known) for name in known[0]}

    @property
    def explanation(self) -> Optional[Dict[str, Any]]:
        """What was tried to make a wrong pose right, where ``explain`` asked for it: what ``helped``, each with its
        ``args`` and ``error``, how many ``runs`` there were, and whether all was tried (``complete``)."""
        found: Optional[Dict[str, Any]] = self._row.get("explanation")
        return found

    @property
    def cost(self) -> Optional[Dict[str, Any]]:
        """The cost at the poses that matter (lower is better); None without a search."""
        cost = self._row["cost"]
        return None if cost is None else dict(cost)

    @property
    def per_reference(self) -> List[Dict[str, Any]]:
        """What each reference alone gave, where several were fused."""
        return list(self._row.get("per_reference") or [])

    @property
    def seconds(self) -> float:
        """How long the localisation took [s]. It is in no file: results hold no clock."""
        return self._answer.seconds()

    @property
    def headline(self) -> str:
        """Query, method and error in a line, with the first verdict."""
        return self._answer.headline()

    @property
    def paragraphs(self) -> List[str]:
        """What follows the first verdict: other verdicts, and what to try."""
        return self._answer.paragraphs()

    def to_json(self) -> str:
        """The line of this result in ``results.jsonl``."""
        return self._json

    def to_dict(self) -> Dict[str, Any]:
        """The object of this result in ``results.jsonl``; docs/results.md explains its fields."""
        row: Dict[str, Any] = json.loads(self._json)
        return row

    def events(self) -> List[Dict[str, Any]]:
        """Every decision of the method, in order, as dicts; docs/results.md explains them.

        Localises again, which gives the same result.
        """
        return [json.loads(line) for line in self._answer.events().splitlines()]

    def inlier_mask(self) -> "Union[None, NDArray[np.bool_], List[NDArray[np.bool_]]]":
        """Which of the matches that were given to :func:`localize` are inliers, in their order; None without matches.

        Where several references were fused, a list with one mask for each. Localises again, which gives the same
        result.
        """
        given = self._matches()
        if given is None:
            return None
        events = self.events()
        alone = [one["references"][0] for one in self.per_reference] or self.references
        masks = [
            _mask([event for event in events if event["reference"] == name], matches)
            for name, matches in zip(alone, given)
        ]
        return masks if len(given) > 1 else masks[0]

    def _matches(self) -> "Optional[List[Any]]":
        """The matches that were given, one entry per reference."""
        function, arguments = self._asked
        return arguments[5] if function == "localize" else None

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Saves a recording (``.rrd``) for the Rerun viewer 0.36. Localises again, which gives the same result.

        Raises:
            OSError: The file cannot be written.
        """
        self._answer.save(os.fspath(path))

    def show(self) -> Any:
        """Opens the recording in Rerun's notebook viewer.

        Raises:
            ImportError: ``rerun-sdk[notebook]`` is not installed; the message says how to install it.
        """
        return _notebook.show(self.save)

    def proof(self) -> Optional[Tuple[str, str]]:
        """The picture that proves the first verdict or shows what decided: a data URI, and what it shows.

        Localises again, once.
        """
        if not self._has_proof:
            self._proof = self._answer.proof()
            self._has_proof = True
        return self._proof

    def __reduce__(self) -> Tuple[Any, ...]:
        return restored, (self._asked, self._json, self.seconds, self._from_matches)

    def __repr__(self) -> str:
        return f"<Result {self.headline}>"

    def _repr_html_(self) -> str:
        lines = [f"<strong>{html.escape(self.headline)}</strong>"]
        known = self.confidence
        if known is not None:
            lines.append(str(known))
        lines += [html.escape(paragraph) for paragraph in self.paragraphs]
        parts = "".join(f"<div>{line}</div>" for line in lines)
        drawn = self.proof()
        if drawn is not None:
            picture, words = drawn
            parts += f'<img src="{picture}" alt="{html.escape(words)}" style="max-width: 100%">'
        return f"<div>{parts}</div>"


def restored(
    asked: Tuple[str, Tuple[Any, ...]], line: str, seconds: float, from_matches: Optional[Result]
) -> Result:
    """A result that travelled: its line in ``results.jsonl``, and what was asked."""
    function, arguments = asked
    answer = getattr(_posescope, function)(*arguments, (line, seconds))
    return Result(answer, asked, from_matches)


def _mask(events: List[Dict[str, Any]], matches: Any) -> "NDArray[np.bool_]":
    """Which matches are inliers by the events of one reference."""
    queries, references = (np.asarray(part, np.float32).reshape(-1, 2) for part in matches[:2])
    keypoints: Dict[str, Any] = {}
    states: List[str] = []
    partners: Dict[int, int] = {}
    for event in events:
        if event["kind"] == "FeaturesDetected":
            keypoints[event["side"]] = np.array([event["x_px"], event["y_px"]], np.float32).T.reshape(-1, 2)
        elif event["kind"] == "MatchesDecided":
            partners = dict(zip(event["query_keypoint"], event["reference_keypoint"]))
        elif event["kind"] == "FeaturesClassified":
            states = event["state"]
    inliers = set()
    for at, state in enumerate(states):
        if state == "inlier" and at in partners:
            inliers.add((*keypoints["query"][at].tolist(), *keypoints["reference"][partners[at]].tolist()))
    pairs = np.hstack([queries, references]).tolist()
    return np.array([tuple(pair) in inliers for pair in pairs], np.bool_)
