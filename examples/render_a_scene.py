"""Draws a street with three road users, which arrays define, and writes images of the paper's cameras to
render_a_scene.png."""

import sys

import numpy as np

import pictura


def main(path: str = "render_a_scene.png") -> None:
    rig = pictura.Rig.paper(480, 270)
    renderer = pictura.Renderer("cpu", rig)
    lines = [([[-50, y, 0], [100, y, 0]], 0.2, (0.9, 0.9, 0.9)) for y in (-5.5, -1.9, 1.7)]
    walls = [[-50, 9, 0, 100, 9, 0, 6.0]]
    renderer.upload(0, pictura.Geometry(lines, np.array(walls, np.float32)))
    scene = pictura.Scene(
        center_m=[[16, 0.2, 0], [9, 5, 0], [22, -3.6, 0]],
        heading_rad=[0.05, 2.9, 0.0],
        size_m=[[4.5, 1.9, 1.5], [0.5, 0.6, 1.7], [1.8, 0.6, 1.7]],
        agent_class=[0, 2, 1],
    )
    images = renderer.render(scene, pictura.make_views([[0, 0, 0]], [0.0]), planes=True)
    pictures = images.rgb.numpy()[0].transpose(0, 2, 3, 1)
    front_left, front, front_right = pictures[1], pictures[0], pictures[2]
    save_png(path, np.concatenate([front_left, front, front_right], axis=1))
    nearest = images.planes(0)["depth_m"].numpy()[0].min()
    print(f"{path}: {len(rig)} cameras, of which three are shown; the nearest surface in front is {nearest:.1f} m away")


def save_png(path: str, rgb: np.ndarray) -> None:
    """Writes uint8 [height, width, 3] as PNG, without an image library."""
    import struct
    import zlib

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width, _ = rgb.shape
    rows = b"".join(b"\0" + row.tobytes() for row in np.ascontiguousarray(rgb))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    main(*sys.argv[1:])
