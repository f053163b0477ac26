// The C++ side of a comparison: a program that is asked on its standard input and answers on its
// standard output, a line of JSON each. docs/peers.md describes the lines.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace harness {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

// What is timed, and what it found.
struct Method {
    std::string name;
    std::string precision;
    // Methods of one stage answer the same question from the same starting point.
    std::string stage;
    std::string note;
    // One sample: `problems` problems solved.
    std::function<void()> call;
    int problems = 1;
    // The result of the latest call as JSON.
    std::function<std::string()> answer;
};

inline std::string pairs_json(const Pairs &pairs) {
    std::ostringstream text;
    text << "{\"pairs\":[";
    const char *comma = "";
    for (const auto &[a, b] : pairs) {
        text << comma << '[' << a << ',' << b << ']';
        comma = ",";
    }
    text << "]}";
    return text.str();
}

inline std::string accelerations_json(const std::vector<std::vector<double>> &rows) {
    std::ostringstream text;
    text.precision(std::numeric_limits<double>::max_digits10);
    text << "{\"accelerations\":[";
    for (std::size_t i = 0; i < rows.size(); ++i) {
        text << (i ? ",[" : "[");
        for (std::size_t k = 0; k < rows[i].size(); ++k)
            text << (k ? "," : "") << rows[i][k];
        text << ']';
    }
    text << "]}";
    return text.str();
}

// Seconds of the calls that fit into `budget`, one at least, after one that fills the caches.
inline std::vector<double> sample(const Method &method, double budget) {
    using Clock = std::chrono::steady_clock;
    const auto seconds = [](Clock::duration d) { return std::chrono::duration<double>(d).count(); };
    method.call();
    std::vector<double> samples;
    const auto start = Clock::now();
    do {
        const auto before = Clock::now();
        method.call();
        samples.push_back(seconds(Clock::now() - before) / method.problems);
    } while (seconds(Clock::now() - start) < budget);
    return samples;
}

// Answers until the input ends.
inline int serve(const std::string &peer, const std::vector<Method> &methods) {
    std::cout << "{\"peer\":\"" << peer << "\",\"methods\":[";
    for (std::size_t i = 0; i < methods.size(); ++i) {
        const Method &m = methods[i];
        std::cout << (i ? "," : "") << "{\"name\":\"" << m.name << "\",\"precision\":\"" << m.precision
                  << "\",\"stage\":\"" << m.stage << "\",\"note\":\"" << m.note << "\"}";
    }
    std::cout << "]}" << std::endl;
    std::string verb;
    std::size_t index;
    while (std::cin >> verb >> index) {
        if (index >= methods.size())
            throw std::runtime_error("asked for a method that is not there");
        const Method &method = methods[index];
        if (verb == "time") {
            double budget;
            std::cin >> budget;
            std::cout << '[';
            const char *comma = "";
            for (double s : sample(method, budget)) {
                std::cout << comma << s;
                comma = ",";
            }
            std::cout << ']' << std::endl;
        } else {
            method.call();
            std::cout << method.answer() << std::endl;
        }
    }
    return 0;
}

// Runs a program on the folder it is given. What goes wrong is one line, and exit status 1.
inline int run(int argc, char **argv, int (*compare)(const std::string &folder)) {
    if (argc != 2) {
        std::cerr << "usage: " << (argc > 0 ? argv[0] : "peer") << " FOLDER" << std::endl;
        return 1;
    }
    try {
        return compare(argv[1]);
    } catch (const std::exception &error) {
        std::cerr << argv[0] << ": " << error.what() << std::endl;
        return 1;
    }
}

struct Mesh {
    std::vector<std::array<double, 3>> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Reads `v x y z` and `f a b c` lines.
inline Mesh read_obj(const std::string &path) {
    std::ifstream file(path);
    if (!file)
        throw std::runtime_error("cannot read " + path);
    Mesh mesh;
    std::string kind;
    while (file >> kind) {
        if (kind == "v") {
            std::array<double, 3> v;
            file >> v[0] >> v[1] >> v[2];
            mesh.vertices.push_back(v);
        } else {
            std::array<std::uint32_t, 3> t{};
            file >> t[0] >> t[1] >> t[2];
            for (std::uint32_t &vertex : t)
                if (--vertex >= mesh.vertices.size())
                    throw std::runtime_error(path + ": a triangle of a vertex that is not there");
            mesh.triangles.push_back(t);
        }
        if (!file)
            throw std::runtime_error(path + ": `" + kind + "` is not followed by three numbers");
    }
    return mesh;
}

struct Body {
    int parent; // -1: the world
    std::string joint; // "revolute" or "free"
    std::array<double, 3> axis, position;
    std::array<double, 4> rotation; // x, y, z, w
    double mass;
    std::array<double, 3> center;
    std::array<double, 6> inertia; // about the centre of mass: xx, yy, zz, xy, xz, yz
};

struct State {
    std::vector<double> q, qd, force;
};

// An articulated model and the states it is solved in. A free joint has q = position, quaternion
// x, y, z, w; qd and force = angular, linear in the axes of the body.
struct Problem {
    std::array<double, 3> gravity;
    std::vector<Body> bodies;
    std::vector<State> states;
    // How many of the states make a sample.
    int group;
};

// What solves the next `group` inputs, and begins again after the last.
template <typename Inputs, typename Solve> std::function<void()> in_turn(const Inputs &inputs, int group, Solve solve) {
    return [&inputs, group, solve, next = std::size_t(0)]() mutable {
        for (int k = 0; k < group; ++k) {
            solve(inputs[next]);
            next = (next + 1) % inputs.size();
        }
    };
}

inline Problem read_problem(const std::string &path) {
    std::ifstream file(path);
    if (!file)
        throw std::runtime_error("cannot read " + path);
    const auto numbers = [&](auto &list) {
        for (double &x : list)
            file >> x;
    };
    Problem problem;
    numbers(problem.gravity);
    std::size_t bodies, states, positions, freedoms;
    file >> bodies;
    problem.bodies.resize(bodies);
    for (Body &b : problem.bodies) {
        file >> b.parent >> b.joint;
        numbers(b.axis), numbers(b.position), numbers(b.rotation);
        file >> b.mass;
        numbers(b.center), numbers(b.inertia);
    }
    file >> states >> positions >> freedoms >> problem.group;
    problem.states.resize(states);
    for (State &s : problem.states) {
        s.q.resize(positions), s.qd.resize(freedoms), s.force.resize(freedoms);
        numbers(s.q), numbers(s.qd), numbers(s.force);
    }
    if (!file)
        throw std::runtime_error(path + " ends early");
    return problem;
}

} // namespace harness
