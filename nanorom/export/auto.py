"""Export of a modal system to AUTO-07p."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from nanorom.continuation.arrays import symmetrise_cubic, symmetrise_quadratic
from nanorom.continuation.drive import CARRIER
from nanorom.continuation.system import ModalSystem
from nanorom.export.folder import write_folder
from nanorom.types import Array


def write_auto(
    system: ModalSystem,
    path: Path,
    omega: tuple[float, float] | None,
    direct: float,
    parametric: float,
) -> None:
    scaled = system.scaled(direct, parametric)
    low, high = (
        (0.8, 1.5) if omega is None else (omega[0] / scaled.frequency, omega[1] / scaled.frequency)
    )
    rows: list[tuple[Any, ...]]
    rows = [(1, *indices, values) for indices, values in _matrix_rows(-scaled.stiffness)]
    rows += [(2, *indices, values) for indices, values in _matrix_rows(-scaled.damping)]
    rows += [
        (3, *indices, values) for indices, values in _matrix_rows(scaled.parametric[..., CARRIER])
    ]
    rows += [
        (4, r + 1, 0, 0, 0, float(value))
        for r, value in enumerate(scaled.force[:, CARRIER])
        if value
    ]
    for kind, tensor in (
        (5, -symmetrise_quadratic(scaled.quadratic)),
        (6, -symmetrise_cubic(scaled.cubic.copy())),
        (7, -scaled.loss),
    ):
        for position in np.argwhere(tensor):
            indices = [int(i) + 1 for i in position] + [0] * (4 - tensor.ndim)
            rows.append((kind, *indices, float(tensor[tuple(position)])))
    text = "\n".join(
        " ".join(f"{item:d}" for item in row[:-1]) + f" {row[-1]:.17e}" for row in rows
    )
    files = {
        "modal.coef": f"{len(rows)}\n{text}\n",
        "modal.f90": _FORTRAN.format(
            size=system.size, omega=low, frequency=scaled.frequency, amplitude=scaled.amplitude
        ),
        "c.modal": _CONSTANTS.format(dimension=2 * system.size + 2),
        "modal.auto": _SCRIPT.format(low=low, high=high),
        "run.sh": _RUN,
    }
    write_folder(path, files)


def _matrix_rows(matrix: Array) -> list[tuple[tuple[int, int, int, int], float]]:
    return [((int(i) + 1, int(j) + 1, 0, 0), float(matrix[i, j])) for i, j in np.argwhere(matrix)]


_FORTRAN = """\
! Modal equations q'' = f(q, q', t), non-dimensional:
! time in 1/({frequency:.17e} rad/s), q in {amplitude:.17e}.
! par(1) = drive frequency, par(2) = factor on all drives (1 = the levels exported),
! par(11) = period.
! u = (q, q', s, c); the last two are an oscillator that supplies c = cos(par(1) t).
! modal.coef: kind r j k l value;
! kind 1 -K, 2 -C, 3 P, 4 J, 5 -A, 6 -B (full symmetric tensors), 7 -D.
module modal
  implicit none
  integer, parameter :: n = {size}
  logical, save :: ready = .false.
  double precision, save :: stiffness(n,n) = 0, damping(n,n) = 0, parametric(n,n) = 0, direct(n) = 0
  double precision, save :: quadratic(n*n,n) = 0, cubic(n*n,n*(n+1)/2) = 0, loss(n*n,n*(n+1)/2) = 0
  logical, save :: has_quadratic = .false., has_loss = .false.
contains
  subroutine load()
    integer :: rows, i, kind, r, j, k, l, p, unit
    double precision :: value
    open(newunit=unit, file='modal.coef', status='old', action='read')
    read(unit,*) rows
    do i = 1, rows
      read(unit,*) kind, r, j, k, l, value
      select case (kind)
      case (1); stiffness(r,j) = value
      case (2); damping(r,j) = value
      case (3); parametric(r,j) = value
      case (4); direct(r) = value
      case (5); quadratic(r+(k-1)*n,j) = value; has_quadratic = .true.
      case (6)  ! the matrix element (r,l) gathers q_j q_k for j <= k
        p = max(j,k)*(max(j,k)-1)/2 + min(j,k)
        cubic(r+(l-1)*n,p) = cubic(r+(l-1)*n,p) + value
      case (7)  ! value q_k q_l q'_j
        p = max(k,l)*(max(k,l)-1)/2 + min(k,l)
        loss(r+(j-1)*n,p) = loss(r+(j-1)*n,p) + value; has_loss = .true.
      end select
    end do
    close(unit)
    ready = .true.
  end subroutine
end module

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  use modal
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim,ndim), dfdp(ndim,*)
  double precision :: q(n), v(n), pairs(n*(n+1)/2), s, c, r2
  double precision :: linear(n,n), gq(n,n), gc(n,n), w(n,n)
  integer :: j, k, l, m
  if (.not. ready) then
!$omp critical (loading)
    if (.not. ready) call load()
!$omp end critical (loading)
  end if
  q = u(1:n); v = u(n+1:2*n); s = u(2*n+1); c = u(2*n+2)
  do k = 1, n
    pairs(k*(k-1)/2+1 : k*(k-1)/2+k) = q(1:k)*q(k)
  end do
  gc = reshape(matmul(cubic, pairs), [n,n])
  linear = stiffness + par(2)*c*parametric
  f(1:n) = v
  f(n+1:2*n) = matmul(linear, q) + matmul(damping, v) + matmul(gc, q) + par(2)*c*direct
  if (has_quadratic) then
    gq = reshape(matmul(quadratic, q), [n,n])
    f(n+1:2*n) = f(n+1:2*n) + matmul(gq, q)
  end if
  if (has_loss) then
    w = reshape(matmul(loss, pairs), [n,n])
    f(n+1:2*n) = f(n+1:2*n) + matmul(w, v)
  end if
  r2 = s*s + c*c
  f(2*n+1) = s + par(1)*c - s*r2
  f(2*n+2) = c - par(1)*s - c*r2
  if (ijac == 0) return
  dfdu = 0
  do j = 1, n
    dfdu(j,n+j) = 1
  end do
  dfdu(n+1:2*n,1:n) = linear + 3*gc
  dfdu(n+1:2*n,n+1:2*n) = damping
  if (has_quadratic) dfdu(n+1:2*n,1:n) = dfdu(n+1:2*n,1:n) + 2*gq
  if (has_loss) then
    dfdu(n+1:2*n,n+1:2*n) = damping + w
    do k = 1, n
      do l = 1, k
        m = k*(k-1)/2 + l
        do j = 1, n
          dfdu(n+1:2*n,k) = dfdu(n+1:2*n,k) + loss((j-1)*n+1:j*n,m)*v(j)*q(l)
          dfdu(n+1:2*n,l) = dfdu(n+1:2*n,l) + loss((j-1)*n+1:j*n,m)*v(j)*q(k)
        end do
      end do
    end do
  end if
  dfdu(n+1:2*n,2*n+2) = par(2)*(matmul(parametric, q) + direct)
  dfdu(2*n+1,2*n+1) = 1 - r2 - 2*s*s; dfdu(2*n+1,2*n+2) = par(1) - 2*s*c
  dfdu(2*n+2,2*n+1) = -par(1) - 2*s*c; dfdu(2*n+2,2*n+2) = 1 - r2 - 2*c*c
  if (ijac == 1) return
  dfdp(:,1) = 0; dfdp(2*n+1,1) = c; dfdp(2*n+2,1) = -s
  dfdp(:,2) = 0; dfdp(n+1:2*n,2) = c*(matmul(parametric, q) + direct)
end subroutine

subroutine stpnt(ndim, u, par, t)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  double precision, parameter :: pi = 4*atan(1d0)
  par(1) = {omega:.17e}
  par(2) = 0
  par(11) = 2*pi/par(1)
  u = 0
  u(ndim-1) = sin(2*pi*t)
  u(ndim) = cos(2*pi*t)
end subroutine

subroutine bcnd
end subroutine
subroutine icnd
end subroutine
subroutine fopt
end subroutine
subroutine pvls
end subroutine
"""
_CONSTANTS = """\
NDIM={dimension}, IPS=2, IRS=0, ILP=0
ICP=[2,11]
NTST=40, NCOL=4, IAD=3, ISP=0, ISW=1, IPLT=0, NBC=0, NINT=0
NMX=500, NPR=0, MXBF=0, IID=2, ITMX=10, ITNW=7, NWTN=3, JAC=1
EPSL=1e-8, EPSU=1e-8, EPSS=1e-6
DS=0.01, DSMIN=1e-7, DSMAX=0.1, IADS=1
NPAR=12, THL={{11: 0.0}}, THU={{}}
UZSTOP={{2: 1.0}}
"""
_SCRIPT = """\
# From rest: raise the drive, sweep the frequency, then follow every branch that bifurcates.
level = run('modal')
sweep = dict(ICP=[1, 11], ILP=1, ISP=2, NMX=4000, DS=0.002, DSMAX=0.02)
base = run(level('UZ1'), UZSTOP={{1: [{low!r} - 1e-6, {high!r}]}}, **sweep)
save(base, 'base')
number = 0
for kind in ('PD', 'BP'):
    for point in base(kind) or []:
        number += 1
        # a branch that bifurcates ends where it comes back to one it shares an orbit with
        limits = {{1: [{low!r} / 2, {high!r} * 2]}}
        branch = run(point, ISW=-1, STOP=['BP1'], UZSTOP=limits, **sweep)
        save(branch, 'branch%d' % number)
"""
_RUN = """\
#!/bin/sh
# Needs AUTO-07p (Debian: auto-07p, gfortran). Results: b.base, s.base, d.base and b.branch1, ...
cd "$(dirname "$0")" && exec auto-07p modal.auto
"""
