"""The exceptions of posescope that its extension raises."""

from __future__ import annotations


class InputError(Exception):
    """A file or a scene cannot be used.

    Attributes:
        file: The file, or the name of the scene.
        place: The place in it, such as ``line 3`` or ``frame 000070``; empty for the whole file.
        expected: What was expected there.
    """

    def __init__(self, file: str, place: str, expected: str) -> None:
        super().__init__(file, place, expected)
        self.file = file
        self.place = place
        self.expected = expected

    def __str__(self) -> str:
        return ": ".join(part for part in (self.file, self.place, self.expected) if part)


class InternalError(RuntimeError):
    """A bug of posescope. The message says where it happened."""
