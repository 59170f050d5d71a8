#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests of the energy meters of boards and cards: hwmon, INA231, batteries, NVIDIA's NVML."""

from __future__ import annotations

import shutil
import subprocess
import unittest
from pathlib import Path
from unittest import mock

from power_testing import ROOT, FalseNvml, MeterTestCase
from meters import MeterError, list_meters, open_meter
from meters.nvml import NvmlError, NvmlLibrary


class HwmonTest(MeterTestCase):
    """Chips of boards, cards and power supplies."""

    def measure(self, spec: str, seconds: float) -> object:
        meter = open_meter(spec, self.root, clock=self.clock)
        meter.start()
        self.clock.advance(seconds)
        return meter.stop()

    def test_the_area_under_a_ramp(self) -> None:
        folder = self.chip(0, "ina219", power1_input=0)
        self.clock.world = lambda now: self.write(
            "sys/class/hwmon/hwmon0/power1_input", round((now - 1000) * 2e6))
        reading = self.measure("hwmon:ina219", 10)
        self.assertAlmostEqual(reading.joules, 100, places=3)  # 10 s at half of 20 W
        self.assertEqual((reading.method, reading.scope), ("sampled", "rail"))
        self.assertEqual(reading.samples, 102)
        self.assertTrue(folder.exists())

    def test_an_energy_counter_goes_before_power(self) -> None:
        folder = self.chip(0, "xe", energy1_input=0, energy1_label="card",
                           power1_input=7_000_000)
        self.clock.world = lambda now: (folder / "energy1_input").write_text(
            str(round((now - 1000) * 3e6)))
        reading = self.measure("hwmon:xe", 10)
        self.assertEqual((round(reading.joules, 6), reading.method, reading.scope),
                         (30.0, "counter", "GPU"))
        self.clock.world = lambda now: None
        (folder / "energy1_input").unlink()
        (folder / "energy1_input").mkdir()
        reading = self.measure("hwmon:xe", 10)
        self.assertEqual((round(reading.joules, 6), reading.method), (70.0, "sampled"))

    def test_a_counter_without_range_that_goes_back(self) -> None:
        folder = self.chip(0, "amd_energy", energy1_input=9_000_000, energy1_label="Esocket0")
        meter = open_meter("hwmon:amd_energy/Esocket0", self.root, clock=self.clock)
        self.assertEqual(meter.scope, "package")
        meter.start()
        (folder / "energy1_input").write_text("8000000")
        self.clock.advance(1)
        self.assert_no_figure(meter.stop(), "went back from 9 J to 8 J")

    def test_averages_go_before_momentary_values_unless_too_long(self) -> None:
        self.chip(0, "power_meter", power1_average=80_000_000, power1_input=90_000_000,
                  power1_average_interval=1000)
        self.assertAlmostEqual(self.measure("hwmon", 2).joules, 160)
        self.chip(0, "power_meter", power1_average_interval=60_000)
        self.assertAlmostEqual(self.measure("hwmon", 2).joules, 180)
        self.assertEqual(self.measure("hwmon", 2).scope, "system")

    def test_volts_times_amps_of_an_ina3221(self) -> None:
        self.chip(0, "ina3221", in1_input=5000, curr1_input=800, in1_label="VDD_IN",
                  in2_input=3300, curr2_input=100)
        self.assertAlmostEqual(self.measure("hwmon:ina3221/VDD_IN", 10).joules, 40)
        self.assertAlmostEqual(self.measure("hwmon:ina3221/in2", 10).joules, 3.3)

    def test_specs_that_mean_several_sensors_are_refused(self) -> None:
        self.chip(0, "amdgpu", power1_average=1, power1_label="PPT")
        self.chip(1, "amdgpu", power1_average=1_000_000, power1_label="PPT")
        self.chip(2, "BAT0", power1_input=5)
        self.assertEqual([info.spec for info in list_meters(self.root, clock=self.clock)],
                         ["hwmon:hwmon0/PPT", "hwmon:hwmon1/PPT"])
        for spec in ("hwmon", "hwmon:amdgpu", "hwmon:amdgpu/PPT", "auto"):
            with self.assertRaisesRegex(MeterError, "found 2 .*hwmon0/PPT, hwmon:hwmon1/PPT"):
                open_meter(spec, self.root, clock=self.clock)
        with self.assertRaisesRegex(MeterError, "found no such sensor, expected one of hwmon:hw"):
            open_meter("hwmon:nct6775", self.root, clock=self.clock)
        self.assertAlmostEqual(self.measure("hwmon:hwmon1/PPT", 3).joules, 3)

    def test_a_negative_absurd_or_dead_sensor(self) -> None:
        folder = self.chip(0, "ina219", power1_input=1)
        for value, pattern in ((-3_000_000, "read -3 W, expected 0 to"),
                               (10**12, r"read 1e\+06 W, expected 0 to"),
                               (0, "no possible result")):
            (folder / "power1_input").write_text(str(value))
            self.assert_no_figure(self.measure("hwmon", 2), pattern)

    def test_a_pause_of_sampling_is_no_straight_line(self) -> None:
        self.chip(0, "ina219", power1_input=1_000_000)
        meter = open_meter("hwmon", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(0.95)
        self.clock.stall(4.05)
        self.assert_no_figure(meter.stop(), "could not be sampled for 4.1 s")

    def test_short_runs_are_noted(self) -> None:
        self.chip(0, "ina219", power1_input=1_000_000, update_interval=200)
        self.assertEqual(self.measure("hwmon", 5).notes, [])
        self.assertRegex(self.measure("hwmon", 1).notes[0], "about 0.2 s.* off by 20%")


class Ina231Test(MeterTestCase):
    """Tests of the Odroid XU3's sensors, which are off by default."""

    WATTS = {"40": 3.5, "41": 0.25, "44": 0.75, "45": 0.5}

    def setUp(self) -> None:
        super().setUp()
        self.folders = {}
        for address in self.WATTS:
            folder = f"sys/bus/i2c/drivers/INA231/4-00{address}"
            self.write(f"{folder}/enable", 0)
            self.folders[address] = self.write(f"{folder}/sensor_W", "0.000").parent
        self.clock.world = self.show

    def show(self, now: float) -> None:
        """While the sensors settle, their values are meaningless."""
        for address, folder in self.folders.items():
            is_on = (folder / "enable").read_text().strip() == "1"
            settled = now >= 1002
            watts = (self.WATTS[address] if settled else 50.0) if is_on else 0.0
            (folder / "sensor_W").write_text(f"{watts:.6f}\n")

    def enabled(self) -> list[str]:
        return [(folder / "enable").read_text().strip() for folder in self.folders.values()]

    def test_the_sum_of_the_rails_after_settling(self) -> None:
        meter = open_meter("ina231", self.root, clock=self.clock)
        self.assertEqual(meter.settling(), 2)
        meter.start()
        self.assertEqual(self.enabled(), ["1"] * 4)
        self.assertEqual(self.clock.now, 1002)
        self.clock.advance(10)
        reading = meter.stop()
        self.assertAlmostEqual(reading.joules, 50)
        self.assertAlmostEqual(reading.seconds, 10)
        self.assertEqual((reading.scope, reading.method), ("rail", "sampled"))
        self.assertEqual(self.enabled(), ["0"] * 4)

    def test_one_rail_leaves_the_others_alone(self) -> None:
        meter = open_meter("ina231:gpu", self.root, clock=self.clock)
        meter.start()
        self.assertEqual(self.enabled(), ["0", "0", "1", "0"])
        self.clock.advance(4)
        self.assertAlmostEqual(meter.stop().joules, 3)
        self.assertEqual(open_meter("ina231:big", self.root).name, "ina231:a15")

    def test_sensors_that_were_on_stay_on(self) -> None:
        for folder in self.folders.values():
            (folder / "enable").write_text("1\n")
        self.clock.advance(10)
        meter = open_meter("ina231", self.root, clock=self.clock)
        meter.start()
        self.assertEqual(self.clock.now, 1010)
        self.clock.advance(1)
        self.assertAlmostEqual(meter.stop().joules, 5)
        self.assertEqual(self.enabled(), ["1"] * 4)

    def test_all_are_switched_off_again_when_one_vanishes(self) -> None:
        meter = open_meter("ina231", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(1.95)
        (self.folders["44"] / "sensor_W").unlink()
        self.clock.world = lambda now: None
        self.clock.advance(5)
        self.assert_no_figure(meter.stop(), "INA231 gpu vanished after 2.0 s")
        self.assertEqual(self.enabled(), ["0"] * 4)

    def test_all_are_switched_off_again_when_one_cannot_be_switched_on(self) -> None:
        meter = open_meter("ina231", self.root, clock=self.clock)
        (self.folders["44"] / "enable").unlink()
        (self.folders["44"] / "enable").mkdir()
        meter.start()
        reading = meter.stop()
        self.assert_no_figure(reading, "0044/enable can't be read: Is a directory")
        self.assertEqual((self.folders["40"] / "enable").read_text().strip(), "0")

    def test_a_missing_rail_spoils_the_sum_only(self) -> None:
        shutil.rmtree(self.folders["45"])
        with self.assertRaisesRegex(MeterError, "lacks the rail a7"):
            open_meter("ina231", self.root, clock=self.clock)
        open_meter("ina231:memory", self.root, clock=self.clock)
        with self.assertRaisesRegex(MeterError, "found no such rail, expected one of ina231, "):
            open_meter("ina231:a7", self.root, clock=self.clock)

    def test_without_the_right_to_switch_on(self) -> None:
        with mock.patch("os.access", return_value=False):
            with self.assertRaisesRegex(MeterError, "needs root: .*enable can't be written"):
                open_meter("ina231:gpu", self.root, clock=self.clock)


class PowerSupplyTest(MeterTestCase):
    """Tests of batteries, and of other files in their folder."""

    def supply(self, name: str, kind: str = "Battery", **values: object) -> Path:
        for file, value in {"type": kind, **values}.items():
            self.write(f"sys/class/power_supply/{name}/{file}", value)
        return self.root / "sys/class/power_supply" / name

    def measure(self, spec: str = "power_supply") -> object:
        meter = open_meter(spec, self.root, clock=self.clock)
        meter.start()
        self.clock.advance(100)
        return meter.stop()

    def test_power_or_volts_times_amps(self) -> None:
        folder = self.supply("BAT0", status="Discharging", power_now=8_000_000)
        self.supply("ADP1", "Mains", online=0)
        self.supply("mouse", scope="Device", status="Discharging", power_now=9_000_000)
        reading = self.measure()
        self.assertAlmostEqual(reading.joules, 800)
        self.assertEqual((reading.scope, reading.meter), ("system", "power_supply"))
        (folder / "power_now").unlink()
        self.supply("BAT0", current_now=-500_000, voltage_now=12_000_000)  # negative: discharging
        self.assertAlmostEqual(self.measure("power_supply:BAT0").joules, 600)

    def test_several_are_added_and_each_is_a_rail(self) -> None:
        for name, watts in (("BAT0", 2), ("BAT1", 3)):
            self.supply(name, status="Discharging", scope="System", power_now=watts * 1_000_000)
        self.assertAlmostEqual(self.measure().joules, 500)
        reading = self.measure("power_supply:BAT1")
        self.assertEqual((round(reading.joules), reading.scope), (300, "rail"))
        with self.assertRaisesRegex(MeterError, "no such battery, expected one of power_supply, "):
            open_meter("power_supply:BAT2", self.root)

    def test_a_charger_makes_it_useless(self) -> None:
        folder = self.supply("BAT0", status="Charging", power_now=8_000_000)
        with self.assertRaisesRegex(MeterError, "found 'Charging', expected Discharging: unplug"):
            open_meter("power_supply", self.root)
        (folder / "status").write_text("Discharging\n")
        meter = open_meter("power_supply", self.root, clock=self.clock)
        meter.start()
        self.clock.advance(5)
        (folder / "status").write_text("Charging\n")
        self.clock.advance(5)
        self.assert_no_figure(meter.stop(), "found 'Charging'.*at the end of the run")

    def test_never_chosen_by_itself_and_missing(self) -> None:
        with self.assertRaisesRegex(MeterError, "found no battery in"):
            open_meter("power_supply", self.root)
        self.supply("BAT0", status="Discharging", power_now=8_000_000)
        self.assertEqual([info.spec for info in list_meters(self.root)], ["power_supply"])
        with self.assertRaisesRegex(MeterError, "meter 'auto': found none that is usable"):
            open_meter("auto", self.root)


class NvmlTest(MeterTestCase):
    """Tests with a replacement for the library."""

    def test_the_energy_counter(self) -> None:
        nvml = FalseNvml(("H200", 5000.0, 700.0))
        self.clock.world = lambda now: nvml.gpus.__setitem__(
            0, ("H200", 5000 + 120 * (now - 1000), 700.0))
        meter = open_meter("nvml", self.root, clock=self.clock, nvml=nvml)
        self.assertEqual((meter.scope, meter.detail), ("GPU", "NVML H200"))
        self.assertEqual(nvml.inits, 0)
        meter.start()
        self.assertEqual(nvml.inits, 1)
        self.clock.advance(10)
        reading = meter.stop()
        self.assertEqual(nvml.inits, 0)
        self.assertAlmostEqual(reading.joules, 1200)
        self.assertEqual(reading.method, "counter")

    def test_power_where_there_is_no_counter(self) -> None:
        nvml = FalseNvml(("Old", None, 60.0))
        meter = open_meter("nvml:0", self.root, clock=self.clock, nvml=nvml)
        meter.start()
        self.clock.advance(10)
        reading = meter.stop()
        self.assertAlmostEqual(reading.joules, 600)
        self.assertEqual((reading.method, reading.samples), ("sampled", 102))
        self.assertIn("averages over about 1 s", reading.notes[0])

    def test_several_gpus_are_added_unless_one_is_named(self) -> None:
        nvml = FalseNvml(("Old", None, 60.0), ("Older", None, 30.0))
        for spec, joules in (("nvml", 180), ("nvml:1", 60)):
            meter = open_meter(spec, self.root, clock=self.clock, nvml=nvml)
            meter.start()
            self.clock.advance(2)
            self.assertAlmostEqual(meter.stop().joules, joules)
        with self.assertRaisesRegex(MeterError, "no such GPU, expected one of nvml, nvml:0, nv"):
            open_meter("nvml:2", self.root, clock=self.clock, nvml=nvml)

    def test_a_gpu_that_is_lost(self) -> None:
        nvml = FalseNvml(("Old", None, 60.0))
        meter = open_meter("nvml", self.root, clock=self.clock, nvml=nvml)
        meter.start()
        self.clock.advance(1)
        nvml.lost = True
        self.clock.advance(1)
        self.assert_no_figure(meter.stop(), "NVML GPU 0 vanished after 1.1 s")
        self.assertEqual(nvml.inits, 0)

    def test_troubles(self) -> None:
        with self.assertRaisesRegex(MeterError, "libnvidia-ml.so.1 can't be loaded"):
            open_meter("nvml", self.root)
        nvml = FalseNvml()
        with self.assertRaisesRegex(MeterError, "knows of no GPU"):
            open_meter("nvml", self.root, nvml=nvml)
        nvml.gpus.append(("Bare", None, None))
        with self.assertRaisesRegex(MeterError, "GPU 0: call: not supported"):
            open_meter("nvml", self.root, nvml=nvml)
        nvml.init_code = 9
        self.assertEqual([info.state for info in list_meters(self.root, nvml=nvml)],
                         ["nvmlInit_v2: driver not loaded (NVML error 9)"])

    @unittest.skipUnless(shutil.which("cc"), "needs a C compiler, as cc, for a library to load")
    def test_calls_of_a_shared_library(self) -> None:
        source = ROOT / "tests/data/power/false_nvml.c"
        for options, method in (([], "counter"), (["-DWITHOUT_COUNTER"], "sampled")):
            library = self.root / f"lib{method}.so"
            subprocess.run(["cc", "-shared", "-fPIC", *options, "-o", library, source], check=True)
            nvml = NvmlLibrary(str(library))
            nvml.init()
            if method == "counter":
                self.assertGreater(nvml.energy_mj(0), 2**32)
            nvml.shutdown()
            with self.assertRaisesRegex(NvmlError, "nvmlDeviceGetHandleByIndex_v2: not init"):
                nvml.power_mw(0)
            meter = open_meter("nvml:1", self.root, clock=self.clock, nvml=nvml)
            self.assertEqual(meter.detail, "NVML GPU 1, False GPU 1")
            meter.start()
            self.clock.advance(1)
            reading = meter.stop()
            self.assertEqual(reading.method, method)
            # The counter increases by 50 J with each reading.
            self.assertAlmostEqual(reading.joules, 100 if method == "counter" else 71.5)


if __name__ == "__main__":
    unittest.main()
