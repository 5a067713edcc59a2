"""Write the tables of files into the documents, from what the classes declare.

./run python -m tests.files.layouts
"""

import re
from importlib import import_module
from pathlib import Path

from nanorom.files import layout, stored
from nanorom.results import diagram_file
from nanorom.results.estimates import Estimates

TOP = Path(__file__).parents[2]
DOCUMENTS = [TOP / "README.md", TOP / "docs" / "files.md"]
LOADED = [kind.load.split(":") for kind in stored.KINDS.values()]  # module, method of the class
CLASSES = {
    name: getattr(import_module(module), name)
    for module, name in ((module, method.split(".")[0]) for module, method in LOADED)
}
TABLE = re.compile(r"(<!-- layout of (\w+), [^>]*-->\n).*?(<!-- end -->)", re.DOTALL)


def rows(name):
    table = layout.rows(CLASSES[name])
    if name == "Response":
        for at, items in diagram_file.TABLES.items():
            table += [layout.item_row(f"{at}/{each}", item) for each, item in items.items()]
        table += [(f"level/K/estimates/{at}", *more) for at, *more in layout.rows(Estimates)]
    return table


def with_tables(text):
    """A document with its tables made anew."""
    return TABLE.sub(lambda m: f"{m[1]}\n{layout.markdown(rows(m[2]))}\n\n{m[3]}", text)


if __name__ == "__main__":
    for document in DOCUMENTS:
        document.write_text(with_tables(document.read_text("utf-8")), "utf-8")
