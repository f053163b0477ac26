"""libigl: intersecting triangles through an AABB tree and exact predicates."""

import importlib.metadata
import sys

import igl.predicates

from harness import read_obj, serve

VA, FA = read_obj(f"{sys.argv[1]}/a.obj")
VB, FB = read_obj(f"{sys.argv[1]}/b.obj")


def find():
    _, pairs, _ = igl.predicates.find_intersections(VA, FA, VB, FB)
    return pairs


serve(
    f"libigl {importlib.metadata.version('libigl')}",
    [
        (
            "libigl-total",
            "-",
            "total",
            "predicates.find_intersections, called from Python; it builds its tree in every call",
            find,
            lambda pairs: pairs,
        )
    ],
)
