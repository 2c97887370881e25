"""The commands `eval` and `doctor`, as functions."""

from __future__ import annotations

import html
import importlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _notebook, _posescope
from ._errors import InputError
from ._posescope import Scene
from ._run import GateError, Run

Pairs = Union[str, "os.PathLike[str]", Sequence[Sequence[Any]], Mapping[Any, Sequence[Any]]]
"""The references of queries: a file, pairs, or lists by query."""
_Option = Union[None, bool, str, int, float, "os.PathLike[str]", Sequence[Any]]


def evaluate(
    scene: "Scene | str | os.PathLike[str]",
    out: "str | os.PathLike[str]",
    threads: Optional[int] = None,
    progress: Optional[bool] = None,
    pairs: Optional[Pairs] = None,
    references: "Optional[Sequence[Any]]" = None,
    **options: _Option,
) -> Run:
    """Localises many queries into a run folder, as ``posescope eval`` does.

    Args:
        scene: The scene of the references.
        out: The run folder; it must not hold anything yet.
        threads: The number of threads; by default one per core.
        progress: Whether to show a progress bar of tqdm. By default where tqdm is installed.
        pairs: The references of each query, whose queries are evaluated: hloc's file of pairs (``query reference`` in
            each line), a list of such pairs, or a dict of lists. Several references are fused.
        references: The references of all queries: names of frames, their numbers, or frames with a ``name``.
        options: The options of ``posescope eval`` with ``_`` for ``-``, such as ``limit=40``, ``method="fb,mi"``,
            ``query_scene="street:night"``, ``gate=["right@fb >= 0.6"]`` or ``set=["fb.ratio=0.7"]``, but for ``sweep``
            and ``rerun_failed``. A list repeats an option; True gives one without a value. ``posescope eval --help``
            explains them.

    Returns:
        The run.

    Raises:
        ValueError: An option is unknown or has another value than expected.
        InputError: A scene or a file cannot be read.
        GateError: A gate failed; the run folder is complete.
        InternalError: A bug of posescope.
    """
    place = scene.path if isinstance(scene, Scene) else os.fspath(scene)
    show = _progress_bar(progress)
    if references is not None:
        if pairs is not None or "reference" in options:
            raise ValueError("references: either references, pairs or reference expected")
        options["reference"] = [_named(one) for one in references]
    failed = _posescope.evaluate(place, os.fspath(out), _pairs_of(pairs), _options(options), threads, show)
    run = Run.open(out)
    if failed is not None:
        raise GateError(failed, run)
    return run


def _named(frame: Any) -> str:
    """The name of a frame that has one."""
    return str(getattr(frame, "name", frame))


def _pairs_of(pairs: Optional[Pairs]) -> Dict[str, List[str]]:
    """The references of each query."""
    if pairs is None:
        return {}
    if isinstance(pairs, Mapping):
        found = {_named(query): [_named(one) for one in references] for query, references in pairs.items()}
    else:
        listed: Sequence[Any]
        if isinstance(pairs, (str, os.PathLike)):
            listed = _pairs_in(Path(pairs))
        else:
            listed = pairs
        found = {}
        for pair in listed:
            if isinstance(pair, str) or len(pair) != 2:
                raise ValueError(f"pairs: pairs of a query and a reference expected, {pair!r} given")
            found.setdefault(_named(pair[0]), []).append(_named(pair[1]))
    if not found:
        raise ValueError("pairs: at least one pair expected, none given")
    return found


def _pairs_in(file: Path) -> List[List[str]]:
    """The pairs of a file of hloc."""
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise InputError(str(file), "", error.strerror or str(error)) from error
    pairs: List[List[str]] = []
    for number, line in enumerate(lines, 1):
        words = line.split()
        if len(words) not in (0, 2):
            raise InputError(str(file), f"line {number}", f"`query reference` expected, {len(words)} words found")
        if words:
            pairs.append(words)
    return pairs


def _options(options: "dict[str, _Option]") -> Dict[str, List[str]]:
    """Each option with its values as text; one without a value has none."""
    texts: Dict[str, List[str]] = {}
    for name, value in options.items():
        if value is None or value is False:
            continue
        values: Sequence[Any] = value if isinstance(value, (list, tuple)) else [value]
        texts[name.rstrip("_").replace("_", "-")] = [str(one) for one in values if one is not True]
    return texts


def _progress_bar(wanted: Optional[bool]) -> "Optional[Callable[[int, int], None]]":
    """Shows how many queries are done, where tqdm is installed."""
    if wanted is False:
        return None
    try:
        tqdm: Any = importlib.import_module("tqdm.auto").tqdm
    except ImportError:
        if wanted:
            raise
        return None
    bar: Any = None

    def show(done: int, of: int) -> None:
        nonlocal bar
        if of == 0:
            return
        if bar is None:
            bar = tqdm(total=of, unit="query")
        bar.update(done - bar.n)
        if done >= of:
            bar.close()

    return show


@dataclass(frozen=True, repr=False)
class Examination:
    """What ``doctor`` finds in a scene. In a notebook it shows itself."""

    is_broken: bool
    """Whether the scene is unusable or contains a mistake."""
    answer: str
    """``fits``, ``does not fit`` or ``cannot be judged``."""
    agreement: Optional[Tuple[Optional[float], Optional[float], Optional[float]]]
    """The share of shared features that the poses explain, the correlation of grey values, and the log ratio of
    image edges at depth edges; ``None`` where nothing can be compared."""
    remarks: List[Tuple[str, str]]
    """Implausible things: ``broken`` or ``odd``, and what it is."""
    mistake: Optional[str]
    """The mistake that explains why photos, poses and clouds do not fit."""
    remedy: Optional[str]
    """What mends it."""
    write: Optional[Tuple[str, str]]
    """The lines that mend a ``scene.toml`` or a file beside it, and where they belong."""
    text: str
    """What ``posescope doctor`` prints."""
    picture: Optional[NDArray[np.uint8]]
    """The cloud of a frame on its photo, with the route of the camera below: H x W x 3."""

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        found = self.answer if self.mistake is None else f"{self.answer}: {self.mistake}"
        return f"<Examination {found}, {len(self.remarks)} remarks>"

    def _repr_html_(self) -> str:
        return _shown(self.text, self.picture)


def doctor(scene: "Scene | str | os.PathLike[str]") -> Examination:
    """Checks that the photos, poses and clouds of a scene fit together, as ``posescope doctor`` does.

    Args:
        scene: The scene, or its path.

    Raises:
        InputError: The scene cannot be read.
        InternalError: A bug of posescope.
    """
    opened = scene if isinstance(scene, Scene) else Scene.open(scene)
    found = _posescope.doctor(opened)
    mistake, remedy = found.pop("mistake") or (None, None)
    return Examination(mistake=mistake, remedy=remedy, **found)


@dataclass(frozen=True, repr=False)
class Calibration:
    """How far camera and scanner are from where a scene says. In a notebook it shows itself.

    Values are pairs: what was found, and half of the interval that holds the true value with 90 %. They are ``None``
    where the calibration cannot be judged.
    """

    answer: str
    """``consistent``, ``off``, ``undecided`` or ``cannot be judged``."""
    text: str
    """What ``posescope doctor --calibration`` prints."""
    turn_deg: Optional[Tuple[Tuple[float, float], ...]] = None
    """How the clouds must be turned about x, y and z of the camera's frame."""
    shift_m: Optional[Tuple[Tuple[float, float], ...]] = None
    """How they must be shifted along x, y and z after that."""
    focal_length_percent: Optional[Tuple[float, float]] = None
    """By how much the focal length must be larger."""
    delay_s: Optional[Tuple[float, float]] = None
    """How much later the photos were taken than the clouds, if nothing else is off; ``None`` where the camera stands."""
    frames: int = 0
    """The frames that were compared."""
    edges: int = 0
    """Their depth edges."""
    camera_from_stated: Optional[NDArray[np.float64]] = None
    """4 x 4: multiplied from the left to the stated ``camera_from_cloud``, it gives the one that fits."""
    picture: Optional[NDArray[np.uint8]] = None
    """Depth edges on a photo as stated and as found, with a curve for each value: H x W x 3."""

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"<Calibration {self.answer}, {self.frames} frames>"

    def _repr_html_(self) -> str:
        return _shown(self.text, self.picture)


def _shown(text: str, picture: Optional[NDArray[np.uint8]]) -> str:
    """A text with its picture, for a notebook."""
    drawn = "" if picture is None else _notebook.image(picture, "what was compared")
    return f"<div><pre>{html.escape(text)}</pre>{drawn}</div>"


def calibration(scene: "Scene | str | os.PathLike[str]") -> Calibration:
    """Measures how far camera and scanner are from where a scene says, as ``posescope doctor --calibration`` does.

    Args:
        scene: The scene, or its path.

    Raises:
        InputError: The scene cannot be read.
        InternalError: A bug of posescope.
    """
    opened = scene if isinstance(scene, Scene) else Scene.open(scene)
    found = _posescope.calibration(opened)
    for key in ("turn_deg", "shift_m"):
        if key in found:
            found[key] = tuple(found[key])
    return Calibration(**found)
