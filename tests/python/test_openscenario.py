"""Scenes as OpenSCENARIO: read back by another reader of XML, and by ASAM's schema where asam-qc-openscenarioxml is installed."""

import importlib.util
import os
import pathlib
import subprocess
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import pictura
from pictura import openscenario

FIXTURE = os.environ.get("PICTURA_SCENE_FIXTURE", "")


@pytest.fixture(scope="module")
def scene(tmp_path_factory) -> pictura.Scenario:
    if not os.path.isfile(FIXTURE):
        pytest.skip("PICTURA_SCENE_FIXTURE: expected the program scene_fixture")
    path = tmp_path_factory.mktemp("scenes")
    subprocess.run([FIXTURE, "write", str(path)], check=True)
    return pictura.Scenario.load(str(path / "womd.tfrecord"))


def pose(position: ET.Element) -> np.ndarray:
    return np.array([float(position.find("WorldPosition").get(name)) for name in "xyzh"])


def check(scene: pictura.Scenario, root: ET.Element) -> int:
    """Checks the pose and time of every recorded box in the file. Returns the number of compared states."""
    tracks, start = scene.tracks(), scene.start_step
    objects = {item.get("name"): item for item in root.iterfind("Entities/ScenarioObject")}
    groups = {item.get("name"): item for item in root.iterfind("Storyboard/Story/Act/ManeuverGroup")}
    inits = {item.get("entityRef"): item for item in root.iterfind("Storyboard/Init/Actions/Private")}
    compared = 0
    for i, track_id in enumerate(tracks["id"]):
        name, valid = f"track {track_id}", tracks["valid"][i, start:]
        assert (name in objects) == valid.any()
        if not valid.any():
            continue
        box = objects[name].find(".//BoundingBox")
        center = np.array([float(box.find("Center").get(axis)) for axis in "xyz"])
        size = [float(box.find("Dimensions").get(side)) for side in ("length", "width", "height")]
        np.testing.assert_allclose(size, tracks["size_m"][i], rtol=1e-6)
        steps = np.flatnonzero(valid)
        assert (name in inits) == bool(valid[0])
        assert (groups[name].find(".//AddEntityAction") is not None) == (not valid[0])
        assert (groups[name].find(".//DeleteEntityAction") is not None) == (not valid[-1])
        vertices = groups[name].findall(".//Vertex")
        assert len(vertices) == (len(steps) if len(steps) > 1 else 0)
        for step, vertex in zip(steps, vertices, strict=False):
            assert float(vertex.get("time")) == pytest.approx(step * scene.dt_s, abs=1e-6)
            x, y, z, h = pose(vertex.find("Position"))
            foot = np.array([x + center[0] * np.cos(h), y + center[0] * np.sin(h), z]) - scene.origin_m
            np.testing.assert_allclose(foot, tracks["position_m"][i, start + step], atol=1e-3)
            assert h == pytest.approx(tracks["heading_rad"][i, start + step], abs=1e-5)
            compared += 1
        if valid[0] and vertices:
            np.testing.assert_allclose(pose(inits[name].find(".//TeleportAction/Position")), pose(vertices[0].find("Position")))
    return compared


@pytest.mark.parametrize("start_step", [0, 30])
def test_boxes_have_their_recorded_poses(scene, tmp_path, start_step):
    later = scene.starting_at(start_step)
    openscenario.write(later, tmp_path / "a.xosc", road_network="map.xodr")
    root = ET.parse(tmp_path / "a.xosc").getroot()
    assert root.find("FileHeader").attrib["revMinor"] == "2" and root.find("RoadNetwork/LogicFile").get("filepath") == "map.xodr"
    assert check(later, root) == later.tracks()["valid"][:, start_step:].sum()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.xosc"]


def test_real_scenes_are_written(tmp_path):
    data = pathlib.Path(os.environ.get("PICTURA_DATA", "/nowhere"), "womd/womd_scenario_input.tfrecord")
    if not data.exists():
        pytest.skip("PICTURA_DATA: expected womd/womd_scenario_input.tfrecord")
    real = pictura.Scenario.load(str(data))
    openscenario.write(real, tmp_path / "real.xosc")
    root = ET.parse(tmp_path / "real.xosc").getroot()
    assert check(real, root) > 5000 and root.find("RoadNetwork/LogicFile") is None


def test_a_recorded_drive_is_written(scene, tmp_path):
    simulator = pictura.Simulator([scene], [(0, scene.num_tracks)], num_threads=1, **scene.world())
    recorder = pictura.SceneRecorder(simulator)
    for _ in range(20):
        simulator.step(np.full(simulator.num_slots, pictura.IDLE_ACTION, np.int32))
    drive = recorder.scenario(id="drive")
    openscenario.write(drive, tmp_path / "drive.xosc")
    assert check(drive, ET.parse(tmp_path / "drive.xosc").getroot()) > 100


def test_written_files_validate_against_the_schema(scene, tmp_path):
    checker = importlib.util.find_spec("qc_openscenario")
    if checker is None or importlib.util.find_spec("lxml") is None:
        pytest.skip("asam-qc-openscenarioxml: expected it, with the schema")
    from lxml import etree

    schema = etree.XMLSchema(etree.parse(pathlib.Path(checker.origin).parent / "schema/1.2.0/OpenSCENARIO.xsd"))
    openscenario.write(scene.starting_at(30), tmp_path / "a.xosc")
    schema.assertValid(etree.parse(tmp_path / "a.xosc"))
    root = ET.parse(tmp_path / "a.xosc").getroot()
    root.find("Entities/ScenarioObject/*/Properties").tag = "Nonsense"
    assert not schema.validate(etree.fromstring(ET.tostring(root)))


def test_refusals(scene, tmp_path):
    with pytest.raises(pictura.UsageError, match="a.xml: expected a name that ends in .xosc"):
        openscenario.write(scene, tmp_path / "a.xml")
    with pytest.raises(pictura.UsageError, match="two steps or more from step 90 on"):
        openscenario.write(scene.starting_at(90), tmp_path / "a.xosc")
    with pytest.raises(FileNotFoundError):
        openscenario.write(scene, tmp_path / "none" / "a.xosc")
