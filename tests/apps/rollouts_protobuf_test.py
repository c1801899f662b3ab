"""Checks `pictura evaluate --rollouts` with an independent protobuf implementation.

Usage: rollouts_protobuf_test.py PICTURA SCENE_FIXTURE. Google's protobuf, with the messages of the Waymo sim-agents
challenge (sim_agents_submission.proto) by number, must find in the file exactly the challenge's required contents.

Runs with the Python of $PICTURA_PY123D, or this one; exits with 77 if it lacks protobuf.
"""

import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

PICTURA, FIXTURE = sys.argv[1:3]
FLOAT, INT32, BOOL, STRING, MESSAGE, ENUM = 2, 5, 8, 9, 11, 14  # FieldDescriptorProto.Type
# name: (number, repeated, type), of messages and of the enumeration in the last one.
SCHEMA = {
    "SimulatedTrajectory": {
        "center_x": (2, True, FLOAT), "center_y": (3, True, FLOAT), "center_z": (4, True, FLOAT), "heading": (5, True, FLOAT),
        "object_id": (6, False, INT32),
    },
    "JointScene": {"simulated_trajectories": (1, True, "SimulatedTrajectory")},
    "ScenarioRollouts": {"scenario_id": (1, False, STRING), "joint_scenes": (2, True, "JointScene")},
    "SimAgentsChallengeSubmission": {
        "scenario_rollouts": (1, True, "ScenarioRollouts"), "submission_type": (2, False, ENUM), "account_name": (3, False, STRING),
        "unique_method_name": (4, False, STRING), "authors": (5, True, STRING), "affiliation": (6, False, STRING),
        "description": (7, False, STRING), "method_link": (8, False, STRING), "uses_lidar_data": (9, False, BOOL),
        "uses_camera_data": (10, False, BOOL), "uses_public_model_pretraining": (11, False, BOOL),
        "num_model_parameters": (12, False, STRING), "public_model_names": (13, True, STRING),
        "acknowledge_complies_with_closed_loop_requirement": (14, False, BOOL),
    },
}
SIM_AGENTS_SUBMISSION = 1


def submission_class():
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    file = descriptor_pb2.FileDescriptorProto(name="rollouts.proto", package="rollouts", syntax="proto2")
    for message_name, fields in SCHEMA.items():
        message = file.message_type.add(name=message_name)
        for name, (number, repeated, kind) in fields.items():
            field = message.field.add(name=name, number=number, label=3 if repeated else 1)
            field.type = MESSAGE if isinstance(kind, str) else kind
            if isinstance(kind, str):
                field.type_name = f".rollouts.{kind}"
            if kind == ENUM:
                field.type_name = ".rollouts.SimAgentsChallengeSubmission.SubmissionType"
            if kind == FLOAT:
                field.options.packed = True
    enum = message.enum_type.add(name="SubmissionType")
    enum.value.add(name="UNKNOWN", number=0)
    enum.value.add(name="SIM_AGENTS_SUBMISSION", number=SIM_AGENTS_SUBMISSION)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("rollouts.SimAgentsChallengeSubmission"))


def rollouts(Submission, folder, scenes, *more):
    out = folder / "rollouts.binproto"
    words = ["--protocol", "simagents", "--scenes", scenes, "--rollouts", out, "--device", "cpu", "--threads", 1, *more]
    subprocess.run([PICTURA, "evaluate", *map(str, words)], check=True, stdout=subprocess.DEVNULL)
    data = out.read_bytes()
    submission = Submission.FromString(data)
    # Unknown fields would be kept but not parsed: all fields are known, and encoded like protobuf's, except for the
    # order of the submission's fields.
    submission.DiscardUnknownFields()
    assert submission.ByteSize() == len(data), (submission.ByteSize(), len(data))
    assert submission.submission_type == SIM_AGENTS_SUBMISSION
    return data, submission


def check_shape(rollout, recorded):
    """Checks the 32 rollouts of one scenario, against protobuf's JSON of its record."""
    present = {track["id"]: track for track in recorded["tracks"] if track["states"][10].get("valid")}
    assert rollout.scenario_id == recorded["scenarioId"] and len(rollout.joint_scenes) == 32
    for scene in rollout.joint_scenes:
        assert sorted(each.object_id for each in scene.simulated_trajectories) == sorted(present), "valid at step 10"
        for each in scene.simulated_trajectories:
            for values in (each.center_x, each.center_y, each.center_z, each.heading):
                assert len(values) == 80 and all(map(math.isfinite, values))
    return present


def main():
    python = os.environ.get("PICTURA_PY123D")
    if python and os.path.abspath(python) != sys.executable and not os.environ.get("PICTURA_PY123D_CHILD"):
        os.environ["PICTURA_PY123D_CHILD"] = "1"
        os.execv(python, [python, *sys.argv])
    try:
        Submission = submission_class()
    except ImportError as error:
        print(f"skipped: {error}: no independent protobuf")
        return 77
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        subprocess.run([FIXTURE, "write", name], check=True)
        recorded = json.loads((folder / "womd_proto.json").read_text())
        scene = folder / "womd.tfrecord"
        data, submission = rollouts(Submission, folder, scene, "--policy", "random")
        (rollout,) = submission.scenario_rollouts
        check_shape(rollout, recorded)
        assert len({scene.SerializeToString() for scene in rollout.joint_scenes}) == 32, "each is another"
        # Concatenated files are one submission, to which the authors' fields may be added.
        both = Submission.FromString(data + data + Submission(account_name="someone").SerializeToString())
        assert len(both.scenario_rollouts) == 2 and both.account_name == "someone"

        # Road users that follow the recording are at the recorded position, in its coordinates.
        _, submission = rollouts(Submission, folder, scene, "--policy", "idle", "--control", "self")
        (rollout,) = submission.scenario_rollouts
        present = check_shape(rollout, recorded)
        sdc = recorded["tracks"][recorded["sdcTrackIndex"]]["id"]
        compared = 0
        for each in rollout.joint_scenes[31].simulated_trajectories:
            if each.object_id == sdc:
                continue
            for step, state in enumerate(present[each.object_id]["states"][11:]):
                if not state.get("valid"):
                    continue
                compared += 1
                place = each.center_x[step], each.center_y[step]
                assert math.dist(place, (state["centerX"], state["centerY"])) < 5e-3, (each.object_id, step, place, state)
                assert abs(each.center_z[step] - state["centerZ"]) < 0.3, (each.center_z[step], state)
                assert abs(math.remainder(each.heading[step] - state["heading"], 2 * math.pi)) < 1e-4
        assert compared > 500, compared
    print(f"read alike: {compared} states")
    return 0


if __name__ == "__main__":
    sys.exit(main())
