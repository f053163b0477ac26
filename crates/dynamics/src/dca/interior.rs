//! The bodies inside a chunk, gathered from the outboard end by the articulated-body recursion with
//! the tip wrench as six right-hand sides, so that no light body is ever inverted.
//!
//! What has been gathered answers an acceleration a of its inboard handle and a force f2 at the
//! tip with f1 = IA a + pA - B f2 and a2 = B'a + C f2 + d. Through a joint, with U = IA S,
//! D = S'U + E where the freedom has inertia E of its own, u = tau - S'pA, s = B'S and the velocity-product acceleration c:
//!
//! Ia = IA - U D^-1 U',  pa = pA + Ia c + U D^-1 u,  B <- B - U D^-1 s',
//! C <- C + s D^-1 s',   d <- d + B'c + s D^-1 u,    qdd = D^-1 (u + s'f2 - U'a').
//!
//! Joints of several freedoms take the columns of U L'^-1, S L'^-1 and s L'^-1 with D = LL', which
//! makes D the identity.

use super::rake::Rake;
use crate::drive::driven;
use crate::link::Kind;
use crate::own::OwnInertia;
use core::ops::Range;
use vertebra_spatial::matrix6::{add_scaled, dot};
use vertebra_spatial::{
    ArticulatedInertia, Force, Mat3, Mat6, Motion, Real, SmallCholesky, Sym3, Vec3,
};

/// What a freedom keeps for the way down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Freedom<T> {
    /// Column of U, or of U L'^-1.
    pub(super) column: Force<T>,
    /// s = B'S, or of s L'^-1.
    pub(super) tip: [T; 6],
    /// u, or L^-1 u.
    pub(super) drive: T,
    /// 1/D, or a row of L with the reciprocal of its diagonal.
    pub(super) pivot: [T; 6],
}

impl<T: Real> Freedom<T> {
    pub(super) const NONE: Self = Self {
        column: Force::ZERO,
        tip: [T::ZERO; 6],
        drive: T::ZERO,
        pivot: [T::ZERO; 6],
    };
}

/// A joint to be passed through.
pub(super) struct Joint<'a, T> {
    pub(super) kind: Kind,
    /// Motion subspace S.
    pub(super) columns: &'a [Motion<T>],
    /// Joint forces.
    pub(super) tau: [T; 6],
    /// Inertia E of the freedoms' own.
    pub(super) own: OwnInertia<'a, T>,
    /// Displacement a radian of a screw.
    pub(super) pitch: T,
    /// Velocity-product acceleration.
    pub(super) c: Motion<T>,
}

/// What has been gathered so far, about its inboard handle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interior<T> {
    pub(super) inertia: ArticulatedInertia<T>,
    pub(super) bias: Force<T>,
    /// B, and whether there is a tip at all.
    pub(super) tip: Mat6<T>,
    pub(super) tipped: bool,
    /// C.
    pub(super) compliance: Mat6<T>,
    /// d.
    pub(super) drift: [T; 6],
    /// Inertia [rotation, translation] before the last joint let go and of the bodies added since: a
    /// pivot below rounding of it says nothing.
    pub(super) carried: [T; 2],
    /// The inertia before the last joint let go.
    arriving: ArticulatedInertia<T>,
}

/// No inertia; a constant, which `Default` cannot be.
const fn massless<T: Real>() -> ArticulatedInertia<T> {
    ArticulatedInertia {
        angular: Sym3::ZERO,
        coupling: Mat3::ZERO,
        linear: Sym3::ZERO,
    }
}

impl<T: Real> Interior<T> {
    /// Nothing, with or without a tip here.
    pub(super) const fn start(tipped: bool) -> Self {
        Self {
            inertia: massless(),
            bias: Force::ZERO,
            tip: if tipped { Mat6::IDENTITY } else { Mat6::ZERO },
            tipped,
            compliance: Mat6::ZERO,
            drift: [T::ZERO; 6],
            carried: [T::ZERO; 2],
            arriving: massless(),
        }
    }

    /// Adds a body and its rakes at the handle.
    pub(super) fn add(&mut self, body: &Rake<T>) {
        self.inertia += body.inertia;
        self.bias += body.bias;
        self.carried[0] += body.carried[0];
        self.carried[1] += body.carried[1];
    }

    /// Inertia [rotation, translation] before the last joint let go, about the point from which that
    /// joint is at `r`.
    pub(super) fn arriving(&self, r: Vec3<T>) -> [T; 2] {
        [
            self.arriving.shifted_angular_trace(r),
            self.arriving.linear.trace(),
        ]
    }

    /// Moves the handle to the point from which it lies at `r` on the same body, whose point at `r`
    /// accelerates by `centripetal` if that point does not.
    pub(super) fn move_handle(&mut self, r: Vec3<T>, centripetal: Motion<T>) {
        self.accelerate(centripetal);
        let before = [self.inertia.angular.trace(), self.inertia.linear.trace()];
        self.carried[0] += self.inertia.shifted_angular_trace(r) - before[0];
        self.refer(r);
    }

    /// Takes the joint passed through last to have been at `r` from the handle of the body before:
    /// from here on that is the handle. What the joint adds to accelerations is worked in.
    pub(super) fn shift(&mut self, r: Vec3<T>) {
        self.carried = self.arriving(r);
        self.refer(r);
    }

    fn refer(&mut self, r: Vec3<T>) {
        self.inertia = self.inertia.shifted_back(r);
        self.bias = self.bias.shifted_back(r);
        if self.tipped {
            self.tip = self.tip.shifted_back(r);
        }
    }

    /// Passes through a joint; `freedoms` are its own. None if the joint moves no inertia to working
    /// precision: its pivot is zero, negative, or within rounding of what it is computed from.
    pub(super) fn let_go(
        &mut self,
        joint: &Joint<'_, T>,
        freedoms: &mut [Freedom<T>],
    ) -> Option<()> {
        self.arriving = self.inertia;
        let rounding = T::from_f64(4.0) * T::EPSILON;
        let floor = self.carried.map(|carried| carried * rounding);
        match joint.kind {
            Kind::Fixed => self.accelerate(joint.c),
            Kind::Revolute => {
                let axis = joint.columns[0].angular;
                let column = Force::new(self.inertia.angular * axis, self.inertia.coupling * axis);
                let d = axis.dot(column.angular) + joint.own.entry(0, 0);
                let u = joint.tau[0] - axis.dot(self.bias.angular);
                let tip = self.tip_seen(axis, 0..3);
                freedoms[0] = pivot(d, floor[0], column, tip, u)?;
                self.release(&freedoms[0], joint.c);
            }
            Kind::Prismatic => {
                let axis = joint.columns[0].linear;
                let column = Force::new(
                    self.inertia.coupling.transpose_mul(axis),
                    self.inertia.linear * axis,
                );
                let d = axis.dot(column.linear) + joint.own.entry(0, 0);
                let u = joint.tau[0] - axis.dot(self.bias.linear);
                let tip = self.tip_seen(axis, 3..6);
                freedoms[0] = pivot(d, floor[1], column, tip, u)?;
                self.release(&freedoms[0], joint.c);
            }
            Kind::Screw => {
                let direction = joint.columns[0];
                let column = self.inertia.mul(direction);
                let d = direction.dot(column) + joint.own.entry(0, 0);
                let u = joint.tau[0] - direction.dot(self.bias);
                let tip = if self.tipped {
                    self.tip.transpose_mul(&direction.to_array())
                } else {
                    [T::ZERO; 6]
                };
                let floor = floor[0] + floor[1] * joint.pitch * joint.pitch;
                freedoms[0] = pivot(d, floor, column, tip, u)?;
                self.release(&freedoms[0], joint.c);
            }
            Kind::Spherical | Kind::Free => self.release_several(joint, freedoms, floor)?,
        }
        Some(())
    }

    /// Works an acceleration in that comes on top of the handle's.
    fn accelerate(&mut self, c: Motion<T>) {
        self.bias += self.inertia.mul(c);
        if self.tipped {
            add_scaled(
                &mut self.drift,
                &self.tip.transpose_mul(&c.to_array()),
                T::ONE,
            );
        }
    }

    /// B'S for an axis among the rows of B.
    fn tip_seen(&self, axis: Vec3<T>, rows: Range<usize>) -> [T; 6] {
        let mut seen = [T::ZERO; 6];
        if self.tipped {
            for (row, factor) in self.tip.0[rows].iter().zip(axis.to_array()) {
                add_scaled(&mut seen, row, factor);
            }
        }
        seen
    }

    /// Lets one freedom go.
    fn release(&mut self, freedom: &Freedom<T>, c: Motion<T>) {
        let d_inverse = freedom.pivot[0];
        let response = freedom.drive * d_inverse;
        self.inertia.subtract_outer(freedom.column, d_inverse);
        self.bias += freedom.column * response;
        if self.tipped {
            let s = &freedom.tip;
            self.tip
                .add_outer(&freedom.column.to_array(), s, -d_inverse);
            self.compliance.add_outer(s, s, d_inverse);
            add_scaled(&mut self.drift, s, response);
        }
        self.accelerate(c);
    }

    /// Lets all three turning freedoms go, or all six: unless they have inertia of their own, what is then
    /// left of IA, pA and B is known to be zero, but for the forces that drive the joint, and is not left
    /// to rounding.
    fn release_several(
        &mut self,
        joint: &Joint<'_, T>,
        freedoms: &mut [Freedom<T>],
        floor: [T; 2],
    ) -> Option<()> {
        let order = joint.columns.len();
        let held = !joint.own.is_zero();
        let mut d = [[T::ZERO; 6]; 6];
        let mut columns = Mat6::ZERO;
        let mut tips = Mat6::ZERO;
        let mut drives = [T::ZERO; 6];
        for (k, &column) in joint.columns.iter().enumerate() {
            let u_column = self.inertia.mul(column);
            for (l, other) in joint.columns.iter().enumerate().take(k + 1) {
                d[k][l] = other.dot(u_column) + joint.own.entry(k, l);
            }
            columns.0[k] = u_column.to_array();
            drives[k] = joint.tau[k] - column.dot(self.bias);
            if self.tipped {
                tips.0[k] = self.tip.transpose_mul(&column.to_array());
            }
        }
        let [turn, slide] = floor;
        let floors = [turn, turn, turn, slide, slide, slide];
        let factor = SmallCholesky::factor(order, &d, &floors).ok()?;
        factor.solve_lower_rows(&mut columns);
        factor.solve_lower_rows(&mut tips);
        factor.solve_lower(&mut drives);
        let driven = driven(joint.columns, &joint.tau);
        let mut passed = self.bias;
        for (k, freedom) in freedoms.iter_mut().enumerate().take(order) {
            let column = Force::from_array(columns.0[k]);
            *freedom = Freedom {
                column,
                tip: tips.0[k],
                drive: drives[k],
                pivot: factor.row(k),
            };
            if held {
                self.inertia.subtract_outer(column, T::ONE);
            } else {
                self.inertia.linear = self.inertia.linear - Sym3::outer(column.linear, T::ONE);
            }
            passed += column * drives[k];
            if self.tipped {
                self.tip.add_outer(&columns.0[k], &tips.0[k], -T::ONE);
                self.compliance.add_outer(&tips.0[k], &tips.0[k], T::ONE);
                add_scaled(&mut self.drift, &tips.0[k], drives[k]);
            }
        }
        if !held {
            self.inertia.angular = Sym3::ZERO;
            self.inertia.coupling = Mat3::ZERO;
            passed.angular = driven.angular;
            self.tip.0[..3].fill([T::ZERO; 6]);
            if order == 6 {
                self.inertia.linear = Sym3::ZERO;
                passed.linear = driven.linear;
                self.tip = Mat6::ZERO;
            }
        }
        self.bias = passed;
        self.accelerate(joint.c);
        Some(())
    }
}

/// The record of a single freedom.
fn pivot<T: Real>(d: T, floor: T, column: Force<T>, tip: [T; 6], drive: T) -> Option<Freedom<T>> {
    // Written so that NaN fails.
    if !(d > floor && d.is_finite()) {
        return None;
    }
    let mut pivot = [T::ZERO; 6];
    pivot[0] = T::ONE / d;
    Some(Freedom {
        column,
        tip,
        drive,
        pivot,
    })
}

/// Down through a joint: adds S qdd to the acceleration a' = X a + c of the body beyond, given f2 at
/// the tip, and writes qdd.
///
/// The condition on qdd reads U'a + E qdd = u + s'f2. It is solved so many times, twice for all digits:
/// a' may be much larger than a (a light body on a fast joint hardly notices its parent), and then
/// rounding of the order of a' is left in a; the second solution removes it. Joints of several freedoms
/// with inertia E of their own, which keep no U and E apart, are solved once.
pub(super) fn respond<T: Real>(
    (columns, own): (&[Motion<T>], OwnInertia<'_, T>),
    freedoms: &[Freedom<T>],
    f2: &[T; 6],
    solutions: usize,
    a: &mut Motion<T>,
    qdd: &mut [T],
) {
    if let ([column], [own], [freedom], [qdd]) = (columns, own.diagonal, freedoms, &mut *qdd) {
        let wanted = freedom.drive + dot(&freedom.tip, f2);
        let first = (wanted - a.dot(freedom.column)) * freedom.pivot[0];
        *a += *column * first;
        *qdd = first;
        if solutions > 1 {
            let second = (wanted - *own * first - a.dot(freedom.column)) * freedom.pivot[0];
            *a += *column * second;
            *qdd += second;
        }
        return;
    }
    qdd.fill(T::ZERO);
    let held = !own.is_zero();
    for _ in 0..if held { 1 } else { solutions } {
        // L'qdd = L^-1 u + (s L'^-1)'f2 - (U L'^-1)'a.
        let mut rest = [T::ZERO; 6];
        for (rest, freedom) in rest.iter_mut().zip(freedoms) {
            *rest = freedom.drive + dot(&freedom.tip, f2) - a.dot(freedom.column);
        }
        for i in (0..freedoms.len()).rev() {
            for k in i + 1..freedoms.len() {
                rest[i] -= freedoms[k].pivot[i] * rest[k];
            }
            rest[i] = rest[i] * freedoms[i].pivot[i];
        }
        for ((qdd, &column), rest) in qdd.iter_mut().zip(columns).zip(rest) {
            *a += column * rest;
            *qdd += rest;
        }
    }
}
