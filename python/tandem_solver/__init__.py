"""Write a solver for Tandem in Python: implement six methods and call `serve_dem` for the bodies, or seven and
`serve_mpm` for the continuum.

The wire is described in `interface/PROTOCOL.md`, the guide is `docs/solver-authors.md`.
"""

from .continuum import serve_mpm
from .control import Fault, NotFinite, Readiness, Refusal, refuse_unknown
from .session import Answer, Measurement, Step, serve_dem
from .wire import BodyState, GroupState, Ledger, Limits

__all__ = [
    "Answer", "BodyState", "Fault", "GroupState", "Ledger", "Limits", "Measurement", "NotFinite", "Readiness",
    "Refusal", "Step", "refuse_unknown", "serve_dem", "serve_mpm",
]
