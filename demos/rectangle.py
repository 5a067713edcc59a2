"""A rectangular silicon-nitride membrane: the closed form of its modes, and its Duffing folds.

A film of length a and width b under the tension T has the frequencies

    f_mn = 1/2 sqrt(T/(rho h)) sqrt(m^2/(a - 2 l)^2 + n^2/(b - 2 l)^2) (1 + (k_mn l)^2/2)

Bending keeps the film flat within l = sqrt(D/T) of its clamped edges, as if it were smaller, and
stiffens waves of wavenumber k_mn; l is 0.25 um of a millimetre here, yet f11 rises by 6e-4.
The fundamental mode is a Duffing resonator, m q'' + c q' + k q + b q^3 = p J cos(omega t), whose
peak follows omega^2 = (k + 3/4 b q^2)/m.

    python demos/rectangle.py [DIRECTORY]   leaves rom.h5, response.h5, pictures and summary.json
"""

import sys
from math import hypot, pi, sqrt, tau
from pathlib import Path

import nanorom


def main(directory="results/rectangle", **changes):
    """Run the scene, with changes as of Scene.with_, and hold it against the closed forms."""
    scene = nanorom.Scene.from_file(Path(__file__).with_suffix(".toml")).with_(**changes)
    nanorom.run(scene, directory)
    model = nanorom.ReducedModel.load(Path(directory) / "rom.h5")
    response = nanorom.Response.load(Path(directory) / "response.h5")
    film, material, h = scene.geometry, scene.material, scene.plate.thickness
    rigidity = material.youngs_modulus * h**3 / (12 * (1 - material.poisson_ratio**2))
    layer = sqrt(rigidity / scene.tension.x)
    speed = sqrt(scene.tension.x / (material.density * h))

    print("mode    nanorom (kHz)  closed form (kHz)  difference")
    for label, frequency in zip(model.label, model.frequency):
        m, n = map(int, label.strip("()").split(","))
        wavenumber = pi * hypot(m / (film.length - 2 * layer), n / (film.width - 2 * layer))
        closed = speed * wavenumber / tau * (1 + (wavenumber * layer) ** 2 / 2)
        difference = frequency / closed - 1
        print(f"{label}  {frequency / 1e3:15.5f}  {closed / 1e3:17.5f}  {difference:10.0e}")

    stiffening = model.b(1)[1, 1, 1] / model.stiffness[0, 0]
    print("\npressure   lower fold (kHz)  upper fold (kHz)  peak q (um)  backbone (kHz)")
    for (pressure, _), diagram in zip(response.drive.levels, response.diagrams):
        folds = sorted(diagram.points("LP"), key=lambda point: point.omega)
        peak = max(branch.amplitude[:, 0].max() for branch in diagram.branches)
        backbone = model.frequency[0] * sqrt(1 + 0.75 * stiffening * peak**2)
        lower, upper = [f"{p.omega / tau / 1e3:.4f}" for p in folds] or ("none", "none")
        print(f"{1e3 * pressure:4g} mPa  {lower:>17} {upper:>17}", end=" ")
        print(f"{1e6 * peak:12.3f}  {backbone / 1e3:14.4f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
