"""The graphene nanodrum of Keskekler et al. (arXiv:2304.01419), from geometry to response.

A clamped disc under the tension N0 = diag(T_x, T_y) deflects by w = sum_r phi_r(x, y) q_r(t), and

    m_r q_r'' + c_r q_r' + k_r q_r + sum_jkl B_rjkl q_j q_k q_l = (p J_r + t sum_s P_rs q_s) cos wt

with a pressure of amplitude p and a tension that is modulated with amplitude t. The pressure bends
the resonance of f01 over (Duffing). The modulation excites f01 at half the drive frequency where
t |P_11| > c_1 w, around w = 2 w_1 (principal parametric resonance).

    python demos/drum.py [DIRECTORY]        leaves rom.h5, response.h5, pictures and summary.json
"""

import sys
from math import tau
from pathlib import Path

import nanorom

# Spectral solution of the same plate in MHz (no finite elements; all digits converged)
EXACT = {
    "f01": 21.15119357,
    "f11s": 35.43957465,
    "f11c": 36.72212759,
    "f21c": 51.91279396,
    "f21s": 52.14308452,
    "f02": 57.68114750,
}


def main(directory="results/drum", **changes):
    """Run the scene, with changes as of Scene.with_; return fixed over free b111."""
    scene = nanorom.Scene.from_file(Path(__file__).with_suffix(".toml")).with_(**changes)
    nanorom.run(scene, directory)
    model = nanorom.ReducedModel.load(Path(directory) / "rom.h5")
    response = nanorom.Response.load(Path(directory) / "response.h5")

    print("mode    nanorom (MHz)  exact (MHz)  difference")
    for label, frequency in zip(model.label, model.frequency / 1e6):
        exact = EXACT.get(label)
        compared = f"{exact:13.6f}  {frequency / exact - 1:10.0e}" if exact else ""
        print(f"{label:6}  {frequency:13.6f}{compared}")

    free = model.b(1)[1, 1, 1]
    fixed = nanorom.reduce(scene.with_(in_plane="fixed", modes=[1])).b(1)[1, 1, 1]
    print(f"\nb111 = {free:.4e} N/m^3, but {fixed:.4e} N/m^3 with in-plane displacement fixed:")
    print(f"freeing it lowers b111 by a factor {fixed / free:.4f}")

    print("\n  direct   parametric  point  frequency (MHz)  f01 (nm)")
    for (direct, parametric), diagram in zip(response.drive.levels, response.diagrams):
        for point in diagram.special_points:
            frequency, amplitude = point.omega / tau / 1e6, point.amplitude[0] * 1e9
            drive = f"{direct:5.1f} Pa  {parametric * 1e3:6.2f} mN/m"
            print(f"{drive}  {point.type:5}  {frequency:15.6f}  {amplitude:8.3f}")
    print("LP: fold, PD: period doubling, NS: Neimark-Sacker, BP: branch point")
    return fixed / free


if __name__ == "__main__":
    main(*sys.argv[1:])
