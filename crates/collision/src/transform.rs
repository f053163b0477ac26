//! Where mesh B stands, seen from mesh A: the definition of its posed vertices.

use glam::{DVec3, Vec3};
use vertebra_spatial::Pose;

use crate::box_pose::BoxPose;
use crate::error::{PoseProblem, QueryError, Side};

/// Matrix and translation entries smaller than this are taken as zero \[1 and m].
const NEGLIGIBLE: f64 = exp2(-200);

/// Translations must stay below this in every component \[m].
const FARTHEST: f64 = exp2(127);

const fn exp2(exponent: i64) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

/// The pose of mesh B seen from mesh A, P = A⁻¹ B, as the nine matrix and three translation entries that define B's
/// posed vertices.
///
/// With q the product conj(qA) qB, the entries are those of its rotation matrix, divided by |q|² so that q need not
/// be of unit length to the last bit: with s = 2 / |q|²,
///
/// ```text
/// 1 - s (yy + zz)   s (xy - wz)       s (xz + wy)
/// s (xy + wz)       1 - s (xx + zz)   s (yz - wx)
/// s (xz - wy)       s (yz + wx)       1 - s (xx + yy)
/// ```
///
/// and the translation is conj(qA) (tB - tA) by the same formula. Entries below 2^-200 in magnitude are zero by
/// definition. Equal poses give exactly the identity.
///
/// So matrix and translation entries are zero or at least 2^-200, hence multiples of 2^-252; `f32` coordinates are
/// multiples of 2^-149 below 2^128. A rounded product of the two is at least 2^-349, so a multiple of 2^-401, and so is
/// every rounded sum of such: a posed coordinate is zero or at least 2^-401. The translation's components are below
/// 2^130 and the rotation at most doubles the length of a vertex, so a posed coordinate is below 2^131. That is what
/// the predicates ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePose {
    /// Rows of the rotation matrix.
    rows: [DVec3; 3],
    /// Origin of B in A \[m].
    translation: DVec3,
}

impl RelativePose {
    /// B stands as A does.
    pub const IDENTITY: Self = Self {
        rows: [DVec3::X, DVec3::Y, DVec3::Z],
        translation: DVec3::ZERO,
    };

    /// The pose of B seen from A, from their poses in the world.
    ///
    /// # Errors
    ///
    /// A pose that is not finite, whose quaternion is not of unit length to 1e-6, or whose translation reaches 2^127.
    pub fn between(a: &Pose, b: &Pose) -> Result<Self, QueryError> {
        for (mesh, pose) in [(Side::A, a), (Side::B, b)] {
            check(pose).map_err(|problem| QueryError::InvalidPose { mesh, problem })?;
        }
        let inverse = rows(a.rotation.conjugate().to_array());
        let from_a = b.translation - a.translation;
        let [ax, ay, az, aw] = a.rotation.conjugate().to_array();
        let [bx, by, bz, bw] = b.rotation.to_array();
        // Paired so that equal poses cancel without rounding.
        let product = [
            (aw * bx + ax * bw) + (ay * bz - az * by),
            (aw * by + ay * bw) + (az * bx - ax * bz),
            (aw * bz + az * bw) + (ax * by - ay * bx),
            (aw * bw - ax * bx) - (ay * by + az * bz),
        ];
        Ok(Self {
            rows: rows(product).map(without_negligible),
            translation: without_negligible(rotate(&inverse, from_a)),
        })
    }

    /// Where boxes of B are in A.
    pub(crate) fn boxes(&self) -> BoxPose {
        BoxPose::new(&self.rows, self.translation)
    }

    /// Where boxes of A are in B.
    pub(crate) fn inverse_boxes(&self) -> BoxPose {
        BoxPose::inverse(&self.rows, self.translation)
    }

    /// The rows r0, r1 and r2 of the matrix that turns B's coordinates into A's, by coordinate of A.
    #[must_use]
    pub fn rows(&self) -> [DVec3; 3] {
        self.rows
    }

    /// Where B's origin is in A \[m].
    #[must_use]
    pub fn translation(&self) -> DVec3 {
        self.translation
    }

    /// Where a vertex of B is in A: `((r0*x + r1*y) + r2*z) + t` per coordinate, in this order \[m].
    #[must_use]
    pub fn apply(&self, vertex: Vec3) -> DVec3 {
        self.apply_wide(vertex.as_dvec3())
    }

    #[inline]
    pub(crate) fn apply_wide(&self, vertex: DVec3) -> DVec3 {
        rotate(&self.rows, vertex) + self.translation
    }
}

impl Default for RelativePose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

fn check(pose: &Pose) -> Result<(), PoseProblem> {
    if !(pose.rotation.is_finite() && pose.translation.is_finite()) {
        Err(PoseProblem::NotFinite)
    } else if (pose.rotation.length() - 1.0).abs() > 1e-6 {
        Err(PoseProblem::NotUnit)
    } else if pose.translation.abs().max_element() >= FARTHEST {
        Err(PoseProblem::TooFar)
    } else {
        Ok(())
    }
}

/// The rows of the rotation matrix of a quaternion (x, y, z, w) of any length but zero.
fn rows([x, y, z, w]: [f64; 4]) -> [DVec3; 3] {
    let s = 2.0 / (((x * x + y * y) + z * z) + w * w);
    [
        DVec3::new(
            1.0 - s * (y * y + z * z),
            s * (x * y - w * z),
            s * (x * z + w * y),
        ),
        DVec3::new(
            s * (x * y + w * z),
            1.0 - s * (x * x + z * z),
            s * (y * z - w * x),
        ),
        DVec3::new(
            s * (x * z - w * y),
            s * (y * z + w * x),
            1.0 - s * (x * x + y * y),
        ),
    ]
}

#[inline]
fn rotate(rows: &[DVec3; 3], v: DVec3) -> DVec3 {
    let row = |r: DVec3| (r.x * v.x + r.y * v.y) + r.z * v.z;
    DVec3::new(row(rows[0]), row(rows[1]), row(rows[2]))
}

fn without_negligible(v: DVec3) -> DVec3 {
    DVec3::from(
        v.to_array()
            .map(|entry| if entry.abs() < NEGLIGIBLE { 0.0 } else { entry }),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn powers_of_two() {
        assert_eq!(NEGLIGIBLE, 2.0_f64.powi(-200));
        assert_eq!(FARTHEST, 2.0_f64.powi(127));
    }

    #[test]
    fn identity_changes_no_value() {
        let identity = RelativePose::between(&Pose::IDENTITY, &Pose::IDENTITY).unwrap();
        assert_eq!(identity, RelativePose::IDENTITY);
        for x in [0.0, -0.0, 1e-45, f32::MAX, 0.1, -7.25e-30] {
            let vertex = Vec3::new(x, -x, 1.0);
            assert_eq!(identity.apply(vertex), vertex.as_dvec3());
        }
    }

    #[test]
    fn a_common_pose_cancels() {
        let rotation = DQuat::from_xyzw(0.1, -0.5, 0.3, 0.7).normalize();
        let pose = Pose::new(rotation, DVec3::new(1e3, -2e-7, 5.0));
        let relative = RelativePose::between(&pose, &pose).unwrap();
        assert_eq!(relative, RelativePose::IDENTITY);
    }

    /// The order of operations is part of the definition: other orders differ in the last bit, often.
    #[test]
    fn apply_is_the_definition_to_the_last_bit() {
        let rotation = DQuat::from_xyzw(0.1, -0.5, 0.3, 0.7);
        let pose = Pose::new(rotation.normalize(), DVec3::new(0.7, -0.3, 0.2));
        let relative = RelativePose::between(&Pose::IDENTITY, &pose).unwrap();
        let (rows, translation) = (relative.rows(), relative.translation());
        let mut other_order_differs = false;
        for i in 0..100_u8 {
            let i = f32::from(i);
            let vertex = Vec3::new(0.1 * i, 1.0 / (i + 3.0), -0.7 + i);
            let posed = relative.apply(vertex);
            for k in 0..3 {
                let [r0, r1, r2] = rows[k].to_array();
                let [x, y, z] = vertex.to_array().map(f64::from);
                let t = translation[k];
                assert_eq!(
                    posed[k].to_bits(),
                    (((r0 * x + r1 * y) + r2 * z) + t).to_bits()
                );
                other_order_differs |= posed[k] != (r0 * x + (r1 * y + r2 * z)) + t;
            }
        }
        assert!(other_order_differs);
    }

    /// Against the poses' own algebra, to a few roundings of the largest term.
    #[test]
    fn agrees_with_composition() {
        let a = Pose::new(
            DQuat::from_xyzw(0.1, -0.5, 0.3, 0.7).normalize(),
            DVec3::new(1.0, -2.0, 0.5),
        );
        let b = Pose::new(
            DQuat::from_xyzw(-0.4, 0.2, 0.9, 0.1).normalize(),
            DVec3::new(-3.0, 0.25, 8.0),
        );
        let relative = RelativePose::between(&a, &b).unwrap();
        for vertex in [Vec3::ZERO, Vec3::X, Vec3::new(0.3, -4.0, 2.5)] {
            let expected = a
                .inverse()
                .transform_point(b.transform_point(vertex.as_dvec3()));
            let error = (relative.apply(vertex) - expected).length();
            assert!(error < 32.0 * f64::EPSILON * 20.0, "{error}");
        }
    }

    #[test]
    fn negligible_entries_are_zero() {
        let tilt = DQuat::from_xyzw(1e-70, 0.0, 0.0, 1.0);
        let pose = Pose::new(tilt, DVec3::new(1e-61, 0.0, -1e-60));
        let relative = RelativePose::between(&Pose::IDENTITY, &pose).unwrap();
        let moved = relative.apply(Vec3::ZERO);
        assert_eq!(moved, DVec3::new(0.0, 0.0, -1e-60));
        assert_eq!(relative.rows, [DVec3::X, DVec3::Y, DVec3::Z]);
    }
}
