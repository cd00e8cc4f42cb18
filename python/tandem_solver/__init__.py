"""Write a rigid-body solver for Tandem in Python: implement six methods, call `serve_dem`.

The wire is described in `interface/PROTOCOL.md`, the guide is `docs/solver-authors.md`.
"""

from .control import Fault, NotFinite, Readiness, Refusal, refuse_unknown
from .session import Answer, Measurement, Step, serve_dem
from .wire import BodyState, Ledger, Limits

__all__ = [
    "Answer", "BodyState", "Fault", "Ledger", "Limits", "Measurement", "NotFinite", "Readiness", "Refusal", "Step",
    "refuse_unknown", "serve_dem",
]
