//! The equations that a closure asks of its two frames, with their first and second rates.
//!
//! With d from the first origin to the second, a_k and b_k the frames' axes, each equation e = 0 is one of
//!
//! point: a_k d; perpendicular: a_i b_j; screw: a_z d - pitch angle(b about a_z); distance: |d| - length.
//!
//! The rate of each is the power of a force pair: J qd = w V_b - w V_a, with w acting on both bodies at the second
//! origin, equal and opposite, so that no closure adds momentum. For a point, w = [0; a_k]; the first frame's
//! turning with d is contained in that. Perpendicular: w = \[b_j x a_i; 0\].

use vertebra_assembly::Closure;
use vertebra_spatial::{Force, Mat3, Transform, Vec3, vec3};

/// One equation of a closure; axes are numbered x, y, z, and z is the closure's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Equation {
    /// The second origin has coordinate zero along an axis of the first frame.
    Point(usize),
    /// An axis of the first frame is perpendicular to one of the second.
    Perpendicular(usize, usize),
    /// The second frame slides along z in proportion to its turn, this far a radian.
    Screw(f64),
    /// The origins are this far apart.
    Distance(f64),
}

use Equation::{Distance, Perpendicular, Point, Screw};

/// The equations of a closure in lengths of a unit.
pub(super) fn equations(closure: &Closure, unit: f64) -> Vec<Equation> {
    let origins = [Point(0), Point(1), Point(2)];
    let across = [Point(0), Point(1)];
    let parallel = [Perpendicular(0, 2), Perpendicular(1, 2)];
    let unturned = [
        Perpendicular(0, 1),
        Perpendicular(1, 2),
        Perpendicular(2, 0),
    ];
    match *closure {
        Closure::Weld => [&origins[..], &unturned].concat(),
        Closure::Ball => origins.to_vec(),
        Closure::Revolute { .. } => [&origins[..], &parallel].concat(),
        Closure::Prismatic { .. } => [&across[..], &unturned].concat(),
        Closure::Screw { pitch, .. } => [&across[..], &parallel, &[Screw(pitch / unit)]].concat(),
        Closure::Cylindrical { .. } => [&across[..], &parallel].concat(),
        Closure::Universal { .. } => [&origins[..], &[Perpendicular(2, 2)]].concat(),
        Closure::Planar { .. } => [&[Point(2)], &parallel[..]].concat(),
        Closure::Distance { length } => vec![Distance(length / unit)],
    }
}

/// Axes of the closure's two frames in the frames as placed: z along the closure's axis.
pub(super) fn axes(closure: &Closure) -> [Mat3<f64>; 2] {
    match *closure {
        Closure::Weld | Closure::Ball | Closure::Distance { .. } => [Mat3::IDENTITY; 2],
        Closure::Revolute { axis }
        | Closure::Prismatic { axis }
        | Closure::Screw { axis, .. }
        | Closure::Cylindrical { axis }
        | Closure::Planar { normal: axis } => [crate::link::with_z_along(axis); 2],
        Closure::Universal { first, second } => [first, second].map(crate::link::with_z_along),
    }
}

/// A frame of a closure in motion: in world axes, origins from a common point, accelerations as if no joint
/// accelerated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moving {
    pub(super) placement: Transform<f64>,
    pub(super) spin: Vec3<f64>,
    pub(super) velocity: Vec3<f64>,
    pub(super) turning: Vec3<f64>,
    pub(super) acceleration: Vec3<f64>,
}

/// An equation at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Evaluated {
    /// What is left of it.
    pub(super) value: f64,
    /// The force pair w, about the second origin, that acts on the second body.
    pub(super) wrench: Force<f64>,
    /// Its second rate, for the accelerations given.
    pub(super) second_rate: f64,
}

impl Equation {
    /// Whether it is a length; else it is an angle or a cosine.
    pub(super) const fn is_length(self) -> bool {
        !matches!(self, Perpendicular(..))
    }

    pub(super) fn evaluate(self, a: &Moving, b: &Moving) -> Evaluated {
        let d = b.placement.translation - a.placement.translation;
        let velocity = b.velocity - a.velocity;
        let acceleration = b.acceleration - a.acceleration;
        match self {
            Point(k) => along(axis(a, k), a, d, velocity, acceleration),
            Perpendicular(i, j) => {
                let (one, other) = (axis(a, i), axis(b, j));
                Evaluated {
                    value: one.dot(other),
                    wrench: Force::new(other.cross(one), Vec3::ZERO),
                    second_rate: second_rate(one, a).dot(other)
                        + one.dot(second_rate(other, b))
                        + 2.0 * a.spin.cross(one).dot(b.spin.cross(other)),
                }
            }
            Screw(pitch) => {
                let z = axis(a, 2);
                let slide = along(z, a, d, velocity, acceleration);
                let x = axis(b, 0);
                let angle = x.dot(axis(a, 1)).atan2(x.dot(axis(a, 0)));
                let turning =
                    (b.turning - a.turning).dot(z) + (b.spin - a.spin).dot(a.spin.cross(z));
                // Turns that are whole cannot be told from none.
                let turn = core::f64::consts::TAU * pitch;
                let value = slide.value - pitch * angle;
                let whole = if pitch == 0.0 {
                    0.0
                } else {
                    (value / turn).round()
                };
                Evaluated {
                    value: value - whole * turn,
                    wrench: Force::new(z * -pitch, z),
                    second_rate: slide.second_rate - pitch * turning,
                }
            }
            Distance(length) => {
                let distance = d.length();
                // Origins that coincide have no direction between them: any will part them.
                let u = if distance > 0.0 {
                    d * (1.0 / distance)
                } else {
                    axis(a, 0)
                };
                let closing = u.dot(velocity);
                let across = velocity.length_squared() - closing * closing;
                Evaluated {
                    value: distance - length,
                    wrench: Force::new(Vec3::ZERO, u),
                    second_rate: u.dot(acceleration)
                        + if distance > 0.0 {
                            across.max(0.0) / distance
                        } else {
                            0.0
                        },
                }
            }
        }
    }
}

/// The equation e = u d for an axis u of the first frame: e'' = u d'' + 2 (w x u) d' + u'' d.
fn along(
    u: Vec3<f64>,
    a: &Moving,
    d: Vec3<f64>,
    velocity: Vec3<f64>,
    acceleration: Vec3<f64>,
) -> Evaluated {
    Evaluated {
        value: u.dot(d),
        wrench: Force::new(Vec3::ZERO, u),
        second_rate: u.dot(acceleration)
            + 2.0 * a.spin.cross(u).dot(velocity)
            + second_rate(u, a).dot(d),
    }
}

/// The second rate of an axis that is fixed in a frame.
fn second_rate(u: Vec3<f64>, frame: &Moving) -> Vec3<f64> {
    frame.turning.cross(u) + frame.spin.cross(frame.spin.cross(u))
}

fn axis(frame: &Moving, k: usize) -> Vec3<f64> {
    let Mat3 {
        x_axis,
        y_axis,
        z_axis,
    } = frame.placement.rotation;
    [x_axis, y_axis, z_axis][k]
}

impl Moving {
    /// A place in the world.
    pub(super) const fn fixed(placement: Transform<f64>) -> Self {
        Self {
            placement,
            spin: Vec3::ZERO,
            velocity: Vec3::ZERO,
            turning: Vec3::ZERO,
            acceleration: vec3(0.0, 0.0, 0.0),
        }
    }
}
