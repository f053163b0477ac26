//! Assembly trees of every shape: complete, consistent, in few rounds.

#![expect(clippy::unwrap_used, reason = "a failed step of a test fails it")]

use proptest::prelude::*;
use vertebra_assembly::schedule::{Node, NodeId, Schedule, ScheduleOptions};
use vertebra_assembly::{BodyId, ModelError, Random, generate};

type Tree = Vec<Option<BodyId>>;

fn tree(count: usize, parent: impl Fn(usize) -> Option<usize>) -> Tree {
    let id = |index| BodyId(u32::try_from(index).unwrap());
    (0..count).map(|body| parent(body).map(id)).collect()
}

fn chain(count: usize) -> Tree {
    tree(count, |body| body.checked_sub(1))
}

fn star(count: usize) -> Tree {
    tree(count, |body| (body > 0).then_some(0))
}

/// Every body carries `branching` others.
fn full(count: usize, branching: usize) -> Tree {
    tree(count, |body| body.checked_sub(1).map(|k| k / branching))
}

/// A spine of which every body carries `legs` chains of `length`.
fn caterpillar(spine: usize, legs: usize, length: usize) -> Tree {
    tree(spine * (1 + legs * length), |body| {
        let Some(leg_body) = body.checked_sub(spine) else {
            return body.checked_sub(1);
        };
        if leg_body % length == 0 {
            Some(leg_body / (legs * length))
        } else {
            Some(body - 1)
        }
    })
}

fn random_tree(count: usize, reach: usize, seed: u64) -> Tree {
    let mut random = Random::new(seed);
    let parents: Vec<_> = (0..count)
        .map(|body| (body > 0).then(|| body - 1 - random.below(reach.min(body))))
        .collect();
    tree(count, |body| parents[body])
}

/// A chain of `stem` bodies that ends in two trees of the same kind, the second with `lighter`
/// percent of the bodies of the first: what defeats schedules that follow the heaviest child.
fn forked(count: usize, stem: usize, lighter: usize) -> Tree {
    let mut parents = Vec::with_capacity(count);
    // Bodies still to be placed below a parent.
    let mut open = vec![(None, count)];
    while let Some((mut parent, left)) = open.pop() {
        let here = left.min(stem);
        for _ in 0..here {
            parents.push(parent);
            parent = Some(parents.len() - 1);
        }
        let rest = left - here;
        let second = rest * lighter / (100 + lighter);
        for part in [second, rest - second] {
            if part > 0 {
                open.push((parent, part));
            }
        }
    }
    tree(parents.len(), |body| parents[body])
}

fn forest(sizes: &[usize], seed: u64) -> Tree {
    let mut parents = Vec::new();
    for (index, &size) in sizes.iter().enumerate() {
        let start = parents.len();
        let part = random_tree(size, 1 + index * 3, seed + index as u64);
        parents.extend(part.iter().map(|p| p.map(|p| start + p.index())));
    }
    tree(parents.len(), |body| parents[body])
}

/// Works the schedule through with masses for inertias and checks everything on the way: what is
/// read has been made in an earlier round and is used once, every body is assembled with all that
/// hangs from it, neighbours meet at the body they share, and no node has a third handle.
fn check(parents: &Tree, weights: &[f64], options: &ScheduleOptions) -> Schedule {
    let schedule = Schedule::of_tree(parents, weights, options).unwrap();
    let nodes = schedule.node_count();
    let mut mass = vec![0.0; nodes];
    let mut made_in = vec![usize::MAX; nodes];
    let mut uses = vec![0.0; nodes];
    // Cut bodies where a node ends, inboard and outboard; none at a path's head and tail.
    let mut ends = vec![[None; 2]; nodes];
    let mut covers = vec![0..0; nodes];
    let mut take = |node: NodeId, share: f64, round: usize, made_in: &[usize], mass: &[f64]| {
        assert!(made_in[node.index()] < round, "{node:?} in round {round}");
        uses[node.index()] += share;
        share * mass[node.index()]
    };
    for round in 0..schedule.round_count() {
        let mut done = Vec::new();
        for index in schedule.chunks_in(round) {
            let chunk = &schedule.chunks()[index];
            let mut sum = 0.0;
            let mut above: Option<BodyId> = None;
            for (body, share) in schedule.members(chunk) {
                if above.is_some() || chunk.head {
                    let carrier = parents[body.index()];
                    assert!(carrier == above || (above.is_none() && chunk.head));
                }
                above = Some(body);
                sum += share * weights[body.index()];
                assert!(schedule.rakes(body).len() <= 2);
                for &raked in schedule.rakes(body) {
                    assert_eq!(ends[raked.index()], [None; 2], "raked with a handle");
                    sum += take(raked, share, round, &made_in, &mass);
                }
            }
            let cuts = [schedule.inboard_cut(chunk), schedule.outboard_cut(chunk)];
            done.push((schedule.chunk_node(index), sum, cuts, chunk.joints()));
        }
        for index in schedule.joins_in(round) {
            let join = schedule.joins()[index];
            let [a, b] = [join.inboard.index(), join.outboard.index()];
            assert_eq!(
                (ends[a][1], ends[b][0]),
                (Some(join.cut), Some(join.cut)),
                "halves of two bodies"
            );
            assert_eq!(covers[a].end, covers[b].start, "neighbours");
            let sum = take(join.inboard, 1.0, round, &made_in, &mass)
                + take(join.outboard, 1.0, round, &made_in, &mass);
            let id = schedule.join_node(index);
            done.push((
                id,
                sum,
                [ends[a][0], ends[b][1]],
                covers[a].start..covers[b].end,
            ));
        }
        for index in schedule.sums_in(round) {
            let sum = schedule.sums()[index];
            let parts = sum.parts;
            let both = parts.map(|part| take(part, 1.0, round, &made_in, &mass));
            for part in parts {
                assert_eq!(ends[part.index()], [None; 2], "summed with a handle");
            }
            done.push((schedule.sum_node(index), both[0] + both[1], [None; 2], 0..0));
        }
        for (id, sum, cuts, range) in done {
            mass[id.index()] = sum;
            made_in[id.index()] = round;
            assert_eq!(schedule.round_of(id), Some(round));
            ends[id.index()] = cuts;
            covers[id.index()] = range;
        }
    }
    // Every path is assembled by its root; roots of paths that hang from the world are not used
    // any more, all else exactly once.
    for path in schedule.paths() {
        assert_eq!(covers[path.root.index()], path.bodies());
        let first = schedule.order()[path.bodies().start];
        assert_eq!(path.carrier, parents[first.index()]);
        if path.carrier.is_none() {
            uses[path.root.index()] += 1.0;
        }
    }
    assert!(uses.iter().all(|&uses| uses == 1.0));
    assert!(made_in.iter().all(|&round| round < schedule.round_count()));
    // All bodies, each once, and all of their mass.
    let mut seen = vec![false; parents.len()];
    for body in schedule.order() {
        assert!(!core::mem::replace(&mut seen[body.index()], true));
    }
    assert!(seen.into_iter().all(|seen| seen));
    let assembled: f64 = schedule
        .paths()
        .iter()
        .filter(|path| path.carrier.is_none())
        .map(|path| mass[path.root.index()])
        .sum();
    let total: f64 = weights.iter().sum();
    let rounding = 4.0 * f64::EPSILON * parents.len() as f64 * total;
    assert!(
        (assembled - total).abs() <= rounding,
        "{assembled} of {total}"
    );
    // Nothing in the window of a cut is more than twice as heavy as what was cut.
    for chunk in schedule.chunks() {
        if let Some(cut) = schedule.outboard_cut(chunk) {
            let start = chunk.joints().start;
            let path = schedule
                .paths()
                .partition_point(|path| path.bodies().end <= start);
            let last = schedule.paths()[path].bodies().end - 1;
            let shortest = (2 * options.window)
                .saturating_sub(options.longest_chunk)
                .max(1);
            let window = start + shortest - 1..(start + options.longest_chunk).min(last);
            let heaviest = schedule.order()[window]
                .iter()
                .fold(0.0_f64, |heaviest, body| {
                    heaviest.max(weights[body.index()])
                });
            assert!(weights[cut.index()] >= 0.5 * heaviest, "{cut:?} is light");
        }
    }
    // m chunks of a path are 2 m - 1 nodes.
    assert_eq!(
        schedule.joins().len(),
        schedule.chunks().len() - schedule.paths().len()
    );
    schedule
}

fn equal(parents: &Tree) -> Vec<f64> {
    vec![1.0; parents.len()]
}

fn varied(parents: &Tree, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed);
    let decades = |random: &mut Random| 10.0_f64.powf(2.0 * random.symmetric());
    parents.iter().map(|_| decades(&mut random)).collect()
}

fn families(n: usize) -> Vec<(String, Tree)> {
    let mut list = vec![
        ("chain".to_owned(), chain(n)),
        ("star".to_owned(), star(n)),
        ("binary".to_owned(), full(n, 2)),
        ("ternary".to_owned(), full(n, 3)),
        ("branching 100".to_owned(), full(n, 100)),
        ("caterpillar".to_owned(), caterpillar(n.div_ceil(2), 1, 1)),
        ("long legs".to_owned(), caterpillar(n.div_ceil(41), 2, 20)),
        ("comb of equals".to_owned(), {
            let side = n.isqrt().max(1);
            caterpillar(side, 1, side)
        }),
        (
            "forest".to_owned(),
            forest(&[n.div_ceil(2), 1, n.div_ceil(5), 2, 40], 3),
        ),
    ];
    for reach in [1, 2, 5, 50, n] {
        list.push((format!("random, reach {reach}"), random_tree(n, reach, 11)));
    }
    for stem in [1, 3, 13, 40] {
        for lighter in [100, 95, 88, 75, 50, 20] {
            let name = format!("forks of stem {stem}, {lighter} %");
            list.push((name, forked(n, stem, lighter)));
        }
    }
    list
}

#[test]
fn every_shape_is_assembled_completely_and_in_few_rounds() {
    let mut worst = (f64::NEG_INFINITY, String::new());
    for n in [1, 2, 3, 13, 100, 1000, 20_000] {
        for (name, parents) in families(n) {
            for window in [1, 2, 8, 30] {
                let options = ScheduleOptions::with_window(window);
                for weights in [equal(&parents), varied(&parents, 5)] {
                    let schedule = check(&parents, &weights, &options);
                    let over = schedule.round_count() as f64 - 2.0 * (parents.len() as f64).log2();
                    let label = format!("{name} of {}, window {window}", parents.len());
                    assert!(over <= 6.0, "{label}: {over} rounds more than 2 log2 n");
                    if over > worst.0 {
                        worst = (over, label);
                    }
                }
            }
        }
    }
    // The bound is near what happens.
    assert!(worst.0 > 0.0, "{worst:?}");
}

#[test]
fn chains_and_stars_take_one_logarithm() {
    for n in [64_usize, 1000, 4096, 100_000] {
        let log = n.next_power_of_two().ilog2() as usize;
        let options = ScheduleOptions::default();
        let chain = check(&chain(n), &vec![1.0; n], &options);
        assert!(chain.round_count() < log, "chain of {n}");
        let star = check(&star(n), &vec![1.0; n], &options);
        assert!(star.round_count() <= log + 2, "star of {n}");
    }
}

/// Windows of one: the classic tree, one joint a leaf.
#[test]
fn joint_by_joint() {
    let parents = chain(1024);
    let schedule = check(&parents, &equal(&parents), &ScheduleOptions::with_window(1));
    assert_eq!(schedule.chunks().len(), 1024);
    assert_eq!(schedule.node_count(), 2 * 1024 - 1);
    assert_eq!(schedule.round_count(), 11);
    assert!(schedule.chunks().iter().all(|c| c.joints().len() == 1));
}

#[test]
fn heavy_bodies_are_cut_and_chunks_are_not_too_long() {
    let parents = chain(5000);
    let options = ScheduleOptions::default();
    for seed in 0..10 {
        let mut weights = varied(&parents, seed);
        // Every eighth body has next to no mass.
        weights.iter_mut().step_by(8).for_each(|w| *w *= 1e-12);
        let schedule = check(&parents, &weights, &options);
        let mean = 5000.0 / schedule.chunks().len() as f64;
        assert!((6.0..10.0).contains(&mean), "{mean}");
        for chunk in schedule.chunks() {
            let joints = chunk.joints();
            assert!(joints.len() <= options.longest_chunk);
        }
    }
}

/// Nothing without mass is cut; a chunk grows instead.
#[test]
fn massless_bodies_are_not_cut() {
    let parents = chain(200);
    let mut weights = vec![0.0; 200];
    weights[60] = 1.0;
    weights[150] = 1.0;
    let schedule = check(&parents, &weights, &ScheduleOptions::default());
    let cuts: Vec<_> = schedule.joins().iter().map(|join| join.cut.0).collect();
    assert_eq!(schedule.chunks().len(), 3);
    assert!(cuts.contains(&60) && cuts.contains(&150));
}

#[test]
fn nothing_and_what_makes_no_sense() {
    let options = ScheduleOptions::default();
    let empty = Schedule::of_tree(&[], &[], &options).unwrap();
    assert_eq!((empty.node_count(), empty.round_count()), (0, 0));
    assert_eq!(empty.node(NodeId(0)), None);
    let bad = |parents: &Tree, weights: &[f64], options: &ScheduleOptions| {
        Schedule::of_tree(parents, weights, options).unwrap_err()
    };
    let two = chain(2);
    let parameter = |error: ModelError| match error {
        ModelError::BadParameter { parameter, .. } => parameter,
        other => unreachable!("{other}"),
    };
    let none = ScheduleOptions::with_window(0);
    assert_eq!(parameter(bad(&two, &[1.0; 2], &none)), "window");
    let short = ScheduleOptions {
        longest_chunk: 3,
        ..options
    };
    assert_eq!(parameter(bad(&two, &[1.0; 2], &short)), "longest_chunk");
    assert_eq!(parameter(bad(&two, &[1.0, -1.0], &options)), "weights");
    assert_eq!(parameter(bad(&two, &[1.0, f64::NAN], &options)), "weights");
    let turned = tree(2, |body| (body == 0).then_some(1));
    assert_eq!(parameter(bad(&turned, &[1.0; 2], &options)), "parents");
    assert!(matches!(
        bad(&two, &[1.0], &options),
        ModelError::WrongLength { .. }
    ));
}

/// Models have schedules, the same every time; printing and drawing show all of them.
#[test]
fn models_tables_and_pictures() {
    let rod = generate::Rod::default();
    let model = generate::tree(60, 2, &rod).unwrap();
    let schedule = Schedule::new(&model, &ScheduleOptions::with_window(3)).unwrap();
    let again = Schedule::new(&model, &ScheduleOptions::with_window(3)).unwrap();
    assert_eq!(schedule.to_string(), again.to_string());
    assert_eq!(
        schedule.to_string().lines().count(),
        2 + schedule.round_count()
    );
    let svg = schedule.to_svg();
    assert_eq!(svg, again.to_svg());
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    assert_eq!(svg.matches("<rect ").count(), schedule.chunks().len());
    assert_eq!(
        svg.matches("<circle ").count(),
        schedule.joins().len() + schedule.sums().len()
    );
    assert!(svg.matches("<line ").count() >= schedule.node_count() - 1);
    assert!(matches!(schedule.node(NodeId(0)), Some(Node::Chunk(_))));
}

/// Depth that recursion would not survive.
#[test]
fn large_trees() {
    for parents in [
        chain(300_000),
        star(300_000),
        caterpillar(60_000, 1, 4),
        random_tree(300_000, 300_000, 1),
    ] {
        check(&parents, &equal(&parents), &ScheduleOptions::default());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn random_trees(
        count in 1..400_usize,
        reach in 1..400_usize,
        window in 1..12_usize,
        slack in 0..12_usize,
        seed in any::<u64>(),
    ) {
        let parents = random_tree(count, reach, seed);
        let options = ScheduleOptions { window, longest_chunk: window + slack };
        let schedule = check(&parents, &varied(&parents, seed), &options);
        let longest = schedule.chunks().iter().map(|c| c.joints().len()).max();
        prop_assert!(longest <= Some(options.longest_chunk));
    }
}
