# SPDX-License-Identifier: GPL-2.0-or-later
"""All sources of energy figures; finds the meter for a spec."""

from __future__ import annotations

from pathlib import Path

from . import csv_log, fixed, hwmon, ina231, nvml as nvml_source, power_supply, rapl
from .clock import Clock
from .nvml import Nvml, NvmlLibrary
from .reading import SCOPES, Meter, MeterError, MeterInfo
from .sensors import SensorMeter

SPECS = ("auto, none, rapl[:ZONE], hwmon[:CHIP[/LABEL]], ina231[:RAIL], nvml[:INDEX], "
         "power_supply[:BATTERY], csv:FILE, constant:WATTS")


def open_meter(spec: str, root: Path = Path("/"), *, clock: Clock | None = None,
               nvml: Nvml | None = None) -> Meter:
    """The meter that a spec names. Raises MeterError with one line if it cannot be used.

    Sensors are searched below `root`. Tests pass a clock and a replacement for NVML, which is not
    used with another root, because it does not use files.
    """
    clock = clock or Clock()
    kind, colon, argument = spec.partition(":")
    if colon and not argument:
        raise MeterError(f"meter '{spec}': found nothing behind the colon, expected {SPECS}")
    if spec == "none":
        return fixed.NoMeter(clock)
    if spec == "auto":
        return choose_widest(list_sources(root, clock=clock, nvml=nvml))
    if kind == "constant":
        return fixed.choose_constant(argument, clock)
    if kind == "rapl":
        meter: Meter = rapl.choose(argument, root, clock)
    elif kind == "hwmon":
        meter = hwmon.choose(argument, root, clock)
    elif kind == "ina231":
        meter = ina231.choose(argument, root, clock)
    elif kind == "power_supply":
        meter = power_supply.choose(argument, root, clock)
    elif kind == "nvml":
        meter = nvml_source.choose(argument, find_nvml(root, nvml), clock)
    elif kind == "csv" and colon:
        meter = csv_log.choose(argument, clock)
    else:
        raise MeterError(f"meter '{spec}': expected {SPECS}")
    if meter.state() != "usable":
        raise MeterError(f"meter '{spec}': {meter.state()}")
    return meter


def list_meters(root: Path = Path("/"), *, clock: Clock | None = None,
                nvml: Nvml | None = None) -> list[MeterInfo]:
    """Lists the sources of this machine, usable or not."""
    return [MeterInfo(meter.name, meter.detail, meter.scope, meter.state())
            for meter in list_sources(root, clock=clock, nvml=nvml)]


def list_sources(root: Path = Path("/"), *, clock: Clock | None = None,
                 nvml: Nvml | None = None) -> list[SensorMeter]:
    """The meters that list_meters() describes."""
    clock = clock or Clock()
    return (rapl.find(root, clock) + nvml_source.find(find_nvml(root, nvml), clock)
            + ina231.find(root, clock) + hwmon.find(root, clock) + power_supply.find(root, clock))


def find_nvml(root: Path, nvml: Nvml | None) -> Nvml | None:
    """NVML, if this machine has it."""
    if nvml is not None or root != Path("/"):
        return nvml
    try:
        return NvmlLibrary()
    except OSError:
        return None


def choose_widest(meters: list[SensorMeter]) -> SensorMeter:
    """The usable meter with the widest scope."""
    usable = [meter for meter in meters if meter.automatic and meter.state() == "usable"]
    if not usable:
        troubles = "; ".join(dict.fromkeys(
            meter.state() for meter in meters if meter.state() != "usable"))
        raise MeterError("meter 'auto': found none that is usable"
                         + (f" ({troubles})" if troubles else "")
                         + "; 'tools/power list' says what one could do")
    scope = min((meter.scope for meter in usable), key=SCOPES.index)
    widest = [meter for meter in usable if meter.scope == scope]
    # Each other kind of source lists its sum first; channels of hwmon may overlap, so they have no
    # sum.
    if widest[0].name.startswith("hwmon:") and len(widest) > 1:
        raise MeterError(f"meter 'auto': found {len(widest)} of the scope '{scope}', expected a "
                         "choice of " + ", ".join(meter.name for meter in widest))
    return widest[0]
