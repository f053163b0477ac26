//! Algebraic identities of the spatial types, in both precisions, against plain 6 x 6 matrices.

use proptest::prelude::*;
use vertebra_spatial::{
    ArticulatedInertia, Force, Mat3, Motion, Quat, Real, RigidInertia, SmallCholesky, Sym3,
    Transform, Vec3, rotation_vector_rate, vec3,
};

type M6<T> = [[T; 6]; 6];

fn v3<T: Real>(a: [f64; 3]) -> Vec3<T> {
    vec3(T::from_f64(a[0]), T::from_f64(a[1]), T::from_f64(a[2]))
}

fn flat<T: Real>(angular: Vec3<T>, linear: Vec3<T>) -> [f64; 6] {
    let (a, l) = (angular.to_glam(), linear.to_glam());
    [a.x, a.y, a.z, l.x, l.y, l.z]
}

/// |a - b| <= tolerance for every component.
fn assert_close(a: [f64; 6], b: [f64; 6], tolerance: f64) {
    for k in 0..6 {
        assert!(
            (a[k] - b[k]).abs() <= tolerance,
            "component {k}: {} and {} differ by more than {tolerance:e}",
            a[k],
            b[k]
        );
    }
}

fn triple(range: f64) -> impl Strategy<Value = [f64; 3]> {
    [-range..range, -range..range, -range..range]
}

/// A physical inertia: points of mass at random places.
fn body<T: Real>(points: &[[f64; 3]; 4]) -> RigidInertia<T> {
    let mut sum = RigidInertia::ZERO;
    for &p in points {
        sum += RigidInertia::from_center(T::ONE, v3(p), Sym3::ZERO);
    }
    sum
}

fn dense<T: Real>(inertia: RigidInertia<T>) -> M6<T> {
    M6::from(&ArticulatedInertia::from(inertia))
}

fn check<T: Real>(
    w: [f64; 3],
    v: [f64; 3],
    n: [f64; 3],
    f: [f64; 3],
    r: [f64; 3],
    points: &[[f64; 3]; 4],
) {
    let eps = T::EPSILON.to_f64();
    let motion = Motion::<T>::new(v3(w), v3(v));
    let force = Force::<T>::new(v3(n), v3(f));
    let r = v3::<T>(r);
    // Components are below 4: products of k of them, a few dozen terms each, below 64 * 4^k.
    let tolerance = |k: i32| 64.0 * 4.0_f64.powi(k) * eps;

    // Power does not depend on the origin: (X m).f = m.(X' f).
    let here = motion.shifted(r).dot(force).to_f64();
    let there = motion.dot(force.shifted_back(r)).to_f64();
    assert!((here - there).abs() <= tolerance(3));

    // A transform's motion and force maps are dual, its inverse undoes it, composition composes.
    let turn = Transform {
        rotation: Quat::exp(v3(n)).to_matrix(),
        translation: r,
    };
    let power = turn.motion(motion).dot(turn.force(force)).to_f64();
    assert!((power - motion.dot(force).to_f64()).abs() <= tolerance(4));
    let back = turn.inverse().motion(turn.motion(motion));
    assert_close(
        flat(back.angular, back.linear),
        flat(motion.angular, motion.linear),
        tolerance(3),
    );
    let twice = (turn * turn).motion(motion);
    let steps = turn.motion(turn.motion(motion));
    assert_close(
        flat(twice.angular, twice.linear),
        flat(steps.angular, steps.linear),
        tolerance(3),
    );

    // Inertia: rigid, articulated and dense products agree, and so do their shifts.
    let rigid = body::<T>(points);
    let articulated = ArticulatedInertia::from(rigid);
    let (a, b) = (rigid.mul(motion), articulated.mul(motion));
    assert_close(
        flat(a.angular, a.linear),
        flat(b.angular, b.linear),
        tolerance(3),
    );
    let definition = articulated.mul(motion.shifted(r)).shifted_back(r);
    let shifted = articulated.shifted_back(r).mul(motion);
    assert_close(
        flat(definition.angular, definition.linear),
        flat(shifted.angular, shifted.linear),
        tolerance(5),
    );
    let trace = articulated.shifted_back(r).angular.trace() - articulated.shifted_angular_trace(r);
    assert!(trace.to_f64().abs() <= tolerance(4));
    let moved = rigid.shifted_back(r).mul(motion);
    assert_close(
        flat(definition.angular, definition.linear),
        flat(moved.angular, moved.linear),
        tolerance(5),
    );
    // Momentum of the points one by one.
    let mut momentum = Force::<T>::ZERO;
    for &p in points {
        let velocity = motion.linear + motion.angular.cross(v3(p));
        momentum += Force::new(v3::<T>(p).cross(velocity), velocity);
    }
    assert_close(
        flat(a.angular, a.linear),
        flat(momentum.angular, momentum.linear),
        tolerance(4),
    );

    // The bias is the force on points that only turn: m w x (w x p), summed.
    let mut centripetal = Force::<T>::ZERO;
    for &p in points {
        let p = v3::<T>(p);
        let a = motion.angular.cross(motion.angular.cross(p));
        centripetal += Force::new(p.cross(a), a);
    }
    let bias = rigid.bias(motion.angular);
    assert_close(
        flat(bias.angular, bias.linear),
        flat(centripetal.angular, centripetal.linear),
        tolerance(5),
    );

    // Duality of the cross products: (v x m).f = -m.(v x* f).
    let other = Motion::<T>::new(v3(f), v3(w));
    let left = other.cross(motion).dot(force).to_f64();
    let right = -motion.dot(other.cross_force(force)).to_f64();
    assert!((left - right).abs() <= tolerance(4));

    // Rotated tensors: R I R' applied to R v is R (I v).
    let rotation = turn.rotation;
    let rotated = rotation * (rigid.rotational * motion.angular);
    let tensor = rigid.rotational.rotated(&rotation) * (rotation * motion.angular);
    assert_close(
        flat(rotated, Vec3::ZERO),
        flat(tensor, Vec3::ZERO),
        tolerance(4),
    );

    // Rank-one downdate: (IA - U U' s) m = IA m - U s (U.m).
    let mut downdated = articulated;
    downdated.subtract_outer(force, T::HALF);
    let direct = articulated.mul(motion) - force * (T::HALF * motion.dot(force));
    let product = downdated.mul(motion);
    assert_close(
        flat(direct.angular, direct.linear),
        flat(product.angular, product.linear),
        tolerance(4),
    );
}

proptest! {
    #[test]
    fn identities_hold(
        w in triple(2.0), v in triple(2.0), n in triple(2.0), f in triple(2.0), r in triple(2.0),
        points in [triple(2.0), triple(2.0), triple(2.0), triple(2.0)],
    ) {
        check::<f64>(w, v, n, f, r, &points);
        check::<f32>(w, v, n, f, r, &points);
    }

    /// exp and log undo each other below a half turn, for angles from 1e-300 up.
    #[test]
    fn quaternion_exp_and_log(direction in triple(1.0), exponent in -300.0..0.49_f64) {
        let d = v3::<f64>(direction);
        prop_assume!(d.length() > 1e-3);
        let r = d * (10.0_f64.powf(exponent) / d.length());
        let back = Quat::exp(r).log();
        prop_assert!((back - r).length() <= 8.0 * f64::EPSILON * r.length());
        prop_assert!((Quat::exp(r).length() - 1.0).abs() <= 4.0 * f64::EPSILON);
    }

    /// Products of quaternions are products of matrices.
    #[test]
    fn quaternion_product(a in triple(3.0), b in triple(3.0), p in triple(1.0)) {
        let (qa, qb) = (Quat::exp(v3::<f64>(a)), Quat::exp(v3::<f64>(b)));
        let direct = (qa * qb).to_matrix() * v3(p);
        let steps = qa.to_matrix() * (qb.to_matrix() * v3(p));
        prop_assert!((direct - steps).length() <= 64.0 * f64::EPSILON);
    }

    /// exp of a twist in k pieces is exp of the whole, and a pure rotation turns about its point.
    #[test]
    fn twist_exponential(w in triple(2.0), v in triple(2.0), exponent in -12.0..0.0_f64) {
        let scale = 10.0_f64.powf(exponent);
        let whole = Transform::exp(Motion::<f64>::new(v3(w), v3(v)) * scale);
        let mut pieces = Transform::IDENTITY;
        for _ in 0..8 {
            pieces = pieces * Transform::exp(Motion::<f64>::new(v3(w), v3(v)) * (scale / 8.0));
        }
        let gap = (whole.translation - pieces.translation).length();
        prop_assert!(gap <= 64.0 * f64::EPSILON * scale * 8.0, "{gap:e}");
        let turned = (whole.rotation * v3([1.0, 0.0, 0.0]) - pieces.rotation * v3([1.0, 0.0, 0.0])).length();
        prop_assert!(turned <= 64.0 * f64::EPSILON);
    }

    /// The rate of the rotation vector against a difference quotient of exp(u) itself.
    #[test]
    fn rotation_vector_rate_matches_difference(u in triple(1e-2), w in triple(1.0)) {
        let (u, w) = (v3::<f64>(u), v3::<f64>(w));
        let h = 1e-5;
        // exp(u(t + h)) = exp(u) exp(w h) to first order; central difference.
        let after = (Quat::exp(u) * Quat::exp(w * h)).log();
        let before = (Quat::exp(u) * Quat::exp(w * -h)).log();
        let difference = (after - before) * (0.5 / h);
        // h^2 from the quotient, eps/h from rounding, |u|^4 from the truncated series.
        let tolerance = 4.0 * (h * h + f64::EPSILON / h + u.length_squared() * u.length_squared());
        prop_assert!((difference - rotation_vector_rate(u, w)).length() <= tolerance);
    }

    /// Solving with the factors of a random symmetric positive definite matrix.
    #[test]
    fn small_cholesky(entries in proptest::collection::vec(-1.0..1.0_f64, 36), b in [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0, -1.0..1.0], order in 1..=6_usize) {
        let mut d = [[0.0; 6]; 6];
        for i in 0..6 {
            for j in 0..6 {
                d[i][j] = (0..6).map(|k| entries[6 * i + k] * entries[6 * j + k]).sum();
            }
            d[i][i] += 0.1;
        }
        let factor = SmallCholesky::factor(order, &d, &[0.0; 6]).expect("positive definite");
        let mut x = b;
        factor.solve(&mut x);
        for i in 0..order {
            let product: f64 = (0..order).map(|k| d[i][k] * x[k]).sum();
            // Entries below 7, solution below |b| / 0.1.
            prop_assert!((product - b[i]).abs() <= 64.0 * f64::EPSILON * 7.0 * 10.0 * 6.0);
        }
    }
}

#[test]
fn dense_matrix_is_symmetric_and_reproduces_the_product() {
    let inertia = body::<f64>(&[[1.0, 2.0, 3.0], [0.0, -1.0, 0.5], [0.2, 0.0, 1.0], [0.0; 3]]);
    let matrix = dense(inertia);
    for i in 0..6 {
        for j in 0..6 {
            assert!((matrix[i][j] - matrix[j][i]).abs() <= 8.0 * f64::EPSILON * 16.0);
        }
    }
}

#[test]
fn cholesky_names_the_bad_pivot() {
    let mut d = [[0.0_f64; 6]; 6];
    d[0][0] = 1.0;
    d[1][1] = -1.0;
    assert_eq!(SmallCholesky::factor(2, &d, &[0.0; 6]).err(), Some(1));
    d[1][1] = f64::NAN;
    assert_eq!(SmallCholesky::factor(2, &d, &[0.0; 6]).err(), Some(1));
    d[1][1] = 1e-20;
    assert_eq!(SmallCholesky::factor(2, &d, &[1e-16; 6]).err(), Some(1));
}

#[test]
fn integration_keeps_unit_length() {
    let mut q = Quat::<f32>::IDENTITY;
    for _ in 0..100_000 {
        q = q.integrate(vec3(0.3, -0.2, 0.1));
    }
    assert!((q.length() - 1.0).abs() <= 2.0 * f32::EPSILON);
    let cross = Mat3::cross_matrix(vec3(1.0_f32, 2.0, 3.0)) * vec3(4.0, 5.0, 6.0);
    assert_eq!(cross, vec3(1.0_f32, 2.0, 3.0).cross(vec3(4.0, 5.0, 6.0)));
}
