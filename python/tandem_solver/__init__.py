"""Write a solver for Tandem in Python: implement six methods and call `serve_dem` for the bodies, or seven and
`serve_mpm` for the continuum.

The wire is described in `interface/PROTOCOL.md`, the guide is `docs/solver-authors.md`.
"""

from .config import BODY, DEM, GROUP, LINEAR, MPM, check_fields
from .continuum import serve_mpm
from .control import Fault, NotFinite, Readiness, Refusal
from .session import Answer, Measurement, Step, serve_dem
from .wire import BodyState, GroupState, Ledger, Limits

__all__ = [
    "Answer", "BODY", "BodyState", "DEM", "Fault", "GROUP", "GroupState", "LINEAR", "Ledger", "Limits", "MPM",
    "Measurement", "NotFinite", "Readiness", "Refusal", "Step", "check_fields",
    "serve_dem", "serve_mpm",
]
