"""WOMD fixtures encoded and parsed by an independent protobuf library, to find errors that writer and reader share.

Usage: womd_protobuf_test.py SCENE_FIXTURE. The fixture's fields, by name, are encoded by Google's protobuf with the
dataset's own schema (which the package py123d ships), and the record is read by the project's reader: it must give
the scene of the project's own record. The project's record, in turn, must parse to the same message without unknown fields.

Runs with the Python $PICTURA_PY123D; default: the running one. Exits with 77 if it lacks py123d or protobuf. Setup:
  python3 -m venv py123d && py123d/bin/pip install --no-deps py123d==0.7.0 && py123d/bin/pip install protobuf numpy
"""

import importlib
import os
import pathlib
import struct
import subprocess
import sys
import tempfile

PACKAGE = "py123d.parser.wod.waymo_open_dataset.protos."


def schema():
    """Returns the message class Scenario. A schema file loads only after the files that it imports, so this retries in any order."""
    package = importlib.import_module(PACKAGE.rstrip("."))
    names = [path.stem for path in pathlib.Path(next(iter(package.__path__))).glob("*_pb2.py")]
    for _ in range(len(names)):
        for name in list(names):
            try:
                importlib.import_module(PACKAGE + name)
                names.remove(name)
            except TypeError:
                pass
    return importlib.import_module(PACKAGE + "scenario_pb2").Scenario


def crc32c(data):
    """Computes CRC-32C bit by bit; the code under test uses a table."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x82F63B78 if crc & 1 else 0)
    return crc ^ 0xFFFFFFFF


def masked(data):
    crc = crc32c(data)
    return (((crc >> 15) | (crc << 17)) + 0xA282EAD8) & 0xFFFFFFFF


def tfrecord(payload):
    length = struct.pack("<Q", len(payload))
    return length + struct.pack("<I", masked(length)) + payload + struct.pack("<I", masked(payload))


def payload_of(record):
    (length,) = struct.unpack_from("<Q", record)
    (sum_of_length,) = struct.unpack_from("<I", record, 8)
    (sum_of_payload,) = struct.unpack_from("<I", record, 12 + length)
    payload = record[12 : 12 + length]
    assert len(record) == length + 16, "one record"
    assert sum_of_length == masked(record[:8]) and sum_of_payload == masked(payload)
    return payload


def unknown_fields(message):
    """Returns the names of messages that contain fields that the schema lacks."""
    from google.protobuf import unknown_fields as unknown

    found = {message.DESCRIPTOR.name} if len(unknown.UnknownFieldSet(message)) else set()
    for field, value in message.ListFields():
        if field.message_type is None:
            continue
        for part in value if hasattr(value, "__len__") else [value]:
            found |= unknown_fields(part)
    return found


def main():
    tool = sys.argv[1]
    python = os.environ.get("PICTURA_PY123D")
    if python and os.path.abspath(python) != sys.executable and not os.environ.get("PICTURA_PY123D_CHILD"):
        os.environ["PICTURA_PY123D_CHILD"] = "1"
        os.execv(python, [python, *sys.argv])
    try:
        Scenario = schema()
        from google.protobuf import json_format
    except ImportError as error:
        print(f"skipped: {error}: no independent protobuf with the dataset's schema (see {__file__})")
        return 77
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([tool, "write", name], check=True)
        theirs = json_format.Parse((folder / "womd_proto.json").read_text(), Scenario())
        assert len(theirs.tracks) == 12 and len(theirs.dynamic_map_states) == 91, "the fixture"
        assert theirs.dynamic_map_states[90].lane_states[0].state == 6, "a green light"
        ours = Scenario()
        ours.ParseFromString(payload_of((folder / "womd.tfrecord").read_bytes()))
        assert not unknown_fields(ours), unknown_fields(ours)
        # proto2 messages record which fields are set, so this compares all written fields.
        assert ours == theirs, "our record differs from the fixture's fields"
        (folder / "theirs.tfrecord").write_bytes(tfrecord(theirs.SerializeToString()))
        print("their bytes are", "equal to" if ours.SerializeToString() == theirs.SerializeToString() else "different from", "ours")
        subprocess.run([tool, "compare", str(folder / "womd.tfrecord"), str(folder / "theirs.tfrecord")], check=True)
        # The comparison must find a wrong light.
        theirs.dynamic_map_states[50].lane_states[1].state = 5
        (folder / "other.tfrecord").write_bytes(tfrecord(theirs.SerializeToString()))
        other = subprocess.run(
            [tool, "compare", str(folder / "womd.tfrecord"), str(folder / "other.tfrecord")], stdout=subprocess.PIPE, text=True
        )
        assert other.returncode == 1 and "light" in other.stdout, other
    print("both records give the same scene")
    return 0


if __name__ == "__main__":
    sys.exit(main())
