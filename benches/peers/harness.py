"""The Python side of a comparison: a program that is asked on its standard input and answers on its
standard output, a line of JSON each. docs/peers.md describes the lines."""

import json
import sys
import time

import numpy


def read_obj(path):
    """Vertices [m], shape (n, 3), and triangles counted from 0, shape (m, 3)."""
    vertices, triangles = [], []
    with open(path, encoding="ascii") as file:
        for line in file:
            kind, *words = line.split()
            if kind == "v":
                vertices.append([float(word) for word in words])
            else:
                triangles.append([int(word) - 1 for word in words])
    return numpy.array(vertices), numpy.array(triangles, dtype=numpy.int64)


def sample(call, budget):
    """Seconds of the calls that fit into the budget, one at least, after one that fills the caches."""
    call()
    samples = []
    start = time.perf_counter()
    while not samples or time.perf_counter() - start < budget:
        before = time.perf_counter()
        call()
        samples.append(time.perf_counter() - before)
    return samples


def serve(peer, methods):
    """Answers until the input ends. A method is (name, precision, stage, note, call, answer): `answer`
    turns what `call` returns into pairs."""
    names = ("name", "precision", "stage", "note")
    described = [dict(zip(names, method)) for method in methods]
    print(json.dumps({"peer": peer, "methods": described}), flush=True)
    for line in sys.stdin:
        verb, index, *budget = line.split()
        *_, call, answer = methods[int(index)]
        if verb == "time":
            print(json.dumps(sample(call, float(budget[0]))), flush=True)
        else:
            pairs = [[int(i), int(j)] for i, j in answer(call())]
            print(json.dumps({"pairs": pairs}), flush=True)
