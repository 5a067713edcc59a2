"""Numerical continuation of small polynomial modal systems: periodic orbits, stability,
bifurcations.
"""

from .diagram import Branch, Diagram, SpecialPoint
from .explore import explore
from .system import ModalSystem

__all__ = ["Branch", "Diagram", "ModalSystem", "SpecialPoint", "explore"]
