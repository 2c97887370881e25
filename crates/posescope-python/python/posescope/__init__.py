"""posescope: see why a camera pose estimate fails.

>>> import posescope
>>> street = posescope.Scene.street()
>>> result = posescope.localize(street.query("70"), street.reference("62"))
>>> result.grade
'right'

Poses are 4 x 4 ``world_from_camera`` [m]. Camera frame: x right, y down, z forward. Photos are uint8, H x W or
H x W x 3. Clouds are N x 3 in the frame that is named. Nothing prints.
"""

from __future__ import annotations

import sys
from typing import List, Optional

from . import _posescope
from ._commands import Calibration, Examination, calibration, doctor, evaluate
from ._errors import GateError, InputError, InternalError
from ._localize import diagnose, localize
from ._posescope import Camera, Query, Reference, Scene, __version__, methods
from ._record import Recording, record
from ._result import Confidence, Failure, PoseError, Result, Verdict
from ._run import Run

__all__ = [
    "Calibration",
    "Camera",
    "Confidence",
    "Examination",
    "Failure",
    "GateError",
    "InputError",
    "InternalError",
    "PoseError",
    "Query",
    "Recording",
    "Reference",
    "Result",
    "Run",
    "Scene",
    "Verdict",
    "__version__",
    "calibration",
    "diagnose",
    "doctor",
    "evaluate",
    "localize",
    "main",
    "methods",
    "record",
]


def main(arguments: Optional[List[str]] = None) -> int:
    """The command ``posescope``: runs it with these arguments and returns its exit code.

    Args:
        arguments: The arguments without the program's name; by default those of this process.
    """
    import signal

    words = sys.argv[1:] if arguments is None else list(arguments)
    # As in the program: commands end cleanly themselves, and Ctrl-C kills what does not.
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        return _posescope.main(["posescope", *words])
    finally:
        signal.signal(signal.SIGINT, before)
