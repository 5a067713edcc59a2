"""Make the pages of the site ready in build/docs: tutorials are run, the command line is described.

./run python docs/make.py; ./run docs goes on with MkDocs
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import re
import shutil
from pathlib import Path

HERE = Path(__file__).resolve().parent
READY = HERE.parent / "build" / "docs"
BLOCK = re.compile(r"^```python\n(.*?)^```\n", re.DOTALL | re.MULTILINE)


def executed(page: Path, folder: Path) -> str:
    """A page with what its Python blocks print after each, and the pictures that they write.

    The blocks run one after the other in a folder, which keeps what they write.
    """
    names: dict[str, object] = {"__name__": "__main__"}
    text = page.read_text(encoding="utf-8")

    def run(match: re.Match[str]) -> str:
        before, told = set(folder.iterdir()), io.StringIO()
        with contextlib.redirect_stdout(told):
            exec(compile(match[1], str(page), "exec"), names)
        pictures = [file.name for file in sorted(set(folder.iterdir()) - before)]
        shown = "".join(f"\n![{name}]({name})\n" for name in pictures if name.endswith(".png"))
        printed = f"\n```text\n{told.getvalue()}```\n" if told.getvalue() else ""
        return match[0] + printed + shown

    with contextlib.chdir(folder):
        return BLOCK.sub(run, text)


def command_line() -> str:
    """The page of all commands, as their own help tells it."""
    from nanorom.cli.parser import build_parser

    parser = build_parser()
    (verbs,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    parts = [
        "# Command line\n\nExit status 0, or one line on standard error and another status; "
        "`--debug` shows where."
    ]
    for name, command in verbs.choices.items():
        parts.append(f"## nanorom {name}\n\n```text\n{command.format_help().rstrip()}\n```")
    return "\n\n".join(parts) + "\n"


def main() -> None:
    os.environ["COLUMNS"] = "100"  # of the help
    shutil.rmtree(READY, ignore_errors=True)
    for page in sorted(HERE.rglob("*.md")):
        ready = READY / page.relative_to(HERE)
        ready.parent.mkdir(parents=True, exist_ok=True)
        ready.write_text(executed(page, ready.parent), encoding="utf-8")
    (READY / "cli.md").write_text(command_line(), encoding="utf-8")


if __name__ == "__main__":
    main()
