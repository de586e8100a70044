"""Checkpoints of a small state."""

import dataclasses
import json

import scenes

from softslip.simulation.checkpoint import Identity
from softslip.simulation.checkpoint_generations import Checkpoints
from softslip.solver.integrators import Memory
from softslip.solver.state import State

IDENTITY = Identity("shear", "a" * 16, "b" * 64, "c" * 16, "python 3", json.dumps({"seed": 1}))


def state(particle_nodes=5, wall_nodes=3, seed=0):
    random = scenes.generator(seed)
    vector = random.standard_normal(2 * particle_nodes + 4 * wall_nodes + 4)
    direction = random.standard_normal(vector.size)
    return State(vector, particle_nodes, wall_nodes, 0.1, 7, Memory(0.02, 300.0, 4, direction))


def said_by(folder, identity=IDENTITY, **options):
    said = []
    return Checkpoints(folder, identity, said.append, **options), said


def written(folder, generations=1):
    checkpoints, _ = said_by(folder)
    for number in range(generations):
        point = dataclasses.replace(state(), step=number)
        checkpoints.save(point.parts, point, 2.0)
    return checkpoints
