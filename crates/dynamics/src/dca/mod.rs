//! Divide and conquer: forward dynamics in O(log n) rounds, each of which works on all its parts at
//! once.
//!
//! Featherstone 1999 joins bodies two by two at their joints. Here bodies are cut instead of
//! joints: a [`Schedule`] lays the tree out in paths, cuts heavy bodies of each in halves, and
//! gathers what lies between two cuts in a chunk, by the articulated-body recursion ([`interior`]),
//! which no light body upsets. The chunks of a path are joined half to half, rigidly ([`join`]); a
//! finished side branch is raked onto the body that carries it ([`rake`]). So the joins are the same
//! whatever the joints, both their sides are heavy, and they may be done in less precision, of which the error
//! comes in squared ([`meet`]).
//!
//! All vectors are in world axes about the bodies' handle points, accelerations conventional.

mod balance;
mod chunk;
mod correct;
mod halves;
mod interior;
mod join;
mod leaf;
mod meet;
mod place;
pub(crate) mod plan;
mod rake;
mod settle;
mod solution;
mod split;
mod substitute;
mod tree;

#[cfg(feature = "gpu")]
pub(crate) use leaf::has_heavy_end;
pub(crate) use split::PARALLEL_BODIES;

use crate::across::Given;
use crate::balance::{largest_push, least_acceleration};
use crate::link::Scales;
use crate::loops::{first_loop, refuse_looped};
use crate::refine::{Loads, relative};
use crate::residual::worst_of;
use crate::workspace::{require, same_model};
use crate::{BodyForce, Error, Forces, Precision, Refinement, Residual, Solved, finite_results};
use split::Fault;
use tree::Tree;
use vertebra_assembly::schedule::{Schedule, ScheduleOptions};
use vertebra_assembly::{BodyId, Model, State};
use vertebra_spatial::{DoubleDouble, Real};

/// How bodies are gathered on a processor unless one asks otherwise (`docs/accuracy.md`): the longer the
/// chunks, the less work a body, and the fewer joins and side branches are in less precision. But a
/// chunk is a recursion, which in f32 loses the digits by which its masses differ.
fn suited(chunks: Precision) -> ScheduleOptions {
    ScheduleOptions::with_window(match chunks {
        Precision::F32 => 8,
        Precision::F64 | Precision::Reference => 32,
    })
}

/// How an assembly tree is worked through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DcaOptions {
    /// Precision of kinematics and chunks, which decides how well light bodies fare.
    pub chunks: Precision,
    /// Precision of the joins, at most that of the chunks.
    pub tree: Precision,
    /// How bodies are gathered into chunks; none for what suits the precision of the chunks: 8 bodies
    /// each in f32, else 32.
    pub schedule: Option<ScheduleOptions>,
    /// Whether the threads of the current rayon pool are used, for 2048 bodies and more. The result
    /// is the same, bit for bit.
    pub parallel: bool,
}

impl Default for DcaOptions {
    /// Everything in f64, all threads.
    fn default() -> Self {
        Self {
            chunks: Precision::F64,
            tree: Precision::F64,
            schedule: None,
            parallel: true,
        }
    }
}

/// Memory in which [`dca`] works and leaves its results, made for one model. No more is taken later.
#[derive(Clone, Debug)]
pub struct DcaWorkspace {
    model: Model,
    options: DcaOptions,
    scales: Scales,
    trees: Trees,
    qdd: Vec<f64>,
    computed: bool,
    wrenches_computed: bool,
    /// Whether the solution has been corrected, and the drift taken out of the bodies' places.
    corrected: bool,
    settled: bool,
    time: f64,
    q: Vec<f64>,
    qd: Vec<f64>,
    /// The first loop or coupling, if the model has any and is not taken as a tree.
    looped: Option<String>,
}

#[derive(Clone, Debug)]
enum Trees {
    F32(Tree<f32, f32>),
    Mixed(Tree<f64, f32>),
    F64(Tree<f64, f64>),
    Reference(Tree<DoubleDouble, DoubleDouble>),
    ReferenceF32(Tree<DoubleDouble, f32>),
    ReferenceF64(Tree<DoubleDouble, f64>),
}

/// Runs a generic expression on a tree of whichever precisions.
macro_rules! in_tree {
    ($trees:expr, $tree:ident => $body:expr) => {
        match $trees {
            Trees::F32($tree) => $body,
            Trees::Mixed($tree) => $body,
            Trees::F64($tree) => $body,
            Trees::Reference($tree) => $body,
            Trees::ReferenceF32($tree) => $body,
            Trees::ReferenceF64($tree) => $body,
        }
    };
}

impl DcaWorkspace {
    /// Builds the assembly tree of a model and takes the memory.
    ///
    /// # Errors
    /// [`Error::Model`] for a window of zero or above the longest chunk; [`Error::TreePrecision`].
    pub fn new(model: &Model, options: &DcaOptions) -> Result<Self, Error> {
        check_precisions(options.chunks, options.tree)?;
        let weights = plan::weights(model, options.tree.epsilon());
        let bodies = model.bodies();
        let parents: Vec<_> = bodies.iter().map(|body| body.parent).collect();
        let gathering = options.schedule.unwrap_or_else(|| suited(options.chunks));
        let cuts = plan::cut_weights(model, &weights, options.tree.epsilon());
        let schedule = Schedule::of_tree(&parents, &cuts, &gathering)?;
        let trees = match (options.chunks, options.tree) {
            (Precision::F32, _) => Trees::F32(Tree::new(model, schedule, &weights)),
            (Precision::F64, Precision::F32) => Trees::Mixed(Tree::new(model, schedule, &weights)),
            (Precision::F64, _) => Trees::F64(Tree::new(model, schedule, &weights)),
            (Precision::Reference, Precision::F32) => {
                Trees::ReferenceF32(Tree::new(model, schedule, &weights))
            }
            (Precision::Reference, Precision::F64) => {
                Trees::ReferenceF64(Tree::new(model, schedule, &weights))
            }
            (Precision::Reference, Precision::Reference) => {
                Trees::Reference(Tree::new(model, schedule, &weights))
            }
        };
        Ok(Self {
            scales: Scales::of_model(model),
            trees,
            qdd: vec![0.0; model.dof_count()],
            computed: false,
            wrenches_computed: false,
            corrected: false,
            settled: false,
            time: 0.0,
            q: vec![0.0; model.position_count()],
            qd: vec![0.0; model.dof_count()],
            looped: first_loop(model),
            options: *options,
            model: model.clone(),
        })
    }

    /// The same for a model of which only the tree is looked at: [`dca`] leaves its loops open and its coupled joints
    /// free.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of_tree(model: &Model, options: &DcaOptions) -> Result<Self, Error> {
        Ok(Self {
            looped: None,
            ..Self::new(model, options)?
        })
    }

    /// The options it was made with.
    #[must_use]
    pub const fn options(&self) -> &DcaOptions {
        &self.options
    }

    /// The assembly tree and its rounds.
    #[must_use]
    pub fn schedule(&self) -> &Schedule {
        in_tree!(&self.trees, tree => &tree.plan.schedule)
    }

    /// The joint accelerations of the last [`dca`] [rad/s^2 or m/s^2], shape [`Model::dof_count`].
    ///
    /// # Errors
    /// [`Error::NotComputed`].
    pub fn joint_accelerations(&self) -> Result<&[f64], Error> {
        require(self.computed, "accelerations", "dca")?;
        Ok(&self.qdd)
    }

    /// Computes the forces that the joints transmit, from the accelerations of the last [`dca`] with
    /// these forces; [`joint_wrench`](Self::joint_wrench) reads them.
    ///
    /// # Errors
    /// [`Error::NotComputed`], [`Error`] if the forces do not fit the model.
    pub fn compute_joint_wrenches(&mut self, forces: &Forces) -> Result<(), Error> {
        require(self.computed, "accelerations", "dca")?;
        forces.check(&self.model)?;
        if !self.wrenches_computed {
            let threads = self.options.parallel;
            in_tree!(&mut self.trees, tree => tree.transmit((forces, &self.scales), threads));
            self.wrenches_computed = true;
        }
        Ok(())
    }

    /// Force that a body's joint transmits to it, constraint and joint force together, in world
    /// axes about the joint's origin: moment [N m], force \[N\].
    ///
    /// # Errors
    /// [`Error::NotComputed`], [`Error::UnknownBody`], [`Error::Overflow`].
    pub fn joint_wrench(&self, body: BodyId) -> Result<BodyForce, Error> {
        let what = ("joint wrenches", "compute_joint_wrenches");
        require(self.wrenches_computed, what.0, what.1)?;
        let name = self.known(body)?;
        let force = in_tree!(&self.trees, tree => tree.wrench(body.index()).map(Real::to_f64));
        BodyForce::in_si(force, self.model.units()).ok_or_else(|| Error::Overflow {
            quantity: "joint force",
            body: name.to_owned(),
            time: self.time,
        })
    }

    /// A fault, with the names of those concerned.
    fn named(&self, fault: Fault) -> Error {
        let slot = fault.slot();
        let body = in_tree!(&self.trees, tree => tree.plan.bodies[slot]);
        let body = self.model.bodies()[body as usize].name.clone();
        match fault {
            Fault::Singular(_) => Error::SingularJoint { body },
            Fault::Unjoined(_) => Error::Unjoined {
                body,
                precision: self.options.tree,
            },
            Fault::Overflow(_) => Error::Overflow {
                quantity: "acceleration",
                body,
                time: self.time,
            },
        }
    }

    fn check_model(&self, model: &Model) -> Result<(), Error> {
        same_model(&self.model, model)
    }

    /// The name of a body of the model.
    fn known(&self, body: BodyId) -> Result<&str, Error> {
        let known = self.model.body(body).ok_or_else(|| Error::UnknownBody {
            model: self.model.name().to_owned(),
            body: body.index(),
        })?;
        Ok(&known.name)
    }
}

impl crate::residual::sealed::Sealed for DcaWorkspace {}

impl Solved for DcaWorkspace {
    fn residual(&self, model: &Model, state: &State, forces: &Forces) -> Result<Residual, Error> {
        self.check_model(model)?;
        self.joint_accelerations()?;
        self.joint_wrench(model.last_body())?;
        in_tree!(&self.trees, tree => {
            tree.solution().residual(model, state, forces, &self.scales)
        })
    }

    fn refine(&mut self, forces: &Forces) -> Result<Refinement, Error> {
        let loads = Loads::of_correction(self.corrected);
        self.correct(forces, loads)
    }
}

impl DcaWorkspace {
    /// Replaces joint forces by the accelerations H^-1 tau that they cause, both in the model's units, with the factors
    /// of the last [`dca`]; not numbers where they overflow.
    pub(crate) fn substitute(&mut self, values: &mut [f64]) {
        let threads = self.options.parallel;
        in_tree!(&mut self.trees, tree => tree.substitute(values, threads));
    }

    /// Corrects the solution once, or finds the response to other loads.
    pub(crate) fn correct(&mut self, forces: &Forces, loads: Loads) -> Result<Refinement, Error> {
        require(self.computed, "accelerations", "dca")?;
        forces.check(&self.model)?;
        let (threads, scales) = (self.options.parallel, &self.scales);
        self.computed = false;
        self.wrenches_computed = false;
        // Once settled, accelerations match inside the chunks again.
        let settles = loads == Loads::Settled && !self.settled;
        let loads = match loads {
            Loads::Settled if self.settled => Loads::Left,
            loads => loads,
        };
        let push = largest_push(&self.model, forces);
        let least = least_acceleration(&self.model, scales, &self.qd, push);
        let given = Given {
            q: &self.q,
            qd: &self.qd,
            rate_scales: &scales.rate,
            length: self.model.units().length,
        };
        let refined = in_tree!(&mut self.trees, tree => {
            tree.prepare_to_settle(&self.model);
            if settles {
                tree.settle(self.model.units(), &given, forces, threads);
            }
            tree.correct(loads, (forces, scales), threads).map(|residual| Refinement {
                residual,
                change: tree.read_change(&mut self.qdd, &scales.acceleration, least),
            })
        });
        let refined = refined.map_err(|fault| self.named(fault))?;
        finite_results(&self.model, "joint acceleration", &self.qdd, self.time)?;
        self.computed = true;
        self.corrected |= loads != Loads::Rounding;
        self.settled |= settles;
        Ok(refined)
    }
}

/// Refuses a tree more precise than its chunks.
pub(crate) fn check_precisions(chunks: Precision, tree: Precision) -> Result<(), Error> {
    if tree.epsilon() >= chunks.epsilon() {
        return Ok(());
    }
    Err(Error::TreePrecision { chunks, tree })
}

/// Forward dynamics by divide and conquer: the joint accelerations [rad/s^2 or m/s^2], shape
/// [`Model::dof_count`].
///
/// # Errors
/// [`Error`] if an input does not fit the model or the workspace, if a joint moves no inertia in this
/// position, if the halves of a body cannot be joined in the precision of the tree, or if the
/// result overflows; [`Error::LoopsUnavailable`] if the model has loops or couplings, unless the workspace is one
/// [of the tree](DcaWorkspace::of_tree).
///
/// ```
/// use vertebra_assembly::{State, generate};
/// use vertebra_dynamics::{DcaOptions, DcaWorkspace, Forces, dca};
///
/// let model = generate::random_chain(1024, &generate::Rod::default(), 7)?;
/// let mut workspace = DcaWorkspace::new(&model, &DcaOptions::default())?;
/// assert_eq!(workspace.schedule().round_count(), 6);
/// let (state, forces) = (State::random(&model, 8), Forces::none(&model));
/// let qdd = dca(&model, &state, &forces, &mut workspace)?;
/// assert_eq!(qdd.len(), 1024);
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
pub fn dca<'w>(
    model: &Model,
    state: &State,
    forces: &Forces,
    workspace: &'w mut DcaWorkspace,
) -> Result<&'w [f64], Error> {
    forces.check(model)?;
    workspace.check_model(model)?;
    refuse_looped(
        workspace.looped.as_ref(),
        "`dca`",
        "use `Simulation` or `Solver`, which do, or leave the loops open knowingly (`DcaWorkspace::of_tree`)",
    )?;
    state.check(model)?;
    workspace.computed = false;
    workspace.wrenches_computed = false;
    workspace.corrected = false;
    workspace.settled = false;
    workspace.time = state.time;
    workspace.q.copy_from_slice(&state.q);
    workspace.qd.copy_from_slice(&state.qd);
    let DcaWorkspace {
        trees,
        scales,
        qdd,
        options,
        ..
    } = workspace;
    let solved = in_tree!(trees, tree => {
        let solved = tree.solve(model, state, forces, scales, options.parallel);
        solved.map(|()| tree.read_accelerations(qdd, &scales.acceleration))
    });
    solved.map_err(|fault| workspace.named(fault))?;
    finite_results(model, "joint acceleration", &workspace.qdd, state.time)?;
    workspace.computed = true;
    Ok(&workspace.qdd)
}

impl<T: Real, L: Real> Tree<T, L> {
    /// [`read_accelerations`](Self::read_accelerations); gives the largest change of one, as part of the
    /// largest, or of `least` if that is larger.
    fn read_change(&self, qdd: &mut [f64], scales: &[f64], least: f64) -> f64 {
        let (mut change, mut largest) = (0.0_f64, least);
        let own = (self.plan.model_dofs.iter()).zip(self.chunks.qdd.iter().zip(self.changes()));
        for (&dof, (own, by)) in own {
            let dof = dof as usize;
            qdd[dof] = own.to_f64() * scales[dof];
            largest = largest.max(qdd[dof].abs());
            change = worst_of(change, by.to_f64().abs() * scales[dof]);
        }
        relative(change, largest)
    }

    /// Joint accelerations in SI and in the model's order.
    fn read_accelerations(&self, qdd: &mut [f64], scales: &[f64]) {
        let own = self.plan.model_dofs.iter().zip(&self.chunks.qdd);
        for (&dof, own) in own {
            let dof = dof as usize;
            qdd[dof] = own.to_f64() * scales[dof];
        }
    }
}
