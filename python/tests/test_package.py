"""The package as a whole: its version, and its names as a type checker sees them."""

import re
import unittest
from pathlib import Path

import avastra

ROOT = Path(__file__).resolve().parents[1]


class Package(unittest.TestCase):
    def test_the_version_is_that_of_the_engine(self):
        cargo = ROOT / "native" / "Cargo.toml"
        if not cargo.is_file():
            self.skipTest("the package is tested away from its repository")
        found = re.search(r'^version = "(.*)"$', cargo.read_text(encoding="utf-8"), re.MULTILINE)
        self.assertEqual(avastra.__version__, found.group(1))

    def test_a_type_checker_sees_every_name_that_is_loaded_late(self):
        source = Path(avastra.__file__).read_text(encoding="utf-8")
        for name in avastra._ENGINE + avastra._NOTEBOOK:
            # Under another form `mypy --strict` takes it for a name that is not exported.
            self.assertRegex(source, rf"import {name} as {name}\n")

    def test_an_unknown_name_is_an_attribute_error(self):
        with self.assertRaisesRegex(AttributeError, "no attribute 'Nothing'"):
            avastra.Nothing


if __name__ == "__main__":
    unittest.main()
