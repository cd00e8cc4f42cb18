"""Write a solver for Tandem in Python: for bodies five methods and `serve_dem`, for a continuum seven and `serve_mpm`.

The wire is described in `interface/PROTOCOL.md`, the guide is `docs/solver-authors.md`. `contact` has the contact of bodies
with points for a solver that has none.
"""

from .config import BODY, DEM, GROUP, LINEAR, MPM, check_fields
from .contact import PointContact, Shape
from .continuum import serve_mpm
from .control import Fault, NotFinite, Readiness, Refusal
from .ledger import Motion
from .session import Measurement, Step, serve_dem
from .wire import BodyState, GroupState, Ledger, Limits

__all__ = [
    "BODY", "BodyState", "DEM", "Fault", "GROUP", "GroupState", "LINEAR", "Ledger", "Limits", "MPM",
    "Measurement", "Motion", "NotFinite", "PointContact", "Readiness", "Refusal", "Shape", "Step", "check_fields",
    "serve_dem", "serve_mpm",
]
