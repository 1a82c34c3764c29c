"""tools/check_layers must catch each kind of forbidden include. Every case is a tiny repository made on the spot."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
LAYERS = """
[folders]
"src/meniscus/base" = []
"src/meniscus/field" = []
"src/meniscus/band" = ["field"]
"src/meniscus/render" = ["field"]
"apps/cli" = ["field", "band", "render"]
[libraries.eigen]
includes = ["Eigen/"]
folders = ["*"]
in_headers_of = ["*"]
[libraries.openvdb]
includes = ["openvdb/"]
folders = ["band", "render"]
in_headers_of = ["band"]
"""


class CheckLayers(unittest.TestCase):
    def check(self, files, layers=LAYERS):
        """Exit code and findings for a repository with these files."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in {"layers.toml": layers, **files}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            run = subprocess.run([sys.executable, REPOSITORY / "tools/check_layers", root], capture_output=True, text=True)
            self.assertEqual(run.stderr, "")
            return run.returncode, run.stdout.splitlines()

    def expect(self, files, *words, layers=LAYERS):
        """Exactly one finding, and it holds these words."""
        code, findings = self.check(files, layers)
        self.assertEqual((code, len(findings)), (1, 1), findings)
        for word in words:
            self.assertIn(word, findings[0])

    def test_accepts_what_the_table_allows(self):
        files = {
            "src/meniscus/base/vec.h": "#include <Eigen/Core>\n#include <vector>\n",
            "src/meniscus/field/field.h": "#include <meniscus/base/vec.h>\n",
            "src/meniscus/band/grid.h": "#include <openvdb/openvdb.h>\n#include <meniscus/field/field.h>\n",
            "src/meniscus/render/render.cpp": '#include <openvdb/openvdb.h>\n#include "local.h"\n',
            "src/meniscus/render/local.h": "",
            "apps/cli/main.cpp": "#include <meniscus/render/local.h>\n",
        }
        self.assertEqual(self.check(files), (0, []))

    def test_upward_include(self):
        files = {"src/meniscus/field/a.cpp": "\n#include <meniscus/band/grid.h>\n", "src/meniscus/band/grid.h": ""}
        self.expect(files, "src/meniscus/field/a.cpp:2:", "field may not include", "band/grid.h")

    def test_sideways_include_and_quotes_are_no_way_round(self):
        files = {"src/meniscus/band/a.cpp": '#include "../render/r.h"\n', "src/meniscus/render/r.h": ""}
        self.expect(files, "band may not include", "render/r.h")

    def test_nobody_includes_the_apps(self):
        files = {"src/meniscus/render/a.cpp": '#include "../../../apps/cli/verb.h"\n', "apps/cli/verb.h": ""}
        self.expect(files, "render may not include", "apps/cli/verb.h")

    def test_cycle_between_files(self):
        files = {
            "src/meniscus/field/a.h": "#include <meniscus/field/b.h>\n",
            "src/meniscus/field/b.h": "#include <meniscus/field/c.h>\n",
            "src/meniscus/field/c.h": "#include <meniscus/field/a.h>\n",
        }
        self.expect(files, "include cycle", "a.h -> ", "b.h -> ", "c.h -> ")

    def test_library_outside_its_folder(self):
        self.expect({"src/meniscus/field/a.cpp": "#include <openvdb/openvdb.h>\n"}, "field may not include openvdb")

    def test_private_library_in_a_header(self):
        self.expect({"src/meniscus/render/a.h": "#include <openvdb/openvdb.h>\n"}, "openvdb", "header of render")

    def test_library_leaking_through_a_header(self):
        files = {
            "src/meniscus/band/grid.h": "#include <meniscus/band/tree.h>\n",
            "src/meniscus/band/tree.h": "#include <openvdb/openvdb.h>\n",
            "apps/cli/main.cpp": "#include <meniscus/band/grid.h>\n",
        }
        self.expect(files, "apps/cli/main.cpp:1:", "brings openvdb into cli")

    def test_unknown_names(self):
        self.expect({"src/meniscus/attic/a.cpp": ""}, "attic/a.cpp", "not in layers.toml")
        self.expect({"src/meniscus/field/a.cpp": "#include <boost/any.hpp>\n"}, "<boost/any.hpp>", "no library")
        self.expect({"src/meniscus/field/a.cpp": "#include <meniscus/field/gone.h>\n"}, "gone.h is not there")

    def test_the_table_itself(self):
        upside_down = LAYERS.replace('"src/meniscus/field" = []', '"src/meniscus/field" = ["band"]')
        self.expect({}, "layers.toml", "stand on one another", "band", "field", layers=upside_down)
        self.expect({}, "layers.toml", "attic, which is no folder", layers=LAYERS.replace('= ["field"]', '= ["field", "attic"]', 1))


if __name__ == "__main__":
    unittest.main()
