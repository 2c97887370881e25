"""What pickle and copy call to make a value of the extension again. Everything here is found by its name in a pickle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional

from . import _posescope

if TYPE_CHECKING:
    from ._posescope import Camera, Query, Reference, Scene


def camera(*numbers: Any) -> "Camera":
    """A camera of its numbers."""
    return _posescope.restored_camera(*numbers)


def scene(path: str, format: Optional[str]) -> "Scene":
    """The scene of this path."""
    return _posescope.restored_scene(path, format)


def query_of(scene: "Scene", name: str) -> "Query":
    """A frame of a scene as a query."""
    return scene.query(name)


def query(*numbers: Any) -> "Query":
    """A query of arrays."""
    return _posescope.restored_query(*numbers)


def reference_of(scene: "Scene", name: str) -> "Reference":
    """A frame of a scene as a reference."""
    return scene.reference(name)


def reference(*numbers: Any) -> "Reference":
    """A reference of arrays."""
    return _posescope.restored_reference(*numbers)
