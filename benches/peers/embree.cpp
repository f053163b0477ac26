// Embree: rtcCollide over user geometry. It leaves the test of two triangles to its user: here that
// is CGAL's with exact predicates, or ours.
#include "harness.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <embree3/rtcore.h>

#include <tuple>

// benches/peers/exact-leaf: nine coordinates each.
extern "C" bool vertebra_triangles_intersect(const double *a, const double *b);

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using harness::Pairs;

struct Side {
    std::vector<Kernel::Triangle_3> triangles;
    std::vector<std::array<double, 9>> corners;
    std::vector<RTCBounds> bounds;

    explicit Side(const harness::Mesh &mesh) {
        const auto corner = [&](std::uint32_t i) {
            const auto &v = mesh.vertices[i];
            return Kernel::Point_3(v[0], v[1], v[2]);
        };
        for (const auto &t : mesh.triangles) {
            triangles.emplace_back(corner(t[0]), corner(t[1]), corner(t[2]));
            const auto &[u, v, w] = std::tie(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
            corners.push_back({u[0], u[1], u[2], v[0], v[1], v[2], w[0], w[1], w[2]});
            // The coordinates are single precision, so the boxes are exact.
            const auto box = triangles.back().bbox();
            RTCBounds b{};
            b.lower_x = float(box.xmin()), b.lower_y = float(box.ymin()), b.lower_z = float(box.zmin());
            b.upper_x = float(box.xmax()), b.upper_y = float(box.ymax()), b.upper_z = float(box.zmax());
            bounds.push_back(b);
        }
    }
};

static RTCScene build(RTCDevice device, const Side &side, RTCBuildQuality quality) {
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, quality);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, side.bounds.size());
    rtcSetGeometryUserData(geometry, const_cast<Side *>(&side));
    rtcSetGeometryBoundsFunction(
        geometry,
        [](const RTCBoundsFunctionArguments *arguments) {
            const Side &side = *static_cast<const Side *>(arguments->geometryUserPtr);
            *arguments->bounds_o = side.bounds[arguments->primID];
        },
        nullptr);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    return scene;
}

struct Search {
    const Side &a, &b;
    Pairs pairs;
    std::size_t candidates = 0;
};

using Leaf = bool (*)(const Side &a, unsigned i, const Side &b, unsigned j);

static bool cgal_leaf(const Side &a, unsigned i, const Side &b, unsigned j) {
    return CGAL::do_intersect(a.triangles[i], b.triangles[j]);
}

static bool vertebra_leaf(const Side &a, unsigned i, const Side &b, unsigned j) {
    return vertebra_triangles_intersect(a.corners[i].data(), b.corners[j].data());
}

template <Leaf leaf> static void query(RTCScene a, RTCScene b, Search &search) {
    search.pairs.clear();
    search.candidates = 0;
    rtcCollide(
        a, b,
        [](void *user, RTCCollision *collisions, unsigned count) {
            Search &search = *static_cast<Search *>(user);
            search.candidates += count;
            for (unsigned k = 0; k < count; ++k) {
                const auto i = collisions[k].primID0, j = collisions[k].primID1;
                if (leaf(search.a, i, search.b, j))
                    search.pairs.emplace_back(i, j);
            }
        },
        &search);
}

static int compare(const std::string &folder) {
    const Side a(harness::read_obj(folder + "/a.obj")), b(harness::read_obj(folder + "/b.obj"));
    RTCDevice device = rtcNewDevice("threads=1");
    Search search{a, b, {}, 0};
    const auto answer = [&] { return harness::pairs_json(search.pairs); };
    struct Test {
        const char *ending, *note;
        void (*query)(RTCScene, RTCScene, Search &);
    };
    const Test tests[] = {{"", "CGAL do_intersect with exact predicates", query<cgal_leaf>},
                          {"-our-leaf", "vertebra's exact test", query<vertebra_leaf>}};
    std::vector<harness::Method> methods;
    for (const auto &[quality, name] : {std::pair{RTC_BUILD_QUALITY_MEDIUM, "embree"},
                                        std::pair{RTC_BUILD_QUALITY_LOW, "embree-low"}}) {
        const RTCScene scene_a = build(device, a, quality), scene_b = build(device, b, quality);
        for (const Test &test : tests) {
            test.query(scene_a, scene_b, search);
            const std::string note = "rtcCollide finds " + std::to_string(search.candidates) +
                                     " pairs of boxes; leaf: " + test.note;
            methods.push_back({std::string(name) + test.ending + "-total", "-", "total", note,
                               [&, quality = quality, query = test.query] {
                                   const RTCScene scene_a = build(device, a, quality);
                                   const RTCScene scene_b = build(device, b, quality);
                                   query(scene_a, scene_b, search);
                                   rtcReleaseScene(scene_a), rtcReleaseScene(scene_b);
                               },
                               1, answer});
            methods.push_back({std::string(name) + test.ending + "-query", "-", "query", note,
                               [&, scene_a, scene_b, query = test.query] { query(scene_a, scene_b, search); }, 1,
                               answer});
        }
    }
    return harness::serve("Embree " RTC_VERSION_STRING, methods);
}

int main(int argc, char **argv) {
    return harness::run(argc, argv, compare);
}
