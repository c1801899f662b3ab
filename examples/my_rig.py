"""Custom cameras: a wide front camera and a narrow rear camera, with different image sizes. Prints how visible the
other agents are in their images."""

import math

import numpy as np

import pictura


def main() -> None:
    rig = pictura.Rig([
        pictura.Camera("wide", 160, 64, focal_px=70, position_m=(1.6, 0, 1.4)),
        pictura.Camera("mirror", 64, 64, focal_px=60, position_m=(0.2, 0, 1.6), yaw_rad=math.pi, pitch_rad=-0.1),
    ])  # fmt: skip
    simulator = pictura.Simulator([pictura.Map.load("procedural:3")], [(0, 24)], seed=2)
    renderer = pictura.Renderer("cpu", rig)
    for handle, geometry in simulator.geometries.items():
        renderer.upload(handle, geometry)
    images = renderer.render(simulator.scene, simulator.views, planes=True)
    for i, camera in enumerate(rig.cameras):
        seen = np.unique(images.planes(i)["instance_id"].numpy()[0])
        print(f"{camera.name}: images {list(images.camera(i).shape)}, agent 0 sees {np.count_nonzero(seen)} others")
    pairs = np.array([(0, other) for other in range(1, 24)], np.int32)
    coverage = renderer.visibility(simulator.scene, simulator.views, pairs)
    print(f"{np.isfinite(coverage).sum()} others are in its frames, {np.count_nonzero(coverage > 0.5)} of them at least half visible")


if __name__ == "__main__":
    main()
