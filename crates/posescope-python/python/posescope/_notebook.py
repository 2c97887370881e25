"""What a notebook shows: Rerun's viewer, and pictures."""

from __future__ import annotations

import base64
import importlib
import os
import tempfile
import weakref
from typing import TYPE_CHECKING, Any, Callable

from . import _posescope

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_INSTALL = "Rerun's notebook viewer is not installed; run: pip install 'rerun-sdk[notebook]==0.36.3'"


def show(save: Callable[[str], None]) -> Any:
    """The recording that ``save`` writes, in Rerun's notebook viewer."""
    try:
        rerun: Any = importlib.import_module("rerun")
        notebook: Any = importlib.import_module("rerun.notebook")
        importlib.import_module("rerun_notebook")
    except ImportError as missing:
        raise ImportError(_INSTALL) from missing
    folder = tempfile.TemporaryDirectory(prefix="posescope-")
    path = os.path.join(folder.name, "result.rrd")
    save(path)
    stream = rerun.RecordingStream("posescope")
    stream.log_file_from_path(path)
    viewer = notebook.Viewer(recording=stream)
    # Rerun reads the file while the viewer opens.
    weakref.finalize(viewer, folder.cleanup)
    return viewer


def image(picture: "NDArray[np.uint8]", words: str) -> str:
    """A picture as an element of a page."""
    with tempfile.TemporaryDirectory(prefix="posescope-") as folder:
        path = os.path.join(folder, "picture.png")
        _posescope.save_photo(picture, path)
        with open(path, "rb") as file:
            data = base64.b64encode(file.read()).decode("ascii")
    return f'<img src="data:image/png;base64,{data}" alt="{words}" style="max-width: 100%">'
