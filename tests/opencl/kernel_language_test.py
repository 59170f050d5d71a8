#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The kernels are OpenCL C 1.1, for devices with 32-bit and with 64-bit addresses.

Drivers differ in how they compile kernels, and some drivers of boards only support 1.1. So Clang compiles them here
with its strictest options, for no particular device.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

KERNELS = Path(__file__).resolve().parents[2] / "kernels"
# The programs: their parts in the order in which drivers get them.
WALKS = ("ray_walk.h", "records.h", "prefilter.cl")
RANGES = (*WALKS, "row_records.h", "row_math.h", "row_ranges.h", "ranges.cl")
ROWS = ("ray_walk.h", "records.h", "row_records.h", "row_math.h", "row_vector.h", "row_access.h", "row_drive.h",
        "row_odometry.h", "row_move.h", "row_ranges.h", "row_walls.h", "row_exact.h", "row_rays.h", "row_control.h",
        "row_pedestrian.h", "row_orca.h", "row_behaviour.h", "row_driven.h", "row_crowd.h", "row_outlines.h", "row_step.h", "row_arrays.h", "row_step.cl")
ISLANDS = ("ray_walk.h", "row_records.h", "row_math.h", "row_vector.h", "row_access.h", "row_crowd.h",
           "row_separation.h", "row_safe_part.h", "row_island.h", "row_forces.h", "row_joint.h", "row_solve.h",
           "islands.cl")
LARGE = "-DROW_SOLVES_LARGE"  # makes another program of the text for islands
CLANG = next((name for name in ("clang", "clang-19", "clang-16", "clang-14") if shutil.which(name)), None)


def read_kernels(parts: tuple[str, ...] = WALKS) -> str:
    return "".join((KERNELS / part).read_text(encoding="utf-8") for part in parts)


def run_clang(text: str, *options: str) -> subprocess.CompletedProcess:
    with tempfile.NamedTemporaryFile("w", suffix=".cl") as file:
        file.write(text)
        file.flush()
        return subprocess.run([CLANG, "-x", "cl", "-Xclang", "-finclude-default-header", *options, file.name],
                              capture_output=True, text=True, check=False)


def compile_kernels(version: str, target: str, tail: str = "", parts: tuple[str, ...] = WALKS,
                    options: tuple[str, ...] = ()) -> str:
    """Returns Clang's errors; empty if it accepts the kernels."""
    done = run_clang(read_kernels(parts) + tail, *options, f"-cl-std={version}", "-target", target, "-Wall", "-Wextra", "-pedantic",
                     "-Wconversion", "-Werror", "-fsyntax-only")
    return done.stderr if done.returncode != 0 else ""


@unittest.skipIf(CLANG is None, "no clang here")
class KernelLanguageTest(unittest.TestCase):
    def test_every_version_and_width_of_addresses(self) -> None:
        for version in ("CL1.1", "CL1.2", "CL2.0", "CL3.0"):
            for target in ("spir", "spir64"):
                for parts, options in ((WALKS, ()), (RANGES, ()), (ROWS, ()), (ISLANDS, ()), (ISLANDS, (LARGE,))):
                    with self.subTest(version=version, target=target, kernels=parts[-1], options=options):
                        self.assertEqual(compile_kernels(version, target, parts=parts, options=options), "")

    def test_drivers_get_all_parts_in_this_order(self) -> None:
        """A part that is embedded, but not here, would not be checked."""
        self.assertEqual({path.name for path in KERNELS.iterdir()}, {*WALKS, *RANGES, *ROWS, *ISLANDS})
        source = (KERNELS.parent / "libstage_cl/open_device.cc").read_text(encoding="utf-8")
        embedded = (KERNELS.parent / "libstage_cl/CMakeLists.txt").read_text(encoding="utf-8")
        files = dict(re.findall(r"(k\w+Source) kernels/([\w.]+)", embedded))
        lists = re.findall(r"return \{(kRayWalkSource.*?)\};", source, re.DOTALL)
        orders = [[files[name] for name in re.findall(r"k\w+Source", text)] for text in lists]
        self.assertEqual(orders, [list(WALKS), list(RANGES), list(ROWS), list(ISLANDS)])

    def test_newer_functions_would_be_noticed(self) -> None:
        later = "__kernel void later(__global uint* a) { a[0] = popcount(a[0]); }\n"
        self.assertIn("popcount", compile_kernels("CL1.1", "spir", later))
        self.assertEqual(compile_kernels("CL1.2", "spir", later), "")

    def test_no_load_of_a_record_straddles_cache_lines(self) -> None:
        """A record is read in pieces of at most 16 bytes, each aligned to its size."""
        for record, alignment in (("ray_super_t", 16), ("ray_fan_record_t", 16), ("ray_group_record_t", 16),
                                  ("ray_direction_t", 8), ("ray_range_record_t", 16)):
            def check(size: int, record: str = record) -> str:
                return (f"struct behind_{record} {{ char c; {record} r; }};\n"
                        f"typedef char of_{record}[sizeof(struct behind_{record}) - sizeof({record}) == {size} "
                        "? 1 : -1];\n")
            for target in ("spir", "spir64"):
                self.assertEqual(compile_kernels("CL1.1", target, check(alignment)), "", record)
            self.assertNotEqual(compile_kernels("CL1.1", "spir", check(alignment // 2)), "")

    def test_registers(self) -> None:
        """Checks the number of registers of a walk on a GPU with 32-bit registers, which docs/boards.md discusses."""
        item = "(__builtin_amdgcn_workgroup_id_x() * 64 + __builtin_amdgcn_workitem_id_x())"
        done = run_clang(f"#define get_global_id(dimension) {item}\n" + read_kernels(), "-cl-std=CL1.1", "-target",
                         "amdgcn-amd-amdhsa", "-mcpu=gfx900", "-nogpulib", "-fvisibility=hidden", "-O2", "-S", "-o", "-")
        if done.returncode != 0 and "target" in done.stderr:
            self.skipTest("this clang makes no code for AMD's GPUs")
        kernel = done.stdout[done.stdout.index("\nwalk_fans:"):]
        found = {name: int(re.search(rf"; {name}: (\d+)", kernel)[1]) for name in ("NumVgprs", "ScratchSize")}
        self.assertEqual(found["ScratchSize"], 0, "values are kept in memory")
        self.assertLessEqual(found["NumVgprs"], 80)

    def test_records_are_the_same_for_all_devices(self) -> None:
        """The sizes of size_t and of pointers depend on the device."""
        for header, least, allowed in (("records.h", 4, {"int", "ray_uint", "ray_ulong"}),
                                       ("row_records.h", 20, {"int", "ray_uint", "ray_ulong", "double"})):
            text = (KERNELS / header).read_text(encoding="utf-8")
            records = re.findall(r"typedef struct[^{]*\{(.*?)\}", text, re.DOTALL)
            self.assertGreaterEqual(len(records), least)
            for record in records:
                members = re.sub(r"/\*.*?\*/", "", record, flags=re.DOTALL)
                types = {line.split()[0] for line in members.split(";") if line.strip()}
                self.assertLessEqual({name for name in types if not name.startswith("row_")}, allowed)
                self.assertNotIn("*", members)


if __name__ == "__main__":
    unittest.main()
