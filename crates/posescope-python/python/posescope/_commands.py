"""The commands `eval` and `doctor`, as functions."""

from __future__ import annotations

import importlib
import os
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _posescope
from ._errors import GateError
from ._posescope import Scene
from ._run import Run

_Option = Union[None, bool, str, int, float, "os.PathLike[str]", Sequence[Any]]


def evaluate(
    scene: "Scene | str | os.PathLike[str]",
    out: "str | os.PathLike[str]",
    threads: Optional[int] = None,
    progress: Optional[bool] = None,
    **options: _Option,
) -> Run:
    """Localises many queries into a run folder, as ``posescope eval`` does.

    Args:
        scene: The scene of the references.
        out: The run folder; it must not hold anything yet.
        threads: The number of threads; by default one per core.
        progress: Whether to show a progress bar of tqdm. By default where tqdm is installed.
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
    failed = _posescope.evaluate(place, os.fspath(out), _options(options), threads, show)
    run = Run.open(out)
    if failed is not None:
        raise GateError(failed, run)
    return run


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


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Calibration:
    """How far camera and scanner are from where a scene says.

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
