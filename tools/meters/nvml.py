# SPDX-License-Identifier: GPL-2.0-or-later
"""NVIDIA GPUs, through the management library (NVML) of the driver."""

from __future__ import annotations

import ctypes
import errno
from typing import Protocol

from .clock import Clock
from .reading import MeterError, explain
from .sensors import Sensor, SensorMeter, counter, power

LIBRARY = "libnvidia-ml.so.1"
MILLI = 1e-3
MOST_WATTS = 5000.0  # of one GPU
COUNTER_UPDATE_SECONDS = 0.1
POWER_AVERAGE_SECONDS = 1.0
NAME_LENGTH = 96

SUCCESS, NOT_SUPPORTED, FUNCTION_NOT_FOUND = 0, 3, 13
LOST = (15, 16)  # the GPU has fallen off the bus or needs a reset
ERRORS = {
    1: "not initialised", 2: "invalid argument", 3: "not supported", 4: "no permission",
    6: "not found", 8: "external power cables are not connected", 9: "driver not loaded",
    10: "the driver did not answer in time", 13: "function not found", 15: "the GPU is lost",
    16: "the GPU needs a reset", 18: "the driver and the library differ in version",
    999: "unknown error",
}


class NvmlError(OSError):
    """A failed call. It is an OSError so that a lost GPU counts as a vanished sensor."""

    def __init__(self, call: str, code: int) -> None:
        what = ERRORS.get(code, "error")
        super().__init__(errno.ENODEV if code in LOST else errno.EIO,
                         f"{call}: {what} (NVML error {code})")
        self.code = code

    def __str__(self) -> str:
        return str(self.strerror)


class Nvml(Protocol):
    """The required functions of NVML. Each raises NvmlError; all but init() require an init()
    before."""

    def init(self) -> None:
        """May be called repeatedly; each call requires one of shutdown()."""

    def shutdown(self) -> None:
        """Ends one init()."""

    def count(self) -> int:
        """Number of GPUs."""

    def gpu_name(self, index: int) -> str:
        """Name of a GPU, such as "NVIDIA H200"."""

    def energy_mj(self, index: int) -> int:
        """Millijoules since the driver was loaded."""

    def power_mw(self, index: int) -> int:
        """Milliwatts; on most GPUs, the mean of the last second."""


class NvmlLibrary:
    """Implements Nvml with the driver's library or any shared library with the same seven
    functions."""

    def __init__(self, path: str = LIBRARY) -> None:
        """Raises OSError if the library cannot be loaded."""
        self._library = ctypes.CDLL(path)

    def _call(self, function: str, *arguments: object) -> None:
        try:
            code = getattr(self._library, function)(*arguments)
        except AttributeError:
            code = FUNCTION_NOT_FOUND  # missing in old drivers
        if code != SUCCESS:
            raise NvmlError(function, code)

    def _handle(self, index: int) -> ctypes.c_void_p:
        handle = ctypes.c_void_p()
        self._call("nvmlDeviceGetHandleByIndex_v2", ctypes.c_uint(index), ctypes.byref(handle))
        return handle

    def init(self) -> None:
        """May be called repeatedly; each call requires one of shutdown()."""
        self._call("nvmlInit_v2")

    def shutdown(self) -> None:
        """Ends one init()."""
        self._call("nvmlShutdown")

    def count(self) -> int:
        """Number of GPUs."""
        count = ctypes.c_uint()
        self._call("nvmlDeviceGetCount_v2", ctypes.byref(count))
        return count.value

    def gpu_name(self, index: int) -> str:
        """Name of a GPU, such as "NVIDIA H200"."""
        name = ctypes.create_string_buffer(NAME_LENGTH)
        self._call("nvmlDeviceGetName", self._handle(index), name, ctypes.c_uint(NAME_LENGTH))
        return name.value.decode(errors="replace")

    def energy_mj(self, index: int) -> int:
        """Millijoules since the driver was loaded."""
        energy = ctypes.c_ulonglong()
        self._call("nvmlDeviceGetTotalEnergyConsumption", self._handle(index),
                   ctypes.byref(energy))
        return energy.value

    def power_mw(self, index: int) -> int:
        """Milliwatts; on most GPUs, the mean of the last second."""
        milliwatts = ctypes.c_uint()
        self._call("nvmlDeviceGetPowerUsage", self._handle(index), ctypes.byref(milliwatts))
        return milliwatts.value


class NvmlAccess:
    """Keeps NVML initialised during a run, so that the driver keeps the GPU's counters."""

    def __init__(self, nvml: Nvml) -> None:
        self._nvml = nvml
        self._is_open = False

    def open(self) -> None:
        """Initialises NVML."""
        self._nvml.init()
        self._is_open = True

    def close(self) -> None:
        """Shuts NVML down."""
        if self._is_open:
            self._is_open = False
            self._nvml.shutdown()

    def settling(self) -> float:
        """Seconds that open() takes: none."""
        return 0.0


def find(nvml: Nvml | None, clock: Clock) -> list[SensorMeter]:
    """A meter for the sum of the GPUs, and one per GPU; none without library or GPU."""
    if nvml is None:
        return []
    try:
        nvml.init()
    except NvmlError as error:
        return [SensorMeter("nvml", "GPU", "NVML", clock, [], trouble=explain(error))]
    try:
        return find_initialised(nvml, clock)
    except NvmlError as error:
        return [SensorMeter("nvml", "GPU", "NVML", clock, [], trouble=explain(error))]
    finally:
        nvml.shutdown()


def find_initialised(nvml: Nvml, clock: Clock) -> list[SensorMeter]:
    """Implements find() once NVML is initialised."""
    names: list[str] = []
    sensors: list[Sensor | None] = []
    troubles: list[str | None] = []
    for index in range(nvml.count()):
        names.append(nvml.gpu_name(index))
        sensor, trouble = None, None
        try:
            sensor = find_sensor(nvml, index)
        except NvmlError as error:
            trouble = f"GPU {index}: {explain(error)}"
        sensors.append(sensor)
        troubles.append(trouble)

    def make(spec: str, detail: str, indices: list[int]) -> SensorMeter:
        chosen = [sensor for i in indices if (sensor := sensors[i]) is not None]
        trouble = next((trouble for i in indices if (trouble := troubles[i]) is not None), None)
        return SensorMeter(spec, "GPU", detail, clock, chosen, access=NvmlAccess(nvml),
                           trouble=trouble)

    if not names:
        return []
    each = [make(f"nvml:{index}", f"NVML GPU {index}, {name}", [index])
            for index, name in enumerate(names)]
    what = names[0] if len(names) == 1 else f"{len(names)} GPUs: " + ", ".join(names)
    return [make("nvml", f"NVML {what}", list(range(len(names))))] + each


def find_sensor(nvml: Nvml, index: int) -> Sensor:
    """The energy counter of a GPU, or its power if it has none (before Volta)."""
    try:
        nvml.energy_mj(index)
        return counter(f"NVML GPU {index}", lambda: nvml.energy_mj(index), scale=MILLI,
                       most_watts=MOST_WATTS, update_seconds=COUNTER_UPDATE_SECONDS)
    except NvmlError as error:
        if error.code not in (NOT_SUPPORTED, FUNCTION_NOT_FOUND):
            raise
    nvml.power_mw(index)
    return power(f"NVML GPU {index}", lambda: nvml.power_mw(index), scale=MILLI,
                 most_watts=MOST_WATTS, update_seconds=POWER_AVERAGE_SECONDS)


def choose(argument: str, nvml: Nvml | None, clock: Clock) -> SensorMeter:
    """The meter for the spec "nvml" or "nvml:INDEX"."""
    spec = f"nvml:{argument}" if argument else "nvml"
    if nvml is None:
        raise MeterError(f"meter '{spec}': {LIBRARY} can't be loaded (it comes with NVIDIA's "
                         "driver)")
    meters = find(nvml, clock)
    if not meters:
        raise MeterError(f"meter '{spec}': NVML knows of no GPU")
    for meter in meters:
        if meter.name == spec:
            return meter
    raise MeterError(f"meter '{spec}': {meters[0].state()}" if len(meters) == 1 else
                     f"meter '{spec}': found no such GPU, expected one of "
                     + ", ".join(meter.name for meter in meters))
