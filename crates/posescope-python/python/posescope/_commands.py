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
    remarks: List[Tuple[str, str]]
    """Implausible things: ``broken`` or ``odd``, and what it is."""
    mistake: Optional[str]
    """The mistake that explains why photos, poses and clouds do not fit."""
    remedy: Optional[str]
    """What mends it."""
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
