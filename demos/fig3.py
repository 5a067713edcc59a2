"""Fig. 3 of Keskekler et al. (arXiv:2304.01419): linear and nonlinear responses of the drum.

The drum is driven as in the paper, F_r = J_r (beta + gamma q_r) cos(omega t), with the modal forces
J_r of a laser spot off its centre and one ladder of levels for beta and gamma together.  The mode r
doubles its period around omega = 2 omega_r where gamma exceeds 2 k_r/(Q |J_r|).

Two variants stand side by side.  The clamped plate with E = 410 GPa has the paper's linear spectrum
(11 modes from 20 to 90 MHz, f21, f02, f03 being modes 4, 6, 15).  Its doubled branch of f01 meets
f21 only near 3.4 f01.  With bending switched off the spectrum is a membrane's, and the meeting lies
at 2.4 to 2.6 f01, where the paper has it.  No parameter is tuned to the paper's nonlinear figure:
position and size of the spot and the levels are round numbers.

    python demos/fig3.py [DIRECTORY]     leaves linear.png, nonlinear.png, and for each variant
                                         rom.h5 and response.h5 (also of the set with f03)
"""

import sys
from math import tau
from pathlib import Path

import numpy as np

import nanorom
from nanorom.aim import aimed
from nanorom.files import make_directory
from nanorom.motion import energy_shares
from nanorom.plots import comparison_figure, linear_figure

VARIANTS = {"plate": "clamped plate, E = 410 GPa", "membrane": "bending switched off"}
SPOT = {"direct_pattern": "spot", "position": ["1.0 um", "0.6 um"], "radius": "1.0 um"}
LADDER = (1.2, 1.6, 2.2, 2.8)  # gamma by the threshold of f01
F03_STEP = 1.6  # the step of the ladder that is repeated with f03
BETA = 60.0  # Pa at the centre of the spot, per step of the ladder
LINEAR = 0.1  # Pa at the centre of the spot, for the linear response
RANGE = ("0.95 f1", "4.25 f1")  # of the plate: 20 to 90 MHz
TOLERANCE = 1e-7  # of the orbits: the picture shows less
PAPER_NS = 2.538  # omega_d/omega_0 of the paper's Neimark-Sacker point
PAPER_SURGE = 3.5  # and of its highest peak


def reduced(variant, count=18):
    """The drum of demos/drum.toml with or without bending; its lowest modes."""
    scene = nanorom.Scene.from_file(Path(__file__).with_name("drum.toml"))
    thickness = scene.plate.thickness
    plate = nanorom.Plate(thickness=thickness, model="auto" if variant == "plate" else variant)
    return nanorom.reduce(scene.with_(plate=plate, modes=count, drive=None, sweep=None))


def threshold(model):
    """gamma (L,) in Pa/m at which mode r doubles its period, 2 k_r/(Q_r |J_r|)."""
    drive = nanorom.Drive(1.0, **SPOT)
    force = np.abs(aimed(model, drive).drive["spot"])
    quality = model.mass * tau * model.frequency / np.diag(model.damping)
    return 2 * np.diag(model.stiffness) / (quality * force)


def levels(model, ladder):
    """The drive of a ladder."""
    gamma = threshold(model)[0]
    return nanorom.Drive(
        [BETA * step for step in ladder],
        [gamma * step for step in ladder],
        parametric_pattern="paper",
        **SPOT,
    )


def main(directory="results/fig3", ladder=LADDER, sweep=RANGE, variants=tuple(VARIANTS), f03=True):
    """Compute both variants, print where each has what the paper names; return the responses."""
    directory = Path(directory)
    models, responses, forces = {}, {}, {}
    for variant in variants:
        title = VARIANTS[variant]
        folder = make_directory(directory / variant)
        full = reduced(variant)
        models[title] = model = full.select(full.label[:11])
        model.save(folder / "rom.h5")
        drive = levels(model, ladder)
        forces[title] = LINEAR * aimed(model, drive).drive["spot"]
        describe(title, full, drive)
        range_ = nanorom.Sweep(*sweep, tolerance=TOLERANCE)
        response = nanorom.respond(model, drive, range_)
        response.save(folder / "response.h5")
        responses[title] = response
        phenomena(model, response)
        if f03:
            with_f03(full, folder, F03_STEP)
    limits = (15e6, 92e6)
    linear_figure(models, forces, limits, (1.0e-6, 0.6e-6), directory / "linear.png")
    names = [f"level {step:g}" for step in ladder]
    comparison_figure(responses, names, directory / "nonlinear.png")
    print(f"\npictures in {directory}: linear.png, nonlinear.png")
    return responses


def describe(title, model, drive):
    """Print every parameter."""
    print(f"\n=== {title}")
    print("R = 2.5 um, h = 10 nm, E = 410 GPa, nu = 0.16, rho = 2267 kg/m^3,")
    print("T_x = 0.321, T_y = 0.257 N/m, Q = 180; spot of 1/e^2 radius 1 um at (1.0, 0.6) um")
    beta, gamma = drive.direct, drive.parametric
    print("beta  (Pa):  ", "  ".join(f"{b:9.1f}" for b in beta))
    print("gamma (Pa/m):", "  ".join(f"{g:9.2e}" for g in gamma))
    force = aimed(model, drive).drive["spot"]
    limit = threshold(model)
    print("number  mode   f (MHz)   f/f01  J_r/J_01  threshold of gamma by that of f01")
    for r in range(model.size):
        f = model.frequency[r]
        if f < 91e6 or model.label[r] == "f03":
            row = f"{model.number[r]:6}  {model.label[r]:5} {f / 1e6:8.4f}"
            row += f" {f / model.frequency[0]:7.4f} {force[r] / force[0]:9.3f}"
            print(f"{row} {limit[r] / limit[0]:8.2f}")


def phenomena(model, response):
    """Print where this variant has what the paper names, beside the paper's numbers."""
    f1 = model.frequency[0]
    limit = threshold(model)
    print("\ngamma/threshold of f01   peak of the doubled branch   f01 there   largest f21")
    for level, diagram in zip(response.drive.parametric, response.diagrams):
        doubled = of_first_mode(diagram, model)
        if doubled is None:
            continue
        top = int(np.argmax(np.where(doubled.stable, doubled.omega, 0)))
        f21 = max(
            float(doubled.amplitude[:, r].max())
            for r, label in enumerate(model.label)
            if label.startswith("f21")
        )
        ratio = doubled.omega[top] / tau / f1
        print(
            f"{level / limit[0]:14.2f} {ratio:26.3f} f01 {1e9 * doubled.amplitude[top, 0]:14.2f} nm"
            f" {1e9 * f21:10.2f} nm"
        )
    print(f"paper: locked near f21, then surging to {PAPER_SURGE} f01")
    for mode in ("f01", "f11s", "f11c"):
        r = model.label.index(mode)
        opened = [
            (level, diagram, point)
            for level, diagram in zip(response.drive.parametric, response.diagrams)
            for point in diagram.points("PD", branch=0)
            if abs(point.omega / tau / model.frequency[r] - 2) < 0.06
            and level > limit[r]
        ]
        text = f"PD at 2 {mode}: threshold {limit[r] / limit[0]:.2f} by one-mode formula"
        if opened:
            level, diagram, point = opened[0]
            text += f"; open from level {level / limit[0]:.2f}"
            text += f" at {point.omega / tau / f1:.4f} f01"
        print(text)
    torus = [
        (abs(point.omega / tau / f1 - PAPER_NS), level, point)
        for level, diagram in zip(response.drive.parametric, response.diagrams)
        for point in diagram.points("NS")
        if point.period_multiple == 2
    ]
    if torus:
        _, level, point = min(torus, key=lambda entry: entry[0])
        print(
            f"Neimark-Sacker point nearest to the paper's {PAPER_NS}: {point.omega / tau / f1:.4f}"
            f" at level {level / limit[0]:.2f} (of {len(torus)})"
        )
        print("modes there:", shares(model, point.orbit))
    else:
        print(f"no Neimark-Sacker point on the doubled branch (paper: {PAPER_NS})")


def of_first_mode(diagram, model):
    """The branch of doubled period that leaves the base branch at 2 f01, or None."""
    for branch in diagram.branches:
        start = branch.omega[0] / tau / model.frequency[0]
        if branch.period_multiple == 2 and branch.parent == 0 and abs(start - 2) < 0.1:
            return branch
    return None


def shares(model, orbit):
    """The five modes with most of the energy of an orbit."""
    energy = energy_shares(model, orbit)
    return ", ".join(f"{model.label[r]} {energy[r]:.2%}" for r in np.argsort(energy)[:-6:-1])


def with_f03(full, folder, step):
    """The doubled branch of f01 at one level once more, with f03 among the modes."""
    number = full.number[full.label.index("f03")]
    model = full.select([*full.label[:11], "f03"])
    model.save(folder / "rom-f03.h5")
    sweep = nanorom.Sweep("1.95 f1", "2.05 f1", tolerance=TOLERANCE)
    response = nanorom.respond(model, levels(model, [step]), sweep)
    response.save(folder / "response-f03.h5")
    print(f"\nwith f03 (mode {number}) as twelfth mode, level {step}:")
    phenomena(model, response)
    doubled = of_first_mode(response.diagrams[0], model)
    if doubled is not None:
        nearest = int(np.argmin(np.abs(doubled.omega / tau / model.frequency[0] - PAPER_NS)))
        print(f"modes on the branch near {PAPER_NS} f01:", shares(model, doubled.orbit(nearest)))


if __name__ == "__main__":
    main(*sys.argv[1:2])
