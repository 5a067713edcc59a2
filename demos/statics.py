"""Static loads: a gate, a bulge test, an AFM's tip, a dome that snaps, a trampoline that relaxes.

Each film is followed from no load to its load, and held against its closed form.

    python demos/statics.py [DIRECTORY]   leaves curves as .csv and .h5, statics.png, trampoline.png
"""

import sys
from math import log, pi
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import nanorom
from nanorom import Load
from nanorom.fem.tuning import tune
from nanorom.plots.modes import mode_gallery
from nanorom.plots.style import COLUMN, save, styled
from nanorom.scene.load import VACUUM_PERMITTIVITY

MESHES = Path(__file__).parents[1] / "meshes"
HENCKY = 0.6534  # w(0) (E h/(p R^4))^(1/3) at nu = 0.3 (Fichter 1997, NASA TP 3658)
PELESKO = 0.7892  # V^2 eps0 R^2/(2 T g^3) at pull-in without stretching (Pelesko, Bernstein 2002)


def gate(points):
    """A graphene drum above a gate: softened by the attraction, then stiffened by stretching."""
    scene = nanorom.Scene.from_file(Path(__file__).with_name("gate.toml"))
    stronger = Load(voltage=20.0, gap=scene.load.gap)  # beyond the pull-in
    curve = nanorom.tune(scene.with_(load=stronger), points)
    radius, tension, gap = scene.geometry.radius, scene.tension.x, scene.load.gap
    soft = np.sqrt(PELESKO * 2 * tension * gap**3 / (VACUUM_PERMITTIVITY * radius**2))
    f = curve.frequency[curve.stable, 0]
    bottom = int(np.flatnonzero(np.diff(f) > 0)[0])  # where it first rises
    print(f"gate: f01 falls by {1 - f[bottom] / f[0]:.2%}, ", end="")
    print(f"rises by {f[bottom:].max() / f[bottom] - 1:.2%}; pulled in at {curve.pull_in:.2f} V")
    print(f"  a rigid plate on the film's mean spring: {curve.lumped:.2f} V")
    print(f"  a membrane that bows but does not stretch: {soft:.2f} V (its middle comes closest)")
    print(f"  stretching stiffens the film, which raises it {curve.pull_in / soft:.2f} times")
    return curve


def bulge(points):
    """A membrane under pressure tends to Hencky's w = 0.6534 (p R^4/(E h))^(1/3)."""
    radius, h, modulus = 50e-6, 50e-9, 250e9
    scene = nanorom.Scene(
        geometry=nanorom.Disc(radius=radius),
        plate=nanorom.Plate(thickness=h, model="membrane"),
        material=nanorom.Material(modulus, 0.3, 3100.0),
        tension=nanorom.Tension.isotropic(0.5),
        modes=nanorom.Modes(3),
        load=Load(pressure=1e6),
    )
    curve = tune(scene, "pressure", np.geomspace(10.0, 1e6, points))
    hencky = HENCKY * np.cbrt(curve.load * radius**4 / (modulus * h))
    print(f"bulge: at {curve.load[-1]:g} Pa {1e6 * curve.centre[-1]:.4f} um, ", end="")
    print(f"Hencky's limit {1e6 * hencky[-1]:.4f} um ({curve.centre[-1] / hencky[-1] - 1:+.2%})")
    return curve, hencky


def indentation(points):
    """A tip in the middle: F = k1 w first, then k3 w^3.

    k1 = 4 pi T/(1 + 2 ln(R/a)) of a membrane under a disc of radius a; k3 = q^3 E h/R^2 with
    q = 1/(1.05 - 0.15 nu - 0.16 nu^2) (Lee et al. 2008, doi:10.1126/science.1157996).
    """
    radius, h, modulus, nu, tension, tip = 1e-6, 0.335e-9, 1e12, 0.165, 0.1, 5e-9
    scene = nanorom.Scene(
        geometry=nanorom.Disc(radius=radius),
        plate=nanorom.Plate(thickness=h, model="membrane"),
        material=nanorom.Material(modulus, nu, 2267.0),
        tension=nanorom.Tension.isotropic(tension),
        modes=nanorom.Modes(1),
        load=Load(force=1e-5, radius=tip),
    )
    curve = tune(scene, "force", np.geomspace(1e-11, 1e-5, points))
    linear = 4 * pi * tension / (1 + 2 * log(radius / tip)) * curve.centre
    cubic = modulus * h * curve.centre**3 / radius**2 / (1.05 - 0.15 * nu - 0.16 * nu**2) ** 3
    print(f"tip: F/(k1 w) - 1 = {curve.load[0] / linear[0] - 1:+.1e} at first, ", end="")
    print(f"F/(k3 w^3) - 1 = {curve.load[-1] / cubic[-1] - 1:+.3f} at last:")
    print("  w ~ 1 - (r/R)^(2/3) ends at the tip's radius a, ", end="")
    print(f"(1 - (a/R)^(2/3))^-3 - 1 = {(1 - (tip / radius) ** (2 / 3)) ** -3 - 1:.3f}")
    return curve, linear, cubic


def dome(points, directory):
    """A clamped shallow cap pressed flat snaps through, along a path that falls in between."""
    radius, h = 2.5e-6, 10e-9
    axis = np.linspace(-1.01, 1.01, 41) * radius
    x, y = (each.ravel() for each in np.meshgrid(axis, axis))
    table = directory / "dome.csv"
    height = 2.5 * h * (1 - (x**2 + y**2) / radius**2)
    np.savetxt(table, np.column_stack([x, y, height]), delimiter=",")
    scene = nanorom.Scene(
        geometry=nanorom.Disc(radius=radius),
        plate=nanorom.Plate(h, "plate", table),
        material=nanorom.Material(410e9, 0.16, 2267.0),
        tension=nanorom.Tension(0.0, 0.0),
        modes=nanorom.Modes(1),
        load=Load(pressure=-6e3),
        accuracy=nanorom.Accuracy(degree=6, mesh_size=radius / 2),
    )
    curve = nanorom.tune(scene, points)
    first, second = curve.limits
    print(f"dome: snaps through at {first:.1f} Pa, back at {second:.1f} Pa")
    return curve


def trampoline(directory, tolerance):
    """Tethers under film stress: where the edges are free the stress relaxes first."""
    scene = nanorom.Scene(
        geometry=nanorom.MeshFile(MESHES / "trampoline.geo", scale=100e-6),
        plate=nanorom.Plate(thickness=100e-9),
        material=nanorom.Material(250e9, 0.23, 3100.0),
        tension=nanorom.Tension.from_stress("500 MPa", 100e-9),
        support=nanorom.Support({"ends": "clamped"}),
        modes=nanorom.Modes(4),
        accuracy=tolerance,
    )
    model = nanorom.reduce(scene)
    model.save(directory / "trampoline.h5")
    mode_gallery(model, directory / "trampoline.png")
    mean = float(model.static["mean_tension"]) / scene.tension.x
    print(f"trampoline: f1 = {model.frequency[0] / 1e3:.1f} kHz, {mean:.1%} of the tension is left")
    return model


@styled
def picture(gated, bulged, tip, snapped, path):
    """Draw the four curves; unstable states are grey."""
    figure = Figure(figsize=(2 * COLUMN, 1.5 * COLUMN), layout="constrained")
    (a, b), (c, d) = figure.subplots(2, 2)
    a.plot(gated.load, gated.frequency[:, 0] / 1e6, ".-", ms=3, label="f01")
    a.axvline(gated.pull_in, color="0.3", lw=0.8, ls=":", label="pull-in")
    a.axvline(gated.lumped, color="C3", lw=0.8, ls="--", label="lumped estimate")
    a.set(title="gate", xlabel="voltage (V)", ylabel="frequency (MHz)")
    curve, hencky = bulged
    b.loglog(curve.load, 1e6 * curve.centre, ".-", ms=3, label="nanorom")
    b.loglog(curve.load, 1e6 * hencky, "k--", lw=0.8, label="Hencky's limit")
    b.set(title="bulge", xlabel="pressure (Pa)", ylabel="centre deflection (µm)")
    curve, linear, cubic = tip
    w = 1e9 * curve.centre
    c.loglog(w, 1e9 * curve.load, ".-", ms=3, label="nanorom")
    c.loglog(w, 1e9 * linear, "k--", lw=0.8, label="$k_1 w$")
    c.loglog(w, 1e9 * cubic, "k:", lw=0.8, label="$k_3 w^3$")
    c.set(title="tip", xlabel="indentation (nm)", ylabel="force (nN)")
    c.set_ylim(bottom=0.3e9 * curve.load[0])
    stable = np.where(snapped.stable, snapped.centre, np.nan)
    d.plot(snapped.load / 1e3, 1e9 * snapped.centre, "--", color="0.6", label="unstable")
    d.plot(snapped.load / 1e3, 1e9 * stable, ".-", ms=3, label="stable")
    d.set(title="dome", xlabel="pressure (kPa)", ylabel="centre deflection (nm)")
    for axes in (a, b, c, d):
        axes.legend()
    save(figure, path)


def main(directory="results/statics", points=20, tolerance=None):
    """Follow every film; points: states of a curve."""
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    gated, (bulged, hencky), tip = gate(points), bulge(points), indentation(points)
    snapped = dome(points, directory)
    model = trampoline(directory, tolerance or nanorom.Accuracy(degree=4, mesh_size=1e-6))
    for name, curve in (("gate", gated), ("bulge", bulged), ("tip", tip[0]), ("dome", snapped)):
        curve.save(directory / f"{name}.h5")
        curve.save_csv(directory / f"{name}.csv")
    picture(gated, (bulged, hencky), tip, snapped, directory / "statics.png")
    return gated, (bulged, hencky), tip, snapped, model


if __name__ == "__main__":
    main(*sys.argv[1:])
