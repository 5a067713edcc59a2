"""A silicon-nitride string under high stress: the Duffing resonator with a closed form.

A string of length L and area A = width h under the stress s, stiffened at its clamped ends by
bending, deflects by w = sin(n pi x/L) q(t) away from the ends; stretching adds a cubic force:

    f_n = n/(2 L) sqrt(s/rho) (1 + 2 e + (4 + n^2 pi^2/2) e^2),  e = sqrt(D/(s h))/L
    m q'' + c q' + k q + b q^3 = p J cos(omega t),               b = E A pi^4/(8 L^3)

It is bistable beyond p J = (4/3)^(5/4) k sqrt(k/b) Q^(-3/2) (Lifshitz and Cross,
doi:10.1002/9783527626359.ch1).

    python demos/nitride_string.py [DIRECTORY]   leaves rom.h5, response.h5, pictures ...
"""

import sys
from math import pi, sqrt, tau
from pathlib import Path

import nanorom


def main(directory="results/string", **changes):
    """Run the scene, with changes as of Scene.with_, and hold it against the closed forms."""
    scene = nanorom.Scene.from_file(Path(__file__).with_name("string.toml")).with_(**changes)
    nanorom.run(scene, directory)
    model = nanorom.ReducedModel.load(Path(directory) / "rom.h5")
    response = nanorom.Response.load(Path(directory) / "response.h5")
    length, width, h = scene.geometry.length, scene.geometry.width, scene.plate.thickness
    modulus, nu = scene.material.youngs_modulus, scene.material.poisson_ratio
    tension, density = scene.tension.x, scene.material.density

    e = sqrt(modulus * h**3 / (12 * (1 - nu**2)) / tension) / length
    print("mode    nanorom (kHz)  closed form (kHz)  difference")
    for label, frequency in zip(model.label, model.frequency):
        n = int(label[1])
        closed = n / (2 * length) * sqrt(tension / (density * h))
        closed *= 1 + 2 * e + (4 + (n * pi) ** 2 / 2) * e**2
        both = f"{frequency / 1e3:15.4f}  {closed / 1e3:17.4f}"
        print(f"{label}  {both}  {frequency / closed - 1:10.0e}")

    k, b, force = model.stiffness[0, 0], model.b(1)[1, 1, 1], model.drive["pressure"][0]
    closed = modulus * width * h * pi**4 / (8 * length**3)
    print(f"\nb111 = {b:.5e} N/m^3, closed form {closed:.5e} N/m^3")
    quality = scene.damping.quality_factor[0]
    onset = (4 / 3) ** 1.25 * k * sqrt(k / b) * quality**-1.5 / force
    print(f"bistable beyond {onset:.4f} Pa\n")
    for (pressure, _), diagram in zip(response.drive.levels, response.diagrams):
        folds = sorted(f"{point.omega / tau / 1e3:.4f}" for point in diagram.points("LP"))
        print(f"{pressure:g} Pa:", f"folds at {' and '.join(folds)} kHz" if folds else "no fold")


if __name__ == "__main__":
    main(*sys.argv[1:])
