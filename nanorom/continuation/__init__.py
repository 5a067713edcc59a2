"""Numerical continuation of small polynomial modal systems.

Periodic orbits, stability and bifurcations.
"""

from .diagram import Branch, Diagram, SpecialPoint
from .explore import explore
from .levels import explore_levels
from .orbit import PeriodicOrbit
from .states import State, states
from .system import ModalSystem

__all__ = [
    "Branch",
    "Diagram",
    "ModalSystem",
    "PeriodicOrbit",
    "SpecialPoint",
    "State",
    "explore",
    "explore_levels",
    "states",
]
