"""Addresses of brokers, and their passwords."""

from __future__ import annotations

from pathlib import Path

import pytest

from firstfix.core.errors import InputError
from firstfix.vda5050.broker import PASSWORD, PASSWORD_FILE, Broker, read_broker


@pytest.fixture(autouse=True)
def no_password(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(PASSWORD, raising=False)
    monkeypatch.delenv(PASSWORD_FILE, raising=False)


@pytest.mark.parametrize(
    ("url", "broker"),
    [
        ("mqtt://a.example", Broker("a.example", 1883)),
        ("mqtt://a.example:99/", Broker("a.example", 99)),
        ("mqtts://a.example", Broker("a.example", 8883, tls=True)),
        ("mqtt://me%40home@[::1]:1884", Broker("::1", 1884, "me@home")),
    ],
)
def test_addresses(url: str, broker: Broker):
    assert read_broker(url) == broker
    assert read_broker(f"{broker}") == Broker(broker.host, broker.port, tls=broker.tls)


BAD = [
    *("", "a.example", "http://a.example", "mqtt://", "mqtt://a:0", "mqtt://a:70000", "mqtt://a:x"),
    *("mqtt://a/topic", "mqtt://a?x=1", "mqtt://[::1", "mqtt://a#x", "tcp://a"),
]


@pytest.mark.parametrize("url", BAD)
def test_addresses_that_are_none(url: str):
    with pytest.raises(InputError, match="mqtt://"):
        read_broker(url)


def test_a_password_in_the_url_is_refused_and_not_shown():
    with pytest.raises(InputError, match=PASSWORD) as refused:
        read_broker("mqtt://me:secret@a.example")
    assert "secret" not in f"{refused.value}"
    with pytest.raises(InputError) as refused:
        read_broker("http://me:secret@a.example")
    assert "secret" not in f"{refused.value}"


def test_a_password_of_the_environment(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(PASSWORD, "secret")
    broker = read_broker("mqtt://me@a.example")
    assert broker.password == "secret"  # noqa: S105
    assert "secret" not in f"{broker!r} {broker}"
    with pytest.raises(InputError, match="USER"):
        read_broker("mqtt://a.example")


def test_a_password_of_a_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    file = tmp_path / "password"
    monkeypatch.setenv(PASSWORD_FILE, str(file))
    for content, read in [(b"secret\n", "secret"), (b"  a b ", "  a b "), ("é".encode(), "é")]:
        file.write_bytes(content)
        assert read_broker("mqtt://me@a.example").password == read


@pytest.mark.parametrize(
    "content", [b"\xff\xfe", b"x" * 70_000, b"\n"], ids=["bytes", "huge", "empty"]
)
def test_files_that_have_no_password(
    content: bytes, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    file = tmp_path / "password"
    file.write_bytes(content)
    monkeypatch.setenv(PASSWORD_FILE, str(file))
    with pytest.raises(InputError, match="password"):
        read_broker("mqtt://me@a.example")
    monkeypatch.setenv(PASSWORD_FILE, str(tmp_path / "none"))
    with pytest.raises(InputError, match="No such file"):
        read_broker("mqtt://me@a.example")
