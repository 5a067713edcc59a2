"""A folder of text files, each of which appears whole or not at all."""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from collections.abc import Mapping
from pathlib import Path

from nanorom.files.whole import check_parent


def write_folder(path: Path, files: Mapping[str, str | bytes]) -> None:
    """Make or fill a folder; files that end in .sh can be run. Raises OSError.

    FileError where there is no place for it.
    """
    check_parent(path)
    temporary = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}."))
    try:
        for name, contents in files.items():
            data = contents.encode() if isinstance(contents, str) else contents
            (temporary / name).write_bytes(data)
            if name.endswith(".sh"):
                mode = (temporary / name).stat().st_mode
                (temporary / name).chmod(mode | stat.S_IXUSR | stat.S_IXGRP | stat.S_IXOTH)
        path.mkdir(exist_ok=True)
        for name in files:
            os.replace(temporary / name, path / name)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
