"""A process that answers as the package's does, in closed form: round membranes of one mode."""

import json
import sys

import numpy as np
from scipy.special import j1, jn_zeros

from nanorom.scene.scene import Scene

J01 = float(jn_zeros(0, 1)[0])
MEMBRANE = """
geometry = { shape = "disc", radius = "2.5 um" }
plate = { thickness = "10 nm", model = "membrane" }
material = { youngs_modulus = "410 GPa", poisson_ratio = 0.16, density = "2267 kg/m^3" }
tension = { value = "0.3 N/m" }
modes = { count = 1 }
accuracy = { tolerance = 1e-4 }
"""


def quantities(scene):
    """Frequency and modal mass, and their powers of the numbers of the scene."""
    h, density, radius = scene.plate.thickness, scene.material.density, scene.geometry.radius
    f = J01 / (2 * np.pi * radius) * np.sqrt(scene.tension.x / (density * h))
    m = np.pi * radius**2 * density * h * float(j1(J01)) ** 2
    powers = {
        "plate.thickness": (-0.5, 1.0),
        "material.density": (-0.5, 1.0),
        "geometry.radius": (-1.0, 2.0),
        "tension.x": (0.25, 0.0),
        "tension.y": (0.25, 0.0),
    }
    values = {"f1": f, "m1": m}
    slopes = {key: {"f1": a * f, "m1": b * m} for key, (a, b) in powers.items()}
    return values, slopes


def answer(job):
    values, slopes = quantities(Scene.from_dict(job["scene"]))
    units = {"f1": "Hz", "m1": "kg"}
    found = {"values": [values[n] for n in job["of"]], "units": [units[n] for n in job["of"]]}
    if job["slopes"]:
        found["slopes"] = {key: [own[n] for n in job["of"]] for key, own in slopes.items()}
    return found


if __name__ == "__main__":
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), flush=True)
