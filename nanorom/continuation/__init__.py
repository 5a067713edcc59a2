"""Numerical continuation of small polynomial modal systems.

Periodic orbits, stability and bifurcations.
"""

from .backbone import Backbone, backbone
from .diagram import Branch, Diagram, SpecialPoint
from .explore import explore
from .levels import add_isolas, explore_each, explore_levels
from .locus import Locus, locus
from .orbit import PeriodicOrbit
from .states import State, states
from .sweep import Sweep, sweep
from .system import ModalSystem

__all__ = [
    "Backbone",
    "Branch",
    "Diagram",
    "Locus",
    "ModalSystem",
    "PeriodicOrbit",
    "SpecialPoint",
    "State",
    "Sweep",
    "add_isolas",
    "backbone",
    "explore",
    "explore_each",
    "explore_levels",
    "locus",
    "states",
    "sweep",
]
