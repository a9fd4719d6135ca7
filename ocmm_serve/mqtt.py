"""``ocmm serve mqtt``: the published facts of a station as JSON to a broker.

Each topic has the latest message alone, retained and with QoS 1. An entry point of `ocmm.commands`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from ocmm_cli.terminal import lead, make_console
from ocmm_core.documents import read_text
from ocmm_core.errors import InputError
from ocmm_core.host import HOST
from ocmm_serve.site import PublishedPlaces, require_package

if TYPE_CHECKING:
    from ocmm_serve.published import PublishedFacts

SCHEMA = "ocmm.published/1"
_PORT, _TLS_PORT = 1883, 8883
_KEEPALIVE_S = 15
_ALIVE, _DEAD = (
    b'{"schema":"ocmm.published/1","alive":true}',
    b'{"schema":"ocmm.published/1","alive":false}',
)


@dataclass(frozen=True, slots=True)
class MqttBroker:
    """A broker, from the options of the command."""

    broker: str
    """HOST or HOST:PORT."""
    topic: str
    """Beginning of all topics."""
    login: Path | None
    """File with user:password."""
    ca: Path | None
    """Certificate (PEM) that the broker's is verified by; None: no TLS."""


def serve_mqtt(*, broker: MqttBroker, places: PublishedPlaces) -> None:
    """Publish state, results, calibrations and corrections of a station as JSON by MQTT.

    Retained messages below --topic: state, result, calibrations, corrections and alive. See
    docs/integrator/opcua.md. Ends by Ctrl-C.
    """
    from ocmm_serve.published import publish_until_end

    require_package("paho", "sensors")
    console, publisher = make_console(soft_wrap=True), MqttPublisher(broker)
    publisher.start()
    try:
        console.print(f"{lead('Broker  ')}{broker.broker}, {broker.topic}/#")
        publish_until_end(
            places, lambda words: console.show(words, style="yellow"), publisher.publish
        )
    finally:
        publisher.close()
    console.show(f"{publisher.sent} messages sent.")


@dataclass(slots=True)
class MqttPublisher:
    """Publish changes; a message that the broker has not got is replaced by the next one."""

    broker: MqttBroker
    sent: int = 0
    _client: Any = None
    _shown: dict[str, bytes] = field(default_factory=dict)

    def start(self) -> None:
        """Connect in the background, again and again; InputError: the login cannot be used."""
        from paho.mqtt.client import Client
        from paho.mqtt.enums import CallbackAPIVersion

        broker = self.broker
        host, _, port = broker.broker.partition(":")
        self._client = client = Client(CallbackAPIVersion.VERSION2)
        if broker.login is not None:
            client.username_pw_set(*_login(broker.login))
        if broker.ca is not None:
            client.tls_set(str(broker.ca))
        client.will_set(f"{broker.topic}/alive", _DEAD, qos=1, retain=True)
        # The broker may have lost the retained messages.
        client.on_connect = lambda *_: self._shown.clear()
        try:
            standard = _PORT if broker.ca is None else _TLS_PORT
            client.connect_async(host, int(port or standard), _KEEPALIVE_S)
        except ValueError as error:
            raise InputError(
                "mqtt.broker", f"{broker.broker} is no broker ({error}).", "Write HOST:PORT."
            ) from error
        client.loop_start()

    def publish(self, facts: PublishedFacts) -> None:
        """Publish the topics that have changed; nothing waits while the broker is away."""
        if self._client.is_connected():
            for topic, content in messages(facts).items():
                if self._shown.get(topic) != content:
                    self._shown[topic] = content
                    self._client.publish(f"{self.broker.topic}/{topic}", content, 1, retain=True)
                    self.sent += 1

    def close(self) -> None:
        """Publish the end, and disconnect."""
        if self._client.is_connected():
            last = self._client.publish(f"{self.broker.topic}/alive", _DEAD, 1, retain=True)
            last.wait_for_publish(_KEEPALIVE_S)
        self._client.disconnect()
        self._client.loop_stop()


def _login(path: Path) -> tuple[str, str]:
    """Return user and password; InputError if the file has none, or others can read it."""
    user, _, password = read_text(path).strip().partition(":")
    if not user or not password or HOST.is_open_to(path.stat(), 0o077):
        raise InputError(
            "mqtt.login",
            f"{path}: this is not user:password, or other users of this computer can read it.",
            f"Correct the file, and type chmod 600 {path}.",
        )
    return user, password


def messages(facts: PublishedFacts) -> Mapping[str, bytes]:
    """Return the messages by topic; that of the last result is ``ocmm.report/1``."""
    found = {"alive": _ALIVE}
    for name in ("state", "calibrations", "corrections"):
        found[name] = msgspec.json.encode({"schema": SCHEMA, name: getattr(facts, name)})
    if facts.results:
        found["result"] = facts.results[-1].json
    return found
