"""POST /v1/locate-files: files of a viewer are located, or refused in one sentence."""

from __future__ import annotations

import base64
import http.client
import io
import json
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import httpx
import msgspec
import numpy as np
import pytest
from live_lab import drive, fed
from PIL import Image

from firstfix.core.errors import InputError
from firstfix.core.grid import OccupancyGrid
from firstfix.core.recording import Recording
from firstfix.io.logs.npz import save_recording
from firstfix.io.maps.map_server import save_map
from firstfix.lab.simulation.lidar import Lidar
from firstfix.lab.worlds.catalog import WORLDS, random_free_poses
from firstfix.web.dropped_files import MOST_FILE_BYTES
from firstfix.web.file_worker import MOST_CELLS, locate_files
from firstfix.web.messages import LocatedFiles

HOUSE = WORLDS["house"]()
POSES = random_free_poses(HOUSE, np.random.default_rng(5), 3)
# Longer than the limits of the server: its answer is judged, not the patience of the client.
PATIENCE_S = 240.0
BINARY = {"content-type": "application/octet-stream"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Give a folder with a map and a log of three scans."""
    rng = np.random.default_rng(0)
    scans = tuple(Lidar().scan(HOUSE, pose, rng, float(i)) for i, pose in enumerate(POSES))
    save_map(HOUSE, tmp_path / "house.yaml")
    save_recording(Recording(scans), tmp_path / "drive.npz")
    return tmp_path


@pytest.fixture(scope="module")
def api() -> Iterator[httpx.Client]:
    begun = drive("house")
    begun.step(22)
    with (
        fed(store=begun.store) as site,
        httpx.Client(base_url=site.url, timeout=PATIENCE_S) as client,
    ):
        yield client


def post(api: httpx.Client, *files: Path, index: int = 0) -> httpx.Response:
    contents = [path.read_bytes() for path in files]
    names = [f"{path.name}:{len(data)}" for path, data in zip(files, contents, strict=True)]
    query = {"file": names, "index": index}
    return api.post("/v1/locate-files", params=query, content=b"".join(contents), headers=BINARY)


@pytest.mark.slow
def test_a_map_and_a_log_are_located_and_nothing_is_kept(
    api: httpx.Client, folder: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch
) -> None:
    scratch = tmp_path_factory.mktemp("scratch")
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    answer = post(api, *sorted(folder.iterdir()), index=1)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert found["answer"]["verdict"] == "UNIQUE"
    assert np.hypot(*np.subtract(found["answer"]["pose"][:2], POSES[1].as_array()[:2])) < 0.1
    assert (found["map"]["name"], found["scans"], found["log"]) == ("house", 3, "drive.npz")
    assert len(found["ends"]) == len(found["classes"]) > 100
    assert list(scratch.iterdir()) == []
    assert api.get("/v1/status").json()["state"] == "LOCALIZED"  # of the robot, as before


@pytest.mark.slow
def test_a_log_alone_is_located_in_the_map_of_the_robot(api: httpx.Client, folder: Path) -> None:
    found = post(api, folder / "drive.npz").json()
    assert np.hypot(*np.subtract(found["answer"]["pose"][:2], POSES[0].as_array()[:2])) < 0.1


@pytest.mark.slow
def test_a_file_that_no_reader_knows_is_refused_in_a_sentence(
    api: httpx.Client, folder: Path
) -> None:
    (folder / "drive.npz").write_bytes(b"PK\x03\x04" + bytes(200))
    answer = post(api, *sorted(folder.iterdir()))
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert "drive.npz" in answer.json()["detail"]
    assert "/" not in answer.json()["detail"].replace(".npz", "")  # no path of the server


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ({}, "1 to 3 files"),
        ({"file": ["a.npz:1"] * 4}, "1 to 3 files"),
        ({"file": ["../a.npz:4"]}, "plain name"),
        ({"file": ["/etc/passwd:4"]}, "plain name"),
        ({"file": ["..\\a.npz:4"]}, "plain name"),
        ({"file": [".hidden:4"]}, "plain name"),
        ({"file": [f"{'a' * 200}:4"]}, "plain name"),
        ({"file": ["a\nb.npz:4"]}, "plain name"),
        ({"file": ["a.npz"]}, "plain name"),
        ({"file": ["a.npz:-4"]}, "number of bytes"),
        ({"file": ["a.npz:" + "9" * 99]}, "number of bytes"),
        ({"file": ["a.npz:2", "A.NPZ:2"]}, "same name"),
        ({"file": ["a.npz:5"]}, "do not add up"),
        ({"file": ["a.npz:4"], "index": "-1"}, "index"),
        ({"file": ["a.npz:4"], "index": "9" * 99}, "index"),
    ],
)
def test_a_malformed_request_is_refused(api: httpx.Client, query: dict, words: str) -> None:
    answer = api.post("/v1/locate-files", params=query, content=b"1234", headers=BINARY)
    assert answer.status_code == 422
    assert words in answer.json()["detail"]


def test_too_much_is_refused_before_it_is_read(api: httpx.Client) -> None:
    connection = http.client.HTTPConnection(api.base_url.host, api.base_url.port)
    connection.putrequest("POST", "/v1/locate-files?file=a.npz:4")
    connection.putheader("content-type", BINARY["content-type"])
    connection.putheader("content-length", str(MOST_FILE_BYTES + 1))
    connection.endheaders()
    assert connection.getresponse().status == 413
    connection.close()
    assert api.post("/v1/locate-files", content=b"", headers={}).status_code == 415


def test_a_path_in_the_yaml_means_the_image_beside_it(folder: Path) -> None:
    header = folder / "house.yaml"
    header.write_text(header.read_text().replace("house.pgm", "/home/ann/maps/house.pgm"))
    assert locate_files(folder, 0)["answer"]["verdict"] == "UNIQUE"


def small_file_of_many_pixels(side: int) -> bytes:
    """Return a PNG of a few kilobytes that says it is square and large."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    head = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    rows = zlib.compress(bytes(1000))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("house.pgm", None, "one image of a map, not 0"),
        ("drive.npz", None, "one log, not 0"),
        ("other.yaml", b"image: a.pgm", "one YAML of a map, not 2"),
        ("house.yaml", b"- a list", "house.yaml"),
        ("house.yaml", b"a: &a [*a]", "house.yaml"),
        ("house.yaml", b"\xff\xfe\x00", "house.yaml"),
        ("house.pgm", b"P5\n10 10\n255\n", "house.pgm"),
        ("house.pgm", b"", "house.pgm"),
        ("house.pgm", small_file_of_many_pixels(20_000), "limit is 16 million"),
        ("drive.npz", b"", "drive.npz"),
        ("drive.npz", b"\x80\x04.", "drive.npz"),
    ],
)
def test_hostile_files_are_refused_in_a_sentence(
    folder: Path, name: str, content: bytes | None, words: str
) -> None:
    if content is None:
        (folder / name).unlink()
    else:
        (folder / name).write_bytes(content)
    with pytest.raises(InputError) as refusal:
        locate_files(folder, 0)
    assert words in str(refusal.value)


def test_random_bytes_are_refused(folder: Path) -> None:
    rng = np.random.default_rng(1)
    for name in ("drive.npz", "house.pgm", "house.yaml"):
        whole = (folder / name).read_bytes()
        for _ in range(10):
            (folder / name).write_bytes(rng.bytes(int(rng.integers(1, 300))))
            with pytest.raises(InputError):
                locate_files(folder, 0)
        (folder / name).write_bytes(whole)


def test_a_scan_that_is_not_there_and_a_map_that_is_too_large_are_refused(folder: Path) -> None:
    with pytest.raises(InputError, match="has 3, from 0"):
        locate_files(folder, 3)
    side = int(MOST_CELLS**0.5) + 1
    save_map(OccupancyGrid(np.zeros((side, side), np.int8), 0.05), folder / "house.yaml")
    with pytest.raises(InputError, match="limit is 16 million"):
        locate_files(folder, 0)


def test_the_answer_is_what_the_schema_says(folder: Path) -> None:
    text = json.dumps(locate_files(folder, 2))
    located = msgspec.json.decode(text, type=LocatedFiles)
    assert located.answer.index == 2
    image = Image.open(io.BytesIO(base64.b64decode(located.png)))
    assert image.size == (located.map.image.width, located.map.image.height)
