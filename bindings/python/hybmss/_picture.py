"""Pictures of bodies for notebooks, drawn by NumPy alone."""

import base64
import struct
import zlib

import numpy as np

from hybmss import _hybmss

_WIDTH, _HEIGHT, _FINER = 400, 300, 2  # pixels; each is the mean of 2 x 2 finer ones
_TURN, _TILT = 0.6, 0.3
_COLOUR = np.array([204, 92, 77.0])


def _view():
    """Rows: to the right, up and towards the eye; y is up in space."""
    c, s, ct, st = np.cos(_TURN), np.sin(_TURN), np.cos(_TILT), np.sin(_TILT)
    return np.array([[c, 0, -s], [-s * st, ct, -c * st], [s * ct, st, c * ct]])


def _drawn(vertices, triangles):
    """Colours and cover, (height, width, 4): every triangle as points so near each other that none is missing."""
    width, height = _WIDTH * _FINER, _HEIGHT * _FINER
    seen = vertices @ _view().T
    low, high = seen.min(axis=0), seen.max(axis=0)
    scale = 0.94 * min(width / max(high[0] - low[0], 1e-30), height / max(high[1] - low[1], 1e-30))
    seen = (seen - (low + high) / 2) * [scale, -scale, scale] + [width / 2, height / 2, 0]
    corners = seen[triangles]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 1] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    shown = normals[:, 2] > 0
    corners, normals = corners[shown], normals[shown] / lengths[shown, None]
    light = 0.4 + 0.6 * np.abs(normals @ (np.array([0.25, -0.5, 0.83])))
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    # Points of which three neighbours are within 0.8 pixels of each other: every pixel has one. Triangles of like sizes go together.
    parts = np.ceil(2 ** (np.ceil(4 * np.log2(np.maximum(1.25 * edges, 1))) / 4)).astype(int)
    places, depths, shades = [], [], []
    for count in np.unique(parts):
        i, j = np.nonzero(np.tri(count + 1, dtype=bool)[::-1])
        weights = np.stack([i, j, count - i - j], axis=1) / count
        of = parts == count
        points = np.einsum("pw,twa->tpa", weights, corners[of])
        x, y = points[..., 0].astype(int).clip(0, width - 1), points[..., 1].astype(int).clip(0, height - 1)
        places.append((y * width + x).ravel())
        depths.append(points[..., 2].ravel())
        shades.append(np.repeat(light[of], len(weights)))
    order = np.argsort(np.concatenate(depths), kind="stable")  # the nearest last: it stays
    image = np.zeros((height * width, 4))
    places, shades = np.concatenate(places)[order], np.concatenate(shades)[order]
    image[places, :3] = np.minimum(shades[:, None] * _COLOUR, 255)
    image[places, 3] = 255
    image[:, :3] *= image[:, 3:] / 255
    image = image.reshape(_HEIGHT, _FINER, _WIDTH, _FINER, 4).mean(axis=(1, 3))
    image[..., :3] *= 255 / np.maximum(image[..., 3:], 1)
    return image.round().astype(np.uint8)


def _png(image):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width, _ = image.shape
    rows = b"".join(b"\0" + row.tobytes() for row in image)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


class Picture:
    """A body's surface as a picture, which notebooks show: `png` are the bytes of its file."""

    __slots__ = ("png", "text")

    def __init__(self, png: bytes, text: str) -> None:
        self.png = png
        self.text = text

    def _repr_png_(self) -> bytes:
        return self.png

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.png).decode()
        return f'<figure style="margin:0"><img alt="{self.text}" src="data:image/png;base64,{data}"><figcaption>{self.text}</figcaption></figure>'


def picture(lattice, displacements=None, text=""):
    """The surface of a lattice, where displacements (m, one a node) bring it. Notebooks show what this returns."""
    vertices, triangles = _hybmss.boundary_mesh(lattice)
    if displacements is not None:
        moved = np.empty_like(vertices)
        skin = _hybmss.Skin(lattice, vertices, triangles)
        skin.update(np.ascontiguousarray(displacements, dtype=np.float64), moved)
        vertices = moved
    if not np.isfinite(vertices).all():
        raise ValueError("displacements: they are not finite")
    nx, ny, nz = lattice.cells
    told = f"{lattice.cell_count} of {nx} x {ny} x {nz} cells of {lattice.cell_size:.6g} m, {lattice.node_count} nodes"
    return Picture(_png(_drawn(vertices, triangles)), told + (f"; {text}" if text else ""))
