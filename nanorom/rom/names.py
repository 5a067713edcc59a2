"""Names of modes as people write them: f01 and f0,1 are one.

Beside a mode of ten nodal diameters all names have a comma; alone they have none.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

_SINGLE = re.compile(r"^f(\d),(\d)([cs]?)$")


def plain(label: str) -> str:
    """A name without the comma that it has beside one of ten diameters: f0,1c is f01c."""
    return _SINGLE.sub(r"f\1\2\3", label)


def index_of(labels: Sequence[str], name: str) -> int | None:
    """Place from 0 of the mode of a name, with its comma or without; None if there is none."""
    if name in labels:
        return list(labels).index(name)
    alike = [plain(label) for label in labels]
    return alike.index(plain(name)) if plain(name) in alike else None
