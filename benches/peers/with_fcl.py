"""FCL through python-fcl: collision of two models of triangles with all contacts."""

import importlib.metadata
import sys

import fcl

from harness import read_obj, serve

MESHES = [read_obj(f"{sys.argv[1]}/{side}.obj") for side in "ab"]


def build():
    objects = []
    for vertices, triangles in MESHES:
        model = fcl.BVHModel()
        model.beginModel(len(vertices), len(triangles))
        model.addSubModel(vertices, triangles)
        model.endModel()
        objects.append(fcl.CollisionObject(model))
    return objects


def query(objects):
    request = fcl.CollisionRequest(num_max_contacts=10_000_000, enable_contact=False)
    result = fcl.CollisionResult()
    fcl.collide(*objects, request, result)
    return result.contacts


def pairs(contacts):
    return {(contact.b1, contact.b2) for contact in contacts}


BUILT = build()
NOTE = "called from Python, which also makes an object of every contact"
serve(
    f"python-fcl {importlib.metadata.version('python-fcl')}",
    [
        ("fcl-total", "f64", "total", NOTE, lambda: query(build()), pairs),
        ("fcl-query", "f64", "query", NOTE, lambda: query(BUILT), pairs),
    ],
)
