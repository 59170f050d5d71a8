# SPDX-License-Identifier: GPL-2.0-or-later
"""Stand-ins for the packages `launch` and `launch_ros`, which PyPI does not have, to run launch files without them.

They keep the rules that decide which command line and which parameters a launch file makes. Values of arguments are
texts. A parameter whose type is not given is read as YAML, and must be a number, a text, a truth value or a list that is
not empty. Parameters reach the node by a file, its name and namespace by remappings.
"""

from __future__ import annotations

import sys
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, Callable, Iterator, Mapping, Sequence
from unittest import mock

import yaml


@dataclass
class LaunchContext:
    """The values of arguments."""

    launch_configurations: dict[str, str] = field(default_factory=dict)


@dataclass
class LaunchConfiguration:
    """The value of an argument."""

    name: str

    def perform(self, context: LaunchContext) -> str:
        return context.launch_configurations[self.name]


@dataclass
class DeclareLaunchArgument:
    """An argument; without a default, it must be given."""

    name: str
    default_value: str | None = None
    description: str = ""

    def execute(self, context: LaunchContext) -> list[Any]:
        assert self.default_value is None or isinstance(self.default_value, str), self.name
        if self.name not in context.launch_configurations:
            if self.default_value is None:
                raise RuntimeError(f"found no value of the argument {self.name}")
            context.launch_configurations[self.name] = self.default_value
        return []


@dataclass
class OpaqueFunction:
    """Calls a function, which returns more actions, when the values of arguments are known."""

    function: Callable[[LaunchContext], Sequence[Any] | None]

    def execute(self, context: LaunchContext) -> list[Any]:
        return list(self.function(context) or [])


@dataclass
class IfCondition:
    """True if the argument is true or 1."""

    value: LaunchConfiguration

    def evaluate(self, context: LaunchContext) -> bool:
        text = self.value.perform(context).strip().lower()
        assert text in ("true", "false", "1", "0"), text
        return text in ("true", "1")


@dataclass
class ParameterValue:
    """The value of a parameter with a type."""

    value: Any
    value_type: type

    def evaluate(self, context: LaunchContext) -> Any:
        text = text_of(self.value, context)
        if self.value_type is not bool:
            return self.value_type(text)
        value = yaml.safe_load(text)
        if not isinstance(value, bool):
            raise ValueError(f"found {text!r}, expected true or false")
        return value


def text_of(value: Any, context: LaunchContext) -> str:
    return value.perform(context) if isinstance(value, LaunchConfiguration) else str(value)


def value_of(value: Any, context: LaunchContext) -> Any:
    """The value of a parameter."""
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if not isinstance(value, LaunchConfiguration):
        return value
    read = yaml.safe_load(value.perform(context))
    if isinstance(read, list):
        if not read or any(type(each) is not type(read[0]) for each in read):
            raise TypeError("Expected a non-empty sequence, with items of uniform type.")
    elif not isinstance(read, (bool, int, float, str)):
        raise TypeError(f"found {read!r}")
    return read


@dataclass
class LaunchDescription:
    """The actions of a launch file."""

    entities: list[Any]


class Node:
    """A node of a package."""

    def __init__(self, *, package: str, executable: str, name: str | None = None, namespace: Any = "", output: str = "log",
                 arguments: Sequence[Any] = (), parameters: Sequence[Any] = (),
                 remappings: Sequence[tuple[Any, Any]] = (), condition: IfCondition | None = None) -> None:
        self.package, self.executable, self.condition = package, executable, condition
        self._name, self._namespace = name, namespace
        self._arguments, self._parameters, self._remappings = arguments, parameters, remappings
        self.output = output

    def command(self, context: LaunchContext, folder: Path) -> list[str]:
        """The words behind the name of the executable."""
        words = [text_of(word, context) for word in self._arguments] + ["--ros-args"]
        if self._name:
            words += ["-r", f"__node:={self._name}"]
        namespace = text_of(self._namespace, context)
        if namespace:
            words += ["-r", f"__ns:=/{namespace.strip('/')}"]
        for number, parameters in enumerate(self._parameters):
            words += ["--params-file", self._file(parameters, context, folder / f"{self.executable}{number}.yaml")]
        for old, new in self._remappings:
            words += ["-r", f"{text_of(old, context)}:={text_of(new, context)}"]
        return words

    @staticmethod
    def _file(parameters: Any, context: LaunchContext, file: Path) -> str:
        if not isinstance(parameters, Mapping):
            return text_of(parameters, context)
        values = {name: value_of(value, context) for name, value in parameters.items()}
        file.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}))
        return str(file)


def modules() -> dict[str, ModuleType]:
    """The stand-ins by the names of modules."""
    contents = {
        "launch": {"LaunchContext": LaunchContext, "LaunchDescription": LaunchDescription},
        "launch.actions": {"DeclareLaunchArgument": DeclareLaunchArgument, "OpaqueFunction": OpaqueFunction},
        "launch.conditions": {"IfCondition": IfCondition},
        "launch.substitutions": {"LaunchConfiguration": LaunchConfiguration},
        "launch_ros": {}, "launch_ros.actions": {"Node": Node},
        "launch_ros.parameter_descriptions": {"ParameterValue": ParameterValue}}
    made = {}
    for name, members in contents.items():
        made[name] = ModuleType(name)
        vars(made[name]).update(members)
    return made


@contextmanager
def loaded(file: Path) -> Iterator[dict[str, Any]]:
    """The names that a launch file defines."""
    names: dict[str, Any] = {"__file__": str(file), "__name__": "launch_file"}
    with mock.patch.dict(sys.modules, modules()):
        exec(compile(file.read_text(), file.name, "exec"), names)
        yield names


def commands(file: Path, folder: Path, **arguments: str) -> dict[str, list[str]]:
    """The words behind each executable that a launch file starts, by their names.

    Args:
        file: the launch file.
        folder: a folder for files with parameters.
        arguments: those that are given.
    """
    context, found = LaunchContext(dict(arguments)), {}
    with loaded(file) as names:
        actions = list(names["generate_launch_description"]().entities)
        known = {action.name for action in actions if isinstance(action, DeclareLaunchArgument)}
        assert set(arguments) <= known, set(arguments) - known
        while actions:
            action = actions.pop(0)
            if isinstance(action, Node):
                if action.condition is None or action.condition.evaluate(context):
                    found[action.executable] = action.command(context, folder)
            else:
                actions = action.execute(context) + actions
    return found
