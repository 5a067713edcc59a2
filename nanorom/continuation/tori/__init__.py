"""Quasi-periodic motion: tori of the modal equations, their stability and bifurcations."""

from .follow import follow_torus
from .motion import QuasiPeriodic
from .torus import Torus, TorusPoint, TorusState

__all__ = ["QuasiPeriodic", "Torus", "TorusPoint", "TorusState", "follow_torus"]
