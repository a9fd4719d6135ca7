"""Facts of a station by MQTT, through a real mosquitto."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from ocmm_core.export.report import read_report
from tests.core.inspection.conftest import Bench
from tests.host import HANG_S, needs_package, not_run
from tests.serve.published_jobs import measure, published
from tests.waiting import wait_until

LOGIN = "station:secret"


@contextmanager
def mosquitto(folder: Path, port: int) -> Iterator[None]:
    """Run a broker with a login."""
    program = shutil.which("mosquitto", path=f"{os.environ['PATH']}:/usr/sbin")
    if program is None:
        not_run("'mosquitto' is not installed")
    passwords = folder / "passwords"
    # The form of `mosquitto_passwd` is made by the program itself, from plain text.
    passwords.write_text(f"{LOGIN}\n", encoding="ascii")
    tool = shutil.which("mosquitto_passwd", path=f"{os.environ['PATH']}:/usr/bin")
    if tool is None:
        not_run("'mosquitto_passwd' is not installed")
    subprocess.run([tool, "-U", passwords], check=True, timeout=HANG_S)
    configuration = folder / "broker.conf"
    configuration.write_text(
        f"listener {port} 127.0.0.1\nallow_anonymous false\npassword_file {passwords}\nuser root\n",
        encoding="ascii",
    )
    broker = subprocess.Popen(
        [program, "-c", configuration], stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    try:
        wait_until(lambda: _answers(port))
        yield
    finally:
        broker.terminate()
        broker.communicate(timeout=HANG_S)


def _answers(port: int) -> bool:
    with socket.socket() as client:
        return client.connect_ex(("127.0.0.1", port)) == 0


class Listener:
    """A client of the broker; `messages`: the last one of each topic."""

    def __init__(self, port: int) -> None:
        from paho.mqtt.client import Client
        from paho.mqtt.enums import CallbackAPIVersion

        self.messages: dict[str, bytes] = {}
        self.client = Client(CallbackAPIVersion.VERSION2)
        self.client.username_pw_set(*LOGIN.split(":"))
        self.client.on_connect = lambda client, *_: client.subscribe("hall/#", 1)
        self.client.on_message = lambda _client, _data, message: self.messages.update(
            {message.topic: bytes(message.payload)}
        )
        self.client.connect("127.0.0.1", port)
        self.client.loop_start()

    def close(self) -> None:
        self.client.disconnect()
        self.client.loop_stop()

    def value(self, topic: str) -> Any:
        return json.loads(self.messages.get(f"hall/{topic}", b"null"))


def serve(folder: Path, port: int, login: Path, *more: str) -> subprocess.Popen[str]:
    """Start ocmm serve mqtt."""
    return subprocess.Popen(
        [sys.executable, "-m", "ocmm_cli", "serve", "mqtt", "--broker", f"127.0.0.1:{port}",
         "--topic", "hall", "--login", login, "--out", folder, *more],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


@pytest.fixture
def port() -> int:
    """Return a free port."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        return int(free.getsockname()[1])


def test_a_broker_gets_the_report_to_the_last_digit_and_again_after_its_restart(
    bench: Bench, tmp_path: Path, port: int
) -> None:
    needs_package("paho", "extra `sensors`")
    jobs, login = tmp_path / "jobs", tmp_path / "login"
    login.write_text(f"{LOGIN}\n", encoding="ascii")
    login.chmod(0o600)
    path = measure(bench, jobs, "unproven", unproven="Measured as uncalibrated.", simulated=True)
    whole: Any = published(path)
    with mosquitto(tmp_path, port):
        server, listener = serve(jobs, port, login), Listener(port)
        try:
            wait_until(lambda: listener.value("result") is not None)
            assert listener.value("result") == json.loads(json.dumps(whole))
            report = read_report(listener.messages["hall/result"])
            assert report.part_verdict is not None
            assert "NOT PROVEN" in report.part_verdict.word
            assert report.simulated
            assert "SIMULATED" in report.state
            assert listener.value("state")["state"]["part"] is None
            assert listener.value("state")["schema"] == "ocmm.published/1"
            wait_until(lambda: len(listener.value("calibrations")["calibrations"]) == 2)
            assert listener.value("alive")["alive"] is True
        finally:
            listener.close()
    # Nothing was kept by the broker.
    with mosquitto(tmp_path, port):
        listener = Listener(port)
        try:
            wait_until(lambda: listener.value("result") is not None)
            assert listener.value("result") == json.loads(json.dumps(whole))
            server.send_signal(signal.SIGKILL)
            server.communicate(timeout=HANG_S)
            wait_until(lambda: listener.value("alive")["alive"] is False)
            again = serve(jobs, port, login)
            wait_until(lambda: listener.value("alive")["alive"] is True)
            again.send_signal(signal.SIGTERM)
            output = again.communicate(timeout=HANG_S)[0]
            assert again.returncode == 0, output
            assert "messages sent" in output
            wait_until(lambda: listener.value("alive")["alive"] is False)
        finally:
            listener.close()


@pytest.mark.parametrize(("text", "mode"), [("no colon\n", 0o600), (f"{LOGIN}\n", 0o644)])
def test_refuses_a_login_that_is_none_or_is_open_to_others(
    tmp_path: Path, text: str, mode: int
) -> None:
    needs_package("paho", "extra `sensors`")
    login = tmp_path / "login"
    login.write_text(text, encoding="ascii")
    login.chmod(mode)
    server = serve(tmp_path, 1, login)
    output = server.communicate(timeout=HANG_S)[0]
    assert server.returncode == 2
    assert "this is not user:password" in output
