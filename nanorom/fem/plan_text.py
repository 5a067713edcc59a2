"""A plan in words: what is computed, what is left out, and why.

A wrong skip is a wrong answer: whatever is not certain to make no difference is computed.
"""

from __future__ import annotations

from math import comb

import attrs

from nanorom.fem.plan import Plan
from nanorom.fem.scales import acting_tension
from nanorom.fem.symmetry import Mirrors
from nanorom.scene.geometry import MeshFile
from nanorom.scene.support import in_plane_of


@attrs.frozen
class Item:
    """One line of a plan: what, whether it is computed, and why (not)."""

    what: str
    computed: bool
    why: str


def state_item(plan: Plan) -> Item:
    """The static state that the model is about."""
    scene = plan.scene
    if scene.load is not None:
        return Item("static state under load", True, "the model is expanded about it")
    if scene.regions or scene.tension.variation is not None:
        return Item("pre-stress", True, "it relaxes, as it is not the same everywhere")
    if any(in_plane_of(kind) != "fixed" for kind in scene.supports.values()):
        return Item(
            "pre-stress",
            True,
            "it relaxes where the tension pulls at an edge that is free in its plane",
        )
    return Item("pre-stress", False, "a constant tension is in equilibrium with its supports")


def bending_item(plan: Plan) -> Item:
    """Bending stiffness."""
    scene, model = plan.scene, plan.scene.plate.model
    if plan.bending_effect is None:
        if not plan.bending:
            return Item("bending", False, f"the scene's model is {model}")
        if isinstance(scene.geometry, MeshFile):
            return Item("bending", True, "the wavelengths on a mesh file are not known")
        if acting_tension(scene) is None:
            return Item("bending", True, "only the static state tells how much tension acts")
        return Item("bending", True, "a direction without tension: nothing to compare it with")
    if plan.bending and scene.bends_with_loss:
        return Item("bending", True, "the material loses energy in it")
    effect = f"a bound on its effect is {plan.bending_effect:.1e}"
    if scene.plate.bends is not None:
        return Item("bending", plan.bending, f"the scene's model is {model}")
    if scene.accuracy.tolerance is None:
        return Item("bending", True, f"{effect}, and the scene states no tolerance")
    relation = "more" if plan.bending else "less"
    return Item("bending", plan.bending, f"{effect}, {relation} than half of the tolerance")


def mirror_item(mirrors: Mirrors) -> Item:
    """The part of the film that is meshed."""
    if not mirrors.axes:
        return Item("the whole film", True, "it is not cut at mirrors")
    part = {2: "half", 4: "three quarters"}[mirrors.copies]
    return Item(
        f"{part} of the film",
        False,
        f"its own mirror image in {' and '.join(mirrors.axes)}; products of odd parity vanish",
    )


def modes_item(plan: Plan) -> Item:
    """The modes that are solved for."""
    modes = plan.scene.modes
    if modes.automatic:
        why = "the driven ones, those that change points of the response, and those that grow"
        return Item(f"modes chosen by the response, among {modes.highest} or more", True, why)
    why = "no mode beyond them but the partners of near ones"
    return Item(f"{plan.scene.modes.highest} lowest modes", True, why)


def tensor_items(plan: Plan, method: str, cases: tuple[int, int], flat: bool) -> list[Item]:
    """Tensors by a method in so many static solutions, of so many without skips."""
    scene, n = plan.scene, len(plan.scene.modes.numbers)
    found, (solved, every) = [], cases
    if flat:
        why = "a flat film without load does not tell its sides"
        found.append(Item("quadratic tensor", False, why))
    else:
        found.append(Item("quadratic tensor", True, ""))
    if method == "direct":
        found.append(Item(f"cubic tensor by {method}: {solved} static solutions", True, ""))
    else:
        of = "" if solved == every else f"of {every}: "
        why = f"{of}of load cases that are mirror images one is solved"
        what = f"cubic tensor by {method}: at most {solved} static solutions"
        found.append(Item(what, True, why))
    what = f"{n**4 - comb(n + 3, 4)} of {n**4} cubic entries"
    found.append(Item(what, False, "they follow from the others: the force has a potential"))
    if not flat:
        static = scene.reduction.outside == "static"
        why = "it follows the quadratic force" if static else "reduction.outside is rest"
        found.append(Item("static response outside the modes", static, why))
    return found
