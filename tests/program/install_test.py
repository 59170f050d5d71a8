#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Installs Stage, moves the installation, and uses it as a client would: the program, and a program
and a controller (install_client) built with CMake, with pkg-config, and by hand."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
from build_tree import (BINARY_DIR, CMAKE, COMPILER, HAS_WINDOW, SANITIZE, SOURCE_DIR,  # noqa: E402
                        cache_entry, run, skip_if_static)
from patience import PATIENCE  # noqa: E402

skip_if_static()
CLIENT_DIR = SOURCE_DIR / "tests" / "program" / "install_client"
PKG_CONFIG = shutil.which("pkg-config")
XVFB = shutil.which("Xvfb")
WINDOW_WORLD = """
interval_sim 50
window ( size [500 400] show_data 1 show_arrow 1 )
position ( name "wanderer" size [0.4 0.4 0.3] ranger( sensor( range [0 3] samples 19 ) ) )
"""
VERSION = "5.0.0"
# Warnings that clients would get from our headers are errors.
COMPILE = [COMPILER, "-std=c++17", "-Wall", "-Wextra", "-Werror", *SANITIZE]


class InstallTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name).resolve()
        cls.first_prefix = cls.folder / "first"
        run(CMAKE, "--install", BINARY_DIR, "--prefix", cls.first_prefix)
        cls.prefix = cls.folder / "elsewhere" / "stage"
        cls.prefix.parent.mkdir()
        cls.first_prefix.rename(cls.prefix)
        cls.include_dir = cls.prefix / "include" / "Stage-5.0"
        cls.plugin_dir = cls.prefix / "lib" / "stage-5.0"

    def new_folder(self, name: str) -> Path:
        path = self.folder / name
        path.mkdir()
        return path

    def check_client(self, folder: Path, **environment: object) -> None:
        """Runs the client in a folder, with its controller beside it."""
        output = run(folder / "client", STAGEPATH=folder, **environment)
        self.assertIn(f"version {VERSION}\n", output)
        for robot in ("wanderer", "circler"):
            way = re.search(rf"^{robot} (\S+)$", output, re.MULTILINE)
            assert way is not None, output
            self.assertGreater(float(way[1]), 0.1, output)
        libraries = re.findall(r"^library (.*)$", output, re.MULTILINE)
        ours = [path for path in libraries if re.search(r"libstage|wander|circle", path)]
        self.assertEqual(sorted(ours), sorted([
            str(self.prefix / "lib" / f"libstage.so.{VERSION}"),
            str(self.plugin_dir / "wander.so"), str(folder / "circle.so")]))

    def check_window_client(self, client: Path, **environment: object) -> None:
        """Runs the client on a virtual display, and without any."""
        assert XVFB is not None
        world = client.parent / "window.world"
        world.write_text(WINDOW_WORLD, encoding="utf-8")
        read_end, write_end = os.pipe()
        with subprocess.Popen([XVFB, "-displayfd", str(write_end), "-screen", "0", "1000x800x24",
                               "-noreset"],
                              pass_fds=[write_end], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL) as server:
            try:
                os.close(write_end)
                with os.fdopen(read_end, encoding="ascii") as numbers:
                    display = ":" + numbers.readline().strip()
                output = run(client, world, DISPLAY=display, **environment)
            finally:
                server.terminate()
        for line in ("windows 1", "steps 1", "pictures 1", f"title Stage (client): {world}"):
            self.assertIn(line + "\n", output)
        self.assertIn("windows 0\n", run(client, "--no-window", DISPLAY="", **environment))

    def test_everything_is_in_its_place(self) -> None:
        for path in ("bin/stage", "lib/libstage.so", f"lib/libstage.so.{VERSION}",
                     "include/Stage-5.0/stage.hh", "share/stage/worlds/simple.world",
                     "share/stage/worlds/bitmaps/rooms.png",
                     "share/stage/worlds/robots/epuck.inc", "share/stage/worlds/robots/epuck.world",
                     "lib/pkgconfig/stage.pc",
                     "lib/cmake/Stage/stage-config.cmake",
                     "lib/cmake/Stage/stage-config-version.cmake"):
            self.assertTrue((self.prefix / path).is_file(), path)
        self.assertEqual(sorted(path.name for path in self.plugin_dir.iterdir()),
                         sorted(path.name for path in (BINARY_DIR / "lib/stage-5.0").iterdir()))

    def test_what_comes_with_it_is_found_by_name(self) -> None:
        """It works from any folder, although the installation has been moved."""
        folder = self.new_folder("worlds")
        (folder / "own.world").write_text('include "sensors.inc"\ninclude "robots.inc"\ninclude "maps.inc"\n'
                                          'floorplan( bitmap "rooms.png" size [16 16 1] )\nexplorer()\n',
                                          encoding="utf-8")
        (folder / "old.world").write_text('include "pioneer.inc"\ninclude "sick.inc"\ninclude "map.inc"\n'
                                          'floorplan( bitmap "bitmaps/cave.png" size [16 16 1] )\n'
                                          'pioneer2dx( sicklaser() )\n', encoding="utf-8")
        (folder / "robots.world").write_text('include "robots/epuck.inc"\ninclude "robots/turtlebot4.inc"\n'
                                             'epuck()\nturtlebot4( pose [1 0 0 0] )\n', encoding="utf-8")
        for world in ("simple.world", "cave.world", "own.world", "old.world", "robots.world", "robots/epuck.world"):
            run("sh", "-c", f'cd "{folder}" && exec "{self.prefix}/bin/stage" -g --duration 0.5 {world}')
        done = subprocess.run([self.prefix / "bin" / "stage", "-g", "cave"], cwd=folder, text=True, check=False,
                              capture_output=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, 1)
        self.assertIn('did you mean "cave.world", which comes with Stage?', done.stderr)

    def test_no_file_names_where_it_was_made(self) -> None:
        texts = [path for pattern in ("include/**/*.h*", "lib/cmake/**/*.cmake", "lib/**/*.pc")
                 for path in self.prefix.glob(pattern)]
        self.assertGreater(len(texts), 10)
        for path in texts:
            text = path.read_text(encoding="utf-8")
            for place in (self.first_prefix, BINARY_DIR, SOURCE_DIR):
                self.assertNotIn(f"{place}/", text, path)

    def test_program_runs_where_it_was_moved_to(self) -> None:
        world = self.prefix / "share" / "stage" / "worlds" / "simple.world"
        hashes = [run(program, "-g", world, "--duration", "2", "--state-hash")
                  for program in (self.prefix / "bin" / "stage", BINARY_DIR / "bin" / "stage")]
        self.assertEqual(hashes[0], hashes[1])
        self.assertRegex(hashes[0], r"[0-9a-f]{16}")
        for binary in (self.prefix / "bin" / "stage", self.plugin_dir / "wander.so"):
            used = re.findall(r"libstage\S* => (\S+)", run("ldd", binary))
            self.assertEqual([os.path.normpath(path) for path in used],
                             [str(self.prefix / "lib" / f"libstage.so.{VERSION}")])

    def test_client_of_cmake(self) -> None:
        folder = self.new_folder("with_cmake")
        # The build's generator, because this machine may have no other.
        run(CMAKE, "-G", cache_entry("CMAKE_GENERATOR"), "-S", CLIENT_DIR, "-B", folder,
            f"-DCMAKE_PREFIX_PATH={self.prefix}",
            f"-DEXPECTED_PREFIX={self.prefix}", f"-DCMAKE_CXX_COMPILER={COMPILER}",
            f"-DCMAKE_CXX_FLAGS={' '.join(SANITIZE)}")
        run(CMAKE, "--build", folder)
        self.check_client(folder)
        self.assertEqual((folder / "window_client").exists(), HAS_WINDOW)
        if HAS_WINDOW and XVFB:
            self.check_window_client(folder / "window_client")

    def build_example(self, example: str, files: tuple[str, ...], name: str, own_name: str) -> Path:
        """Builds a plug-in of the examples as its README says, by another name, as Stage has found its own already."""
        folder, source = self.new_folder(own_name), SOURCE_DIR / "examples" / example
        texts = {file: (source / file).read_text(encoding="utf-8") for file in files}
        readme = (source / "README.md").read_text(encoding="utf-8").split("## Compile it elsewhere")[1]
        texts["CMakeLists.txt"] = "\n".join(re.findall(r"^    (.*)$", readme, re.MULTILINE)) + "\n"
        for file, text in texts.items():
            (folder / file.replace(name, own_name)).write_text(text.replace(name, own_name), encoding="utf-8")
        run(CMAKE, "-G", cache_entry("CMAKE_GENERATOR"), "-S", folder, "-B", folder,
            f"-DCMAKE_PREFIX_PATH={self.prefix}", f"-DCMAKE_CXX_COMPILER={COMPILER}",
            f"-DCMAKE_CXX_FLAGS={' '.join(SANITIZE)}")
        run(CMAKE, "--build", folder)
        return folder

    def test_drive_in_a_plugin(self) -> None:
        """The example of a drive is built as its README says, and changes how its robots move."""
        folder = self.build_example("drive", ("lagging_drive.cc", "lagging.world"), "lagging", "sluggish")
        hashes = [run(self.prefix / "bin" / "stage", "-g", "--duration", "3", "--state-hash", "--set", f"slow0.drive={drive}",
                      folder / "sluggish.world", STAGEPATH=folder) for drive in ("sluggish", "diff", "sluggish")]
        self.assertEqual(hashes[0], hashes[2])
        self.assertNotEqual(hashes[0], hashes[1])

    def test_batch_controller_in_a_plugin(self) -> None:
        """The example of a batch controller is built as its README says, and drives its robots."""
        folder = self.build_example("batch_controller", ("convoy.cc", "convoy.world"), "convoy", "caravan")
        hashes = [run(self.prefix / "bin" / "stage", "-g", "--duration", "3", "--state-hash", *options,
                      folder / "caravan.world", STAGEPATH=folder) for options in ((), ("--no-controllers",), ())]
        self.assertEqual(hashes[0], hashes[2])
        self.assertNotEqual(hashes[0], hashes[1])

    def test_sensor_in_a_plugin(self) -> None:
        """The example of a model type, which adds rays to the batch, is built as its README says, and logged."""
        folder = self.build_example("model", ("sonar_ring.cc", "sonar_ring.hh", "sonar.world"), "sonar_ring", "own_ring")
        run(self.prefix / "bin" / "stage", "-g", "--duration", "1", "--log", folder / "run.mcap", "--log-compression",
            "none", folder / "sonar.world", STAGEPATH=folder)
        log = (folder / "run.mcap").read_bytes()
        self.assertIn(b"stage_msgs/msg/OwnRing", log)
        self.assertEqual(log.count(b"/readings/own_ring"), 2)  # in a chunk and in the summary
        self.assertIn(b"Unit: m\nfloat64[] ranges\n", log)

    @unittest.skipUnless(PKG_CONFIG, "pkg-config is not installed")
    def test_client_of_pkg_config(self) -> None:
        folder = self.new_folder("with_pkg_config")

        def ask(*options: str) -> list[str]:
            return run(PKG_CONFIG, *options, "stage",
                       PKG_CONFIG_PATH=self.prefix / "lib" / "pkgconfig").split()

        self.assertEqual(ask("--modversion"), [VERSION])
        self.assertEqual(os.path.realpath(*ask("--variable=prefix")), str(self.prefix))
        flags = ask("--cflags", "--libs")
        run(*COMPILE, CLIENT_DIR / "main.cc", *flags, "-o", folder / "client")
        run(*COMPILE, "-shared", "-fPIC", CLIENT_DIR / "circle.cc", *flags,
            "-o", folder / "circle.so")
        self.check_client(folder, LD_LIBRARY_PATH=self.prefix / "lib")

    @unittest.skipUnless(PKG_CONFIG and XVFB, "pkg-config or Xvfb is not installed")
    @unittest.skipUnless(HAS_WINDOW, "built without the window")
    def test_window_of_pkg_config(self) -> None:
        folder = self.new_folder("window_with_pkg_config")
        flags = run(PKG_CONFIG, "--cflags", "--libs", "stage",
                    PKG_CONFIG_PATH=self.prefix / "lib" / "pkgconfig").split()
        run(*COMPILE, CLIENT_DIR / "window.cc", *flags, "-o", folder / "client")
        self.check_window_client(folder / "client", LD_LIBRARY_PATH=self.prefix / "lib")

    def test_header_by_its_long_name(self) -> None:
        source = self.new_folder("by_long_name") / "client.cc"
        source.write_text("#include <Stage-5.0/stage.hh>\nStg::World* world;\n", encoding="utf-8")
        run(*COMPILE, "-fsyntax-only", f"-I{self.prefix / 'include'}", source)

    def test_header_by_the_name_of_stage_4_3(self) -> None:
        source = self.new_folder("by_old_name") / "client.cc"
        source.write_text("#include <Stage-4.3/stage.hh>\n#include <stage.hh>\nStg::World* world;\n", encoding="utf-8")
        include = self.prefix / "include"
        for folders in ((include / "Stage-5.0",), (include, include / "Stage-5.0")):
            run(*COMPILE, "-fsyntax-only", *(f"-I{folder}" for folder in folders), source)

    def test_installing_again_leaves_headers_alone(self) -> None:
        second = self.folder / "second"
        times = []
        for _ in range(2):
            run(CMAKE, "--install", BINARY_DIR, "--prefix", second, "--component", "libstage-dev")
            times.append((second / "include" / "Stage-5.0" / "stage.hh").stat().st_mtime_ns)
        self.assertEqual(times[0], times[1])
        self.assertFalse((second / "bin").exists())


if __name__ == "__main__":
    unittest.main()
