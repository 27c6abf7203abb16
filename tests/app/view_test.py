#!/usr/bin/python3
"""hybmss view: who is let in, what is streamed, what pulling does, and that no message harms it. No time is judged.

    view_test.py PROGRAM
"""

import base64
import hashlib
import json
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import unittest

PROGRAM = ""
SCENE = """
[body]
cells = [4, 4, 4]
cell_size = 0.01
[material]
young_modulus = 1e4
poisson_ratio = 0.45
density = 1000
[gravity]
acceleration = [0, -9.81, 0]
[[fix]]
where = "y-max"
[[obstacle]]
name = "floor"
plane = {point = [0, -0.001, 0], normal = [0, 1, 0]}
[solver]
time_step = 1e-4
duration = 0.05
[output]
every = 0.01
"""
TWO = """
[[body]]
name = "low"
cells = [2, 2, 2]
cell_size = 0.01
[[body]]
name = "high"
cells = [3, 2, 2]
cell_size = 0.01
place = {translate = [0, 0.03, 0]}
[material]
young_modulus = 1e4
poisson_ratio = 0.3
density = 1000
[gravity]
acceleration = [0, -9.81, 0]
[[contact]]
between = ["low", "high"]
[[fix]]
body = "low"
where = "y-min"
[solver]
time_step = 1e-4
duration = 0.02
[output]
every = 0.005
"""
STATIC = """
[body]
cells = [4, 4, 4]
cell_size = 0.01
[material]
young_modulus = 1e4
poisson_ratio = 0.3
density = 1000
[[fix]]
where = "y-min"
[[move]]
where = "y-max"
translate = [0, -0.004, 0]
[solver]
method = "static"
"""


class Program:
    """hybmss view of something, while the block lasts."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([PROGRAM, "view", "--no-open", *arguments], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        self.match = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/([0-9a-f]{32})/\n", line)
        assert self.match, (line, self.process.stderr.read())
        self.port, self.token = int(self.match[1]), self.match[2]
        self.host = f"127.0.0.1:{self.port}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()

    def end(self, by=signal.SIGINT):
        if self.process.returncode is None:
            self.process.send_signal(by)
            self.output, self.errors = self.process.communicate(timeout=60)
        return self.process.returncode

    def ask(self, text):
        """What comes of a request, up to where the program ends the connection."""
        with socket.create_connection(("127.0.0.1", self.port), 20) as connection:
            try:
                connection.sendall(text if isinstance(text, bytes) else text.encode())
                answer = b""
                while more := connection.recv(65536):
                    answer += more
            except ConnectionError:
                return b""
        return answer

    def stream_status(self, *arguments, **named):
        with Stream(self, *arguments, **named) as stream:
            return stream.answer

    def status(self, path, host=None, method="GET", more=""):
        host = self.host if host is None else host
        answer = self.ask(f"{method} {path} HTTP/1.1\r\nHost: {host}\r\n{more}\r\n")
        return int(answer.split()[1]) if answer else 0


class Stream:
    """A websocket of RFC 6455, by itself."""

    def __init__(self, program, more="", path=None, host=None):
        self.socket = socket.create_connection(("127.0.0.1", program.port), 60)
        key = base64.b64encode(os.urandom(16)).decode()
        path = f"/{program.token}/stream" if path is None else path
        self.socket.sendall((f"GET {path} HTTP/1.1\r\nHost: {host or program.host}\r\nUpgrade: websocket\r\n"
                             f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n{more}\r\n").encode())
        self.data = b""
        while b"\r\n\r\n" not in self.data:
            part = self.socket.recv(65536)
            if not part:
                break
            self.data += part
        head, _, self.data = self.data.partition(b"\r\n\r\n")
        self.answer = int(head.split()[1])
        if self.answer == 101:
            accept = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest())
            assert b"Sec-WebSocket-Accept: " + accept in head
            self.surfaces = self.frame = self.status = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def raw(self, data):
        self.socket.sendall(data)

    def send(self, text, opcode=1):
        data = text if isinstance(text, bytes) else text.encode()
        mask = os.urandom(4)
        length = bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + struct.pack(">H", len(data))
        self.raw(bytes([0x80 | opcode]) + length + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(data)))

    def take(self, count):
        while len(self.data) < count:
            part = self.socket.recv(1 << 16)
            if not part:
                raise EOFError
            self.data += part
        taken, self.data = self.data[:count], self.data[count:]
        return taken

    def receive(self):
        """The kind of the next message, which is kept; "closed" at the end."""
        try:
            first, length = self.take(2)
            if length == 126:
                length = struct.unpack(">H", self.take(2))[0]
            elif length == 127:
                length = struct.unpack(">Q", self.take(8))[0]
            data = self.take(length)
        except (EOFError, ConnectionError):
            return "closed"
        opcode = first & 15
        assert first & 0x80 or opcode < 3, "the stream is of whole messages"
        if opcode == 8:
            self.code = struct.unpack(">H", data[:2])[0]
            return "closed"
        if opcode == 1:
            self.status = json.loads(data)
            return "status"
        if opcode != 2:
            return "other"
        kind, count = struct.unpack("<II", data[:8])
        if kind == 1:
            self.surfaces = struct.unpack(f"<{3 * count}I", data[8:])
            return "surfaces"
        assert kind == 2
        self.time, self.steps, self.rate = struct.unpack("<ddd", data[8:32])
        self.obstacles = data[32:32 + 64 * count]
        self.frame = data[32 + 64 * count:]
        return "frame"

    def until(self, kind, condition=lambda: True):
        for _ in range(100000):
            got = self.receive()
            if got == kind and condition():
                return self
            assert got != "closed", f"closed before a {kind}"
        raise AssertionError(f"no {kind}")

    def points(self):
        numbers = struct.unpack(f"<{len(self.frame) // 4}f", self.frame)
        return [numbers[i:i + 3] for i in range(0, len(numbers), 3)]


def vtu(path):
    """Points as bytes of single precision, and the cells' corners in VTK's order."""
    data = path.read_bytes()
    header, _, appended = data.partition(b'<AppendedData encoding="raw">\n_')

    def array(name):
        offset = int(re.search(rb'Name="%s"[^>]*offset="(\d+)"' % name, header)[1])
        size = struct.unpack("<Q", appended[offset:offset + 8])[0]
        return appended[offset + 8:offset + 8 + size]

    points = struct.unpack(f"<{len(array(b'Points')) // 8}d", array(b"Points"))
    cells = struct.unpack(f"<{len(array(b'connectivity')) // 4}i", array(b"connectivity"))
    return [struct.pack("<3f", *points[i:i + 3]) for i in range(0, len(points), 3)], cells


def surface_points(points, cells):
    """Those of faces that one cell alone has: on a full box, corners that fewer than eight cells share."""
    return b"".join(p for n, p in enumerate(points) if 0 < cells.count(n) < 8)


class View(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        for name, text in (("one", SCENE), ("two", TWO), ("static", STATIC)):
            (cls.folder / f"{name}.toml").write_text(text)
            subprocess.run([PROGRAM, "run", "--quiet", cls.folder / f"{name}.toml", "--out", cls.folder / name], check=True,
                           capture_output=True)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def view(self, name, *more):
        return Program(str(self.folder / name), *more)

    # -- Who is let in

    def test_the_token_is_wanted_and_nothing_else_is_there(self):
        with self.view("one.toml", "--paused") as program:
            root = f"/{program.token}/"
            self.assertEqual(program.status(root), 200)
            self.assertEqual(program.status(root, f"localhost:{program.port}"), 200)
            other = ("0" if program.token[0] != "0" else "1") + program.token[1:]
            for path in ("/", "/stream", f"/{program.token}", f"/{other}/", f"/{other}/stream", f"/{program.token[:31]}/",
                         root + "x", root + "../", root + "one.toml", root + "../../etc/passwd", root + "%2e%2e/etc/passwd",
                         root + "..%2f..%2fetc/passwd", "/../../etc/passwd", str(self.folder / "one.toml"), root + "?x=1",
                         "*", f"http://{program.host}{root}"):
                self.assertEqual(program.status(path), 404, path)
            self.assertEqual(program.status(root, method="POST"), 405)
            self.assertEqual(program.status(root, method="DELETE"), 405)
            self.assertEqual(program.status(root + "stream"), 426)

    def test_other_hosts_and_origins_are_refused(self):
        with self.view("one.toml", "--paused") as program:
            root = f"/{program.token}/"
            for host in ("example.com", f"example.com:{program.port}", "127.0.0.1", f"127.0.0.1:{program.port + 1}", "",
                         f"127.0.0.1:{program.port}.example.com", f"[::1]:{program.port}"):
                self.assertEqual(program.status(root, host), 403, host)
                if host:
                    self.assertEqual(program.stream_status(host=host), 403, host)
            self.assertEqual(program.status(root, more=f"Host: {program.host}\r\n"), 403)
            for origin in ("http://example.com", "null", f"https://{program.host}", f"http://{program.host}.example.com",
                           "http://localhost", f"http://example.com:{program.port}", "file://"):
                self.assertEqual(program.status(root, more=f"Origin: {origin}\r\n"), 403, origin)
                self.assertEqual(program.stream_status(f"Origin: {origin}\r\n"), 403, origin)
            self.assertEqual(program.stream_status(f"Origin: http://{program.host}\r\n"), 101)
            self.assertEqual(program.stream_status(path="/stream"), 404)
            # No other of this machine's addresses is listened on.
            with self.assertRaises(OSError):
                socket.create_connection(("127.0.0.2", program.port), 5)

    def test_the_page_lets_in_no_script_but_its_own(self):
        with self.view("one.toml", "--paused") as program:
            request = f"GET /{program.token}/ HTTP/1.1\r\nHost: {program.host}\r\n\r\n"
            pages = [program.ask(request).decode() for _ in range(2)]
            nonces = [re.search(r"script-src 'nonce-(\w{32})'", page)[1] for page in pages]
            self.assertNotEqual(*nonces)
            for page, nonce in zip(pages, nonces):
                head, _, body = page.partition("\r\n\r\n")
                self.assertIn("default-src 'none'", head)
                self.assertIn("no-store", head)
                self.assertEqual(re.findall(r'<(?:script|style) nonce="(\w+)">', body), [nonce, nonce])
                self.assertNotIn("@NONCE@", body)
                self.assertIsNone(re.search(r"https?://", body))

    def test_requests_that_are_none_end_the_connection_alone(self):
        drawn = random.Random(5)
        with self.view("one.toml", "--paused") as program:
            root = f"/{program.token}/"
            good = f"GET {root} HTTP/1.1\r\nHost: {program.host}\r\n\r\n".encode()
            program.ask(b"GET / HTTP/1.1\r\nHost: " + b"x" * 100000 + b"\r\n\r\n")
            program.ask(good[:-2] + b"Content-Length: 1000000\r\n\r\n" + b"x" * 1000)
            for _ in range(500):
                text = bytearray(good)
                for _ in range(drawn.randrange(1, 20)):
                    text[drawn.randrange(len(text))] = drawn.randrange(256)
                program.ask(bytes(text) + b"\r\n\r\n\r\n")
            self.assertEqual(program.status(root), 200)

    # -- What is streamed

    def test_live_frames_are_those_of_the_run(self):
        with self.view("one.toml", "--paused") as program, Stream(program) as stream:
            stream.until("frame")
            self.assertTrue(stream.status["live"] and stream.status["pulls"] and not stream.status["running"])
            for frame in range(6):
                points, cells = vtu(self.folder / f"one/body_{frame:04}.vtu")
                self.assertEqual(stream.frame, surface_points(points, cells), frame)
                self.assertEqual(stream.steps, 100 * frame)
                self.assertAlmostEqual(stream.time, 0.01 * frame)
                stream.send("step 100")
                stream.until("frame")
            self.assertNotEqual(stream.frame, surface_points(*vtu(self.folder / "one/body_0000.vtu")))
            self.assertEqual(len(stream.surfaces), 3 * 2 * 6 * 16)
            self.assertEqual(len(stream.obstacles), 64)
            stream.send("restart")
            stream.until("frame")
            self.assertEqual(stream.frame, surface_points(*vtu(self.folder / "one/body_0000.vtu")))

    def test_surfaces_enclose_the_body(self):
        with self.view("one.toml", "--paused") as program, Stream(program) as stream:
            points = stream.until("frame").points()
            volume = 0
            for t in range(0, len(stream.surfaces), 3):
                a, b, c = (points[n] for n in stream.surfaces[t:t + 3])
                volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
                           + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6
            self.assertAlmostEqual(volume / 0.04 ** 3, 1, 5)

    def test_several_bodies(self):
        with self.view("two.toml", "--paused") as program, Stream(program) as stream:
            stream.until("frame")
            stream.send("step 200")
            stream.until("frame")
            bodies = [vtu(self.folder / f"two/{name}/body_0004.vtu") for name in ("low", "high")]
            self.assertEqual(stream.frame, b"".join(surface_points(*body) for body in bodies))

    def test_a_static_scene_goes_to_its_equilibrium(self):
        with self.view("static.toml") as program, Stream(program) as stream:
            stream.until("frame", lambda: stream.time == 1)
            self.assertEqual(stream.frame, surface_points(*vtu(self.folder / "static/body_0001.vtu")))
            self.assertFalse(stream.status["pulls"])

    def test_a_scene_runs_by_itself_and_pauses(self):
        with self.view("one.toml") as program, Stream(program) as stream:
            stream.until("frame", lambda: stream.steps > 300)
            self.assertGreater(stream.rate, 0)
            stream.send("pause")
            stream.until("status", lambda: not stream.status["running"])
            stream.send("step 1")
            stream.until("frame")
            stopped = stream.steps
            stream.send("step 1")
            stream.until("frame")
            self.assertEqual(stream.steps, stopped + 1)

    def test_a_finished_run_is_replayed(self):
        for name, bodies in (("one", [""]), ("two", ["low", "high"])):
            with self.view(name, "--paused") as program, Stream(program) as stream:
                stream.until("frame")
                self.assertFalse(stream.status["live"])
                for frame in range(stream.status["frames"]):
                    stream.send(f"show {frame}")
                    stream.until("frame")
                    shown = [vtu(self.folder / name / body / f"body_{frame:04}.vtu") for body in bodies]
                    self.assertEqual(stream.frame, b"".join(surface_points(*body) for body in shown))
                stream.send("run")
                stream.until("status", lambda: not stream.status["running"] and stream.status["frame"] > 0)
                self.assertEqual(stream.status["frame"], stream.status["frames"] - 1)

    def test_what_is_no_run_is_refused_in_one_line(self):
        bad = self.folder / "bad"
        shutil.copytree(self.folder / "one", bad)
        cases = [(self.folder / "two/nothing", None, "nothing"), (self.folder, None, "neither body.pvd"),
                 (bad, b'<VTKFile type="Collection"><DataSet timestep="0" part="0" file="../one.toml"/>', "elsewhere"),
                 (bad, b'<VTKFile type="Collection"><DataSet timestep="0" part="0" file="/etc/passwd"/>', "elsewhere"),
                 (bad, b'<VTKFile type="Collection"><DataSet timestep="0" part="0" file="probes.csv"/>', "no .vtu"),
                 (bad, b"nothing", "no .pvd")]
        for path, text, expected in cases:
            if text is not None:
                (bad / "body.pvd").write_bytes(text)
            done = subprocess.run([PROGRAM, "view", "--no-open", path], capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(expected, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1)

    # -- What pulling does

    def test_pulling_moves_a_node_and_letting_go_ends_it(self):
        with self.view("one.toml", "--paused") as program, Stream(program) as stream:
            before = stream.until("frame").points()
            low = min(range(len(before)), key=lambda n: (before[n][1], before[n][0], before[n][2]))
            stream.send("step 200")  # it hangs and swings by then
            stream.until("frame")
            target = [before[low][0] - 0.02, before[low][1], before[low][2]]
            stream.send("pull %d %r %r %r" % (low, *target))
            stream.send("step 500")
            after = stream.until("frame").points()
            self.assertLess(after[low][0], before[low][0] - 0.01)
            stream.send("release")
            stream.send("step 3000")
            self.assertGreater(stream.until("frame").points()[low][0], after[low][0] + 0.005)
            # One who leaves lets go.
            stream.send("pull %d %r %r %r" % (low, *target))
            with Stream(program) as other:
                other.until("frame")
                other.send("pull %d %r %r %r" % (low, *target))
                other.send("step 500")
                pulled = other.until("frame", lambda: other.steps == 4200).points()[low][0]
            stream.send("step 3000")
            self.assertGreater(stream.until("frame", lambda: stream.steps == 7200).points()[low][0], pulled + 0.005)

    # -- What no message does

    def test_what_is_no_message_ends_the_connection_and_nothing_else(self):
        drawn = random.Random(7)
        good = ["run", "pause", "restart", "step 1", "speed 1", "show 0", "pull 1 0 0 0", "release"]
        bad = ["", " ", "run ", " run", "RUN", "run 1", "step", "step 0", "step -1", "step 1e3", "step 1000001", "step 1 1",
               "step 99999999999999999999", "speed 0", "speed nan", "speed inf", "speed -1", "speed 1e4", "speed", "pull",
               "pull 1 0 0", "pull 1 0 0 0 0", "pull 1 nan 0 0", "pull 1 1e7 0 0", "pull -1 0 0 0", "pull 1  0 0 0",
               "pull 4294967296 0 0 0", "show -1", "pause\n", "pause\0", "x" * 300, "{}", "é"]
        with self.view("one.toml", "--paused") as program:
            for text in bad:
                with Stream(program) as stream:
                    stream.send(text)
                    while (got := stream.receive()) != "closed":
                        self.assertIn(got, ("status", "surfaces", "frame"))
            with Stream(program) as stream:
                stream.send("run", opcode=2)  # right words, but not as text
                while stream.receive() != "closed":
                    pass
                self.assertEqual(stream.code, 1008)
            for words in good:
                with Stream(program) as stream:
                    stream.send(words)
                    stream.send("step 1")
                    stream.until("frame", lambda: stream.steps >= 1)
            sent = 0
            while sent < 3000:  # changed messages, as long as they let us
                with Stream(program) as stream:
                    stream.socket.settimeout(60)
                    try:
                        for _ in range(50):
                            text = bytearray(drawn.choice(good).encode())
                            for _ in range(drawn.randrange(3)):
                                at = drawn.randrange(len(text) + 1)
                                text[at:at + drawn.randrange(2)] = bytes([drawn.choice(b" 0123456789.-enaf\x00\xff\x80")])
                            stream.send(bytes(text))
                            sent += 1
                    except ConnectionError:
                        pass
            for _ in range(500):  # bytes that are no websocket's
                with Stream(program) as stream:
                    stream.raw(drawn.randbytes(drawn.randrange(1, 60)))
            # Points that there are none of do nothing.
            with Stream(program) as stream:
                stream.send("restart")
                stream.send("pause")
                stream.send("pull 4000000000 0 0 0")
                stream.send("show 1")
                stream.send("step 7")
                stream.until("frame", lambda: stream.steps == 7)
            self.assertEqual(program.end(), 0, program.errors)
            self.assertEqual(program.errors, "")

    def test_many_connections_are_not_too_many(self):
        with self.view("one.toml", "--paused") as program:
            idle = [socket.create_connection(("127.0.0.1", program.port), 20) for _ in range(100)]
            for connection in idle:
                connection.close()
            with Stream(program) as stream:
                stream.until("frame")

    def test_interrupt_ends_it_with_viewers_and_without(self):
        for by in (signal.SIGINT, signal.SIGTERM):
            with self.view("one.toml") as program:
                self.assertEqual(program.end(by), 0)
                self.assertEqual(program.errors, "")
            with self.view("one.toml") as program, Stream(program) as stream:
                stream.until("frame")
                self.assertEqual(program.end(by), 0)
                while stream.receive() != "closed":
                    pass
        with self.view("one.toml") as program:
            taken = subprocess.run([PROGRAM, "view", "--no-open", "--port", str(program.port), self.folder / "one.toml"],
                                   capture_output=True, text=True, timeout=60)
            self.assertEqual((taken.returncode, taken.stderr.count("\n")), (1, 1))
            self.assertIn(f"port {program.port}", taken.stderr)

    def test_a_scene_that_fails_says_so_and_can_begin_anew(self):
        (self.folder / "wild.toml").write_text(SCENE.replace("[0, -9.81, 0]", "[1e6, 0, 0]"))
        with self.view("wild.toml", "--paused") as program, Stream(program) as stream:
            begin = stream.until("frame").frame
            for _ in range(50):
                stream.send("step 100")
            stream.until("status", lambda: stream.status["note"])
            self.assertIn("diverged", stream.status["note"])
            stream.send("restart")
            stream.until("status", lambda: not stream.status["note"])
            self.assertEqual((stream.frame, stream.steps), (begin, 0))
            self.assertEqual(program.end(), 0)
            self.assertEqual(program.errors.count("\n"), 1)


if __name__ == "__main__":
    PROGRAM = sys.argv.pop(1)
    unittest.main()
