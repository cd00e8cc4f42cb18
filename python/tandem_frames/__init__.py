"""Reads the frames of a run (`output.frames`), and writes them as VTKHDF.

    python3 -m tandem_frames RUN [--out FOLDER]

`in_paraview.py` in this folder opens a run in ParaView. docs/frames.md says what frames hold.
"""

from .frames import Frame, Mesh, frames
from .vtkhdf import write

__all__ = ["Frame", "Mesh", "frames", "write"]
