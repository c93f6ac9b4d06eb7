"""The conversation: reads messages, calls the driver, writes its answers.

Standard output belongs to the protocol. So at the beginning its descriptor is moved away and descriptor 1 becomes a copy
of 2: whatever your code or a native library prints goes to standard error, from C++ too.
"""

import io
import json
import os
import socket
import sys
import threading
import time
import traceback
from typing import IO, Any, Callable, Dict, Iterable, Optional, Union

from . import messages
from .driver import Driver
from .messages import PROTOCOL, Event, Init, Map, ProtocolError, Reset, Step

#: Longest text of an `error`, in characters.
_ERROR_LENGTH_MAX = 2000


def serve(driver: Callable[[], Driver]) -> None:
    """Serves a driver (a class, or a function that makes one) until the simulator closes the conversation.

    Then it ends the process: with status 0 after `close` or the end of the input, 1 if the driver raised or answered what
    the protocol does not allow, 2 if the simulator sent what this package does not understand. In both of the
    latter cases the simulator gets an `error`, and the traceback is on standard error.
    """
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    sys.stdout.flush()
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    # The simulator may be gone before the last words are said.
    try:
        status = converse(driver, sys.stdin.buffer, out)
    except BrokenPipeError:
        status = 0
    sys.stderr.flush()
    # Not `sys.exit`: threads and destructors of native libraries must not keep or crash a process that is done.
    os._exit(status)


class Listener:
    """Serves drivers over TCP on this machine alone, each connection in a thread of its own."""

    def __init__(self, driver: Callable[[], Driver]) -> None:
        self._driver = driver
        self._socket = socket.create_server(("127.0.0.1", 0))
        self._is_closed = False
        #: As `--ads` and `ads_cmd` take it: `tcp:127.0.0.1:PORT`.
        self.address = f"tcp:127.0.0.1:{self._socket.getsockname()[1]}"
        threading.Thread(target=self._accept, name="avastra.listen", daemon=True).start()

    def close(self) -> None:
        """Takes no further connection; those that there are go on."""
        self._is_closed = True
        # Closing alone does not wake a thread that waits for a connection.
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self._socket.close()

    def __enter__(self) -> "Listener":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                if self._is_closed:
                    return
                time.sleep(0.01)
                continue
            threading.Thread(target=self._converse, args=(connection,), daemon=True).start()

    def _converse(self, connection: socket.socket) -> None:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with connection, connection.makefile("rb") as lines, connection.makefile("wb", buffering=0) as out:
            try:
                converse(self._driver, lines, out)
            except OSError:  # the simulator is gone
                pass


def listen(driver: Callable[[], Driver]) -> Listener:
    """Serves a driver (a class, or a function that makes one) in this process, for episodes that this process plays:

        with avastra.listen(Cruise) as listener:
            episodes = avastra.Episodes(space, "crossroad", ads_cmd=listener.address)

    Several episodes may be driven at once, so drivers must not share what they change.
    """
    return Listener(driver)


def converse(driver: Callable[[], Driver], lines: Iterable[bytes], out: Union[IO[bytes], io.RawIOBase]) -> int:
    """The conversation itself, over any two streams; returns the exit status that `serve` ends with."""
    def say(message: Dict[str, Any]) -> None:
        out.write(json.dumps(message, separators=(",", ":"), allow_nan=False).encode() + b"\n")

    try:
        conversation = Conversation(driver())
        for line in lines:
            if not line.strip():
                continue
            message = _parse(line)
            if message["type"] == "close":
                break
            reply = conversation.reply(message)
            if reply is not None:
                say(reply)
        conversation.driver.close()
    except BrokenPipeError:
        raise
    except Exception as error:  # whatever a driver raises is told, and ends the conversation
        traceback.print_exc()
        text = str(error) if isinstance(error, ProtocolError) else f"{type(error).__name__}: {error}"
        say({"type": "error", "message": text[:_ERROR_LENGTH_MAX]})
        return 2 if isinstance(error, _NotUnderstood) else 1
    return 0


class Conversation:
    """One driver in conversation: what it is asked, and what it answers."""

    def __init__(self, driver: Driver):
        if not isinstance(driver, Driver):
            raise TypeError(f"`serve` needs a class derived from avastra.Driver, and got {driver!r}")
        self.driver = driver
        self.initialised = False

    def reply(self, message: Dict[str, Any]) -> Optional[Dict[str, Any]]:
        """The answer to a message, or None where none is due."""
        kind = message["type"]
        if kind == "init":
            return self._ready(_understood(Init, message))
        if not self.initialised:
            raise _NotUnderstood(f"the first message is `{kind}`, and must be `init`")
        if kind == "step":
            step = _understood(Step, message)
            return self._checked(messages.answer(self.driver.step(step), step.seq), step)
        if kind == "map":
            self.driver.map(_understood(Map, message))
            return {"type": "ready"}
        if kind == "reset":
            self.driver.reset(_understood(Reset, message))
            return {"type": "ready"}
        if kind == "event":
            self.driver.event(_understood(Event, message))
            return None
        raise _NotUnderstood(f"`{kind}` is no message of {PROTOCOL}")

    def _ready(self, init: Init) -> Dict[str, Any]:
        driver = self.driver
        if init.protocol != PROTOCOL:
            raise _NotUnderstood(f"the simulator speaks {init.protocol}, this package {PROTOCOL}")
        if init.answer not in (None, driver.answer):
            raise ProtocolError(f"asked for answers of kind `{init.answer}`, and gives only `{driver.answer}`")
        driver.init(init)
        self.initialised = True
        ready = {
            "type": "ready",
            "protocol": PROTOCOL,
            "name": driver.name or type(driver).__name__,
            "version": driver.version,
            "answer": driver.answer,
            "deterministic": driver.deterministic,
        }
        return {**ready, "wants": list(driver.wants)} if driver.wants else ready

    def _checked(self, answer: Dict[str, Any], step: Step) -> Dict[str, Any]:
        """The answer, if it is of the announced kind and a trajectory covers its time."""
        announced = self.driver.answer
        if answer["type"] != announced:
            raise ProtocolError(f"`step` returned a {answer['type']}, but `answer` of the class announces `{announced}`")
        if announced == "trajectory":
            times = [point["t_us"] for point in answer["points"]]
            if any(after <= before for before, after in zip(times, times[1:])):
                raise ProtocolError("the times `t_us` of `trajectory.points` must rise from point to point")
            slowest = min(point["v"] for point in answer["points"])
            if slowest < 0.0:
                raise ProtocolError(f"a speed `v` of the trajectory is {slowest}; the vehicle does not drive backwards")
            if times[0] > step.t_us or times[-1] < step.t_us + 1_000_000:
                raise ProtocolError(f"the trajectory goes from {times[0]} to {times[-1]} µs; it must begin at the time of the "
                                    f"step, {step.t_us}, or before, and reach at least 1 s beyond it")
        return answer


class _NotUnderstood(ProtocolError):
    """The simulator sent what this package does not understand."""


def _parse(line: bytes) -> Dict[str, Any]:
    try:
        message = json.loads(line)
    except ValueError as error:
        raise _NotUnderstood(f"a line is no JSON: {error}") from None
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise _NotUnderstood("a line is no object with a `type`")
    return message


def _understood(cls: Any, message: Dict[str, Any]) -> Any:
    try:
        return messages.read(cls, message, message["type"])
    except ProtocolError as error:
        raise _NotUnderstood(str(error)) from None
