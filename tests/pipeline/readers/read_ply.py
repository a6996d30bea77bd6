"""read_ply.py FILE.ply: what meshio (Debian: python3-meshio) reads, as JSON: points, fields of the points, triangles."""
import json
import sys

import meshio

mesh = meshio.read(sys.argv[1])
print(json.dumps({
    "type": str(mesh.points.dtype),
    "points": mesh.points.tolist(),
    "fields": {name: values.tolist() for name, values in mesh.point_data.items()},
    "triangles": [cell for block in mesh.cells if block.type == "triangle" for cell in block.data.tolist()],
}))
