"""Random tables and sweeps: they are read, or refused with one line."""

import re

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nanorom.errors import NanoromError
from nanorom.measurement.data import Resonances
from nanorom.scene.excitation import Excitation

FEW = settings(max_examples=60, suppress_health_check=list(HealthCheck), deadline=None)

keys = st.sampled_from(["drive", "sweep", "damping", "direct", "from", "to", "quality_factor", "x"])
values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
    | st.sampled_from(["1 Pa", "0.9 f1", "1e400 Pa", "1 mN/m", "-3 f1"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3),
    max_leaves=8,
)  # fmt: skip


@FEW
@given(st.dictionaries(keys, st.dictionaries(keys, values, max_size=4), max_size=4))
def test_any_keys_and_values_of_a_sweep_may_be_wrong(tmp_path_factory, tables):
    text = "\n".join(
        f"[{section}]\n" + "\n".join(f"{key} = {value!r}" for key, value in entries.items())
        for section, entries in tables.items()
    )
    path = tmp_path_factory.getbasetemp() / "fuzz.toml"
    path.write_text(text, encoding="utf-8", errors="replace")
    try:
        Excitation.from_file(path)
    except NanoromError as error:
        assert re.fullmatch(r"[^\n]+", str(error))


@FEW
@given(
    st.text(max_size=60)
    | st.lists(
        st.lists(st.sampled_from(["frequency", "label", "1 MHz", "", "nan", "f01", '"', "é", "-1"]),
                 max_size=4).map(",".join), max_size=6).map("\n".join)
)  # fmt: skip
def test_any_table_of_resonances_may_be_wrong(tmp_path_factory, table):
    path = tmp_path_factory.getbasetemp() / "fuzz.csv"
    path.write_text(table, encoding="utf-8", errors="replace", newline="")
    try:
        Resonances.from_file(path)
    except NanoromError as error:
        assert re.fullmatch(r"[^\n]+", str(error))
