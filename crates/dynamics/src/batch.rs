//! Forward dynamics of many states of one model.
//!
//! States of one model run through the same joints in the same order, so several are computed side by
//! side, each in its lane of a vector register ([`Lanes`](vertebra_spatial::Lanes)): what is one addition for [`aba`](crate::aba) is one for
//! four or eight states here. Lanes round as single numbers do, and no lane sees its neighbours: every
//! state gets the bits that [`aba`](crate::aba) gives it alone, whatever stands beside it and however many threads
//! there are.
//!
//! A pack of lanes does not say which of its states a joint refused. It is then computed again, state
//! by state, with [`aba`](crate::aba), whose errors these are. So are all states of a model with closed loops, which
//! each thread solves as a [`Solver`](crate::Solver) does.

use crate::link::Scales;
use crate::loops::Loops;
use crate::tolerance::Method;
use crate::workspace::Sweeps;
use crate::{Error, Forces, Precision, Workspace};
use vertebra_assembly::{Model, State};
use vertebra_spatial::{F32Lanes, F64Lanes, Number, Real};

/// Memory for the forward dynamics of many states of one model, and its results.
///
/// It grows with the largest batch it has seen; then nothing more is allocated.
#[derive(Clone, Debug)]
pub struct Batch {
    model: Model,
    precision: Precision,
    /// One a thread.
    workers: Vec<Worker>,
    /// Joint accelerations of all items, one after the other [rad/s^2 or m/s^2].
    qdd: Vec<f64>,
    /// Why items have none.
    errors: Vec<Option<Error>>,
}

impl Batch {
    /// Takes the memory for one model and precision, to be used by all threads that there are (of the
    /// current rayon pool, with the feature `rayon`).
    #[must_use]
    pub fn new(model: &Model, precision: Precision) -> Self {
        Self::with_threads(model, precision, 0)
    }

    /// The same for so many threads, at most those that there are; 0 means all.
    #[must_use]
    pub fn with_threads(model: &Model, precision: Precision, threads: usize) -> Self {
        Self {
            workers: vec![Worker::new(model, precision); available(threads)],
            qdd: Vec::new(),
            errors: Vec::new(),
            model: model.clone(),
            precision,
        }
    }

    /// The precision it works in.
    #[must_use]
    pub const fn precision(&self) -> Precision {
        self.precision
    }

    /// Number of items of the last [`aba_batch`].
    #[must_use]
    pub fn len(&self) -> usize {
        self.errors.len()
    }

    /// Whether there were none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.errors.is_empty()
    }

    /// Joint accelerations of one item of the last [`aba_batch`] [rad/s^2 or m/s^2], shape
    /// [`Model::dof_count`].
    ///
    /// # Errors
    /// Why this item has none, or [`Error::UnknownItem`].
    pub fn joint_accelerations(&self, item: usize) -> Result<&[f64], Error> {
        match self.errors.get(item) {
            Some(None) => {
                let dofs = self.model.dof_count();
                Ok(&self.qdd[item * dofs..(item + 1) * dofs])
            }
            Some(Some(error)) => Err(error.clone()),
            None => Err(Error::UnknownItem {
                item,
                count: self.errors.len(),
            }),
        }
    }

    /// The items of the last [`aba_batch`] that have no accelerations, in order, and why.
    pub fn failures(&self) -> impl Iterator<Item = (usize, &Error)> {
        let errors = self.errors.iter().enumerate();
        errors.filter_map(|(item, error)| Some((item, error.as_ref()?)))
    }
}

/// [`aba`](crate::aba) for many states of one model: the joint accelerations [rad/s^2 or m/s^2], item by item,
/// shape [items, [`Model::dof_count`]]. `forces` has those of each state.
///
/// # Errors
/// [`Error::BatchLengths`], [`Error::WrongWorkspace`]; [`Error::Item`] with the first item that failed. The others have their accelerations all the same: [`Batch::joint_accelerations`], and
/// [`Batch::failures`] lists those that have none.
///
/// ```
/// use vertebra_assembly::{State, generate};
/// use vertebra_dynamics::{Batch, Forces, Precision, aba_batch};
///
/// let model = generate::random_chain(7, &generate::Rod::default(), 7)?;
/// let states: Vec<_> = (0..1000).map(|seed| State::random(&model, seed)).collect();
/// let forces = vec![Forces::none(&model); states.len()];
///
/// let mut batch = Batch::new(&model, Precision::F64);
/// let qdd = aba_batch(&model, &states, &forces, &mut batch)?;
/// assert_eq!(qdd.len(), 7 * 1000);
/// # Ok::<(), vertebra_dynamics::Error>(())
/// ```
pub fn aba_batch<'b>(
    model: &Model,
    states: &[State],
    forces: &[Forces],
    batch: &'b mut Batch,
) -> Result<&'b [f64], Error> {
    if !batch.model.is_same(model) {
        return Err(Error::WrongWorkspace {
            workspace: batch.model.name().to_owned(),
            model: model.name().to_owned(),
        });
    }
    if states.len() != forces.len() {
        return Err(Error::BatchLengths {
            states: states.len(),
            forces: forces.len(),
        });
    }
    let count = states.len();
    batch.errors.clear();
    batch.errors.resize(count, None);
    batch.qdd.resize(count * model.dof_count(), 0.0);
    let items = Items {
        model,
        states,
        forces,
        qdd: &mut batch.qdd,
        errors: &mut batch.errors,
    };
    share(&mut batch.workers, items);
    let failed = batch.failures().count();
    match batch.failures().next() {
        None => Ok(&batch.qdd),
        Some((item, error)) => Err(Error::Item {
            item,
            failed,
            count,
            source: Box::new(error.clone()),
        }),
    }
}

/// Items that stand side by side, and where their results go.
struct Items<'a> {
    model: &'a Model,
    states: &'a [State],
    forces: &'a [Forces],
    qdd: &'a mut [f64],
    errors: &'a mut [Option<Error>],
}

impl<'a> Items<'a> {
    fn split_at(self, count: usize) -> (Self, Self) {
        let model = self.model;
        let (states, other_states) = self.states.split_at(count);
        let (forces, other_forces) = self.forces.split_at(count);
        let (qdd, other_qdd) = self.qdd.split_at_mut(count * model.dof_count());
        let (errors, other_errors) = self.errors.split_at_mut(count);
        (
            Self {
                model,
                states,
                forces,
                qdd,
                errors,
            },
            Self {
                model,
                states: other_states,
                forces: other_forces,
                qdd: other_qdd,
                errors: other_errors,
            },
        )
    }
}

/// Shares the items out among the workers in halves.
fn share(workers: &mut [Worker], items: Items<'_>) {
    if let [worker] = workers {
        worker.solve(items);
        return;
    }
    let (left, right) = workers.split_at_mut(workers.len() / 2);
    let part = items.states.len() * left.len() / (left.len() + right.len());
    let part = part.next_multiple_of(WIDEST).min(items.states.len());
    let (first, second) = items.split_at(part);
    #[cfg(feature = "rayon")]
    rayon::join(|| share(left, first), || share(right, second));
    #[cfg(not(feature = "rayon"))]
    for (workers, items) in [(left, first), (right, second)] {
        share(workers, items);
    }
}

#[cfg(feature = "rayon")]
fn available(threads: usize) -> usize {
    match threads {
        1 => 1,
        0 => rayon::current_num_threads(),
        _ => threads.min(rayon::current_num_threads()),
    }
}

#[cfg(not(feature = "rayon"))]
fn available(_threads: usize) -> usize {
    1
}

/// Lanes of the widest pack.
const WIDEST: usize = 8;

/// What one thread needs.
#[derive(Clone, Debug)]
struct Worker {
    packs: Packs,
    scales: Scales,
    /// For states that are computed alone: the tree, and what keeps loops closed, if there are any.
    single: Method,
    loops: Option<Box<Loops>>,
}

/// The lanes of a precision.
#[derive(Clone, Debug)]
enum Packs {
    F32(Pack<F32Lanes>),
    F64(Pack<F64Lanes>),
    /// The reference goes state by state, and so do loops.
    None,
}

impl Worker {
    fn new(model: &Model, precision: Precision) -> Self {
        let loops = Loops::of_model(model);
        Self {
            packs: match precision {
                _ if loops.is_some() => Packs::None,
                Precision::F32 => Packs::F32(Pack::new(model)),
                Precision::F64 => Packs::F64(Pack::new(model)),
                Precision::Reference => Packs::None,
            },
            scales: Scales::of_model(model),
            single: Method::Aba(Box::new(Workspace::of_tree(model, precision))),
            loops,
        }
    }

    fn solve(&mut self, mut items: Items<'_>) {
        let lanes = match self.packs {
            Packs::F32(_) => F32Lanes::LANES,
            Packs::F64(_) => F64Lanes::LANES,
            Packs::None => 1,
        };
        while !items.states.is_empty() {
            let count = lanes.min(items.states.len());
            let (mut some, rest) = items.split_at(count);
            items = rest;
            let solved = match &mut self.packs {
                Packs::F32(pack) => pack.solve(&mut some, &self.scales),
                Packs::F64(pack) => pack.solve(&mut some, &self.scales),
                Packs::None => false,
            };
            if !solved {
                self.solve_singly(&mut some);
            }
        }
    }

    fn solve_singly(&mut self, items: &mut Items<'_>) {
        let dofs = items.model.dof_count();
        for (item, error) in items.errors.iter_mut().enumerate() {
            match self.solve_one(items.model, &items.states[item], &items.forces[item]) {
                Ok(qdd) => items.qdd[item * dofs..(item + 1) * dofs].copy_from_slice(qdd),
                Err(reason) => *error = Some(reason),
            }
        }
    }

    fn solve_one(
        &mut self,
        model: &Model,
        state: &State,
        forces: &Forces,
    ) -> Result<&[f64], Error> {
        self.single.solve(model, state, forces)?;
        match &mut self.loops {
            None => self.single.accelerations(),
            Some(loops) => loops.constrain(model, state, &mut self.single),
        }
    }
}

/// Whether the joints of several freedoms have inertia of their own in both or in neither: a pack takes
/// them one way or the other.
fn holds_alike(model: &Model, a: &Forces, b: &Forces) -> bool {
    (a.joint_inertia.is_empty() && b.joint_inertia.is_empty())
        || model.bodies().iter().all(|body| {
            let holds = |forces: &Forces| body.dof_range().any(|dof| forces.inertia(dof) != 0.0);
            body.dof_range().len() < 2 || holds(a) == holds(b)
        })
}

/// States side by side.
#[derive(Clone, Debug)]
struct Pack<T: Number> {
    sweeps: Sweeps<T>,
    /// Positions and rates in SI.
    q: Vec<T::Input>,
    qd: Vec<T::Input>,
}

impl<T: Number> Pack<T> {
    fn new(model: &Model) -> Self {
        Self {
            sweeps: Sweeps::new(model),
            q: vec![T::Input::ZERO; model.position_count()],
            qd: vec![T::Input::ZERO; model.dof_count()],
        }
    }

    /// Solves as many items as there are lanes, or fewer. False if one of them is refused or
    /// overflows; then no result is worth anything.
    fn solve(&mut self, items: &mut Items<'_>, scales: &Scales) -> bool {
        let Items {
            model,
            states,
            forces,
            ..
        } = *items;
        let fits = |(state, forces): (&State, &Forces)| {
            state.check(model).is_ok() && forces.check(model).is_ok()
        };
        if !states.iter().zip(forces).all(fits) {
            return false;
        }
        if !forces
            .iter()
            .all(|other| holds_alike(model, &forces[0], other))
        {
            return false;
        }
        let s = &mut self.sweeps;
        for lane in 0..T::LANES {
            // Lanes to spare repeat the last item.
            let item = lane.min(states.len() - 1);
            let State { q, qd, .. } = &states[item];
            for (packed, &q) in self.q.iter_mut().zip(q) {
                packed.set_lane(lane, q);
            }
            for (packed, &qd) in self.qd.iter_mut().zip(qd) {
                packed.set_lane(lane, qd);
            }
            let given = forces[item].joint.iter().zip(&scales.force);
            for (tau, (&given, &scale)) in s.tau.iter_mut().zip(given) {
                tau.set_lane(lane, T::Scalar::from_f64(given / scale));
            }
            s.set_added(lane, &forces[item], scales);
        }
        s.set_state(&self.q, &self.qd, model.units().length, &scales.rate);
        for (lane, forces) in forces.iter().enumerate() {
            s.add_external(lane, forces, model.units());
        }
        if s.articulate().is_err() {
            return false;
        }
        s.respond();
        // Whatever overflowed on the way down is in the accelerations.
        let mut finite = s.acceleration.iter().all(|a| a.is_finite());
        let dofs = model.dof_count();
        for item in 0..states.len() {
            let qdd = &mut items.qdd[item * dofs..(item + 1) * dofs];
            for (qdd, (u, &scale)) in qdd.iter_mut().zip(s.u.iter().zip(&scales.acceleration)) {
                *qdd = u.lane(item).to_f64() * scale;
                finite &= qdd.is_finite();
            }
        }
        finite
    }
}
