"""Fig. 4 of Keskekler et al. (arXiv:2304.01419): what the film does along the parametric branch.

Everything is rebuilt from rom.h5 and response.h5 alone, w = sum_r phi_r(x, y) q_r(t), without a
finite-element code: amplitudes and energies of all modes along the branch of doubled period, the
motion at the internal resonance of f01 with f21, shapes at largest deflection, an animation.
The internal resonance is taken, as in the paper, at the Neimark-Sacker point that is nearest to
2.538 f01.  The drum is that of demos/fig3.py with bending switched off, with f03 among its modes.

    python demos/fig4.py [DIRECTORY [FIG3]]     FIG3: results of demos/fig3.py, made if missing
"""

import sys
from math import tau
from pathlib import Path

import numpy as np
import phenomena as ph

import nanorom
from nanorom.files.whole import make_directory
from nanorom.plots import motion
from nanorom.rom.motion import energy_shares

BEFORE = (2.1, 2.3)  # drive frequencies by f01 of the first shapes; then the resonance and the top


def main(directory="results/fig4", source="results/fig3", frames=True):
    """Draw everything; return the model and the orbit at the internal resonance."""
    directory, folder = make_directory(Path(directory)), Path(source) / "membrane"
    if not (folder / "response-f03.h5").exists():
        import fig3  # the one that needs finite elements

        make_directory(folder)
        fig3.with_f03(fig3.reduced("membrane"), folder, fig3.F03_STEP)
    model = nanorom.ReducedModel.load(folder / "rom-f03.h5")
    response = nanorom.Response.load(folder / "response-f03.h5")
    (diagram,) = response.diagrams
    branch = ph.first_branch(diagram, model)
    resonance = ph.nearest_torus(diagram, model).orbit

    orbits = [stable_near(branch, ratio * model.frequency[0]) for ratio in BEFORE]
    orbits += [resonance, branch.orbit(int(branch.omega.argmax()))]
    marks = [orbit.omega / tau for orbit in orbits]
    motion.branch_panels(model, branch, marks, directory / "branch.png")
    motion.time_series_figure(model, resonance, directory / "time.png")
    motion.shapes_figure(model, orbits, directory / "shapes.png")
    motion.snapshots_figure(model, resonance, path=directory / "snapshots.png")
    if frames:
        motion.animate(model, resonance, directory / "motion.gif")

    ratio = resonance.omega / tau / model.frequency[0]
    print(f"\ninternal resonance: Neimark-Sacker point at {ratio:.4f} f01 (paper: {ph.PAPER_NS})")
    print("number  mode   share of energy   max|q| (nm)      (paper: modes 4, 6, 15 most excited)")
    shares = energy_shares(model, resonance)
    _, q, _ = resonance.time_series(256, 1)
    for r in np.argsort(shares)[::-1]:
        size = 1e9 * np.abs(q[:, r]).max()
        print(f"{model.number[r]:6}  {model.label[r]:5} {shares[r]:16.4%} {size:13.4f}")
    print(f"pictures and motion.gif in {directory}")
    return model, resonance


def stable_near(branch, frequency):
    """The stable orbit nearest to a drive frequency."""
    distance = np.where(branch.stable, np.abs(branch.omega / tau - frequency), np.inf)
    return branch.orbit(int(distance.argmin()))


if __name__ == "__main__":
    main(*sys.argv[1:3])
