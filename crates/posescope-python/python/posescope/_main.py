"""The command."""

from __future__ import annotations

import signal
import sys
from typing import List, Optional

from . import _posescope


def main(arguments: Optional[List[str]] = None) -> int:
    """The command ``posescope``: runs it with these arguments and returns its exit code.

    Args:
        arguments: The arguments without the program's name; by default those of this process.
    """
    words = sys.argv[1:] if arguments is None else list(arguments)
    # As in the program: commands end cleanly themselves, and Ctrl-C kills what does not.
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        return _posescope.main(["posescope", *words])
    finally:
        signal.signal(signal.SIGINT, before)
