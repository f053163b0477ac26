// CGAL: triangles of one mesh against the AABB tree of the other, and sweeping of boxes; both with
// exact predicates.
#include "harness.hpp"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/version.h>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangle = Kernel::Triangle_3;
using Triangles = std::vector<Triangle>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
using harness::Pairs;

static Triangles triangles(const harness::Mesh &mesh) {
    Triangles list;
    list.reserve(mesh.triangles.size());
    const auto corner = [&](std::uint32_t i) {
        const auto &v = mesh.vertices[i];
        return Kernel::Point_3(v[0], v[1], v[2]);
    };
    for (const auto &t : mesh.triangles)
        list.emplace_back(corner(t[0]), corner(t[1]), corner(t[2]));
    return list;
}

static void build(Tree &tree, const Triangles &list) {
    tree.rebuild(list.begin(), list.end());
    tree.build();
}

// Queries the tree over `trees` with every triangle of `queries`.
static void query(const Tree &tree, const Triangles &trees, const Triangles &queries, bool swapped, Pairs &pairs) {
    pairs.clear();
    std::vector<Tree::Primitive_id> found;
    for (std::uint32_t i = 0; i < queries.size(); ++i) {
        found.clear();
        tree.all_intersected_primitives(queries[i], std::back_inserter(found));
        for (auto it : found) {
            const auto j = static_cast<std::uint32_t>(it - trees.begin());
            swapped ? pairs.emplace_back(j, i) : pairs.emplace_back(i, j);
        }
    }
}

using Box = CGAL::Box_intersection_d::Box_with_handle_d<double, 3, Triangles::const_iterator>;

static void sweep(const Triangles &a, const Triangles &b, Pairs &pairs) {
    pairs.clear();
    const auto boxes = [](const Triangles &list) {
        std::vector<Box> boxes;
        boxes.reserve(list.size());
        for (auto it = list.begin(); it != list.end(); ++it)
            boxes.emplace_back(it->bbox(), it);
        return boxes;
    };
    auto boxes_a = boxes(a), boxes_b = boxes(b);
    CGAL::box_intersection_d(boxes_a.begin(), boxes_a.end(), boxes_b.begin(), boxes_b.end(),
                             [&](const Box &x, const Box &y) {
                                 if (CGAL::do_intersect(*x.handle(), *y.handle()))
                                     pairs.emplace_back(x.handle() - a.begin(), y.handle() - b.begin());
                             });
}

static int compare(const std::string &folder) {
    const Triangles a = triangles(harness::read_obj(folder + "/a.obj"));
    const Triangles b = triangles(harness::read_obj(folder + "/b.obj"));
    Tree tree_a, tree_b, tree;
    build(tree_a, a), build(tree_b, b);
    Pairs pairs;
    const auto answer = [&] { return harness::pairs_json(pairs); };
    const std::string kernel = "exact predicates (EPICK)";
    return harness::serve(
        "CGAL " CGAL_VERSION_STR,
        {
            {"cgal-tree-a-total", "-", "total", kernel + "; tree over A, queried with every triangle of B",
             [&] { build(tree, a), query(tree, a, b, true, pairs); }, 1, answer},
            {"cgal-tree-b-total", "-", "total", kernel + "; tree over B, queried with every triangle of A",
             [&] { build(tree, b), query(tree, b, a, false, pairs); }, 1, answer},
            {"cgal-boxes-total", "-", "total", kernel + "; box_intersection_d, then do_intersect",
             [&] { sweep(a, b, pairs); }, 1, answer},
            {"cgal-tree-a-query", "-", "query", kernel + "; tree over A built before",
             [&] { query(tree_a, a, b, true, pairs); }, 1, answer},
            {"cgal-tree-b-query", "-", "query", kernel + "; tree over B built before",
             [&] { query(tree_b, b, a, false, pairs); }, 1, answer},
        });
}

int main(int argc, char **argv) {
    return harness::run(argc, argv, compare);
}
