"""What takes energy out of a mode, each mechanism by itself: 1/Q by name.

Stored energy is that of bending, stretching and tension together; the material loses of the first
two alone, so that tension dilutes its loss (Gonzalez and Saulson 1994, doi:10.1121/1.410467;
Unterreithmeier et al. 2010, doi:10.1103/PhysRevLett.105.027205).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np

from nanorom.errors import AccuracyWarning
from nanorom.scene.elasticity import Law, as_law, scaled
from nanorom.scene.material import GAS_CONSTANT
from nanorom.scene.scene import Scene
from nanorom.scene.support import deflection_of

UNSURE = 0.1  # relative error of a mode's loss that is told aloud
TURNING = 10.0  # more error than of frequencies where held edges turn: see `told`; measured up to 8
APART = 1e-6  # modes whose squared frequencies differ by less (relative) are turned by rules
THIN = 0.1  # h by thermal lengths up to which the series of Zener's function has more digits


@attrs.frozen(eq=False)
class Motion:
    """What losses of L modes follow from, in SI.

    frequency (L,) Hz; stiffness (L,) N/m of all that stores energy; strained (L, L) N/m: the part
    of bending and of linear stretching; dilated (L,) N/m: see `dilated`, of a strip that is free to
    bend across E I int kappa^2; mass (L,) kg; square (L,) m^2, int phi^2; lossy (L,) N/m: of
    `strained` each place's times its E''/E', None where the material is one; squeezed (L,) complex
    N/m: of the gas in a gap, None without one; pulling (L,) N^2/m^3: int V^2 ds of the force V per
    length of the held edges on the frame, None where that does not move.
    """

    frequency: np.ndarray
    stiffness: np.ndarray
    strained: np.ndarray
    dilated: np.ndarray
    mass: np.ndarray
    square: np.ndarray
    lossy: np.ndarray | None = None
    squeezed: np.ndarray | None = None
    pulling: np.ndarray | None = None

    @property
    def omega(self) -> np.ndarray:
        """Angular frequencies (L,) in rad/s."""
        return 2 * np.pi * self.frequency


def material(scene: Scene, motion: Motion) -> np.ndarray | None:
    """Loss factors of the modulus, each times the share of energy that its material stores."""
    loss = scene.material.loss
    if motion.lossy is not None:
        return motion.lossy / motion.stiffness if motion.lossy.any() else None
    return loss * np.diag(motion.strained) / motion.stiffness if loss else None


def thermoelastic(scene: Scene, motion: Motion) -> np.ndarray | None:
    """Heat that flows between the compressed and the stretched side of a bent film.

    Lifshitz and Roukes 2000, eq. 40, doi:10.1103/PhysRevB.61.5600; that of plates has the trace of
    the curvature in its place (Norris and Photiadis 2005, doi:10.1093/qjmam/hbi003).
    """
    known, h = scene.material, scene.plate.thickness
    if known.expansion is None or known.conductivity is None or known.specific_heat is None:
        return None
    if not scene.bends_with_loss:
        return None
    capacity = known.density * known.specific_heat
    strength = known.youngs_modulus * known.expansion**2 * known.temperature / capacity
    xi = h * np.sqrt(motion.omega * capacity / (2 * known.conductivity))
    return strength * zener(xi) * motion.dilated / motion.stiffness


def dilated(scene: Scene) -> Law:
    """Moments by D of the law whose energy int h^3/12 (beta.kappa)^2/E thermal stress feeds on.

    beta = C (1, 1, 0) is the stress of a strain that is the same in every direction; of an
    isotropic film E h^3/12/(1 - nu)^2 int (tr kappa)^2.
    """
    material, h = scene.material, scene.plate.thickness
    beta = np.array(material.law) @ [1.0, 1.0, 0.0]
    unit = material.youngs_modulus * h**3 / 12 / material.bending_stiffness(h)
    return scaled(as_law(np.outer(beta, beta)), unit)


def zener(xi: np.ndarray) -> np.ndarray:
    """6/xi^2 - 6/xi^3 (sinh xi + sin xi)/(cosh xi + cos xi), in which small xi cancel (n,)."""
    small = xi < THIN
    x = np.where(small, 1.0, xi)
    decay = np.exp(-x)
    sinh, cosh = (1 - decay**2) / 2, (1 + decay**2) / 2
    ratio = (sinh + decay * np.sin(x)) / (cosh + decay * np.cos(x))
    series = xi**2 / 5 - 31 / 3780 * xi**6
    return np.where(small, series, 6 / x**2 - 6 / x**3 * ratio)


def gas(scene: Scene, motion: Motion) -> np.ndarray | None:
    """Drag of a gas whose molecules meet the film alone, on both sides.

    Christian 1966, doi:10.1016/0042-207X(66)91162-6: 4 p sqrt(2 M/(pi R T)) per area and velocity.
    """
    if scene.gas is None:
        return None
    speed = np.sqrt(np.pi * GAS_CONSTANT * scene.gas.temperature / (2 * scene.gas.molar_mass))
    drag = 4 * scene.gas.pressure / speed
    sides = 1.0 if scene.gas.gap is None else 0.5  # the other one is that of `squeeze`
    return sides * drag * motion.square / (motion.mass * motion.omega)


def squeeze(scene: Scene, motion: Motion) -> np.ndarray | None:
    """Gas that flows out of and into the gap below the film."""
    if motion.squeezed is None:
        return None
    return motion.squeezed.imag / (motion.stiffness + motion.squeezed.real)


def radiation(scene: Scene, motion: Motion) -> np.ndarray | None:
    """What the film's edge pulls out of a frame of a given impedance, per cycle.

    The frame gives way at V/Z and takes int V^2/(2 Z) ds; to first order in 1/Z, the frame's
    stiffness left out (of a string on the Re Z of its supports: Cross and Lifshitz 2001,
    doi:10.1103/PhysRevB.64.085324, who have Z of plates and half spaces).
    """
    if motion.pulling is None or scene.support.impedance is None:
        return None
    return motion.pulling / (scene.support.impedance * motion.mass * motion.omega**3)


Mechanism = Callable[[Scene, Motion], np.ndarray | None]
MECHANISMS: dict[str, Mechanism] = {
    "material": material,
    "thermoelastic": thermoelastic,
    "gas": gas,
    "squeeze": squeeze,
    "radiation": radiation,
}


def told(
    scene: Scene, motion: Motion | None, frequency: np.ndarray, names: Sequence[str]
) -> dict[str, Any]:
    """Estimated relative errors of what bending loses, where it does. Warns where they are large.

    frequency: estimated relative errors (L,) of the frequencies of modes of these names.  The
    energy that a solution leaves out, 2 df/f of all, is lost at most as where the film is lossiest,
    and where tension dilutes loss, all energy is many times the lossy part.  That bending weighs a
    shape otherwise than its stiffness does counts no more where the film bends most in its edge
    layer, for which the mesh is made; where a held edge may turn the shape hardly bends there, and
    the layer counts that the weight itself makes.  Besides, errors turn modes of near frequencies
    into each other, see `modes.accuracy`.
    """
    if motion is None or not scene.bends_with_loss:
        return {}
    share = np.diag(motion.strained) / motion.stiffness
    lossiest = max(scene.material.loss, *(region.loss or 0.0 for region in scene.regions), 0.0)
    if motion.lossy is not None and lossiest:
        share = motion.lossy / (lossiest * motion.stiffness)
    left_out = np.divide(2 * frequency, share, out=np.full_like(share, np.inf), where=share > 0)
    held = [kind for kind in map(deflection_of, scene.supports.values()) if kind != "free"]
    if any(kind != "clamped" for kind in held):
        left_out = TURNING * left_out
    errors = left_out + _turned(motion, frequency)
    worst = int(errors.argmax())
    if not errors[worst] <= UNSURE:
        ask = 10 ** np.floor(np.log10(0.5 * UNSURE * max(share[worst], np.finfo(float).eps)))
        warnings.warn(
            f"the loss of mode {names[worst]} is known to {errors[worst]:.0e} only, since tension "
            f"stores all but {share[worst]:.0e} of its energy; ask for accuracy.tolerance = "
            f"{ask:g}, or less",
            AccuracyWarning,
            stacklevel=2,
        )
    return {"error_losses": errors}


def _turned(motion: Motion, frequency: np.ndarray) -> np.ndarray:
    """What errors (L,) of frequencies change of lossy energies (L,) by mixing modes, relative."""
    scale = np.sqrt(motion.mass)
    lossy = np.abs(motion.strained) / np.outer(scale, scale)
    squares = motion.omega**2
    apart = np.abs(squares[:, None] - squares) / np.sqrt(np.outer(squares, squares))
    error = 2 * np.sqrt(np.outer(frequency, frequency))
    angle = np.divide(error, apart, out=np.zeros_like(error), where=apart > APART)
    own = np.maximum(np.diag(lossy), np.finfo(float).tiny)
    return np.asarray(2 * (lossy * np.minimum(angle, 1.0)).sum(axis=1) / own)


def losses(scene: Scene, motion: Motion | None) -> dict[str, np.ndarray]:
    """1/Q (L,) of each mechanism that a scene has; none without what they follow from."""
    if motion is None:
        return {}
    found = {name: mechanism(scene, motion) for name, mechanism in MECHANISMS.items()}
    return {name: inverse for name, inverse in found.items() if inverse is not None}
