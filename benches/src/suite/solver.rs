//! The solvers of forward dynamics, behind one door.

use vertebra::{
    Batch, DcaOptions, DcaWorkspace, Error, Forces, Model, Precision, Residual, Solved,
    SolverOptions, State, Workspace, aba, aba_batch, crba_forward_dynamics, dca, joint_wrenches,
    refine, residual,
};

/// A way to compute forward dynamics.
pub trait Solver: Sync {
    /// Name of the method, as in benchmark rows.
    fn method(&self) -> &'static str;

    /// Precision it works in.
    fn precision(&self) -> Precision;

    /// Whether it goes through the joint-space mass matrix: it then loses up to that matrix's
    /// condition number, which grows up to n^4 on chains, and gives no forces of the bodies.
    fn is_dense(&self) -> bool {
        false
    }

    /// Whether it keeps what the bodies' own equations are made of. The mass matrix knows nothing of
    /// the bodies' forces.
    fn keeps_body_forces(&self) -> bool {
        !self.is_dense()
    }

    /// Joint accelerations [rad/s^2 or m/s^2] of several inputs, one after the other in the same
    /// memory.
    ///
    /// # Errors
    /// As the method's own.
    fn solve_all(&self, model: &Model, inputs: &[(State, Forces)]) -> Result<Vec<Vec<f64>>, Error>;

    /// Joint accelerations [rad/s^2 or m/s^2].
    ///
    /// # Errors
    /// As the method's own.
    fn solve(&self, model: &Model, state: &State, forces: &Forces) -> Result<Vec<f64>, Error> {
        let solved = self.solve_all(model, &[(state.clone(), forces.clone())])?;
        Ok(solved.concat())
    }

    /// Residual of the bodies' own equations; none where the method gives no forces of the bodies.
    ///
    /// # Errors
    /// As the method's own.
    fn residual(
        &self,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<Option<Residual>, Error>;
}

/// Every solver there is on this machine.
#[must_use]
pub fn all() -> Vec<Box<dyn Solver>> {
    vec![
        Box::new(Aba(Precision::F64)),
        Box::new(Aba(Precision::F32)),
        Box::new(Aba(Precision::Reference)),
        Box::new(Dca::new("dca", Precision::F64, Precision::F64)),
        Box::new(Dca::new("dca f64 over", Precision::F64, Precision::F32)),
        Box::new(Dca::new("dca", Precision::F32, Precision::F32)),
        Box::new(Dca::new("dca", Precision::Reference, Precision::Reference)),
        Box::new(Refined::aba("aba+1", 1)),
        Box::new(Refined::dca(
            "dca f32 tree+2",
            Precision::F64,
            Precision::F32,
            2,
        )),
        Box::new(AbaBatch(Precision::F64)),
        Box::new(AbaBatch(Precision::F32)),
        Box::new(Crba),
    ]
}

/// The articulated-body algorithm on the CPU, all inputs side by side.
pub struct AbaBatch(pub Precision);

impl Solver for AbaBatch {
    fn method(&self) -> &'static str {
        "aba-batch"
    }

    fn precision(&self) -> Precision {
        self.0
    }

    fn solve_all(&self, model: &Model, inputs: &[(State, Forces)]) -> Result<Vec<Vec<f64>>, Error> {
        let (states, forces): (Vec<_>, Vec<_>) = inputs.iter().cloned().unzip();
        let mut batch = Batch::new(model, self.0);
        aba_batch(model, &states, &forces, &mut batch)?;
        let items = 0..inputs.len();
        items
            .map(|item| batch.joint_accelerations(item).map(<[f64]>::to_vec))
            .collect()
    }

    /// It keeps joint accelerations alone.
    fn keeps_body_forces(&self) -> bool {
        false
    }

    fn residual(&self, _: &Model, _: &State, _: &Forces) -> Result<Option<Residual>, Error> {
        Ok(None)
    }
}

/// The articulated-body algorithm on the CPU.
pub struct Aba(pub Precision);

impl Solver for Aba {
    fn method(&self) -> &'static str {
        "aba"
    }

    fn precision(&self) -> Precision {
        self.0
    }

    fn solve_all(&self, model: &Model, inputs: &[(State, Forces)]) -> Result<Vec<Vec<f64>>, Error> {
        let mut workspace = Workspace::new(model, self.0);
        let solve = |(state, forces): &(State, Forces)| {
            aba(model, state, forces, &mut workspace).map(<[f64]>::to_vec)
        };
        inputs.iter().map(solve).collect()
    }

    fn residual(
        &self,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<Option<Residual>, Error> {
        let mut workspace = Workspace::new(model, self.0);
        aba(model, state, forces, &mut workspace)?;
        joint_wrenches(&mut workspace)?;
        residual(model, state, forces, &workspace).map(Some)
    }
}

/// Divide and conquer over the assembly tree on the CPU.
pub struct Dca {
    name: &'static str,
    options: DcaOptions,
}

impl Dca {
    /// With the precisions of chunks and tree.
    #[must_use]
    pub fn new(name: &'static str, chunks: Precision, tree: Precision) -> Self {
        Self {
            name,
            options: DcaOptions {
                chunks,
                tree,
                ..DcaOptions::default()
            },
        }
    }
}

impl Solver for Dca {
    fn method(&self) -> &'static str {
        self.name
    }

    fn precision(&self) -> Precision {
        self.options.tree
    }

    fn solve_all(&self, model: &Model, inputs: &[(State, Forces)]) -> Result<Vec<Vec<f64>>, Error> {
        let mut workspace = DcaWorkspace::new(model, &self.options)?;
        let solve = |(state, forces): &(State, Forces)| {
            dca(model, state, forces, &mut workspace).map(<[f64]>::to_vec)
        };
        inputs.iter().map(solve).collect()
    }

    fn residual(
        &self,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<Option<Residual>, Error> {
        let mut workspace = DcaWorkspace::new(model, &self.options)?;
        dca(model, state, forces, &mut workspace)?;
        workspace.compute_joint_wrenches(forces)?;
        residual(model, state, forces, &workspace).map(Some)
    }
}

/// Solutions of either, [refined](refine) so many times.
pub struct Refined {
    name: &'static str,
    /// Options of divide and conquer; none for the articulated-body algorithm in f64.
    tree: Option<DcaOptions>,
    sweeps: usize,
}

impl Refined {
    /// The articulated-body algorithm in f64.
    #[must_use]
    pub const fn aba(name: &'static str, sweeps: usize) -> Self {
        Self {
            name,
            tree: None,
            sweeps,
        }
    }

    /// Divide and conquer with the precisions of chunks and tree.
    #[must_use]
    pub fn dca(name: &'static str, chunks: Precision, tree: Precision, sweeps: usize) -> Self {
        Self {
            name,
            tree: Some(Dca::new(name, chunks, tree).options),
            sweeps,
        }
    }

    /// Refines what has been solved.
    fn refined(&self, forces: &Forces, solved: &mut impl Solved) -> Result<(), Error> {
        (0..self.sweeps).try_for_each(|_| refine(forces, solved).map(|_| ()))
    }
}

impl Solver for Refined {
    fn method(&self) -> &'static str {
        self.name
    }

    /// That of the residuals.
    fn precision(&self) -> Precision {
        self.tree.map_or(Precision::F64, |options| options.chunks)
    }

    fn solve_all(&self, model: &Model, inputs: &[(State, Forces)]) -> Result<Vec<Vec<f64>>, Error> {
        if let Some(options) = &self.tree {
            let mut workspace = DcaWorkspace::new(model, options)?;
            let solve = |(state, forces): &(State, Forces)| {
                dca(model, state, forces, &mut workspace)?;
                self.refined(forces, &mut workspace)?;
                workspace.joint_accelerations().map(<[f64]>::to_vec)
            };
            return inputs.iter().map(solve).collect();
        }
        let mut workspace = Workspace::new(model, Precision::F64);
        let solve = |(state, forces): &(State, Forces)| {
            aba(model, state, forces, &mut workspace)?;
            self.refined(forces, &mut workspace)?;
            workspace.joint_accelerations().map(<[f64]>::to_vec)
        };
        inputs.iter().map(solve).collect()
    }

    fn residual(
        &self,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<Option<Residual>, Error> {
        if let Some(options) = &self.tree {
            let mut workspace = DcaWorkspace::new(model, options)?;
            dca(model, state, forces, &mut workspace)?;
            self.refined(forces, &mut workspace)?;
            workspace.compute_joint_wrenches(forces)?;
            return residual(model, state, forces, &workspace).map(Some);
        }
        let mut workspace = Workspace::new(model, Precision::F64);
        aba(model, state, forces, &mut workspace)?;
        self.refined(forces, &mut workspace)?;
        joint_wrenches(&mut workspace)?;
        residual(model, state, forces, &workspace).map(Some)
    }
}

/// Whatever meets a tolerance, or is refused.
pub struct ToTolerance(pub &'static str, pub f64);

impl Solver for ToTolerance {
    fn method(&self) -> &'static str {
        self.0
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }

    fn keeps_body_forces(&self) -> bool {
        false
    }

    fn solve_all(&self, model: &Model, inputs: &[(State, Forces)]) -> Result<Vec<Vec<f64>>, Error> {
        let options = SolverOptions {
            parallel: false,
            ..SolverOptions::to_tolerance(self.1)
        };
        let mut solver = vertebra::Solver::new(model, &options)?;
        let solve = |(state, forces): &(State, Forces)| {
            let solved = solver.forward_dynamics(model, state, forces);
            solved.map(<[f64]>::to_vec)
        };
        inputs.iter().map(solve).collect()
    }

    fn residual(&self, _: &Model, _: &State, _: &Forces) -> Result<Option<Residual>, Error> {
        Ok(None)
    }
}

/// The composite-rigid-body algorithm and a dense Cholesky factorisation, in f64.
pub struct Crba;

impl Solver for Crba {
    fn method(&self) -> &'static str {
        "crba"
    }

    fn precision(&self) -> Precision {
        Precision::F64
    }

    fn is_dense(&self) -> bool {
        true
    }

    fn solve_all(&self, model: &Model, inputs: &[(State, Forces)]) -> Result<Vec<Vec<f64>>, Error> {
        let mut workspace = Workspace::new(model, Precision::F64);
        let solve = |(state, forces): &(State, Forces)| {
            crba_forward_dynamics(model, state, forces, &mut workspace)
        };
        inputs.iter().map(solve).collect()
    }

    fn residual(&self, _: &Model, _: &State, _: &Forces) -> Result<Option<Residual>, Error> {
        Ok(None)
    }
}
