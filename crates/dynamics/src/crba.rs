//! Composite-rigid-body algorithm: the joint-space mass matrix; and forward dynamics through it.
//!
//! Walker and Orin 1982; RBDA section 6.2. The composite inertia of everything beyond a joint is
//! accelerated by each of the joint's freedoms; the force that takes, F = Ic S, projected on the
//! joints towards the world gives one column: H_jk = S_j' F. Dense: it needs the square of the
//! degrees of freedom in memory and serves as an independent check of ABA.

use crate::forces::body_of_dof;
use crate::workspace::{Sweeps, in_precision};
use crate::{Error, Forces, Workspace, finite_results, rnea};
use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, MatRef, Side};
use vertebra_assembly::{Model, State};
use vertebra_spatial::{ArticulatedInertia, Force, Real};

/// The joint-space mass matrix M, symmetric, shape [`Model::dof_count`] squared, `m[(row, column)]`, in SI.
///
/// # Errors
/// [`Error`] if an input does not fit the model, or the matrix is too large (16 384 freedoms at most).
pub fn crba<'w>(
    model: &Model,
    state: &State,
    workspace: &'w mut Workspace,
) -> Result<MatRef<'w, f64>, Error> {
    workspace.set_state(model, state)?;
    let dofs = model.dof_count();
    reserve_square(&mut workspace.mass_matrix, dofs)?;
    let Workspace {
        scales,
        arrays,
        mass_matrix,
        ..
    } = workspace;
    in_precision!(arrays, s => {
        s.set_composite_inertias();
        // M in SI: a joint force an acceleration.
        s.for_each_mass(|row, column, value| {
            let mass = value * scales.force[row] / scales.acceleration[column];
            mass_matrix[row + column * dofs] = mass;
            mass_matrix[column + row * dofs] = mass;
        });
    });
    let overflowed = workspace.mass_matrix.iter().position(|m| !m.is_finite());
    if let Some(index) = overflowed {
        return Err(Error::Overflow {
            quantity: "mass matrix",
            body: body_of_dof(model, index % dofs),
            time: state.time,
        });
    }
    Ok(MatRef::from_column_major_slice(
        &workspace.mass_matrix,
        dofs,
        dofs,
    ))
}

/// Forward dynamics through the mass matrix: (M + E) qdd = tau - h, E the inertia of the freedoms' own, by Cholesky (faer). O(n^3); the
/// factorisation is in f64 whatever the workspace's precision. Allocates.
///
/// # Errors
/// [`Error`] as [`crba`] and [`rnea`], [`Error::SingularMassMatrix`], and [`Error::LoopsUnavailable`] as
/// [`aba`](crate::aba).
pub fn crba_forward_dynamics(
    model: &Model,
    state: &State,
    forces: &Forces,
    workspace: &mut Workspace,
) -> Result<Vec<f64>, Error> {
    forces.check(model)?;
    workspace.refuse_loops("`crba_forward_dynamics`")?;
    let dofs = model.dof_count();
    let still = vec![0.0; dofs];
    let bias = rnea(model, state, &still, forces, workspace)?;
    let mut right = Mat::from_fn(dofs, 1, |i, _| forces.joint[i] - bias[i]);
    if dofs == 0 {
        return Ok(Vec::new());
    }
    crba(model, state, workspace)?;
    for (row, column, own) in forces.inertias(model) {
        workspace.mass_matrix[row + dofs * column] += own;
    }
    let mass_matrix = MatRef::from_column_major_slice(&workspace.mass_matrix, dofs, dofs);
    let factor = Llt::new(mass_matrix, Side::Lower).map_err(|error| {
        let faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index } = error;
        Error::SingularMassMatrix { dofs, pivot: index }
    })?;
    factor.solve_in_place(right.as_mut());
    let qdd: Vec<f64> = right.col(0).iter().copied().collect();
    finite_results(model, "joint acceleration", &qdd, state.time)?;
    Ok(qdd)
}

/// Order beyond which no dense matrix is made: 2.1 GB.
const DENSE_LIMIT: usize = 1 << 14;

fn reserve_square(matrix: &mut Vec<f64>, dofs: usize) -> Result<(), Error> {
    let too_large = Error::DenseTooLarge {
        dofs,
        limit: DENSE_LIMIT,
    };
    if dofs > DENSE_LIMIT {
        return Err(too_large);
    }
    matrix.clear();
    matrix
        .try_reserve_exact(dofs * dofs)
        .map_err(|_| too_large)?;
    matrix.resize(dofs * dofs, 0.0);
    Ok(())
}

impl<T: Real> Sweeps<T> {
    fn set_composite_inertias(&mut self) {
        for (composite, &inertia) in self.articulated.iter_mut().zip(&self.inertia) {
            *composite = ArticulatedInertia::from(inertia);
        }
        for i in (0..self.links.len()).rev() {
            if let Some(parent) = self.links[i].parent {
                let passed_on = self.articulated[i].shifted_back(self.offset[i]);
                self.articulated[parent] += passed_on;
            }
        }
    }

    /// Calls `entry(row, column, value)` for every pair of freedoms that one chain of joints links,
    /// once a pair, in model units.
    fn for_each_mass(&self, mut entry: impl FnMut(usize, usize, f64)) {
        for i in 0..self.links.len() {
            for column in self.dofs(i) {
                let mut force: Force<T> = self.articulated[i].mul(self.subspace[column]);
                let mut at = i;
                loop {
                    for row in self.dofs(at).filter(|&row| row <= column) {
                        entry(row, column, self.subspace[row].dot(force).to_f64());
                    }
                    let Some(parent) = self.links[at].parent else {
                        break;
                    };
                    force = force.shifted_back(self.offset[at]);
                    at = parent;
                }
            }
        }
    }
}
