"""What the film is made of, and the gas about it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import attrs

from nanorom.errors import SceneError
from nanorom.scene import elasticity, units
from nanorom.scene import fields as v
from nanorom.scene.units import with_unit

if TYPE_CHECKING:
    from nanorom.scene.film import Plate

GAS_CONSTANT = 8.31446261815324  # J/mol/K, exact
SLIP, SLIP_POWER = 9.638, 1.159  # of the effective viscosity (Veijola et al. 1995)
THERMAL = ("expansion", "conductivity", "specific_heat")  # keys that are given together


@attrs.frozen(field_transformer=v.readers)
class Material:
    """Linear elastic material, and what it makes of motion and heat.

    youngs_modulus in Pa, poisson_ratio, density in kg/m^3.  Of a crystal those are of its first
    axis, at an ``orientation`` (rad) from x, and from it to the second; youngs_modulus_2 and
    shear_modulus in Pa are what isotropy does not give.  bending : stiffness in N m that does not
    follow from the thickness, as of few layers.  loss : E''/E' of the complex modulus.
    With expansion (1/K), conductivity (W/m/K) and specific_heat (J/kg/K), all or none of them, bent
    films lose energy to heat that flows through their thickness, at a temperature in K.
    Raises SceneError.
    """

    youngs_modulus: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity("material.youngs_modulus", "Pa", about="Young's modulus E"),
    )
    poisson_ratio: float = attrs.field(
        converter=v.as_quantity,
        metadata=v.quantity(
            "material.poisson_ratio", "1", v.within(-1, 0.5), about="Poisson's ratio"
        ),
    )
    density: float = attrs.field(
        converter=v.as_quantity, metadata=v.quantity("material.density", "kg/m^3", about="density")
    )
    youngs_modulus_2: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "material.youngs_modulus_2", "Pa", about="of a crystal, along its second axis"
        ),
    )
    shear_modulus: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("material.shear_modulus", "Pa", about="of a crystal, between its axes"),
    )
    orientation: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "material.orientation", "rad", v.ANY, about="of a crystal's first axis from x"
        ),
    )
    bending: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "material.bending", "J", about="bending stiffness D where it is not that of a plate"
        ),
    )
    loss: float = attrs.field(
        default=0.0,
        converter=v.as_quantity,
        metadata=v.quantity(
            "material.loss",
            "1",
            v.SHARE,
            about="E''/E' of the complex modulus: what a mode loses of its bending energy",
        ),
    )
    expansion: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity(
            "material.expansion", "1/K", v.ANY, about="linear thermal expansion alpha"
        ),
    )
    conductivity: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("material.conductivity", "W/m/K", about="thermal conductivity"),
    )
    specific_heat: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("material.specific_heat", "J/kg/K", about="specific heat capacity"),
    )
    temperature: float = attrs.field(
        default=293.0,
        converter=v.as_quantity,
        metadata=v.quantity("material.temperature", "K", about="of the film at rest"),
    )

    def __attrs_post_init__(self) -> None:
        self._check_crystal()
        known = [getattr(self, name) is not None for name in THERMAL]
        if any(known) and not all(known):
            missing = THERMAL[known.index(False)]
            raise SceneError(f"material.{missing}: missing; allowed: all of {', '.join(THERMAL)}")

    def _check_crystal(self) -> None:
        """Raise SceneError for a crystal that is not whole, or stores no energy in some strain."""
        if self.youngs_modulus_2 is not None and self.shear_modulus is None:
            raise SceneError("material.shear_modulus: missing; a crystal needs it")
        if self.orientation and not self.crystalline:
            raise SceneError("material.shear_modulus: missing; orientation is that of a crystal")
        if self.youngs_modulus_2 is None:
            return
        most = math.sqrt(self.youngs_modulus / self.youngs_modulus_2)
        if not abs(self.poisson_ratio) < most:
            raise SceneError(
                f"material.poisson_ratio: found {self.poisson_ratio:g}; allowed: less than the "
                f"root of youngs_modulus by youngs_modulus_2, {most:.3g}, either sign"
            )

    @property
    def crystalline(self) -> bool:
        """Its stiffness depends on direction."""
        return self.shear_modulus is not None

    @property
    def law(self) -> elasticity.Law:
        """Plane stress of (xx, yy, 2 xy) along x and y, by youngs_modulus."""
        if self.shear_modulus is None:
            return elasticity.isotropic(self.poisson_ratio)
        e = self.youngs_modulus
        second = 1.0 if self.youngs_modulus_2 is None else self.youngs_modulus_2 / e
        known = elasticity.Engineering(1.0, second, self.poisson_ratio, self.shear_modulus / e)
        return elasticity.orthotropic(known, self.orientation)

    @property
    def held_ratio(self) -> float:
        """1 - nu_12 nu_21: Young's modulus by the stiffness along the first axis alone."""
        second = self.youngs_modulus_2 or self.youngs_modulus
        return 1 - self.poisson_ratio**2 * second / self.youngs_modulus

    def bending_stiffness(self, thickness: float) -> float:
        """D in N m of a film of a thickness in m, along a crystal's first axis."""
        if self.bending is not None:
            return self.bending
        return self.youngs_modulus * thickness**3 / (12 * self.held_ratio)

    @staticmethod
    def of_cubic(c11: v.Quantity, c12: v.Quantity, c44: v.Quantity) -> dict[str, float]:
        """Moduli of a film in the (001) plane of a cubic crystal, of its constants in Pa.

        The orientation is that of [100] from x.  Raises SceneError.
        """
        key = "material.cubic"
        a, b, c = (v.read_quantity(each, "Pa", key, v.POSITIVE) for each in (c11, c12, c44))
        if not b < a:
            raise SceneError(
                f"{key}: found c12 = {with_unit(b, 'Pa', 6)}; allowed: less than c11, "
                f"{with_unit(a, 'Pa', 6)}"
            )
        known = elasticity.of_cubic(a, b, c)
        return {
            "youngs_modulus": known.first,
            "poisson_ratio": known.ratio,
            "youngs_modulus_2": known.second,
            "shear_modulus": known.shear,
        }

    @classmethod
    def from_table(cls, table: Any, plate: Plate) -> Material:
        """Read [material]: youngs_modulus, or stretching E h in N/m, or constants of a cubic one.

        Raises SceneError.
        """
        ways = [key for key in ("youngs_modulus", "stretching", "cubic") if key in table]
        if len(ways) > 1:
            raise SceneError(
                f"material: found {' and '.join(ways)}; allowed: youngs_modulus, or stretching "
                "(E h in N/m), or cubic (c11, c12 and c44)"
            )
        given = dict(table)
        if "stretching" in given:
            key = "material.stretching"
            stretching = v.read_quantity(given.pop("stretching"), "N/m", key, v.POSITIVE)
            given["youngs_modulus"] = stretching / plate.thickness
        if "cubic" in given:
            constants = given.pop("cubic")
            if not v.is_list(constants) or len(constants) != 3:
                raise units.wrong("material.cubic", constants, "a list of c11, c12 and c44")
            for key in ("poisson_ratio", "youngs_modulus_2", "shear_modulus"):
                if key in given:
                    raise SceneError(f"material.{key}: found beside cubic, of which it follows")
            given |= cls.of_cubic(*constants)
        return v.from_table(cls, "material", given)

    @property
    def thermal(self) -> bool:
        """What heat does in it is known."""
        return self.expansion is not None

    @property
    def lossy(self) -> bool:
        """It takes energy out of a film that bends."""
        return self.loss > 0 or self.thermal


@attrs.frozen(field_transformer=v.readers)
class Gas:
    """Gas on both sides of the film: pressure in Pa, temperature in K, molar_mass in kg/mol.

    Without a gap it is rarefied on both sides.  With one, in m, a wall lies below the film, which
    squeezes the gas between them, of a viscosity in Pa s; at its edge the gap is open or sealed.
    """

    pressure: float = attrs.field(
        converter=v.as_quantity, metadata=v.quantity("gas.pressure", "Pa", about="of the gas")
    )
    temperature: float = attrs.field(
        default=293.0,
        converter=v.as_quantity,
        metadata=v.quantity("gas.temperature", "K", about="of the gas"),
    )
    molar_mass: float = attrs.field(
        default=28.96e-3,
        converter=v.as_quantity,
        metadata=v.quantity("gas.molar_mass", "kg/mol", about="of the gas; that of air"),
    )
    gap: float | None = attrs.field(
        default=None,
        converter=v.as_optional_quantity,
        metadata=v.quantity("gas.gap", "m", about="to a wall, where the film squeezes the gas"),
    )
    viscosity: float = attrs.field(
        default=1.82e-5,
        converter=v.as_quantity,
        metadata=v.quantity("gas.viscosity", "Pa*s", about="of the gas in the gap; that of air"),
    )
    edge: str = attrs.field(
        default="open",
        metadata=v.choice(
            "gas.edge", ("open", "sealed"), about="whether gas flows out of the gap at its edge"
        ),
    )

    @property
    def vented(self) -> bool:
        """Gas flows out of the gap at its edge."""
        return self.edge == "open"

    def squeeze_number(self, omega: float, length: float) -> float:
        """12 mu omega L^2/(p g^2) of a length in m at omega in rad/s, mu that of rarefied gas.

        Its mean free path is mu/p sqrt(pi R T/(2 M)).
        """
        assert self.gap is not None
        speed = math.sqrt(math.pi * GAS_CONSTANT * self.temperature / (2 * self.molar_mass))
        knudsen = self.viscosity / self.pressure * speed / self.gap
        viscosity = self.viscosity / (1 + SLIP * knudsen**SLIP_POWER)
        return 12 * viscosity * omega * length**2 / (self.pressure * self.gap**2)
