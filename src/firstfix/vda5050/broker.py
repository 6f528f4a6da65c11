"""Address of a broker and how to log in."""

from __future__ import annotations

import os
import ssl
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote, urlsplit

from firstfix.core.errors import InputError

PASSWORD = "FIRSTFIX_MQTT_PASSWORD"  # noqa: S105 - name of a variable
PASSWORD_FILE = "FIRSTFIX_MQTT_PASSWORD_FILE"  # noqa: S105 - name of a variable
_PORTS = {"mqtt": 1883, "mqtts": 8883}
_LONGEST_PASSWORD = 65535  # bytes, of MQTT


@dataclass(frozen=True, slots=True)
class Broker:
    """Where the broker is, and how to log in.

    Parameters
    ----------
    host : str
        Name or address.
    port : int
        TCP port.
    user : str or None
        None: anonymous.
    password : str or None
        Never shown.
    tls : bool
        Encrypt, and verify the certificate of the broker.
    """

    host: str
    port: int
    user: str | None = None
    password: str | None = field(default=None, repr=False)
    tls: bool = False

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'mqtts' if self.tls else 'mqtt'}://{host}:{self.port}"

    def tls_context(self) -> ssl.SSLContext | None:
        """Return the trusted authorities: of the system, or of `SSL_CERT_FILE`."""
        return ssl.create_default_context() if self.tls else None


def read_broker(url: str) -> Broker:
    """Return the broker of a URL; the password comes from the environment.

    Parameters
    ----------
    url : str
        ``mqtt://user@host:1883``, or ``mqtts://`` with TLS.

    Raises
    ------
    InputError
        If the URL or the password cannot be used.

    Examples
    --------
    >>> print(read_broker("mqtts://robot@broker.example"))
    mqtts://broker.example:8883
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        raise _not_an_address("that cannot be read") from None
    if parts.scheme not in _PORTS or not parts.hostname or port == 0:
        raise _not_an_address(f"{parts.scheme or 'no'} scheme, host {parts.hostname}")
    if parts.password is not None:
        raise InputError(
            "The password must not be in the URL: other users of this machine can read it there. "
            f"Put it into the environment variable {PASSWORD}, or the name of its file into "
            f"{PASSWORD_FILE}."
        )
    if parts.path.strip("/") or parts.query or parts.fragment:
        raise _not_an_address("more after the port")
    user = unquote(parts.username) if parts.username else None
    password = _password()
    if password is not None and user is None:
        raise InputError(
            expected="a user for the password, as in mqtt://USER@HOST",
            received="none",
            remedy=f"add it, or unset {PASSWORD} and {PASSWORD_FILE}",
        )
    secure = parts.scheme == "mqtts"
    return Broker(parts.hostname, port or _PORTS[parts.scheme], user, password, secure)


def _not_an_address(received: str) -> InputError:
    """Return the error; the URL itself may contain a password."""
    return InputError(
        expected="the URL of a broker: mqtt://[USER@]HOST[:PORT], or mqtts:// with TLS",
        received=f"a URL with {received}",
        remedy="correct --vda5050",
    )


def _password() -> str | None:
    name = os.environ.get(PASSWORD_FILE)
    if name is None:
        return os.environ.get(PASSWORD)
    received = ""
    try:
        with Path(name).open("rb") as file:
            content = file.read(_LONGEST_PASSWORD + 1)
        password = content.decode().rstrip("\r\n")
        if not password or len(content) > _LONGEST_PASSWORD:
            received = f"{len(content)} bytes"
    except OSError as error:
        password, received = "", f"{error.strerror}"
    except UnicodeError:
        password, received = "", "not UTF-8 text"
    if received:
        raise InputError(
            expected=f"a file with a password in {PASSWORD_FILE}",
            received=f"{name}: {received}",
            remedy="correct the variable or the file",
        )
    return password
