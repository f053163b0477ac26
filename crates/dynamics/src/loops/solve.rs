//! The forces of loops: A = J H^-1 J' by its envelope, solved and applied.

use super::Loops;
use super::constraint::Constraint;
use super::envelope::Envelope;
use crate::residual::worst_of;
use crate::tolerance::Method;

/// Rounding of a product of J with columns of H^-1 J', as a multiple of the epsilon of the factors: mu is no less.
const PRODUCTS: f64 = 64.0;

impl Loops {
    /// A + mu 1, scaled, and its factor.
    pub(super) fn factor(&mut self, method: &mut Method) {
        let proximal = self.multiply(method).max(self.proximal);
        self.scale();
        for row in 0..self.row_scales.len() {
            *self.matrix.diagonal_mut(row) += proximal;
        }
        self.matrix.factor(0.5 * proximal);
        self.factored = proximal;
    }

    /// A, and the least mu that its rounding asks for.
    ///
    /// With the factors of the articulated-body algorithm it is Y'Y, which rounding does not make indefinite; with
    /// those of an assembly tree J times the columns of H^-1 J', in as many rounds as the tree has.
    fn multiply(&mut self, method: &mut Method) -> f64 {
        let (constraints, spread) = (&self.constraints, &mut self.spread);
        match method {
            Method::Aba(workspace) => {
                self.roots.copy_from_slice(&self.jacobian);
                for constraint in constraints {
                    for row in constraint.rows.clone() {
                        let y = &mut self.roots[constraint.entries(row)];
                        workspace.whiten(&constraint.bodies, y);
                    }
                }
                spread.fill(0.0);
                for (index, constraint) in constraints.iter().enumerate() {
                    for row in constraint.rows.clone() {
                        constraint.add(row, &self.roots, 1.0, spread);
                        set_row(
                            &mut self.matrix,
                            &constraints[..=index],
                            row,
                            &self.roots,
                            spread,
                        );
                        for &dof in &constraint.dofs {
                            spread[dof] = 0.0;
                        }
                    }
                }
                0.0
            }
            Method::Dca(workspace) => {
                for (index, constraint) in constraints.iter().enumerate() {
                    for row in constraint.rows.clone() {
                        spread.fill(0.0);
                        constraint.add(row, &self.jacobian, 1.0, spread);
                        workspace.substitute(spread);
                        let before = &constraints[..=index];
                        set_row(&mut self.matrix, before, row, &self.jacobian, spread);
                    }
                }
                PRODUCTS * workspace.options().tree.epsilon()
            }
        }
    }

    /// Scales A and finds by what: lengths by the size of their loop, all of a loop by its largest compliance.
    fn scale(&mut self) {
        for constraint in &self.constraints {
            let mut compliance = 0.0_f64;
            for row in constraint.rows.clone() {
                let size = constraint.size_of(row);
                compliance = worst_of(compliance, *self.matrix.diagonal_mut(row) / (size * size));
            }
            for row in constraint.rows.clone() {
                self.row_scales[row] = if compliance == 0.0 {
                    0.0
                } else if compliance.is_finite() {
                    1.0 / (constraint.size_of(row) * compliance.sqrt())
                } else {
                    // Overflowed: not to be taken for a loop that nothing moves.
                    f64::NAN
                };
            }
        }
        for row in 0..self.row_scales.len() {
            let (first, scale) = (self.matrix.first(row), self.row_scales[row]);
            let entries = self.matrix.row_mut(row);
            for (entry, other) in entries.iter_mut().zip(&self.row_scales[first..]) {
                *entry *= scale * other;
            }
        }
    }

    /// lambda = (A + mu 1)^-1 residual into `change`, scaled, and H^-1 J' lambda into `joint`.
    pub(super) fn respond(&mut self, method: &mut Method) {
        self.change.copy_from_slice(&self.residual);
        self.matrix.solve(&mut self.change);
        self.push(method);
    }

    /// The same with lambda = (A + mu 1)^-1 A (A + mu 1)^-1 residual, for factors of another position: what A does not
    /// see, the J at hand may move, and it is not to be asked for 1 / mu times over.
    pub(super) fn respond_elsewhere(&mut self, method: &mut Method) {
        self.change.copy_from_slice(&self.residual);
        self.matrix.solve(&mut self.change);
        self.right.copy_from_slice(&self.change);
        self.matrix.solve(&mut self.right);
        for (change, &twice) in self.change.iter_mut().zip(&self.right) {
            *change -= self.factored * twice;
        }
        self.push(method);
    }

    /// H^-1 J' `change` into `joint`.
    fn push(&mut self, method: &mut Method) {
        self.joint.fill(0.0);
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let force = self.change[row] * self.row_scales[row];
                constraint.add(row, &self.jacobian, force, &mut self.joint);
            }
        }
        method.substitute(&mut self.joint);
    }

    /// residual -= J joint, scaled.
    pub(super) fn subtract_response(&mut self) {
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let product = constraint.times(row, &self.jacobian, &self.joint);
                self.residual[row] -= product * self.row_scales[row];
            }
        }
    }

    /// Proximal iterations on the residual at hand: adds to lambda and to the accelerations.
    pub(super) fn settle(&mut self, method: &mut Method, iterations: usize) {
        let rounding = f64::EPSILON * super::largest(&self.residual);
        let mut last = f64::INFINITY;
        for _ in 0..iterations {
            let left = super::largest(&self.residual);
            // What has overflowed goes on into the accelerations, which are then refused.
            if left.is_finite() && (left <= rounding || left >= 0.5 * last) {
                break;
            }
            last = left;
            self.respond(method);
            for (sum, &change) in self.multipliers.iter_mut().zip(&self.change) {
                *sum += change;
            }
            for (qdd, &response) in self.qdd.iter_mut().zip(&self.joint) {
                *qdd += response;
            }
            self.subtract_response();
        }
    }

    /// Takes out of lambda what does nothing: the proximal solution of A x = A lambda. Where loops contradict each
    /// other by rounding, each iteration has left some of that there.
    pub(super) fn take_least_norm(&mut self, method: &mut Method) {
        self.times_matrix(method);
        self.right.copy_from_slice(&self.change);
        self.multipliers.fill(0.0);
        for _ in 0..4 {
            self.times_matrix(method);
            for (change, &right) in self.change.iter_mut().zip(&self.right) {
                *change = right - *change;
            }
            self.matrix.solve(&mut self.change);
            for (sum, &change) in self.multipliers.iter_mut().zip(&self.change) {
                *sum += change;
            }
        }
    }

    /// A lambda, scaled, into `change`.
    fn times_matrix(&mut self, method: &mut Method) {
        self.change.copy_from_slice(&self.multipliers);
        self.push(method);
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let product = constraint.times(row, &self.jacobian, &self.joint);
                self.change[row] = product * self.row_scales[row];
            }
        }
    }
}

/// A row of the matrix up to its diagonal: products of the rows of all constraints so far with one that is spread out
/// over all freedoms.
fn set_row(
    matrix: &mut Envelope,
    constraints: &[Constraint],
    row: usize,
    rows: &[f64],
    spread: &[f64],
) {
    let first = matrix.first(row);
    for other in constraints.iter().rev() {
        if other.rows.end <= first {
            break;
        }
        for column in other.rows.clone().filter(|&column| column <= row) {
            matrix.row_mut(row)[column - first] = other.times(column, rows, spread);
        }
    }
}
