"""posescope: see why a camera pose estimate fails.

>>> import posescope
>>> street = posescope.Scene.street()
>>> result = posescope.localize(street.query("70"), street.reference("62"))
>>> result.grade
'right'

Poses are 4 x 4 ``world_from_camera`` [m]. Camera frame: x right, y down, z forward. Photos are uint8, H x W or
H x W x 3. Clouds are N x 3 in the frame that is named. Nothing prints.
"""

from ._commands import Calibration, Examination, calibration, doctor, evaluate
from ._errors import InputError, InternalError
from ._localize import diagnose, localize
from ._main import main
from ._posescope import Camera, Query, Reference, Scene, __version__, methods
from ._record import Recording, record
from ._result import Confidence, Failure, Opinion, PoseError, Result, Verdict
from ._run import GateError, Run

__all__ = [
    "Calibration",
    "Camera",
    "Confidence",
    "Examination",
    "Failure",
    "GateError",
    "InputError",
    "InternalError",
    "Opinion",
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


def __dir__() -> "list[str]":
    # What is completed: the names of the package, and not those that it imports.
    return sorted(__all__)
