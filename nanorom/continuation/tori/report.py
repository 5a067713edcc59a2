"""Members of a family of curves as tori in the user's units."""

from __future__ import annotations

import numpy as np

from nanorom.continuation.orbits.orbit import PeriodicOrbit
from nanorom.continuation.tori.course import Course
from nanorom.continuation.tori.family import Family, Member
from nanorom.continuation.tori.motion import QuasiPeriodic, motion
from nanorom.continuation.tori.parameter import Varied
from nanorom.continuation.tori.return_map import ReturnMap
from nanorom.continuation.tori.tongues import Cycle, Tongue
from nanorom.continuation.tori.torus import ResonanceTongue, Torus, TorusPoint, TorusState

SAMPLES = 64  # of a period of the response, to describe a locked orbit


class Report:
    """What a family and the course along it are for the user."""

    def __init__(self, varied: Varied, map_: ReturnMap) -> None:
        self.varied, self.map = varied, map_

    def torus(self, family: Family, course: Course) -> Torus:
        members = course.members

        def at(index: int, parameter: float) -> TorusState:
            wanted = parameter / self.varied.unit
            before, after = members[index : index + 2]
            # the later one knows how the family bends
            near = min((after, before), key=lambda m: abs(m.curve.parameter - wanted))
            return self.state(family, family.at_parameter(near, wanted))

        return Torus(
            [self.state(family, member) for member in members],
            [TorusPoint(event.type, self.state(family, event.member)) for event in course.events],
            [self.tongue(tongue) for tongue in course.tongues],
            [ratio * self.map.parts for ratio in course.missed],
            self.map.period_multiple,
            self.varied.name,
            course.ending,
            at,
        )

    def state(self, family: Family, member: Member) -> TorusState:
        curve, unit = member.curve, self.varied.system
        scaled = motion(self.map, curve)
        user = QuasiPeriodic(
            unit.given(scaled.coefficients),
            scaled.omega * unit.frequency,
            scaled.second * unit.frequency,
            scaled.period_multiple,
        )
        duration = self.map.duration(curve.parameter) / unit.frequency
        return TorusState(
            parameter=curve.parameter * self.varied.unit,
            omega=user.omega,
            second=user.second,
            amplitude=user.amplitude(),
            exponents=member.exponents / duration,
            residual=family.equations.defect(curve),
            harmonics=curve.circle.harmonics,
            motion=user,
        )

    def tongue(self, tongue: Tongue) -> ResonanceTongue:
        unit = self.varied.unit
        return ResonanceTongue(
            ratio=tongue.ratio * self.map.parts,
            low=tongue.low.parameter * unit,
            high=tongue.high.parameter * unit,
            locked=self.orbit(tongue.locked),
            stable=bool(np.abs(tongue.locked.multipliers).max() < 1),
        )

    def orbit(self, cycle: Cycle) -> PeriodicOrbit:
        """The periodic orbit through the states of a cycle, in the order of time."""
        q, parts, unit = len(cycle.states), self.map.parts, self.varied.system
        periods = q // np.gcd(q, parts)
        order = parts * np.arange(periods) % q
        states = self.map.samples(cycle.states[order], cycle.parameter, SAMPLES)
        q_of_time = states[:, :, : unit.size].transpose(1, 0, 2).reshape(-1, unit.size)
        spectrum = np.fft.rfft(q_of_time, axis=0)[: (len(q_of_time) + 1) // 2] / len(q_of_time)
        coefficients = np.empty((2 * len(spectrum) - 1, unit.size))
        coefficients[0] = spectrum[0].real
        coefficients[1::2], coefficients[2::2] = 2 * spectrum[1:].real, -2 * spectrum[1:].imag
        _, omega = self.map.at(cycle.parameter)
        return PeriodicOrbit(
            unit.given(coefficients),
            omega * unit.frequency,
            int(periods) * self.map.period_multiple,
        )
