"""The one module that knows DOLFINx versions: 0.5 (Debian 12) to 0.11 (Debian sid).

Every difference is found by a probe of what the library offers, never by its version string.
The rest of the package sees one interface, documented function by function below.
"""

from __future__ import annotations

import ctypes
import inspect
import logging
import signal
import threading
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from math import comb
from pathlib import Path
from typing import Any

import attrs
import basix
import cffi
import dolfinx
import numpy as np
import ufl
from dolfinx import fem, jit
from dolfinx.fem import forms as _forms
from dolfinx.fem import petsc as _petsc
from mpi4py import MPI
from petsc4py import PETSc

from nanorom.fem.solvers import compiler
from nanorom.fem.solvers.partition import destinations

try:  # DOLFINx >= 0.7: UFL elements are Basix elements
    import basix.ufl as _basix_ufl
except ImportError:
    _basix_ufl = None

_ffi = cffi.FFI()  # one: each parses the names of types anew
logging.captureWarnings(False)  # importing the form compiler sends warnings to its log

# PETSc takes a closed pipe for a crash and prints a page about it; Python raises BrokenPipeError
PETSc.Sys.popSignalHandler()
if threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE))

CELLS = {2: "triangle", 3: "tetrahedron"}  # by their dimension
_EQUISPACED = basix.LagrangeVariant.equispaced
_GLL = basix.LagrangeVariant.gll_warped
_JIT = "jit_options" if "jit_options" in inspect.signature(fem.form).parameters else "jit_params"


@lru_cache(maxsize=32)
def reference_element(degree: int, equispaced: bool = False, dimension: int = 2) -> Any:
    """Basix Lagrange triangle or tetrahedron of a degree, to tabulate and to place nodes.

    The Gauss-Lobatto variant is the one of the function spaces, the equispaced one that of the
    coordinate elements.
    """
    variant = _EQUISPACED if equispaced else _GLL
    cell = getattr(basix.CellType, CELLS[dimension])
    return basix.create_element(basix.ElementFamily.P, cell, degree, variant)


def degree_of(n_nodes: int, dimension: int = 2) -> int:
    """Degree of a Lagrange triangle or tetrahedron of n nodes."""
    return next(k for k in range(n_nodes) if comb(k + dimension, dimension) == n_nodes)


def create_mesh(
    comm: MPI.Comm, cells: np.ndarray, points: np.ndarray, order: int, dimension: int = 2
) -> Any:
    """Distributed mesh of triangles or tetrahedra, equispaced Lagrange coordinates of any order.

    ``cells`` (c, nodes) are node numbers in Basix' order, ``points`` (n, 2) in the plane or (n, 3)
    in space; ranks may pass any share of them, usually rank 0 passes all.
    """
    cells = np.ascontiguousarray(cells, dtype=np.int64)
    points = np.ascontiguousarray(points, dtype=np.float64)
    domain = _coordinate_domain(order, points.shape[1], CELLS[dimension])
    # facets between two ranks need the cells on both sides: they become ghosts
    found = destinations(cells[:, : dimension + 1], points, comm.size)
    names = list(inspect.signature(dolfinx.mesh.create_mesh).parameters)
    if _basix_ufl is None:  # 0.5 takes arrays too, but writes them out in an error first
        cells = dolfinx.cpp.graph.AdjacencyList_int64(cells)
    by_name = {"comm": comm, "cells": cells, "x": points, "domain": domain, "e": domain}
    arguments = [by_name[name] for name in names if name in by_name]
    return dolfinx.mesh.create_mesh(*arguments, partitioner=lambda *_: _adjacency(found))


def _coordinate_domain(order: int, components: int, cell: str) -> Any:
    if _basix_ufl is not None:
        kind = {"lagrange_variant": _EQUISPACED, "shape": (components,)}
        return ufl.Mesh(_basix_ufl.element("Lagrange", cell, order, **kind))
    shape = ufl.Cell(cell, geometric_dimension=components)
    scalar = ufl.FiniteElement("Lagrange", shape, order, variant="equispaced")
    return ufl.Mesh(ufl.VectorElement(scalar, dim=components))


def _adjacency(rows: list[np.ndarray]) -> Any:
    """DOLFINx' own ragged array of 32-bit integers."""
    values = np.concatenate([*rows, np.empty(0, dtype=np.int32)]).astype(np.int32)
    offsets = np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int32)
    adjacency = getattr(dolfinx.graph, "adjacencylist", None)
    if adjacency is None:
        return dolfinx.cpp.graph.AdjacencyList_int32(values, offsets)
    made = adjacency(values, offsets)
    return getattr(made, "_cpp_object", made)


def lagrange_space(mesh: Any, degree: int, components: int = 1) -> Any:
    """Continuous Lagrange space (Gauss-Lobatto nodes), scalar or vector; of degree 0 by cells."""
    family = "Lagrange" if degree else "DG"
    if _basix_ufl is not None:
        options = {"lagrange_variant": _GLL} | ({"shape": (components,)} if components > 1 else {})
        element = _basix_ufl.element(family, CELLS[mesh.topology.dim], degree, **options)
        return _compiled(mesh.comm, partial(fem.functionspace, mesh, element))
    kind = degree, components, mesh.geometry.dim, mesh.topology.dim
    if not mesh.comm.allreduce(kind in _known_spaces, op=MPI.LAND):
        element = ufl.FiniteElement(family, mesh.ufl_cell(), degree)
        if components > 1:
            element = ufl.VectorElement(element, dim=components)
        space = _compiled(mesh.comm, partial(fem.FunctionSpace, mesh, element))
        _known_spaces[kind] = element, space._cpp_object.element, space._ufcx_dofmap
        return space
    element, compiled, layout = _known_spaces[kind]
    address = _ffi.cast("uintptr_t", _ffi.addressof(layout))
    dofmap = dolfinx.cpp.fem.create_dofmap(mesh.comm, address, mesh.topology, compiled)
    on = getattr(mesh, "_mesh", mesh)
    return fem.FunctionSpace(mesh, element, dolfinx.cpp.fem.FunctionSpace(on, compiled, dofmap))


# objects of UFL, DOLFINx, FFCx by degree, components, dimensions: 0.5 looks them up anew
_known_spaces: dict[tuple[int, int, int, int], tuple[Any, Any, Any]] = {}


def interpolation_matrix(coarse: Any, fine: Any) -> Any:
    """Matrix from a function's coefficients in one space to those in a larger one. Collective."""
    python = getattr(_petsc, "interpolation_matrix", None)
    if python is None:
        function = dolfinx.cpp.fem.petsc.interpolation_matrix
        matrix = function(coarse._cpp_object, fine._cpp_object)
    else:
        matrix = python(coarse, fine)
    matrix.assemble()
    return matrix


def cell_dofs(space: Any) -> np.ndarray:
    """Local degrees of freedom (blocks) of every local and ghost cell, (c, n)."""
    dofs = space.dofmap.list
    if not isinstance(dofs, np.ndarray):
        dofs = dofs.array.reshape(dofs.num_nodes, -1)
    return dofs


def cell_nodes(mesh: Any) -> np.ndarray:
    """Local geometry nodes of every local and ghost cell, (c, n), vertices first."""
    maps = getattr(mesh.geometry, "dofmaps", None)
    nodes = maps[0] if isinstance(maps, list) else mesh.geometry.dofmap  # >= 0.11 has a list
    if not isinstance(nodes, np.ndarray):
        nodes = nodes.array.reshape(nodes.num_nodes, -1)
    return nodes


def input_nodes(mesh: Any) -> np.ndarray:
    """Number in the input of every local geometry node."""
    return np.asarray(mesh.geometry.input_global_indices)


def input_cells(mesh: Any) -> np.ndarray:
    """Number in the input of every local and ghost cell."""
    return np.asarray(mesh.topology.original_cell_index)


def vector_of(function: Any) -> Any:
    """PETSc vector that shares the memory of a function's degrees of freedom."""
    if hasattr(function.x, "petsc_vec"):
        return function.x.petsc_vec
    return function.vector


def form(expression: Any) -> Any:
    """Compile a UFL form, or find it compiled; raises NanoromError without a C compiler.

    Collective.
    """
    comm = expression.ufl_domain().ufl_cargo().comm
    return _compiled(comm, partial(fem.form, expression, **{_JIT: _jit_options()}))


def _compiled(comm: MPI.Comm, make: Callable[[], Any]) -> Any:
    # rank 0 compiles, and the others read
    return compiler.run(make, Path(_jit_options()["cache_dir"]), comm.rank == 0)


@lru_cache
def _jit_options() -> dict[str, Any]:
    defaults = (getattr(jit, "get_options", None) or jit.get_parameters)()
    return {"cache_dir": defaults["cache_dir"], "cffi_extra_compile_args": compiler.options()}


@attrs.frozen(eq=False)
class Kernel:
    """A compiled form without the mesh for which it was compiled.

    kind: DOLFINx' class of such a form; compiled: the form compiler's; tagged: numbers of the
    groups of tagged facets by type of integral.
    """

    kind: Any
    compiled: Any
    tagged: dict[str, list[int]]

    @classmethod
    def of(cls, expression: Any, form: Any) -> Kernel:
        """Kernel of a form that an expression was compiled to."""
        tagged: dict[str, set[int]] = {}
        for integral in expression.integrals():
            number = integral.subdomain_id()
            if integral.subdomain_data() is not None:
                numbers = number if isinstance(number, tuple) else (number,)
                tagged.setdefault(integral.integral_type(), set()).update(numbers)
        groups = {name: sorted(own) for name, own in tagged.items()}
        return cls(type(getattr(form, "_cpp_object", form)), form.ufcx_form, groups)

    def bound(
        self, spaces: list[Any], functions: list[Any], constants: list[Any], tags: Any
    ) -> Any:
        """The form about the operands that take the places of the first form's."""
        parts = [[part._cpp_object for part in own] for own in (spaces, functions, constants)]
        mesh = parts[0][0].mesh
        if issubclass(self.kind, getattr(_forms, "FormMetaClass", ())):  # 0.5
            types = dolfinx.cpp.fem.IntegralType
            domains = {getattr(types, name): tags for name in self.tagged}
            return self.kind(self.compiled, *parts, domains, mesh, _ffi, None)
        entities = {
            getattr(fem.IntegralType, name): _forms.get_integration_domains(
                getattr(fem.IntegralType, name), tags, numbers
            )
            for name, numbers in self.tagged.items()
        }
        address = _ffi.cast("uintptr_t", _ffi.addressof(self.compiled))
        try:
            made = self.kind([int(address)], *parts, entities, [], mesh)
        except TypeError:  # before meshes of several kinds of cells
            made = self.kind(address, *parts, entities, {}, mesh)
        return fem.Form(made, self.compiled)


def operands(expression: Any, form: Any) -> tuple[list[Any], list[Any], list[Any]]:
    """Function spaces, functions and constants of a form, each in its kernel's order."""
    compiled = form.ufcx_form
    # 0.5 has the name in the singular
    order = "original_coefficient_position"
    order = order if hasattr(compiled, order) else f"{order}s"
    functions = expression.coefficients()
    places = getattr(compiled, order)
    return (
        [argument.ufl_function_space() for argument in expression.arguments()],
        [functions[places[i]] for i in range(compiled.num_coefficients)],
        list(expression.constants()),
    )


def facet_measures(
    mesh: Any,
    groups: Sequence[np.ndarray],
    metadata: dict[str, Any],
    others: Sequence[np.ndarray] = (),
) -> list[Any]:
    """Integration over each of some disjoint groups of exterior facets (local numbers).

    Then over each of ``others``, disjoint among themselves, whose facets may be of the groups too.
    A form may hold any of them together, but none of another call.
    """
    every = [*groups, *others, np.empty(0, dtype=np.int32)]
    facets = np.unique(np.concatenate(every)).astype(np.int32)
    numbers = np.zeros(len(facets), dtype=np.int32)
    for number, group in enumerate(groups, 1):
        numbers[np.isin(facets, group) & (numbers == 0)] = number
    stride = len(groups) + 1
    for number, group in enumerate(others, 1):
        numbers[np.isin(facets, group)] += number * stride
    tags = dolfinx.mesh.meshtags(mesh, mesh.topology.dim - 1, facets, numbers)
    edge = ufl.Measure("ds", domain=mesh, subdomain_data=tags, metadata=metadata)
    beside = range(len(others) + 1)
    own = [tuple(g + stride * i for i in beside) for g in range(1, stride)]
    own += [tuple(stride * number + g for g in range(stride)) for number in beside[1:]]
    return [edge(ids if len(ids) > 1 else ids[0]) for ids in own]


def scatter_reverse_add(function: Any) -> None:
    """Add the ghost values of a function to their owners. Collective."""
    mode = getattr(dolfinx.la, "InsertMode", None) or dolfinx.la.ScatterMode
    function.x.scatter_reverse(mode.add)


WORTHWHILE = 64_000_000  # bytes freed in small pieces that are given back: less is soon used again


def free_memory(*comms: MPI.Comm) -> None:
    """Free the PETSc objects that Python has let go: some releases keep them until asked.

    So does the C library with what was freed in small pieces, which after a factorisation is as
    much as its factors.  Collective on every communicator.
    """
    if hasattr(PETSc, "garbage_cleanup"):
        for comm in comms:
            PETSc.garbage_cleanup(comm)
    if _TRIM is not None and (_MALLINFO is None or _MALLINFO().fordblks > WORTHWHILE):
        _TRIM(0)


class _Mallinfo(ctypes.Structure):
    """What the GNU C library tells of its heap, mallinfo2 in malloc.h."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks".split()
    ] + [("keepcost", ctypes.c_size_t)]


_TRIM = getattr(ctypes.CDLL(None), "malloc_trim", None)  # the GNU library's
_MALLINFO = getattr(ctypes.CDLL(None), "mallinfo2", None)
if _MALLINFO is not None:
    _MALLINFO.restype = _Mallinfo


def versions() -> dict[str, str]:
    """Versions of the finite-element libraries in use."""
    import petsc4py
    import slepc4py

    modules = {"dolfinx": dolfinx, "basix": basix, "petsc4py": petsc4py, "slepc4py": slepc4py}
    return {name: module.__version__ for name, module in modules.items()}


def assemble_matrix_into(matrix: Any, form: Any) -> None:
    """Add an assembled bilinear form to an existing matrix of its sparsity. Collective."""
    _petsc.assemble_matrix(matrix, form, bcs=[])
    matrix.assemble()


def orthonormal_polynomials(degree: int, points: np.ndarray) -> np.ndarray:
    """Orthonormal polynomials (p, q) of the reference triangle, sorted by degree."""
    return np.asarray(
        basix.tabulate_polynomials(
            basix.PolynomialType.legendre, basix.CellType.triangle, degree, points
        )
    )


def exterior_facets(mesh: Any) -> np.ndarray:
    """Local facets on the boundary of the whole mesh that this rank owns."""
    mesh.topology.create_connectivity(mesh.topology.dim - 1, mesh.topology.dim)
    return np.asarray(dolfinx.mesh.exterior_facet_indices(mesh.topology))


def cells_at(mesh: Any, facets: np.ndarray) -> np.ndarray:
    """A local cell (f,) that each of some local facets bounds."""
    dimension = mesh.topology.dim
    mesh.topology.create_connectivity(dimension - 1, dimension)
    cells = mesh.topology.connectivity(dimension - 1, dimension)
    return np.array([cells.links(facet)[0] for facet in facets], dtype=np.int64)


def facet_vertices(mesh: Any, facets: np.ndarray) -> np.ndarray:
    """Local geometry nodes (f, 2) at the ends of facets."""
    mesh.topology.create_connectivity(2, 1)
    edges = ((1, 2), (0, 2), (0, 1))
    cells = mesh.topology.connectivity(2, 1)
    nodes = cell_nodes(mesh)[:, :3]
    of_cell = cells.array[: 3 * len(nodes)].reshape(-1, 3)
    ends = np.empty((of_cell.max(initial=-1) + 1, 2), dtype=np.int64)
    for local, pair in enumerate(edges):
        ends[of_cell[:, local]] = nodes[:, pair]
    return ends[facets]


def mesh_from_gmsh(comm: MPI.Comm) -> Any:
    """Mesh in the plane of gmsh's current model, by DOLFINx' own reader. Collective."""
    import gmsh

    try:
        from dolfinx.io import gmsh as reader
    except ImportError:
        from dolfinx.io import gmshio as reader
    return reader.model_to_mesh(gmsh.model, comm, 0, gdim=2)[0]


def cells_with(mesh: Any, points: np.ndarray) -> Any:
    """Ragged array of the local cells that points (n, 3) lie in; ``links(i)`` are those of one."""
    geometry = dolfinx.geometry
    if hasattr(geometry, "bb_tree"):
        candidates = geometry.compute_collisions_points(geometry.bb_tree(mesh, 2), points)
    else:
        candidates = geometry.compute_collisions(geometry.BoundingBoxTree(mesh, 2), points)
    return geometry.compute_colliding_cells(mesh, candidates, points)
