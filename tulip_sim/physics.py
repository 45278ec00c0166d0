"""pybullet, without the line that its import prints."""

from __future__ import annotations

import os
import sys

__all__ = ["pybullet"]

# The library's C code writes its build time to standard error, where people look for errors.
sys.stderr.flush()
_stderr = os.dup(2)
_nowhere = os.open(os.devnull, os.O_WRONLY)
try:
    os.dup2(_nowhere, 2)
    import pybullet
finally:
    os.dup2(_stderr, 2)
    os.close(_stderr)
    os.close(_nowhere)
