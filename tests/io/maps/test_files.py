"""Naming the wrong file is answered with the right one."""

import os

import pytest

from firstfix.core.errors import MapError
from firstfix.io.maps.files import find_image, find_yaml, read_yaml_bytes


def test_a_file_is_taken_as_it_is(tmp_path):
    (tmp_path / "anything").write_text("a: 1")
    assert find_yaml(tmp_path / "anything") == tmp_path / "anything"


def test_a_folder_gives_its_map_yaml_or_its_only_one(tmp_path):
    (tmp_path / "hall.yaml").touch()
    assert find_yaml(tmp_path) == tmp_path / "hall.yaml"
    (tmp_path / "params.yml").touch()
    with pytest.raises(MapError, match=r"hall.yaml and params.yml"):
        find_yaml(tmp_path)
    (tmp_path / "map.yaml").touch()
    assert find_yaml(tmp_path) == tmp_path / "map.yaml"


def test_an_empty_folder(tmp_path):
    with pytest.raises(MapError, match="no YAML"):
        find_yaml(tmp_path)


def test_a_forgotten_suffix(tmp_path):
    (tmp_path / "hall.yaml").touch()
    with pytest.raises(MapError, match=r"pass .*hall\.yaml"):
        find_yaml(tmp_path / "hall")


@pytest.mark.parametrize("name", ["no.yaml", "x\0y", "a" * 5000, "\ud800", "pipe"])
def test_what_is_no_file(tmp_path, name):
    os.mkfifo(tmp_path / "pipe")  # reading it would wait for ever
    with pytest.raises(MapError, match="no file") as caught:
        find_yaml(tmp_path / name)
    str(caught.value).encode()


@pytest.mark.parametrize("name", ["m.png", "m.yaml"])
def test_an_image_instead_of_its_yaml(tmp_path, name):
    (tmp_path / name).write_bytes(b"\x89PNG\r\n\x1a\n")
    with pytest.raises(MapError, match="an image"):
        read_yaml_bytes(tmp_path / name)
    (tmp_path / "m.yml").touch()
    with pytest.raises(MapError, match="an image") as caught:
        read_yaml_bytes(tmp_path / name)
    assert "m.y" in caught.value.remedy


def test_a_file_without_permission(tmp_path, monkeypatch):
    path = tmp_path / "m.yaml"
    path.touch()

    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(path), "open", refuse)
    with pytest.raises(MapError, match="Permission denied"):
        read_yaml_bytes(path)


def test_images_are_relative_to_the_yaml_or_absolute(tmp_path):
    (tmp_path / "images").mkdir()
    image = tmp_path / "images" / "a b.pgm"
    image.touch()
    assert find_image(tmp_path / "m.yaml", "images/a b.pgm") == image
    assert find_image(tmp_path / "m.yaml", str(image)) == image


def test_an_absolute_path_of_another_machine(tmp_path):
    (tmp_path / "hall.pgm").touch()
    with pytest.raises(MapError, match=r"write 'image: hall\.pgm'"):
        find_image(tmp_path / "m.yaml", "/home/somebody/maps/hall.pgm")


@pytest.mark.parametrize("name", ["", ".", "..", "no.pgm", "x\0y", "/", "a" * 5000])
def test_what_is_no_image(tmp_path, name):
    with pytest.raises(MapError, match=r"no file|an empty name"):
        find_image(tmp_path / "m.yaml", name)
