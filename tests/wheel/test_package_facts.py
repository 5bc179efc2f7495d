"""Bills of materials, provenance and equal bytes of equal packages, on small packages made here."""

import hashlib
import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import zipfile
from unittest import mock

TREE = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(TREE / "python"))
import build_wheel  # noqa: E402
import package_facts  # noqa: E402

METADATA = "Name: relign-bench\nVersion: 0.1.0\nRequires-Dist: numpy>=1.24\nRequires-Dist: torch>=2.5; extra == 'train'\n"
LIBRARY = "libz.so.1"  # of zlib1g, which dpkg needs itself


@unittest.skipUnless(shutil.which("dpkg-query") and shutil.which("dpkg-deb"), "no dpkg")
class PackageFacts(unittest.TestCase):
    def setUp(self):
        kept = tempfile.TemporaryDirectory()
        self.addCleanup(kept.cleanup)
        self.folder = pathlib.Path(kept.name)
        epoch = mock.patch.dict(os.environ, {"SOURCE_DATE_EPOCH": "1700000000"})
        epoch.start()
        self.addCleanup(epoch.stop)

    def wheel(self, library):
        file = self.folder / "relign_bench-0.1.0-py3-none-any.whl"
        with zipfile.ZipFile(file, "w") as wheel:
            wheel.writestr("relign_bench-0.1.0.dist-info/METADATA", METADATA)
            wheel.writestr(f"relign_bench.libs/{library}", "code")
        return file

    def facts(self, file):
        """What the program writes beside a file."""
        package_facts.main([file])
        return [json.loads(file.with_name(f"{file.name}.{suffix}.json").read_text()) for suffix in ("cdx", "provenance")]

    def test_wheel_lists_bundled_libraries_and_requirements(self):
        file = self.wheel("libz-0123abcd.so.1")  # as auditwheel names it
        materials, provenance = self.facts(file)
        components = {one["name"]: one for one in materials["components"]}
        version = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "zlib1g"], capture_output=True, text=True, check=True)
        self.assertEqual(components["zlib1g"]["version"], version.stdout)
        self.assertEqual(components["zlib1g"]["components"],
                         [{"type": "file", "name": "relign_bench.libs/libz-0123abcd.so.1",
                           "hashes": [{"alg": "SHA-256", "content": hashlib.sha256(b"code").hexdigest()}]}])
        self.assertEqual([components[name]["scope"] for name in ("numpy", "torch")], ["required", "optional"])
        self.assertEqual(materials["metadata"]["timestamp"], "2023-11-14T22:13:20Z")
        self.assertEqual({one["bom-ref"] for one in materials["components"]}, set(materials["dependencies"][0]["dependsOn"]))
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        self.assertEqual(provenance["subject"], [{"name": file.name, "digest": {"sha256": digest}}])
        self.assertEqual(self.facts(file), [materials, provenance])

    def test_unknown_library_is_refused(self):
        with self.assertRaisesRegex(ValueError, "'relign_bench.libs/libnowhere.so.7' belongs to no Debian package"):
            self.facts(self.wheel("libnowhere.so.7"))

    def test_debian_package_lists_what_it_depends_on(self):
        (self.folder / "tree" / "DEBIAN").mkdir(parents=True)
        (self.folder / "tree" / "DEBIAN" / "control").write_text(
            "Package: relign-bench\nVersion: 0.1.0\nArchitecture: amd64\nMaintainer: A <a@localhost>\nDescription: b\n"
            "Depends: zlib1g (>= 1:1.2), libc6 (>= 2.36)\n")
        file = self.folder / "relign-bench_0.1.0_amd64.deb"
        subprocess.run(["dpkg-deb", "--root-owner-group", "--build", self.folder / "tree", file], check=True,
                       capture_output=True)
        materials, _ = self.facts(file)
        self.assertLessEqual({"zlib1g", "libc6"}, {one["name"] for one in materials["components"]})

    @unittest.skipUnless(importlib.util.find_spec("cyclonedx"), "no cyclonedx-python-lib, which has the schema of CycloneDX")
    def test_bill_of_materials_follows_the_schema(self):
        from cyclonedx.schema import SchemaVersion
        from cyclonedx.validation.json import JsonStrictValidator

        materials, _ = self.facts(self.wheel(LIBRARY))
        self.assertIsNone(JsonStrictValidator(SchemaVersion.V1_5).validate_str(json.dumps(materials)))


@unittest.skipUnless(importlib.util.find_spec("pip"), "no pip")
class Index(unittest.TestCase):
    def test_pip_installs_from_the_index(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            for name, needs in (("relign-bench", "Requires-Python: >=3.9,<3.99\n"), ("relign-bench-extras", "")):
                module = name.replace("-", "_")
                info = folder / name / f"{module}-0.1.0.dist-info"
                info.mkdir(parents=True)
                (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1.0\n{needs}")
                (info / "WHEEL").write_text("Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
                build_wheel.packed(info.parent, folder / f"{module}-0.1.0-py3-none-any.whl")
            build_wheel.write_index(folder)
            page = (folder / "simple" / "relign-bench" / "index.html").read_text()
            self.assertIn('data-requires-python="&gt;=3.9,&lt;3.99"', page)

            def install():
                return subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-cache-dir", "--target",
                                       folder / "there", "--index-url", (folder / "simple").as_uri(), "relign-bench",
                                       "relign-bench-extras"], capture_output=True, text=True, check=False)

            done = install()
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(len(list((folder / "there").glob("*.dist-info"))), 2)
            # The index has the hash of each file.
            wheel = folder / "relign_bench-0.1.0-py3-none-any.whl"
            wheel.write_bytes(wheel.read_bytes() + b"x")
            shutil.rmtree(folder / "there")
            self.assertIn("DO NOT MATCH THE HASHES", install().stderr)


class Packing(unittest.TestCase):
    def test_equal_files_make_equal_wheels(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            wheels = []
            for number, now in enumerate((1.6e9, 1.7e9)):
                info = folder / str(number) / "relign_bench-0.1.0.dist-info"
                info.mkdir(parents=True)
                (info / "METADATA").write_text(METADATA)
                os.utime(info / "METADATA", (now, now))
                with mock.patch.object(time, "time", return_value=now):
                    wheels.append(build_wheel.packed(info.parent, folder / f"{number}.whl").read_bytes())
            self.assertEqual(*wheels)


if __name__ == "__main__":
    unittest.main()
