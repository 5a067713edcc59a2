"""What ended processes leave in the cache of compiled forms stops nobody."""

import subprocess
import sys

import pytest

from nanorom.fem.solvers import compiler

HOLD = """
import sys
from pathlib import Path
from nanorom.fem.solvers import compiler
with compiler.held(Path(sys.argv[1]), True):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def source(tmp_path):
    """The source of a form that a process left uncompiled, beside a compiled one."""
    for name in ("libffcx_forms_1.c", "libffcx_forms_2.c", "libffcx_forms_2.c.cached"):
        (tmp_path / name).touch()
    return tmp_path / "libffcx_forms_1.c"


def test_what_a_killed_process_left_is_compiled_again(source):
    def make():
        if source.exists():
            raise TimeoutError("as the form compiler after ten seconds")
        return "form"

    assert compiler.run(make, source.parent, compiles=True) == "form"
    assert sorted(p.name for p in source.parent.glob("libffcx*")) == [
        "libffcx_forms_2.c",
        "libffcx_forms_2.c.cached",
    ]


def test_an_interrupted_compilation_leaves_nothing(source):
    def make():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        compiler.run(make, source.parent, compiles=True)
    assert not source.exists()


def test_what_another_process_compiles_is_left_to_it_and_waited_for(source):
    command = [sys.executable, "-c", HOLD, str(source.parent)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as other:
        assert other.stdout.readline() == "held\n"
        with compiler.held(source.parent, True) as cache:
            cache.clear()
            assert source.exists()
            other.stdin.close()
            cache.clear(patience=60.0)
            assert not source.exists()


def test_a_cache_that_cannot_be_held_is_used_all_the_same(tmp_path):
    (tmp_path / "file").touch()
    assert compiler.run(lambda: "form", tmp_path / "file" / "cache", compiles=True) == "form"
