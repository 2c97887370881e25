"""The exceptions of posescope."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._run import Run


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


class GateError(Exception):
    """A gate of an evaluation failed.

    Attributes:
        run: The run, which is complete.
    """

    def __init__(self, message: str, run: "Run") -> None:
        # With both, the error can be pickled: a pool of processes passes it on.
        super().__init__(message, run)
        self.run = run

    def __str__(self) -> str:
        return str(self.args[0])
