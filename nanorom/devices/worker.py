"""A process that reduces one scene after another: scenes come as lines, quantities go as lines.

It keeps what it has compiled.  It ends when nobody asks any more, in the middle of a scene, too.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
import warnings
from pathlib import Path
from typing import Any

from nanorom.errors import NanoromError
from nanorom.launch import finite_elements
from nanorom.rom import quantities
from nanorom.rom.model import ReducedModel
from nanorom.scene.scene import Scene


def answer(job: dict[str, Any]) -> dict[str, Any]:
    """Values and units of the quantities of a scene, and what it warns of; or why there are none.

    job: scene, its tables; directory of its files; of, names of quantities; slopes, whether exact
    derivatives are wanted where there are any: by key of the scene, d value / d ln(key) of each.
    """
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            scene, of = Scene.from_dict(job["scene"], Path(job["directory"])), job["of"]
            derived = _derived(scene, of) if job.get("slopes") else {}
            if "values" not in derived:
                model = _reduced(scene)
                values, units = zip(*(quantities.value(name, model, model.label) for name in of))
                derived |= {"values": values, "units": units}
    except NanoromError as error:
        return {"failure": str(error)}
    except Exception as error:  # one device that fails is no reason to lose the others
        return {"failure": f"unexpected {type(error).__name__}: {error}"}
    remarks = [str(each.message) for each in told if issubclass(each.category, UserWarning)]
    return {**derived, "remark": "; ".join(dict.fromkeys(remarks))}


def _derived(scene: Scene, of: list[str]) -> dict[str, Any]:
    """Values, units and derivatives; or why there are no derivatives."""
    from nanorom.workflow import sensitivity

    try:
        found = sensitivity(scene, of, exact=True)
    except NanoromError as error:  # said so where the values are wanted
        return {"inexact": str(error)}
    slopes = dict(zip(found.by, found.slope.T.tolist()))
    return {"values": found.value.tolist(), "units": found.unit, "slopes": slopes}


def _reduced(scene: Scene) -> ReducedModel:
    """Without the larger model, in which errors of responses are estimated."""
    with finite_elements():
        from nanorom.fem.mesh import kept
        from nanorom.fem.reduce import reduce_scene
        from nanorom.verification import modes
    with kept.for_more():
        return modes.automatic(scene, None, None) if scene.modes.automatic else reduce_scene(scene)


def main() -> None:
    """Answer the lines of the standard input on the standard output."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # left to who asks
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as answers:
        os.dup2(2, 1)  # what libraries print is no answer
        jobs: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=_listen, args=(jobs,), daemon=True).start()
        while True:
            print(json.dumps(answer(json.loads(jobs.get()))), file=answers, flush=True)


def _listen(jobs: queue.SimpleQueue[str]) -> None:
    for line in sys.stdin:
        jobs.put(line)
    os._exit(0)


if __name__ == "__main__":
    main()
