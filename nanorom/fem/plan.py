"""What a scene needs, what is left out, and why: decided once, before anything is computed.

A wrong skip is a wrong answer: whatever is not certain to make no difference is computed.
"""

from __future__ import annotations

from math import comb

import attrs
import numpy as np

from nanorom.fem.mesh import discretisation
from nanorom.fem.mesh.discretisation import Discretisation
from nanorom.fem.scales import Scales
from nanorom.fem.symmetry import Mirrors, is_of_revolution, is_symmetric
from nanorom.fem.tensors.step import EXTRAPOLATED
from nanorom.scene.geometry import Disc, MeshFile
from nanorom.scene.scene import Scene

SHELL_DEGREE = 6  # unless the scene states one: higher ones take long to compile

BENDING_FACTOR = 4.0  # from wavenumber x layer to a bound on the effect of bending: 30 times safe
# measured on drums, one core of 2020: s, and s per degree of freedom, also per pair of modes and
# per load case
SECONDS_FIXED, SECONDS_PER_DOF = 0.03, 1.3e-4
SECONDS_PER_PAIR, SECONDS_PER_CASE = 7e-7, 1.8e-6
BYTES_PER_DOF = 3e3  # per degree of the deflection: peak of a group with factors, rounded up
SHARE = 0.5  # of the free memory that a default may fill


@attrs.frozen
class Item:
    """One line of a plan: what, whether it is computed, and why (not)."""

    what: str
    computed: bool
    why: str


@attrs.frozen
class Plan:
    """Decisions about a scene.

    bending: with bending stiffness; bending_effect: a bound on its relative effect, None where it
    is not in question; scales: units of the computation.
    """

    scene: Scene
    bending: bool
    bending_effect: float | None
    scales: Scales

    @classmethod
    def of(cls, scene: Scene) -> Plan:
        """Plan of a scene."""
        effect = bending_effect(scene)
        tolerance = scene.accuracy.tolerance
        bending = scene.plate.model != "membrane"
        if scene.plate.model == "auto" and effect is not None and tolerance is not None:
            bending = effect > tolerance
        return cls(scene, bending, effect, Scales.of(scene, bending))

    @property
    def layer(self) -> float:
        """Width sqrt(D/T) of the edge layer in units of the scene's length; 0 without bending."""
        tension = max(self.scene.tension.x, self.scene.tension.y, 1e-300)
        return float(np.sqrt(self.scales.bending * self.scales.tension / tension))

    def discretisation(self, aim: float | None) -> Discretisation:
        """Mesh and degree for an aimed error."""
        return discretisation.choose(self.scene, self.scales.length, self.layer, aim)

    @property
    def cut(self) -> Mirrors:
        """Mirrors at which the meshed part ends; none where states mix modes of every parity."""
        scene = self.scene
        alike = scene.flat or is_symmetric(scene) and scene.reduction.method == "direct"
        return self.discretisation(scene.accuracy.tolerance).mirrors if alike else Mirrors()

    def groups(self, ranks: int, memory: float) -> int:
        """How many groups are the fastest: of them, each has the whole mesh in its part of memory.

        Groups share classes of symmetry, which wait for each other less than ranks that share a
        mesh.  memory : free bytes.
        """
        if ranks == 1 or self.scene.plate.model in ("shell", "beam"):
            return 1
        most = self.cut.copies
        if (dofs := self.dofs) is not None:
            most = min(most, int(SHARE * memory / (BYTES_PER_DOF * self.degree * dofs)))
        return max(g for g in range(1, ranks + 1) if ranks % g == 0 and g <= max(most, 1))

    @property
    def degree(self) -> int:
        """Degree of the deflection."""
        return self.discretisation(self.scene.accuracy.tolerance).degree

    @property
    def dofs(self) -> int | None:
        """About how many degrees of freedom w has; None for a mesh file, not yet read."""
        chosen = self.discretisation(self.scene.accuracy.tolerance)
        cells = discretisation.cells_of(chosen)
        return None if cells is None else int(cells * chosen.degree**2 / 2 * 1.05)

    @property
    def route(self) -> str:
        """How the tensors are found: a shell's by STEP alone."""
        return "step" if self.scene.plate.model == "shell" else self.scene.reduction.method

    @property
    def load_cases(self) -> tuple[int, int]:
        """Static solutions of the scene's route, and how many there would be without skips."""
        n, method = len(self.scene.modes.numbers), self.route
        if method == "direct":
            return comb(n + 1, 2), comb(n + 1, 2)
        if method == "tangent":
            return n + comb(n, 2), 2 * n + comb(n, 2)
        if self.scene.plate.model == "shell":  # and opposites of all, to tell even from odd
            amplitudes = EXTRAPOLATED if self.scene.reduction.amplitude is None else 1
            every = amplitudes * (2 * n + 4 * comb(n, 2) + 2 * comb(n, 3))
            return every, every
        every = 2 * n + 3 * comb(n, 2) + comb(n, 3)
        return (n + 2 * comb(n, 2) + comb(n, 3) if self.scene.flat else every), every

    def items(self) -> list[Item]:
        """Everything that could be computed, in the order of the computation."""
        scene, chosen = self.scene, self.discretisation(self.scene.accuracy.tolerance)
        n = len(scene.modes.numbers)
        cases, all_cases = self.load_cases
        mirrors = Mirrors() if scene.plate.model == "shell" else chosen.mirrors
        found = [
            self._state_item(),
            self._bending_item(),
            _mirror_item(mirrors),
            Item(
                f"{scene.modes.highest} lowest modes",
                True,
                "no mode beyond them but the partners of near ones",
            ),
            Item("quadratic tensor", False, "a flat film without load does not tell its sides")
            if scene.flat and not self._curved
            else Item("quadratic tensor", True, ""),
            Item(f"cubic tensor by {self.route}: {cases} static solutions", True, "")
            if cases == all_cases
            else Item(
                f"cubic tensor by {self.route}: at most {cases} static solutions",
                True,
                f"of {all_cases}: of load cases that are mirror images one is solved",
            ),
            Item(
                f"{n**4 - comb(n + 3, 4)} of {n**4} cubic entries",
                False,
                "they follow from the others: the force has a potential",
            ),
        ]
        if is_of_revolution(scene) and scene.plate.model != "shell":
            found.append(
                Item(
                    "entries whose nodal diameters cannot add up to 0",
                    False,
                    "they are zero on a body of revolution",
                )
            )
        if scene.reduction.in_plane == "fixed":
            found.append(Item("in-plane equilibrium", False, "reduction.in_plane is fixed"))
        return found

    @property
    def _curved(self) -> bool:
        """The film may be a surface in space: only its mesh file tells."""
        return self.scene.plate.model == "shell" and isinstance(self.scene.geometry, MeshFile)

    def _state_item(self) -> Item:
        scene = self.scene
        if scene.load is not None:
            return Item("static state under load", True, "the model is expanded about it")
        if "free" in scene.supports.values():
            return Item("pre-stress", True, "it relaxes where the tension pulls at a free edge")
        return Item("pre-stress", False, "a constant tension is in equilibrium with its supports")

    def _bending_item(self) -> Item:
        if self.bending_effect is None:
            if not self.bending:
                return Item("bending", False, "the scene's model is membrane")
            if isinstance(self.scene.geometry, MeshFile):
                return Item("bending", True, "the wavelengths on a mesh file are not known")
            return Item("bending", True, "a direction without tension: nothing to compare it with")
        effect = f"a bound on its effect is {self.bending_effect:.1e}"
        if self.scene.plate.model != "auto":
            return Item("bending", self.bending, f"the scene's model is {self.scene.plate.model}")
        tolerance = self.scene.accuracy.tolerance
        if tolerance is None:
            return Item("bending", True, f"{effect}, and the scene states no tolerance")
        relation = "more" if self.bending else "less"
        return Item("bending", self.bending, f"{effect}, {relation} than the tolerance")

    def cost(self) -> str:
        """Predicted size and run time, in words."""
        chosen = self.discretisation(self.scene.accuracy.tolerance)
        cells = discretisation.cells_of(chosen)
        if cells is None:
            return f"degree {chosen.degree} on the mesh of {chosen.file.name}"
        if self.scene.plate.model == "shell":
            cells *= chosen.mirrors.copies
            return f"{cells} cells of degree {self.scene.accuracy.degree or SHELL_DEGREE} or more"
        dofs = self.dofs or 0
        seconds = SECONDS_FIXED + SECONDS_PER_DOF * dofs
        if self.route == "direct":
            seconds += SECONDS_PER_PAIR * self.load_cases[0] * dofs
        else:
            columns = self.load_cases[0]
            if self.route == "tangent":
                columns *= len(self.scene.modes.numbers)
            seconds += SECONDS_PER_CASE * columns * dofs
        return (
            f"{cells} cells of degree {chosen.degree}, about {dofs} degrees of freedom of the "
            f"deflection, about {seconds:.1g} s on one core, once the forms are compiled"
        )


def _mirror_item(mirrors: Mirrors) -> Item:
    if not mirrors.axes:
        return Item("the whole film", True, "it is not cut at mirrors")
    part = {2: "half", 4: "three quarters"}[mirrors.copies]
    return Item(
        f"{part} of the film",
        False,
        f"its own mirror image in {' and '.join(mirrors.axes)}; products of odd parity vanish",
    )


def bending_effect(scene: Scene) -> float | None:
    """Bound on the relative effect of bending on frequencies and tensors.

    At a clamped edge the film is stiff over a layer sqrt(D/T), as if it were shorter by that; None
    where there is no tension, or for a mesh file, whose wavelengths are not known beforehand.
    """
    scales = Scales.of(scene)
    smallest = min(scene.tension.x, scene.tension.y)
    supports = scene.supports.values()
    if isinstance(scene.geometry, MeshFile) or smallest <= 0 or scene.plate.model == "membrane":
        return None
    wavenumber = discretisation.shortest_wave(scene.geometry, scene.modes.highest) * scales.length
    size = 1.0 if isinstance(scene.geometry, Disc) else scene.geometry.width / scales.length
    layer = float(np.sqrt(scales.bending * scales.tension / smallest))
    scaled = BENDING_FACTOR * max(wavenumber, 1 / size) * layer
    return scaled if "clamped" in supports or scene.support.springs else scaled**2
