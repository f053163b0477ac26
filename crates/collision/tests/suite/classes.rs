//! The class of a pair against the dimension of the intersection in exact arithmetic.

use crate::support::{Exact, ORDERS, Random, Rational, Triangle, decompose, gold_mesh, rational};
use glam::DVec3;
use num_bigint::BigInt;
use num_traits::{FromPrimitive, Signed, ToPrimitive};
use vertebra_collision::exact::{classify, triangles_intersect};
use vertebra_collision::{Method, PairClass, Query, QueryError, TriangleMesh};

/// Brings a matrix to echelon form without fractions (Bareiss); returns the pivot columns.
fn echelon<T: Clone + Signed>(rows: &mut [Vec<T>]) -> Vec<usize> {
    let columns = rows.first().map_or(0, Vec::len);
    let mut pivots = Vec::new();
    let mut previous = T::one();
    for column in 0..columns {
        let done = pivots.len();
        let Some(found) = (done..rows.len()).find(|&r| !rows[r][column].is_zero()) else {
            continue;
        };
        rows.swap(done, found);
        let pivot = rows[done].clone();
        for (r, row) in rows.iter_mut().enumerate() {
            if r != done {
                let factor = row[column].clone();
                for (entry, p) in row.iter_mut().zip(&pivot) {
                    let product =
                        entry.clone() * pivot[column].clone() - factor.clone() * p.clone();
                    *entry = product / previous.clone();
                }
            }
        }
        previous = pivot[column].clone();
        pivots.push(column);
    }
    pivots
}

/// Points whose hull is the intersection of two hulls, in homogeneous coordinates: what the vertices of the polytope
/// { l, m >= 0, sum l = sum m = 1, sum l a = sum m b } map to. They are its members whose positive weights belong to
/// independent columns.
fn spanning_points<T: Clone + Ord + Signed>(a: &[[T; 3]; 3], b: &[[T; 3]; 3]) -> Vec<Vec<T>> {
    let column = |c: usize| -> Vec<T> {
        let (one, zero) = (T::one(), T::zero());
        if c < 3 {
            a[c].iter().cloned().chain([one, zero]).collect()
        } else {
            let negated = b[c - 3].iter().map(|x| -x.clone());
            negated.chain([zero, one]).collect()
        }
    };
    let columns: Vec<Vec<T>> = (0..6).map(column).collect();
    let mut points: Vec<Vec<T>> = Vec::new();
    for subset in 1_u32..64 {
        let chosen: Vec<usize> = (0..6).filter(|c| subset >> c & 1 == 1).collect();
        let mut rows: Vec<Vec<T>> = (0..5)
            .map(|r| {
                let right = if r < 3 { T::zero() } else { T::one() };
                let left = chosen.iter().map(|&c| columns[c][r].clone());
                left.chain([right]).collect()
            })
            .collect();
        let pivots = echelon(&mut rows);
        // Independent columns, and no contradiction in the last one.
        if pivots.len() != chosen.len() || pivots.last() == Some(&chosen.len()) {
            continue;
        }
        // After the elimination all pivots are one and the same number, the common denominator.
        let denominator = rows[0][pivots[0]].clone();
        let sign = denominator.signum();
        let weights: Vec<T> = rows[..chosen.len()]
            .iter()
            .map(|row| row[chosen.len()].clone() * sign.clone())
            .collect();
        if weights.iter().any(|w| w.is_negative()) {
            continue;
        }
        let mut point = vec![T::zero(); 4];
        for (&c, weight) in chosen.iter().zip(&weights) {
            if c < 3 {
                for k in 0..3 {
                    point[k] = point[k].clone() + weight.clone() * a[c][k].clone();
                }
                point[3] = point[3].clone() + weight.clone();
            }
        }
        points.push(point);
    }
    points
}

/// The same for `f64` points, each exactly and rounded.
pub(crate) fn meeting_points(a: &Triangle, b: &Triangle) -> Vec<(Exact, DVec3)> {
    let numbers = || a.iter().chain(b).flat_map(|p| p.to_array());
    let exponents = numbers().filter(|&x| x != 0.0).map(|x| decompose(x).1);
    let lowest = exponents.min().unwrap_or(0);
    let integer = |x: f64| {
        let (mantissa, exponent) = decompose(x);
        let shift = if x == 0.0 { 0 } else { exponent - lowest };
        BigInt::from(mantissa) << shift
    };
    let integers = |t: &Triangle| t.map(|p| p.to_array().map(integer));
    let unit = rational(2.0_f64.powi(lowest));
    let point = |p: Vec<BigInt>| {
        let affine = [0, 1, 2].map(|k| Rational::new(p[k].clone(), p[3].clone()) * &unit);
        let rounded = affine.each_ref().map(|x| {
            // Both shortened alike, so that they fit.
            let shift = x.denom().bits().saturating_sub(900);
            let short = |n: &BigInt| (n >> shift).to_f64().unwrap();
            short(x.numer()) / short(x.denom())
        });
        (affine, DVec3::from(rounded))
    };
    spanning_points(&integers(a), &integers(b))
        .into_iter()
        .map(point)
        .collect()
}

/// The dimension of the intersection of two hulls.
fn dimension<T: Clone + Ord + Signed>(a: &[[T; 3]; 3], b: &[[T; 3]; 3]) -> Option<usize> {
    let mut points = spanning_points(a, b);
    // In homogeneous coordinates, n + 1 independent points span n dimensions.
    (!points.is_empty()).then(|| echelon(&mut points).len() - 1)
}

/// Whether each triangle has corners strictly on both sides of the other's plane.
fn crossing<T: Clone + Ord + Signed>(a: &[[T; 3]; 3], b: &[[T; 3]; 3]) -> bool {
    let both = |t: &[[T; 3]; 3], points: &[[T; 3]; 3]| {
        let minus = |p: &[T; 3]| [0, 1, 2].map(|k| p[k].clone() - t[0][k].clone());
        let (u, v) = (minus(&t[1]), minus(&t[2]));
        let side = |p: &[T; 3]| {
            let w = minus(p);
            (0..3).fold(T::zero(), |sum, k| {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                let minor = u[i].clone() * v[j].clone() - u[j].clone() * v[i].clone();
                sum + minor * w[k].clone()
            })
        };
        let sides = [0, 1, 2].map(|i| side(&points[i]));
        sides.iter().any(|s| s.is_positive()) && sides.iter().any(|s| s.is_negative())
    };
    both(a, b) && both(b, a)
}

fn expected<T: Clone + Ord + Signed>(a: &[[T; 3]; 3], b: &[[T; 3]; 3]) -> Option<PairClass> {
    Some(match dimension(a, b)? {
        0 => PairClass::Point,
        1 if crossing(a, b) => PairClass::Crossing,
        1 => PairClass::Touching,
        _ => PairClass::Area,
    })
}

/// How often a class was seen.
fn tally(counts: &mut [usize; 5], class: Option<PairClass>) {
    counts[class.map_or(4, |class| class as usize)] += 1;
}

#[test]
fn small_lattice() {
    let mut random = Random::new(31);
    let mut counts = [0; 5];
    for _ in 0..10_000 {
        let (a, b) = (random.lattice_triangle(0, 2), random.lattice_triangle(0, 2));
        let integers = |t: Triangle| t.map(|p| p.to_array().map(|x| x as i128));
        let class = expected(&integers(a), &integers(b));
        assert_eq!(classify(&a, &b), class, "{a:?} {b:?}");
        assert_eq!(classify(&b, &a), class, "{b:?} {a:?}");
        tally(&mut counts, class);
    }
    assert!(counts.iter().all(|&count| count > 30), "{counts:?}");
}

/// In one plane, where everything but points and areas is rare otherwise.
#[test]
fn coplanar_lattice() {
    let mut random = Random::new(32);
    let mut counts = [0; 5];
    for _ in 0..4000 {
        let mut flat = || {
            random
                .lattice_triangle(-2, 2)
                .map(|p| DVec3::new(p.x, p.y, p.x + 2.0 * p.y))
        };
        let (a, b) = (flat(), flat());
        let integers = |t: Triangle| t.map(|p| p.to_array().map(|x| x as i128));
        let class = expected(&integers(a), &integers(b));
        assert_eq!(classify(&a, &b), class, "{a:?} {b:?}");
        tally(&mut counts, class);
    }
    let [point, touching, _, area, none] = counts;
    assert!(
        [point, touching, area, none].iter().all(|&c| c > 100),
        "{counts:?}"
    );
}

/// Relabelling changes nothing, and the class exists iff the triangles meet, on points far from any lattice.
#[test]
fn nearly_touching() {
    let mut random = Random::new(33);
    let mut counts = [0; 5];
    for _ in 0..1500 {
        let a: Triangle = [(); 3].map(|()| random.point().as_dvec3());
        let mut b: Triangle = [(); 3].map(|()| random.point().as_dvec3());
        match random.int(0, 3) {
            0 => b[0] = a[0],
            1 => (b[0], b[1]) = (a[0], a[1]),
            2 => b[0] = ((a[0] + a[1] + a[2]) / 3.0).as_vec3().as_dvec3(),
            _ => {}
        }
        let integers = |t: &Triangle| {
            t.map(|p| {
                p.to_array().map(|x| {
                    let (mantissa, exponent) = decompose(x);
                    let shift = if x == 0.0 { 0 } else { exponent + 200 };
                    BigInt::from_i64(mantissa).unwrap() << shift
                })
            })
        };
        let class = expected(&integers(&a), &integers(&b));
        for order in ORDERS {
            let a = order.map(|i| a[i]);
            assert_eq!(classify(&a, &b), class, "{a:?} {b:?}");
            assert_eq!(classify(&b, &a), class, "{b:?} {a:?}");
        }
        assert_eq!(triangles_intersect(&a, &b), class.is_some());
        tally(&mut counts, class);
    }
    let [point, touching, crossing, _, none] = counts;
    assert!(
        [point, touching, crossing, none].iter().all(|&c| c > 30),
        "{counts:?}"
    );
}

#[test]
fn classified_pairs_are_the_pairs() {
    let (a, b) = (gold_mesh("sphere"), gold_mesh("cylinder"));
    let query = Query::new(&a, &b);
    let classified = query.classified().unwrap();
    let pairs: Vec<[u32; 2]> = classified.iter().map(|pair| [pair.a, pair.b]).collect();
    assert_eq!(pairs, query.pairs().unwrap());
    assert_eq!(query.clone().threads(0).classified().unwrap(), classified);
    let crossing = classified
        .iter()
        .filter(|pair| pair.class == PairClass::Crossing);
    assert!(crossing.count() * 2 > pairs.len());
    // A mesh on itself: every triangle covers itself, and neighbours share edges and corners.
    let itself = Query::new(&b, &b).classified().unwrap();
    for pair in &itself {
        assert_eq!(pair.class == PairClass::Area, pair.a == pair.b, "{pair:?}");
    }
    assert!(itself.iter().any(|pair| pair.class == PairClass::Touching));
    let moller = query.method(Method::MOLLER).classified();
    assert_eq!(moller, Err(QueryError::NotExact));
    assert!(QueryError::NotExact.to_string().contains("Method::Exact"));
}

/// The dimension of each class, and one triangle on itself.
#[test]
fn dimensions() {
    let classes = [
        PairClass::Point,
        PairClass::Touching,
        PairClass::Crossing,
        PairClass::Area,
    ];
    assert_eq!(classes.map(PairClass::dimension), [0, 1, 1, 2]);
    let tile = TriangleMesh::new(
        vec![glam::Vec3::ZERO, glam::Vec3::X, glam::Vec3::Y],
        vec![[0, 1, 2]],
    );
    let tile = tile.unwrap();
    let pairs = Query::new(&tile, &tile).classified().unwrap();
    assert_eq!(pairs.len(), 1);
    assert_eq!(pairs[0].class, PairClass::Area);
}
