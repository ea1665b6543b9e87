"""`qjulia explore` as a process, and requests to it."""
import http.client
import random
import re
import socket
import subprocess


def connect(host, port, timeout):
    """A connection to the server, also where nothing can look up localhost."""
    try:
        return socket.create_connection((host, port), timeout=timeout)
    except socket.gaierror:
        if host != "localhost":
            raise
        return socket.create_connection(("127.0.0.1", port), timeout=timeout)


class Server:
    """`qjulia explore` of a map or a mesh in a folder."""

    def __init__(self, qjulia, folder, name, *options):
        self.process = subprocess.Popen([qjulia, "explore", name, *map(str, options), "--device", "cpu", "--quiet"], cwd=folder,
                                        stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        found = re.fullmatch(r"http://(.+):(\d+)/\?token=([0-9a-f]{32})", self.address)
        self.host, self.port, self.token = found[1].strip("[]"), int(found[2]), found[3]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    def get(self, path, token=None, method="GET", client="test", body=None, **headers):
        """Status, headers and body of an answer."""
        connection = http.client.HTTPConnection(self.host, self.port, timeout=120)
        connection.sock = connect(self.host, self.port, timeout=120)
        own = {"X-Qjulia-Token": self.token if token is None else token, "X-Qjulia-Client": client}
        own.update({name.replace("_", "-"): value for name, value in headers.items()})
        try:
            connection.request(method, path, body=body, headers=own)
            answer = connection.getresponse()
            data = answer.read()
            while data[:1] == b"~":  # how far it was
                data = data[data.index(b"\n") + 1:]
            return answer.status, answer.headers, data
        finally:
            connection.close()

    def get_or_nothing(self, path):
        try:
            return self.get(path)
        except (OSError, http.client.HTTPException):
            return None

    def status(self, *words, **options):
        return self.get(*words, **options)[0]

    def is_well(self):
        status, _, body = self.get("/frame?size=16x12&samples=1", client=f"well{random.random()}")
        return status == 200 and body[:4] == b"=\x89PN"

    def raw(self, data, reads=True):
        """What the server answers to these bytes; None where it closes the connection."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=20) as connection:
            try:
                connection.sendall(data)
                connection.shutdown(socket.SHUT_WR)
                return connection.recv(1 << 16) if reads else None
            except OSError:
                return None
