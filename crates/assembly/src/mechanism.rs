//! Mechanisms with closed loops, assembled: four-bar and five-bar linkages, overconstrained linkages, a walking leg,
//! chain mail, a parallel robot, random ones. Each function gives a model and a state in which its loops are closed.
//!
//! The planar ones lie askew in the world, so that nothing is aligned with its axes.
//!
//! ```
//! use vertebra_assembly::mechanism;
//!
//! let (model, state) = mechanism::jansen_leg()?;
//! assert_eq!((model.dof_count(), model.loops().len()), (7, 3));
//! assert_eq!(state.q.len(), 7);
//! # Ok::<(), vertebra_assembly::ModelError>(())
//! ```

mod random;

pub use random::random;

use crate::{Closure, Joint, MassProperties, Model, ModelDescription, ModelError, State};
use core::f64::consts::{FRAC_PI_2, PI};
use glam::{DQuat, DVec2, DVec3};
use vertebra_spatial::Pose;

/// The plane of planar mechanisms lies askew in the world; its axis is y, rods lie along z at angle 0.
fn askew() -> Pose {
    Pose::new(turn(DVec3::new(0.7, -0.4, 1.1)), DVec3::new(0.3, 1.0, -0.2))
}

fn in_plane(at: DVec2) -> Pose {
    Pose::from_translation(DVec3::new(at.x, 0.0, at.y))
}

const HINGE: Closure = Closure::Revolute { axis: DVec3::Y };

fn hinge(at: Pose) -> Joint {
    Joint::revolute(DVec3::Y).at(at)
}

fn rod(length: f64) -> MassProperties {
    MassProperties::rod(length, length, 0.02 * length)
}

/// The rotation about a vector by its length.
fn turn(by: DVec3) -> DQuat {
    let angle = by.length();
    let v = by * (libm::sin(0.5 * angle) / angle);
    DQuat::from_xyzw(v.x, v.y, v.z, libm::cos(0.5 * angle))
}

/// The direction at an angle in the plane.
fn direction(angle: f64) -> DVec2 {
    DVec2::new(libm::sin(angle), libm::cos(angle))
}

/// Angle of a direction in the plane.
fn angle(from: DVec2, to: DVec2) -> f64 {
    let d = to - from;
    libm::atan2(d.x, d.y)
}

/// The point at these distances from two others; `side` says which of the two.
fn meet(p: DVec2, from_p: f64, q: DVec2, from_q: f64, side: f64) -> DVec2 {
    let d = q - p;
    let along = (d.length_squared() + from_p * from_p - from_q * from_q) / (2.0 * d.length());
    let across = (from_p * from_p - along * along).sqrt();
    let u = d.normalize();
    p + u * along + DVec2::new(-u.y, u.x) * (side * across)
}

/// Crank, coupler and rocker between two pivots of the ground, closed by a hinge where coupler and rocker meet; all
/// lengths \[m\], the crank starting at an angle \[rad\] from the normal of the ground. With crank and rocker alike and
/// coupler and ground, it is a parallelogram, which folds flat twice a turn.
///
/// # Errors
/// [`ModelError`] if the lengths cannot be assembled so.
pub fn four_bar(
    ground: f64,
    crank: f64,
    coupler: f64,
    rocker: f64,
    start: f64,
) -> Result<(Model, State), ModelError> {
    let lengths = [ground, crank, coupler, rocker];
    if !lengths
        .iter()
        .all(|length| *length > 0.0 && length.is_finite())
        || !start.is_finite()
    {
        return Err(ModelError::BadParameter {
            parameter: "each length of a four-bar linkage",
            requirement: "above zero and finite, and so the starting angle finite",
        });
    }
    let pivot = DVec2::new(ground, 0.0);
    let end = direction(start) * crank;
    let pin = meet(end, coupler, pivot, rocker, 1.0);
    if !pin.is_finite() {
        return Err(ModelError::BadParameter {
            parameter: "the lengths of a four-bar linkage",
            requirement: "such that coupler and rocker meet at the starting angle",
        });
    }
    let tip = |length: f64| in_plane(DVec2::new(0.0, length));
    let model = ModelDescription::new("four-bar")
        .body("crank", None, hinge(askew()), rod(crank))
        .body("coupler", Some("crank"), hinge(tip(crank)), rod(coupler))
        .body(
            "rocker",
            None,
            hinge(askew() * in_plane(pivot)),
            rod(rocker),
        )
        .close(
            "pin",
            [Some("coupler"), Some("rocker")],
            [tip(coupler), tip(rocker)],
            HINGE,
        )
        .build()?;
    let mut state = State::neutral(&model);
    state.q = vec![start, angle(end, pin) - start, angle(pivot, pin)];
    Ok((model, state))
}

/// Two arms of two links each between two pivots, hinged together at their tips: two freedoms.
///
/// # Errors
/// None: the fixed sizes fit.
pub fn five_bar() -> Result<(Model, State), ModelError> {
    let pivot = DVec2::new(0.8, 0.1);
    let tip = |length: f64| in_plane(DVec2::new(0.0, length));
    let model = ModelDescription::new("five-bar")
        .body("a", None, hinge(askew()), rod(0.4))
        .body("b", Some("a"), hinge(tip(0.4)), rod(0.7))
        .body("c", None, hinge(askew() * in_plane(pivot)), rod(0.5))
        .body("d", Some("c"), hinge(tip(0.5)), rod(0.8))
        .close("pin", [Some("b"), Some("d")], [tip(0.7), tip(0.8)], HINGE)
        .build()?;
    let (first, second) = (0.4, 1.0);
    let left = direction(first) * 0.4;
    let right = pivot + direction(second) * 0.5;
    let pin = meet(left, 0.7, right, 0.8, 1.0);
    let mut state = State::neutral(&model);
    state.q = vec![
        first,
        angle(left, pin) - first,
        second,
        angle(right, pin) - second,
    ];
    Ok((model, state))
}

/// A single loop of hinges in Denavit and Hartenberg's notation: each link is Tx(length) Rx(twist). The ground
/// is the last.
fn hinge_loop(
    name: &str,
    lengths: &[f64],
    twists: &[f64],
    angles: &[f64],
) -> Result<(Model, State), ModelError> {
    let link = |k: usize| Pose::new(turn(DVec3::X * twists[k]), DVec3::new(lengths[k], 0.0, 0.0));
    let mut description = ModelDescription::new(name);
    let count = lengths.len() - 1;
    let mut place = askew();
    for k in 0..count {
        let parent = k.checked_sub(1).map(|k| format!("link {k}"));
        let joint = Joint::revolute(DVec3::Z).at(place);
        let mass = MassProperties::rod(1.0, 0.5 * lengths[k], 0.1 * lengths[k]);
        description = description.body(format!("link {k}"), parent.as_deref(), joint, mass);
        place = link(k);
    }
    let last = format!("link {}", count - 1);
    let model = description
        .close(
            "closure",
            [Some(&last), None],
            [place, askew() * link(count).inverse()],
            Closure::Revolute { axis: DVec3::Z },
        )
        .build()?;
    let mut state = State::neutral(&model);
    state.q.copy_from_slice(&angles[..count]);
    Ok((model, state))
}

/// Bennett's linkage: a loop of four hinges in space that moves although counting says it cannot. Opposite links are
/// alike, lengths as the sines of their twists (Bennett, Engineering 76, 1903).
///
/// # Errors
/// None: the fixed sizes fit.
pub fn bennett() -> Result<(Model, State), ModelError> {
    let (alpha, beta, first) = (0.6, 1.1, 1.0);
    let ratio = libm::sin(0.5 * (beta + alpha)) / libm::sin(0.5 * (beta - alpha));
    let second = 2.0 * libm::atan(ratio / libm::tan(0.5 * first));
    let (a, b) = (libm::sin(alpha), libm::sin(beta));
    hinge_loop(
        "bennett",
        &[a, b, a, b],
        &[alpha, beta, alpha, beta],
        &[first, second, -first, -second],
    )
}

/// Bricard's loop of six hinges, threefold symmetric, of right twists: its angles a, b, a, b, a, b obey
/// cos a + cos b + cos a cos b = 0 (Chen, You and Tarnai, Int. J. Solids Struct. 42, 2005).
///
/// # Errors
/// None: the fixed sizes fit.
pub fn bricard() -> Result<(Model, State), ModelError> {
    let first = libm::acos(0.6);
    let second = libm::acos(-0.375);
    hinge_loop(
        "bricard",
        &[0.5; 6],
        &[
            FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2,
        ],
        &[first, second, first, second, first, second],
    )
}

/// A leg of Theo Jansen's Strandbeest: seven moving links, three loops beside the tree, one freedom.
///
/// # Errors
/// None: the fixed sizes fit.
pub fn jansen_leg() -> Result<(Model, State), ModelError> {
    let [a, b, c, d, e, f, g, h, i, j, k, l, m] = [
        38.0, 41.5, 39.3, 40.1, 55.8, 39.4, 36.7, 65.7, 49.0, 50.0, 61.9, 7.8, 15.0,
    ]
    .map(|length: f64| 0.01 * length);
    let start = 0.5;
    let axle = DVec2::ZERO;
    let pivot = DVec2::new(-a, -l);
    let crank = direction(start) * m;
    let top = meet(pivot, b, crank, j, 1.0);
    let side = meet(pivot, d, top, e, 1.0);
    let knee = meet(pivot, c, crank, k, -1.0);
    let ankle = meet(side, f, knee, g, 1.0);
    let foot = meet(ankle, h, knee, i, 1.0);
    let along = |length: f64| in_plane(DVec2::new(0.0, length));
    // A point of a link whose z axis points from `from` to `to`.
    let seen = |from: DVec2, to: DVec2, point: DVec2| {
        let DVec2 { x: sin, y: cos } = direction(angle(from, to));
        let d = point - from;
        in_plane(DVec2::new(d.x * cos - d.y * sin, d.x * sin + d.y * cos))
    };
    let model = ModelDescription::new("jansen-leg")
        .body("crank", None, hinge(askew() * in_plane(axle)), rod(m))
        .body("upper", Some("crank"), hinge(along(m)), rod(j))
        .body("lower", Some("crank"), hinge(along(m)), rod(k))
        .body("shoulder", None, hinge(askew() * in_plane(pivot)), rod(b))
        .body("arm", None, hinge(askew() * in_plane(pivot)), rod(c))
        .body(
            "strut",
            Some("shoulder"),
            hinge(seen(pivot, top, side)),
            rod(f),
        )
        .body("shin", Some("arm"), hinge(along(c)), rod(i))
        .close(
            "top",
            [Some("upper"), Some("shoulder")],
            [along(j), along(b)],
            HINGE,
        )
        .close(
            "knee",
            [Some("lower"), Some("arm")],
            [along(k), along(c)],
            HINGE,
        )
        .close(
            "ankle",
            [Some("strut"), Some("shin")],
            [along(f), seen(knee, foot, ankle)],
            HINGE,
        )
        .build()?;
    let mut state = State::neutral(&model);
    let shoulder = angle(pivot, top);
    let arm = angle(pivot, knee);
    state.q = vec![
        start,
        angle(crank, top) - start,
        angle(crank, knee) - start,
        shoulder,
        arm,
        angle(side, ankle) - shoulder,
        angle(knee, foot) - arm,
    ];
    Ok((model, state))
}

/// A patch of chain mail: floating rings, each linked to its neighbours by balls, hung up by the two upper corners.
/// Flat and at rest, it is in a singular position: it has rates there that are forbidden nearby. Push rings out of the
/// plane and close the loops again for one that moves as it may.
///
/// # Errors
/// [`ModelError`] without rings.
pub fn chain_mail(rows: usize, columns: usize) -> Result<(Model, State), ModelError> {
    let mass = MassProperties::rod(0.1, 0.04, 0.02);
    let name = |row: usize, column: usize| format!("ring {row} {column}");
    let mut description = ModelDescription::new("chain-mail");
    for row in 0..rows {
        for column in 0..columns {
            description = description.body(name(row, column), None, Joint::free(), mass);
        }
    }
    let rim = |x: f64, z: f64| Pose::from_translation(DVec3::new(0.05 * x, 0.0, 0.05 * z));
    for row in 0..rows {
        for column in 0..columns {
            let here = name(row, column);
            if column + 1 < columns {
                let right = name(row, column + 1);
                description = description.close(
                    format!("across {row} {column}"),
                    [Some(&here), Some(&right)],
                    [rim(1.0, 0.0), rim(-1.0, 0.0)],
                    Closure::Ball,
                );
            }
            if row + 1 < rows {
                let below = name(row + 1, column);
                description = description.close(
                    format!("down {row} {column}"),
                    [Some(&here), Some(&below)],
                    [rim(0.0, -1.0), rim(0.0, 1.0)],
                    Closure::Ball,
                );
            }
        }
    }
    for column in [0, columns - 1] {
        let at = Pose::from_translation(DVec3::new(0.1 * column as f64, 0.0, 0.05));
        description = description.close(
            format!("hook {column}"),
            [Some(&name(0, column)), None],
            [rim(0.0, 1.0), at],
            Closure::Ball,
        );
    }
    let model = description.build()?;
    let mut state = State::neutral(&model);
    for row in 0..rows {
        for column in 0..columns {
            let q = &mut state.q[7 * (row * columns + column)..];
            (q[0], q[2]) = (0.1 * column as f64, -0.1 * row as f64);
        }
    }
    Ok((model, state))
}

/// A Stewart platform: six legs, each a spherical joint, a slide and a ball, between the ground and a platform that
/// floats.
///
/// # Errors
/// None: the fixed sizes fit.
pub fn stewart_platform() -> Result<(Model, State), ModelError> {
    let plate = MassProperties::rod(5.0, 0.1, 0.5);
    let leg = rod(0.4);
    let height = 0.8;
    let mut description = ModelDescription::new("stewart-platform").body(
        "platform",
        None,
        Joint::free().at(Pose::from_translation(DVec3::Z * height)),
        plate,
    );
    let foot = |k: usize, radius: f64, spread: f64| {
        let angle =
            (k / 2) as f64 * 2.0 * PI / 3.0 + if k.is_multiple_of(2) { -spread } else { spread };
        DVec3::new(libm::cos(angle), libm::sin(angle), 0.0) * radius
    };
    for k in 0..6 {
        let below = foot(k, 0.7, 0.3);
        // Legs lean to the corner between.
        let above = foot(k, 0.5, 0.8);
        let along = above + DVec3::Z * height - below;
        let lean = Pose::new(DQuat::from_rotation_arc(DVec3::Z, along.normalize()), below);
        let (lower, upper) = (format!("lower {k}"), format!("upper {k}"));
        let start = Pose::from_translation(DVec3::Z * (along.length() - 0.4));
        description = description
            .body(&lower, None, Joint::spherical().at(lean), leg)
            .body(
                &upper,
                Some(&lower),
                Joint::prismatic(DVec3::Z).at(start),
                leg,
            )
            .close(
                format!("joint {k}"),
                [Some(&upper), Some("platform")],
                [
                    Pose::from_translation(DVec3::Z * 0.4),
                    Pose::from_translation(above),
                ],
                Closure::Ball,
            );
    }
    let model = description.build()?;
    let state = State::neutral(&model);
    Ok((model, state))
}
