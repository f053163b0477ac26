// MuJoCo: mj_forward without constraints and sensors.
#include "harness.hpp"

#include <mujoco/mujoco.h>

static mjModel *build(const harness::Problem &problem) {
    mjSpec *spec = mj_makeSpec();
    for (int k = 0; k < 3; ++k)
        spec->option.gravity[k] = problem.gravity[k];
    spec->option.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_CONTACT | mjDSBL_LIMIT | mjDSBL_FRICTIONLOSS |
                                 mjDSBL_EQUALITY | mjDSBL_SENSOR | mjDSBL_ACTUATION | mjDSBL_WARMSTART;
    // Nothing of the model may be changed to what MuJoCo would rather have.
    spec->compiler.balanceinertia = 0;
    spec->compiler.boundmass = spec->compiler.boundinertia = 0;
    spec->compiler.alignfree = 0;
    spec->compiler.fusestatic = 0;
    std::vector<mjsBody *> bodies;
    for (const harness::Body &b : problem.bodies) {
        mjsBody *parent = b.parent < 0 ? mjs_findBody(spec, "world") : bodies[b.parent];
        mjsBody *body = mjs_addBody(parent, nullptr);
        for (int k = 0; k < 3; ++k) {
            body->pos[k] = b.position[k];
            body->ipos[k] = b.center[k];
            // MuJoCo: w, x, y, z.
            body->quat[k + 1] = b.rotation[k];
        }
        body->quat[0] = b.rotation[3];
        body->mass = b.mass;
        for (int k = 0; k < 6; ++k)
            body->fullinertia[k] = b.inertia[k];
        body->explicitinertial = 1;
        mjsJoint *joint = mjs_addJoint(body, nullptr);
        if (b.joint == "free")
            joint->type = mjJNT_FREE;
        else if (b.joint == "revolute")
            joint->type = mjJNT_HINGE;
        else
            throw std::runtime_error("joints of kind " + b.joint + " are not compared");
        for (int k = 0; k < 3; ++k)
            joint->axis[k] = b.axis[k];
        bodies.push_back(body);
    }
    mjModel *model = mj_compile(spec, nullptr);
    if (!model)
        throw std::runtime_error(mjs_getError(spec));
    return model;
}

// A free joint's rates: angular, then linear, both in body axes, are MuJoCo's linear in world axes,
// then angular in body axes.
struct Input {
    std::vector<double> q, v, force;
};

static Input convert(const mjModel *model, const harness::State &state) {
    Input input{state.q, state.qd, state.force};
    for (int j = 0; j < model->njnt; ++j)
        if (model->jnt_type[j] == mjJNT_FREE) {
            const int i = model->jnt_dofadr[j];
            double *q = &input.q[model->jnt_qposadr[j]];
            const double turn[4] = {q[6], q[3], q[4], q[5]};
            mju_copy(q + 3, turn, 4);
            for (auto [to, from] : {std::pair{&input.v, &state.qd}, std::pair{&input.force, &state.force}}) {
                mju_rotVecQuat(&(*to)[i], &(*from)[i + 3], turn);
                mju_copy3(&(*to)[i + 3], &(*from)[i]);
            }
        }
    return input;
}

// With v = R u for the linear velocity, v' = R (u' + w x u).
static std::vector<double> convert_back(const mjModel *model, const mjData *data, const harness::State &state) {
    std::vector<double> a(data->qacc, data->qacc + model->nv);
    for (int j = 0; j < model->njnt; ++j)
        if (model->jnt_type[j] == mjJNT_FREE) {
            const int i = model->jnt_dofadr[j];
            const double *q = data->qpos + model->jnt_qposadr[j];
            double back[4], linear[3], turning[3];
            mju_negQuat(back, q + 3);
            mju_rotVecQuat(linear, data->qacc + i, back);
            mju_cross(turning, &state.qd[i], &state.qd[i + 3]);
            mju_copy3(&a[i], data->qacc + i + 3);
            mju_sub3(&a[i + 3], linear, turning);
        }
    return a;
}

static int compare(const std::string &folder) {
    const harness::Problem problem = harness::read_problem(folder + "/problem.txt");
    mjModel *model = build(problem);
    mjData *data = mj_makeData(model);
    std::vector<Input> inputs;
    for (const harness::State &s : problem.states)
        inputs.push_back(convert(model, s));
    const auto solve = [&](const Input &x) {
        mju_copy(data->qpos, x.q.data(), model->nq);
        mju_copy(data->qvel, x.v.data(), model->nv);
        mju_copy(data->qfrc_applied, x.force.data(), model->nv);
        mj_forward(model, data);
    };
    const auto answer = [&] {
        std::vector<std::vector<double>> rows;
        for (std::size_t i = 0; i < inputs.size(); ++i) {
            solve(inputs[i]);
            rows.push_back(convert_back(model, data, problem.states[i]));
        }
        return harness::accelerations_json(rows);
    };
    return harness::serve(std::string("MuJoCo ") + mj_versionString(),
                          {{"mujoco", "f64", "forward dynamics",
                            "mj_forward() from C++, constraints, contacts, actuation and sensors off; it computes the "
                            "mass matrix and its factors on the way",
                            harness::in_turn(inputs, problem.group, solve), problem.group, answer}});
}

int main(int argc, char **argv) {
    return harness::run(argc, argv, compare);
}
