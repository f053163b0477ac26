"""Writes crane.gold.json: what Drake (`pip install drake`) makes of crane.sdf.

Positions, rates, forces and accelerations stand by joint, as Drake has them: of a ball joint roll, pitch and yaw and
the angular velocity in the parent's axes; of a free link its quaternion (w first) and place, then angular and linear
velocity of its origin, all in world axes. Forces of free links and ball joints go with their rates.
"""

import json
import pathlib
import sys

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

HERE = pathlib.Path(__file__).parent
GRAVITY = [0.4, -0.3, -9.1]  # Drake does not read a world's <gravity>.

plant = MultibodyPlant(time_step=0.0)
Parser(plant).AddModels(str(HERE / "crane.sdf"))
plant.mutable_gravity_field().set_gravity_vector(GRAVITY)
plant.Finalize()

models = [plant.GetModelInstanceByName(name) for name in ("crane", "press")]
joints, free = {}, {}
for model in models:
    scope = plant.GetModelInstanceName(model) + "::"
    for index in plant.GetJointIndices(model):
        joint = plant.get_joint(index)
        if joint.type_name() == "quaternion_floating":
            free[scope + joint.child_body().name()] = joint
        elif joint.num_velocities():
            joints[scope + joint.name()] = joint
links = [plant.get_body(index) for model in models for index in plant.GetBodyIndices(model)]


def scoped(body):
    return plant.GetModelInstanceName(body.model_instance()) + "::" + body.name()


def split(q, v):
    """Positions and rates by joint or free link."""
    both = {**joints, **free}
    return {
        name: {
            "q": q[j.position_start() :][: j.num_positions()].tolist(),
            "v": v[j.velocity_start() :][: j.num_velocities()].tolist(),
        }
        for name, j in both.items()
    }


random = np.random.default_rng(1)
context = plant.CreateDefaultContext()
nv = plant.num_velocities()
cases = []
for case in range(5):
    # The first is at rest in the pose of the file.
    if case > 0:
        q = plant.GetPositions(context) + random.uniform(-0.8, 0.8, plant.num_positions())
        for joint in free.values():
            at = slice(joint.position_start(), joint.position_start() + 4)
            q[at] /= np.linalg.norm(q[at])
        plant.SetPositions(context, q)
        plant.SetVelocities(context, random.uniform(-2, 2, nv))
    tau = random.uniform(-3, 3, nv) * (case > 0)
    plant.get_applied_generalized_force_input_port().FixValue(context, tau)
    a = plant.get_generalized_acceleration_output_port().Eval(context)
    q, v = plant.GetPositions(context), plant.GetVelocities(context)
    state, acted = split(q, v), split(q, tau)
    moved = split(q, a)
    cases.append(
        {
            "joints": {
                name: {
                    "q": state[name]["q"],
                    "qd": state[name]["v"],
                    "tau": acted[name]["v"],
                    "qdd": moved[name]["v"],
                }
                for name in state
            },
            "places": {
                scoped(body): plant.EvalBodyPoseInWorld(context, body).GetAsMatrix34().T.ravel().tolist()
                for body in links
            },
        }
    )

gold = {
    "tool": "Drake 1.51.1",
    "file": "crane.sdf",
    "masses": {scoped(body): body.default_mass() for body in links},
    "free": sorted(free),
    "cases": cases,
}
out = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "crane.gold.json"
out.write_text(json.dumps(gold))
