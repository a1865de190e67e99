"""PythonFMU adapter: a block as an FMI 2.0 co-simulation slave. What it answers stands in ``component``.

PythonFMU knows two answers only: fmi2OK, and for an exception fmi2Fatal, which is therefore its word for every refusal.
Nothing but a refusal leaves a slave. What a host with logging off must know is printed to stderr, once.

This module loads without NumPy and CasADi: a host's interpreter that lacks them is told so by fmi2Instantiate. The
wrapper survives an exception there, but not in the import of an FMU's script.
"""

from __future__ import annotations

import importlib
import sys
import weakref
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar, NoReturn
from xml.etree.ElementTree import Element

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from . import saved_state
from .runtime import go_on_with, refusal, rejoin_installed
from .wrapper import Log, hold, let_go_at_the_end


class Refused(Exception):
    """Leaves the slave where a call is refused; the wrapper logs its ``repr``, as a C format."""

    def __repr__(self) -> str:
        return str(self).replace("%", "%%")


class BlockSlave(Fmi2Slave):
    """Base of every slave: a subclass says ``where`` its block is declared, as in imufmu.estimators.lee2012:BLOCK."""

    where: ClassVar[str]
    _living: ClassVar[weakref.WeakSet[BlockSlave]]

    def __init_subclass__(cls) -> None:
        hold(vars(sys.modules[cls.__module__]))
        cls._living = weakref.WeakSet()

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        logger = kwargs.get("logger", 0)
        self._log = Log(logger, self.instance_name)
        self._explained = False
        self.modelName = _model_name(type(self))
        try:
            if logger:  # else it is the builder, which takes its own path off again
                _forget(kwargs["resources"])
            self._start(Path(kwargs["resources"]))
        except Exception as error:  # whatever is missing in this interpreter or wrong in edited sources
            reason = str(error) if isinstance(error, Refused) else f"{self.modelName}: {_described(error)}"
            self._explain(reason)
            raise Refused(reason) from error
        finally:
            let_go_at_the_end(logger)  # last, when CasADi is loaded: Python has to go before it
        self._living.add(self)

    def _start(self, resources: Path) -> None:
        rejoin_installed()
        reason = refusal(resources)
        if reason:
            raise Refused(f"{self.modelName}: {reason}")
        go_on_with(resources / "imufmu")
        try:
            module, name = self.where.split(":")
            self.block = getattr(importlib.import_module(module), name)
            from .component import Component, Refusal
        except ImportError as error:
            needs = "it needs NumPy and CasADi in the Python interpreter of this host"
            raise Refused(f"{self.modelName}: {error}; {needs} ({sys.prefix})") from error
        self._component = Component(self.block, self._warn)
        self._refusal = Refusal

    def to_xml(self, model_options: Any = None) -> Element:
        from .model_description import model_description  # needed where FMUs are built, not where they run

        return model_description(self.block)

    # Messages

    def log(self, msg: str, status: Fmi2Status = Fmi2Status.ok, category: Any = None, debug: Any = None) -> None:
        """Log a message. PythonFMU hands it on as a C format, where a percent sign would be read as a directive."""
        own = category or f"logStatus{status.name.capitalize()}"
        super().log(msg.replace("%", "%%"), status, self._log.category(own))

    def _warn(self, message: str) -> None:
        self.log(message, Fmi2Status.warning)

    def _explain(self, message: str) -> None:
        """Print the first message that a host with logging off will not get."""
        if not self._log.is_on and not self._explained and sys.stderr:
            self._explained = True
            print(message, file=sys.stderr, flush=True)

    # Every call of the host

    def _answer(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except BaseException as error:  # Ctrl-C too: no other exception may leave the slave
            is_refusal = isinstance(error, self._refusal)
            self._refuse(str(error) if is_refusal else f"{self.block.name}: {_described(error)}")

    def _refuse(self, message: str) -> NoReturn:
        self._component.failed()
        self.log(message, Fmi2Status.error)
        self._explain(message)
        hold(self, type(self), self.log_queue)
        raise Refused(message)

    def setup_experiment(self, start_time: float, stop_time: Any = None, tolerance: Any = None) -> None:
        self._answer(self._component.setup_experiment, start_time)

    def enter_initialization_mode(self) -> None:
        self._answer(self._component.enter_initialization_mode)

    def exit_initialization_mode(self) -> None:
        self._answer(self._component.exit_initialization_mode)

    def do_step(self, current_time: float, step_size: float) -> bool:
        self._answer(self._component.do_step, current_time, step_size)
        return True

    def terminate(self) -> None:
        self._answer(self._component.terminate)

    def get_real(self, vrs: Sequence[int]) -> Any:
        return self._answer(self._component.get, "Real", vrs)

    def get_integer(self, vrs: Sequence[int]) -> list[int]:
        return [int(value) for value in self._answer(self._component.get, "Integer", vrs)]

    def get_boolean(self, vrs: Sequence[int]) -> list[bool]:
        return [bool(value) for value in self._answer(self._component.get, "Boolean", vrs)]

    def get_string(self, vrs: Sequence[int]) -> Any:
        return self._answer(self._component.strings, "fmi2GetString", vrs)

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        self._answer(self._component.set, "Real", vrs, values)

    def set_integer(self, vrs: Sequence[int], values: Sequence[int]) -> None:
        self._answer(self._component.set, "Integer", vrs, values)

    def set_boolean(self, vrs: Sequence[int], values: Sequence[bool]) -> None:
        self._answer(self._component.set, "Boolean", vrs, values)

    def set_string(self, vrs: Sequence[int], values: Sequence[str]) -> None:
        self._answer(self._component.strings, "fmi2SetString", vrs)

    def _get_fmu_state(self) -> Any:
        return self._answer(self._component.get_state)

    def _set_fmu_state(self, state: Any) -> None:
        self._answer(self._component.set_state, state)

    _fmu_state_to_bytes = staticmethod(saved_state.to_bytes)

    @classmethod
    def _fmu_state_from_bytes(cls, state: bytes) -> Any:
        """The wrapper asks the class, and gives back references of an instance that it does not name."""
        try:
            return saved_state.from_bytes(state)
        except BaseException as error:
            hold(cls)
            for living in cls._living:
                hold(living, living.log_queue)
            is_known = isinstance(error, saved_state.DamagedState)
            raise Refused(f"{_model_name(cls)}: {error if is_known else _described(error)}") from error


def _model_name(cls: type) -> str:
    """Name of the FMU, which that of its script holds."""
    return cls.__module__.removesuffix("_fmu")


def _forget(resources: str) -> None:
    """Take the FMU's folder off the path again. The wrapper adds it at every start; what is in it is loaded by now."""
    sys.path[:] = [entry for entry in sys.path if entry != resources]


def _described(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"
