// Pinocchio: the articulated-body algorithm in both of its conventions.
#include "harness.hpp"

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/config.hpp>
#include <pinocchio/multibody.hpp>

namespace pin = pinocchio;
using Eigen::Vector3d;

// Pinocchio has linear before angular in a free joint; swapping is its own inverse.
static Eigen::VectorXd swapped(const Eigen::VectorXd &v, const pin::Model &model) {
    Eigen::VectorXd out = v;
    for (std::size_t j = 1; j < model.joints.size(); ++j)
        if (model.nvs[j] == 6) {
            const int i = model.idx_vs[j];
            out.segment<3>(i) = v.segment<3>(i + 3);
            out.segment<3>(i + 3) = v.segment<3>(i);
        }
    return out;
}

static pin::Model build(const harness::Problem &problem) {
    pin::Model model;
    model.gravity.linear() = Vector3d(problem.gravity.data());
    std::vector<pin::JointIndex> joints;
    for (const harness::Body &b : problem.bodies) {
        const Eigen::Quaterniond rotation(b.rotation[3], b.rotation[0], b.rotation[1], b.rotation[2]);
        const pin::SE3 placement(rotation, Vector3d(b.position.data()));
        const pin::JointIndex parent = b.parent < 0 ? 0 : joints[b.parent];
        const std::string name = "joint" + std::to_string(joints.size());
        const Vector3d axis(b.axis.data());
        pin::JointIndex joint;
        if (b.joint == "free")
            joint = model.addJoint(parent, pin::JointModelFreeFlyer(), placement, name);
        else if (b.joint != "revolute")
            throw std::runtime_error("joints of kind " + b.joint + " are not compared");
        // The kinds with a fixed axis are the fastest it has.
        else if (axis == Vector3d::UnitX())
            joint = model.addJoint(parent, pin::JointModelRX(), placement, name);
        else if (axis == Vector3d::UnitY())
            joint = model.addJoint(parent, pin::JointModelRY(), placement, name);
        else if (axis == Vector3d::UnitZ())
            joint = model.addJoint(parent, pin::JointModelRZ(), placement, name);
        else
            joint = model.addJoint(parent, pin::JointModelRevoluteUnaligned(axis), placement, name);
        Eigen::Matrix3d inertia;
        inertia << b.inertia[0], b.inertia[3], b.inertia[4], b.inertia[3], b.inertia[1], b.inertia[5], b.inertia[4],
            b.inertia[5], b.inertia[2];
        model.appendBodyToJoint(joint, pin::Inertia(b.mass, Vector3d(b.center.data()), inertia), pin::SE3::Identity());
        joints.push_back(joint);
    }
    return model;
}

// Its Data takes about 64 bytes times the cube of the number of freedoms.
static void check_memory(const pin::Model &model) {
    std::ifstream file("/proc/meminfo");
    std::string word;
    double available = 0.0; // [kB]
    while (file >> word && word != "MemAvailable:") {
    }
    if (file >> available && 64.0 * model.nv * model.nv * model.nv > 0.8 * 1024.0 * available)
        throw std::runtime_error("not enough memory for pinocchio::Data");
}

static int compare(const std::string &folder) {
    const harness::Problem problem = harness::read_problem(folder + "/problem.txt");
    const pin::Model model = build(problem);
    check_memory(model);
    pin::Data data(model);
    struct Input {
        Eigen::VectorXd q, v, tau;
    };
    std::vector<Input> inputs;
    for (const harness::State &s : problem.states) {
        const auto vector = [](const std::vector<double> &x) {
            return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(x.data(), x.size()));
        };
        inputs.push_back({vector(s.q), swapped(vector(s.qd), model), swapped(vector(s.force), model)});
    }
    const auto method = [&](const char *name, pin::Convention convention) {
        const auto solve = [&, convention](const Input &x) { pin::aba(model, data, x.q, x.v, x.tau, convention); };
        const auto answer = [&, convention] {
            std::vector<std::vector<double>> rows;
            for (const Input &x : inputs) {
                const Eigen::VectorXd a = swapped(pin::aba(model, data, x.q, x.v, x.tau, convention), model);
                rows.emplace_back(a.data(), a.data() + a.size());
            }
            return harness::accelerations_json(rows);
        };
        return harness::Method{name,
                               "f64",
                               "forward dynamics",
                               "aba() from C++, headers compiled with -O3 -DNDEBUG",
                               harness::in_turn(inputs, problem.group, solve),
                               problem.group,
                               answer};
    };
    return harness::serve("Pinocchio " PINOCCHIO_VERSION, {method("pinocchio-local", pin::Convention::LOCAL),
                                                           method("pinocchio-world", pin::Convention::WORLD)});
}

int main(int argc, char **argv) {
    return harness::run(argc, argv, compare);
}
