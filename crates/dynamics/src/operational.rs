//! Operational-space inertia: what bodies resist with at chosen points.
//!
//! Lambda^-1 = J H^-1 J' (Khatib, IEEE J. Robot. Autom. 3, 1987), without H: the columns of J' go up through
//! the factors of the articulated-body algorithm, y = D^(-1/2) u, and Lambda^-1 = Y' Y is positive semidefinite
//! whatever rounding did (Wensing, Featherstone and Orin, ICRA 2012, discuss the cost: O(n) a column).

use crate::workspace::{in_precision, require};
use crate::{BodyPoint, Error, Workspace};
use faer::linalg::solvers::{DenseSolveCore, Llt};
use faer::{Mat, Side};
use vertebra_spatial::{Force, Real, Vec3};

/// Inverse operational-space inertia at `points` [rad/s^2 or m/s^2 a N m or N]: the accelerations, angular then
/// linear in world axes, point after point, that forces in the same order cause beside those that act. Symmetric,
/// shape 6 points squared; positive semidefinite, and singular where the points cannot move freely. With the
/// factors of the last [`aba`](crate::aba).
///
/// # Errors
/// [`Error::NotComputed`] if [`aba`](crate::aba) has not been called, [`Error::UnknownBody`],
/// [`Error::NonFiniteInput`], [`Error::Overflow`].
pub fn inverse_operational_inertia(
    workspace: &mut Workspace,
    points: &[BodyPoint],
) -> Result<Mat<f64>, Error> {
    require(workspace.computed.accelerations, "factors", "aba")?;
    let mut roots = Mat::<f64>::zeros(workspace.qdd.len(), 6 * points.len());
    for (k, &at) in points.iter().enumerate() {
        let i = workspace.check_point(at)?;
        let length = workspace.model.units().length;
        let path = in_precision!(&workspace.arrays, s => s.path_to(i));
        let dofs: Vec<usize> = path
            .iter()
            .flat_map(|&body| workspace.model.bodies()[body].dof_range())
            .collect();
        let mut row = vec![0.0; dofs.len()];
        for axis in 0..6 {
            let unit = core::array::from_fn(|entry| f64::from(u8::from(entry == axis)));
            in_precision!(&workspace.arrays, s => {
                let point = Vec3::from_glam(at.point / length);
                let mut f = Force::from_array(unit).map(vertebra_spatial::Number::from_f64);
                f = f.shifted_back(s.arm(i, point));
                let mut end = row.len();
                for &body in path.iter().rev() {
                    let columns = &s.subspace[s.dofs(body)];
                    end -= columns.len();
                    for (entry, column) in row[end..].iter_mut().zip(columns) {
                        *entry = Real::to_f64(column.dot(f));
                    }
                    f = f.shifted_back(s.offset[body]);
                }
            });
            workspace.whiten(&path, &mut row);
            for (&dof, &y) in dofs.iter().zip(&row) {
                roots[(dof, 6 * k + axis)] = y;
            }
        }
    }
    let mut inverse = roots.transpose() * &roots;
    let units = workspace.model.units();
    let [turning, sliding] = [1.0 / (units.time * units.time), units.acceleration()];
    let scale =
        |row: usize, [angular, linear]: [f64; 2]| if row % 6 < 3 { angular } else { linear };
    for column in 0..inverse.ncols() {
        for row in 0..inverse.nrows() {
            inverse[(row, column)] *=
                scale(row, [turning, sliding]) / scale(column, [units.energy(), units.force()]);
            if !inverse[(row, column)].is_finite() {
                let body = points[row / 6].body.index();
                workspace.refuse_overflow("operational inertia", Some(body))?;
            }
        }
    }
    Ok(inverse)
}

/// Operational-space inertia at `points` [N m or N a rad/s^2 or m/s^2]: the forces that the accelerations of the
/// points take, as [`inverse_operational_inertia`] orders them.
///
/// # Errors
/// As [`inverse_operational_inertia`]; [`Error::SingularOperationalInertia`] where the points cannot accelerate in
/// every direction: then it does not exist.
pub fn operational_inertia(
    workspace: &mut Workspace,
    points: &[BodyPoint],
) -> Result<Mat<f64>, Error> {
    let inverse = inverse_operational_inertia(workspace, points)?;
    let (order, epsilon) = (inverse.nrows(), workspace.precision().epsilon());
    if order == 0 {
        return Ok(inverse);
    }
    // Scaled to a diagonal of ones, so that radians and metres are alike.
    let roots: Vec<f64> = (0..order).map(|k| inverse[(k, k)].sqrt()).collect();
    let singular = |row: usize| Error::SingularOperationalInertia {
        body: (workspace.model.bodies()[points[row / 6].body.index()])
            .name
            .clone(),
        direction: row % 6,
    };
    if let Some(row) = roots.iter().position(|&root| root == 0.0) {
        return Err(singular(row));
    }
    let scaled = Mat::from_fn(order, order, |i, j| inverse[(i, j)] / (roots[i] * roots[j]));
    let factor = Llt::new(scaled.as_ref(), Side::Lower).map_err(|error| {
        let faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index } = error;
        singular(index)
    })?;
    let rounding = 16.0 * order as f64 * epsilon;
    let lower = factor.L();
    if let Some(row) = (0..order).find(|&k| lower[(k, k)] * lower[(k, k)] <= rounding) {
        return Err(singular(row));
    }
    let inertia = factor.inverse();
    Ok(Mat::from_fn(order, order, |i, j| {
        inertia[(i, j)] / (roots[i] * roots[j])
    }))
}
