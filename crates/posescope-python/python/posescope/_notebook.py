"""What a notebook shows: Rerun's viewer, and progress."""

from __future__ import annotations

import importlib
import os
import tempfile
import weakref
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._result import Result

_INSTALL = "Rerun's notebook viewer is not installed; run: pip install 'rerun-sdk[notebook]==0.36.3'"


def show(result: "Result") -> Any:
    """The recording of a result in Rerun's notebook viewer."""
    try:
        rerun: Any = importlib.import_module("rerun")
        notebook: Any = importlib.import_module("rerun.notebook")
        importlib.import_module("rerun_notebook")
    except ImportError as missing:
        raise ImportError(_INSTALL) from missing
    folder = tempfile.TemporaryDirectory(prefix="posescope-")
    path = os.path.join(folder.name, "result.rrd")
    result.save(path)
    stream = rerun.RecordingStream("posescope")
    stream.log_file_from_path(path)
    viewer = notebook.Viewer(recording=stream)
    # Rerun reads the file while the viewer opens.
    weakref.finalize(viewer, folder.cleanup)
    return viewer
