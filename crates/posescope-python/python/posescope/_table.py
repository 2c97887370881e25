"""The results of a run as a table whose columns do not depend on the run."""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

LIBRARIES = ("polars", "pandas", "pyarrow")

Row = Dict[str, Any]
Parts = Tuple[float, float, float, float, float, float, float]
"""Position and quaternion x y z w of a pose."""


def _at(*keys: str) -> Callable[[Row], Any]:
    """The value below these keys, or None."""

    def value(row: Row) -> Any:
        found: Any = row
        for key in keys:
            found = found.get(key) if isinstance(found, dict) else None
        return found

    return value


def _element(key: str, at: int) -> Callable[[Row], Any]:
    """An element of a list of the pose, or None."""

    def value(row: Row) -> Any:
        pose = row.get("pose")
        return None if pose is None else pose[key][at]

    return value


def _primary(key: str) -> Callable[[Row], Any]:
    def value(row: Row) -> Any:
        verdicts = row.get("diagnosis") or []
        return verdicts[0][key] if verdicts else None

    return value


def _codes(row: Row) -> List[str]:
    return [str(one["code"]) for one in row.get("diagnosis") or []]


_COUNTS = ("query_keypoints", "reference_keypoints", "ratio_passed", "unique", "with_depth", "inliers")

COLUMNS: Dict[str, Tuple[str, Callable[[Row], Any]]] = {
    "query": ("text", _at("query")),
    "method": ("text", _at("method")),
    "fusion": ("text", _at("fusion")),
    "scene": ("text", _at("scene")),
    "query_scene": ("text", lambda row: row.get("query_scene") or row.get("scene")),
    "references": ("texts", lambda row: list(row.get("references") or [])),
    "radius_m": ("number", _at("setting", "radius_m")),
    "seed": ("whole", _at("seed")),
    "grade": ("text", _at("grade")),
    "code": ("text", _primary("code")),
    "codes": ("texts", _codes),
    "verdict": ("text", _primary("text")),
    "confidence.probability": ("number", _at("confidence", "probability")),
    "confidence.word": ("text", _at("confidence", "word")),
    "opinion.standing": ("text", _at("opinion", "standing")),
    "opinion.probability": ("number", _at("opinion", "probability")),
    "position.x_m": ("number", _element("position_m", 0)),
    "position.y_m": ("number", _element("position_m", 1)),
    "position.z_m": ("number", _element("position_m", 2)),
    "quaternion.x": ("number", _element("quaternion_xyzw", 0)),
    "quaternion.y": ("number", _element("quaternion_xyzw", 1)),
    "quaternion.z": ("number", _element("quaternion_xyzw", 2)),
    "quaternion.w": ("number", _element("quaternion_xyzw", 3)),
    "error.translation_m": ("number", _at("error", "translation_m")),
    "error.rotation_deg": ("number", _at("error", "rotation_deg")),
    "error.max_euler_deg": ("number", _at("error", "max_euler_deg")),
    "error.right_m": ("number", _at("error_vector", "right")),
    "error.down_m": ("number", _at("error_vector", "down")),
    "error.forward_m": ("number", _at("error_vector", "forward")),
    "initial_error.translation_m": ("number", _at("initial_error", "translation_m")),
    "initial_error.rotation_deg": ("number", _at("initial_error", "rotation_deg")),
    **{f"counts.{name}": ("whole", _at("counts", name)) for name in _COUNTS},
    "cost.best": ("number", _at("cost", "best")),
    "cost.truth": ("number", _at("cost", "truth")),
    "cost.coverage_best": ("number", _at("cost", "coverage_best")),
    "time_s": ("number", _at("time_s")),
}
"""The columns in order: the kind of their values, and where these are in a result."""


def error_vector(position_m: Sequence[float], truth: Parts) -> Dict[str, float]:
    """How far a position is right of the true camera, below it and in front of it [m]."""
    x, y, z, w = truth[3:]
    off = np.asarray(position_m, np.float64) - np.asarray(truth[:3])
    # The inverse of the true rotation turns it into the camera's axes.
    turn = -np.array([x, y, z])
    across = 2.0 * np.cross(turn, off)
    right, down, forward = (off + w * across + np.cross(turn, across)).tolist()
    return {"right": right, "down": down, "forward": forward}


def table(rows: Sequence[Row], library: Optional[str]) -> Any:
    """The rows in the columns, as a table of the library, or as dicts."""
    if library not in (None, "list", *LIBRARIES):
        raise ValueError(f"library: polars, pandas, pyarrow or list expected, `{library}` given")
    installed = (name for name in LIBRARIES if importlib.util.find_spec(name))
    chosen = library or next(installed, "list")
    if chosen == "list":
        return [{name: read(row) for name, (_, read) in COLUMNS.items()} for row in rows]
    columns = {name: [read(row) for row in rows] for name, (_, read) in COLUMNS.items()}
    module: Any = importlib.import_module(chosen)
    kinds = {name: kind for name, (kind, _) in COLUMNS.items()}
    if chosen == "pyarrow":
        types = {
            "text": module.string(),
            "texts": module.list_(module.string()),
            "whole": module.int64(),
            "number": module.float64(),
        }
        return module.table(columns, schema=module.schema([(name, types[kind]) for name, kind in kinds.items()]))
    if chosen == "polars":
        types = {
            "text": module.String,
            "texts": module.List(module.String),
            "whole": module.Int64,
            "number": module.Float64,
        }
        return module.DataFrame(columns, schema={name: types[kind] for name, kind in kinds.items()}, strict=False)
    dtypes = {"text": "object", "texts": "object", "whole": "Int64", "number": "float64"}
    return module.DataFrame(
        {name: module.Series(values, dtype=dtypes[kinds[name]]) for name, values in columns.items()}
    )
