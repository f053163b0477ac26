//! Two parts of a path, put together where they meet.
//!
//! A part answers forces f1, f2 at its two handles with accelerations of these,
//!
//! a1 = Phi11 f1 + Phi12 f2 + b1,   a2 = Phi21 f1 + Phi22 f2 + b2
//!
//! (Featherstone 1999, part 1, eq. 4), unless it is its path's **head**: it then hangs from a body
//! that is not part of it, whose acceleration a1 it takes, and
//!
//! f1 = Ia a1 + pa - B f2,          a2 = B'a1 + C f2 + d.
//!
//! A [`Node`] holds both in the same places: Ia for Phi11, B for Phi12, C for Phi22, pa for b1, d
//! for b2; and x stands for what its inboard end is given, f1 or a1.
//!
//! A and B meet at a handle of both. There B is acted on by f, A by -f. If they are rigidly joined,
//! a2 of A is a1 of B; if by a joint with motion subspace S, they differ by S qdd + c, and S'f is
//! the joint force. With the columns of T an orthonormal basis of the forces that do no work on the
//! joint (T'S = 0; the identity for rigid joins), f_Q = S tau the force that drives it,
//! G = Phi22 of A + Phi11 of B, and T'GT = LL',
//!
//! f = f_Q + T L'^-1 (Y_A x - Y_B f2 + y),
//! Y_A = L^-1 T' Phi21 of A,  Y_B = L^-1 T' Phi12 of B,  y = L^-1 T'(b2 of A + c - b1 of B - G f_Q),
//!
//! and the whole has Phi11 -+ Y_A'Y_A (minus; plus for a head), Phi12 = Y_A'Y_B,
//! Phi22 of B - Y_B'Y_B, b1 of A -+ (Y_A'y + Phi12 of A f_Q), b2 of B + Y_B'y + Phi21 of B f_Q.
//!
//! A freedom with inertia E of its own transmits S'f = tau - E qdd, which is a force that does depend on
//! the motion: with t = S (S'S)^-1 a column more of T, tau no part of f_Q, and t'(a1 of B - a2 of A - c)
//! = qdd, it adds 1/E to its entry on the diagonal of T'GT and tau/E to that of L y. Where E is not diagonal, t are
//! its principal axes.

use super::interior::Joint;
use crate::link::Kind;
use vertebra_spatial::matrix6::add_scaled;
use vertebra_spatial::{Mat3, Mat6, Motion, Real, SmallCholesky};

/// A part as seen from its handles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node<T> {
    pub(super) phi11: Mat6<T>,
    pub(super) phi12: Mat6<T>,
    pub(super) phi22: Mat6<T>,
    pub(super) b1: [T; 6],
    pub(super) b2: [T; 6],
}

impl<T: Real> Node<T> {
    pub(super) const ZERO: Self = Self {
        phi11: Mat6::ZERO,
        phi12: Mat6::ZERO,
        phi22: Mat6::ZERO,
        b1: [T::ZERO; 6],
        b2: [T::ZERO; 6],
    };

    /// b1 and b2, in another precision.
    pub(super) fn free<U: Real>(&self) -> [[U; 6]; 2] {
        [self.b1, self.b2].map(|b| b.map(T::cast))
    }

    /// In another precision.
    pub(super) fn cast<U: Real>(&self) -> Node<U> {
        Node {
            phi11: self.phi11.map(T::cast),
            phi12: self.phi12.map(T::cast),
            phi22: self.phi22.map(T::cast),
            b1: self.b1.map(T::cast),
            b2: self.b2.map(T::cast),
        }
    }
}

/// The joint between two parts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seam<T> {
    /// T': a basis of the constraint forces by rows, as many as there are.
    basis: Mat6<T>,
    order: usize,
    /// f_Q, the force along the freedoms.
    drive: [T; 6],
    /// 1/E and tau/E of each row that is such a freedom, else zero.
    held: [[T; 2]; 6],
}

impl<T: Real> Seam<T> {
    pub(super) const RIGID: Self = Self {
        basis: Mat6::IDENTITY,
        order: 6,
        drive: [T::ZERO; 6],
        held: [[T::ZERO; 2]; 6],
    };

    /// A joint whose axes are the columns of `rotation`.
    pub(super) fn new(joint: &Joint<'_, T>, rotation: &Mat3<T>) -> Self {
        let mut seam = Self {
            basis: Mat6::ZERO,
            order: 0,
            drive: [T::ZERO; 6],
            held: [[T::ZERO; 2]; 6],
        };
        // Joints of one freedom have theirs along z.
        let (moments, forces) = match joint.kind {
            Kind::Fixed => (3, 3),
            Kind::Revolute => (2, 3),
            Kind::Prismatic => (3, 2),
            Kind::Screw => (2, 2),
            Kind::Spherical => (0, 3),
            Kind::Free => (0, 0),
        };
        let axes = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
        for (at, count) in [(0, moments), (3, forces)] {
            for axis in axes.into_iter().take(count) {
                seam.basis.0[seam.order][at..at + 3].copy_from_slice(&axis.to_array());
                seam.order += 1;
            }
        }
        // The square of a screw's column is not 1, as it is of others.
        let square = T::ONE + joint.pitch * joint.pitch;
        if joint.kind == Kind::Screw {
            let axis = rotation.z_axis;
            let across = Motion::new(-axis * joint.pitch, axis);
            seam.basis.0[seam.order] = across.to_array();
            seam.order += 1;
        }
        let mut columns = [Motion::ZERO; 6];
        columns[..joint.columns.len()].copy_from_slice(joint.columns);
        let (mut tau, mut own) = (joint.tau, [T::ZERO; 6]);
        own[..joint.columns.len()].copy_from_slice(joint.own.diagonal);
        if joint.kind == Kind::Spherical && !joint.own.is_diagonal() {
            // Any axes do: along the principal ones freedoms hold each by itself.
            for (k, (axis, moment)) in joint.own.principal().into_iter().enumerate() {
                (columns[k], tau[k], own[k]) = (Motion::ZERO, T::ZERO, moment);
                for (l, part) in axis.into_iter().enumerate() {
                    columns[k] += joint.columns[l] * part;
                    tau[k] += joint.tau[l] * part;
                }
            }
        }
        for (k, column) in columns.into_iter().enumerate().take(joint.columns.len()) {
            let direction = (column * (T::ONE / square)).to_array();
            let (tau, own) = (tau[k], own[k]);
            if own == T::ZERO {
                add_scaled(&mut seam.drive, &direction, tau);
            } else {
                seam.basis.0[seam.order] = direction;
                seam.held[seam.order] = [T::ONE / own, tau / own];
                seam.order += 1;
            }
        }
        seam
    }

    /// T'M by rows.
    fn project(&self, m: &Mat6<T>) -> Mat6<T> {
        let mut rows = Mat6::ZERO;
        for (row, t) in rows.0.iter_mut().zip(&self.basis.0).take(self.order) {
            *row = m.transpose_mul(t);
        }
        rows
    }
}

/// What a join keeps for the way down.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joined<T> {
    factor: SmallCholesky<T>,
    inboard: Mat6<T>,
    outboard: Mat6<T>,
    bias: [T; 6],
}

impl<T: Real> Joined<T> {
    pub(super) const NONE: Self = Self {
        factor: SmallCholesky::EMPTY,
        inboard: Mat6::ZERO,
        outboard: Mat6::ZERO,
        bias: [T::ZERO; 6],
    };

    /// Keeps y of the difference L y = T'(b2 of A + c - b1 of B - G f_Q); gives b1 and b2 of the whole,
    /// less what f_Q adds, from `b1` of A and `b2` of B.
    fn bridge(
        &mut self,
        head: bool,
        mut difference: [T; 6],
        mut b1: [T; 6],
        mut b2: [T; 6],
    ) -> ([T; 6], [T; 6]) {
        self.factor.solve_lower(&mut difference);
        let sign = if head { T::ONE } else { -T::ONE };
        for (k, &y) in difference.iter().enumerate().take(self.factor.order()) {
            add_scaled(&mut b1, &self.inboard.0[k], sign * y);
            add_scaled(&mut b2, &self.outboard.0[k], y);
        }
        self.bias = difference;
        (b1, b2)
    }

    /// The same join of parts that answer the same forces with other b, \[b1, b2\] each: gives those of
    /// the whole.
    pub(super) fn rejoin(&mut self, head: bool, a: [[T; 6]; 2], b: [[T; 6]; 2]) -> [[T; 6]; 2] {
        let mut difference = a[1];
        add_scaled(&mut difference, &b[0], -T::ONE);
        let (b1, b2) = self.bridge(head, difference, a[0], b[1]);
        [b1, b2]
    }

    /// The same across a joint, which no force drives from here on and whose velocities add nothing.
    pub(super) fn rejoin_across(
        &mut self,
        head: bool,
        seam: &mut Seam<T>,
        a: [[T; 6]; 2],
        b: [[T; 6]; 2],
    ) -> [[T; 6]; 2] {
        seam.drive = [T::ZERO; 6];
        let mut difference = a[1];
        add_scaled(&mut difference, &b[0], -T::ONE);
        let (b1, b2) = self.bridge(head, seam.basis.mul(&difference), a[0], b[1]);
        [b1, b2]
    }

    /// The force f on the outboard part, given x and f2 at the ends of the whole.
    pub(super) fn force(&self, x: &[T; 6], f2: &[T; 6]) -> [T; 6] {
        let mut f = self.bias;
        let (own, beyond) = (self.inboard.mul(x), self.outboard.mul(f2));
        for ((f, own), beyond) in f.iter_mut().zip(own).zip(beyond) {
            *f = *f + own - beyond;
        }
        self.factor.solve_upper(&mut f);
        f
    }

    /// The same across a joint.
    pub(super) fn force_across(&self, seam: &Seam<T>, x: &[T; 6], f2: &[T; 6]) -> [T; 6] {
        let mut f = seam.drive;
        let constraint = self.force(x, f2);
        for (row, &factor) in seam.basis.0.iter().zip(&constraint).take(seam.order) {
            add_scaled(&mut f, row, factor);
        }
        f
    }
}

/// The two put together rigidly, and what is kept for the way down; `head` says whether the inboard
/// part is a path's head. None if G is not positive definite to working precision.
pub(super) fn join<T: Real>(head: bool, a: &Node<T>, b: &Node<T>) -> Option<(Node<T>, Joined<T>)> {
    let g = sum(&a.phi22, &b.phi11);
    let rows = a.phi12.transpose();
    let mut y = a.b2;
    add_scaled(&mut y, &b.b1, -T::ONE);
    finish(head, a, b, 6, &g, rows, b.phi12, y)
}

/// The two put together at a joint with velocity-product acceleration `c`.
pub(super) fn join_across<T: Real>(
    head: bool,
    a: &Node<T>,
    b: &Node<T>,
    seam: &Seam<T>,
    c: Motion<T>,
) -> Option<(Node<T>, Joined<T>)> {
    let g = sum(&a.phi22, &b.phi11);
    let mut y = a.b2;
    add_scaled(&mut y, &c.to_array(), T::ONE);
    add_scaled(&mut y, &b.b1, -T::ONE);
    add_scaled(&mut y, &g.mul(&seam.drive), -T::ONE);
    let mut projected = Mat6::ZERO;
    let half = seam.project(&g);
    for (row, half) in projected.0.iter_mut().zip(&half.0).take(seam.order) {
        *row = seam.basis.mul(half);
    }
    let mut y = seam.basis.mul(&y);
    for (k, [compliance, drift]) in seam.held.into_iter().enumerate() {
        projected.0[k][k] += compliance;
        y[k] += drift;
    }
    let (mut node, joined) = finish(
        head,
        a,
        b,
        seam.order,
        &projected,
        seam.project(&a.phi12.transpose()),
        seam.project(&b.phi12),
        y,
    )?;
    let sign = if head { T::ONE } else { -T::ONE };
    add_scaled(&mut node.b1, &a.phi12.mul(&seam.drive), sign);
    add_scaled(&mut node.b2, &b.phi12.transpose_mul(&seam.drive), T::ONE);
    Some((node, joined))
}

#[expect(clippy::too_many_arguments, reason = "the terms of one formula")]
fn finish<T: Real>(
    head: bool,
    a: &Node<T>,
    b: &Node<T>,
    order: usize,
    g: &Mat6<T>,
    mut inboard: Mat6<T>,
    mut outboard: Mat6<T>,
    bias: [T; 6],
) -> Option<(Node<T>, Joined<T>)> {
    let factor = SmallCholesky::factor(order, &g.0, &[T::ZERO; 6]).ok()?;
    factor.solve_lower_rows(&mut inboard);
    factor.solve_lower_rows(&mut outboard);
    let mut joined = Joined {
        factor,
        inboard,
        outboard,
        bias: [T::ZERO; 6],
    };
    let (b1, b2) = joined.bridge(head, bias, a.b1, b.b2);
    let sign = if head { T::ONE } else { -T::ONE };
    let mut node = Node {
        phi11: a.phi11,
        phi12: Mat6::ZERO,
        phi22: b.phi22,
        b1,
        b2,
    };
    node.phi11
        .add_transpose_product(order, &inboard, &inboard, sign);
    node.phi12
        .add_transpose_product(order, &inboard, &outboard, T::ONE);
    node.phi22
        .add_transpose_product(order, &outboard, &outboard, -T::ONE);
    Some((node, joined))
}

fn sum<T: Real>(a: &Mat6<T>, b: &Mat6<T>) -> Mat6<T> {
    let mut sum = *a;
    for (row, b) in sum.0.iter_mut().zip(&b.0) {
        add_scaled(row, b, T::ONE);
    }
    sum
}
