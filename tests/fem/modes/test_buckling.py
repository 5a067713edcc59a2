"""Films whose pre-stress relaxes at free edges buckle where it then compresses them."""

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.linalg import eigh

from nanorom.errors import SolverError
from nanorom.fem.mesh.gmsh import MESHES
from nanorom.fem.reduce import reduce_scene
from nanorom.scene.film import Plate, Tension
from nanorom.scene.geometry import Disc, MeshFile, Rectangle
from nanorom.scene.load import Load
from nanorom.scene.material import Material
from nanorom.scene.scene import Accuracy, Modes, Scene
from nanorom.scene.support import Support
from nanorom.scene.units import to_si
from tests.fem.ritz import relaxed

H = 1e-4
HOLE = 0.4  # radius of the hole of annulus.geo
CRITICAL = 14.681970642  # j_11^2: T R^2/D at which a clamped disc buckles
TOLD = 5e-3  # of the factor, on the coarse mesh of the first attempt
FACTOR = r"it buckles at (\S+) of what is stated"


def rigidity(nu):
    return H**3 / (12 * (1 - nu**2))  # E = 1


def film(geometry, edge, tension, nu, **changes):
    """Tension in units of the bending stiffness."""
    given = {
        "geometry": geometry,
        "plate": Plate(H, "plate"),
        "material": Material(1.0, nu, 1.0),
        "tension": Tension(*(rigidity(nu) * t for t in tension)),
        "support": Support(edge),
        "modes": Modes(count=1),
        "accuracy": Accuracy(tolerance=1e-6),
    }
    return Scene(**(given | changes))


def told(scene):
    """The factor that the error names."""
    with pytest.raises(SolverError, match=FACTOR) as error:
        reduce_scene(scene)
    return float(str(error.value).split("buckles at ")[1].split()[0])


def annulus(tension, nu, n, count=14):
    """Factor at which an annulus clamped inside buckles in n diameters, by Ritz' method in r.

    The tension that the free rim lets go leaves u_r = A (r - a^2/r) behind, in closed form.
    """
    s, weight = legendre.leggauss(60)
    r, weight = HOLE + (1 - HOLE) * (s + 1) / 2, weight * (1 - HOLE) / 2
    q = HOLE**2
    rim = (1 + nu) + (1 - nu) * q
    across = tension * (1 - ((1 + nu) + (1 - nu) * q / r**2) / rim)
    around = tension * (1 - ((1 + nu) - (1 - nu) * q / r**2) / rim)
    p = [
        np.array([legendre.legval(s, legendre.legder(c, d) if d else c) for c in np.eye(count)])
        * (2 / (1 - HOLE)) ** d
        for d in range(3)
    ]
    g = (r - HOLE) ** 2, 2 * (r - HOLE), 2.0
    w, slope = g[0] * p[0], g[1] * p[0] + g[0] * p[1]
    curved = g[2] * p[0] + 2 * g[1] * p[1] + g[0] * p[2]
    turned, twisted = slope / r - n**2 * w / r**2, n * (slope / r - w / r**2)

    def product(one, other, by=1.0):
        return (one * r * weight * by) @ other.T

    mixed = product(curved, turned)
    bending = product(curved, curved) + product(turned, turned) + nu * (mixed + mixed.T)
    bending += 2 * (1 - nu) * product(twisted, twisted)
    pulled = product(slope, slope, across) + product(n * w / r, n * w / r, around)
    return 1 / eigh(-pulled, bending, eigvals_only=True)[-1]


def test_an_annulus_clamped_inside_buckles_under_tension():
    """Random scene 61: it shrinks onto its clamp."""
    nu, tension = -0.227, 148.0
    factor = min(annulus(tension, nu, n) for n in range(4))
    edge = {"outer": "free", "inner": "clamped"}
    scene = film(MeshFile(MESHES / "annulus.geo", scale=1.0), edge, (tension, tension), nu)
    assert told(scene) == pytest.approx(factor, rel=TOLD)
    below = scene.with_(tension=Tension.isotropic(0.9 * factor * tension * rigidity(nu)))
    assert reduce_scene(below).frequency[0] > 0


@pytest.mark.parametrize(
    ("sides", "width", "tension", "nu"),
    [("fcfc", 0.386, (1.17e4, 8.74e3), -0.137), ("fsfc", 0.66, (8.69e3, 1.05e4), 0.146)],
)
def test_rectangles_with_free_sides_buckle_where_ritz_has_it(sides, width, tension, nu):
    """Random scenes 40 and 75: the held corner takes the pull of both free sides."""
    names = {"c": "clamped", "s": "simply_supported", "f": "free"}
    edge = dict(zip(("left", "right", "bottom", "top"), (names[side] for side in sides)))
    scene = film(Rectangle(1.0, width), edge, tension, nu)
    coarse, fine = (relaxed(sides, width, nu, tension, *n) for n in ((10, 14), (14, 18)))
    assert told(scene) == pytest.approx(fine, rel=TOLD + abs(coarse / fine - 1))


def test_a_change_of_stress_is_part_of_what_buckles_a_film():
    """Without tension a drum that shrinks its frame buckles as one that is compressed."""
    stress = -30 * rigidity(0.3) / H
    scene = film(Disc(1.0), "clamped", (10, 10), 0.3, load=Load(stress=stress))
    with pytest.raises(SolverError, match="the film buckles at 0.734") as error:
        reduce_scene(scene)
    told = str(error.value).split("tension is ")[1].split(":")[0]
    critical = to_si(told, "N/m", "tension")
    assert critical == pytest.approx(-CRITICAL * rigidity(0.3), rel=1e-6)
