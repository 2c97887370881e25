"""What other libraries give: keypoints and matches of OpenCV, matches by index, models of pycolmap. Nothing is imported."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any, List, Optional, Tuple

import numpy as np

Triple = Tuple[Any, Any, Any]
"""Query points, reference points, and scores or None."""

_written: "List[tempfile.TemporaryDirectory[str]]" = []
"""The models that were written; they are removed when the process ends."""


def triple(matches: Any) -> Triple:
    """Query points, reference points, and scores or None.

    The third part may also be a list of OpenCV's ``DMatch``, or M x 2 whole numbers: positions among the points.
    """
    count = len(matches)
    if count not in (2, 3):
        raise ValueError(
            f"matches: query points, reference points and perhaps scores expected, {count} parts given"
        )
    parts = tuple(matches)
    queries, references = points(parts[0]), points(parts[1])
    third = parts[2] if count == 3 else None
    if third is None:
        return queries, references, None
    pairs, scores = _pairs(third)
    if pairs is None:
        return queries, references, third
    both = []
    for at, (name, places) in enumerate((("query", queries), ("reference", references))):
        array = np.asarray(places)
        chosen = pairs[:, at]
        if chosen.size and not (0 <= chosen.min() and chosen.max() < len(array)):
            raise ValueError(
                f"matches[2]: positions below {len(array)}, the number of {name} points, expected, "
                f"{chosen.min()} to {chosen.max()} given"
            )
        both.append(array[chosen].reshape(-1, *array.shape[1:]) if len(array) else np.zeros((0, 2)))
    return both[0], both[1], scores


def points(value: Any) -> Any:
    """Keypoints of OpenCV as N x 2; everything else as it is."""
    if isinstance(value, (list, tuple)) and value and all(hasattr(one, "pt") for one in value):
        return np.array([one.pt for one in value], np.float64).reshape(-1, 2)
    if isinstance(value, (list, tuple)) and not value:
        return np.zeros((0, 2))
    return value


def _pairs(third: Any) -> "Tuple[Optional[np.ndarray[Any, Any]], Optional[np.ndarray[Any, Any]]]":
    """The positions of both points of each match, and its score, where this is no list of scores."""
    if isinstance(third, (list, tuple)):
        # What knnMatch gives are tuples of the best.
        firsts = [one[0] if isinstance(one, (list, tuple)) and one else one for one in third]
        if all(hasattr(one, "queryIdx") for one in firsts):
            pairs = np.array([(one.queryIdx, one.trainIdx) for one in firsts], np.int64).reshape(-1, 2)
            return pairs, np.array([-one.distance for one in firsts], np.float64)
        return None, None
    array = np.asarray(third)
    if array.ndim == 2 and array.shape[1] == 2 and array.dtype.kind in "iu":
        return array, None
    return None, None


def written_model(reconstruction: Any, images: "Optional[str | os.PathLike[str]]") -> str:
    """The folder of a ``Reconstruction`` of pycolmap, which is written there, with a link to its photos."""
    if images is None:
        raise ValueError("images: the folder of the photos of the Reconstruction expected")
    photos = Path(images).resolve()
    if not photos.is_dir():
        raise ValueError(f"images: a folder expected, `{images}` given")
    folder = tempfile.TemporaryDirectory(prefix="posescope-")
    _written.append(folder)
    # Results name the scene by this folder.
    place = Path(folder.name) / (photos.parent.name or "model")
    model = place / "sparse" / "0"
    model.mkdir(parents=True)
    reconstruction.write_text(os.fspath(model))
    (place / "images").symlink_to(photos, target_is_directory=True)
    return os.fspath(place)
