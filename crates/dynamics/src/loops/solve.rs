//! The forces of loops: A = Y'Y by its envelope, solved and applied.

use super::Loops;
use crate::Workspace;

impl Loops {
    /// Takes out of lambda what does nothing: the proximal solution of A x = A lambda. Where loops contradict each
    /// other by rounding, each iteration has left some of that there.
    pub(super) fn take_least_norm(&mut self) {
        self.times_matrix();
        self.right.copy_from_slice(&self.change);
        self.multipliers.fill(0.0);
        for _ in 0..4 {
            self.times_matrix();
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
    pub(super) fn times_matrix(&mut self) {
        self.spread.fill(0.0);
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let factor = self.multipliers[row] * self.row_scales[row];
                for (&dof, &y) in constraint
                    .dofs
                    .iter()
                    .zip(constraint.row(row, &self.whitened))
                {
                    self.spread[dof] += factor * y;
                }
            }
        }
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                self.change[row] =
                    self.row_scales[row] * constraint.times(row, &self.whitened, &self.spread);
            }
        }
    }

    /// A + mu 1, scaled, and its factor.
    pub(super) fn factor(&mut self, workspace: &mut Workspace) {
        self.whitened.copy_from_slice(&self.jacobian);
        for constraint in &self.constraints {
            let mut compliance = 0.0_f64;
            for row in constraint.rows.clone() {
                let y = &mut self.whitened[constraint.entries(row)];
                workspace.whiten(&constraint.bodies, y);
                let square: f64 = y.iter().map(|y| y * y).sum();
                let size = constraint.size_of(row);
                compliance = compliance.max(square / (size * size));
            }
            for row in constraint.rows.clone() {
                let size = constraint.size_of(row);
                self.row_scales[row] = if compliance > 0.0 {
                    1.0 / (size * compliance.sqrt())
                } else {
                    0.0
                };
            }
        }
        self.spread.fill(0.0);
        for (index, constraint) in self.constraints.iter().enumerate() {
            for row in constraint.rows.clone() {
                let y = constraint.row(row, &self.whitened);
                for (&dof, &y) in constraint.dofs.iter().zip(y) {
                    self.spread[dof] = y * self.row_scales[row];
                }
                let first = self.matrix.first(row);
                for other in self.constraints[..=index].iter().rev() {
                    if other.rows.end <= first {
                        break;
                    }
                    for column in other.rows.clone().filter(|&column| column <= row) {
                        let product = other.times(column, &self.whitened, &self.spread);
                        self.matrix.row_mut(row)[column - first] =
                            product * self.row_scales[column];
                    }
                }
                self.matrix.row_mut(row)[row - first] += self.proximal;
                for &dof in &constraint.dofs {
                    self.spread[dof] = 0.0;
                }
            }
        }
        self.matrix.factor(0.5 * self.proximal);
    }

    /// lambda = (A + mu 1)^-1 residual into `change`, scaled, and H^-1 J' lambda into `joint`.
    pub(super) fn respond(&mut self, workspace: &mut Workspace) {
        self.change.copy_from_slice(&self.residual);
        self.matrix.solve(&mut self.change);
        self.joint.fill(0.0);
        for constraint in &self.constraints {
            for row in constraint.rows.clone() {
                let force = self.change[row] * self.row_scales[row];
                for (&dof, &entry) in constraint
                    .dofs
                    .iter()
                    .zip(constraint.row(row, &self.jacobian))
                {
                    self.joint[dof] += force * entry;
                }
            }
        }
        workspace.substitute(&mut self.joint);
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
}
