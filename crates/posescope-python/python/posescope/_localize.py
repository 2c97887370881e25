"""Localising, and judging somebody else's pose."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any, Callable, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _posescope
from ._neighbours import Triple, triple
from ._posescope import Query, Reference
from ._result import Result

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    Matches = Sequence[Any]
    """Query points (N x 2), reference points (N x 2), and perhaps scores (N) [px]."""
    Matcher = Callable[[Any, Any], Matches]
    """Takes the photo of the query and that of a reference, and returns their matches."""
    MatchesOrMatcher = Union[Matches, Sequence[Matches], Matcher]

Right = Union[str, Tuple[float, float]]
"""The largest error of a right pose: metres and degrees, or text such as ``0.5m,2deg``."""

_EXPLAINING_RUNS = 12
"""How many variations the command tries by default."""

_USES_MATCHES = ("fb", "hy")
"""The methods that use matches of another system."""


def localize(
    query: Query,
    reference: "Reference | Sequence[Reference]",
    method: Optional[str] = None,
    params: Optional[Mapping[str, object]] = None,
    radius: Optional[float] = None,
    matches: "Optional[MatchesOrMatcher]" = None,
    fusion: Optional[str] = None,
    seed: int = 0,
    threads: Optional[int] = None,
    right: Optional[Right] = None,
    explain: "bool | int" = False,
) -> Result:
    """Estimates where a query was taken.

    The result has the same bytes as that of the command, on any number of threads. The interpreter's lock is released
    meanwhile; Ctrl-C stops it.

    Args:
        query: The photo whose pose is sought.
        reference: One reference, or several, which are fused.
        method: ``fb``, ``pm``, ``mi``, ``hy`` as in the paper, ``fb2``, ``mi6``, ``nid``, or ``robust``. By default
            ``robust``; ``fb`` where matches are given.
        params: Parameters by name, such as ``{"fb.ratio": 0.7}``; ``posescope params`` lists them.
        radius: How far from the reference the direct methods search [m]. By default 15 m; in scenes that are no
            street, what suits the depth of their clouds.
        matches: Matches that take the place of SURF's in ``fb`` and ``hy``: query points, reference points, and
            perhaps scores. Points are N x 2 [px], and (0, 0) is the centre of the top-left pixel, or keypoints of
            OpenCV. In place of scores, a list of ``DMatch`` or M x 2 positions say which points are matches. For several
            references, a list with one entry each. Or a callable that takes both photos (uint8, H x W x 3 where they
            have colours, else H x W) and returns such a tuple.
        fusion: How several references become one pose: ``r-wavg`` (by default), ``maxf``, ``avg``, ``wavg``,
            ``joint``.
        seed: The seed of every random choice.
        threads: The number of threads; by default one per core.
        right: The largest error of a right pose, such as ``(0.5, 2.0)`` for 0.5 m and 2 degrees, or ``"0.5m,2deg"``.
            By default 1 m and 5 degrees; in scenes that are no street, what suits the depth of their clouds.
        explain: Whether to try variations of a wrong result, 12 or so many; ``explanation`` says what helped.

    Returns:
        The pose with its confidence and verdicts, or why there is none. Having no pose is no exception.

    Raises:
        ValueError: An array has another dtype or shape, or an argument another value; the message names what was
            expected.
        InputError: A frame of a scene cannot be read.
        InternalError: A bug of posescope.
    """
    references = _list_of(reference)
    if method is None:
        method = "robust" if matches is None else _USES_MATCHES[0]
    if not isinstance(method, str):
        raise TypeError(f"method: a name expected, {type(method).__name__} given")
    if matches is not None and method not in _USES_MATCHES:
        raise ValueError(f"matches: the methods that use them are fb and hy, `{method}` given")
    given = _matches_of(query, references, matches)
    judging = judged_by(radius, right, explain)
    return _asked("localize", query, references, method, _texts(params), judging, given, fusion, seed, threads)


def diagnose(
    query: Query,
    references: "Reference | Sequence[Reference]",
    world_from_camera: "ArrayLike",
    truth: "Optional[ArrayLike]" = None,
    matches: "Optional[MatchesOrMatcher]" = None,
    params: Optional[Mapping[str, object]] = None,
    name: str = "pose",
    threads: Optional[int] = None,
    radius: Optional[float] = None,
    right: Optional[Right] = None,
    explain: "bool | int" = False,
) -> Result:
    """Says what the verdicts and the costs make of a pose that somebody else found.

    Args:
        query: The photo.
        references: One reference, or several.
        world_from_camera: The pose to judge, 4 x 4 [m]. What has a ``cam_from_world``, such as the answer of an
            estimator of pycolmap, is taken, too.
        truth: The true pose, 4 x 4, where the query does not know it.
        matches: As in :func:`localize`. They have no part in the verdicts on the pose; ``from_matches`` of the result is
            what ``fb`` makes of them.
        params: Parameters by name.
        name: What the other system is called in the result.
        threads: The number of threads; by default one per core.
        radius: How far from the reference a search would have looked [m].
        right: The largest error of a right pose, as in :func:`localize`.
        explain: Whether to try variations of what ``fb`` makes of the matches, as in :func:`localize`.

    Returns:
        A result whose pose is the given one.

    Raises:
        ValueError: An array has another dtype or shape, or an argument another value.
        InputError: A frame of a scene cannot be read.
        InternalError: A bug of posescope.
    """
    all_references, texts = _list_of(references), _texts(params)
    judging = judged_by(radius, right, explain)
    world_from_camera = _as_array("world_from_camera", world_from_camera)
    truth = None if truth is None else _as_array("truth", truth)
    asked = (query, all_references, world_from_camera, truth, texts, judging, name, threads)
    if matches is None:
        return _asked("diagnose", *asked)
    judged = query if truth is None else Query(query.photo, query.camera, query.name, truth)
    given = _matches_of(query, all_references, matches)
    found = _asked("localize", judged, all_references, "fb", texts, judging, given, None, 0, threads)
    return _asked("diagnose", *asked, from_matches=found)


def _asked(function: str, *arguments: Any, from_matches: Optional[Result] = None) -> Result:
    """What a function of the extension answers, with what it was asked."""
    answer = getattr(_posescope, function)(*arguments)
    return Result(answer, (function, _kept(arguments)), from_matches)


def _as_array(name: str, pose: Any) -> Any:
    """A pose of another library as an array, which travels."""
    if isinstance(pose, (np.ndarray, list, tuple)):
        return pose
    return _posescope.pose_of(_posescope.pose_parts(name, pose))


def _kept(value: Any) -> Any:
    """A copy of all arrays in it: their owners may change them before the result travels."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, (list, tuple)):
        return type(value)(_kept(one) for one in value)
    return value


def judged_by(
    radius: Optional[float], right: Optional[Right], explain: "bool | int"
) -> Tuple[Optional[float], Optional[str], int]:
    """The radius, the tolerance as text, and how many variations are tried."""
    if isinstance(right, (tuple, list)):
        if len(right) != 2:
            raise ValueError(f"right: metres and degrees expected, {len(right)} numbers given")
        right = f"{right[0]}m,{right[1]}deg"
    if right is not None and not isinstance(right, str):
        raise TypeError(f"right: metres and degrees expected, {type(right).__name__} given")
    runs = _EXPLAINING_RUNS if explain is True else operator.index(explain)
    if runs < 0:
        raise ValueError(f"explain: True or a number from 0 on expected, {runs} given")
    return radius, right, runs


def _list_of(reference: "Reference | Sequence[Reference]") -> List[Reference]:
    references = [reference] if isinstance(reference, Reference) else list(reference)
    for one in references:
        if not isinstance(one, Reference):
            raise TypeError(f"references: posescope.Reference expected, {type(one).__name__} given")
    return references


def _texts(params: Optional[Mapping[str, object]]) -> List[Tuple[str, str]]:
    """Parameters as the command line writes them."""

    def text(value: object) -> str:
        return str(value).lower() if isinstance(value, bool) else str(value)

    return [(str(key), text(value)) for key, value in (params or {}).items()]


def _matches_of(
    query: Query, references: List[Reference], matches: "Optional[MatchesOrMatcher]"
) -> Optional[List[Triple]]:
    """The matches of each reference, as triples."""
    if matches is None:
        return None
    if callable(matches):
        photo = query.photo
        given: Sequence[Any] = [matches(photo, reference.photo) for reference in references]
    else:
        several = len(references) > 1 or _is_nested(matches)
        given = matches if several else [matches]
    # Counted first: an array may have any number of rows.
    if len(given) != len(references):
        raise ValueError(
            f"matches: one entry per reference expected, {len(given)} for {len(references)} references given"
        )
    return [triple(one) for one in given]


def _is_nested(matches: Any) -> bool:
    """Whether this is a list with the matches of one reference."""
    return isinstance(matches, list) and len(matches) == 1
