"""Reads the frames of a run (`output.frames`), and writes them as VTKHDF.

    python3 -m tandem_frames RUN [--out FOLDER]

`in_paraview.py` in this folder opens a run in ParaView. docs/frames.md says what frames hold. `tandem_frames.vtkhdf` needs h5py.
"""

from .frames import Frame, FrameError, Frames, Mesh, frames

__all__ = ["Frame", "FrameError", "Frames", "Mesh", "frames"]
