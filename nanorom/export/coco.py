"""Export to continuation in MATLAB or Octave: functions for COCO and MatCont.

The equations are non-dimensional and written as polynomials of the state, in functions that take
many states at once, with their derivatives.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np

from nanorom.continuation.drive import CARRIER
from nanorom.continuation.system import ModalSystem
from nanorom.export.folder import write_folder
from nanorom.export.polynomial import acceleration


def write_coco(
    system: ModalSystem,
    path: Path,
    omega: tuple[float, float] | None,
    direct: float,
    parametric: float,
) -> None:
    """Write a folder with modal.m, its derivatives, modal_autonomous.m and their coefficients.

    modal(t, x, p) is what COCO's toolboxes 'coll' and 'po' take with 'autonomous' off; x = (q, q')
    (2L, N) in ``amplitude`` and ``amplitude * frequency``, t (1, N) in 1/``frequency``, p (3, N):
    omega in ``frequency``, factors on the direct and the parametric level.  Raises OSError.
    """
    from scipy.io import savemat

    scaled = system.scaled(direct, parametric)
    contents = {
        "modes": float(system.size),
        "direct": scaled.force[:, CARRIER],
        "parametric": scaled.parametric[..., CARRIER],
        "frequency": scaled.frequency,
        "amplitude": scaled.amplitude,
        "omega": np.array(omega or ()) / scaled.frequency,
    }
    for order, terms in enumerate(acceleration(scaled), 1):
        contents[f"index{order}"] = terms.index.reshape(-1, order) + 1.0
        contents[f"coefficient{order}"] = terms.coefficient.reshape(system.size, -1)
    buffer = BytesIO()
    savemat(buffer, contents, oned_as="column")
    files: dict[str, str | bytes] = {"modal_coefficients.mat": buffer.getvalue()}
    write_folder(path, files | FUNCTIONS)


FUNCTIONS = {
    "modal.m": """\
function y = modal(t, x, p)
% Modal equations x' = f(t, x, p), non-dimensional: x = (q, q') (2L x N), t (1 x N),
% p = (omega; factor on the direct level; factor on the parametric level) (3 x N).
% modal_coefficients.mat has the units (frequency in rad/s, amplitude in m) and the polynomial.
% COCO:  funcs = {@modal, @modal_dx, @modal_dp, @modal_dt};
%        prob = coco_set(coco_prob(), 'ode', 'autonomous', false);
%        prob = ode_isol2po(prob, '', funcs{:}, t0, x0, {'omega' 'direct' 'parametric'}, p0);
d = modal_coefficients();
q = x(1:d.modes, :);
c = cos(p(1, :) .* t);
force = d.direct * (p(2, :) .* c) + (d.parametric * q) .* repmat(p(3, :) .* c, d.modes, 1);
y = [x(d.modes + 1:end, :); force + modal_polynomial(d, x)];
end
""",
    "modal_coefficients.m": """\
function d = modal_coefficients()
% The coefficients, read once.
persistent known
if isempty(known)
  folder = fileparts(mfilename('fullpath'));
  known = load(fullfile(folder, 'modal_coefficients.mat'));
end
d = known;
end
""",
    "modal_polynomial.m": """\
function a = modal_polynomial(d, x)
% Accelerations (L x N) without the drive: sums of products of states (2L x N).
a = zeros(d.modes, size(x, 2));
for order = 1:3
  [index, coefficient] = modal_terms(d, order);
  product = ones(size(index, 1), size(x, 2));
  for slot = 1:order
    product = product .* x(index(:, slot), :);
  end
  a = a + coefficient * product;
end
end
""",
    "modal_terms.m": """\
function [index, coefficient] = modal_terms(d, order)
% Places in the state (n x order) and coefficients (L x n) of the terms of one order.
index = reshape(d.(sprintf('index%d', order)), [], order);
coefficient = reshape(d.(sprintf('coefficient%d', order)), d.modes, []);
end
""",
    "modal_dx.m": """\
function J = modal_dx(t, x, p)
% df/dx (2L x 2L x N).
d = modal_coefficients();
n = d.modes; count = size(x, 2);
J = zeros(2 * n, 2 * n, count);
lower = n + 1:2 * n;
J(1:n, lower, :) = repmat(eye(n), [1, 1, count]);
c = reshape(p(3, :) .* cos(p(1, :) .* t), 1, 1, count);
J(lower, 1:n, :) = repmat(d.parametric, [1, 1, count]) .* repmat(c, [n, n, 1]);
for order = 1:3
  [index, coefficient] = modal_terms(d, order);
  for slot = 1:order
    product = ones(size(index, 1), count);
    for other = [1:slot - 1, slot + 1:order]
      product = product .* x(index(:, other), :);
    end
    for state = unique(index(:, slot))'
      chosen = index(:, slot) == state;
      change = reshape(coefficient(:, chosen) * product(chosen, :), n, 1, count);
      J(lower, state, :) = J(lower, state, :) + change;
    end
  end
end
end
""",
    "modal_dp.m": """\
function J = modal_dp(t, x, p)
% df/dp (2L x 3 x N).
d = modal_coefficients();
n = d.modes; count = size(x, 2);
J = zeros(2 * n, 3, count);
lower = n + 1:2 * n;
c = cos(p(1, :) .* t); s = -t .* sin(p(1, :) .* t);
stretch = d.parametric * x(1:n, :);
change = d.direct * (p(2, :) .* s) + stretch .* repmat(p(3, :) .* s, n, 1);
J(lower, 1, :) = reshape(change, n, 1, count);
J(lower, 2, :) = reshape(d.direct * c, n, 1, count);
J(lower, 3, :) = reshape(stretch .* repmat(c, n, 1), n, 1, count);
end
""",
    "modal_dt.m": """\
function y = modal_dt(t, x, p)
% df/dt (2L x N).
d = modal_coefficients();
n = d.modes;
s = -p(1, :) .* sin(p(1, :) .* t);
change = d.direct * (p(2, :) .* s) + (d.parametric * x(1:n, :)) .* repmat(p(3, :) .* s, n, 1);
y = [zeros(n, size(x, 2)); change];
end
""",
    "modal_autonomous.m": """\
function y = modal_autonomous(x, p)
% The same without time, for MatCont: x = (q, q', s, c) with an oscillator that supplies
% c = cos(omega t) and s = sin(omega t).
d = modal_coefficients();
n = 2 * d.modes;
s = x(n + 1, :); c = x(n + 2, :);
q = x(1:d.modes, :);
force = d.direct * (p(2, :) .* c) + (d.parametric * q) .* repmat(p(3, :) .* c, d.modes, 1);
size2 = 1 - s .^ 2 - c .^ 2;
y = [x(d.modes + 1:n, :)
     force + modal_polynomial(d, x(1:n, :))
     p(1, :) .* c + s .* size2
     -p(1, :) .* s + c .* size2];
end
""",
}
