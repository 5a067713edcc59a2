"""What `import nanorom` offers: public names, and nothing else at the tab key."""

import subprocess
import sys

import nanorom


def test_only_public_names_are_listed():
    listed = [name for name in dir(nanorom) if not name.startswith("__")]
    assert sorted(listed) == sorted({*nanorom.__all__, "continuation", "plots"})
    assert all(getattr(nanorom, name) is not None for name in listed)


def test_rooms_are_loaded_when_they_are_first_used():
    program = (
        "import sys, nanorom\n"
        "assert 'nanorom.plots' not in sys.modules\n"
        "assert callable(nanorom.plots.mode_gallery) and callable(nanorom.continuation.explore)"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
