# SPDX-License-Identifier: Apache-2.0 OR GPL-3.0-or-later
# Part of qjulia, which is under the Apache License 2.0. This add-on may be used under the GNU General
# Public License, version 3 or later, as well, which is what Blender asks of add-ons.
"""Runs 'qjulia explore' as a child process and sends requests to it. Does not use Blender."""

from __future__ import annotations

import html.parser
import http.client
import json
import os
import re
import select
import shutil
import signal
import subprocess
import tempfile
import threading
import urllib.parse
import uuid
from typing import Callable, Mapping

_START_SECONDS = 120  # a device's first start compiles kernels
_ANSWER_SECONDS = 3600

# The shell becomes the program, so that the child process is the program itself. A watcher beside it ends both when
# the standard input closes, even where Blender was killed. It signals its own process group and no process number:
# the number of a program that has crashed may belong to another process by then. It reads a copy of the standard
# input, because shells give background jobs an empty one, and does not hold the output open.
_WATCHED = 'exec 3<&0; { read -r _ <&3; kill 0; } >&- & exec "$@" </dev/null 3<&-'


class ProgramError(Exception):
    """A message for the user: what is wrong, and what to do."""


class LostError(ProgramError):
    """The program has ended, or left a request without an answer."""


class Cancelled(Exception):
    """The request was cancelled."""


class _PageParts(html.parser.HTMLParser):
    """The texts of a page's JSON scripts by their ids."""

    def __init__(self) -> None:
        super().__init__()
        self.parts: dict[str, str] = {}
        self._inside = ""

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self._inside = given.get("id", "") if tag == "script" and given.get("type") == "application/json" else ""

    def handle_endtag(self, tag):
        self._inside = ""

    def handle_data(self, data):
        if self._inside:
            self.parts[self._inside] = self.parts.get(self._inside, "") + data


def found_program(given: str) -> str:
    """The program's path; `given` may be empty, for the one in PATH. @raises ProgramError"""
    found = shutil.which(given or "qjulia")
    if found:
        return found
    if given:
        raise ProgramError(f"'{given}' is not a program that can be run: correct the path in the add-on's preferences")
    raise ProgramError("the program qjulia was not found: install it, or give its path in the add-on's preferences")


class Request:
    """A request that another thread may cancel."""

    def __init__(self) -> None:
        self.is_cancelled = False
        self.share, self.activity = 0.0, ""  # the progress of the program
        self._connection: http.client.HTTPConnection | None = None
        self._lock = threading.Lock()

    def cancel(self) -> None:
        with self._lock:
            self.is_cancelled = True
            if self._connection and self._connection.sock:
                try:
                    self._connection.sock.shutdown(2)
                except OSError:
                    pass

    def hold(self, connection: http.client.HTTPConnection) -> None:
        with self._lock:
            self._connection = connection
        if self.is_cancelled:
            raise Cancelled()


class Server:
    """The program with one map. @raises ProgramError where it does not start or is too old"""

    def __init__(self, program: str, map_file: str, device: str = ""):
        self.map_file = map_file
        path = found_program(program)
        if not os.path.isfile(map_file):
            raise ProgramError(f"'{map_file}' does not exist: choose the map file again")
        words = [path, "explore", map_file, "--quiet", *(["--device", device] if device else [])]
        self._is_lost = False  # whether a request got no answer
        self._errors = tempfile.TemporaryFile()
        try:
            self._process = subprocess.Popen(["/bin/sh", "-c", _WATCHED, "sh", *words], stdin=subprocess.PIPE,
                                             stdout=subprocess.PIPE, stderr=self._errors, start_new_session=True)
        except OSError as error:
            raise ProgramError(f"'{path}' cannot be run: {error.strerror}") from error
        try:
            self._find_address(path)
            self.table = self._read_table(path)
        except BaseException:
            self.stop()
            raise

    def _find_address(self, path: str) -> None:
        assert self._process.stdout
        ready, _, _ = select.select([self._process.stdout], [], [], _START_SECONDS)
        line = self._process.stdout.readline().decode("utf-8", "replace").strip() if ready else ""
        found = re.fullmatch(r"http://([^/]+):(\d+)/\?token=([0-9a-f]+)", line)
        if not found:
            self.stop()
            raise ProgramError(self._why_not_started(path, line))
        self._host, self._port, self._token = found[1], int(found[2]), found[3]

    def _why_not_started(self, path: str, line: str) -> str:
        self._errors.seek(0)
        said = self._errors.read().decode("utf-8", "replace").strip()
        first = said.splitlines()[0] if said else line
        if re.search(r"explore.*(unknown|not expected|unexpected)|(unknown|not expected|unexpected).*explore", said):
            return f"'{path}' is too old: it has no command 'explore'; update qjulia"
        if first:
            return first
        return f"'{path}' ended without a word: it may be another program; see the add-on's preferences"

    def _read_table(self, path: str) -> str:
        status, page = self._get(f"/?token={self._token}", Request())
        parser = _PageParts()
        parser.feed(page.decode("utf-8", "replace"))
        try:
            return json.dumps({name: json.loads(parser.parts[name]) for name in ("settings", "palettes")})
        except (KeyError, ValueError) as error:
            raise ProgramError(f"'{path}' is too old, or newer than this add-on: its page holds no table of knobs "
                               f"(status {status}); install the add-on that comes with your qjulia") from error

    def _get(self, path: str, request: Request) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection(self._host, self._port, timeout=_ANSWER_SECONDS)
        headers = {"X-Qjulia-Token": self._token, "X-Qjulia-Client": uuid.uuid4().hex}
        try:
            connection.connect()
            request.hold(connection)
            connection.request("GET", path, headers=headers)
            answer = connection.getresponse()
            data = bytearray()
            while part := answer.read1(1 << 20):
                data += part
                while data[:1] == b"~" and b"\n" in data:  # progress
                    line = data[1:data.index(b"\n")]
                    del data[:len(line) + 2]
                    share, _, request.activity = line.decode("utf-8", "replace").partition(" ")
                    request.share = float(share)
            return answer.status, bytes(data)
        except (OSError, http.client.HTTPException, ValueError) as error:
            if request.is_cancelled:
                raise Cancelled() from error
            self._is_lost = not isinstance(error, ValueError)
            kind = LostError if self._is_lost else ProgramError
            raise kind(f"qjulia does not answer any more ({error}); turn a knob, or press 'Start again' in the "
                       "panel") from error
        finally:
            connection.close()

    def mesh(self, query: Mapping[str, str], cells: int, request: Request | None = None) -> bytes:
        """A .ply file of the map with its knobs turned. @raises ProgramError, Cancelled"""
        text = urllib.parse.urlencode({**query, "make": "ply", "resolution": cells})
        request = request or Request()
        status, data = self._get(f"/make?{text}", request)
        if request.is_cancelled:
            raise Cancelled()
        if status == 200 and data[:1] == b"=":
            return data[1:]
        if status == 200 and data[:1] == b"!":
            raise ProgramError(data[1:].decode("utf-8", "replace"))
        if status == 200:
            raise Cancelled()
        raise ProgramError(data.decode("utf-8", "replace").strip() or f"qjulia answers {status}")

    def is_running(self) -> bool:
        """False where the program has ended, and where it has left a request without an answer."""
        return not self._is_lost and self._process.poll() is None

    def stop(self) -> None:
        """Ends the program. May be called more than once."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.close()
        try:
            self._process.wait(5)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)  # the program, and its watcher
            self._process.wait()
        self._process.stdout.close()


class Servers:
    """One server for each map, started by the first request."""

    def __init__(self, how: Callable[[], tuple[str, str]]):
        self._how = how  # the program and the device, from the preferences
        self._lock = threading.Lock()  # for what follows, and never held while a program starts or ends
        self._all: dict[tuple[str, str, str], Server] = {}
        self._starting: dict[tuple[str, str, str], threading.Lock] = {}  # held by the thread that starts a server
        self._generation = 0  # how often `stop` was called

    def choice(self, map_file: str) -> tuple[str, str, str]:
        """The settings to start a server with. To be called in Blender's main thread."""
        program, device = self._how()
        return program, map_file, device

    def of(self, choice: tuple[str, str, str]) -> Server:
        """The server of a map. May be called in any thread.

        @raises ProgramError; Cancelled where `stop` was called meanwhile
        """
        with self._lock:
            generation = self._generation
            starting = self._starting.setdefault(choice, threading.Lock())
        with starting:
            with self._lock:
                if generation != self._generation:
                    raise Cancelled()
                old = self._all.get(choice)
                if old and old.is_running():
                    return old
                self._all.pop(choice, None)
            if old:
                old.stop()
            server = Server(*choice)
            with self._lock:
                if generation == self._generation:
                    self._all[choice] = server
                    return server
            server.stop()
            raise Cancelled()

    def mesh(self, choice: tuple[str, str, str], query: Mapping[str, str], cells: int, request: Request) -> bytes:
        """`Server.mesh` of a map. May be called in any thread.

        A program that is lost is started again once: it may have been killed since the last request, and the system
        may accept connections for it until its last thread has ended.

        @raises ProgramError, Cancelled
        """
        try:
            return self.of(choice).mesh(query, cells, request)
        except LostError:
            return self.of(choice).mesh(query, cells, request)

    def stop(self) -> None:
        """Ends all servers. One that is starting in another thread ends there as soon as it has started."""
        with self._lock:
            self._generation += 1
            ended = list(self._all.values())
            self._all.clear()
            self._starting.clear()  # who asks from now on does not wait for those threads
        for server in ended:
            server.stop()
