"""Does docs/reference/formats.md name every element and attribute of the schemas of OpenSCENARIO XML and OpenDRIVE?

Arguments: folders with the schemas (`.xsd`) of both formats, such as the unpacked packages `asam-qc-openscenarioxml` and
`asam-qc-opendrive` of PyPI (docs/maintaining.md). Each folder that holds schemas is one version. With `--list` it prints what the
schemas have, a line for each element, and compares nothing.
"""

import collections
import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

XS = "{http://www.w3.org/2001/XMLSchema}"

#: Elements that may stand in every element of OpenDRIVE.
EVERYWHERE = ("dataQuality", "include", "userData")

#: Elements that no schema has, of a draft of OpenSCENARIO 1.0: files have them.
DRAFTS = {"PositionInLaneCoordinates", "PositionInRoadCoordinates"}

#: Versions before these are not read: their folders are passed over.
OLD = ("1.1", "1.2", "1.3")


def local(name):
    return (name or "").split(":")[-1]


class Schema:
    """The elements of one version, each by its parent, with its attributes."""

    def __init__(self, files):
        self.types, self.groups, self.attributes, self.tops = {}, {}, {}, {}
        places = {"complexType": self.types, "group": self.groups, "attributeGroup": self.attributes, "element": self.tops}
        for file in files:
            for node in ElementTree.parse(file).getroot():
                place = places.get(node.tag.removeprefix(XS))
                if place is not None:
                    place[node.get("name")] = node
        self.found, self.seen = collections.defaultdict(set), set()
        for root in ("OpenSCENARIO", "OpenDRIVE"):
            if root in self.tops:
                self.visit(self.tops[root], "")

    def parts(self, node, attributes, children):
        """Adds the attributes and the children that a type has, with those of its bases."""
        for part in node:
            kind, name = part.tag.removeprefix(XS), local(part.get("ref"))
            if kind == "attribute":
                attributes.add(part.get("name") or name)
            elif kind == "element":
                children.append(part)
            elif kind in ("group", "attributeGroup") and name:
                self.parts((self.groups if kind == "group" else self.attributes)[name], attributes, children)
            elif kind == "extension":
                base = self.types.get(local(part.get("base")))
                if base is not None:
                    self.parts(base, attributes, children)
                self.parts(part, attributes, children)
            elif kind not in ("annotation", "assert"):
                self.parts(part, attributes, children)

    def derived(self, name):
        """The types that extend a type, directly or not: an element of the type may be any of them."""
        own = [other for other, node in self.types.items()
               if any(local(part.get("base")) == name for part in node.iter(XS + "extension"))]
        return own + [deeper for other in own for deeper in self.derived(other)]

    def visit(self, element, parent):
        name = element.get("name") or local(element.get("ref"))
        if name.startswith("_"):
            return
        if not element.get("name"):
            element = self.tops[name]
        of = local(element.get("type"))
        if (parent, name, of) in self.seen:
            return
        self.seen.add((parent, name, of))
        types = [self.types[of]] if of in self.types else element.findall(XS + "complexType")
        if of in self.types and (types[0].get("abstract") == "true" or element.find(XS + "alternative") is not None):
            types += [self.types[other] for other in self.derived(of)]
        attributes, children = self.found[parent, name], []
        for node in types:
            self.parts(node, attributes, children)
        for child in children:
            self.visit(child, name)


def of_schemas(folders):
    """The elements of all versions of each format: of OpenSCENARIO by their names, of OpenDRIVE by their parents' and their own."""
    formats = {"OpenSCENARIO": collections.defaultdict(set), "OpenDRIVE": collections.defaultdict(set)}
    homes = sorted({file.parent for folder in folders for file in folder.rglob("*.xsd")})
    for home in (home for home in homes if home.name not in OLD):
        found = Schema(sorted(home.glob("*.xsd"))).found
        kind = "OpenDRIVE" if ("", "OpenDRIVE") in found else "OpenSCENARIO"
        for (parent, name), attributes in found.items():
            if kind == "OpenSCENARIO":
                formats[kind][name] |= attributes
            elif name in EVERYWHERE:
                formats[kind][f"*.{name}"] |= attributes
            elif parent not in ("", *EVERYWHERE):
                formats[kind][f"{parent}.{name}"] |= attributes
    return formats


def of_page(page):
    """For each format the rows of its table, the names that stand in its lists, and all that has a place."""
    formats = {}
    for section in page.split("\n## ")[1:]:
        name = section.split()[0]
        rows = {}
        for line in section.splitlines():
            if row := re.match(r"\| `([\w.*]+)` \|(.*)\|", line):
                rows[row[1]] = set(re.findall(r"`([\w.]+)`", row[2]))
        lists = [line for line in section.splitlines() if line.startswith("`")]
        formats[name] = rows, {word for line in lists for word in re.findall(r"`([\w.*]+)`", line)}
    return formats


def main():
    folders = [Path(folder) for folder in sys.argv[1:] if folder != "--list"]
    formats = of_schemas(folders)
    if not folders or not all(formats.values()):
        sys.exit("usage: formats.py [--list] FOLDER... (with schemas of both formats)")
    if "--list" in sys.argv:
        for kind, elements in formats.items():
            for name, attributes in sorted(elements.items()):
                print(kind, name, *sorted(attributes))
        return
    page = of_page((Path(__file__).parents[2] / "docs/reference/formats.md").read_text())
    wrong = []
    for kind, elements in formats.items():
        rows, whole = page[kind]
        # What lies within an element that is passed over as a whole is passed over with it.
        within = {name for name in elements if kind == "OpenDRIVE" and inside(name, whole, elements)}
        for name, attributes in sorted(elements.items()):
            if name in rows:
                wrong += [f"{kind}: `{name}` has no `{one}` on the page" for one in sorted(attributes - rows[name])]
                wrong += [f"{kind}: `{name}` has no `{one}` in any schema" for one in sorted(rows[name] - attributes)]
            elif name not in whole and name not in within:
                wrong.append(f"{kind}: `{name}` is not on the page: {' '.join(sorted(attributes))}")
        wrong += [f"{kind}: `{name}` is in no schema" for name in sorted((set(rows) | whole) - set(elements) - DRAFTS)]
    print(*wrong, sep="\n")
    count = sum(len(elements) for elements in formats.values())
    print(f"{count} elements, {len(wrong)} differences")
    sys.exit(bool(wrong))


def inside(name, whole, elements, depth=8):
    """Whether every way to an element leads through one that is passed over as a whole."""
    if name in whole:
        return True
    parent = name.split(".")[0]
    ways = [other for other in elements if other.split(".")[-1] == parent]
    return depth > 0 and bool(ways) and all(inside(other, whole, elements, depth - 1) for other in ways)


if __name__ == "__main__":
    main()
