"""Numerical continuation of small polynomial modal systems.

Periodic orbits and tori, stability and bifurcations.
"""

from nanorom.continuation.branches.states import State, states
from nanorom.continuation.comb import Comb, comb, record
from nanorom.continuation.curves.backbone import Backbone, backbone
from nanorom.continuation.curves.conditioned import OrbitCurve
from nanorom.continuation.curves.limit_cycles import limit_cycles
from nanorom.continuation.curves.locus import Locus, locus
from nanorom.continuation.curves.phase_resonance import phase_resonance
from nanorom.continuation.curves.rest import RestPoint, RestStates, rest_states
from nanorom.continuation.curves.slopes import PointSlope, point_slopes
from nanorom.continuation.diagrams.course import Course
from nanorom.continuation.diagrams.diagram import Branch, Diagram, SpecialPoint, Unexplored
from nanorom.continuation.diagrams.explore import explore
from nanorom.continuation.diagrams.levels import add_isolas, explore_each, explore_levels
from nanorom.continuation.drive import Drive
from nanorom.continuation.ensemble.basins import Basins, basins
from nanorom.continuation.ensemble.falls import Falls, falls
from nanorom.continuation.ensemble.lyapunov import Lyapunov, lyapunov
from nanorom.continuation.ensemble.sweeps import Sweeps, sweeps
from nanorom.continuation.first_order import FirstOrder
from nanorom.continuation.noise import LinearResponse
from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.continuation.ramp import Ramp, ramp
from nanorom.continuation.readout import Readout, readout
from nanorom.continuation.ringdown import RingDown, ring_down
from nanorom.continuation.sweep import Sweep, sweep
from nanorom.continuation.system import ModalSystem
from nanorom.continuation.tori.follow import follow_torus
from nanorom.continuation.tori.motion import QuasiPeriodic
from nanorom.continuation.tori.torus import ResonanceTongue, Torus, TorusPoint, TorusState
from nanorom.continuation.tori.two_tone import Tone, two_tones

__all__ = [
    "Backbone",
    "Basins",
    "Branch",
    "Comb",
    "Course",
    "Diagram",
    "Drive",
    "Falls",
    "FirstOrder",
    "LinearResponse",
    "Locus",
    "Lyapunov",
    "ModalSystem",
    "OrbitCurve",
    "PeriodicOrbit",
    "PointSlope",
    "QuasiPeriodic",
    "Ramp",
    "Readout",
    "ResonanceTongue",
    "RestPoint",
    "RestStates",
    "RingDown",
    "SpecialPoint",
    "State",
    "Sweep",
    "Sweeps",
    "Tone",
    "Torus",
    "TorusPoint",
    "TorusState",
    "Unexplored",
    "add_isolas",
    "backbone",
    "basins",
    "comb",
    "explore",
    "explore_each",
    "explore_levels",
    "falls",
    "follow_torus",
    "limit_cycles",
    "locus",
    "lyapunov",
    "phase_resonance",
    "point_slopes",
    "ramp",
    "readout",
    "record",
    "rest_states",
    "ring_down",
    "states",
    "sweep",
    "sweeps",
    "two_tones",
]
